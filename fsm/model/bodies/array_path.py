"""Kernels of bodies for quasi-static paths; see `fsm.model.system.array_path`."""

from __future__ import annotations

import numpy as np

from fsm.interactions.driven import driven_power, fill_reactions, place_driven
from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d
from fsm.kernels.body_poses import pose_difference, scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.newton_euler import largest_force, largest_moment, support_reactions
from fsm.kernels.pointers import call_at
from fsm.model.bodies import arrays as at
from fsm.model.bodies.array_forces import energies_of_motion, place, power_of_loads, with_springs
from fsm.model.bodies.array_locked import largest_multiplier, swap_multipliers
from fsm.model.bodies.array_statics import per_second_of, place_mean
from fsm.model.bodies.arrays import Segments, driven_of, springs_of
from fsm.model.bodies.contact_arrays import BRISTLE, contacts_at
from fsm.solve.stepping import path_state as path
from fsm.solve.stepping.path_state import DRIVES
from fsm.solve.stepping.vectors import copy_into, subtracted


@kernel
def begin_bodies(
    table: np.ndarray, t: float, before: float, q: np.ndarray, start: np.ndarray, rate_dependent: bool
) -> None:
    """Begin a step of bodies, with the efforts `start`; see `StaticCalls.begin`."""
    interval, rates, moves = floats_1d(table, at.INTERVAL), floats_2d(table, at.RATES), rate_dependent and t > before
    interval[0], interval[1], interval[2], interval[3] = t, t - before if moves else 0.0, t - before, before
    copy_into(q, floats_1d(table, at.LAST_Q))
    rates[:] = 0.0
    place_driven(driven_of(table), t, before if moves else t, floats_2d(table, at.POSES), rates)
    if not moves:
        rates[:] = 0.0
    copy_into(start, springs_of(table).efforts)


# ends of steps ----------------------------------------------------------------------------------------------------------


@kernel
def place_end(table: np.ndarray, q: np.ndarray) -> None:
    """Write poses and mean rates of all bodies at the end of a step, also if no force depends on rates."""
    interval, poses, rates = floats_1d(table, at.INTERVAL), floats_2d(table, at.POSES), floats_2d(table, at.RATES)
    place_mean(table, q)
    if not interval[2] > 0.0:
        rates[:] = 0.0
        place_driven(driven_of(table), interval[0], interval[0], poses, np.empty(rates.shape))
        return
    place_driven(driven_of(table), interval[0], interval[3], poses, rates)
    if not interval[1] > 0.0:
        last = floats_1d(table, at.LAST_Q)
        mean = pose_difference(last, q) if poses.shape[1] == 7 else subtracted(q, last)
        for i in range(mean.shape[0]):
            mean[i] /= interval[2]
        scatter_free(integers_1d(table, at.FREE), mean, q.shape[0] < 0, rates)


@kernel
def has_passed(model: Segments) -> bool:
    """Whether sides of contacts have passed through each other."""
    return bool(
        model.groups.shape[0] > 0 and model.by_contacts.passed(model.table, model.groups)
    )  # fmt: skip


