"""Kernels of bodies and ANCF elements as a compiled model that quasi-static steps call; see `fsm.model.joined.arrays` and
`fsm.solve.stepping.quasi_static`.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.block_equations import FAILED
from fsm.kernels.body_poses import retract_poses, scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import call_at
from fsm.model.bodies.array_forces import add_tangents_by_deformations, sum_tangents_by_rates
from fsm.model.bodies.array_forces import sum_forces as sum_body_forces
from fsm.model.bodies.array_locked import do_along_rates
from fsm.model.bodies.array_statics import add_damping, advance_by, largest_force_along, per_second_of, take_up
from fsm.model.bodies.array_statics import place_mean as place_mean_bodies
from fsm.model.bodies.arrays import AGAIN, FREE, INTERVAL, POSES, RATES, STEP, WORK, springs_of
from fsm.model.bodies.contact_arrays import lack_pairs, restore_depths
from fsm.model.joined import array_forces as joined
from fsm.model.joined.arrays import FACETS, Joined
from fsm.model.nodes.arrays import ADVANCE_AT, DAMPING, FIXED, LAST, MATRIX, STIFFNESS, Q, U
from fsm.model.nodes.arrays import pattern_of as joined_pattern_of
from fsm.model.nodes.system.array_forces import factorise_matrix, hold
from fsm.model.nodes.system.array_forces import place as place_nodes
from fsm.model.nodes.system.array_forces import solve as solve_nodes
from fsm.model.nodes.system.array_forces import sum_forces as sum_node_forces
from fsm.model.nodes.system.array_forces import sum_tangents as sum_node_tangents
from fsm.solve.stepping.quasi_static import StaticCalls
from fsm.solve.stepping.vectors import copy_into


@kernel
def place_nodes_mean(model: Joined, q: np.ndarray, duration: float) -> None:
    """Write coordinates of nodes, poses of frames, and their mean rates since the last state; zero rates at rest."""
    bodies, nodes = model.bodies.table, model.nodes.table
    last, t, rates = floats_1d(nodes, LAST), floats_1d(bodies, INTERVAL)[0], np.zeros(q.shape[0])
    if duration > 0.0:
        for i in range(rates.shape[0]):
            rates[i] = (q[i] - last[i]) / duration
    place_nodes(nodes, t, t, q, rates)
    joined.set_frames(model, floats_1d(nodes, Q))
    joined.fill_maps(model)
    joined.copy_rates(model, floats_2d(bodies, RATES))


@kernel
def _place(model: Joined, q: np.ndarray) -> np.ndarray:
    """Write the state of a step; the result is that of `fsm.model.bodies.array_statics.place_mean`."""
    first = 7 * joined.free_bodies(model)
    since = place_mean_bodies(model.bodies.table, q[:first])
    place_nodes_mean(model, q[first:], floats_1d(model.bodies.table, INTERVAL)[1])
    return since


@kernel
def _force(model: Joined, q: np.ndarray) -> np.ndarray:
    _place(model, q)
    t, per_second = floats_1d(model.bodies.table, INTERVAL)[0], per_second_of(model.bodies.table)
    sum_body_forces(model.bodies, t, per_second)
    sum_node_forces(model.nodes, t, 1.0 if per_second > 0.0 else 0.0)
    return joined.folded(model, q)


@kernel
def sum_tangents(
    model: Joined, t: float, per_second: float, efforts: np.ndarray, since: np.ndarray, at_depths: bool
) -> None:
    """Write forces, K and D of all parts at the present state; arguments as for bodies
    (`fsm.model.bodies.array_forces.sum_tangents`).
    """
    moving = 1.0 if per_second > 0.0 else 0.0
    sum_tangents_by_rates(model.bodies, t, per_second, since, at_depths)
    floats_3d(model.nodes.table, DAMPING)[:] = 0.0
    sum_node_tangents(model.nodes, t, moving)
    if moving > 0.0:  # the rates of springs and elements are increments of deformations, which do not turn
        joined.add_turning(model)
    add_tangents_by_deformations(model.bodies, t, per_second, efforts)
    joined.set_moments(model)
    joined.condense(model)
    hold(model.nodes.table)


@kernel
def _give_efforts(model: Joined, given: float) -> None:
    """Let the membrane efforts that are kept give the geometric stiffness of facets (1), or those of the coordinates (0)."""
    for row in range(FACETS + 1, model.table.shape[0], 2):
        floats_1d(model.table, row)[0] = given


@kernel
def _linearised_force(model: Joined, q: np.ndarray, mixed: bool) -> np.ndarray:
    table = model.bodies.table
    since, efforts = _place(model, q), springs_of(table).efforts
    own = efforts if mixed else efforts[:0]
    _give_efforts(model, 1.0 if mixed else 0.0)
    sum_tangents(model, floats_1d(table, INTERVAL)[0], per_second_of(table), own, since, mixed)
    _give_efforts(model, 0.0)
    return joined.folded(model, q)


@kernel
def _factorise(model: Joined) -> bool:
    if lack_pairs(model.bodies.groups):
        return False
    nodes = model.nodes.table
    matrix = floats_3d(nodes, MATRIX)
    copy_into(floats_3d(nodes, STIFFNESS), matrix)
    add_damping(floats_3d(nodes, DAMPING), per_second_of(model.bodies.table), matrix)
    return bool(factorise_matrix(model.nodes, True))


@kernel
def _largest_force(model: Joined, span: np.ndarray, force_scale: np.ndarray) -> float:
    nodes = model.nodes.table
    return largest_force_along(floats_3d(nodes, MATRIX), joined_pattern_of(nodes), span, force_scale)


@kernel
def _solve(model: Joined, right: np.ndarray) -> np.ndarray:
    model.flags[FAILED] = 0
    x = solve_nodes(model.nodes, right)
    if model.flags[FAILED] == 1:
        x[:] = np.nan
    return x


@kernel
def retract(model: Joined, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    free, out = joined.free_bodies(model), np.empty(q.shape[0])
    copy_into(retract_poses(q[: 7 * free], x[: 6 * free]), out[: 7 * free])
    for i in range(7 * free, q.shape[0]):
        out[i] = q[i] + x[i - free]
    return out


@kernel
def _advance(model: Joined, q: np.ndarray, dx: np.ndarray, cut: bool) -> None:
    bodies, nodes, free = model.bodies.table, model.nodes.table, joined.free_bodies(model)
    if cut:
        restore_depths(model.bodies.groups)
    poses, change = floats_2d(bodies, POSES), np.zeros(floats_2d(bodies, RATES).shape)
    no = q.shape[0] < 0
    scatter_free(integers_1d(bodies, FREE), q[: 7 * free], not no and poses.shape[1] == 7, poses)
    scatter_free(integers_1d(bodies, FREE), dx[: 6 * free], no, change)
    t = floats_1d(bodies, INTERVAL)[0]
    place_nodes(nodes, t, t, q[7 * free :], floats_1d(nodes, U))
    joined.set_frames(model, floats_1d(nodes, Q))
    moved, fixed = floats_1d(nodes, U), integers_2d(nodes, FIXED).reshape(-1)
    for i in range(moved.shape[0]):
        moved[i] = 0.0 if fixed[i] == 1 else dx[6 * free + i]
    for k in range(model.nodes.kernels.shape[0]):
        call_at(model.nodes.kernels[k, ADVANCE_AT], nodes, model.nodes.tables[k], 0.0)
    joined.fill_maps(model)
    joined.copy_rates(model, change)
    advance_by(model.bodies, change, cut)


@kernel
def _multiply(model: Joined, dx: np.ndarray, part: float, again: bool) -> None:
    _do_at_rest(model, dx, AGAIN if again else STEP, part)


@kernel
def _work_of_locks(model: Joined, dx: np.ndarray) -> float:
    return _do_at_rest(model, dx, WORK, 1.0)


@kernel
def _do_at_rest(model: Joined, dx: np.ndarray, task: float, part: float) -> float:
    bodies = model.bodies
    if bodies.elements.shape[0] == 0:
        return 0.0
    rates = floats_2d(bodies.at_rest, RATES)
    joined.spread(model, dx, rates)
    found = do_along_rates(bodies, bodies.at_rest, task, part)
    rates[:] = 0.0
    return found


@kernel
def _take_up(model: Joined, task: int) -> float:
    return float(take_up(model.bodies, task))


STATICS = StaticCalls(
    _force, _linearised_force, _factorise, _largest_force, _solve, retract, _advance, _multiply, _work_of_locks, _take_up
)
"""Kernels of `Joined` that quasi-static steps call."""
