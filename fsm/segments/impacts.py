"""Which contacts are impacts, and the steps that resolve them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.segments.contact_geometry import ContactGeometry, Measured, Touching
from fsm.segments.contact_memory import Remembered
from fsm.segments.normal_force import NormalForce

__all__ = ["Impacts"]

_STEPS, _FEWER_STEPS = 90, 30
"""Steps that an impact takes at least, about: where the law promises a restitution, and where it does not."""
_FIRST = 0.006
"""Length of the step in which an impact begins, over that of the impact, counted from its beginning."""
_BEFORE = 0.003
"""The step before ends so long before it, over its length."""
_JOLT = 3e-4
"""Change of speed by an impact in the step in which it begins, over its speed, that is too much."""
_HEAVY = 0.1
"""Energy of an impact of a loose body that is resolved with any law, over all kinetic energy."""
_LASTING = 10.0
"""Time after which a contact rests, over the length of its impact without damping."""
_LEAST = 0.02
"""Share of a face that a corner has, about."""
_IMPACT = 3.0
"""Closing speed from which on a contact is an impact, over the floor of speeds of its law."""


@dataclass(frozen=True)
class Impacts:
    """Impacts among the contacts of one geometry.

    Attributes
    ----------
    geometry : ContactGeometry
    normal : NormalForce
    mobility : (n_bodies, 3 or 6) array
        One over masses and moments of inertia; zero for what cannot move.
    loose : (n_bodies,) bool array
        Bodies that can move and that no force element holds.
    """

    geometry: ContactGeometry
    normal: NormalForce
    mobility: np.ndarray
    loose: np.ndarray

    @property
    def resolved(self) -> bool:
        """Whether steps have to resolve any."""
        return self.normal.law.restitution or bool(self.loose.any())

    def late(
        self,
        touching: Touching,
        measured: Measured,
        normal: np.ndarray,
        new: np.ndarray,
        rates_before: np.ndarray,
        step: float,
    ) -> float:
        """Part of a step that ends before its impacts begin; 1 if they begin gently, or none does.

        A law of restitution needs to know the speed with which an impact begins, and a long step blurs it.

        Parameters
        ----------
        touching, measured : contacts at the end of the step
        normal : (count,) array, N
        new : (count,) bool array
            Contacts that there were not when it began.
        rates_before : (n_bodies, 3 or 6) array
            When it began.
        step : s
        """
        slot = touching.slot
        before = rates_before[measured.bodies].reshape(len(slot), -1)
        start, end = -(measured.gradient[:, 0] * before).sum(axis=1), -measured.rate[:, 0]
        mass = self._mass(measured)
        # what parts without a force at the end of the step has had all of its impact within it
        jolt = np.where(normal > 0.0, normal * step / mass, start - end)
        speed = np.maximum(start, end + jolt)  # the second is about that of a step without the contact
        new = new & self._count(measured.bodies, mass, speed, rates_before) & (jolt > _JOLT * speed)
        if not new.any():
            return 1.0
        start, end, jolt, speed = start[new], end[new], jolt[new], speed[new]
        # the way that was closed, by the speeds at both ends, tells how wide the gap was
        gap = np.maximum(0.0, 0.5 * (start + end) * step + touching.gap[new])
        slowing = np.sqrt(np.maximum(0.0, start**2 + 2.0 * gap * (end + jolt - start) / step))
        begins = 2.0 * gap / np.maximum(start + slowing, 1e-300)
        lasts = self._last(mass[new], speed, self.geometry.share[slot][new])
        return float(np.clip((begins - _BEFORE * lasts).min() / step, 0.05, 0.9))

    def longest_step(
        self, t: float, near: Touching, measured: Measured, kept: Remembered, rates: np.ndarray
    ) -> float:
        """Longest step that resolves the impacts that go on or are about to begin among what is near, s."""
        onset, closing = kept.onset, -measured.rate[:, 0]
        begun = onset > 0.0
        speed = np.where(begun, onset, closing)
        mass = self._mass(measured)
        counts = self._count(measured.bodies, mass, speed, rates)
        if not counts.any():
            return np.inf
        mass, share = mass[counts], self.geometry.share[near.slot][counts]
        lasts, begun = self._last(mass, speed[counts], share), begun[counts]
        begins = np.maximum(near.gap[counts], 0.0) / speed[counts]
        before = np.where(begins > 2.0 * _BEFORE * lasts, begins - _BEFORE * lasts, begins + _FIRST * lasts)
        rests = begun & (t - kept.began[counts] > _LASTING * lasts)
        steps = _STEPS if self.normal.law.restitution else _FEWER_STEPS
        return float(np.where(rests, np.inf, np.where(begun, lasts / steps, before)).min())

    def young(self, age: np.ndarray, measured: Measured, onset: np.ndarray) -> np.ndarray:
        """Which contacts (count,) may still be impacts, by their age, s, and the closing speed they began with, m/s."""
        moves = self.mobility[measured.bodies].reshape(len(age), -1).any(axis=1)
        lasts = self._last(np.where(moves, self._mass(measured), 0.0), onset, np.full(len(age), _LEAST))
        return np.asarray((onset > _IMPACT * self.normal.speed_floor) & (age <= _LASTING * lasts))

    def _count(self, bodies: np.ndarray, mass: np.ndarray, speed: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Which contacts are impacts that steps have to resolve.

        All that are fast enough, if the law promises a restitution; else those of loose bodies with a good part of all the
        kinetic energy. Segments that others hold give way as soon as they are hit.
        """
        fast = speed > _IMPACT * self.normal.speed_floor
        if self.normal.law.restitution:
            return fast
        fast &= self.loose[bodies].any(axis=1)
        if not fast.any():
            return fast
        moving = self.mobility > 0.0
        kinetic = 0.5 * float((rates[moving] ** 2 / self.mobility[moving]).sum())
        return np.asarray(fast & (0.5 * mass * speed**2 > _HEAVY * kinetic))

    def _last(self, mass: np.ndarray, speed: np.ndarray, share: np.ndarray) -> np.ndarray:
        """How long impacts last without their damping, s: 2.94 (Hertz) or 3.14 (linear) depths over the speed, about."""
        # of the points of a face two touch together at least, but for a corner
        shared = np.minimum(1.0, 2.0 * share)
        one = self.normal.law.energy(np.ones_like(speed), shared, self.normal.params)
        deepest = (0.5 * mass * speed**2 / one) ** (1.0 / (1.0 + self.normal.exponent))
        return np.asarray(3.0 * deepest / speed)

    def _mass(self, measured: Measured) -> np.ndarray:
        """What moves along the gap of each contact, as if nothing else held it, kg."""
        mobility = self.mobility[measured.bodies].reshape(len(measured.bodies), -1)
        flexible = (measured.gradient[:, 0] ** 2 * mobility).sum(axis=1)
        return np.asarray(1.0 / np.maximum(flexible, 1e-300))
