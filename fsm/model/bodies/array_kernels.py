"""Kernels of a compiled model (`ArrayModel`) that time steps call; see `fsm.model.bodies.arrays` and
`fsm.solve.stepping.model`.

Kernels of a compiled model (`ArrayModel`) for motions in the coordinates of joints that form trees; see
`fsm.solve.stepping.model` and `fsm.interactions.joint_tree`.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions import joint_tree
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d
from fsm.kernels.block_equations import FAILED, keep_low_rank, set_factors, solution, stiffness_times
from fsm.kernels.block_lu import multiply_blocks
from fsm.kernels.body_poses import increment_blocks
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import effective_stiffness
from fsm.model.bodies import arrays as at
from fsm.model.bodies.array_forces import (
    accept_elements,
    accepted_part,
    energies,
    force,
    forces_and_powers,
    part_before_event,
    place,
    powers,
    renewed_force,
    retract,
    sum_forces,
)
from fsm.model.bodies.array_locked import add_inertia, advance, consistent, lock, project
from fsm.model.bodies.arrays import Segments, pattern_of, tree_of
from fsm.model.bodies.contact_arrays import have_opened, lack_pairs
from fsm.solve.stepping.model import NOT_MINIMAL, Calls
from fsm.solve.stepping.vectors import copy_into, kept, scaled


@kernel
def to_minimal(
    model: Segments, t: float, q: np.ndarray, u: np.ndarray, y: np.ndarray, v: np.ndarray
) -> tuple[int, int]:
    """See `fsm.solve.stepping.model`."""
    table, tree = model.table, tree_of(model.table)
    if tree.links.shape[0] == 0 or tree.links[0, joint_tree.CHILD] < 0:
        return 0, 0
    place(table, t, q, u)
    lock(model, 0.0)
    project(model, t, at.MEASURE)  # sets the multipliers to zero: the coordinates of joints need none
    joint_tree.refer(tree, floats_2d(table, at.POSES), floats_2d(table, at.RATES), y, v)
    last = tree.links[tree.links.shape[0] - 1]
    coordinates = last[joint_tree.SLIDES] + (4 if last[joint_tree.TURNS] == 3 else last[joint_tree.TURNS])
    return last[joint_tree.FIRST_COORDINATE] + coordinates, last[joint_tree.FIRST_RATE] + last[joint_tree.RATES]


@kernel
def minimal_rates(
    model: Segments, t: float, y: np.ndarray, v: np.ndarray, of_y: np.ndarray, of_v: np.ndarray, of_pairs: np.ndarray,
    drive_force: np.ndarray, counts: bool,
) -> tuple[bool, float, float]:  # fmt: skip
    """See `fsm.solve.stepping.model`."""
    table, tree = model.table, tree_of(model.table)
    poses, rates = floats_2d(table, at.POSES), floats_2d(table, at.RATES)
    joint_tree.place_links(tree, y, v, poses, rates)
    put_in = lost = 0.0
    if counts:
        put_in, lost = forces_and_powers(model, t, of_pairs, drive_force)
    else:
        sum_forces(model, t, 0.0)
    good = joint_tree.accelerate(tree, poses, floats_2d(table, at.INERTIA), floats_2d(table, at.FORCE), of_v)
    joint_tree.coordinate_rates(tree, y, v, of_y)
    return good, put_in, lost


@kernel
def from_minimal(model: Segments, y: np.ndarray, v: np.ndarray, q: np.ndarray, u: np.ndarray) -> float:
    """See `fsm.solve.stepping.model`."""
    table, tree, free = model.table, tree_of(model.table), integers_1d(model.table, at.FREE)
    poses, rates = floats_2d(table, at.POSES), floats_2d(table, at.RATES)
    joint_tree.with_unit_turns(tree, y)
    joint_tree.place_links(tree, y, v, poses, rates)
    for i in range(free.shape[0]):
        for k in range(7):
            q[7 * i + k] = poses[free[i], k]
        for k in range(6):
            u[6 * i + k] = rates[free[i], k]
    return joint_tree.longest_step_of_turns(tree, v)


@kernel
def from_minimal_changes(
    model: Segments, y: np.ndarray, change: np.ndarray, of_rates: np.ndarray, moved: np.ndarray, faster: np.ndarray
) -> bool:
    """See `fsm.solve.stepping.model`."""
    table, tree, free = model.table, tree_of(model.table), integers_1d(model.table, at.FREE)
    poses, out = floats_2d(table, at.POSES), tree.force
    for turns, small, result in ((True, change, moved), (False, of_rates, faster)):
        joint_tree.spread(tree, poses, y, small, turns, out)
        for i in range(free.shape[0]):
            for k in range(6):
                result[6 * i + k] = out[free[i], k]
    return True


MINIMAL = to_minimal, minimal_rates, from_minimal, from_minimal_changes
"""Last kernels of `Calls`."""


# equations --------------------------------------------------------------------------------------------------------------


@kernel
def _factors_of(model: Segments, whole: bool) -> bool:
    table = model.table
    return set_factors(
        model.equations, pattern_of(table), floats_3d(table, at.MATRIX), floats_3d(table, at.FACTORS), model.flags, whole
    )


@kernel
def _set_matrix(table: np.ndarray, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> None:
    """Write S to the matrix."""
    matrix, stiffness, damping = floats_3d(table, at.MATRIX), floats_3d(table, at.STIFFNESS), floats_3d(table, at.DAMPING)
    turned = floats_3d(table, at.TURNED)
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
        copy_into(effective_stiffness(stiffness, matrix, 1.0, turned, pattern_of(table).columns), matrix)


@kernel
def _factorise(model: Segments, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> bool:
    _set_matrix(model.table, by_rate, by_acceleration, x, maps)
    return _factors_of(model, True)


@kernel
def _factorise_mass(model: Segments) -> bool:
    floats_3d(model.table, at.MATRIX)[:] = 0.0
    add_inertia(model.table, 1.0)
    return _factors_of(model, False)


@kernel
def _solve(model: Segments, right: np.ndarray) -> np.ndarray:
    table = model.table
    return solution(
        model.equations, pattern_of(table), floats_3d(table, at.MATRIX), floats_3d(table, at.FACTORS), model.flags, right
    )


@kernel
def _mapped(model: Segments, change: np.ndarray) -> np.ndarray:
    turned = floats_3d(model.table, at.TURNED)
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
    mass, out = floats_1d(model.table, at.MASS), np.empty(vector.shape[0])
    for i in range(vector.shape[0]):
        out[i] = mass[i] * vector[i]
    return out


@kernel
def _stiffness_times(model: Segments, vector: np.ndarray) -> np.ndarray:
    stiffness, p = floats_3d(model.table, at.STIFFNESS), pattern_of(model.table)
    return stiffness_times(model.equations, p, stiffness, model.flags, vector)


@kernel
def _damping_times(model: Segments, vector: np.ndarray) -> np.ndarray:
    p = pattern_of(model.table)
    return multiply_blocks(p.rows, p.columns, floats_3d(model.table, at.DAMPING), vector)


@kernel
def _unable(model: Segments) -> bool:
    return model.flags[FAILED] == 1 or lack_pairs(model.groups)


@kernel
def _keep_tangent(model: Segments, by_stiffness: float, by_damping: float, first: bool) -> bool:
    table = model.table
    kept(floats_3d(table, at.STIFFNESS), by_stiffness, first, floats_3d(table, at.KEPT_STIFFNESS))
    kept(floats_3d(table, at.DAMPING), by_damping, first, floats_3d(table, at.KEPT_DAMPING))
    keep_low_rank(model.equations, by_stiffness, first)
    return True


# contacts ---------------------------------------------------------------------------------------------------------------


@kernel
def _contacts_opened(model: Segments) -> bool:
    return bool(have_opened(model.groups))


@kernel
def _part_of_step(model: Segments, t: float, q: np.ndarray, u: np.ndarray, step: float) -> float:
    if model.groups.shape[0] == 0 and model.elements.shape[0] == 0:
        return 1.0
    place(model.table, t, q, u)
    part = 1.0
    if model.groups.shape[0] > 0:
        part = model.by_contacts.part_of_step(model.table, model.groups, model.contact_laws, t, step)
    return accepted_part(float(part), part_before_event(model, t, step))


@kernel
def _longest_step(model: Segments, t: float, q: np.ndarray, u: np.ndarray) -> float:
    if model.groups.shape[0] == 0:
        return np.inf
    place(model.table, t, q, u)
    longest = model.by_contacts.longest_step(model.table, model.groups, model.contact_laws, t)
    return float(longest)


@kernel
def _accept(model: Segments, t: float, q: np.ndarray, u: np.ndarray) -> float:
    if model.groups.shape[0] == 0 and model.elements.shape[0] == 0:
        return np.inf
    place(model.table, t, q, u)
    accept_elements(model, t)
    if model.groups.shape[0] == 0:
        return np.inf
    model.by_contacts.accept(model.table, model.groups, model.contact_laws, t, False)
    longest = model.by_contacts.longest_step(model.table, model.groups, model.contact_laws, t)
    return float(longest)


KERNELS = Calls(
    force, renewed_force, _factorise, _factorise_mass, _solve, _mapped, retract, _mass_times, _stiffness_times,
    _damping_times, _contacts_opened, _part_of_step, _longest_step, _accept, _unable, energies,
    _keep_tangent, powers, lock, advance, consistent, *MINIMAL,
)  # fmt: skip
"""Kernels of `Segments` that time steps call."""
WITHOUT_TREE = KERNELS._replace(**dict(zip(Calls._fields[-len(NOT_MINIMAL) :], NOT_MINIMAL, strict=True)))
"""Kernels of `Segments` without a tree of joints."""
