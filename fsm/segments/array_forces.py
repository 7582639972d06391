"""Kernels of a model of arrays: poses, forces and tangents; see `fsm.segments.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.interactions.applied import add_applied, add_applied_stiffness
from fsm.interactions.driven import place_driven
from fsm.kernels.addresses import floats_2d, floats_3d, integers_1d
from fsm.kernels.body_poses import gather_free, retract_poses, scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.newton_euler import add_gyroscopic, gyroscopic_damping
from fsm.kernels.pieces import program_at
from fsm.segments.arrays import (
    DAMPING,
    FORCE,
    FREE,
    INERTIA,
    POSES,
    RATES,
    STIFFNESS,
    WEIGHT,
    Loads,
    Segments,
    driven_of,
    loads_of,
    pattern_of,
    springs_of,
)
from fsm.segments.contact_arrays import keep_loaded

__all__ = ["factors_of", "force", "place", "renewed_force", "retract", "sum_forces", "sum_tangents"]


@kernel
def place(table: np.ndarray, t: float, q: np.ndarray, u: np.ndarray) -> None:
    """Write poses and rates of all bodies."""
    free, poses, rates = integers_1d(table, FREE), floats_2d(table, POSES), floats_2d(table, RATES)
    no = u.shape[0] < 0  # a variable, because a constant would compile the kernel again
    scatter_free(free, q, not no and poses.shape[1] == 7, poses)
    scatter_free(free, u, no, rates)
    place_driven(driven_of(table), t, poses, rates)


@kernel
def retract(model: Segments, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    """See `fsm.stepping.model`."""
    if x.shape[0] < q.shape[0]:
        return retract_poses(q, x)
    out = np.empty(q.shape[0])
    for i in range(q.shape[0]):
        out[i] = q[i] + x[i]
    return out


@kernel
def factors_of(loads: Loads, t: float) -> np.ndarray:
    """Factors (m,) of all loads at a time, s."""
    factors = np.empty(loads.bodies.shape[0])
    for i in range(factors.shape[0]):
        factors[i] = program_at(loads.programs, i, t)[0]
    return factors


@kernel
def _set_simple_forces(table: np.ndarray, t: float) -> None:
    """Write weights, loads and gyroscopic moments to the forces."""
    total, weight, poses = floats_2d(table, FORCE), floats_2d(table, WEIGHT), floats_2d(table, POSES)
    for i in range(total.shape[0]):
        for k in range(total.shape[1]):
            total[i, k] = weight[i, k] if k < weight.shape[1] else 0.0
    loads = loads_of(table)
    if loads.bodies.shape[0] > 0:
        factors = factors_of(loads, t)
        add_applied(poses, loads.bodies, loads.points, loads.forces, loads.moments, loads.follower, factors, total)
    if poses.shape[1] == 7:
        add_gyroscopic(floats_2d(table, RATES), floats_2d(table, INERTIA), total)


@kernel
def sum_forces(model: Segments, t: float) -> None:
    """Write the forces on all bodies at the present poses."""
    table = model.table
    poses, rates, total = floats_2d(table, POSES), floats_2d(table, RATES), floats_2d(table, FORCE)
    _set_simple_forces(table, t)
    springs = springs_of(table)
    model.by_springs.force(poses, rates, springs.bodies, springs.constants, springs.last, 0.0, total)
    model.by_creases.force(table)
    model.by_ligaments.force(table)
    model.by_contacts.force(table, model.groups, model.contact_parts, t)


@kernel
def force(model: Segments, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """See `fsm.stepping.model`."""
    place(model.table, t, q, u)
    sum_forces(model, t)
    return gather_free(integers_1d(model.table, FREE), floats_2d(model.table, FORCE))


@kernel
def _set_simple_tangents(table: np.ndarray, t: float) -> None:
    """Write the tangents of loads and gyroscopic moments to the block data."""
    stiffness, damping, poses = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING), floats_2d(table, POSES)
    stiffness[:] = 0.0
    damping[:] = 0.0
    loads = loads_of(table)
    if loads.bodies.shape[0] > 0:
        add_applied_stiffness(
            poses, loads.bodies, loads.points, loads.forces, loads.moments, loads.follower, factors_of(loads, t),
            loads.slots, stiffness,
        )  # fmt: skip
    if poses.shape[1] == 7:
        p = pattern_of(table)
        gyroscopic_damping(floats_2d(table, RATES), floats_2d(table, INERTIA), p.dof, p.rows, p.columns, damping)


@kernel
def sum_tangents(model: Segments, t: float) -> None:
    """Write the forces on all bodies at the present poses, K and D."""
    table = model.table
    _set_simple_forces(table, t)
    _set_simple_tangents(table, t)
    springs = springs_of(table)
    model.by_springs.tangent(
        floats_2d(table, POSES), floats_2d(table, RATES), springs.bodies, springs.constants, springs.last, 0.0,
        springs.last[:0], springs.slots, floats_2d(table, FORCE), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING),
    )  # fmt: skip
    model.by_creases.tangent(table)
    model.by_ligaments.tangent(table)
    model.by_contacts.tangent(table, model.groups, model.contact_parts, t)


@kernel
def renewed_force(model: Segments, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """See `fsm.stepping.model`."""
    place(model.table, t, q, u)
    sum_tangents(model, t)
    keep_loaded(model.groups)
    return gather_free(integers_1d(model.table, FREE), floats_2d(model.table, FORCE))
