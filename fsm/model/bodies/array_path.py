"""Kernels of a compiled model that quasi-static paths call at the ends of steps; see `fsm.solve.stepping.path_end`."""

from __future__ import annotations

import numpy as np

from fsm.interactions.applied import applied_power
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d
from fsm.kernels.block_equations import SYMMETRIC, TRUSTED, Pattern
from fsm.kernels.block_lu import count_negative, multiply_blocks
from fsm.kernels.jit import kernel
from fsm.kernels.newton_euler import largest_force
from fsm.kernels.pointers import call_at
from fsm.kernels.small_blocks import negative_eigenvalues
from fsm.model.bodies.array_forces import factors_of, place, sum_forces, sum_tangents
from fsm.model.bodies.array_statics import per_second_of, place_mean
from fsm.model.bodies.arrays import (
    ACCEPT_BY,
    FACTORS,
    FORCE,
    FREE,
    INTERVAL,
    KEEP_BY,
    LAST_Q,
    LOST_BY,
    MATRIX,
    POSES,
    RATES,
    STIFFNESS,
    STORED,
    STORED_BY,
    WEIGHT,
    Segments,
    loads_of,
    pattern_of,
    springs_of,
)
from fsm.solve.stepping.path_end import (
    CONTACT,
    CONTACT_SUMS,
    CROSSED,
    DISSIPATED,
    GRAVITY,
    JOINTS,
    LOADS,
    NEGATIVE,
    NEGATIVE_AT_REST,
    SLIDING_JOINTS,
    UNKNOWN,
    PathCalls,
)
from fsm.solve.stepping.vectors import copy_into


