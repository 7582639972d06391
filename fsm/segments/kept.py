"""What force elements find once and use again: where their blocks are, how they were deformed in the past."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from fsm.kernels.scatter import pair_slots
from fsm.segments.group import Past
from fsm.segments.pattern import BodyPattern

__all__ = ["Deformed", "Kept"]


class Deformed(Protocol):
    """A group of elements between two bodies each."""

    @property
    def bodies(self) -> np.ndarray:
        """(m, 2) int array."""
        ...

    @property
    def geometry(self) -> tuple[np.ndarray, ...]:
        """Arrays that `measure` takes after `bodies`."""
        ...

    @property
    def rest(self) -> np.ndarray:
        """Deformations without a past."""
        ...

    @property
    def measure(self) -> Any:
        """Kernel (poses, rates, bodies, *geometry) -> (deformations, ...)."""
        ...


class Kept:
    """What has been found for the last pattern and for the last past state; both are known by their identity."""

    def __init__(self) -> None:
        self._pattern: BodyPattern | None = None
        self._slots: np.ndarray | None = None
        self._past: np.ndarray | None = None
        self._before: np.ndarray | None = None

    def slots(self, group: Deformed, pattern: BodyPattern) -> np.ndarray:
        """Where the blocks of every element are."""
        if self._slots is None or self._pattern is not pattern:
            self._slots = np.asarray(pair_slots(group.bodies, *pattern.index))
            self._pattern = pattern
        return self._slots

    def before(self, group: Deformed, rates: np.ndarray, past: Past | None) -> tuple[np.ndarray, float]:
        """Deformations in the past, and one over the time since, 1/s; zero without a past."""
        if past is None:
            return group.rest, 0.0
        if self._before is None or self._past is not past.poses:
            self._before = np.asarray(group.measure(past.poses, rates, group.bodies, *group.geometry)[0])
            self._past = past.poses
        return self._before, 1.0 / past.duration
