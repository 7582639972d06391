"""Kernels of a compiled model (`ArrayModel`) for motions in the coordinates of joints that form trees; see
`fsm.solve.stepping.model` and `fsm.interactions.joint_tree`.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.joint_tree import (
    CHILD,
    FIRST_COORDINATE,
    FIRST_RATE,
    RATES,
    SLIDES,
    TURNS,
    accelerate,
    coordinate_rates,
    longest_step_of_turns,
    place_links,
    refer,
    spread,
    with_unit_turns,
)
from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d
from fsm.kernels.jit import kernel
from fsm.model.bodies import arrays as at
from fsm.model.bodies.array_energies import present_powers
from fsm.model.bodies.array_forces import place, sum_forces
from fsm.model.bodies.array_locked import lock, project
from fsm.model.bodies.arrays import Segments, tree_of


@kernel
def to_minimal(
    model: Segments, t: float, q: np.ndarray, u: np.ndarray, y: np.ndarray, v: np.ndarray
) -> tuple[int, int]:
    """See `fsm.solve.stepping.model`."""
    table, tree = model.table, tree_of(model.table)
    if tree.links.shape[0] == 0 or tree.links[0, CHILD] < 0:
        return 0, 0
    floats_1d(table, at.INTERVAL)[at.HELD] = 1.0
    place(table, t, q, u)
    lock(model, 0.0)
    project(model, t, at.MEASURE)  # sets the multipliers to zero: the coordinates of joints need none
    refer(tree, floats_2d(table, at.POSES), floats_2d(table, at.RATES), y, v)
    last = tree.links[tree.links.shape[0] - 1]
    coordinates = last[SLIDES] + (4 if last[TURNS] == 3 else last[TURNS])
    return last[FIRST_COORDINATE] + coordinates, last[FIRST_RATE] + last[RATES]


@kernel
def minimal_rates(
    model: Segments, t: float, y: np.ndarray, v: np.ndarray, of_y: np.ndarray, of_v: np.ndarray, of_pairs: np.ndarray,
    drive_force: np.ndarray, counts: bool,
) -> tuple[bool, float, float]:  # fmt: skip
    """See `fsm.solve.stepping.model`."""
    table, tree = model.table, tree_of(model.table)
    poses, rates = floats_2d(table, at.POSES), floats_2d(table, at.RATES)
    place_links(tree, y, v, poses, rates)
    sum_forces(model, t, 0.0)
    good = accelerate(tree, poses, floats_2d(table, at.INERTIA), floats_2d(table, at.FORCE), of_v)
    coordinate_rates(tree, y, v, of_y)
    if not counts:
        return good, 0.0, 0.0
    put_in, lost = present_powers(model, t, of_pairs, drive_force)
    return good, put_in, lost


@kernel
def from_minimal(model: Segments, y: np.ndarray, v: np.ndarray, q: np.ndarray, u: np.ndarray) -> float:
    """See `fsm.solve.stepping.model`."""
    table, tree, free = model.table, tree_of(model.table), integers_1d(model.table, at.FREE)
    poses, rates = floats_2d(table, at.POSES), floats_2d(table, at.RATES)
    with_unit_turns(tree, y)
    place_links(tree, y, v, poses, rates)
    for i in range(free.shape[0]):
        for k in range(7):
            q[7 * i + k] = poses[free[i], k]
        for k in range(6):
            u[6 * i + k] = rates[free[i], k]
    return longest_step_of_turns(tree, v)


@kernel
def from_minimal_changes(
    model: Segments, y: np.ndarray, change: np.ndarray, of_rates: np.ndarray, moved: np.ndarray, faster: np.ndarray
) -> bool:
    """See `fsm.solve.stepping.model`."""
    table, tree, free = model.table, tree_of(model.table), integers_1d(model.table, at.FREE)
    poses, out = floats_2d(table, at.POSES), tree.force
    for turns, small, result in ((True, change, moved), (False, of_rates, faster)):
        spread(tree, poses, y, small, turns, out)
        for i in range(free.shape[0]):
            for k in range(6):
                result[6 * i + k] = out[free[i], k]
    return True


MINIMAL = to_minimal, minimal_rates, from_minimal, from_minimal_changes
"""Last kernels of `Calls`."""
