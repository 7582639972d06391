"""Kernels of creases and ligaments of a compiled model, called by their addresses; see `fsm.segments.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.interactions.crease_planar import force_crease_planar, linearise_crease_planar
from fsm.interactions.crease_spatial import force_crease_spatial, linearise_crease_spatial
from fsm.interactions.hinge_planar import measure_hinge_planar
from fsm.interactions.hinge_spatial import measure_hinge_spatial
from fsm.interactions.ligament_planar import (
    force_ligament_planar,
    linearise_ligament_planar,
    measure_ligament_planar,
    stored_ligament_planar,
)
from fsm.kernels.addresses import floats_2d, floats_3d, integers_1d
from fsm.kernels.jit import kernel
from fsm.laws.crease import crease_energy, crease_moment
from fsm.segments.arrays import (
    DAMPING,
    DOF,
    FORCE,
    POSES,
    RATES,
    STIFFNESS,
    Creases,
    ElementKernels,
    creases_of,
    ligaments_of,
    pattern_of,
)
from fsm.stepping.vectors import copy_into

__all__ = ["LIGAMENTS", "PLANAR_CREASES", "SPATIAL_CREASES"]


# creases ----------------------------------------------------------------------------------------------------------------


@kernel
def _crease_force_planar(table: np.ndarray, per_second: float) -> None:
    poses, rates, force, c = floats_2d(table, POSES), floats_2d(table, RATES), floats_2d(table, FORCE), creases_of(table)
    force_crease_planar(poses, rates, c.bodies, c.angle_offset, c.law, c.last, per_second, force)


@kernel
def _crease_force_spatial(table: np.ndarray, per_second: float) -> None:
    poses, rates, force, c = floats_2d(table, POSES), floats_2d(table, RATES), floats_2d(table, FORCE), creases_of(table)
    force_crease_spatial(
        poses, rates, c.bodies, c.axes_inner, c.axes_outer, c.angle_offset, c.law, c.last, per_second, force,
    )  # fmt: skip


@kernel
def _crease_tangent_planar(table: np.ndarray, per_second: float) -> None:
    poses, rates, c = floats_2d(table, POSES), floats_2d(table, RATES), creases_of(table)
    force, stiffness, damping = floats_2d(table, FORCE), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    linearise_crease_planar(
        poses, rates, c.bodies, c.angle_offset, c.law, c.last, per_second, c.slots, force, stiffness, damping
    )


@kernel
def _crease_tangent_spatial(table: np.ndarray, per_second: float) -> None:
    poses, rates, c = floats_2d(table, POSES), floats_2d(table, RATES), creases_of(table)
    force, stiffness, damping = floats_2d(table, FORCE), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    linearise_crease_spatial(
        poses, rates, c.bodies, c.axes_inner, c.axes_outer, c.angle_offset, c.law, c.last, per_second, c.slots, force,
        stiffness, damping,
    )  # fmt: skip


@kernel
def _crease_energies(
    angle: np.ndarray, rate: np.ndarray, creases: Creases, per_second: float
) -> tuple[float, float, float]:
    c = creases
    energy = crease_energy(angle, c.law)
    moment, _ = crease_moment(angle, np.zeros(angle.shape[0]), c.law)
    half_cells = stored = power = 0.0
    for i in range(angle.shape[0]):
        stored += energy[i]
        half_cells += 0.5 * c.flexibility[i] * moment[i, 0] ** 2
        speed = rate[i] if per_second == 0.0 else (angle[i] - c.last[i]) * per_second
        power += c.law.damping[i] * speed**2
    copy_into(angle, c.last)
    return half_cells, stored - half_cells, power


@kernel
def _crease_stored_planar(table: np.ndarray, per_second: float) -> tuple[float, float, float]:
    poses, rates, c = floats_2d(table, POSES), floats_2d(table, RATES), creases_of(table)
    angle, rate, _ = measure_hinge_planar(poses, rates, c.bodies, c.angle_offset)
    return _crease_energies(angle, rate, c, per_second)


@kernel
def _crease_stored_spatial(table: np.ndarray, per_second: float) -> tuple[float, float, float]:
    poses, rates, c = floats_2d(table, POSES), floats_2d(table, RATES), creases_of(table)
    angle, rate, _ = measure_hinge_spatial(poses, rates, c.bodies, c.axes_inner, c.axes_outer, c.angle_offset)
    return _crease_energies(angle, rate, c, per_second)


PLANAR_CREASES = ElementKernels(_crease_force_planar, _crease_tangent_planar, _crease_stored_planar)
SPATIAL_CREASES = ElementKernels(_crease_force_spatial, _crease_tangent_spatial, _crease_stored_spatial)


# ligaments --------------------------------------------------------------------------------------------------------------


@kernel
def _ligament_force(table: np.ndarray, per_second: float) -> None:
    poses, rates, ligaments = floats_2d(table, POSES), floats_2d(table, RATES), ligaments_of(table)
    bodies, constants = ligaments.bodies, ligaments.constants
    force_ligament_planar(poses, rates, bodies, constants, ligaments.last, per_second, floats_2d(table, FORCE))


@kernel
def _ligament_tangent(table: np.ndarray, per_second: float) -> None:
    ligaments, pattern = ligaments_of(table), pattern_of(table)
    linearise_ligament_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), ligaments.bodies, ligaments.constants, ligaments.last, per_second,
        integers_1d(table, DOF), pattern.rows, pattern.columns, floats_2d(table, FORCE), floats_3d(table, STIFFNESS),
        floats_3d(table, DAMPING),
    )  # fmt: skip


@kernel
def _ligament_stored(table: np.ndarray, per_second: float) -> tuple[float, float, float]:
    poses, rates, ligaments = floats_2d(table, POSES), floats_2d(table, RATES), ligaments_of(table)
    bodies, constants = ligaments.bodies, ligaments.constants
    stored, power = stored_ligament_planar(poses, rates, bodies, constants, ligaments.last, per_second)
    copy_into(measure_ligament_planar(poses, rates, bodies, constants)[0], ligaments.last)
    return 0.0, stored, power


LIGAMENTS = ElementKernels(_ligament_force, _ligament_tangent, _ligament_stored)
