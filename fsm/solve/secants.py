"""Broyden updates of a tangent that is reused in several Newton iterations."""

from __future__ import annotations

import numpy as np

__all__ = ["Secants"]

_CURVED = 0.1
"""Smallest ratio of the predicted change to a correction for which an update is made."""


class Secants:
    """Broyden's good updates of the inverse of a tangent that is reused in several iterations.

    Parameters
    ----------
    weight : (n,) array
        Weight of the square of each increment.
    """

    def __init__(self, weight: np.ndarray) -> None:
        self._weight = weight
        self._pairs: list[tuple[np.ndarray, np.ndarray]] = []
        self._last: tuple[np.ndarray, np.ndarray] | None = None

    def clear(self) -> None:
        """Remove all updates, after a new tangent."""
        self._pairs.clear()
        self._last = None

    def improved(self, dx: np.ndarray) -> np.ndarray:
        """Correction by the tangent, with the updates of the iterations since then."""
        for weighted, more in self._pairs:
            dx = dx + float(weighted @ dx) * more
        if self._last is not None:
            way, whole = self._last
            weighted, promised = self._weight * way, whole - dx
            along, length = float(weighted @ promised), float(weighted @ way)
            if along > _CURVED * length:
                more = (way - promised) / along
                self._pairs.append((weighted, more))
                dx = dx + float(weighted @ dx) * more
        return dx

    def add(self, way: np.ndarray, whole: np.ndarray) -> None:
        """Store the applied part `way` of a correction and the whole correction."""
        self._last = way, whole
