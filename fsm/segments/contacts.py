"""Contact and friction as a group: a geometry finds, laws push, and what has to be remembered is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fsm.interactions.bristle import carried
from fsm.kernels.scatter import scatter_efforts
from fsm.laws.friction import FrictionLaw
from fsm.laws.normal import NormalLaw
from fsm.segments.contact_geometry import ContactForces, ContactGeometry, Measured, Touching
from fsm.segments.group import Past
from fsm.segments.pattern import BodyPattern
from fsm.system import PairState

__all__ = ["ContactGroup", "FrictionForce", "NormalForce"]

_ONSET = 5e-5
"""Energy stored by an impact at the end of the step in which it began, over that of the impact."""
_AIM = 1 / 3
"""Part of that energy that a step is cut to."""
_STEPS = 30
"""Steps an impact takes at least."""


class NormalForce(NamedTuple):
    """A normal law with its parameters; `exponent` and `speed_floor` (m/s) are those of `fsm.scene.contact.Contact`."""

    law: NormalLaw
    params: np.ndarray
    exponent: float
    speed_floor: float


class FrictionForce(NamedTuple):
    """A friction law with its parameters."""

    law: FrictionLaw
    params: np.ndarray


@dataclass
class _Found:
    """Contacts of one state, with forces; `powers` (2, count), W, once they were asked for."""

    touching: Touching
    depth: np.ndarray
    measured: Measured
    forces: ContactForces
    deflection: np.ndarray
    powers: np.ndarray | None = None


class ContactGroup:
    """Contacts of one geometry.

    What is remembered, by slot: the closing speed at which a contact began, for laws with a restitution; the deflection
    of the bristles and the slip velocity, for friction that sticks; what the geometry remembers. It changes when a step
    is accepted and at no other time, so forces between are functions of the state.

    Parameters
    ----------
    geometry : ContactGeometry
    normal : NormalForce
    friction : FrictionForce or None
    mobility : (n_bodies, 3 or 6) array
        One over masses and moments of inertia; zero for what cannot move.
    n_pairs : int
    """

    def __init__(
        self,
        geometry: ContactGeometry,
        normal: NormalForce,
        friction: FrictionForce | None,
        mobility: np.ndarray,
        n_pairs: int,
    ) -> None:
        self.geometry, self.normal, self.friction = geometry, normal, friction
        self.mobility, self.n_pairs = mobility, n_pairs
        self.evaluations = 0
        slots = len(geometry.share)
        self._onset = np.zeros(slots)
        self._deflection = np.zeros((slots, geometry.slips))
        self._slip = np.zeros((slots, geometry.slips))
        self._time = 0.0
        self._poses: np.ndarray | None = None
        self._last: tuple[np.ndarray, np.ndarray, _Found | None] | None = None

    @property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return self.friction is not None or self.normal.law.rate_dependent(self.normal.params)

    # forces ---------------------------------------------------------------------------------------------------------

    def _contacts(self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None) -> _Found | None:
        """Contacts of a state; asked for the very same arrays again (force, then energy), those of the last time."""
        if self._last is None or self._last[0] is not poses or self._last[1] is not rates:
            self._last = (poses, rates, self._find(t, poses, rates, past))
        return self._last[2]

    def _find(self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None) -> _Found | None:
        geometry = self.geometry
        self.evaluations += 1
        touching = geometry.find(poses, 0.0)
        slot = touching.slot
        if not len(slot):
            return None
        measured = geometry.measure(poses, rates, touching)
        depth, slip = -touching.gap, np.ascontiguousarray(measured.rate[:, 1:])
        normal, slopes = self.normal.law.force(
            depth, -measured.rate[:, 0], self._onset[slot], geometry.share[slot], self.normal.params
        )
        count, slips = slip.shape
        deflection = effort = by_normal = np.zeros((count, slips))
        by_slip = np.zeros((count, slips, slips))
        friction = self.friction
        if friction is not None and friction.law.bristle:
            # a mean velocity is one already
            before = slip if past is not None else self._slip[slot]
            effort, by_slip, by_normal, deflection = friction.law.effort(
                slip, before, normal, self._deflection[slot], max(0.0, t - self._time), friction.params
            )
        elif friction is not None:
            effort, by_slip, by_normal = friction.law.effort(slip, normal, friction.params)
        forces = ContactForces(
            normal,
            np.ascontiguousarray(slopes[:, 0]),
            np.ascontiguousarray(slopes[:, 1]),
            effort,
            by_slip,
            by_normal,
            friction is not None,
        )
        return _Found(touching, depth, measured, forces, deflection)

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: Past | None = None
    ) -> None:
        """See `Group`."""
        found = self._contacts(t, poses, rates, past)
        if found is not None:
            _scatter(found, force)

    def add_linearised(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        pattern: BodyPattern,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        past: Past | None = None,
    ) -> None:
        """See `Group`."""
        found = self._contacts(t, poses, rates, past)
        if found is None:
            return
        _scatter(found, force)
        self.geometry.add_tangent(
            poses, rates, found.touching, found.measured, found.forces, pattern, stiffness, damping
        )

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`; contacts do not know the time."""

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        found = self._contacts(t, poses, rates, past)
        if found is None:
            return {"contact": 0.0}, 0.0, 0.0
        stored = self.normal.law.energy(found.depth, self.geometry.share[found.touching.slot], self.normal.params)
        return {"contact": float(stored.sum())}, float(self._powers(found).sum()), 0.0

    def pair_power(self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None = None) -> np.ndarray:
        """Power that friction and damping of every pair dissipate, (2, n_pairs), W."""
        found = self._contacts(t, poses, rates, past)
        if found is None:
            return np.zeros((2, self.n_pairs))
        return np.stack([self._by_pair(found, power) for power in self._powers(found)])

    def _powers(self, found: _Found) -> np.ndarray:
        """Powers dissipated by the friction of every contact, and by its damping, (2, count), W."""
        if found.powers is None:
            share = self.geometry.share[found.touching.slot]
            still = np.zeros_like(found.depth)
            elastic, _ = self.normal.law.force(found.depth, still, np.ones_like(found.depth), share, self.normal.params)
            rate = found.measured.rate
            friction = (found.forces.effort * rate[:, 1:]).sum(axis=1)
            found.powers = np.stack([friction, (found.forces.normal - elastic) * -rate[:, 0]])
        return found.powers

    def _by_pair(self, found: _Found, values: np.ndarray) -> np.ndarray:
        """Sums over the contacts of every pair, (n_pairs,)."""
        return np.bincount(self.geometry.pair[found.touching.slot], values, self.n_pairs)

    # results --------------------------------------------------------------------------------------------------------

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.geometry.pairs(poses)

    def observe(self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None = None) -> PairState:
        """The pairs as this group has them; gaps are at most the margin."""
        geometry = self.geometry
        gap = np.full(self.n_pairs, geometry.margin)
        near = geometry.find(poses, geometry.margin)
        np.minimum.at(gap, geometry.pair[near.slot], near.gap)
        found = self._contacts(t, poses, rates, past)
        if found is None:
            none = np.zeros(self.n_pairs)
            return PairState(none, gap, none, none, none, none, none)
        normal = found.forces.normal
        speed, effort = (np.sqrt((v**2).sum(axis=1)) for v in (found.measured.rate[:, 1:], found.forces.effort))
        force, carried_by = self._by_pair(found, normal), self._by_pair(found, normal * speed)
        slip = np.divide(carried_by, force, out=np.zeros(self.n_pairs), where=force > 0.0)
        area = self._by_pair(found, geometry.area[found.touching.slot])
        return PairState(
            force, gap, area, self._by_pair(found, effort), slip, *self.pair_power(t, poses, rates, past)
        )

    # memory ---------------------------------------------------------------------------------------------------------

    def commit(self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None = None) -> None:
        """A step was accepted: remember how contacts began, and how far bristles are bent."""
        found = self._contacts(t, poses, rates, past)
        onset = np.zeros_like(self._onset)
        deflection, slip = np.zeros_like(self._deflection), np.zeros_like(self._slip)
        if found is not None:
            slot = found.touching.slot
            # an impact that is pressed on from outside may close faster than it began
            onset[slot] = np.maximum(self._onset[slot], np.maximum(-found.measured.rate[:, 0], self.normal.speed_floor))
            slip[slot] = found.measured.rate[:, 1:]
            deflection[slot] = found.deflection
            if self._poses is not None and self.geometry.slips == 3 and self.friction is not None:
                deflection[slot] = carried(found.deflection, self._poses, poses, found.measured.bodies[:, 0])
        self._onset, self._deflection, self._slip = onset, deflection, slip
        self._time, self._poses = t, poses
        self.geometry.commit(poses)
        self._last = None

    def memory(self) -> np.ndarray:
        """All that is remembered, as one flat array."""
        return np.concatenate(
            [[self._time], self._onset, self._deflection.ravel(), self._slip.ravel(), self.geometry.memory()]
        )

    def restore(self, memory: np.ndarray) -> None:
        """Remember that again; bristles are carried on from the next commit."""
        slots, bent = len(self._onset), self._deflection.size
        parts = np.split(memory, np.cumsum([1, slots, bent, bent]))
        self._time, self._onset = float(parts[0][0]), parts[1].copy()
        self._deflection, self._slip = (part.reshape(slots, -1).copy() for part in parts[2:4])
        self.geometry.restore(parts[4])
        self._poses = None
        self._last = None

    # steps ----------------------------------------------------------------------------------------------------------

    def late(self, t: float, poses: np.ndarray, rates: np.ndarray, step: float) -> float:
        """Part of a step after which its impacts should begin, so that the speed they begin with is known; 1 if they do."""
        found = self._contacts(t, poses, rates, None) if self.normal.law.restitution else None
        if found is None:
            return 1.0
        slot = found.touching.slot
        share = self.geometry.share[slot]
        stored = self.normal.law.energy(found.depth, share, self.normal.params)
        speed = np.abs(found.measured.rate[:, 0])
        kinetic = 0.5 * self._mass(found.measured) * speed**2
        new = (self._onset[slot] == 0.0) & (stored > _ONSET * kinetic) & (speed > self.normal.speed_floor)
        if not new.any():
            return 1.0
        wanted = (_AIM * _ONSET * kinetic[new] / stored[new]) ** (1.0 / (1.0 + self.normal.exponent))
        part = 1.0 - found.depth[new] * (1.0 - wanted) / (speed[new] * step)
        return float(np.clip(part.min(), 0.1, 0.95))

    def longest_step(self, t: float, poses: np.ndarray, rates: np.ndarray) -> float:
        """Longest step that resolves the impacts going on, s: a part of how long they take."""
        found = self._contacts(t, poses, rates, None) if self.normal.law.restitution else None
        if found is None:
            return np.inf
        slot = found.touching.slot
        begun = self._onset[slot] > self.normal.speed_floor
        if not begun.any():
            return np.inf
        speed, share = self._onset[slot][begun], self.geometry.share[slot][begun]
        kinetic = 0.5 * self._mass(found.measured)[begun] * speed**2
        one = self.normal.law.energy(np.ones_like(speed), share, self.normal.params)
        deepest = (kinetic / one) ** (1.0 / (1.0 + self.normal.exponent))
        return float((3.0 * deepest / speed).min() / _STEPS)

    def _mass(self, measured: Measured) -> np.ndarray:
        """What moves along the gap of each contact, as if nothing else held it, kg."""
        mobility = self.mobility[measured.bodies].reshape(len(measured.bodies), -1)
        flexible = (measured.gradient[:, 0] ** 2 * mobility).sum(axis=1)
        return np.asarray(1.0 / np.maximum(flexible, 1e-300))


def _scatter(found: _Found, force: np.ndarray) -> None:
    measured = found.measured
    effort = np.column_stack([-found.forces.normal, found.forces.effort])
    scatter_efforts(measured.bodies, measured.gradient, effort, len(effort), force)
