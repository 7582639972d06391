"""Energies and powers of a compiled model (`ArrayModel`), and the record of a step; see `fsm.model.bodies.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.interactions.applied import applied_power
from fsm.interactions.driven import driven_power, fill_reactions
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d
from fsm.kernels.block_equations import NEGATIVE, do_low_rank, set_factors
from fsm.kernels.block_lu import count_negative
from fsm.kernels.body_poses import gather_free
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import call_at
from fsm.kernels.records import replaced
from fsm.model.bodies import arrays as at
from fsm.model.bodies.array_forces import factors_of, place, sum_forces, sum_tangents
from fsm.model.bodies.arrays import Segments, driven_of, loads_of, pattern_of, springs_of
from fsm.solve.stepping.model import CREASES, DRIVES, INERTIAL, KINETIC, PANELS, STEADY
from fsm.solve.stepping.vectors import copy_into


@kernel
def energies(
    model: Segments, t: float, q: np.ndarray, u: np.ndarray, step: float, record: np.ndarray
) -> tuple[float, float, float, float, float]:
    """See `fsm.solve.stepping.model`."""
    place(model.table, t, q, u)
    kinetic, stored, lost, power, driven = present_energies(model, t, step, record)
    if driven_of(model.table).bodies.shape[0] > 0:
        record[STEADY] = 1.0 if _nearly_at_rest(model, t, record) else 0.0
    return kinetic, stored, lost, power, driven


@kernel
def present_energies(
    model: Segments, t: float, step: float, record: np.ndarray
) -> tuple[float, float, float, float, float]:
    """Energies and powers of the present poses and rates, as `energies`."""
    table = model.table
    per_second = 1.0 / step if step > 0.0 else 0.0
    poses, rates, s = floats_2d(table, at.POSES), floats_2d(table, at.RATES), springs_of(table)
    springs, by_springs = model.by_springs.stored(
        poses, rates, s.bodies, s.constants, s.last, per_second, s.category, s.in_panels.shape[0]
    )
    copy_into(model.by_springs.deformations(poses, rates, s.bodies, s.constants), s.last)
    of_elements, contacts, lost = floats_1d(table, at.STORED), 0.0, 0.0
    of_elements[:] = 0.0
    for k in range(model.elements.shape[0]):
        own = model.element_tables[k]
        call_at(model.elements[k, at.STORED_BY], table, own, t, per_second)
        lost += call_at(model.elements[k, at.LOST_BY], table, own, t, per_second)
        call_at(model.elements[k, at.KEEP_BY], table, own, t, per_second)
    panels, creases = of_elements[0], of_elements[1]
    for i in range(springs.shape[0]):
        panels += s.in_panels[i] * springs[i]
        creases += (1.0 - s.in_panels[i]) * springs[i]
    kinetic, height = _motion(table)
    drives, pairs = driven_of(table).directions.shape[0], floats_2d(table, at.PAIR_ENERGY).shape[1]
    pair_force = record[DRIVES + 2 * drives : DRIVES + 2 * drives + pairs]
    if model.groups.shape[0] > 0:
        contacts, by_contacts = model.by_contacts.stored(table, model.groups, model.contact_laws, t, step, pair_force)
        lost += by_contacts
    power, kinetic_driven = input_powers(model, t, record)
    power += of_elements[2]
    record[KINETIC], record[PANELS], record[CREASES] = kinetic, panels, creases
    stored = panels + creases + of_elements[at.GAS] + height + contacts
    return kinetic, stored, by_springs + lost, power, kinetic_driven


@kernel
def powers(
    model: Segments, t: float, q: np.ndarray, u: np.ndarray, of_pairs: np.ndarray, drive_force: np.ndarray
) -> tuple[float, float]:
    """See `fsm.solve.stepping.model`."""
    place(model.table, t, q, u)
    return present_powers(model, t, of_pairs, drive_force)


@kernel
def present_powers(
    model: Segments, t: float, of_pairs: np.ndarray, drive_force: np.ndarray
) -> tuple[float, float]:
    """Powers at the present poses and rates, as `powers`."""
    table = model.table
    poses, rates, s = floats_2d(table, at.POSES), floats_2d(table, at.RATES), springs_of(table)
    _, lost = model.by_springs.stored(
        poses, rates, s.bodies, s.constants, s.last, 0.0, s.category, s.in_panels.shape[0]
    )
    of_elements = floats_1d(table, at.STORED)
    of_elements[:] = 0.0
    for k in range(model.elements.shape[0]):
        lost += call_at(model.elements[k, at.LOST_BY], table, model.element_tables[k], t, 0.0)
    if model.groups.shape[0] > 0:
        lost += model.by_contacts.losses(table, model.groups, model.contact_laws, t, of_pairs)
    count = drive_force.shape[0]
    record = np.zeros(DRIVES + 2 * count)
    put_in, _ = input_powers(model, t, record)
    for k in range(count):
        drive_force[k] += record[DRIVES + count + k]
    return put_in + of_elements[2], lost


@kernel
def part_before_event(model: Segments, t: float, step: float) -> float:
    """See `System.part_before_event`, at the present state."""
    part = 2.0
    for k in range(model.elements.shape[0]):
        found = call_at(model.elements[k, at.PART_BY], model.table, model.element_tables[k], t, step)
        if found > 0.0:
            part = min(part, found)
    return part


@kernel
def accepted_part(part: float, of_event: float) -> float:
    """See `fsm.solve.stepping.model.part_of_step`, from the parts of contacts (at most 1) and of events (2 without one)."""
    return 2.0 if part == 1.0 and of_event == 1.0 else min(part, of_event)


@kernel
def accept_elements(model: Segments, t: float) -> None:
    """Let elements with memory accept the present poses."""
    for k in range(model.elements.shape[0]):
        call_at(model.elements[k, at.ACCEPT_BY], model.table, model.element_tables[k], t, 0.0)


@kernel
def _motion(table: np.ndarray) -> tuple[float, float]:
    """Kinetic energy, and potential energy of the weights, J."""
    poses, rates, inertia = floats_2d(table, at.POSES), floats_2d(table, at.RATES), floats_2d(table, at.INERTIA)
    weight = floats_2d(table, at.WEIGHT)
    kinetic = height = 0.0
    for i in range(rates.shape[0]):
        for k in range(rates.shape[1]):
            kinetic += 0.5 * inertia[i, k] * rates[i, k] ** 2
        for k in range(weight.shape[1]):
            height -= weight[i, k] * poses[i, k]
    return kinetic, height


@kernel
def input_powers(model: Segments, t: float, record: np.ndarray) -> tuple[float, float]:
    """Input power, W, and kinetic energy of driven bodies, J; writes travels and forces of the drives to the record."""
    table, power, kinetic = model.table, 0.0, 0.0
    rates, loads, driven = floats_2d(table, at.RATES), loads_of(table), driven_of(table)
    if loads.bodies.shape[0] > 0:
        power = applied_power(
            floats_2d(table, at.POSES), rates, loads.bodies, loads.points, loads.forces, loads.moments, loads.follower,
            factors_of(loads, t),
        )  # fmt: skip
    if driven.bodies.shape[0] > 0:
        sum_forces(model, t, 0.0)
        force, inertia = floats_2d(table, at.FORCE), floats_2d(table, at.INERTIA)
        of_drives, kinetic = driven_power(driven, inertia, rates, force)
        power += of_drives
        fill_reactions(driven, t, inertia, force, record[DRIVES:])
    return power, kinetic


@kernel
def _nearly_at_rest(model: Segments, t: float, record: np.ndarray) -> bool:
    """Whether the present state is near a stable equilibrium; its forces and drives are already computed."""
    table, driven = model.table, driven_of(model.table)
    force, inertia = floats_2d(table, at.FORCE), floats_2d(table, at.INERTIA)
    inertial = fill_reactions(driven, t, inertia, force, record[DRIVES:])
    free, force_scale = gather_free(integers_1d(table, at.FREE), force), floats_1d(table, at.FORCE_SCALE)
    for i in range(free.shape[0]):
        inertial += abs(free[i] / force_scale[i])
    largest, count = 0.0, driven.directions.shape[0]
    for k in range(count):
        largest = max(largest, abs(record[DRIVES + count + k]) / driven.scale[k])
    return inertial <= INERTIAL * largest and _stable_at_rest(model, t)


@kernel
def _stable_at_rest(model: Segments, t: float) -> bool:
    """Whether all pivots of the symmetric part of the stiffness at rest, at the present poses, are positive."""
    table = model.at_rest
    sum_tangents(replaced(model, "table", table), t, 0.0, springs_of(table).last[:0], floats_1d(table, at.LAST_Q)[:0], False)
    matrix, stiffness, factors = floats_3d(table, at.MATRIX), floats_3d(table, at.STIFFNESS), floats_3d(table, at.FACTORS)
    p = pattern_of(table)
    for k in range(matrix.shape[0]):
        mirrored = p.transposed[k]
        for i in range(matrix.shape[1]):
            for j in range(matrix.shape[1]):
                matrix[k, i, j] = 0.5 * (stiffness[k, i, j] + stiffness[mirrored, j, i])
    if model.equations.low_rank.shape[0] > 0:
        done = set_factors(model.equations, p, matrix, factors, model.flags, True)
        return done and do_low_rank(model.equations.low_rank, NEGATIVE, p, matrix, factors, model.flags, matrix[0, 0]) == 0.0
    failed = model.equations.factorise(
        matrix, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, True, factors
    )
    return failed < 0 and count_negative(p.filled_diagonal, factors) == 0
