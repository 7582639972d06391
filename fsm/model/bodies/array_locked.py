"""Kernels of a compiled model (`ArrayModel`) for locked directions; see `fsm.solve.stepping.model` and
`fsm.model.elements.joints`.

Velocities and accelerations are projected with the matrix M + r J^T J, whose penalty is 1e7 times the inertia of each
opening. Each solution reduces the rates of openings by about this factor; the loops end at round-off.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.driven import accelerate_driven
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d
from fsm.kernels.block_lu import REFINE_ABOVE
from fsm.kernels.body_poses import gather_free, scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import call_at
from fsm.model.bodies import arrays as rows
from fsm.model.bodies.array_forces import place, retract, sum_forces
from fsm.model.bodies.arrays import Segments
from fsm.solve.stepping.vectors import copy_into

MOST = 50
"""Largest number of solutions of a projection."""
STALLED = 0.25
"""Ratio of successive errors (squares) above which only round-off is left."""
EXACT = 1e-26
"""Error (a square) relative to the first ones, at which rates and accelerations are exact."""


@kernel
def add_inertia(table: np.ndarray, factor: float) -> None:
    """Add M, multiplied by a factor, to the matrix."""
    matrix, mass, diagonal = floats_3d(table, rows.MATRIX), floats_1d(table, rows.MASS), rows.pattern_of(table).diagonal
    size = matrix.shape[1]
    for row in range(diagonal.shape[0]):
        for k in range(size):
            matrix[diagonal[row], k, k] += factor * mass[row * size + k]


@kernel
def lock(model: Segments, by_acceleration: float) -> bool:
    """See `fsm.solve.stepping.model`."""
    found = 0.0
    for k in range(model.elements.shape[0]):
        found += call_at(model.elements[k, rows.LOCK_BY], model.table, model.element_tables[k], 0.0, by_acceleration)
    return found > 0.0


@kernel
def advance(model: Segments, change: np.ndarray) -> bool:
    """See `fsm.solve.stepping.model`."""
    do_locked(model, model.table, change, rows.STEP, 1.0)
    return True


@kernel
def do_locked(model: Segments, table: np.ndarray, change: np.ndarray, task: float, part: float) -> float:
    """Do a task of the kernels `advance` of all elements with an increment (nu,) of the last evaluated state, which becomes
    the rates of the table.
    """
    rates = floats_2d(table, rows.RATES)
    rates[:] = 0.0
    scatter_free(integers_1d(table, rows.FREE), change, change.shape[0] < 0, rates)
    return float(do_along_rates(model, table, task, part))


@kernel
def do_along_rates(model: Segments, table: np.ndarray, task: float, part: float) -> float:
    """Do a task of the kernels `advance` of all elements; the rates of the table contain the increments of all bodies."""
    total = 0.0
    for k in range(model.elements.shape[0]):
        total += call_at(model.elements[k, rows.ADVANCE_BY], table, model.element_tables[k], task, part)
    return total


@kernel
def project(model: Segments, t: float, task: int) -> float:
    """Do a task of a projection with the arrays `at_rest`; returns the error."""
    error = 0.0
    for k in range(model.elements.shape[0]):
        error += call_at(model.elements[k, rows.PROJECT_BY], model.at_rest, model.element_tables[k], t, float(task))
    return error


@kernel
def swap_multipliers(model: Segments) -> None:
    """Exchange the present multipliers and those of the last accepted state."""
    project(model, 0.0, rows.SWAP)


@kernel
def largest_multiplier(model: Segments) -> float:
    """Largest force of the multipliers at the last evaluated state, N. Forces of mechanisms may balance without supports."""
    found = 0.0
    for k in range(model.elements.shape[0]):
        found = max(
            found, call_at(model.elements[k, rows.ADVANCE_BY], model.table, model.element_tables[k], rows.LARGEST, 0.0)
        )
    return found


@kernel
def _correction(model: Segments, right: np.ndarray) -> np.ndarray:
    """Solution (nu,) with the factors of the projection; further solutions reduce its error."""
    table, p = model.at_rest, rows.pattern_of(model.at_rest)
    x: np.ndarray
    x, _, _ = model.equations.solve(
        p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, floats_3d(table, rows.FACTORS), p.rows, p.columns,
        floats_3d(table, rows.MATRIX), right, REFINE_ABOVE, True, True,
    )  # fmt: skip
    return x


@kernel
def _move(model: Segments, vector: np.ndarray, change: np.ndarray) -> None:
    """Add a change (nu,) to a vector of rates or accelerations, and write the sum to the arrays `at_rest`."""
    for i in range(vector.shape[0]):
        vector[i] += change[i]
    scatter_free(integers_1d(model.table, rows.FREE), vector, vector.shape[0] < 0, floats_2d(model.at_rest, rows.RATES))


@kernel
def _measure_and_factorise(model: Segments, t: float) -> None:
    """Measure openings at the present poses, and factorise M + r J^T J."""
    other, p = model.at_rest, rows.pattern_of(model.table)
    matrix, stiffness = floats_3d(other, rows.MATRIX), floats_3d(other, rows.STIFFNESS)
    stiffness[:] = 0.0
    project(model, t, rows.MEASURE)
    copy_into(stiffness, matrix)
    add_inertia(other, 1.0)
    model.equations.factorise(
        matrix, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, True, floats_3d(other, rows.FACTORS)
    )


@kernel
def close_openings(model: Segments, t: float, q: np.ndarray, u: np.ndarray, inside: bool) -> bool:
    """Correct q and u as `fsm.solve.stepping.model.consistent` does, and measure openings there; multipliers are zero.

    `inside` a step of a tree of joints, q stays, and one solution corrects u.
    """
    lock(model, 0.0)
    table, other, free = model.table, model.at_rest, integers_1d(model.table, rows.FREE)
    force, rates = floats_2d(other, rows.FORCE), floats_2d(other, rows.RATES)
    place(table, t, q, u)
    copy_into(floats_2d(table, rows.RATES), rates)
    _measure_and_factorise(model, t)
    force[:] = 0.0
    if not inside and project(model, t, rows.CLOSE) > 0.0:
        copy_into(retract(model, q, _correction(model, gather_free(free, force))), q)
        place(table, t, q, u)
        _measure_and_factorise(model, t)  # with the old factors, r times the square of the rotation limits convergence
    before, largest = np.inf, 0.0
    for _ in range(1 if inside else MOST):
        force[:] = 0.0
        error = project(model, t, rows.AT_RATES)
        if not EXACT * largest < error < STALLED * before:
            break
        before, largest = error, max(largest, error)
        _move(model, u, _correction(model, gather_free(free, force)))
    project(model, t, rows.BEND)
    place(table, t, q, u)
    return True


@kernel
def find_multipliers(model: Segments, t: float, rate: np.ndarray, inside: bool) -> bool:
    """Correct and keep accelerations and multipliers as `fsm.solve.stepping.model.consistent` does, after `close_openings`.

    The table of the model has the forces on all bodies without the multipliers. `inside` a step of a tree of joints, there
    are two solutions: the first one has a small error normal to all motions that the joints allow, but its large penalties
    cause round-off of these motions.
    """
    table, other, free = model.table, model.at_rest, integers_1d(model.table, rows.FREE)
    force, rates, mass = floats_2d(other, rows.FORCE), floats_2d(other, rows.RATES), floats_1d(table, rows.MASS)
    accelerate_driven(rows.driven_of(table), t, rates)
    _move(model, rate, np.zeros(rate.shape[0]))
    before, largest = np.inf, 0.0
    for number in range(MOST):
        copy_into(floats_2d(table, rows.FORCE), force)
        error = project(model, t, rows.AT_GIVEN if number == 0 else rows.AT_ACCELERATIONS)
        if number > 1 and (inside or error <= EXACT * largest):
            break
        right = gather_free(free, force)
        for i in range(right.shape[0]):
            right[i] -= mass[i] * rate[i]
        _move(model, rate, _correction(model, right))
        if number > 1 and not 0.0 < error < STALLED * before:  # the first error follows from the given acceleration
            break
        before, largest = error, max(largest, error)
    project(model, t, rows.KEEP)
    rates[:] = 0.0
    return True


@kernel
def consistent(model: Segments, t: float, q: np.ndarray, u: np.ndarray, rate: np.ndarray, inside: bool) -> bool:
    """See `fsm.solve.stepping.model`."""
    if not lock(model, 0.0):
        return False
    few = inside and floats_1d(model.table, rows.INTERVAL)[rows.LOOPS] == 0.0
    close_openings(model, t, q, u, few)
    sum_forces(model, t, 0.0)
    return find_multipliers(model, t, rate, few)
