"""What the iterations of Newton's method show of a tangent that is kept over several of them."""

from __future__ import annotations

import numpy as np

__all__ = ["Secants"]

_CURVED = 0.1
"""Part of a step that the tangent must promise for what came of it, for it to be learnt from."""


class Secants:
    """Broyden's good updates of the inverse of a tangent that is kept over several iterations.

    Parameters
    ----------
    weight : (n,) array
        Of the square of each increment.
    """

    def __init__(self, weight: np.ndarray) -> None:
        self._weight = weight
        self._pairs: list[tuple[np.ndarray, np.ndarray]] = []
        self._last: tuple[np.ndarray, np.ndarray] | None = None

    def clear(self) -> None:
        """Forget all: the tangent is new."""
        self._pairs.clear()
        self._last = None

    def improved(self, dx: np.ndarray) -> np.ndarray:
        """A correction by the tangent, improved by what the iterations since then have shown."""
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

    def tell(self, way: np.ndarray, whole: np.ndarray) -> None:
        """How far an iteration went, of the whole correction."""
        self._last = way, whole
