"""Kernels of bodies and ANCF elements as a compiled model (`ArrayModel`) that time steps call; see
`fsm.model.joined.arrays`.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d
from fsm.kernels.block_equations import FAILED, stiffness_times
from fsm.kernels.block_lu import multiply_blocks
from fsm.kernels.body_poses import increment_blocks
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import effective_stiffness
from fsm.model.bodies.array_forces import (
    accept_elements,
    accepted_part,
    part_before_event,
    present_energies,
    present_powers,
)
from fsm.model.bodies.arrays import MASS as BODY_MASS
from fsm.model.bodies.arrays import POSES
from fsm.model.bodies.contact_arrays import have_opened, lack_pairs
from fsm.model.joined.array_forces import force, free_bodies, place, renewed_force
from fsm.model.joined.array_locked import advance, consistent, lock
from fsm.model.joined.array_statics import retract
from fsm.model.joined.arrays import NEAR, TURNED, Joined, frames_of
from fsm.model.nodes.arrays import DAMPING, MASS, MATRIX, STIFFNESS, mass_of
from fsm.model.nodes.arrays import pattern_of as joined_pattern_of
from fsm.model.nodes.system.array_forces import factorise_matrix, rows_times, set_matrix, solve
from fsm.model.nodes.system.array_kernels import accept_present, keep_tangent
from fsm.model.nodes.system.array_kernels import energies as energies_of_nodes
from fsm.model.nodes.system.array_kernels import present_powers as powers_of_nodes
from fsm.solve.stepping.model import CREASES, KINETIC, NOT_MINIMAL, PANELS, STEADY, Calls
from fsm.solve.stepping.vectors import copy_into


@kernel
def _factorise(model: Joined, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> bool:
    nodes, free, turned = model.nodes.table, free_bodies(model), floats_3d(model.table, TURNED)
    if free == 0:
        set_matrix(nodes, by_rate, by_acceleration)
        return bool(factorise_matrix(model.nodes, True))
    turns = increment_blocks(x[: 6 * free])
    for i in range(free):
        for a in range(3):
            for b in range(3):
                turned[2 * i + 1, a, b] = turns[i, 3 + a, 3 + b] if maps else 1.0 if a == b else 0.0
    matrix, damping, mass = floats_3d(nodes, MATRIX), floats_3d(nodes, DAMPING), floats_3d(nodes, MASS)
    for k in range(matrix.shape[0]):
        for a in range(3):
            for b in range(3):
                matrix[k, a, b] = by_rate * damping[k, a, b] + by_acceleration * mass[k, a, b]
    columns = joined_pattern_of(nodes).columns
    copy_into(effective_stiffness(floats_3d(nodes, STIFFNESS), matrix, 1.0, turned, columns), matrix)
    return bool(factorise_matrix(model.nodes, True))


@kernel
def _factorise_mass(model: Joined) -> bool:
    copy_into(floats_3d(model.nodes.table, MASS), floats_3d(model.nodes.table, MATRIX))
    return bool(factorise_matrix(model.nodes, False))


@kernel
def _solve(model: Joined, right: np.ndarray) -> np.ndarray:
    return solve(model.nodes, right)


@kernel
def _mapped(model: Joined, change: np.ndarray) -> np.ndarray:
    turned, out = floats_3d(model.table, TURNED), change.copy()
    for i in range(free_bodies(model)):
        for a in range(3):
            total = 0.0
            for b in range(3):
                total += turned[2 * i + 1, a, b] * change[6 * i + 3 + b]
            out[6 * i + 3 + a] = total
    return out


@kernel
def _mass_times(model: Joined, vector: np.ndarray) -> np.ndarray:
    mass, out = floats_1d(model.bodies.table, BODY_MASS), np.empty(vector.shape[0])
    count = mass.shape[0]
    for i in range(count):
        out[i] = mass[i] * vector[i]
    copy_into(rows_times(mass_of(model.nodes.table), vector[count:]), out[count:])
    return out


@kernel
def _stiffness_times(model: Joined, vector: np.ndarray) -> np.ndarray:
    nodes = model.nodes
    stiffness, p = floats_3d(nodes.table, STIFFNESS), joined_pattern_of(nodes.table)
    return stiffness_times(nodes.equations, p, stiffness, model.flags, vector)


@kernel
def _damping_times(model: Joined, vector: np.ndarray) -> np.ndarray:
    p = joined_pattern_of(model.nodes.table)
    return multiply_blocks(p.rows, p.columns, floats_3d(model.nodes.table, DAMPING), vector)


@kernel
def _unable(model: Joined) -> bool:
    return model.flags[FAILED] == 1 or lack_pairs(model.bodies.groups)


# contacts and frames ----------------------------------------------------------------------------------------------------


@kernel
def _contacts_opened(model: Joined) -> bool:
    return bool(have_opened(model.bodies.groups))


@kernel
def _part_of_step(model: Joined, t: float, q: np.ndarray, u: np.ndarray, step: float) -> float:
    bodies = model.bodies
    if bodies.groups.shape[0] == 0 and bodies.elements.shape[0] == 0:
        return 1.0
    place(model, t, q, u)
    part = 1.0
    if bodies.groups.shape[0] > 0:
        part = bodies.by_contacts.part_of_step(bodies.table, bodies.groups, bodies.contact_laws, t, step)
    return accepted_part(float(part), part_before_event(bodies, t, step))


@kernel
def _longest_step(model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> float:
    bodies = model.bodies
    if bodies.groups.shape[0] == 0:
        return np.inf
    place(model, t, q, u)
    longest = bodies.by_contacts.longest_step(bodies.table, bodies.groups, bodies.contact_laws, t)
    return float(longest)


@kernel
def _accept(model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> float:
    bodies = model.bodies
    place(model, t, q, u)
    poses, near, f = floats_2d(bodies.table, POSES), floats_2d(model.table, NEAR), frames_of(model.table)
    for i in range(f.bodies.shape[0]):
        for k in range(4):
            near[i, k] = poses[f.bodies[i], 3 + k]
    accept_present(model.nodes, t)
    accept_elements(bodies, t)
    if bodies.groups.shape[0] == 0:
        return np.inf
    bodies.by_contacts.accept(bodies.table, bodies.groups, bodies.contact_laws, t, False)
    longest = bodies.by_contacts.longest_step(bodies.table, bodies.groups, bodies.contact_laws, t)
    return float(longest)


# energies ---------------------------------------------------------------------------------------------------------------


@kernel
def _energies(
    model: Joined, t: float, q: np.ndarray, u: np.ndarray, step: float, record: np.ndarray
) -> tuple[float, float, float, float, float]:
    free = free_bodies(model)
    kinetic, stored, lost, power, _ = energies_of_nodes(model.nodes, t, q[7 * free :], u[6 * free :], step, record)
    panels, creases = record[PANELS], record[CREASES]
    place(model, t, q, u)
    of_bodies = present_energies(model.bodies, t, step, record)
    kinetic += of_bodies[0]
    record[KINETIC], record[STEADY] = kinetic, 0.0  # unknown
    record[PANELS] += panels
    record[CREASES] += creases
    return kinetic, stored + of_bodies[1], lost + of_bodies[2], power + of_bodies[3], of_bodies[4]


@kernel
def _keep_tangent(model: Joined, by_stiffness: float, by_damping: float, first: bool) -> bool:
    return bool(keep_tangent(model.nodes, by_stiffness, by_damping, first))


@kernel
def _powers(
    model: Joined, t: float, q: np.ndarray, u: np.ndarray, of_pairs: np.ndarray, drive_force: np.ndarray
) -> tuple[float, float]:
    place(model, t, q, u)
    put_in, lost = present_powers(model.bodies, t, of_pairs, drive_force)
    of_nodes = powers_of_nodes(model.nodes, t, drive_force)
    return put_in + of_nodes[0], lost + of_nodes[1]


KERNELS = Calls(
    force, renewed_force, _factorise, _factorise_mass, _solve, _mapped, retract, _mass_times, _stiffness_times,
    _damping_times, _contacts_opened, _part_of_step, _longest_step, _accept, _unable, _energies,
    _keep_tangent, _powers, lock, advance, consistent, *NOT_MINIMAL,
)  # fmt: skip
"""Kernels of `Joined` that time steps call."""
