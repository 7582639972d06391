"""Kernels of a compiled model (`ArrayModel`) that time steps call; see `fsm.model.system.arrays` and
`fsm.solve.stepping.model`.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_3d
from fsm.kernels.block_equations import FAILED, keep_low_rank, set_factors, solution, stiffness_times
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
from fsm.model.bodies.array_forces import energies as energies_of_bodies
from fsm.model.bodies.array_kernels import MINIMAL
from fsm.model.bodies.array_locked import add_inertia
from fsm.model.bodies.array_locked import set_matrix as set_matrix_of_bodies
from fsm.model.bodies.arrays import MASS as BODY_MASS
from fsm.model.bodies.arrays import MATRIX as BODY_MATRIX
from fsm.model.bodies.arrays import TURNED as BODIES_TURNED
from fsm.model.bodies.contact_arrays import lack_pairs, touching
from fsm.model.nodes.arrays import MASS, Coordinates, mass_of
from fsm.model.nodes.system.array_forces import rows_times, set_halfway, set_matrix
from fsm.model.nodes.system.array_kernels import energies as energies_of_nodes
from fsm.model.nodes.system.array_kernels import present_powers as powers_of_nodes
from fsm.model.system.array_forces import accept_nodes_and_frames, force, free_bodies, place, renewed_force, retract
from fsm.model.system.array_locked import advance, consistent, lock, measure_step
from fsm.model.system.arrays import TURNED, Joined, matrices_of, sizes
from fsm.solve.stepping.model import CREASES, KINETIC, NOT_MINIMAL, PANELS, STEADY, Calls
from fsm.solve.stepping.vectors import copy_into, kept, scaled

# equations --------------------------------------------------------------------------------------------------------------


@kernel
def _factorise(model: Joined, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> bool:
    _set_matrix(model.nodes, model, by_rate, by_acceleration, x, maps)
    return _factors_of(model, True)


@kernel
def _set_matrix(
    nodes: Coordinates | None, model: Joined, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool
) -> None:
    """Write S to the matrix."""
    if nodes is None:
        set_matrix_of_bodies(model.bodies.table, by_rate, by_acceleration, x, maps)
        return
    free, turned = free_bodies(model), floats_3d(model.table, TURNED)
    if free == 0:
        set_matrix(nodes.table, by_rate, by_acceleration)
        return
    own, turns, mass = matrices_of(model), floats_3d(model.bodies.table, BODIES_TURNED), floats_3d(nodes.table, MASS)
    change = x[: 6 * free]
    copy_into(increment_blocks(change if maps else scaled(0.0, change)), turns)
    for i in range(free):
        for a in range(3):
            for b in range(3):
                turned[2 * i + 1, a, b] = turns[i, 3 + a, 3 + b]
    for k in range(mass.shape[0]):
        for a in range(3):
            for b in range(3):
                own.matrix[k, a, b] = by_rate * own.damping[k, a, b] + by_acceleration * mass[k, a, b]
    copy_into(effective_stiffness(own.stiffness, own.matrix, 1.0, turned, own.pattern.columns), own.matrix)


@kernel
def _factors_of(model: Joined, whole: bool) -> bool:
    own = matrices_of(model)
    return bool(set_factors(model.equations, own.pattern, own.matrix, own.factors, model.flags, whole))


@kernel
def _factorise_mass(model: Joined) -> bool:
    _set_mass(model.nodes, model)
    return _factors_of(model, False)


@kernel
def _set_mass(nodes: Coordinates | None, model: Joined) -> None:
    """Write M to the matrix."""
    if nodes is None:
        floats_3d(model.bodies.table, BODY_MATRIX)[:] = 0.0
        add_inertia(model.bodies.table, 1.0)
        return
    copy_into(floats_3d(nodes.table, MASS), matrices_of(model).matrix)


@kernel
def _solve(model: Joined, right: np.ndarray) -> np.ndarray:
    own = matrices_of(model)
    return solution(model.equations, own.pattern, own.matrix, own.factors, model.flags, right)


@kernel
def _mapped(model: Joined, change: np.ndarray) -> np.ndarray:
    turned = floats_3d(model.bodies.table, BODIES_TURNED)
    if turned.shape[0] == 0:
        return change
    out = change.copy()
    for i in range(turned.shape[0]):
        for a in range(6):
            total = 0.0
            for b in range(6):
                total += turned[i, a, b] * change[6 * i + b]
            out[6 * i + a] = total
    return out


@kernel
def _mass_times(model: Joined, vector: np.ndarray) -> np.ndarray:
    mass, out = floats_1d(model.bodies.table, BODY_MASS), np.empty(vector.shape[0])
    for i in range(mass.shape[0]):
        out[i] = mass[i] * vector[i]
    _node_mass_times(model.nodes, vector, out, mass.shape[0])
    return out


@kernel
def _node_mass_times(nodes: Coordinates | None, vector: np.ndarray, out: np.ndarray, first: int) -> None:
    if nodes is None:
        return
    copy_into(rows_times(mass_of(nodes.table), vector[first:]), out[first:])


@kernel
def _stiffness_times(model: Joined, vector: np.ndarray) -> np.ndarray:
    own = matrices_of(model)
    return stiffness_times(model.equations, own.pattern, own.stiffness, model.flags, vector)


@kernel
def _damping_times(model: Joined, vector: np.ndarray) -> np.ndarray:
    own = matrices_of(model)
    return multiply_blocks(own.pattern.rows, own.pattern.columns, own.damping, vector)


@kernel
def _unable(model: Joined) -> bool:
    return model.flags[FAILED] == 1 or lack_pairs(model.bodies.groups)


@kernel
def _keep_tangent(model: Joined, by_stiffness: float, by_damping: float, first: bool) -> bool:
    own = matrices_of(model)
    kept(own.stiffness, by_stiffness, first, own.kept_stiffness)
    kept(own.damping, by_damping, first, own.kept_damping)
    keep_low_rank(model.equations, by_stiffness, first)
    return True


# contacts and memory ----------------------------------------------------------------------------------------------------


@kernel
def _touching(model: Joined) -> tuple[int, bool]:
    return touching(model.bodies.groups)


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
    if model.bodies.groups.shape[0] == 0:
        return np.inf
    place(model, t, q, u)
    return _longest_of_impacts(model, t)


@kernel
def _longest_of_impacts(model: Joined, t: float) -> float:
    bodies = model.bodies
    longest = bodies.by_contacts.longest_step(bodies.table, bodies.groups, bodies.contact_laws, t)
    return float(longest)


@kernel
def _accept(model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> float:
    bodies, alone = model.bodies, model.table.shape[0] == 0
    if alone and bodies.groups.shape[0] == 0 and bodies.elements.shape[0] == 0:
        return np.inf
    place(model, t, q, u)
    accept_nodes_and_frames(model.nodes, model, t)
    accept_elements(bodies, t)
    if bodies.groups.shape[0] == 0:
        return np.inf
    bodies.by_contacts.accept(bodies.table, bodies.groups, bodies.contact_laws, t, False)
    return _longest_of_impacts(model, t)


# energies ---------------------------------------------------------------------------------------------------------------


@kernel
def _energies(
    model: Joined, t: float, q: np.ndarray, u: np.ndarray, step: float, record: np.ndarray
) -> tuple[float, float, float, float, float]:
    return _energies_of(model.nodes, model, t, q, u, step, record)


@kernel
def _energies_of(
    nodes: Coordinates | None, model: Joined, t: float, q: np.ndarray, u: np.ndarray, step: float, record: np.ndarray
) -> tuple[float, float, float, float, float]:
    if nodes is None:
        return energies_of_bodies(model.bodies, t, q, u, step, record)
    first, own = sizes(model)
    kinetic, stored, lost, power, _ = energies_of_nodes(nodes, t, q[first:], u[own:], step, record)
    panels, creases = record[PANELS], record[CREASES]
    place(model, t, q, u)
    of_bodies = present_energies(model.bodies, t, step, record)
    kinetic += of_bodies[0]
    record[KINETIC], record[STEADY] = kinetic, 0.0  # unknown
    record[PANELS] += panels
    record[CREASES] += creases
    return kinetic, stored + of_bodies[1], lost + of_bodies[2], power + of_bodies[3], of_bodies[4]


@kernel
def _powers(
    model: Joined, t: float, q: np.ndarray, u: np.ndarray, of_pairs: np.ndarray, drive_force: np.ndarray
) -> tuple[float, float]:
    place(model, t, q, u)
    put_in, lost = present_powers(model.bodies, t, of_pairs, drive_force)
    of_nodes = _powers_of(model.nodes, t, drive_force)
    return put_in + of_nodes[0], lost + of_nodes[1]


@kernel
def _powers_of(nodes: Coordinates | None, t: float, drive_force: np.ndarray) -> tuple[float, float]:
    if nodes is None:
        return 0.0, 0.0
    return powers_of_nodes(nodes, t, drive_force)


@kernel
def _halfway(model: Joined, t: float, h: float, q: np.ndarray, x: np.ndarray) -> bool:
    return _halfway_of_nodes(model.nodes, model, t, h, q, x)


@kernel
def _halfway_of_nodes(
    nodes: Coordinates | None, model: Joined, t: float, h: float, q: np.ndarray, x: np.ndarray
) -> bool:
    if nodes is None:
        return False
    first, own = sizes(model)
    return bool(set_halfway(nodes, t, h, q[first:], x[own:]))


KERNELS = Calls(
    force, renewed_force, _factorise, _factorise_mass, _solve, _mapped, retract, _mass_times, _stiffness_times,
    _damping_times, _touching, _part_of_step, _longest_step, _accept, _unable, _energies,
    _keep_tangent, _powers, lock, advance, measure_step, _halfway, consistent, *NOT_MINIMAL,
)  # fmt: skip
"""Kernels of `Joined` that time steps call."""
WITH_TREE = KERNELS._replace(**dict(zip(Calls._fields[-len(MINIMAL) :], MINIMAL, strict=True)))
"""Kernels of bodies alone with a tree of joints."""
