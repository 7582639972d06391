"""Creases whose rest angle moves: an additional moment on linear springs, as a function of time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.interactions.crease_spatial import force_crease_spatial, linearise_crease_spatial
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import pieces_at, program_at
from fsm.kernels.programs import Program, table_of
from fsm.laws.crease import CreaseLaws, MomentCurve, crease_laws_of, join_curves
from fsm.model.bodies.arrays import DAMPING, FORCE, POSES, RATES, STIFFNESS, STORED
from fsm.model.elements.element_group import LAST, ElementKernels, bodies_of, slots_of
from fsm.model.elements.hinges import AFTER_HINGE, AXES_INNER, AXES_OUTER, OFFSET, HingeGroup, keep_spatial, spatial_angles

_MOMENT, _UNIT, _LAWS = range(AFTER_HINGE, AFTER_HINGE + 3)
_TIME = _LAWS + len(CreaseLaws._fields)
_ANGLE = 10.0
"""Half the range of the table of a constant moment, rad; it continues outside."""


@kernel
def _factor(own: np.ndarray, t: float) -> float:
    return program_at(pieces_at(own, _TIME), 0, t)[0]


@kernel
def _laws_at(own: np.ndarray, t: float) -> CreaseLaws:
    """Laws at a time (s): the opening is the negative angle, and the moment is constant."""
    law, unit, factor = crease_laws_of(own, _LAWS), floats_2d(own, _UNIT), _factor(own, t)
    for i in range(unit.shape[0]):
        for k in range(unit.shape[1]):
            law.coefficients[i, k] = factor * unit[i, k]
    return law


@kernel
def _force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    force_crease_spatial(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_2d(own, AXES_INNER),
        floats_2d(own, AXES_OUTER), floats_1d(own, OFFSET), _laws_at(own, t), floats_1d(own, LAST), 0.0,
        floats_2d(table, FORCE),
    )  # fmt: skip
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    linearise_crease_spatial(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_2d(own, AXES_INNER),
        floats_2d(own, AXES_OUTER), floats_1d(own, OFFSET), _laws_at(own, t), floats_1d(own, LAST), 0.0, slots_of(own),
        floats_2d(table, FORCE), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING),
    )  # fmt: skip
    return 0.0


@kernel
def _put_in(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Add the power of the moments, W; nothing is dissipated."""
    _, rate, _ = spatial_angles(table, own)
    moment, factor, stored = floats_1d(own, _MOMENT), _factor(own, t), floats_1d(table, STORED)
    for i in range(rate.shape[0]):
        stored[2] += factor * moment[i] * rate[i]
    return 0.0


_KERNELS = ElementKernels(_force, _tangent, keep_spatial, lost=_put_in)


@dataclass(frozen=True)
class ActuatorGroup(HingeGroup):
    """Moments k (change of the rest angle) about the axes of linear creases, in space.

    A spring with the moment k (psi - rest) and a rest angle that changes by d(t) has the additional moment k d(t). The
    moment counts as a load: its power is input power, and the energy of the spring refers to the rest angle at the start.

    Attributes
    ----------
    bodies, geometry : see `HingeGroup`
    moment : (m,) array
        Moment at the factor 1, N m.
    time : function of time of all moments
    names : names of the elements
    """

    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    moment: np.ndarray
    time: Program
    names: tuple[str, ...]
    categories = ()
    kernels = _KERNELS

    @cached_property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        values, which = np.unique(self.moment, return_inverse=True)
        knots, count = np.array([-_ANGLE, _ANGLE]), len(self.moment)
        curves = [MomentCurve(knots, np.array([[0.0, 0.0, 0.0, m]] * 2), np.zeros(2)) for m in values]
        table, none = join_curves(curves), np.zeros(count)
        law = CreaseLaws(
            none, np.ones(count), none, np.asarray(which, dtype=np.int64).ravel(), table.bounds, table.knots,
            table.coefficients.copy(), table.energies,
        )  # fmt: skip
        return [*self.hinge_arrays, self.moment, table.coefficients, *law, *table_of([self.time])]

    def moments(self, t: float) -> np.ndarray:
        """Moments along the twists of the elements at a time (s), (m,), N m."""
        return self.time.at(t)[0] * self.moment

    def break_times(self) -> set[float]:
        """Times at which the function of time is not smooth, s."""
        return set(self.time.breaks())
