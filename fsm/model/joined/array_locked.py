"""Kernels of bodies and ANCF elements for locked directions at bodies and frames; see `fsm.solve.stepping.model`.

The projections are those of `fsm.model.bodies.array_locked`, with the matrix M + r J^T J of bodies and nodal vectors. A
frame at the rates T u of its vectors has the acceleration T u' + (dT/dt) u.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.driven import accelerate_driven
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.bodies.array_forces import sum_forces as sum_body_forces
from fsm.model.bodies.array_locked import EXACT, MOST, STALLED, do_along_rates, project
from fsm.model.bodies.array_locked import lock as lock_bodies
from fsm.model.bodies.arrays import AT_ACCELERATIONS, AT_RATES, BEND, CLOSE, FREE, KEEP, MEASURE, RATES, STEP, driven_of
from fsm.model.bodies.arrays import FORCE as WRENCHES
from fsm.model.bodies.arrays import MASS as BODY_MASS
from fsm.model.bodies.arrays import STIFFNESS as BODY_STIFFNESS
from fsm.model.bodies.arrays import pattern_of as body_pattern_of
from fsm.model.joined.array_forces import free_bodies, place, spread
from fsm.model.joined.array_statics import retract
from fsm.model.joined.arrays import MEMBERS, NODE_ROWS, OF_MEMBERS, SLOTS, STARTS, TURNING, WAVES, Joined, frames_of
from fsm.model.joined.condense import add_condensed, fold_forces
from fsm.model.nodes.arrays import FIXED, HELD_STIFFNESS, MASS, MATRIX, NUMBERS, U, mass_of
from fsm.model.nodes.system.array_forces import (
    factorise_matrix,
    forces_of_coordinates,
    hold_rows,
    rows_times,
    solve,
)
from fsm.model.nodes.system.array_forces import sum_forces as sum_node_forces
from fsm.solve.stepping.vectors import copy_into


@kernel
def lock(model: Joined, by_acceleration: float) -> bool:
    """See `fsm.solve.stepping.model`."""
    least = floats_1d(model.table, WAVES)[0] if by_acceleration > 0.0 else 0.0
    return bool(lock_bodies(model.bodies, by_acceleration + least))


@kernel
def advance(model: Joined, change: np.ndarray) -> bool:
    """See `fsm.solve.stepping.model`."""
    table = model.bodies.table
    spread(model, change, floats_2d(table, RATES))
    do_along_rates(model.bodies, table, STEP, 1.0)
    return True


@kernel
def _measure_and_factorise(model: Joined, t: float) -> None:
    """Measure openings at the present poses, and factorise M + r J^T J."""
    other, table, own = model.bodies.at_rest, model.table, model.projection
    stiffness, matrix, p = floats_3d(other, BODY_STIFFNESS), floats_3d(own.table, MATRIX), body_pattern_of(other)
    stiffness[:] = 0.0
    project(model.bodies, t, MEASURE)
    copy_into(floats_3d(own.table, MASS), matrix)
    members = floats_3d(table, MEMBERS)
    add_condensed(
        p.rows, p.columns, stiffness, integers_1d(table, OF_MEMBERS), members, members, integers_1d(table, STARTS),
        integers_1d(table, SLOTS), matrix,
    )  # fmt: skip
    hold_rows(own.table, floats_1d(own.table, NUMBERS)[HELD_STIFFNESS], matrix)
    factorise_matrix(own, False)


@kernel
def _folded(model: Joined, wrenches: np.ndarray) -> np.ndarray:
    """Generalised forces (nu,) of wrenches (n_bodies, 6) on bodies and frames; zero at held coordinates."""
    free, f, fixed = integers_1d(model.bodies.table, FREE), frames_of(model.table), integers_2d(model.nodes.table, FIXED)
    count, held, on_frames = free.shape[0], fixed.reshape(-1), np.empty((f.bodies.shape[0], 6))
    out = np.zeros(6 * count + held.shape[0])
    for i in range(count):
        for k in range(6):
            out[6 * i + k] = wrenches[free[i], k]
    for i in range(f.bodies.shape[0]):
        for k in range(6):
            on_frames[i, k] = wrenches[f.bodies[i], k]
    maps = floats_3d(model.table, MEMBERS)[2 * count :]
    fold_forces(on_frames, f.first, integers_1d(model.table, NODE_ROWS), maps, out[6 * count :])
    for i in range(held.shape[0]):
        if held[i] == 1:
            out[6 * count + i] = 0.0
    return out


@kernel
def close_openings(model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> bool:
    """Correct q and u as `fsm.solve.stepping.model.consistent` does, and measure openings there; multipliers are zero."""
    lock_bodies(model.bodies, 0.0)
    table, other = model.bodies.table, model.bodies.at_rest
    force, rates = floats_2d(other, WRENCHES), floats_2d(other, RATES)
    place(model, t, q, u)
    copy_into(floats_2d(table, RATES), rates)
    _measure_and_factorise(model, t)
    force[:] = 0.0
    if project(model.bodies, t, CLOSE) > 0.0:
        copy_into(retract(model, q, solve(model.projection, _folded(model, force))), q)
        place(model, t, q, u)
        copy_into(floats_2d(table, RATES), rates)
        _measure_and_factorise(model, t)
    before = np.inf
    for _ in range(MOST):
        force[:] = 0.0
        error = project(model.bodies, t, AT_RATES)
        if not 0.0 < error < STALLED * before:
            break
        before = error
        change = solve(model.projection, _folded(model, force))
        for i in range(u.shape[0]):
            u[i] += change[i]
        place(model, t, q, u)
        copy_into(floats_2d(table, RATES), rates)
    project(model.bodies, t, BEND)
    return True


@kernel
def _set_accelerations(model: Joined, t: float, rate: np.ndarray) -> None:
    """Write the accelerations of all bodies and frames to the rates of the arrays at rest."""
    rates, free, table = floats_2d(model.bodies.at_rest, RATES), free_bodies(model), model.table
    f, rows, now = frames_of(table), integers_1d(table, NODE_ROWS), floats_1d(model.nodes.table, U)
    turns = floats_3d(table, TURNING)[2 * free :]
    spread(model, rate, rates)
    for i in range(f.bodies.shape[0]):
        for j in range(f.first[i], f.first[i + 1]):
            for k in range(6):
                for c in range(3):
                    rates[f.bodies[i], k] += turns[j, k, c] * now[3 * rows[j] + c]
    accelerate_driven(driven_of(model.bodies.table), t, rates)


@kernel
def find_multipliers(model: Joined, t: float, rate: np.ndarray, on_nodes: np.ndarray) -> bool:
    """Correct and keep accelerations and multipliers as `fsm.solve.stepping.model.consistent` does, after `close_openings`.

    The table of the bodies has the forces on all bodies and frames without the multipliers, and `on_nodes` are the other
    forces on the coordinates of nodes.
    """
    table, other, first = model.bodies.table, model.bodies.at_rest, 6 * free_bodies(model)
    force, mass = floats_2d(other, WRENCHES), floats_1d(table, BODY_MASS)
    _set_accelerations(model, t, rate)
    before, largest = np.inf, 0.0
    for number in range(MOST):
        copy_into(floats_2d(table, WRENCHES), force)
        error = project(model.bodies, t, AT_ACCELERATIONS)
        if number > 1 and error <= EXACT * largest:
            break
        right = _folded(model, force)
        for i in range(first):
            right[i] -= mass[i] * rate[i]
        inertial = rows_times(mass_of(model.nodes.table), rate[first:])
        for i in range(inertial.shape[0]):
            right[first + i] += on_nodes[i] - inertial[i]
        change = solve(model.projection, right)
        for i in range(rate.shape[0]):
            rate[i] += change[i]
        _set_accelerations(model, t, rate)
        if number > 1 and not 0.0 < error < STALLED * before:  # the first two errors follow from the given acceleration
            break
        before, largest = error, max(largest, error)
    project(model.bodies, t, KEEP)
    floats_2d(other, RATES)[:] = 0.0
    return True


@kernel
def consistent(model: Joined, t: float, q: np.ndarray, u: np.ndarray, rate: np.ndarray, inside: bool) -> bool:
    """See `fsm.solve.stepping.model`; openings inside steps are closed too."""
    if not lock(model, 0.0):
        return False
    close_openings(model, t, q, u)
    sum_body_forces(model.bodies, t, 0.0)
    sum_node_forces(model.nodes, t, 1.0)
    find_multipliers(model, t, rate, forces_of_coordinates(model.nodes.table, q[7 * free_bodies(model) :]))
    return True
