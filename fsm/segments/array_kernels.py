"""Kernels of a model of arrays that time steps call; see `fsm.segments.arrays` and `fsm.stepping.model`."""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_3d
from fsm.kernels.block_lu import (
    MAX_ERROR,
    REFINE_ABOVE,
    SYMMETRY_TOLERANCE,
    is_symmetric,
    multiply_blocks,
)
from fsm.kernels.block_sum import effective_stiffness
from fsm.kernels.body_poses import increment_blocks
from fsm.kernels.jit import kernel
from fsm.segments.array_energies import energies
from fsm.segments.array_forces import force, place, renewed_force, retract
from fsm.segments.arrays import DAMPING, FACTORS, MASS, MATRIX, STIFFNESS, TURNED, Segments, pattern_of
from fsm.segments.contact_arrays import have_opened, lack_pairs
from fsm.stepping.model import Calls
from fsm.stepping.vectors import copy_into, scaled

__all__ = ["KERNELS"]

_SYMMETRIC, _TRUSTED, _FAILED = 0, 1, 2
"""Indices of `Segments.flags`: two on the last factorisation, and whether any factorisation or solution has failed."""


# equations --------------------------------------------------------------------------------------------------------------


@kernel
def _factors_of(model: Segments) -> bool:
    matrix, p, flags = floats_3d(model.table, MATRIX), pattern_of(model.table), model.flags
    symmetric = is_symmetric(matrix, p.transposed, SYMMETRY_TOLERANCE)
    flags[_SYMMETRIC], flags[_TRUSTED] = 1 if symmetric else 0, 0
    failed = model.equations.factorise(
        matrix, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, symmetric, floats_3d(model.table, FACTORS)
    )
    if failed >= 0:
        flags[_FAILED] = 1
    return failed < 0


@kernel
def _add_inertia(table: np.ndarray, factor: float) -> None:
    matrix, mass, diagonal = floats_3d(table, MATRIX), floats_1d(table, MASS), pattern_of(table).diagonal
    size = matrix.shape[1]
    for row in range(diagonal.shape[0]):
        for k in range(size):
            matrix[diagonal[row], k, k] += factor * mass[row * size + k]


@kernel
def _set_matrix(table: np.ndarray, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> None:
    """Write S to the matrix."""
    matrix, stiffness, damping = floats_3d(table, MATRIX), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    turned = floats_3d(table, TURNED)
    spatial = turned.shape[0] > 0
    for k in range(matrix.shape[0]):
        for i in range(matrix.shape[1]):
            for j in range(matrix.shape[1]):
                matrix[k, i, j] = by_rate * damping[k, i, j]
                if not spatial:
                    matrix[k, i, j] += stiffness[k, i, j]
    _add_inertia(table, by_acceleration)
    if spatial:  # K + (c_d D + c_m M) T
        copy_into(increment_blocks(x if maps else scaled(0.0, x)), turned)
        copy_into(effective_stiffness(stiffness, matrix, 1.0, turned, pattern_of(table).columns), matrix)


@kernel
def _factorise(model: Segments, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> bool:
    _set_matrix(model.table, by_rate, by_acceleration, x, maps)
    return _factors_of(model)


@kernel
def _factorise_mass(model: Segments) -> bool:
    floats_3d(model.table, MATRIX)[:] = 0.0
    _add_inertia(model.table, 1.0)
    return _factors_of(model)


@kernel
def _solve(model: Segments, right: np.ndarray) -> np.ndarray:
    p, flags, table = pattern_of(model.table), model.flags, model.table
    x, error, refined = model.equations.solve(
        p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, floats_3d(table, FACTORS), p.rows, p.columns,
        floats_3d(table, MATRIX), right, REFINE_ABOVE, flags[_SYMMETRIC] == 1, flags[_TRUSTED] == 1,
    )  # fmt: skip
    if not error <= MAX_ERROR:
        flags[_FAILED] = 1
    flags[_TRUSTED] = 0 if refined else 1
    return x


@kernel
def _mapped(model: Segments, change: np.ndarray) -> np.ndarray:
    turned = floats_3d(model.table, TURNED)
    if turned.shape[0] == 0:
        return change
    out = np.empty(change.shape[0])
    for i in range(turned.shape[0]):
        for a in range(6):
            total = 0.0
            for b in range(6):
                total += turned[i, a, b] * change[6 * i + b]
            out[6 * i + a] = total
    return out


@kernel
def _mass_times(model: Segments, vector: np.ndarray) -> np.ndarray:
    mass, out = floats_1d(model.table, MASS), np.empty(vector.shape[0])
    for i in range(vector.shape[0]):
        out[i] = mass[i] * vector[i]
    return out


@kernel
def _stiffness_times(model: Segments, vector: np.ndarray) -> np.ndarray:
    p = pattern_of(model.table)
    return multiply_blocks(p.rows, p.columns, floats_3d(model.table, STIFFNESS), vector)


@kernel
def _damping_times(model: Segments, vector: np.ndarray) -> np.ndarray:
    p = pattern_of(model.table)
    return multiply_blocks(p.rows, p.columns, floats_3d(model.table, DAMPING), vector)


@kernel
def _unable(model: Segments) -> bool:
    return model.flags[_FAILED] == 1 or lack_pairs(model.groups)


# contacts ---------------------------------------------------------------------------------------------------------------


@kernel
def _contacts_opened(model: Segments) -> bool:
    return bool(have_opened(model.groups))


@kernel
def _part_of_step(model: Segments, t: float, q: np.ndarray, u: np.ndarray, step: float) -> float:
    if model.groups.shape[0] == 0:
        return 1.0
    place(model.table, t, q, u)
    part = model.by_contacts.part_of_step(model.table, model.groups, model.contact_parts, t, step)
    return float(part)


@kernel
def _longest_step(model: Segments, t: float, q: np.ndarray, u: np.ndarray) -> float:
    if model.groups.shape[0] == 0:
        return np.inf
    place(model.table, t, q, u)
    longest = model.by_contacts.longest_step(model.table, model.groups, model.contact_parts, t)
    return float(longest)


@kernel
def _accept(model: Segments, t: float, q: np.ndarray, u: np.ndarray) -> float:
    if model.groups.shape[0] == 0:
        return np.inf
    place(model.table, t, q, u)
    model.by_contacts.accept(model.table, model.groups, model.contact_parts, t)
    longest = model.by_contacts.longest_step(model.table, model.groups, model.contact_parts, t)
    return float(longest)


KERNELS = Calls(
    force, renewed_force, _factorise, _factorise_mass, _solve, _mapped, retract, _mass_times, _stiffness_times,
    _damping_times, _contacts_opened, _part_of_step, _longest_step, _accept, _unable, energies,
)  # fmt: skip
"""Kernels of `Segments` that time steps call."""
