"""Force curve of a run: drives, contacts and elastic energies at the steps of the solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fsm.results.film import Floats, Integers
from fsm.text.short_repr import ShortRepr

if TYPE_CHECKING:
    from fsm.solve.outcome.run_io import CurvePoint

MAX_POINTS = 4000
"""Approximate number of curve points in a results file, at most."""
START_UP = 0.02
"""Start-up phase as a fraction of the travel; the jerk of a drive causes forces of inertia and dampers there."""
_STORED = 0.5
"""Part of the work of the drives in the start-up of a motion that is stored, above which their force is quasi-static."""


@dataclass(frozen=True, repr=False)
class ForceCurve(ShortRepr):
    """Force curve in the order of time.

    Attributes
    ----------
    travel, force : (n, n_drives) arrays, m, N
    pair_force : (n, n_pairs) array, N
        Normal force of every contact pair; a curve that was read from a file has no pairs.
    time : (n,) array, s
    path : (n,) array of int
        Even: twice the number of a quasi-static path. Odd: motion between two such paths.
    panels, creases : (n,) arrays, J
        Elastic energy of the panels and of the creases.
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
    def from_points(cls, points: Sequence[CurvePoint]) -> ForceCurve:
        """Force curve through the points of a solver."""
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
        """Mask (n,) of the points in motions where inertial or damping forces matter.

        The path tells it for inertial forces. Damping forces matter in the start-up of a run that begins as a motion, where
        dampers take most of the work of the drives.
        """
        moving = self.path % 2 == 1
        stored = self.panels + self.creases
        if len(self) and moving[0] and self.travel.shape[1] and np.ptp(stored) > 0.0:
            steps = 0.5 * (self.force[1:] + self.force[:-1]) * np.diff(self.travel, axis=0)
            work = np.append(0.0, np.cumsum(np.nan_to_num(steps).sum(axis=1)))
            travel = np.abs(self.travel[:, 0])
            start_up = travel < START_UP * travel.max()
            moving = moving | (start_up & (stored - stored[0] < _STORED * work))
        return np.asarray(moving)

    @property
    def has_quasi_static(self) -> bool:
        """Whether any quasi-static point has a positive travel."""
        return bool(np.any(~self.dynamic & (self.travel[:, 0] > 0.0))) if self.travel.shape[1] else False

    def select(self, points: Any) -> ForceCurve:
        """Curve of the points that an index array or a mask selects."""
        return ForceCurve(*(values[points] for values in vars(self).values()))

    def without_pairs(self) -> ForceCurve:
        """Curve as it is stored in a results file, without the forces of contact pairs."""
        return replace(self, pair_force=np.zeros((len(self), 0)))

    def decimate(self, limit: int = MAX_POINTS) -> ForceCurve:
        """Curve of about `limit` points or fewer: both ends, ends of paths, and the extreme forces of each interval."""
        if len(self) <= limit:
            return self
        ends, dynamic = np.flatnonzero(np.diff(self.path)), self.dynamic
        keep = {0, len(self) - 1, *ends.tolist(), *(ends + 1).tolist()}
        size = max(2, -(-2 * (1 + self.force.shape[1]) * len(self) // limit))
        for start in range(0, len(self), size):
            keep.add(start)
            for part in (dynamic[start : start + size], ~dynamic[start : start + size]):
                here = start + np.flatnonzero(part)
                if len(here):
                    force = self.force[here]
                    keep.update(here[np.argmax(force, axis=0)].tolist(), here[np.argmin(force, axis=0)].tolist())
        return self.select(sorted(keep))
