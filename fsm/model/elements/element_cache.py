"""Group of elements that each join two bodies, with a cache of matrix positions and past deformations."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from fsm.kernels.scatter import pair_slots
from fsm.model.bodies.group import Group, PreviousPoses
from fsm.model.bodies.pattern import BodyPattern


class ElementCache:
    """Results for the last pattern and the last previous state; both are compared by identity."""

    def __init__(self) -> None:
        self.pattern: BodyPattern | None = None
        self.slots = np.zeros((0, 4), dtype=np.int64)
        self.past: np.ndarray | None = None
        self.before = np.zeros(0)


class TwoBodyGroup(Group):
    """Elements that each join two bodies.

    Attributes
    ----------
    bodies : (m, 2) int array
    geometry : arguments of the kernels after `bodies`
    rest : (m,) or (m, 3 or 6) array
        Deformations for use without a past state.
    """

    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray

    @property
    @abstractmethod
    def measure(self) -> Callable[..., Any]:
        """Kernel (poses, rates, bodies, *geometry) -> (deformations, ...)."""

    @cached_property
    def _cache(self) -> ElementCache:
        return ElementCache()

    def _slots(self, pattern: BodyPattern) -> np.ndarray:
        """Positions of the matrix blocks of every element."""
        cache = self._cache
        if cache.pattern is not pattern:
            cache.slots, cache.pattern = np.asarray(pair_slots(self.bodies, *pattern.index)), pattern
        return cache.slots

    def _before(self, rates: np.ndarray, past: PreviousPoses | None) -> tuple[np.ndarray, float]:
        """Previous deformations and the inverse of the elapsed time, 1/s; zero without a past state or dampers."""
        if past is None or not self.rate_dependent:
            return self.rest, 0.0
        cache = self._cache
        if cache.past is not past.poses:
            cache.before = np.asarray(self.measure(past.poses, rates, self.bodies, *self.geometry)[0])
            cache.past = past.poses
        return cache.before, 1.0 / past.duration

    def deformations_before(self, rates: np.ndarray, past: PreviousPoses | None) -> np.ndarray:
        """Deformations at a past state; without a past state, deformations at rest."""
        return self._before(rates, past)[0]

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.bodies, 0
