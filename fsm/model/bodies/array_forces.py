"""Kernels of a compiled model (`ArrayModel`): poses, forces and tangents; see `fsm.model.bodies.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.interactions.applied import add_applied, add_applied_stiffness
from fsm.interactions.driven import place_driven
from fsm.kernels.addresses import floats_2d, floats_3d, integers_1d
from fsm.kernels.block_sum import multiply_block_diagonal
from fsm.kernels.body_poses import gather_free, increment_blocks, retract_poses, scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.newton_euler import add_gyroscopic, gyroscopic_damping
from fsm.kernels.pieces import program_at
from fsm.kernels.pointers import call_at
from fsm.model.bodies import arrays as at
from fsm.model.bodies.arrays import Loads, Segments, driven_of, loads_of, pattern_of, springs_of
from fsm.model.bodies.contact_arrays import keep_loaded


@kernel
def place(table: np.ndarray, t: float, q: np.ndarray, u: np.ndarray) -> None:
    """Write poses and rates of all bodies."""
    free, poses, rates = integers_1d(table, at.FREE), floats_2d(table, at.POSES), floats_2d(table, at.RATES)
    no = u.shape[0] < 0  # this is a variable, because a constant would cause a new compilation of the kernel
    scatter_free(free, q, not no and poses.shape[1] == 7, poses)
    scatter_free(free, u, no, rates)
    place_driven(driven_of(table), t, t, poses, rates)


@kernel
def retract(model: Segments, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
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
    """Write weights and loads to the forces."""
    total, weight, poses = floats_2d(table, at.FORCE), floats_2d(table, at.WEIGHT), floats_2d(table, at.POSES)
    for i in range(total.shape[0]):
        for k in range(total.shape[1]):
            total[i, k] = weight[i, k] if k < weight.shape[1] else 0.0
    loads = loads_of(table)
    if loads.bodies.shape[0] > 0:
        factors = factors_of(loads, t)
        add_applied(poses, loads.bodies, loads.points, loads.forces, loads.moments, loads.follower, factors, total)


@kernel
def sum_forces(model: Segments, t: float, per_second: float) -> None:
    """Write the forces on all bodies at the present poses; `per_second` as for the kernels of elements."""
    table = model.table
    poses, rates, total = floats_2d(table, at.POSES), floats_2d(table, at.RATES), floats_2d(table, at.FORCE)
    _set_simple_forces(table, t)
    springs = springs_of(table)
    model.by_springs.force(poses, rates, springs.bodies, springs.constants, springs.last, per_second, total)
    for k in range(model.elements.shape[0]):
        call_at(model.elements[k, at.FORCE_BY], table, model.element_tables[k], t, per_second)
    if model.groups.shape[0] > 0:
        model.by_contacts.force(table, model.groups, model.contact_laws, t, per_second > 0.0)
    if poses.shape[1] == 7:
        add_gyroscopic(rates, floats_2d(table, at.INERTIA), total)


@kernel
def force(model: Segments, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    place(model.table, t, q, u)
    sum_forces(model, t, 0.0)
    return gather_free(integers_1d(model.table, at.FREE), floats_2d(model.table, at.FORCE))


@kernel
def _set_simple_tangents(table: np.ndarray, t: float) -> None:
    """Write the tangents of loads and gyroscopic moments to the block data."""
    stiffness, damping, poses = floats_3d(table, at.STIFFNESS), floats_3d(table, at.DAMPING), floats_2d(table, at.POSES)
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
        dof = integers_1d(table, at.DOF)
        gyroscopic_damping(floats_2d(table, at.RATES), floats_2d(table, at.INERTIA), dof, p.rows, p.columns, damping)


@kernel
def sum_tangents(
    model: Segments, t: float, per_second: float, efforts: np.ndarray, since: np.ndarray, at_depths: bool
) -> None:
    """Write the forces on all bodies at the present poses, K and D.

    Parameters
    ----------
    t, per_second : s, and as for the kernels of elements
    efforts : (m, 3 or 6) array, or (0, 3 or 6)
        Efforts of springs for their geometric stiffness; if empty, efforts at the poses are used.
    since : (nu,) array, or (0,)
        Increments from the last state, if rates are these increments divided by the elapsed time. The rates of bodies then
        change with further increments; their derivative multiplies D.
    at_depths : whether contacts are linearised at the depths of statics
    """
    sum_tangents_by_rates(model, t, per_second, since, at_depths)
    add_tangents_by_deformations(model, t, per_second, efforts)


@kernel
def sum_tangents_by_rates(model: Segments, t: float, per_second: float, since: np.ndarray, at_depths: bool) -> None:
    """Write forces, K and D of all parts whose D acts on rates of bodies; arguments as for `sum_tangents`."""
    table = model.table
    poses, rates, total = floats_2d(table, at.POSES), floats_2d(table, at.RATES), floats_2d(table, at.FORCE)
    damping = floats_3d(table, at.DAMPING)
    _set_simple_forces(table, t)
    _set_simple_tangents(table, t)
    if poses.shape[1] == 7:
        add_gyroscopic(rates, floats_2d(table, at.INERTIA), total)
    if model.groups.shape[0] > 0:
        model.by_contacts.tangent(table, model.groups, model.contact_laws, t, per_second > 0.0, at_depths)
    if poses.shape[1] == 7 and since.shape[0] > 0:
        multiply_block_diagonal(damping, increment_blocks(since), pattern_of(table).columns)


@kernel
def add_tangents_by_deformations(model: Segments, t: float, per_second: float, efforts: np.ndarray) -> None:
    """Add forces, K and D of springs and elements; arguments as for `sum_tangents`."""
    table, springs = model.table, springs_of(model.table)
    poses, rates, total = floats_2d(table, at.POSES), floats_2d(table, at.RATES), floats_2d(table, at.FORCE)
    stiffness, damping = floats_3d(table, at.STIFFNESS), floats_3d(table, at.DAMPING)
    model.by_springs.tangent(
        poses, rates, springs.bodies, springs.constants, springs.last, per_second, efforts, springs.slots, total, stiffness,
        damping,
    )  # fmt: skip
    for k in range(model.elements.shape[0]):
        call_at(model.elements[k, at.TANGENT_BY], table, model.element_tables[k], t, per_second)


@kernel
def renewed_force(model: Segments, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    place(model.table, t, q, u)
    sum_tangents(model, t, 0.0, springs_of(model.table).last[:0], q[:0], False)
    keep_loaded(model.groups)
    return gather_free(integers_1d(model.table, at.FREE), floats_2d(model.table, at.FORCE))
