"""Detection of impacts among contacts, and steps that resolve them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.segments.contact_geometry import ActiveContacts, ContactGeometry, ContactKinematics
from fsm.segments.contact_memory import ContactMemory
from fsm.segments.normal_force import NormalForce

__all__ = ["Impacts"]

_STEPS, _FEWER_STEPS = 90, 30
"""Approximate minimum number of steps in an impact: for laws with a coefficient of restitution, and without."""
_FIRST_STEP = 0.006
"""Length of the first step of an impact after its onset, relative to the duration of the impact."""
_LEAD_TIME = 0.003
"""Time between the end of the preceding step and the onset of the impact, relative to the duration of the impact."""
_SPEED_CHANGE = 3e-4
"""Limit of the change of speed in the first step of an impact, relative to its initial speed."""
_ENERGY_SHARE = 0.1
"""Energy of an impact of a loose body, relative to the total kinetic energy, above which steps resolve it for any law."""
_REST_TIME = 10.0
"""Time after which a contact counts as resting, relative to the duration of its undamped impact."""
_CORNER_WEIGHT = 0.02
"""Approximate weight of a corner in its face."""
_IMPACT_SPEED = 3.0
"""Closing speed, relative to the speed floor of its law, above which a contact is an impact."""


@dataclass(frozen=True)
class Impacts:
    """Impacts among the contacts of one geometry.

    Attributes
    ----------
    geometry : ContactGeometry
    normal : NormalForce
    mobility : (n_bodies, 3 or 6) array
        Inverse masses and moments of inertia; zero for fixed degrees of freedom.
    loose : (n_bodies,) bool array
        Bodies that can move and have no force element.
    coarse : -
        Factor of the steps within an impact, for a comparison with a less exact solution.
    """

    geometry: ContactGeometry
    normal: NormalForce
    mobility: np.ndarray
    loose: np.ndarray
    coarse: float = 1.0

    @property
    def resolved(self) -> bool:
        """Whether steps have to resolve any impacts."""
        return self.normal.law.restitution or bool(self.loose.any())

    def fraction_before(
        self,
        touching: ActiveContacts,
        measured: ContactKinematics,
        normal: np.ndarray,
        new: np.ndarray,
        rates_before: np.ndarray,
        step: float,
    ) -> float:
        """Fraction of a step that ends before its impacts begin; 1 without impacts or if they begin gently.

        A restitution law depends on the closing speed at the onset of the impact. A long step would falsify this speed.

        Parameters
        ----------
        touching, measured : contacts at the end of the step
        normal : (count,) array, N
        new : (count,) bool array
            Contacts that did not exist at the start of the step.
        rates_before : (n_bodies, 3 or 6) array
            Rates at the start of the step.
        step : s
        """
        slot = touching.slot
        before = rates_before[measured.bodies].reshape(len(slot), -1)
        start, end = -(measured.gradient[:, 0] * before).sum(axis=1), -measured.rate[:, 0]
        mass = self._mass(measured)
        # a contact that opens without force at the end of the step had its whole impact within the step
        speed_change = np.where(normal > 0.0, normal * step / mass, start - end)
        speed = np.maximum(start, end + speed_change)  # end + speed_change estimates the speed without the contact
        new = new & self._to_resolve(measured.bodies, mass, speed, rates_before) & (speed_change > _SPEED_CHANGE * speed)
        if not new.any():
            return 1.0
        start, end, speed_change, speed = start[new], end[new], speed_change[new], speed[new]
        # the speeds at both ends give the closed distance, and hence the initial gap
        gap = np.maximum(0.0, 0.5 * (start + end) * step + touching.gap[new])
        slowing = np.sqrt(np.maximum(0.0, start**2 + 2.0 * gap * (end + speed_change - start) / step))
        begins = 2.0 * gap / np.maximum(start + slowing, 1e-300)
        duration = self._durations(mass[new], speed, self.geometry.share[slot][new])
        return float(np.clip((begins - _LEAD_TIME * duration).min() / step, 0.05, 0.9))

    def longest_step(
        self, t: float, near: ActiveContacts, measured: ContactKinematics, kept: ContactMemory, rates: np.ndarray
    ) -> float:
        """Longest step that resolves present and imminent impacts among nearby slots, s."""
        onset, closing = kept.onset, -measured.rate[:, 0]
        begun = onset > 0.0
        speed = np.where(begun, onset, closing)
        mass = self._mass(measured)
        counts = self._to_resolve(measured.bodies, mass, speed, rates)
        if not counts.any():
            return np.inf
        mass, share = mass[counts], self.geometry.share[near.slot][counts]
        duration, begun = self._durations(mass, speed[counts], share), begun[counts]
        begins = np.maximum(near.gap[counts], 0.0) / speed[counts]
        lead, first = _LEAD_TIME * duration, _FIRST_STEP * duration
        before = np.where(begins > 2.0 * lead, begins - lead, begins + first)
        rests = begun & (t - kept.began[counts] > _REST_TIME * duration)
        steps = (_STEPS if self.normal.law.restitution else _FEWER_STEPS) / self.coarse
        return float(np.where(rests, np.inf, np.where(begun, duration / steps, before)).min())

    def young(self, age: np.ndarray, measured: ContactKinematics, onset: np.ndarray) -> np.ndarray:
        """Mask (count,) of contacts that may still be impacts, by their age (s) and initial closing speed (m/s)."""
        moves = self.mobility[measured.bodies].reshape(len(age), -1).any(axis=1)
        duration = self._durations(np.where(moves, self._mass(measured), 0.0), onset, np.full(len(age), _CORNER_WEIGHT))
        return np.asarray((onset > _IMPACT_SPEED * self.normal.speed_floor) & (age <= _REST_TIME * duration))

    def _to_resolve(self, bodies: np.ndarray, mass: np.ndarray, speed: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Mask of the contacts that are impacts which steps have to resolve.

        With a restitution law these are all contacts that close fast enough. Otherwise they are contacts of loose bodies
        with a considerable part of the total kinetic energy. Segments with force elements yield when they are hit.
        """
        fast = speed > _IMPACT_SPEED * self.normal.speed_floor
        if self.normal.law.restitution:
            return fast
        fast &= self.loose[bodies].any(axis=1)
        if not fast.any():
            return fast
        moving = self.mobility > 0.0
        kinetic = 0.5 * float((rates[moving] ** 2 / self.mobility[moving]).sum())
        return np.asarray(fast & (0.5 * mass * speed**2 > _ENERGY_SHARE * kinetic))

    def _durations(self, mass: np.ndarray, speed: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Duration of undamped impacts, s: about 2.94 (Hertz) or 3.14 (linear) times depth over speed."""
        # at least two points of a face touch together, except at a corner
        shared = np.minimum(1.0, 2.0 * share)
        one = self.normal.law.energy(np.ones_like(speed), shared, self.normal.params)
        deepest = (0.5 * mass * speed**2 / one) ** (1.0 / (1.0 + self.normal.exponent))
        return np.asarray(3.0 * deepest / speed)

    def _mass(self, measured: ContactKinematics) -> np.ndarray:
        """Effective mass along the gap of each contact, other connections neglected, kg."""
        mobility = self.mobility[measured.bodies].reshape(len(measured.bodies), -1)
        flexible = (measured.gradient[:, 0] ** 2 * mobility).sum(axis=1)
        return np.asarray(1.0 / np.maximum(flexible, 1e-300))
