"""Kernels of bodies and ANCF elements as a compiled model that quasi-static paths call; see `fsm.solve.stepping.path`."""

from __future__ import annotations

import numpy as np

from fsm.interactions.driven import place_driven
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.block_equations import UNKNOWN
from fsm.kernels.body_poses import pose_difference, scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import call_at
from fsm.kernels.records import replaced
from fsm.model.bodies.array_forces import sum_forces as sum_body_forces
from fsm.model.bodies.array_path import (
    accept_present as accept_bodies,
)
from fsm.model.bodies.array_path import (
    begin_bodies,
    efforts,
    has_passed,
    largest_contact_force,
    power_of_present,
    progress,
    rest,
    write_drives,
    write_record,
)
from fsm.model.bodies.array_path import (
    place_end as place_end_of_bodies,
)
from fsm.model.bodies.array_pivots import negative_of_last, negative_of_symmetric
from fsm.model.bodies.array_statics import per_second_of, take_up
from fsm.model.bodies.arrays import FREE, INTERVAL, POSES, RATES, driven_of, springs_of
from fsm.model.bodies.contact_arrays import lack_pairs
from fsm.model.joined.array_forces import folded, free_bodies, set_frames
from fsm.model.joined.array_statics import STATICS, place_nodes_mean, sum_tangents
from fsm.model.joined.arrays import AT, FACETS, NEAR, PLACES, Joined
from fsm.model.nodes import arrays as rows
from fsm.model.nodes.arrays import full_mass_of
from fsm.model.nodes.arrays import pattern_of as joined_pattern_of
from fsm.model.nodes.system.array_forces import rows_times
from fsm.model.nodes.system.array_forces import sum_forces as sum_node_forces
from fsm.model.nodes.system.array_kernels import accept_present as accept_nodes
from fsm.solve.stepping import path_state as path
from fsm.solve.stepping.quasi_static import BEGIN, StaticCalls
from fsm.solve.stepping.vectors import copy_into


@kernel
def _progress(model: Joined, t: float) -> float:
    return float(progress(model.bodies, t))


