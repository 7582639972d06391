"""Kernels of a compiled model that quasi-static steps call; see `fsm.model.system.arrays` and
`fsm.solve.stepping.quasi_static`.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d, integers_2d
from fsm.kernels.block_equations import FAILED, set_factors, solution
from fsm.kernels.body_poses import scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import call_at
from fsm.model.bodies.array_locked import do_along_rates
from fsm.model.bodies.array_statics import add_damping, advance_by, largest_force_along, per_second_of, take_up
from fsm.model.bodies.array_statics import place_mean as place_mean_bodies
from fsm.model.bodies.arrays import AGAIN, FREE, INTERVAL, POSES, RATES, STEP, WORK, springs_of
from fsm.model.bodies.contact_arrays import lack_pairs, restore_depths
from fsm.model.nodes.arrays import ADVANCE_AT, FIXED, LAST, Coordinates, Q, U
from fsm.model.nodes.system.array_forces import place as place_nodes
from fsm.model.system import array_forces as forces
from fsm.model.system.arrays import FACETS, Joined, matrices_of, sizes
from fsm.solve.stepping.quasi_static import StaticCalls
from fsm.solve.stepping.vectors import copy_into


@kernel
def place_nodes_mean(nodes: Coordinates | None, model: Joined, q: np.ndarray, duration: float) -> None:
    """Write coordinates of nodes, poses of frames, and their mean rates since the last state; zero rates at rest."""
    if nodes is None:
        return
    (first, own), last, t = sizes(model), floats_1d(nodes.table, LAST), floats_1d(model.bodies.table, INTERVAL)[0]
    rates = np.zeros(own + last.shape[0])
    if duration > 0.0:
        for i in range(last.shape[0]):
            rates[own + i] = (q[first + i] - last[i]) / duration
    forces.place_nodes_and_frames(nodes, model, t, q, rates)


@kernel
def _place(model: Joined, q: np.ndarray) -> np.ndarray:
    """Write the state of a step; the result is that of `fsm.model.bodies.array_statics.place_mean`."""
    since = place_mean_bodies(model.bodies.table, q)
    place_nodes_mean(model.nodes, model, q, floats_1d(model.bodies.table, INTERVAL)[1])
    return since


@kernel
def _force(model: Joined, q: np.ndarray) -> np.ndarray:
    _place(model, q)
    t, per_second = floats_1d(model.bodies.table, INTERVAL)[0], per_second_of(model.bodies.table)
    forces.sum_forces(model, t, per_second, 1.0 if per_second > 0.0 else 0.0)
    return forces.folded(model, q)


@kernel
def _give_efforts(nodes: Coordinates | None, model: Joined, given: float) -> None:
    """Let the membrane efforts that are kept give the geometric stiffness of facets (1), or those of the coordinates (0)."""
    if nodes is None:
        return
    for row in range(FACETS + 1, model.table.shape[0], 2):
        floats_1d(model.table, row)[0] = given


@kernel
def _linearised_force(model: Joined, q: np.ndarray, mixed: bool) -> np.ndarray:
    table = model.bodies.table
    since, efforts = _place(model, q), springs_of(table).efforts
    own = efforts if mixed else efforts[:0]
    _give_efforts(model.nodes, model, 1.0 if mixed else 0.0)
    forces.sum_tangents(model, floats_1d(table, INTERVAL)[0], per_second_of(table), own, since, mixed)
    _give_efforts(model.nodes, model, 0.0)
    return forces.folded(model, q)


@kernel
def _factorise(model: Joined) -> bool:
    if lack_pairs(model.bodies.groups):
        return False
    own = matrices_of(model)
    copy_into(own.stiffness, own.matrix)
    add_damping(own.damping, per_second_of(model.bodies.table), own.matrix)
    return set_factors(model.equations, own.pattern, own.matrix, own.factors, model.flags, True)


@kernel
def _largest_force(model: Joined, span: np.ndarray, force_scale: np.ndarray) -> float:
    own = matrices_of(model)
    return largest_force_along(own.matrix, own.pattern, span, force_scale, _held_coordinates(model.nodes, model))


@kernel
def _held_coordinates(nodes: Coordinates | None, model: Joined) -> np.ndarray:
    """1 for held coordinates of nodes, else 0."""
    if nodes is None:
        return integers_1d(model.bodies.table, FREE)[:0]
    return integers_2d(nodes.table, FIXED).reshape(-1)


@kernel
def _solve(model: Joined, right: np.ndarray) -> np.ndarray:
    own, model.flags[FAILED] = matrices_of(model), 0
    x = solution(model.equations, own.pattern, own.matrix, own.factors, model.flags, right)
    if model.flags[FAILED] == 1:
        x[:] = np.nan
    return x


@kernel
def _advance(model: Joined, q: np.ndarray, dx: np.ndarray, cut: bool) -> None:
    bodies = model.bodies.table
    if cut:
        restore_depths(model.bodies.groups)
    free, poses, change = integers_1d(bodies, FREE), floats_2d(bodies, POSES), np.zeros(floats_2d(bodies, RATES).shape)
    no = q.shape[0] < 0
    scatter_free(free, q, not no and poses.shape[1] == 7, poses)
    scatter_free(free, dx, no, change)
    _change_frames(model.nodes, model, q, dx, change)
    advance_by(model.bodies, change, cut)


@kernel
def _change_frames(nodes: Coordinates | None, model: Joined, q: np.ndarray, dx: np.ndarray, change: np.ndarray) -> None:
    """Write the increments of all frames, (n_bodies, 6), along an increment of the coordinates from q."""
    if nodes is None:
        return
    (first, own), t = sizes(model), floats_1d(model.bodies.table, INTERVAL)[0]
    place_nodes(nodes.table, t, t, q[first:], floats_1d(nodes.table, U))
    forces.set_frames(model, floats_1d(nodes.table, Q))
    moved, fixed = floats_1d(nodes.table, U), integers_2d(nodes.table, FIXED).reshape(-1)
    for i in range(moved.shape[0]):
        moved[i] = 0.0 if fixed[i] == 1 else dx[own + i]
    for k in range(nodes.kernels.shape[0]):
        call_at(nodes.kernels[k, ADVANCE_AT], nodes.table, nodes.tables[k], 0.0)
    forces.fill_maps(nodes, model)
    forces.copy_rates(model, change)


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
    forces.spread(model, dx, rates)
    found = do_along_rates(bodies, bodies.at_rest, task, part)
    rates[:] = 0.0
    return found


@kernel
def _take_up(model: Joined, task: int) -> float:
    return float(take_up(model.bodies, task))


STATICS = StaticCalls(
    _force, _linearised_force, _factorise, _largest_force, _solve, forces.retract, _advance, _multiply, _work_of_locks,
    _take_up,
)  # fmt: skip
"""Kernels of `Joined` that quasi-static steps call."""
