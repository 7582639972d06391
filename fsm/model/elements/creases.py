"""Hinges whose moment is a tabulated curve: the group, its table, and its kernels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.interactions.crease_planar import force_crease_planar, linearise_crease_planar
from fsm.interactions.crease_spatial import force_crease_spatial, linearise_crease_spatial
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d
from fsm.kernels.jit import kernel
from fsm.laws.crease import CreaseLaws, CurveTable, crease_laws_of, elastic_effort
from fsm.model.bodies.arrays import DAMPING, FORCE, POSES, RATES, STIFFNESS, STORED
from fsm.model.elements import hinges
from fsm.model.elements.element_group import LAST, ElementKernels, bodies_of, slots_of
from fsm.model.elements.hinges import HingeGroup

_LAWS = hinges.AFTER_HINGE
_FLEXIBILITY = _LAWS + len(CreaseLaws._fields)


@kernel
def _planar_force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    force_crease_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_1d(own, hinges.OFFSET),
        crease_laws_of(own, _LAWS),
        floats_1d(own, LAST), per_second, floats_2d(table, FORCE),
    )  # fmt: skip
    return 0.0


@kernel
def _planar_tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    linearise_crease_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_1d(own, hinges.OFFSET),
        crease_laws_of(own, _LAWS),
        floats_1d(own, LAST), per_second, slots_of(own), floats_2d(table, FORCE), floats_3d(table, STIFFNESS),
        floats_3d(table, DAMPING),
    )  # fmt: skip
    return 0.0


@kernel
def _spatial_force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    force_crease_spatial(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_2d(own, hinges.AXES_INNER),
        floats_2d(own, hinges.AXES_OUTER), floats_1d(own, hinges.OFFSET), crease_laws_of(own, _LAWS), floats_1d(own, LAST),
        per_second,
        floats_2d(table, FORCE),
    )  # fmt: skip
    return 0.0


@kernel
def _spatial_tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    linearise_crease_spatial(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_2d(own, hinges.AXES_INNER),
        floats_2d(own, hinges.AXES_OUTER), floats_1d(own, hinges.OFFSET), crease_laws_of(own, _LAWS), floats_1d(own, LAST),
        per_second,
        slots_of(own), floats_2d(table, FORCE), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING),
    )  # fmt: skip
    return 0.0


@kernel
def _add_stored(own: np.ndarray, angle: np.ndarray, stored: np.ndarray) -> float:
    """Add the energies in panels (half segments in series with the creases) and in creases to `stored`."""
    law, flexibility = crease_laws_of(own, _LAWS), floats_1d(own, _FLEXIBILITY)
    half_cells = total = 0.0
    for i in range(angle.shape[0]):
        energy, moment, _ = elastic_effort(law, i, angle[i])
        total += energy
        half_cells += 0.5 * flexibility[i] * moment**2
    stored[0] += half_cells
    stored[1] += total - half_cells
    return 0.0


@kernel
def _power(own: np.ndarray, angle: np.ndarray, rate: np.ndarray, per_second: float) -> float:
    law, last, power = crease_laws_of(own, _LAWS), floats_1d(own, LAST), 0.0
    for i in range(angle.shape[0]):
        speed = rate[i] if per_second == 0.0 else (angle[i] - last[i]) * per_second
        power += law.damping[i] * speed**2
    return power


@kernel
def _planar_stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    return _add_stored(own, hinges.planar_angles(table, own)[0], floats_1d(table, STORED))


@kernel
def _spatial_stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    return _add_stored(own, hinges.spatial_angles(table, own)[0], floats_1d(table, STORED))


@kernel
def _planar_lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, _ = hinges.planar_angles(table, own)
    return _power(own, angle, rate, per_second)


@kernel
def _spatial_lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, _ = hinges.spatial_angles(table, own)
    return _power(own, angle, rate, per_second)


_PLANAR = ElementKernels(_planar_force, _planar_tangent, hinges.keep_planar, _planar_stored, _planar_lost)
_SPATIAL = ElementKernels(_spatial_force, _spatial_tangent, hinges.keep_spatial, _spatial_stored, _spatial_lost)


@dataclass(frozen=True)
class CreaseGroup(HingeGroup):
    """Hinges whose moment is a tabulated curve.

    Attributes
    ----------
    bodies, geometry : see `HingeGroup`
    rest, side : (m,) arrays
        Rest angle (rad) and side (+1 or -1) of each crease; the opening is o = rest - side psi.
    damping : (m,) array, N m s/rad
    curve : (m,) int array
        Curve of each crease in `table`.
    table : CurveTable
    flexibility : (m,) array, rad/(N m)
        Flexibility of the half segments in series with each crease; the curves include it.
    names : names of the elements
    """

    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray
    side: np.ndarray
    damping: np.ndarray
    curve: np.ndarray
    table: CurveTable
    flexibility: np.ndarray
    names: tuple[str, ...] = ()

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.damping))

    @cached_property
    def law(self) -> CreaseLaws:
        """Laws of all creases, for the kernels."""
        table = self.table
        own = self.rest, self.side, self.damping, self.curve
        return CreaseLaws(*own, table.bounds, table.knots, table.coefficients, table.energies)

    @property
    def kernels(self) -> ElementKernels:
        """See `ElementGroup`."""
        return _SPATIAL if self.spatial else _PLANAR

    @property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return [*self.hinge_arrays, *self.law, self.flexibility]