@kernel
def _difference(model: Joined, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    free = free_bodies(model)
    out = np.empty(start.shape[0] - free)
    copy_into(pose_difference(start[: 7 * free], end[: 7 * free]), out[: 6 * free])
    for i in range(6 * free, out.shape[0]):
        out[i] = end[i + free] - start[i + free]
    return out


@kernel
def _lacks(model: Joined) -> bool:
    return bool(lack_pairs(model.bodies.groups))


@kernel
def _efforts(model: Joined, out: np.ndarray) -> None:
    of_springs = springs_of(model.bodies.table).efforts.shape
    first = of_springs[0] * of_springs[1]
    efforts(model.bodies, out[:first])
    for row in range(FACETS, model.table.shape[0], 2):
        own = floats_1d(model.table, row)
        copy_into(own, out[first : first + own.shape[0]])
        first += own.shape[0]


@kernel
def _begin(
    model: Joined, t: float, before: float, q: np.ndarray, start: np.ndarray, rate_dependent: bool, most: float
) -> None:
    bodies, nodes, first = model.bodies, model.nodes.table, 7 * free_bodies(model)
    begin_bodies(bodies.table, t, before, q[:first], start, rate_dependent)
    of_springs = springs_of(bodies.table).efforts.shape
    taken = of_springs[0] * of_springs[1]
    for row in range(FACETS, model.table.shape[0], 2):
        own = floats_1d(model.table, row)
        copy_into(start[taken:], own)
        taken += own.shape[0]
    copy_into(q[first:], floats_1d(nodes, rows.LAST))
    floats_1d(nodes, rows.NUMBERS)[rows.MEAN_OVER] = floats_1d(bodies.table, INTERVAL)[1]
    take_up(bodies, BEGIN)
    if bodies.groups.shape[0] > 0:
        bodies.by_contacts.press(bodies.groups, most)


# ends of steps ----------------------------------------------------------------------------------------------------------


@kernel
def _place_end(model: Joined, q: np.ndarray) -> None:
    """Write poses, coordinates and mean rates at the end of a step, also if no force depends on rates."""
    first = 7 * free_bodies(model)
    place_end_of_bodies(model.bodies.table, q[:first])
    place_nodes_mean(model, q[first:], floats_1d(model.bodies.table, INTERVAL)[2])


@kernel
def _end_of_step(
    model: Joined, q: np.ndarray, trial: np.ndarray, accurate: float, at_rest: bool, record: np.ndarray
) -> None:
    bodies, nodes, record[:] = model.bodies, model.nodes, 0.0
    _place_end(model, q)
    if has_passed(bodies):
        record[path.PASSED] = 1.0
        return
    t, per_second = floats_1d(bodies.table, INTERVAL)[0], per_second_of(bodies.table)
    sum_body_forces(bodies, t, per_second)
    sum_node_forces(nodes, t, 1.0 if per_second > 0.0 else 0.0)
    folded(model, q)
    moving = np.concatenate((integers_1d(bodies.table, FREE), integers_1d(model.table, AT)))
    write_record(bodies, t, per_second, moving, record)
    _add_nodes(model, record)
    p, factors = joined_pattern_of(nodes.table), floats_3d(nodes.table, rows.FACTORS)
    matrix = floats_3d(nodes.table, rows.MATRIX)
    negative = negative_of_last(nodes.equations, p, matrix, factors, model.flags, trial, accurate)
    record[path.NEGATIVE] = negative
    if at_rest:  # the same matrix and factors are used
        record[path.NEGATIVE_AT_REST] = UNKNOWN if negative == UNKNOWN else _negative_at_rest(model, q, trial, accurate)


@kernel
def _add_nodes(model: Joined, record: np.ndarray) -> None:
    """Add energies, powers and reactions of nodes at the present coordinates, rates and forces."""
    nodes, table, interval = model.nodes, model.nodes.table, floats_1d(model.bodies.table, INTERVAL)
    numbers, kinds = floats_1d(table, rows.NUMBERS), integers_1d(table, rows.KINDS)
    here, rates = floats_1d(table, rows.Q), floats_1d(table, rows.U)
    numbers[rows.MEAN_OVER] = interval[2]
    for k in range(nodes.kernels.shape[0]):
        stored = call_at(nodes.kernels[k, rows.STORED_AT], table, nodes.tables[k], 1.0)
        record[path.STORED] += stored
        if kinds[k] > 2:
            record[path.BARS + kinds[k] - 3] += stored
        elif kinds[k] > 0:
            record[path.PANELS + kinds[k] - 1] += stored
        slid = call_at(nodes.kernels[k, rows.SLID_AT], table, nodes.tables[k], 0.0)
        record[path.KEPT_LOSS] += slid
        record[path.LOST] += slid + call_at(nodes.kernels[k, rows.LOST_AT], table, nodes.tables[k], 1.0)
    put_in = _power_of_nodes(model, 0.0)
    record[path.LOADS] += put_in
    record[path.INPUT] += put_in
    numbers[rows.MEAN_OVER] = interval[1]
    weight, momentum = floats_1d(table, rows.WEIGHT), rows_times(full_mass_of(table), rates)
    for i in range(rates.shape[0]):
        record[path.KINETIC] += 0.5 * rates[i] * momentum[i]
        record[path.GRAVITY] -= weight[i] * here[i]
        record[path.STORED] -= weight[i] * here[i]
    force, fixed = floats_1d(table, rows.FORCE), integers_2d(table, rows.FIXED).reshape(-1)
    places = integers_1d(model.table, PLACES)
    for i in range(places.shape[0]):
        square = 0.0
        for k in range(places[i], places[i] + 3):
            square += force[k] * force[k] if fixed[k] == 1 else 0.0
        record[path.LARGEST] = max(record[path.LARGEST], np.sqrt(square))


@kernel
def _power_of_nodes(model: Joined, step: float) -> float:
    """Power that elements of nodes put into the system at the present state, W, or at the one before for a negative step."""
    nodes, power = model.nodes, 0.0
    for k in range(nodes.kernels.shape[0]):
        power += call_at(nodes.kernels[k, rows.PUT_IN_AT], nodes.table, nodes.tables[k], step)
    return power


@kernel
def _power_before(model: Joined, t: float, q: np.ndarray) -> float:
    bodies, free = model.bodies.table, free_bodies(model)
    interval, poses = floats_1d(bodies, INTERVAL), floats_2d(bodies, POSES)
    numbers = floats_1d(model.nodes.table, rows.NUMBERS)
    # the coordinates are those of the end, which give the mean rates
    numbers[rows.NOW], numbers[rows.MEAN_OVER] = t, interval[2]
    power = _power_of_nodes(model, -1.0)
    numbers[rows.NOW], numbers[rows.MEAN_OVER] = interval[0], interval[1]
    scatter_free(integers_1d(bodies, FREE), q[: 7 * free], not q.shape[0] < 0 and poses.shape[1] == 7, poses)
    place_driven(driven_of(bodies), t, t, poses, np.empty(floats_2d(bodies, RATES).shape))
    set_frames(model, q[7 * free :])
    return power + float(power_of_present(model.bodies, t))


@kernel
def _rest(model: Joined, t: float, q: np.ndarray) -> None:
    """Write the state at rest; `model` with the table of bodies at rest."""
    first, now = 7 * free_bodies(model), floats_1d(model.bodies.table, INTERVAL)
    rest(model.bodies.table, t, q[:first])
    begun, now[0] = now[0], t
    place_nodes_mean(model, q[first:], 0.0)
    now[0] = begun


@kernel
def _balance_at_rest(model: Joined, t: float, q: np.ndarray, force: np.ndarray, drives: np.ndarray) -> None:
    own = replaced(model, "bodies", replaced(model.bodies, "table", model.bodies.at_rest))
    _rest(own, t, q)
    sum_body_forces(own.bodies, t, 0.0)
    sum_node_forces(own.nodes, t, 0.0)
    copy_into(folded(own, q), force)
    write_drives(own.bodies.table, t, drives)


@kernel
def _negative_at_rest(model: Joined, q: np.ndarray, trial: np.ndarray, accurate: float) -> float:
    """Number of negative pivots of the symmetric part of the stiffness at rest, or `UNKNOWN`."""
    own = replaced(model, "bodies", replaced(model.bodies, "table", model.bodies.at_rest))
    t, table = floats_1d(model.bodies.table, INTERVAL)[0], model.nodes.table
    _rest(own, t, q)
    sum_tangents(own, t, 0.0, springs_of(own.bodies.table).last[:0], q[:0], False)
    return float(negative_of_symmetric(
        model.nodes.equations, joined_pattern_of(table), floats_3d(table, rows.STIFFNESS), floats_3d(table, rows.MATRIX),
        floats_3d(table, rows.FACTORS), trial, accurate, model.flags,
    ))  # fmt: skip


# memory -----------------------------------------------------------------------------------------------------------------


@kernel
def _accept(model: Joined, q: np.ndarray) -> None:
    _place_end(model, q)
    accept_bodies(model.bodies)
    poses, near, at = floats_2d(model.bodies.table, POSES), floats_2d(model.table, NEAR), integers_1d(model.table, AT)
    for i in range(at.shape[0]):
        for k in range(4):
            near[i, k] = poses[at[i], 3 + k]
    accept_nodes(model.nodes, floats_1d(model.bodies.table, INTERVAL)[0])


@kernel
def _contact_force(model: Joined, t: float, q: np.ndarray) -> float:
    if model.bodies.groups.shape[0] == 0:
        return 0.0
    first = 7 * free_bodies(model)
    rest(model.bodies.at_rest, t, q[:first])
    set_frames(model, q[first:])
    return float(largest_contact_force(model.bodies, t))


PATH = StaticCalls(
    *STATICS[:10], _begin, _lacks, _efforts, _end_of_step, _accept, _progress, _difference, _contact_force, _balance_at_rest,
    _power_before,
)  # fmt: skip
"""Kernels of `Joined` that quasi-static steps and paths call."""
