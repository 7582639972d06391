"""Kernels of a compiled model that quasi-static paths call; see `fsm.solve.stepping.path`."""

from __future__ import annotations

import numpy as np

from fsm.interactions.driven import place_driven
from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d, integers_2d
from fsm.kernels.block_equations import UNKNOWN
from fsm.kernels.block_lu import SYMMETRY_TOLERANCE, is_symmetric
from fsm.kernels.body_poses import pose_difference, scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import program_at
from fsm.kernels.pointers import call_at
from fsm.kernels.records import replaced
from fsm.model.bodies import array_path as of_bodies
from fsm.model.bodies.array_forces import part_before_event
from fsm.model.bodies.array_locked import lock, swap_multipliers
from fsm.model.bodies.array_pivots import negative_of_last, negative_of_symmetric
from fsm.model.bodies.array_statics import add_damping, per_second_of, take_up
from fsm.model.bodies.arrays import FREE, INTERVAL, POSES, RATES, driven_of, springs_of
from fsm.model.bodies.contact_arrays import FRICTION, contacts_at, lack_pairs
from fsm.model.nodes import arrays as rows
from fsm.model.nodes.arrays import Coordinates, full_mass_of
from fsm.model.nodes.system.array_forces import rows_times
from fsm.model.nodes.system.array_kernels import sum_of
from fsm.model.system.array_forces import (
    accept_nodes_and_frames,
    folded,
    set_frames,
    sum_damping_of_contacts,
    sum_forces,
    sum_tangents,
)
from fsm.model.system.array_statics import STATICS, place_nodes_mean
from fsm.model.system.arrays import AT, FACETS, PLACES, Joined, matrices_of, sizes
from fsm.solve.stepping import path_state as path
from fsm.solve.stepping.quasi_static import BEGIN, StaticCalls
from fsm.solve.stepping.vectors import copy_into, subtracted


@kernel
def _progress(model: Joined, t: float) -> float:
    table, value = model.bodies.table, t
    pace = floats_1d(table, INTERVAL)[4]
    if pace > 0.0:
        value = program_at(driven_of(table).programs, 0, t)[0] + pace * t
    return value


