"""Cache of force elements: positions of their matrix blocks, and past deformations."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from fsm.kernels.scatter import pair_slots
from fsm.segments.group import PreviousPoses
from fsm.segments.pattern import BodyPattern

__all__ = ["TwoBodyElements", "ElementCache"]


class TwoBodyElements(Protocol):
    """Protocol of a group of elements that each join two bodies."""

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
        """Zero deformations, for use without a past state."""
        ...

    @property
    def measure(self) -> Any:
        """Kernel (poses, rates, bodies, *geometry) -> (deformations, ...)."""
        ...


class ElementCache:
    """Cache for the last pattern and the last past state, which are compared by identity."""

    def __init__(self) -> None:
        self._pattern: BodyPattern | None = None
        self._slots: np.ndarray | None = None
        self._past: np.ndarray | None = None
        self._before: np.ndarray | None = None

    def slots(self, group: TwoBodyElements, pattern: BodyPattern) -> np.ndarray:
        """Positions of the blocks of every element."""
        if self._slots is None or self._pattern is not pattern:
            self._slots = np.asarray(pair_slots(group.bodies, *pattern.index))
            self._pattern = pattern
        return self._slots

    def before(self, group: TwoBodyElements, rates: np.ndarray, past: PreviousPoses | None) -> tuple[np.ndarray, float]:
        """Past deformations and the inverse of the elapsed time, 1/s; zero without a past state."""
        if past is None:
            return group.rest, 0.0
        if self._before is None or self._past is not past.poses:
            self._before = np.asarray(group.measure(past.poses, rates, group.bodies, *group.geometry)[0])
            self._past = past.poses
        return self._before, 1.0 / past.duration