@kernel
def _end_of_step(
    model: Segments, q: np.ndarray, trial: np.ndarray, accurate: float, at_rest: bool, record: np.ndarray
) -> None:
    table, record[:] = model.table, 0.0
    place_mean(table, q)
    t, per_second = floats_1d(table, INTERVAL)[0], per_second_of(table)
    sums = record[CONTACT_SUMS:].reshape(7, (record.shape[0] - CONTACT_SUMS) // 7)
    if model.groups.shape[0] > 0 and model.by_contacts.passed(table, model.groups, model.contact_parts):
        record[CROSSED] = 1.0
    sum_forces(model, t, per_second)
    _add_joints(model, t, per_second, record)
    _add_loads(table, t, record)
    if model.groups.shape[0] > 0:
        record[CONTACT], lost = model.by_contacts.sums(
            table, model.groups, model.contact_parts, t, per_second > 0.0, sums
        )
        record[DISSIPATED] += lost
    record[NEGATIVE] = _negative_of_last(model, trial, accurate)
    if at_rest:
        record[NEGATIVE_AT_REST] = _negative_at_rest(model, trial, accurate)


@kernel
def _add_joints(model: Segments, t: float, per_second: float, record: np.ndarray) -> None:
    """Add the energies and the damper power of springs and elements."""
    table = model.table
    poses, rates, s = floats_2d(table, POSES), floats_2d(table, RATES), springs_of(table)
    springs, lost = model.by_springs.stored(
        poses, rates, s.bodies, s.constants, s.last, per_second, s.category, s.in_panels.shape[0]
    )
    of_elements, duration = floats_1d(table, STORED), floats_1d(table, INTERVAL)[2]
    of_elements[:] = 0.0
    of_step = 1.0 / duration if duration > 0.0 else 0.0
    for k in range(model.elements.shape[0]):
        own = model.element_tables[k]
        call_at(model.elements[k, STORED_BY], table, own, t, of_step)
        lost += call_at(model.elements[k, LOST_BY], table, own, t, of_step)
    record[DISSIPATED] += lost
    record[LOADS] += of_elements[2]
    record[SLIDING_JOINTS] = of_elements[3]
    record[JOINTS], record[JOINTS + 1] = of_elements[0], of_elements[1]
    for i in range(springs.shape[0]):
        record[JOINTS] += s.in_panels[i] * springs[i]
        record[JOINTS + 1] += (1.0 - s.in_panels[i]) * springs[i]


@kernel
def _add_loads(table: np.ndarray, t: float, record: np.ndarray) -> None:
    """Add the energy of the weights and the power of loads."""
    poses, weight, loads = floats_2d(table, POSES), floats_2d(table, WEIGHT), loads_of(table)
    for i in range(weight.shape[0]):
        for k in range(weight.shape[1]):
            record[GRAVITY] -= weight[i, k] * poses[i, k]
    if loads.bodies.shape[0] > 0:
        record[LOADS] += applied_power(
            poses, floats_2d(table, RATES), loads.bodies, loads.points, loads.forces, loads.moments, loads.follower,
            factors_of(loads, t),
        )  # fmt: skip


# stability --------------------------------------------------------------------------------------------------------------


@kernel
def _negative_of_last(model: Segments, trial: np.ndarray, accurate: float) -> float:
    """Number of negative pivots of the last matrix, or `UNKNOWN`.

    An unsymmetric matrix has no negative real pivot if the symmetric parts of all pivot blocks are definite, and these are
    definite if the symmetric part of the matrix is.
    """
    table, p, flags = model.table, pattern_of(model.table), model.flags
    factors = floats_3d(table, FACTORS)
    if flags[SYMMETRIC] == 0:
        return 0.0 if flags[TRUSTED] == 1 and _definite_pivots(p.filled_diagonal, factors) else UNKNOWN
    found = count_negative(p.filled_diagonal, factors)
    if found == 0 and flags[TRUSTED] == 1:
        return 0.0
    return float(found) if _signs_hold(model, p, floats_3d(table, MATRIX), factors, trial, accurate) else UNKNOWN


@kernel
def _definite_pivots(diagonal: np.ndarray, factors: np.ndarray) -> bool:
    """Whether the symmetric parts of all pivot blocks are positive definite, like those of their inverses in `factors`."""
    size = factors.shape[1]
    work, part = np.empty((size, size)), np.empty((size, size))
    for i in range(diagonal.shape[0]):
        block = factors[diagonal[i]]
        for a in range(size):
            for b in range(size):
                part[a, b] = 0.5 * (block[a, b] + block[b, a])
        if negative_eigenvalues(part, work) > 0:
            return False
    return True


@kernel
def _negative_at_rest(model: Segments, trial: np.ndarray, accurate: float) -> float:
    """Number of negative pivots of the symmetric part of the stiffness at rest, or `UNKNOWN`; writes the forces there."""
    table, t = model.at_rest, floats_1d(model.table, INTERVAL)[0]
    others = Segments(
        table, table, model.flags, model.groups, model.elements, model.element_tables, model.by_springs,
        model.by_contacts, model.contact_parts, model.equations,
    )  # fmt: skip
    sum_tangents(others, t, 0.0, springs_of(table).last[:0], floats_1d(table, LAST_Q)[:0], False)
    p, blocks = pattern_of(table), floats_3d(table, STIFFNESS)
    matrix, factors = floats_3d(table, MATRIX), floats_3d(table, FACTORS)
    for k in range(matrix.shape[0]):
        mirrored = p.transposed[k]
        for i in range(matrix.shape[1]):
            for j in range(matrix.shape[1]):
                matrix[k, i, j] = 0.5 * (blocks[k, i, j] + blocks[mirrored, j, i])
    failed = model.equations.factorise(
        matrix, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, True, factors
    )
    if failed >= 0 or not _signs_hold(model, p, matrix, factors, trial, accurate):
        return UNKNOWN
    return float(count_negative(p.filled_diagonal, factors))


@kernel
def _signs_hold(
    model: Segments, p: Pattern, matrix: np.ndarray, factors: np.ndarray, trial: np.ndarray, accurate: float
) -> bool:
    """Whether round-off of symmetric factors cannot have changed the sign of an eigenvalue; see
    `fsm.solve.equations.linear`.
    """
    right = multiply_blocks(p.rows, p.columns, matrix, trial)
    found, _, _ = model.equations.solve(
        p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, factors, p.rows, p.columns, matrix, right, 0.0, True,
        True,
    )  # fmt: skip
    worst = 0.0
    for i in range(found.shape[0]):
        worst = max(worst, abs(found[i] - trial[i]))
    return worst < accurate


# memory -----------------------------------------------------------------------------------------------------------------


@kernel
def _accept(model: Segments, q: np.ndarray) -> None:
    table = model.table
    place_mean(table, q)
    t, per_second, s = floats_1d(table, INTERVAL)[0], per_second_of(table), springs_of(table)
    poses, rates = floats_2d(table, POSES), floats_2d(table, RATES)
    if model.groups.shape[0] > 0:
        model.by_contacts.accept(table, model.groups, model.contact_parts, t, per_second > 0.0)
    copy_into(model.by_springs.deformations(poses, rates, s.bodies, s.constants), s.last)
    for k in range(model.elements.shape[0]):
        call_at(model.elements[k, KEEP_BY], table, model.element_tables[k], t, per_second)
        call_at(model.elements[k, ACCEPT_BY], table, model.element_tables[k], t, per_second)


@kernel
def _contact_force(model: Segments, t: float, q: np.ndarray) -> float:
    if model.groups.shape[0] == 0:
        return 0.0
    table = model.at_rest
    force, rates = floats_2d(table, FORCE), floats_2d(table, RATES)
    place(table, t, q, np.zeros(integers_1d(table, FREE).shape[0] * rates.shape[1]))
    force[:] = 0.0
    rates[:] = 0.0
    model.by_contacts.force(table, model.groups, model.contact_parts, t, False)
    largest: float = largest_force(force)
    return largest


PATH = PathCalls(_end_of_step, _accept, _contact_force)
"""Kernels of `Segments` that quasi-static paths call."""