@kernel
def _difference(model: Joined, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    if floats_2d(model.bodies.table, POSES).shape[1] == 3:
        return subtracted(end, start)
    return _difference_in_space(model.nodes, model, start, end)


@kernel
def _difference_in_space(nodes: Coordinates | None, model: Joined, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    if nodes is None:
        return pose_difference(start, end)
    first, own = sizes(model)
    out = np.empty(start.shape[0] - first + own)
    copy_into(pose_difference(start[:first], end[:first]), out[:own])
    copy_into(subtracted(end[first:], start[first:]), out[own:])
    return out


@kernel
def _lacks(model: Joined) -> bool:
    return bool(lack_pairs(model.bodies.groups))


@kernel
def _efforts(model: Joined, out: np.ndarray) -> None:
    of_springs = springs_of(model.bodies.table).efforts.reshape(-1)
    for i in range(of_springs.shape[0]):
        out[i] = of_springs[i]
    _efforts_of_facets(model.nodes, model, out, of_springs.shape[0])


@kernel
def _efforts_of_facets(nodes: Coordinates | None, model: Joined, out: np.ndarray, first: int) -> None:
    """Write membrane efforts to `out`, from an index on."""
    if nodes is None:
        return
    for row in range(FACETS, model.table.shape[0], 2):
        own = floats_1d(model.table, row)
        copy_into(own, out[first : first + own.shape[0]])
        first += own.shape[0]


@kernel
def _begin(
    model: Joined, t: float, before: float, q: np.ndarray, start: np.ndarray, rate_dependent: bool, most: float
) -> None:
    bodies = model.bodies
    of_bodies.begin_bodies(bodies.table, t, before, q, start, rate_dependent)
    _begin_nodes(model.nodes, model, q, start)
    lock(bodies, 0.0)
    take_up(bodies, BEGIN)
    if bodies.groups.shape[0] > 0:
        bodies.by_contacts.press(bodies.groups, most)


@kernel
def _begin_nodes(nodes: Coordinates | None, model: Joined, q: np.ndarray, start: np.ndarray) -> None:
    if nodes is None:
        return
    taken = springs_of(model.bodies.table).efforts.reshape(-1).shape[0]
    for row in range(FACETS, model.table.shape[0], 2):
        own = floats_1d(model.table, row)
        copy_into(start[taken:], own)
        taken += own.shape[0]
    copy_into(q[sizes(model)[0] :], floats_1d(nodes.table, rows.LAST))
    floats_1d(nodes.table, rows.NUMBERS)[rows.MEAN_OVER] = floats_1d(model.bodies.table, INTERVAL)[1]


# ends of steps ----------------------------------------------------------------------------------------------------------


@kernel
def _place_end(model: Joined, q: np.ndarray) -> None:
    """Write poses, coordinates and mean rates at the end of a step, also if no force depends on rates."""
    of_bodies.place_end(model.bodies.table, q)
    place_nodes_mean(model.nodes, model, q, floats_1d(model.bodies.table, INTERVAL)[2])


@kernel
def _end_of_step(
    model: Joined, q: np.ndarray, trial: np.ndarray, accurate: float, at_rest: bool, record: np.ndarray
) -> None:
    bodies, record[:] = model.bodies, 0.0
    _place_end(model, q)
    if of_bodies.has_passed(bodies):
        record[path.PASSED] = 1.0
        return
    interval, per_second = floats_1d(bodies.table, INTERVAL), per_second_of(bodies.table)
    sum_forces(model, interval[0], per_second, 1.0 if per_second > 0.0 else 0.0)
    of_bodies.write_record(bodies, interval[0], per_second, _moving(model.nodes, model), record)
    _add_nodes(model.nodes, model, q, record)
    part = part_before_event(bodies, interval[0], interval[2])
    record[path.PART] = part if part <= 1.0 else 0.0
    own = matrices_of(model)
    negative = negative_of_last(model.equations, own.pattern, own.matrix, own.factors, model.flags, trial, accurate)
    record[path.NEGATIVE] = negative
    if at_rest:  # nodes have one matrix, which must not change if the number is computed in another way
        kept = model.table.shape[0] > 0 and negative == UNKNOWN
        record[path.NEGATIVE_AT_REST] = UNKNOWN if kept else _negative_at_rest(model, q, trial, accurate)


@kernel
def _moving(nodes: Coordinates | None, model: Joined) -> np.ndarray:
    """Bodies that are free, or carried by nodes."""
    free = integers_1d(model.bodies.table, FREE)
    if nodes is None:
        return free
    return np.concatenate((free, integers_1d(model.table, AT)))


@kernel
def _add_nodes(nodes: Coordinates | None, model: Joined, q: np.ndarray, record: np.ndarray) -> None:
    """Add energies, powers and reactions of nodes at the present coordinates, rates and forces."""
    if nodes is None:
        return
    folded(model, q)
    table, interval = nodes.table, floats_1d(model.bodies.table, INTERVAL)
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
    put_in = sum_of(nodes, rows.PUT_IN_AT, 0.0)
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
def _power_before(model: Joined, t: float, q: np.ndarray) -> float:
    bodies = model.bodies.table
    poses, power = floats_2d(bodies, POSES), _power_of_nodes_before(model.nodes, t, floats_1d(bodies, INTERVAL))
    scatter_free(integers_1d(bodies, FREE), q, not q.shape[0] < 0 and poses.shape[1] == 7, poses)
    place_driven(driven_of(bodies), t, t, poses, np.empty(floats_2d(bodies, RATES).shape))
    _set_frames(model.nodes, model, q)
    return power + float(of_bodies.power_of_present(model.bodies, t))


@kernel
def _power_of_nodes_before(nodes: Coordinates | None, t: float, interval: np.ndarray) -> float:
    if nodes is None:
        return 0.0
    numbers = floats_1d(nodes.table, rows.NUMBERS)
    # the coordinates are those of the end, which give the mean rates
    numbers[rows.NOW], numbers[rows.MEAN_OVER] = t, interval[2]
    power = sum_of(nodes, rows.PUT_IN_AT, -1.0)  # at the state before
    numbers[rows.NOW], numbers[rows.MEAN_OVER] = interval[0], interval[1]
    return power


@kernel
def _set_frames(nodes: Coordinates | None, model: Joined, q: np.ndarray) -> None:
    if nodes is None:
        return
    set_frames(model, q[sizes(model)[0] :])


@kernel
def _rest(model: Joined, t: float, q: np.ndarray) -> None:
    """Write the state at rest; `model` with the table of bodies at rest."""
    now = floats_1d(model.bodies.table, INTERVAL)
    of_bodies.rest(model.bodies.table, t, q)
    begun, now[0] = now[0], t
    place_nodes_mean(model.nodes, model, q, 0.0)
    now[0] = begun


@kernel
def _balance_at_rest(model: Joined, t: float, q: np.ndarray, force: np.ndarray, drives: np.ndarray) -> None:
    own = replaced(model, "bodies", replaced(model.bodies, "table", model.bodies.at_rest))
    before = t != floats_1d(model.bodies.table, INTERVAL)[0]
    _rest(own, t, q)
    if before:
        swap_multipliers(model.bodies)
    sum_forces(own, t, 0.0, 0.0)
    if before:
        swap_multipliers(model.bodies)
    copy_into(folded(own, q), force)
    of_bodies.write_drives(own.bodies.table, t, drives)


@kernel
def _negative_at_rest(model: Joined, q: np.ndarray, trial: np.ndarray, accurate: float) -> float:
    """Number of negative pivots of the symmetric part of the stiffness at rest, or `UNKNOWN`."""
    own = replaced(model, "bodies", replaced(model.bodies, "table", model.bodies.at_rest))
    t = floats_1d(model.bodies.table, INTERVAL)[0]
    _rest(own, t, q)
    sum_tangents(own, t, 0.0, springs_of(own.bodies.table).last[:0], q[:0], False)
    of = matrices_of(own)
    return float(negative_of_symmetric(
        model.equations, of.pattern, of.stiffness, of.matrix, of.factors, trial, accurate, model.flags
    ))  # fmt: skip


@kernel
def _sticks(model: Joined, q: np.ndarray, trial: np.ndarray, accurate: float, sticking: float) -> float:
    own = replaced(model, "bodies", replaced(model.bodies, "table", model.bodies.at_rest))
    of, friction = matrices_of(own), 0
    if not is_symmetric(of.stiffness, of.pattern.rows, of.pattern.columns, of.pattern.transposed, SYMMETRY_TOLERANCE):
        return UNKNOWN
    for k in range(model.bodies.groups.shape[0]):
        friction += contacts_at(model.bodies.groups, k).state[FRICTION]
    if friction == 0:
        return 0.0
    held, t = of.stiffness.copy(), floats_1d(model.bodies.table, INTERVAL)[0]
    _rest(own, t, q)
    sum_damping_of_contacts(own, t)
    add_damping(of.damping, 1.0 / sticking, held)
    found = negative_of_symmetric(model.equations, of.pattern, held, of.matrix, of.factors, trial, accurate, model.flags)
    return float(UNKNOWN if found == UNKNOWN else 1.0 if found == 0.0 else 0.0)


# memory -----------------------------------------------------------------------------------------------------------------


@kernel
def _accept(model: Joined, q: np.ndarray) -> None:
    _place_end(model, q)
    of_bodies.accept_present(model.bodies)
    accept_nodes_and_frames(model.nodes, model, floats_1d(model.bodies.table, INTERVAL)[0])


@kernel
def _contact_force(model: Joined, t: float, q: np.ndarray) -> float:
    if model.bodies.groups.shape[0] == 0:
        return 0.0
    of_bodies.rest(model.bodies.at_rest, t, q)
    _set_frames(model.nodes, model, q)
    return float(of_bodies.largest_contact_force(model.bodies, t))


PATH = StaticCalls(
    *STATICS[:10], _begin, _lacks, _efforts, _end_of_step, _accept, _progress, _difference, _contact_force, _balance_at_rest,
    _power_before, _sticks,
)  # fmt: skip
"""Kernels of `Joined` that quasi-static steps and paths call."""
