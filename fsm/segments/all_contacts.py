"""All contact groups of a scene as one: what they remember, what they object to, what they report."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from fsm.segments.contacts import ContactGroup
from fsm.segments.group import Past
from fsm.system import Objection, PairState

__all__ = ["Contacts"]


class Contacts(tuple[ContactGroup, ...]):
    """The contact groups of a scene; none in most. Poses and rates are of all bodies."""

    __slots__ = ()

    # memory ---------------------------------------------------------------------------------------------------------

    def commit(self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None) -> None:
        """A step was accepted."""
        for group in self:
            group.commit(t, poses, rates, past)

    def memory(self) -> np.ndarray:
        """What all remember, each with its length before it."""
        parts = [group.memory() for group in self]
        return np.concatenate([array for part in parts for array in ([float(len(part))], part)] or [[]])

    def restore(self, memory: np.ndarray) -> None:
        """Remember that again; nothing: forget all."""
        at = 0
        for group in self:
            end = at + 1 + int(memory[at]) if len(memory) else 0
            group.restore(memory[at + 1 : end])
            at = end

    def counted(self) -> np.ndarray:
        """States looked at and renewals of the broad phase of every group, flat."""
        return np.array([float(count) for group in self for count in (group.evaluations, group.renewals)])

    def forget(self, counted: np.ndarray) -> None:
        """Drop what was kept to be faster, and count on from there; nothing: from zero."""
        counts = counted if len(counted) else np.zeros(2 * len(self))
        for group, (evaluations, renewals) in zip(self, counts.reshape(-1, 2).tolist(), strict=True):
            group.forget(int(evaluations), int(renewals))

    # steps ----------------------------------------------------------------------------------------------------------

    @property
    def resolution(self) -> float:
        """Error of positions that the forces of all can bear, m."""
        return min((group.resolution for group in self), default=math.inf)

    def parted(self) -> bool:
        """Whether contacts that pushed where the tangents were taken last do not at the state looked at last."""
        return any(group.parted() for group in self)

    def objection(
        self, t: float, poses: np.ndarray, rates: np.ndarray, step: float | None, names: tuple[str, ...]
    ) -> Objection | None:
        """What stands against a step of that length, s; None in statics, where no impacts are resolved."""
        for group in self:
            crossed = group.geometry.crossed(poses)
            if crossed:
                return Objection(0.5, f"{names[crossed[0]]} pass through each other")
        part = 1.0 if step is None else min((group.late(t, poses, rates, step) for group in self), default=1.0)
        return Objection(part) if part < 1.0 else None

    def longest_step(self, t: float, poses: np.ndarray, rates: np.ndarray) -> float:
        """Longest step that resolves the impacts of all, s."""
        return min((group.longest_step(t, poses, rates) for group in self), default=math.inf)

    # results --------------------------------------------------------------------------------------------------------

    def observe(self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None, pairs: int) -> PairState:
        """The contact pairs, what all groups have of them put together."""
        if not self:
            return _apart(pairs)
        first, *others = (group.observe(t, poses, rates, past) for group in self)
        for other in others:
            first = first.joined(other)
        return first

    def pair_power(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None, pairs: int
    ) -> np.ndarray:
        """Power that friction and damping of every pair dissipate, (2, pairs), W."""
        total = np.zeros((2, pairs))
        for group in self:
            total += group.pair_power(t, poses, rates, past)
        return total

    def stats(self) -> dict[str, int]:
        """Slots, states that they were found in, renewals of the broad phase."""
        return {
            "slots": sum(len(group.geometry.share) for group in self),
            "evaluations": sum(group.evaluations for group in self),
            "renewals": sum(group.renewals for group in self),
        }


@cache
def _apart(pairs: int) -> PairState:
    """Pairs that nothing looks after; shared, not to be changed."""
    none, far = np.zeros(pairs), np.full(pairs, np.inf)
    none.flags.writeable = far.flags.writeable = False
    return PairState(none, far, none, none, none, none, none)
