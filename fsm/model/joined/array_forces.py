"""Kernels of bodies, ANCF elements and frames as a compiled model: places, forces, tangents; see
`fsm.model.joined.arrays`.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.body_poses import scatter_free
from fsm.kernels.jit import kernel
from fsm.model.bodies.array_forces import place as place_bodies
from fsm.model.bodies.array_forces import sum_forces as sum_body_forces
from fsm.model.bodies.array_forces import sum_tangents as sum_body_tangents
from fsm.model.bodies.arrays import DAMPING as BODY_DAMPING
from fsm.model.bodies.arrays import FORCE as WRENCHES
from fsm.model.bodies.arrays import FREE, POSES, RATES, springs_of
from fsm.model.bodies.arrays import STIFFNESS as BODY_STIFFNESS
from fsm.model.bodies.arrays import pattern_of as body_pattern_of
from fsm.model.bodies.contact_arrays import keep_loaded
from fsm.model.joined import arrays as at
from fsm.model.joined.arrays import Joined, frames_of
from fsm.model.joined.condense import add_condensed, add_curvatures, fold_forces
from fsm.model.joined.frames import frame_maps, place_frames
from fsm.model.nodes.arrays import DAMPING, FIXED, FORCE, STIFFNESS, Q, U
from fsm.model.nodes.arrays import pattern_of as joined_pattern_of
from fsm.model.nodes.system.array_forces import forces_of_coordinates, hold
from fsm.model.nodes.system.array_forces import place as place_nodes
from fsm.model.nodes.system.array_forces import sum_forces as sum_node_forces
from fsm.model.nodes.system.array_forces import sum_tangents as sum_node_tangents


@kernel
def free_bodies(model: Joined) -> int:
    """Number of free bodies."""
    return int(integers_1d(model.bodies.table, FREE).shape[0])


@kernel
def fill_maps(model: Joined) -> None:
    """Compute maps, their derivatives, curvatures and rates of the frames at the present coordinates and moments."""
    table, nodes, free = model.table, model.nodes.table, free_bodies(model)
    f = frames_of(table)
    frame_maps(
        f.first, f.vectors, f.weights, f.along, f.across, f.fixed, f.oriented, floats_1d(nodes, Q), floats_1d(nodes, U),
        floats_2d(table, at.MOMENTS), floats_3d(table, at.MEMBERS)[2 * free :], floats_3d(table, at.TURNING)[2 * free :],
        floats_3d(table, at.CURVATURES), floats_2d(table, at.OWN_RATES),
    )  # fmt: skip


@kernel
def place(model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> None:
    """Write poses and rates of all bodies and frames, and coordinates and rates of all nodes."""
    bodies, nodes, free = model.bodies.table, model.nodes.table, free_bodies(model)
    place_bodies(bodies, t, q[: 7 * free], u[: 6 * free])
    place_nodes(nodes, t, t, q[7 * free :], u[6 * free :])
    set_frames(model, floats_1d(nodes, Q))
    fill_maps(model)
    copy_rates(model, floats_2d(bodies, RATES))


@kernel
def set_frames(model: Joined, q: np.ndarray) -> None:
    """Write the poses of all frames at these coordinates of the nodes."""
    f, poses, near = frames_of(model.table), floats_2d(model.bodies.table, POSES), floats_2d(model.table, at.NEAR)
    place_frames(f.bodies, f.first, f.vectors, f.weights, f.along, f.across, f.fixed, f.oriented, q, near, poses)


@kernel
def copy_rates(model: Joined, rates: np.ndarray) -> None:
    """Copy the rates of all frames to those of bodies, (n_bodies, 6)."""
    bodies, own = integers_1d(model.table, at.AT), floats_2d(model.table, at.OWN_RATES)
    for i in range(bodies.shape[0]):
        for k in range(6):
            rates[bodies[i], k] = own[i, k]


@kernel
def spread(model: Joined, change: np.ndarray, rates: np.ndarray) -> None:
    """Write an increment or a rate (nu,) as those of all bodies and frames, (n_bodies, 6), with the present maps."""
    free, table, fixed = integers_1d(model.bodies.table, FREE), model.table, integers_2d(model.nodes.table, FIXED)
    f, rows, held, first = frames_of(table), integers_1d(table, at.NODE_ROWS), fixed.reshape(-1), 6 * free.shape[0]
    maps = floats_3d(table, at.MEMBERS)[2 * free.shape[0] :]
    rates[:] = 0.0
    scatter_free(free, change[:first], change.shape[0] < 0, rates)
    for i in range(f.bodies.shape[0]):
        for j in range(f.first[i], f.first[i + 1]):
            for c in range(3):
                if held[3 * rows[j] + c] == 0:
                    for k in range(6):
                        rates[f.bodies[i], k] += maps[j, k, c] * change[first + 3 * rows[j] + c]


@kernel
def folded(model: Joined, q: np.ndarray) -> np.ndarray:
    """Generalised forces (nu,) from the present wrenches on bodies and forces on coordinates."""
    bodies, nodes, table, free = model.bodies.table, model.nodes.table, model.table, integers_1d(model.bodies.table, FREE)
    f, wrenches, on_frames = frames_of(table), floats_2d(bodies, WRENCHES), floats_2d(table, at.OWN_RATES)
    count = free.shape[0]
    for i in range(f.bodies.shape[0]):
        for k in range(6):
            on_frames[i, k] = wrenches[f.bodies[i], k]
    maps = floats_3d(table, at.MEMBERS)[2 * count :]
    fold_forces(on_frames, f.first, integers_1d(table, at.NODE_ROWS), maps, floats_1d(nodes, FORCE))
    of_nodes = forces_of_coordinates(nodes, q[7 * count :])
    out = np.empty(6 * count + of_nodes.shape[0])
    for i in range(count):
        for k in range(6):
            out[6 * i + k] = wrenches[free[i], k]
    for i in range(of_nodes.shape[0]):
        out[6 * count + i] = of_nodes[i]
    return out


@kernel
def force(model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    place(model, t, q, u)
    sum_body_forces(model.bodies, t, 0.0)
    sum_node_forces(model.nodes, t, 1.0)
    return folded(model, q)


@kernel
def set_moments(model: Joined) -> None:
    """Compute the curvatures of the present moments on the frames."""
    moments, wrenches = floats_2d(model.table, at.MOMENTS), floats_2d(model.bodies.table, WRENCHES)
    f, any_moment = frames_of(model.table), False
    for i in range(f.bodies.shape[0]):
        for k in range(3):
            moments[i, k] = wrenches[f.bodies[i], 3 + k]
            any_moment = any_moment or (f.oriented[i] == 1 and moments[i, k] != 0.0)
    if any_moment:  # if there are no moments, `place` has already computed all maps
        fill_maps(model)
    moments[:] = 0.0


@kernel
def add_turning(model: Joined) -> None:
    """Add the change of the rates of frames with the coordinates, times the damping between bodies and frames."""
    oriented, turns = frames_of(model.table).oriented, False
    for i in range(oriented.shape[0]):
        turns = turns or oriented[i] == 1
    if not turns:
        return
    bodies, table, p = model.bodies.table, model.table, body_pattern_of(model.bodies.table)
    first, starts, slots = integers_1d(table, at.OF_MEMBERS), integers_1d(table, at.STARTS), integers_1d(table, at.SLOTS)
    add_condensed(
        p.rows, p.columns, floats_3d(bodies, BODY_DAMPING), first, floats_3d(table, at.MEMBERS),
        floats_3d(table, at.TURNING), starts, slots, floats_3d(model.nodes.table, STIFFNESS),
    )  # fmt: skip


@kernel
def condense(model: Joined) -> None:
    """Add the tangents between bodies and frames to the joined matrices, apart from `add_turning`."""
    bodies, nodes, table = model.bodies.table, model.nodes.table, model.table
    p, joined = body_pattern_of(bodies), joined_pattern_of(nodes)
    stiffness, damping = floats_3d(nodes, STIFFNESS), floats_3d(nodes, DAMPING)
    by_pose, by_rate = floats_3d(bodies, BODY_STIFFNESS), floats_3d(bodies, BODY_DAMPING)
    first, starts, slots = integers_1d(table, at.OF_MEMBERS), integers_1d(table, at.STARTS), integers_1d(table, at.SLOTS)
    members = floats_3d(table, at.MEMBERS)
    add_condensed(p.rows, p.columns, by_pose, first, members, members, starts, slots, stiffness)
    add_condensed(p.rows, p.columns, by_rate, first, members, members, starts, slots, damping)
    f = frames_of(table)
    add_curvatures(
        joined.rows, joined.columns, f.first, integers_1d(table, at.ROWS), f.along, f.across,
        floats_3d(table, at.CURVATURES), stiffness,
    )  # fmt: skip


@kernel
def renewed_force(model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    place(model, t, q, u)
    sum_body_tangents(model.bodies, t, 0.0, springs_of(model.bodies.table).last[:0], q[:0], False)
    keep_loaded(model.bodies.groups)
    floats_3d(model.nodes.table, DAMPING)[:] = 0.0
    sum_node_tangents(model.nodes, t, 1.0)
    set_moments(model)
    add_turning(model)
    condense(model)
    hold(model.nodes.table)
    return folded(model, q)
