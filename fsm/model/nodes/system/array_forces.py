"""Kernels of a mesh as a compiled model (`ArrayModel`): forces, tangents and equations; see `fsm.model.nodes.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.block_equations import set_factors, solution
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import program_at
from fsm.kernels.pointers import call_at
from fsm.model.nodes import arrays as at
from fsm.model.nodes.arrays import Coordinates, Rows, forcing_programs, full_mass_of, moved_of, pattern_of
from fsm.solve.stepping.vectors import copy_into


@kernel
def rows_times(rows: Rows, vector: np.ndarray) -> np.ndarray:
    """Product of a matrix that is stored by rows, and a vector (n,)."""
    out = np.empty(vector.shape[0])
    for i in range(out.shape[0]):
        total = 0.0
        for k in range(rows.first[i], rows.first[i + 1]):
            total += rows.values[k] * vector[rows.columns[k]]
        out[i] = total
    return out


@kernel
def place(table: np.ndarray, t: float, since: float, q: np.ndarray, u: np.ndarray) -> None:
    """Write coordinates and rates; moved coordinates get their values at time t. Rates are mean values since the time
    `since`, if this time is before t (s).
    """
    here, rates, start = floats_1d(table, at.Q), floats_1d(table, at.U), floats_1d(table, at.START)
    copy_into(q, here)
    copy_into(u, rates)
    floats_1d(table, at.NUMBERS)[at.NOW] = t
    moved = moved_of(table)
    for i in range(moved.coordinates.shape[0]):
        value, slope, _ = program_at(moved.programs, moved.motions[i], t)
        if since < t:
            slope = (value - program_at(moved.programs, moved.motions[i], since)[0]) / (t - since)
        k = moved.coordinates[i]
        here[k] = start[k] + value * moved.displacements[i]
        rates[k] = slope * moved.displacements[i]


@kernel
def _add_loads(table: np.ndarray, t: float, moving: float) -> None:
    """Add weight, loads, damping by mass and the inertia of moved coordinates to the forces."""
    force, weight, forcings = floats_1d(table, at.FORCE), floats_1d(table, at.WEIGHT), floats_2d(table, at.FORCINGS)
    programs, moved, rates = forcing_programs(table), moved_of(table), floats_1d(table, at.U)
    for i in range(force.shape[0]):
        force[i] += weight[i]
    for k in range(forcings.shape[0]):
        factor = program_at(programs, k, t)[0]
        for i in range(force.shape[0]):
            force[i] += factor * forcings[k, i]
    if moving == 0.0:
        return
    damped = floats_1d(table, at.NUMBERS)[at.DAMPED]
    if damped == 0.0 and moved.coordinates.shape[0] == 0:
        return
    change = np.empty(force.shape[0])
    for i in range(force.shape[0]):
        change[i] = damped * rates[i]
    for i in range(moved.coordinates.shape[0]):
        change[moved.coordinates[i]] += program_at(moved.programs, moved.motions[i], t)[2] * moved.displacements[i]
    inertial = rows_times(full_mass_of(table), change)
    for i in range(force.shape[0]):
        force[i] -= inertial[i]


@kernel
def _apart(table: np.ndarray, moving: float) -> bool:
    """Whether the dampers of elements act at the state half-way in the step."""
    return bool(moving == at.IN_MOTION and floats_1d(table, at.NUMBERS)[at.APART] > 0.0)


@kernel
def table_halfway(table: np.ndarray) -> np.ndarray:
    """Table with the coordinates and rates half-way in the step in place of the present ones."""
    out = table.copy()
    out[at.Q], out[at.U] = table[at.HALFWAY], table[at.HALFWAY_RATES]
    return out


@kernel
def _call_dampers(model: Coordinates, column: int, number: float, table: np.ndarray) -> float:
    """Call a kernel of all groups whose forces depend on rates; returns the sum of the results."""
    damped, total = integers_1d(table, at.DAMPED_GROUPS), 0.0
    for k in range(damped.shape[0]):
        if damped[k] == 1:
            total += call_at(model.kernels[k, column], table, model.tables[k], number)
    return total


@kernel
def set_halfway(model: Coordinates, t: float, h: float, q: np.ndarray, x: np.ndarray) -> bool:
    """See `fsm.solve.stepping.model.halfway`."""
    table = model.table
    numbers, damped, found = floats_1d(table, at.NUMBERS), integers_1d(table, at.DAMPED_GROUPS), False
    for k in range(damped.shape[0]):
        found = found or damped[k] == 1
    numbers[at.APART] = 0.0
    if h == 0.0 or not found:
        return False
    middle, rates, here = floats_1d(table, at.HALFWAY), floats_1d(table, at.HALFWAY_RATES), floats_1d(table, at.Q)
    end, mean = np.empty(q.shape[0]), np.empty(q.shape[0])
    for i in range(q.shape[0]):
        end[i], mean[i] = q[i] + x[i], x[i] / h
    place(table, t, t, q, mean)
    copy_into(here, middle)
    place(table, t + h, t, end, mean)
    copy_into(floats_1d(table, at.U), rates)
    for i in range(middle.shape[0]):
        middle[i] += 0.5 * (here[i] - middle[i])
    numbers[at.NOW], numbers[at.APART] = t + 0.5 * h, 1.0
    floats_1d(table, at.DAMPER_FORCE)[:] = 0.0
    there = table_halfway(table)
    there[at.FORCE] = table[at.DAMPER_FORCE]
    _call_dampers(model, at.FORCE_AT, at.DAMPERS, there)
    return True


@kernel
def lost_by_dampers(model: Coordinates) -> float:
    """Power that the dampers of elements dissipate, W."""
    apart = _apart(model.table, at.IN_MOTION)
    return float(_call_dampers(model, at.LOST_AT, at.IN_MOTION, table_halfway(model.table) if apart else model.table))


@kernel
def sum_forces(model: Coordinates, t: float, moving: float) -> None:
    """Write the forces on all coordinates at the present state."""
    total = floats_1d(model.table, at.FORCE)
    for i in range(total.shape[0]):
        total[i] = 0.0
    apart, damped = _apart(model.table, moving), integers_1d(model.table, at.DAMPED_GROUPS)
    for k in range(model.kernels.shape[0]):
        number = at.UNDAMPED if apart and damped[k] == 1 else moving
        call_at(model.kernels[k, at.FORCE_AT], model.table, model.tables[k], number)
    if apart:
        _add_array(floats_1d(model.table, at.DAMPER_FORCE), total)
    _add_loads(model.table, t, moving)


@kernel
def forces_of_coordinates(table: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Forces (n,). At held coordinates, the result is the force of the springs that keep them at their initial values."""
    total, start, fixed = floats_1d(table, at.FORCE), floats_1d(table, at.START), integers_2d(table, at.FIXED)
    stiff, size, out = floats_1d(table, at.NUMBERS)[at.HELD_STIFFNESS], fixed.shape[1], np.empty(q.shape[0])
    for i in range(fixed.shape[0]):
        for a in range(size):
            k = i * size + a
            out[k] = -stiff * (q[k] - start[k]) if fixed[i, a] == 1 else total[k]
    return out


