"""Kernels of bodies, ANCF elements and frames as a compiled model: places, forces, tangents; see
`fsm.model.system.arrays`.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.body_poses import gather_free, scatter_free
from fsm.kernels.jit import kernel
from fsm.model.bodies.array_forces import add_tangents_by_deformations, sum_tangents_by_rates
from fsm.model.bodies.array_forces import place as place_bodies
from fsm.model.bodies.array_forces import retract as retract_bodies
from fsm.model.bodies.array_forces import sum_forces as sum_body_forces
from fsm.model.bodies.array_forces import sum_tangents as sum_body_tangents
from fsm.model.bodies.arrays import DAMPING as BODY_DAMPING
from fsm.model.bodies.arrays import FORCE as WRENCHES
from fsm.model.bodies.arrays import FREE, LAST_Q, POSES, RATES, springs_of
from fsm.model.bodies.arrays import STIFFNESS as BODY_STIFFNESS
from fsm.model.bodies.arrays import pattern_of as body_pattern_of
from fsm.model.bodies.contact_arrays import keep_loaded
from fsm.model.nodes.arrays import DAMPING, FIXED, FORCE, STIFFNESS, Coordinates, Q, U
from fsm.model.nodes.arrays import pattern_of as joined_pattern_of
from fsm.model.nodes.system.array_forces import forces_of_coordinates, hold, hold_rows
from fsm.model.nodes.system.array_forces import place as place_nodes
from fsm.model.nodes.system.array_forces import sum_forces as sum_node_forces
from fsm.model.nodes.system.array_forces import sum_tangents as sum_node_tangents
from fsm.model.nodes.system.array_kernels import accept_present as accept_nodes
from fsm.model.system import arrays as at
from fsm.model.system.arrays import Joined, frames_of, sizes
from fsm.model.system.condense import add_condensed, add_curvatures, fold_forces
from fsm.model.system.frames import frame_maps, frame_turns, place_frames
from fsm.solve.stepping.vectors import copy_into


@kernel
def free_bodies(model: Joined) -> int:
    """Number of free bodies."""
    return int(integers_1d(model.bodies.table, FREE).shape[0])


@kernel
def retract(model: Joined, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    return _retract(model.nodes, model, q, x)


@kernel
def _retract(nodes: Coordinates | None, model: Joined, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    if nodes is None:
        return retract_bodies(model.bodies, q, x)
    (first, own), out = sizes(model), np.empty(q.shape[0])
    copy_into(retract_bodies(model.bodies, q[:first], x[:own]), out[:first])
    for i in range(first, q.shape[0]):
        out[i] = q[i] + x[i - first + own]
    return out


@kernel
def fill_maps(nodes: Coordinates, model: Joined) -> None:
    """Compute maps and rates of the frames at the present coordinates."""
    table = model.table
    frame_maps(
        frames_of(table), floats_1d(nodes.table, Q), floats_1d(nodes.table, U),
        floats_3d(table, at.MEMBERS)[2 * free_bodies(model) :], floats_2d(table, at.OWN_RATES),
    )  # fmt: skip


@kernel
def fill_turns(nodes: Coordinates, model: Joined) -> None:
    """Compute derivatives of the maps of the frames, and their curvatures at the present coordinates and moments."""
    table = model.table
    frame_turns(
        frames_of(table), floats_1d(nodes.table, Q), floats_1d(nodes.table, U), floats_2d(table, at.MOMENTS),
        floats_3d(table, at.TURNING)[2 * free_bodies(model) :], floats_3d(table, at.CURVATURES),
    )  # fmt: skip


@kernel
def place(model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> None:
    """Write poses and rates of all bodies and frames, and coordinates and rates of all nodes."""
    place_bodies(model.bodies.table, t, q, u)
    place_nodes_and_frames(model.nodes, model, t, q, u)


@kernel
def place_nodes_and_frames(nodes: Coordinates | None, model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> None:
    """Write coordinates and rates of all nodes, and poses and rates of all frames."""
    if nodes is None:
        return
    first, own = sizes(model)
    place_nodes(nodes.table, t, t, q[first:], u[own:])
    set_frames(model, floats_1d(nodes.table, Q))
    fill_maps(nodes, model)
    copy_rates(model, floats_2d(model.bodies.table, RATES))


@kernel
def set_frames(model: Joined, q: np.ndarray) -> None:
    """Write the poses of all frames at these coordinates of the nodes."""
    place_frames(frames_of(model.table), q, floats_2d(model.table, at.NEAR), floats_2d(model.bodies.table, POSES))


@kernel
def copy_rates(model: Joined, rates: np.ndarray) -> None:
    """Copy the rates of all frames to those of bodies, (n_bodies, 6)."""
    bodies, own = integers_1d(model.table, at.AT), floats_2d(model.table, at.OWN_RATES)
    for i in range(bodies.shape[0]):
        for k in range(6):
            rates[bodies[i], k] = own[i, k]


@kernel
def spread(model: Joined, change: np.ndarray, rates: np.ndarray) -> None:
    """Write an increment or a rate (nu,) as those of all bodies and frames, (n_bodies, 3 or 6), with the present maps."""
    rates[:] = 0.0
    scatter_free(integers_1d(model.bodies.table, FREE), change, change.shape[0] < 0, rates)
    _spread_to_frames(model.nodes, model, change, rates)


@kernel
def _spread_to_frames(nodes: Coordinates | None, model: Joined, change: np.ndarray, rates: np.ndarray) -> None:
    if nodes is None:
        return
    held, table, free = integers_2d(nodes.table, FIXED).reshape(-1), model.table, free_bodies(model)
    of_nodes = change[6 * free :]
    f, rows, maps = frames_of(table), integers_1d(table, at.NODE_ROWS), floats_3d(table, at.MEMBERS)[2 * free :]
    for i in range(f.bodies.shape[0]):
        for j in range(f.first[i], f.first[i + 1]):
            for c in range(3):
                if held[3 * rows[j] + c] == 0:
                    for k in range(6):
                        rates[f.bodies[i], k] += maps[j, k, c] * of_nodes[3 * rows[j] + c]


@kernel
def folded(model: Joined, q: np.ndarray) -> np.ndarray:
    """Generalised forces (nu,) from the present wrenches on bodies and forces on coordinates."""
    of_bodies = gather_free(integers_1d(model.bodies.table, FREE), floats_2d(model.bodies.table, WRENCHES))
    return _with_nodes(model.nodes, model, q, of_bodies)


@kernel
def _with_nodes(nodes: Coordinates | None, model: Joined, q: np.ndarray, of_bodies: np.ndarray) -> np.ndarray:
    """Generalised forces on bodies and coordinates."""
    if nodes is None:
        return of_bodies
    add_from_frames(model, floats_2d(model.bodies.table, WRENCHES), floats_1d(nodes.table, FORCE))
    of_nodes, count = forces_of_coordinates(nodes.table, q[sizes(model)[0] :]), of_bodies.shape[0]
    out = np.empty(count + of_nodes.shape[0])
    copy_into(of_bodies, out[:count])
    copy_into(of_nodes, out[count:])
    return out


@kernel
def add_from_frames(model: Joined, wrenches: np.ndarray, force: np.ndarray) -> None:
    """Add the wrenches (n_bodies, 6) on frames to the forces on coordinates."""
    table = model.table
    f, on_frames = frames_of(table), floats_2d(table, at.OWN_RATES)
    for i in range(f.bodies.shape[0]):
        for k in range(6):
            on_frames[i, k] = wrenches[f.bodies[i], k]
    maps = floats_3d(table, at.MEMBERS)[2 * free_bodies(model) :]
    fold_forces(on_frames, f.first, integers_1d(table, at.NODE_ROWS), maps, force)


@kernel
def sum_forces(model: Joined, t: float, per_second: float, moving: float) -> None:
    """Write the forces on all bodies and coordinates; `moving` is 1 in motion, 0 at rest."""
    sum_body_forces(model.bodies, t, per_second)
    _sum_on_nodes(model.nodes, t, moving)


@kernel
def _sum_on_nodes(nodes: Coordinates | None, t: float, moving: float) -> None:
    if nodes is None:
        return
    sum_node_forces(nodes, t, moving)


@kernel
def force(model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    place(model, t, q, u)
    sum_forces(model, t, 0.0, 1.0)
    return folded(model, q)


@kernel
def set_moments(nodes: Coordinates, model: Joined) -> None:
    """Compute the curvatures of the present moments on the frames, and `fill_turns`."""
    moments, wrenches = floats_2d(model.table, at.MOMENTS), floats_2d(model.bodies.table, WRENCHES)
    f = frames_of(model.table)
    for i in range(f.bodies.shape[0]):
        for k in range(3):
            moments[i, k] = wrenches[f.bodies[i], 3 + k]
    fill_turns(nodes, model)
    moments[:] = 0.0


@kernel
def add_turning(nodes: Coordinates, model: Joined) -> None:
    """Add the change of the rates of frames with the coordinates, times the damping between bodies and frames, after
    `fill_turns`.
    """
    oriented, turns = frames_of(model.table).oriented, False
    for i in range(oriented.shape[0]):
        turns = turns or oriented[i] == 1
    if not turns:
        return
    bodies, table, p = model.bodies.table, model.table, body_pattern_of(model.bodies.table)
    first, starts, slots = integers_1d(table, at.OF_MEMBERS), integers_1d(table, at.STARTS), integers_1d(table, at.SLOTS)
    add_condensed(
        p.rows, p.columns, floats_3d(bodies, BODY_DAMPING), first, floats_3d(table, at.MEMBERS),
        floats_3d(table, at.TURNING), starts, slots, floats_3d(nodes.table, STIFFNESS),
    )  # fmt: skip


@kernel
def condense(nodes: Coordinates, model: Joined) -> None:
    """Add the tangents between bodies and frames to the joined matrices, apart from `add_turning`."""
    bodies, table, own = model.bodies.table, model.table, nodes.table
    p, joined = body_pattern_of(bodies), joined_pattern_of(own)
    stiffness, damping = floats_3d(own, STIFFNESS), floats_3d(own, DAMPING)
    by_pose, by_rate = floats_3d(bodies, BODY_STIFFNESS), floats_3d(bodies, BODY_DAMPING)
    first, starts, slots = integers_1d(table, at.OF_MEMBERS), integers_1d(table, at.STARTS), integers_1d(table, at.SLOTS)
    members = floats_3d(table, at.MEMBERS)
    add_condensed(p.rows, p.columns, by_pose, first, members, members, starts, slots, stiffness)
    add_condensed(p.rows, p.columns, by_rate, first, members, members, starts, slots, damping)
    curvatures = floats_3d(table, at.CURVATURES)
    add_curvatures(joined.rows, joined.columns, frames_of(table), integers_1d(table, at.ROWS), curvatures, stiffness)


@kernel
def renewed_force(model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    place(model, t, q, u)
    sum_body_tangents(model.bodies, t, 0.0, springs_of(model.bodies.table).last[:0], q[:0], False)
    keep_loaded(model.bodies.groups)
    _join_tangents(model.nodes, model, t)
    return folded(model, q)


@kernel
def _join_tangents(nodes: Coordinates | None, model: Joined, t: float) -> None:
    if nodes is None:
        return
    _sum_tangents_of_nodes(nodes, t, 1.0)
    set_moments(nodes, model)
    add_turning(nodes, model)
    condense(nodes, model)
    hold(nodes.table)


@kernel
def _sum_tangents_of_nodes(nodes: Coordinates, t: float, moving: float) -> None:
    floats_3d(nodes.table, DAMPING)[:] = 0.0
    sum_node_tangents(nodes, t, moving)


@kernel
def sum_tangents(
    model: Joined, t: float, per_second: float, efforts: np.ndarray, since: np.ndarray, at_depths: bool
) -> None:
    """Write forces, K and D of all parts at the present state in statics; arguments as for bodies
    (`fsm.model.bodies.array_forces.sum_tangents`).
    """
    sum_tangents_by_rates(model.bodies, t, per_second, since, at_depths)
    _add_nodes_by_rates(model.nodes, model, t, per_second)
    add_tangents_by_deformations(model.bodies, t, per_second, efforts)
    _condense_all(model.nodes, model)


@kernel
def _add_nodes_by_rates(nodes: Coordinates | None, model: Joined, t: float, per_second: float) -> None:
    if nodes is None:
        return
    moving = 1.0 if per_second > 0.0 else 0.0
    _sum_tangents_of_nodes(nodes, t, moving)
    if moving > 0.0:  # the rates of springs and elements are increments of deformations, which do not turn
        fill_turns(nodes, model)
        add_turning(nodes, model)


@kernel
def _condense_all(nodes: Coordinates | None, model: Joined) -> None:
    if nodes is None:
        return
    set_moments(nodes, model)
    condense(nodes, model)
    hold(nodes.table)


@kernel
def sum_damping_of_contacts(model: Joined, t: float) -> None:
    """Write D of contacts alone, at the present state at rest, to the damping of the model; overwrites K of bodies."""
    sum_tangents_by_rates(model.bodies, t, 0.0, floats_1d(model.bodies.table, LAST_Q)[:0], False)
    _condense_damping(model.nodes, model)


@kernel
def _condense_damping(nodes: Coordinates | None, model: Joined) -> None:
    if nodes is None:
        return
    bodies, table, damping = model.bodies.table, model.table, floats_3d(nodes.table, DAMPING)
    p, members, damping[:] = body_pattern_of(bodies), floats_3d(table, at.MEMBERS), 0.0
    add_condensed(
        p.rows, p.columns, floats_3d(bodies, BODY_DAMPING), integers_1d(table, at.OF_MEMBERS), members, members,
        integers_1d(table, at.STARTS), integers_1d(table, at.SLOTS), damping,
    )  # fmt: skip
    hold_rows(nodes.table, 0.0, damping)


@kernel
def accept_nodes_and_frames(nodes: Coordinates | None, model: Joined, t: float) -> None:
    """Accept the present coordinates and quaternions of frames."""
    if nodes is None:
        return
    poses, near = floats_2d(model.bodies.table, POSES), floats_2d(model.table, at.NEAR)
    bodies = integers_1d(model.table, at.AT)
    for i in range(bodies.shape[0]):
        for k in range(4):
            near[i, k] = poses[bodies[i], 3 + k]
    accept_nodes(nodes, t)
