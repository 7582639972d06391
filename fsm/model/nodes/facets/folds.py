"""Folds: rotational springs between the sides of a crease of flexible facets, or between triangles of points.

The vectors a and b across the fold on its sides, and c along it, are sums of four nodal vectors:

* a crease of flexible facets, at a node: a and b are sums of the slopes of the facets on both sides. The two sides share
positions and have separate slopes; c is the mean of their slopes along the crease.
* triangles (i, j, k) and (l, k, j) of points: a = x_j - x_i, b = x_l - x_j, c = x_k - x_j.

The fold angle is the rotation about c from a to b, as in `fsm.model.nodes.facets.fold_angle`: zero if flat, positive for a
valley. The moment of fold i at the angle psi, with the memory of the path, is

    M = s M_c(psi) + k_r (tan(c d)/c - d) + M_n - k d_r(t) + s_d psi',    d = |psi| - p > 0,   c = pi/(2 (pi - p))

M_c is the curve of `fsm.laws.crease`, with the friction slider of `fsm.laws.crease_sliders` if it has two branches. s is the
share of the fold. The second term acts beyond the angle p and becomes infinite where facets meet (Liu and Paulino,
2017). Its energy grows only with the logarithm of the remaining angle r = pi - |psi|: an impact of the energy E would stop
at r = exp(-E c^2/k_r), which is zero in floating-point numbers. The moment M_n of facets that nearly touch has the energy

    U_n = 100 (k_r/c^2) (r_n/r - 1)^3    for r < r_n = (pi - p)/20

Its moment and slope are continuous, and an impact stops at r = r_n/(1 + (E c^2/(100 k_r))^(1/3)). At larger remaining
angles the law is that of Liu and Paulino. The fourth term is a load: the rest angle of a linear fold with the
stiffness k moves by d_r.

Fold angles are continuous. Fold angles differ by less than half a turn from the fold angles of the last accepted state, so
they may exceed 180 degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fsm.kernels.programs import CONSTANT, Program, table_of
from fsm.laws.crease import CreaseLaws
from fsm.laws.crease_sliders import Sliders, no_sliders
from fsm.model.nodes.arrays import FORCE_AT
from fsm.model.nodes.facets.array_folds import FOLDS, MOMENTS, commit_folds, fold_table
from fsm.model.nodes.facets.fold_kernels import FoldArrays, FoldCurves, FoldPath, fold_angles
from fsm.model.nodes.group import ElementGroup


@dataclass(eq=False)
class FoldLaws:
    """Laws of (m,) folds; see the module docstring.

    Attributes
    ----------
    start : (m,) array, rad
        Fold angles at the start; the angles of the first state are within half a turn of these values.
    curves : CreaseLaws
        Curves without dampers; the opening is o = rest - side psi.
    share : (m,) array
        Factor s of each curve.
    damping : (m,) array, N m s/rad
    turning : (m,) array, N m
        Stiffness times the change of the rest angle at the factor 1.
    time : factor of `turning` as a function of time
    linear_to : rad
        Angle p; pi: never reached.
    rise : (m,) array, N m/rad
        Stiffness k_r.
    sliders : Sliders of unit shares, or None
    chosen : (n,) int array
        Folds of the sliders.
    """

    start: np.ndarray
    curves: CreaseLaws
    share: np.ndarray
    damping: np.ndarray
    turning: np.ndarray
    time: Program = CONSTANT
    linear_to: float = math.pi
    rise: np.ndarray = field(default_factory=lambda: np.zeros(0))
    sliders: Sliders | None = None
    chosen: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        self.near = np.array(self.start, dtype=float)

    @cached_property
    def without_memory(self) -> FoldCurves:
        """Laws without dampers, sliders and moving rest angles."""
        share, rise = np.array(self.share, dtype=float), np.array(self.rise, dtype=float)
        return FoldCurves(self.curves, share, rise, np.array([self.linear_to]))

    @cached_property
    def path(self) -> FoldPath:
        """Sliders and moving rest angles."""
        turning = np.array(self.turning, dtype=float) if np.any(self.turning) else np.zeros(0)
        sliders = no_sliders() if self.sliders is None else self.sliders
        return FoldPath(turning, table_of([self.time]), np.array(self.chosen, dtype=np.int64), sliders)


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
    kernels = FOLDS
    accept = staticmethod(commit_folds)

    @cached_property
    def table(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return fold_table(self.arrays)

    @cached_property
    def rate_dependent(self) -> bool:
        """See `ElementGroup`."""
        return bool(np.any(self.laws.damping))

    @cached_property
    def arrays(self) -> FoldArrays:
        """Arrays of the kernels; the laws give `near`."""
        return FoldArrays(
            np.ascontiguousarray(self.vectors), np.ascontiguousarray(self.weights), self.laws.near,
            np.array(self.laws.damping, dtype=float), self.laws.without_memory, self.laws.path,
        )  # fmt: skip

    def angles(self, q: np.ndarray) -> np.ndarray:
        """Fold angle of every fold, (m,), rad."""
        return np.asarray(fold_angles(self.arrays, q))

    def moments(self, q: np.ndarray, u: np.ndarray | None = None) -> np.ndarray:
        """Moment of every fold, (m,), N m."""
        self._alone.call(FORCE_AT, q, u, np.zeros_like(q))
        return self.table[MOMENTS].copy()

    def break_times(self) -> list[float]:
        """See `ElementGroup`."""
        return list(self.laws.time.breaks())

    @property
    def kept(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """See `ElementGroup`."""
        laws = self.laws
        angles = laws.near, np.array(laws.start, dtype=float)
        return [angles] if laws.sliders is None else [angles, (laws.sliders.memory, laws.sliders.first)]