@kernel
def force(model: Coordinates, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    place(model.table, t, t, q, u)
    sum_forces(model, t, 1.0)
    return forces_of_coordinates(model.table, q)


@kernel
def hold_rows(table: np.ndarray, diagonal: float, data: np.ndarray) -> None:
    """Set the rows and columns of held coordinates in block data, as `fsm.model.nodes.group.set_held`."""
    flat, cleared, places = data.reshape(-1), integers_1d(table, at.CLEARED), integers_1d(table, at.DIAGONAL)
    for i in range(cleared.shape[0]):
        flat[cleared[i]] = 0.0
    for i in range(places.shape[0]):
        flat[places[i]] = diagonal


@kernel
def hold(table: np.ndarray) -> None:
    """Set the rows and columns of held coordinates in K and D."""
    hold_rows(table, floats_1d(table, at.NUMBERS)[at.HELD_STIFFNESS], floats_3d(table, at.STIFFNESS))
    hold_rows(table, 0.0, floats_3d(table, at.DAMPING))


@kernel
def _add_dampers(model: Coordinates) -> None:
    """Add the forces and tangents of dampers half-way in the step; both Gauss points of a step share them."""
    table, numbers = model.table, floats_1d(model.table, at.NUMBERS)
    if numbers[at.APART] == 1.0:
        there = table_halfway(table)
        there[at.FORCE], there[at.STIFFNESS] = table[at.DAMPER_FORCE], table[at.DAMPER_STIFFNESS]
        there[at.DAMPING] = table[at.DAMPER_DAMPING]
        floats_1d(there, at.FORCE)[:] = 0.0
        floats_3d(there, at.STIFFNESS)[:] = 0.0
        floats_3d(there, at.DAMPING)[:] = 0.0
        _call_dampers(model, at.TANGENT_AT, at.DAMPERS, there)
        numbers[at.APART] = 2.0
    _add_array(floats_1d(table, at.DAMPER_FORCE), floats_1d(table, at.FORCE))
    _add_array(floats_3d(table, at.DAMPER_STIFFNESS).reshape(-1), floats_3d(table, at.STIFFNESS).reshape(-1))
    _add_array(floats_3d(table, at.DAMPER_DAMPING).reshape(-1), floats_3d(table, at.DAMPING).reshape(-1))


@kernel
def _add_array(values: np.ndarray, out: np.ndarray) -> None:
    for i in range(out.shape[0]):
        out[i] += values[i]


@kernel
def sum_tangents(model: Coordinates, t: float, moving: float) -> None:
    """Write the forces on all coordinates at the present state, K and D. Supports have no effect here; see `hold`."""
    table = model.table
    total, stiffness, damping = floats_1d(table, at.FORCE), floats_3d(table, at.STIFFNESS), floats_3d(table, at.DAMPING)
    for i in range(total.shape[0]):
        total[i] = 0.0
    numbers = floats_1d(table, at.NUMBERS)
    stiffness[:] = 0.0
    if numbers[at.RATE_DEPENDENT] > 0.0:
        damping[:] = 0.0
    apart, damped = _apart(table, moving), integers_1d(table, at.DAMPED_GROUPS)
    for k in range(model.kernels.shape[0]):
        number = at.UNDAMPED if apart and damped[k] == 1 else moving
        call_at(model.kernels[k, at.TANGENT_AT], table, model.tables[k], number)
    if apart:
        _add_dampers(model)
    _add_loads(table, t, moving)
    if numbers[at.DAMPED] > 0.0:
        flat, mass = damping.reshape(-1), floats_3d(table, at.FULL_MASS).reshape(-1)
        for i in range(flat.shape[0]):
            flat[i] += numbers[at.DAMPED] * mass[i]


@kernel
def renewed_force(model: Coordinates, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    place(model.table, t, t, q, u)
    sum_tangents(model, t, 1.0)
    hold(model.table)
    return forces_of_coordinates(model.table, q)


# equations --------------------------------------------------------------------------------------------------------------


@kernel
def factorise_matrix(model: Coordinates, whole: bool) -> bool:
    """Factorise the matrix, without its part of low rank unless it is `whole`; false if it is singular."""
    table = model.table
    return set_factors(
        model.equations, pattern_of(table), floats_3d(table, at.MATRIX), floats_3d(table, at.FACTORS), model.flags,
        whole,
    )  # fmt: skip


@kernel
def set_matrix(table: np.ndarray, by_rate: float, by_acceleration: float) -> None:
    """Write K + by_rate D + by_acceleration M to the matrix."""
    matrix, stiffness = floats_3d(table, at.MATRIX).reshape(-1), floats_3d(table, at.STIFFNESS).reshape(-1)
    damping, mass = floats_3d(table, at.DAMPING).reshape(-1), floats_3d(table, at.MASS).reshape(-1)
    for i in range(matrix.shape[0]):
        matrix[i] = stiffness[i] + (by_rate * damping[i] + by_acceleration * mass[i])


@kernel
def solve(model: Coordinates, right: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    table = model.table
    return solution(
        model.equations, pattern_of(table), floats_3d(table, at.MATRIX), floats_3d(table, at.FACTORS), model.flags, right
    )
