"""Set of all contact groups of a scene: memory, step control and results."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from fsm.model.bodies.group import BodyState
from fsm.model.contact.contacts import ContactGroup
from fsm.solve.interface.records import PairState, StepRejection
from fsm.text.shown_units import shown


class ContactSet(tuple[ContactGroup, ...]):
    """Contact groups of a scene; may be empty."""

    __slots__ = ()

    # memory ---------------------------------------------------------------------------------------------------------

    def commit(self, at: BodyState) -> None:
        """Update the memory of all groups after an accepted step."""
        for group in self:
            group.commit(at)

    def memory(self) -> np.ndarray:
        """Memory of all groups, each preceded by its length."""
        parts = [group.memory() for group in self]
        return np.concatenate([array for part in parts for array in ([float(len(part))], part)] or [[]])

    def restore(self, memory: np.ndarray) -> None:
        """Restore the memory; an empty array clears it."""
        at = 0
        for group in self:
            end = at + 1 + int(memory[at]) if len(memory) else 0
            group.restore(memory[at + 1 : end])
            at = end

    def counters(self) -> np.ndarray:
        """Numbers of evaluated states and of renewals of the broad phase of every group, flat."""
        return np.array([float(count) for group in self for count in (group.evaluations, group.renewals)])

    def clear_caches(self, counters: np.ndarray) -> None:
        """Clear all caches and continue the counters from `counters`, or from zero if it is empty."""
        counts = counters if len(counters) else np.zeros(2 * len(self))
        for group, (evaluations, renewals) in zip(self, counts.reshape(-1, 2).tolist(), strict=True):
            group.clear_caches(int(evaluations), int(renewals))

    # steps ----------------------------------------------------------------------------------------------------------

    @property
    def resolution(self) -> float:
        """Smallest tolerance of positions that the contact forces require, m."""
        return min((group.resolution for group in self), default=math.inf)

    def touching(self) -> tuple[int, bool]:
        """Number of contacts with a force in the last evaluated state, and whether others of the last linearisation have
        none.
        """
        found = [group.touching() for group in self]
        return sum(count for count, _ in found), any(opened for _, opened in found)

    def rejection(self, at: BodyState, step: float | None, names: tuple[str, ...]) -> StepRejection | None:
        """Reason to reject a step of this length, s, or None. In statics the length is None: impacts are not resolved."""
        for group in self:
            crossed = group.geometry.crossed(at.poses)
            if crossed:
                depth = -float(group.geometry.find(at.poses, 0.0).gap.min(initial=0.0))
                return StepRejection(0.5, f"{names[crossed[0]]} pass through each other (penetration {shown(depth, 'm')})")
        if step is None:
            return None
        part = min((group.fraction_before_impacts(at, step) for group in self), default=1.0)
        return StepRejection(part) if part < 1.0 else None

    @property
    def resolves(self) -> bool:
        """Whether steps have to resolve impacts."""
        return any(group.resolves for group in self)

    def coarsen(self, factor: float) -> None:
        """Multiply the step sizes that resolve impacts by a factor."""
        for group in self:
            group.coarsen(factor)

    def longest_step(self, at: BodyState) -> float:
        """Longest step that resolves the impacts of all groups, s."""
        return min((group.longest_step(at) for group in self), default=math.inf)

    # results --------------------------------------------------------------------------------------------------------

    def observe(self, at: BodyState, pairs: int) -> PairState:
        """State of all contact pairs, combined from all groups."""
        if not self:
            return _no_contact(pairs)
        first, *others = (group.observe(at) for group in self)
        for other in others:
            first = first.joined(other)
        return first

    def pair_power(self, at: BodyState, pairs: int) -> np.ndarray:
        """Power that friction and damping of every pair dissipate, (2, pairs), W."""
        total = np.zeros((2, pairs))
        for group in self:
            total += group.pair_power(at)
        return total

    def stats(self) -> dict[str, int]:
        """Numbers of slots, of evaluated states, and of renewals of the broad phase."""
        return {
            "slots": sum(len(group.geometry.share) for group in self),
            "evaluations": sum(group.evaluations for group in self),
            "renewals": sum(group.renewals for group in self),
        }


@lru_cache(maxsize=64)
def _no_contact(pairs: int) -> PairState:
    """State of pairs without contact; its arrays are shared and read-only."""
    none, far = np.zeros(pairs), np.full(pairs, np.inf)
    none.flags.writeable = far.flags.writeable = False
    return PairState(none, far, none, none, none, none, none)
