"""Force curve of a run: drives, contacts and elastic energies at every point that the solver looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fsm.results.film import Floats, Integers

if TYPE_CHECKING:
    from fsm.results.solution import Solution
    from fsm.solve.handed_over import CurvePoint

__all__ = ["MOST_POINTS", "Curve"]

MOST_POINTS = 4000
"""Points that a result file keeps of a curve, about."""


@dataclass(frozen=True)
class Curve:
    """Force curve in the order of time.

    Attributes
    ----------
    travel, force : (n, n_drives) arrays, m, N
    pair_force : (n, n_pairs) array, N       normal force of every contact pair; none in a curve out of a file
    time : (n,) array, s
    path : (n,) array of int
        Even: number of a quasi-static path, times two. Odd: motion between two of them.
    panels, creases : (n,) arrays, J         elastic energy
    """

    travel: Floats
    force: Floats
    pair_force: Floats
    time: Floats
    path: Integers
    panels: Floats
    creases: Floats

    def __len__(self) -> int:
        return len(self.time)

    @classmethod
    def of(cls, solution: Solution) -> Curve:
        """The curve that a solution keeps; of one that keeps none, that of its records."""
        if solution.curve is not None:
            return solution.curve
        energy, path = solution.energy, np.zeros(len(solution), dtype=np.int64)
        fields = solution.travel, solution.force, solution.pair_force, solution.time
        return cls(*fields, path, energy["panels"], energy["creases"])

    @classmethod
    def through(cls, points: Sequence[CurvePoint]) -> Curve:
        """The curve of the points of a solve."""
        return cls(
            np.array([point.drive.travel for point in points]),
            np.array([point.drive.force for point in points]),
            np.array([point.pair_force for point in points]),
            np.array([point.time for point in points]),
            np.array([point.path for point in points], dtype=np.int64),
            np.array([point.panels for point in points]),
            np.array([point.creases for point in points]),
        )

    @property
    def dynamic(self) -> np.ndarray:
        """Which points are of a motion whose inertia or dampers count, (n,) array of bool."""
        return np.asarray(self.path % 2 == 1)

    @property
    def has_quasi_static(self) -> bool:
        """Whether a quasi-static point has moved."""
        return bool(np.any(~self.dynamic & (self.travel[:, 0] > 0.0))) if self.travel.shape[1] else False

    def at(self, points: Any) -> Curve:
        """The curve of some points only, by their numbers or a mask."""
        return Curve(*(values[points] for values in vars(self).values()))

    def thinned(self, most: int = MOST_POINTS) -> Curve:
        """About `most` points at most: the first, the last, ends of paths, and of every bucket its extreme forces."""
        if len(self) <= most:
            return self
        ends = np.flatnonzero(np.diff(self.path))
        keep = {0, len(self) - 1, *ends.tolist(), *(ends + 1).tolist()}
        size = max(2, -(-2 * (1 + self.force.shape[1]) * len(self) // most))
        for start in range(0, len(self), size):
            keep.add(start)
            for part in (self.dynamic[start : start + size], ~self.dynamic[start : start + size]):
                here = start + np.flatnonzero(part)
                if len(here):
                    force = self.force[here]
                    keep.update(here[np.argmax(force, axis=0)].tolist(), here[np.argmin(force, axis=0)].tolist())
        return self.at(sorted(keep))
