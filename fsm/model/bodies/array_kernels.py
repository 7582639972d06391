"""Kernels of a compiled model (`ArrayModel`) for motions in the coordinates of joints that form trees; see
`fsm.solve.stepping.model` and `fsm.interactions.joint_tree`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fsm.interactions import joint_tree
from fsm.kernels.addresses import floats_2d, integers_1d
from fsm.kernels.jit import kernel
from fsm.model.bodies import arrays as at
from fsm.model.bodies.array_forces import forces_and_powers, place, sum_forces
from fsm.model.bodies.array_locked import lock, project
from fsm.model.bodies.arrays import tree_of

if TYPE_CHECKING:
    from fsm.model.system.arrays import Joined


@kernel
def to_minimal(
    whole: Joined, t: float, q: np.ndarray, u: np.ndarray, y: np.ndarray, v: np.ndarray
) -> tuple[int, int]:
    """See `fsm.solve.stepping.model`."""
    model = whole.bodies
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
    whole: Joined, t: float, y: np.ndarray, v: np.ndarray, of_y: np.ndarray, of_v: np.ndarray, of_pairs: np.ndarray,
    drive_force: np.ndarray, counts: bool,
) -> tuple[bool, float, float]:  # fmt: skip
    """See `fsm.solve.stepping.model`."""
    model = whole.bodies
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
def from_minimal(whole: Joined, y: np.ndarray, v: np.ndarray, q: np.ndarray, u: np.ndarray) -> float:
    """See `fsm.solve.stepping.model`."""
    model = whole.bodies
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
    whole: Joined, y: np.ndarray, change: np.ndarray, of_rates: np.ndarray, moved: np.ndarray, faster: np.ndarray
) -> bool:
    """See `fsm.solve.stepping.model`."""
    model = whole.bodies
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
