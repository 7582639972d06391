"""Kernels of a compiled model (`ArrayModel`): poses, forces and tangents; see `fsm.model.bodies.arrays`.

Energies and powers of a compiled model (`ArrayModel`), and the record of a step; see `fsm.model.bodies.arrays`.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.applied import add_applied, add_applied_stiffness, applied_power
from fsm.interactions.driven import driven_power, fill_reactions, place_driven
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d
from fsm.kernels.block_equations import NEGATIVE, do_low_rank, set_factors
from fsm.kernels.block_lu import count_negative
from fsm.kernels.body_poses import gather_free, increment_blocks, retract_poses, scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.newton_euler import add_gyroscopic, gyroscopic_damping
from fsm.kernels.pieces import program_at
from fsm.kernels.pointers import call_at
from fsm.kernels.records import replaced
from fsm.kernels.scatter import multiply_block_diagonal
from fsm.model.bodies import arrays as at
from fsm.model.bodies.arrays import Loads, Segments, driven_of, loads_of, pattern_of, springs_of
from fsm.solve.stepping.model import CREASES, DRIVES, INERTIAL, KINETIC, PANELS, STEADY
from fsm.solve.stepping.vectors import copy_into


@kernel
def place(table: np.ndarray, t: float, q: np.ndarray, u: np.ndarray) -> None:
    """Write poses and rates of all bodies."""
    free, poses, rates = integers_1d(table, at.FREE), floats_2d(table, at.POSES), floats_2d(table, at.RATES)
    no = u.shape[0] < 0  # this is a variable, because a constant would cause a new compilation of the kernel
    scatter_free(free, q, not no and poses.shape[1] == 7, poses)
    scatter_free(free, u, no, rates)
    place_driven(driven_of(table), t, t, poses, rates)


@kernel
def retract(model: Segments, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    """See `fsm.solve.stepping.model`."""
    if x.shape[0] < q.shape[0]:
        return retract_poses(q, x)
    out = np.empty(q.shape[0])
    for i in range(q.shape[0]):
        out[i] = q[i] + x[i]
    return out


@kernel
def factors_of(loads: Loads, t: float) -> np.ndarray:
    """Factors (m,) of all loads at a time, s."""
    factors = np.empty(loads.bodies.shape[0])
    for i in range(factors.shape[0]):
        factors[i] = program_at(loads.programs, i, t)[0]
    return factors


@kernel
def _set_simple_forces(table: np.ndarray, t: float) -> None:
    """Write weights and loads to the forces."""
    total, weight, poses = floats_2d(table, at.FORCE), floats_2d(table, at.WEIGHT), floats_2d(table, at.POSES)
    for i in range(total.shape[0]):
        for k in range(total.shape[1]):
            total[i, k] = weight[i, k] if k < weight.shape[1] else 0.0
    loads = loads_of(table)
    if loads.bodies.shape[0] > 0:
        factors = factors_of(loads, t)
        add_applied(poses, loads.bodies, loads.points, loads.forces, loads.moments, loads.follower, factors, total)


@kernel
def sum_forces(model: Segments, t: float, per_second: float) -> None:
    """Write the forces on all bodies at the present poses; `per_second` as for the kernels of elements."""
    _sum_forces(model, t, per_second, False)


@kernel
def _sum_forces(model: Segments, t: float, per_second: float, counts: bool) -> float:
    """Write the forces on all bodies, and, if it `counts`, what `_sum_losses` does."""
    table, lost = model.table, 0.0
    poses, rates, total = floats_2d(table, at.POSES), floats_2d(table, at.RATES), floats_2d(table, at.FORCE)
    _set_simple_forces(table, t)
    springs = springs_of(table)
    model.by_springs.force(poses, rates, springs.bodies, springs.constants, springs.last, per_second, total)
    if counts:
        floats_1d(table, at.STORED)[:] = 0.0
    for k in range(model.elements.shape[0]):
        own, both = model.element_tables[k], model.elements[k, at.BOTH_BY]
        if counts and both != 0:
            lost += call_at(both, table, own, t, 0.0)
            continue
        call_at(model.elements[k, at.FORCE_BY], table, own, t, per_second)
        if counts:
            lost += call_at(model.elements[k, at.LOST_BY], table, own, t, 0.0)
    if model.groups.shape[0] > 0:
        model.by_contacts.force(table, model.groups, model.contact_laws, t, per_second > 0.0)
    if poses.shape[1] == 7:
        add_gyroscopic(rates, floats_2d(table, at.INERTIA), total)
    return lost


@kernel
def _set_simple_tangents(table: np.ndarray, t: float) -> None:
    """Write the tangents of loads and gyroscopic moments to the block data."""
    stiffness, damping, poses = floats_3d(table, at.STIFFNESS), floats_3d(table, at.DAMPING), floats_2d(table, at.POSES)
    stiffness[:] = 0.0
    damping[:] = 0.0
    loads = loads_of(table)
    if loads.bodies.shape[0] > 0:
        add_applied_stiffness(
            poses, loads.bodies, loads.points, loads.forces, loads.moments, loads.follower, factors_of(loads, t),
            loads.slots, stiffness,
        )  # fmt: skip
    if poses.shape[1] == 7:
        p = pattern_of(table)
        dof = integers_1d(table, at.DOF)
        gyroscopic_damping(floats_2d(table, at.RATES), floats_2d(table, at.INERTIA), dof, p.rows, p.columns, damping)


@kernel
def sum_tangents(
    model: Segments, t: float, per_second: float, efforts: np.ndarray, since: np.ndarray, at_depths: bool
) -> None:
    """Write the forces on all bodies at the present poses, K and D.

    Parameters
    ----------
    t, per_second : s, and as for the kernels of elements
    efforts : (m, 3 or 6) array, or (0, 3 or 6)
        Efforts of springs for their geometric stiffness; if empty, efforts at the poses are used.
    since : (nu,) array, or (0,)
        Increments from the last state, if rates are these increments divided by the elapsed time. The rates of bodies then
        change with further increments; their derivative multiplies D.
    at_depths : whether contacts are linearised at the depths of statics
    """
    sum_tangents_by_rates(model, t, per_second, since, at_depths)
    add_tangents_by_deformations(model, t, per_second, efforts)


@kernel
def sum_tangents_by_rates(model: Segments, t: float, per_second: float, since: np.ndarray, at_depths: bool) -> None:
    """Write forces, K and D of all parts whose D acts on rates of bodies; arguments as for `sum_tangents`."""
    table = model.table
    poses, rates, total = floats_2d(table, at.POSES), floats_2d(table, at.RATES), floats_2d(table, at.FORCE)
    damping = floats_3d(table, at.DAMPING)
    _set_simple_forces(table, t)
    _set_simple_tangents(table, t)
    if poses.shape[1] == 7:
        add_gyroscopic(rates, floats_2d(table, at.INERTIA), total)
    if model.groups.shape[0] > 0:
        model.by_contacts.tangent(table, model.groups, model.contact_laws, t, per_second > 0.0, at_depths)
    if poses.shape[1] == 7 and since.shape[0] > 0:
        multiply_block_diagonal(damping, increment_blocks(since), pattern_of(table).columns)


@kernel
def add_tangents_by_deformations(model: Segments, t: float, per_second: float, efforts: np.ndarray) -> None:
    """Add forces, K and D of springs and elements; arguments as for `sum_tangents`."""
    table, springs = model.table, springs_of(model.table)
    poses, rates, total = floats_2d(table, at.POSES), floats_2d(table, at.RATES), floats_2d(table, at.FORCE)
    stiffness, damping = floats_3d(table, at.STIFFNESS), floats_3d(table, at.DAMPING)
    model.by_springs.tangent(
        poses, rates, springs.bodies, springs.constants, springs.last, per_second, efforts, springs.slots, total, stiffness,
        damping,
    )  # fmt: skip
    for k in range(model.elements.shape[0]):
        call_at(model.elements[k, at.TANGENT_BY], table, model.element_tables[k], t, per_second)


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
    panels, creases = with_springs(table, springs)
    kinetic, height = energies_of_motion(table)
    if model.groups.shape[0] > 0:
        drives, pair_force = driven_of(table).directions.shape[0], floats_1d(table, at.PAIR_FORCE)
        contacts = model.by_contacts.stored(table, model.groups, model.contact_laws, t)
        copy_into(pair_force, record[DRIVES + 2 * drives : DRIVES + 2 * drives + pair_force.shape[0]])
    power, kinetic_driven = input_powers(model, t, record)
    power += of_elements[2]
    record[KINETIC], record[PANELS], record[CREASES] = kinetic, panels, creases
    stored = panels + creases + of_elements[at.GAS] + height + contacts
    return kinetic, stored, by_springs + lost, power, kinetic_driven


@kernel
def forces_and_powers(
    model: Segments, t: float, of_pairs: np.ndarray, drive_force: np.ndarray
) -> tuple[float, float]:
    """Write the forces on all bodies, and return the powers, at the present poses and rates."""
    return _powers(model, t, of_pairs, drive_force, _sum_forces(model, t, 0.0, True))


@kernel
def present_powers(
    model: Segments, t: float, of_pairs: np.ndarray, drive_force: np.ndarray
) -> tuple[float, float]:
    """Powers at the present poses and rates, as `powers`."""
    return _powers(model, t, of_pairs, drive_force, _sum_losses(model, t))


@kernel
def _sum_losses(model: Segments, t: float) -> float:
    """Dissipated power of the elements at the present rates; the power that they put in is written to row `STORED`."""
    lost = 0.0
    floats_1d(model.table, at.STORED)[:] = 0.0
    for k in range(model.elements.shape[0]):
        lost += call_at(model.elements[k, at.LOST_BY], model.table, model.element_tables[k], t, 0.0)
    return lost


@kernel
def _powers(
    model: Segments, t: float, of_pairs: np.ndarray, drive_force: np.ndarray, of_elements: float
) -> tuple[float, float]:
    """Powers as `powers`, with the dissipated power of the elements."""
    table = model.table
    poses, rates, s = floats_2d(table, at.POSES), floats_2d(table, at.RATES), springs_of(table)
    _, lost = model.by_springs.stored(
        poses, rates, s.bodies, s.constants, s.last, 0.0, s.category, s.in_panels.shape[0]
    )
    lost += of_elements
    if model.groups.shape[0] > 0:
        lost += model.by_contacts.losses(table, model.groups, model.contact_laws, t, of_pairs)
    count = drive_force.shape[0]
    record = np.zeros(DRIVES + 2 * count)
    put_in, _ = input_powers(model, t, record)
    for k in range(count):
        drive_force[k] += record[DRIVES + count + k]
    return put_in + floats_1d(table, at.STORED)[2], lost


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
def with_springs(table: np.ndarray, springs: np.ndarray) -> tuple[float, float]:
    """Energies of panels and of creases, J, from those of springs by category and the stored energies of elements."""
    in_panels, of_elements = springs_of(table).in_panels, floats_1d(table, at.STORED)
    panels, creases = of_elements[0], of_elements[1]
    for i in range(springs.shape[0]):
        panels += in_panels[i] * springs[i]
        creases += (1.0 - in_panels[i]) * springs[i]
    return panels, creases


@kernel
def energies_of_motion(table: np.ndarray) -> tuple[float, float]:
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
def power_of_loads(table: np.ndarray, t: float) -> float:
    """Power of loads at the present poses and rates, W."""
    loads, power = loads_of(table), 0.0
    if loads.bodies.shape[0] > 0:
        power = applied_power(
            floats_2d(table, at.POSES), floats_2d(table, at.RATES), loads.bodies, loads.points, loads.forces, loads.moments,
            loads.follower, factors_of(loads, t),
        )  # fmt: skip
    return power


@kernel
def input_powers(model: Segments, t: float, record: np.ndarray) -> tuple[float, float]:
    """Input power, W, and kinetic energy of driven bodies, J; writes travels and forces of the drives to the record."""
    table, kinetic = model.table, 0.0
    power, driven = power_of_loads(table, t), driven_of(table)
    if driven.bodies.shape[0] > 0:
        sum_forces(model, t, 0.0)
        force, inertia = floats_2d(table, at.FORCE), floats_2d(table, at.INERTIA)
        of_drives, kinetic = driven_power(driven, inertia, floats_2d(table, at.RATES), force)
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
