"""Friction sliders parallel to the elastic curves of creases, which cause hysteresis between opening and closing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.interactions.hinge_planar import stiffness_hinge_planar
from fsm.interactions.hinge_spatial import stiffness_hinge_spatial
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import scatter_efforts
from fsm.laws.crease import CreaseLaws, crease_laws_of, elastic_effort, openings_of
from fsm.laws.crease_sliders import Sliders, accept_sliders, slider_energy, slider_moments, sliders_of
from fsm.model.bodies.arrays import FORCE, POSES, STIFFNESS, STORED, index_of
from fsm.model.elements import hinges
from fsm.model.elements.element_group import LAST, ElementKernels, bodies_of
from fsm.model.elements.hinges import HingeGroup

_LAWS = hinges.AFTER_HINGE
_FLEXIBILITY = _LAWS + len(CreaseLaws._fields)
_SLIDERS = _FLEXIBILITY + 1


@kernel
def _opening(own: np.ndarray, angle: np.ndarray) -> np.ndarray:
    found: np.ndarray = openings_of(crease_laws_of(own, _LAWS), np.arange(angle.shape[0]), angle)
    return found


@kernel
def _efforts(own: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Moments against the hinge angle and their slopes by it, (m, 1) arrays, N m and N m/rad."""
    side, count = crease_laws_of(own, _LAWS).side, angle.shape[0]
    moment, slope = slider_moments(sliders_of(own, _SLIDERS), _opening(own, angle))
    effort = np.empty((count, 1))
    for i in range(count):
        effort[i, 0] = -side[i] * moment[i]
    return effort, slope.reshape(count, 1)


@kernel
def _add_force(table: np.ndarray, own: np.ndarray, effort: np.ndarray, gradient: np.ndarray) -> None:
    scatter_efforts(bodies_of(own), gradient, effort, effort.shape[0], floats_2d(table, FORCE))


@kernel
def _planar_force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, _, gradient = hinges.planar_angles(table, own)
    _add_force(table, own, _efforts(own, angle)[0], gradient)
    return 0.0


@kernel
def _spatial_force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, _, gradient = hinges.spatial_angles(table, own)
    _add_force(table, own, _efforts(own, angle)[0], gradient)
    return 0.0


@kernel
def _planar_tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, _, gradient = hinges.planar_angles(table, own)
    effort, slope = _efforts(own, angle)
    _add_force(table, own, effort, gradient)
    stiffness_hinge_planar(bodies_of(own), slope, index_of(table), floats_3d(table, STIFFNESS))
    return 0.0


@kernel
def _spatial_tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, _, gradient = hinges.spatial_angles(table, own)
    effort, slope = _efforts(own, angle)
    _add_force(table, own, effort, gradient)
    stiffness_hinge_spatial(
        floats_2d(table, POSES), bodies_of(own), floats_2d(own, hinges.AXES_INNER), floats_2d(own, hinges.AXES_OUTER),
        effort, slope, index_of(table), floats_3d(table, STIFFNESS),
    )  # fmt: skip
    return 0.0


@kernel
def _energy(
    own: np.ndarray, t: float, angle: np.ndarray, rate: np.ndarray, per_second: float
) -> tuple[np.ndarray, np.ndarray]:
    """Stored energy (J) and dissipated power (W) of every slider."""
    side, change = crease_laws_of(own, _LAWS).side, np.empty(angle.shape[0])
    for i in range(angle.shape[0]):
        change[i] = -side[i] * rate[i]
    other = _opening(own, floats_1d(own, LAST))
    return slider_energy(sliders_of(own, _SLIDERS), t, _opening(own, angle), change, per_second, other)


@kernel
def _add_stored(table: np.ndarray, own: np.ndarray, angle: np.ndarray) -> float:
    """Add the energies. The half segments carry the sum of both moments; the `CreaseGroup` counts its own moment alone."""
    law, flexibility, stored = crease_laws_of(own, _LAWS), floats_1d(own, _FLEXIBILITY), floats_1d(table, STORED)
    energy, _ = _energy(own, 0.0, angle, angle, 0.0)
    effort, _ = _efforts(own, angle)
    half_cells = total = 0.0
    for i in range(angle.shape[0]):
        _, beside, _ = elastic_effort(law, i, angle[i])
        half_cells += flexibility[i] * (beside * effort[i, 0] + 0.5 * effort[i, 0] ** 2)
        total += energy[i]
    stored[0] += half_cells
    stored[1] += total - half_cells
    return 0.0


@kernel
def _planar_stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    return _add_stored(table, own, hinges.planar_angles(table, own)[0])


@kernel
def _spatial_stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    return _add_stored(table, own, hinges.spatial_angles(table, own)[0])


@kernel
def _power(table: np.ndarray, own: np.ndarray, t: float, angle: np.ndarray, rate: np.ndarray, per_second: float) -> float:
    """Dissipated power, W. Over a step it is the exact mean."""
    power = float(_energy(own, t, angle, rate, per_second)[1].sum())
    floats_1d(table, STORED)[3] += power
    return power


@kernel
def _planar_lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, _ = hinges.planar_angles(table, own)
    return _power(table, own, t, angle, rate, per_second)


@kernel
def _spatial_lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, _ = hinges.spatial_angles(table, own)
    return _power(table, own, t, angle, rate, per_second)


@kernel
def _planar_accept(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    accept_sliders(sliders_of(own, _SLIDERS), t, _opening(own, hinges.planar_angles(table, own)[0]))
    return 0.0


@kernel
def _spatial_accept(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    accept_sliders(sliders_of(own, _SLIDERS), t, _opening(own, hinges.spatial_angles(table, own)[0]))
    return 0.0


_PLANAR = ElementKernels(_planar_force, _planar_tangent, hinges.keep_planar, _planar_stored, _planar_lost, _planar_accept)
_SPATIAL = ElementKernels(
    _spatial_force, _spatial_tangent, hinges.keep_spatial, _spatial_stored, _spatial_lost, _spatial_accept
)


@dataclass(frozen=True)
class HysteresisGroup(HingeGroup):
    """Sliders of the law `fsm.laws.crease_hysteresis`, each between two bodies. All sliders start on the loading curve.

    The moment depends on the path, not on the speed, so the group is not rate-dependent.

    Attributes
    ----------
    bodies, geometry : see `HingeGroup`
    law : CreaseLaws
        Laws of the creases parallel to the sliders, without dampers; the opening is o = rest - side psi.
    flexibility : (m,) array, rad/(N m)
        Flexibility of the half segments in series with each crease and slider.
    sliders : Sliders
    names : names of the elements
    """

    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    law: CreaseLaws
    flexibility: np.ndarray
    sliders: Sliders
    names: tuple[str, ...] = ()

    @property
    def kernels(self) -> ElementKernels:
        """See `ElementGroup`."""
        return _SPATIAL if self.spatial else _PLANAR

    @property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return [*self.hinge_arrays, *self.law, self.flexibility, *self.sliders]

    @property
    def looks_back(self) -> bool:
        """See `ElementGroup`; the power of the sliders is that of the step from the last state."""
        return True

    @property
    def memory_of(self) -> np.ndarray:
        """See `ElementGroup`."""
        return self.sliders.memory

    @property
    def first_memory(self) -> np.ndarray:
        """See `ElementGroup`."""
        return self.sliders.first

    def moments(self, angle: np.ndarray) -> np.ndarray:
        """Moments (m,) against hinge angles (m,), N m."""
        moment, _ = slider_moments(self.sliders, openings_of(self.law, np.arange(len(angle)), angle))
        return np.asarray(-self.law.side * moment)