@kernel
def write_record(model: Segments, t: float, per_second: float, moving: np.ndarray, record: np.ndarray) -> None:
    """Write the record of a state from the present poses, rates and forces, without the numbers of pivots. Only bodies that
    are not `moving` have reactions.
    """
    table, s = model.table, springs_of(model.table)
    first = DRIVES + 2 * driven_of(table).directions.shape[0]
    sums = record[first:].reshape(7, (record.shape[0] - first) // 7)
    _, record[path.OPENING] = model.by_springs.widest(floats_2d(table, at.POSES), s.bodies, s.constants, s.structural)
    _add_joints(model, t, per_second, record)
    _add_motion(table, t, moving, record)
    record[path.LARGEST] = max(record[path.LARGEST], largest_multiplier(model))
    if model.groups.shape[0] > 0:
        record[path.CONTACT], lost = model.by_contacts.sums(
            table, model.groups, model.contact_laws, t, per_second > 0.0, sums
        )
        record[path.LOST] += lost
        if _bristles(model.groups):  # these also resist at zero speed
            for p in range(sums.shape[1]):
                record[path.KEPT_LOSS] += sums[path.PAIR_SLIDING, p]
    record[path.STORED] = (
        record[path.PANELS] + record[path.CREASES] + record[path.GAS] + record[path.GRAVITY] + record[path.CONTACT]
    )  # fmt: skip


@kernel
def _bristles(groups: np.ndarray) -> bool:
    count = 0
    for k in range(groups.shape[0]):
        count += contacts_at(groups, k).state[BRISTLE]
    return count > 0


@kernel
def _add_joints(model: Segments, t: float, per_second: float, record: np.ndarray) -> None:
    """Add the energies and the damper power of springs and elements."""
    table = model.table
    poses, rates, s = floats_2d(table, at.POSES), floats_2d(table, at.RATES), springs_of(table)
    springs, lost = model.by_springs.stored(
        poses, rates, s.bodies, s.constants, s.last, per_second, s.category, s.in_panels.shape[0]
    )
    of_elements, duration = floats_1d(table, at.STORED), floats_1d(table, at.INTERVAL)[2]
    of_elements[:] = 0.0
    of_step = 1.0 / duration if duration > 0.0 else 0.0
    for k in range(model.elements.shape[0]):
        own = model.element_tables[k]
        call_at(model.elements[k, at.STORED_BY], table, own, t, of_step)
        lost += call_at(model.elements[k, at.LOST_BY], table, own, t, of_step)
    record[path.LOST] += lost
    record[path.LOADS] += of_elements[2]
    record[path.KEPT_LOSS] = of_elements[3]
    record[path.PANELS], record[path.CREASES] = with_springs(table, springs)
    record[path.GAS] = of_elements[at.GAS]


@kernel
def _add_motion(table: np.ndarray, t: float, moving: np.ndarray, record: np.ndarray) -> None:
    """Write travels and forces of drives, energies of the motion and of weights, and the powers of loads and drives."""
    record[path.KINETIC], record[path.GRAVITY] = energies_of_motion(table)
    inertia, wrenches, driven = floats_2d(table, at.INERTIA), floats_2d(table, at.FORCE), driven_of(table)
    record[path.LOADS] += power_of_loads(table, t)
    driving, record[path.DRIVEN] = driven_power(driven, inertia, floats_2d(table, at.RATES), wrenches)
    record[path.INPUT] = record[path.LOADS] + driving
    reactions = support_reactions(wrenches, moving)
    record[path.LARGEST] = max(
        largest_force(reactions), floats_1d(table, at.INTERVAL)[5] * largest_moment(reactions)
    )  # fmt: skip
    fill_reactions(driven, t, np.zeros(inertia.shape), wrenches, record[DRIVES:])


@kernel
def power_of_present(model: Segments, t: float) -> float:
    """Power of loads and actuators at the present poses and rates, W."""
    table, of_elements = model.table, floats_1d(model.table, at.STORED)
    of_elements[:] = 0.0
    swap_multipliers(model)
    to_end = -1.0 / floats_1d(table, at.INTERVAL)[2]
    for k in range(model.elements.shape[0]):
        call_at(model.elements[k, at.LOST_BY], table, model.element_tables[k], t, to_end)  # actuators write their power
    swap_multipliers(model)
    return power_of_loads(table, t) + of_elements[2]


@kernel
def write_drives(table: np.ndarray, t: float, drives: np.ndarray) -> None:
    """Write the forces (n_drives,) of all drives at rest from the present wrenches."""
    wrenches, count = floats_2d(table, at.FORCE), drives.shape[0]
    out = np.empty(2 * count)
    fill_reactions(driven_of(table), t, np.zeros(wrenches.shape), wrenches, out)
    copy_into(out[count:], drives)


@kernel
def rest(table: np.ndarray, t: float, q: np.ndarray) -> None:
    """Write the poses of a state at rest to the table of rates at rest."""
    rates = floats_2d(table, at.RATES)
    place(table, t, q, np.zeros(integers_1d(table, at.FREE).shape[0] * rates.shape[1]))
    rates[:] = 0.0


# memory -----------------------------------------------------------------------------------------------------------------


@kernel
def accept_present(model: Segments) -> None:
    """Accept the present poses and rates."""
    table = model.table
    t, per_second, s = floats_1d(table, at.INTERVAL)[0], per_second_of(table), springs_of(table)
    poses, rates = floats_2d(table, at.POSES), floats_2d(table, at.RATES)
    if model.groups.shape[0] > 0:
        model.by_contacts.accept(table, model.groups, model.contact_laws, t, per_second > 0.0)
    copy_into(model.by_springs.deformations(poses, rates, s.bodies, s.constants), s.last)
    for k in range(model.elements.shape[0]):
        call_at(model.elements[k, at.KEEP_BY], table, model.element_tables[k], t, per_second)
        call_at(model.elements[k, at.ACCEPT_BY], table, model.element_tables[k], t, per_second)


@kernel
def largest_contact_force(model: Segments, t: float) -> float:
    """Largest component of the forces of contacts at the present poses, at rest, N."""
    table = model.at_rest
    force = floats_2d(table, at.FORCE)
    force[:] = 0.0
    model.by_contacts.force(table, model.groups, model.contact_laws, t, False)
    largest: float = largest_force(force)
    return largest
