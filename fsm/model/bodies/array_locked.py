"""Kernels of bodies for their inertia and for locked directions; see `fsm.model.system.array_locked` and
`fsm.model.elements.joints`.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_3d
from fsm.kernels.body_poses import increment_blocks
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import call_at
from fsm.kernels.scatter import effective_stiffness
from fsm.model.bodies import arrays as rows
from fsm.model.bodies.arrays import Segments
from fsm.solve.stepping.vectors import copy_into, scaled


@kernel
def add_inertia(table: np.ndarray, factor: float) -> None:
    """Add M, multiplied by a factor, to the matrix."""
    matrix, mass, diagonal = floats_3d(table, rows.MATRIX), floats_1d(table, rows.MASS), rows.pattern_of(table).diagonal
    size = matrix.shape[1]
    for row in range(diagonal.shape[0]):
        for k in range(size):
            matrix[diagonal[row], k, k] += factor * mass[row * size + k]


@kernel
def set_matrix(table: np.ndarray, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> None:
    """Write S to the matrix; see `factorise` of `fsm.solve.stepping.model`."""
    matrix, stiffness = floats_3d(table, rows.MATRIX), floats_3d(table, rows.STIFFNESS)
    damping, turned = floats_3d(table, rows.DAMPING), floats_3d(table, rows.TURNED)
    spatial = turned.shape[0] > 0
    for k in range(matrix.shape[0]):
        for i in range(matrix.shape[1]):
            for j in range(matrix.shape[1]):
                matrix[k, i, j] = by_rate * damping[k, i, j]
                if not spatial:
                    matrix[k, i, j] += stiffness[k, i, j]
    add_inertia(table, by_acceleration)
    if spatial:  # K + (c_d D + c_m M) T
        copy_into(increment_blocks(x if maps else scaled(0.0, x)), turned)
        copy_into(effective_stiffness(stiffness, matrix, 1.0, turned, rows.pattern_of(table).columns), matrix)


@kernel
def lock(model: Segments, by_acceleration: float) -> bool:
    """See `fsm.solve.stepping.model`."""
    found = 0.0
    for k in range(model.elements.shape[0]):
        found += call_at(model.elements[k, rows.LOCK_BY], model.table, model.element_tables[k], 0.0, by_acceleration)
    return found > 0.0


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
