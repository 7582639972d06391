"""Folds: rotational springs between the sides of a crease of flexible facets, or between triangles of points.

The vectors a and b across the fold on its sides, and c along it, are sums of four nodal vectors:

* a crease of flexible facets, at a node: a and b are sums of the slopes of the facets on both sides. The two sides share
positions and have separate slopes; c is the mean of their slopes along the crease.
* triangles (i, j, k) and (l, k, j) of points: a = x_j - x_i, b = x_l - x_j, c = x_k - x_j.

The fold angle is the rotation about c from a to b, as in `fsm.model.nodes.facets.fold_angle`: zero if flat, positive for a
valley. `fsm.model.nodes.facets.fold_laws` defines the moments.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fsm.model.nodes.facets.array_folds import FOLDS, fold_table
from fsm.model.nodes.facets.fold_kernels import FoldArrays, add_moments, add_tangents, fold_rates, fold_states
from fsm.model.nodes.facets.fold_laws import FoldEnergy, FoldLaws
from fsm.model.nodes.group import ElementGroup
from fsm.solve.interface.records import PreviousState

BETWEEN_POINTS = np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.0], [0.0, -1.0, 1.0, 0.0]])
"""a, b and c as sums of the points i, j, k, l of two triangles."""


@dataclass(eq=False)
class FoldGroup(ElementGroup):
    """Folds; see the module docstring.

    Attributes
    ----------
    vectors : (m, 4) int array
        First coordinates of the nodal vectors.
    weights : (m, 3, 4) array
        Factors of these vectors in a, b and c.
    laws : FoldLaws
    name : name of their energy
    """

    vectors: np.ndarray
    weights: np.ndarray
    laws: FoldLaws
    name: str = "creases"
    _time: float = field(default=0.0, init=False)
    _before: PreviousState | None = field(default=None, init=False)
    kernels = FOLDS

    @property
    def table(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return fold_table(self.arrays)

    @property
    def rate_dependent(self) -> bool:
        """See `ElementGroup`."""
        return self.laws.rate_dependent

    def at(self, t: float, before: PreviousState | None) -> None:
        """See `ElementGroup`."""
        self._time, self._before = t, before if before is not None and before[0] != t else None

    @cached_property
    def arrays(self) -> FoldArrays:
        """Arrays of the kernels; the laws give `near`."""
        return FoldArrays(
            np.ascontiguousarray(self.vectors), np.ascontiguousarray(self.weights), self.laws.near,
            np.array(self.laws.damping, dtype=float), self.laws.without_memory, self.laws.path,
        )  # fmt: skip

    def angles(self, q: np.ndarray) -> np.ndarray:
        """Fold angle of every fold, (m,), rad."""
        return self._states(q)[:, 0].copy()

    def add_turns(self, q: np.ndarray, weights: np.ndarray, out: np.ndarray) -> None:
        """Add the gradient of the sum of weights (m,) times fold angles to `out` (n,)."""
        add_moments(self.arrays, self._states(q), -weights, out)

    def moments(self, q: np.ndarray, u: np.ndarray | None = None) -> np.ndarray:
        """Moment of every fold, (m,), N m."""
        return self._efforts(self._states(q), u)[0]

    def add_force(self, q: np.ndarray, u: np.ndarray | None, force: np.ndarray) -> None:
        """See `ElementGroup`."""
        states = self._states(q)
        add_moments(self.arrays, states, self._efforts(states, u)[0], force)

    def add_linearised(
        self,
        q: np.ndarray,
        u: np.ndarray | None,
        slots: np.ndarray,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
    ) -> None:
        """See `ElementGroup`."""
        states = self._states(q)
        moment, slope = self._efforts(states, u)
        add_moments(self.arrays, states, moment, force)
        none, dampers = np.zeros(len(states)), self.arrays.damping
        add_tangents(
            self.arrays, q, q if u is None else u, states, moment, slope,
            none if u is None or self._before is not None else dampers, none if u is None else dampers, slots,
            stiffness.shape[1], stiffness.reshape(-1), damping.reshape(-1),
        )  # fmt: skip

    def energy(self, q: np.ndarray, u: np.ndarray | None) -> tuple[float, float]:
        """See `ElementGroup`."""
        found = self.powers(q, u)
        return found.stored, found.dissipated

    def powers(self, q: np.ndarray, u: np.ndarray | None) -> FoldEnergy:
        """Energy, and powers of dampers, sliders and moving rest angles."""
        states = self._states(q)
        angle, rate = states[:, 0].copy(), self._rate(states, u)
        if self._before is None:
            return self.laws.energy(self._time, angle, rate)
        return self.laws.energy(self._time, angle, rate, self._time - self._before[0], self.angles(self._before[1]))

    # memory -----------------------------------------------------------------------------------------------------------

    def commit(self, t: float, q: np.ndarray) -> None:
        """See `FoldLaws`."""
        self.laws.commit(t, self.angles(q))

    @property
    def remembered(self) -> int:
        """See `FoldLaws`."""
        return self.laws.remembered

    def memory(self) -> np.ndarray:
        """See `FoldLaws`."""
        return self.laws.memory()

    def restore(self, memory: np.ndarray) -> None:
        """See `FoldLaws`."""
        self.laws.restore(memory)

    # inside -----------------------------------------------------------------------------------------------------------

    def _states(self, q: np.ndarray) -> np.ndarray:
        """See `fold_states`."""
        states = np.empty((len(self.vectors), 19))
        fold_states(self.arrays, q, states)
        return states

    def _efforts(self, states: np.ndarray, u: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Moments and slopes of all folds."""
        return self.laws.moments(self._time, states[:, 0].copy(), self._rate(states, u))

    def _rate(self, states: np.ndarray, u: np.ndarray | None) -> np.ndarray:
        """Rates of the fold angles, (m,), rad/s: means over a step of a path, else the rates at the velocities u."""
        if u is None:
            return np.zeros(len(states))
        if self._before is not None:
            return np.asarray((states[:, 0] - self.angles(self._before[1])) / (self._time - self._before[0]))
        return np.asarray(fold_rates(self.arrays, states, u))
