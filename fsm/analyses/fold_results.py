"""Fold angles and moments of creases and bend lines of flexible facets and of bars."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fsm.case.models.flexible_facets import FoldData
from fsm.case.models.scene import Scene
from fsm.model.nodes.facets.folds import FoldGroup
from fsm.results.solution import Solution
from fsm.solve.interface.records import PreviousState


@dataclass(frozen=True, eq=False)
class SheetFolds:
    """Creases and bend lines of a sheet whose facets are flexible or bars.

    Attributes
    ----------
    data : FoldData
    """

    data: FoldData

    def angles(self, system: Any, t: float, q: np.ndarray) -> np.ndarray:
        """Mean fold angle of each joint over its length, (n,), rad; continuous from the last accepted state."""
        nodes, _ = system.elements.place(t, _nodes(system, q), None)
        angles = np.concatenate([group.angles(nodes) for group in _groups(system)])
        return np.asarray(self._sums(angles * self.data.length) / self._sums(self.data.length))

    def moments(
        self, system: Any, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None
    ) -> np.ndarray:
        """Moment of each joint about its line, with its dampers, (n,), N m; arguments as in `System.force`."""
        earlier = None if before is None else (before[0], _nodes(system, before[1]))
        rates = None if u is None else u[len(u) - system.elements.nu :]
        nodes, rates = system.elements.place(t, _nodes(system, q), rates, earlier)
        return self._sums(np.concatenate([group.moments(nodes, rates) for group in _groups(system)]))

    def over_time(self, system: Any, solution: Solution) -> np.ndarray:
        """Mean fold angles at the start and at all records, (1 + n_records, n), rad; they are continuous in time."""
        states = [self.angles(system, float(t), q) for t, q in zip(solution.time, solution.q, strict=True)]
        start = self._sums(self.data.start * self.data.length) / self._sums(self.data.length)
        return np.asarray(np.unwrap(np.array([start, *states]), axis=0))

    def _sums(self, values: np.ndarray) -> np.ndarray:
        """Sums over the folds of each joint."""
        mine = self.data.joint >= 0
        return np.bincount(self.data.joint[mine], weights=values[mine], minlength=len(self.data.names))


def folds_of(scene: Scene | None) -> SheetFolds | None:
    """Folds of the sheet of a scene; None if its facets are rigid, or if it has none."""
    if scene is None:
        return None
    data = scene.built.folds if scene.built.facets is None else scene.built.facets.folds
    return None if data is None or not data.names else SheetFolds(data)


def _groups(system: Any) -> list[FoldGroup]:
    return [group for group in system.elements.mesh.groups if isinstance(group, FoldGroup)]


def _nodes(system: Any, q: np.ndarray) -> np.ndarray:
    return q[len(q) - system.elements.nq :]
