"""Kernels of contacts of a compiled model (`ArrayModel`), called by their addresses; see `fsm.model.bodies.contact_arrays`.

The kernels apply to all geometries and laws. `fsm.model.contact.contacts` calls the parts that are the same for one group.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.bristle import add_way_stiffness, carried
from fsm.interactions.contact.contact_depths import advance_depths
from fsm.interactions.contact.impacts import CORNER_WEIGHT, fraction_before, longest_step, young_impacts
from fsm.interactions.contact.pair_sums import FORCE as FORCES
from fsm.interactions.contact.pair_sums import SLIDING, smallest_gaps, sums_of_pairs
from fsm.interactions.surfaces.end_taper import add_taper_tangent
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d
from fsm.kernels.jit import kernel, shared
from fsm.model.bodies import contact_arrays as index
from fsm.model.bodies.arrays import DAMPING, FORCE, PAIR_FORCE, POSES, RATES, STIFFNESS
from fsm.model.bodies.contact_arrays import ContactArrays, ContactKernels, LawKernels
from fsm.model.contact import array_contact_state as contact_state
from fsm.model.contact.array_contact_state import Weighed
from fsm.model.contact.geometry_calls import geometry_of
from fsm.solve.stepping.vectors import copy_into


@kernel
def _mark(g: ContactArrays, count: int) -> None:
    """Mark the slots (possible contacts) that have a force."""
    loaded, slot, normal = g.loaded, g.slot, g.normal_force
    loaded[:] = 0
    for i in range(count):
        if normal[i] > 0.0:
            loaded[slot[i]] = 1


@kernel
def _force(table: np.ndarray, groups: np.ndarray, laws: LawKernels, t: float, mean_rates: bool) -> None:
    """Add the forces of all contacts; `mean_rates` as for `evaluate`."""
    poses, rates, total = floats_2d(table, POSES), floats_2d(table, RATES), floats_2d(table, FORCE)
    for k in range(groups.shape[0]):
        g = index.contacts_at(groups, k)
        count = contact_state.find_slots(g, poses, 0.0)
        if count > 0:
            weighed, _ = contact_state.evaluate(g, laws, t, poses, rates, mean_rates, count, False)
            contact_state.add_forces(g, weighed, contact_state.taper_energy(g, laws, weighed.rows), count, total)
        _mark(g, count)


@kernel
def _tangent(
    table: np.ndarray, groups: np.ndarray, laws: LawKernels, t: float, mean_rates: bool, at_depths: bool
) -> None:
    """Add the forces of all contacts, and their stiffness K and damping D; arguments as for `evaluate`."""
    poses, rates, total = floats_2d(table, POSES), floats_2d(table, RATES), floats_2d(table, FORCE)
    stiffness, damping = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    for k in range(groups.shape[0]):
        g = index.contacts_at(groups, k)
        count = contact_state.find_pressed(g, poses) if at_depths else contact_state.find_slots(g, poses, 0.0)
        g.state[index.ACTIVE] = count
        if count == 0:
            _mark(g, count)
            continue
        weighed, bristles = contact_state.evaluate(g, laws, t, poses, rates, mean_rates, count, at_depths)
        _mark(g, count)
        contact_state.add_forces(g, weighed, contact_state.taper_energy(g, laws, weighed.rows), count, total)
        add_tangent(g, laws, weighed, bristles, poses, rates, count, stiffness, damping)


@kernel
def add_geometric_tangent(
    g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    """Add stiffness K and damping D of contacts from gradients and second derivatives of their gaps."""
    geometry_of(g).tangent(g, poses, rates, count, stiffness, damping)


@shared
def add_tangent(
    g: ContactArrays, laws: LawKernels, weighed: Weighed, bristles: bool, poses: np.ndarray, rates: np.ndarray, count: int,
    stiffness: np.ndarray, damping: np.ndarray,
) -> None:  # fmt: skip
    """Add stiffness K and damping D of the evaluated contacts; arguments as `evaluate` returns them."""
    add_geometric_tangent(g, poses, rates, count, stiffness, damping)
    if weighed.rows.shape[0] > 0:
        _add_taper_tangent(g, laws, weighed, count, stiffness)
    bodies, gradient = g.bodies[:count], g.gradient[:count]
    if g.numbers[index.ACROSS] != 1.0:
        laws.add_turn_stiffness(bodies, gradient, g.by_turn[:count], g.dof, g.indptr, g.indices, stiffness)
    if bristles:
        add_way_stiffness(bodies, gradient, g.by_distance[:count], g.dof, g.indptr, g.indices, stiffness)


@shared
def _add_taper_tangent(g: ContactArrays, laws: LawKernels, weighed: Weighed, count: int, stiffness: np.ndarray) -> None:
    rows, params = weighed.rows, g.normal
    depth, whole = contact_state.taper_arguments(g, rows)
    closing = -contact_state.values_at(contact_state.column_of(g.rate[:count], 0, 1.0), rows)
    onset = contact_state.values_at(g.onset_of, rows)
    normal, _ = laws.normal(depth, closing, onset, whole, params)
    add_taper_tangent(
        g.bodies[:count], g.gradient[:count], rows, weighed.gradient, weighed.hessian,
        laws.energy(depth, whole, params), contact_state.elastic_force(g, laws, depth, whole), normal, g.by_normal[:count],
        g.dof, g.indptr, g.indices, stiffness,
    )  # fmt: skip


@kernel
def _press(groups: np.ndarray, most: float) -> None:
    """Begin Newton's method of statics at the depths of the last accepted state; `most` (N) as in `MOST`."""
    for k in range(groups.shape[0]):
        g = index.contacts_at(groups, k)
        if g.state[index.RENUMBERS] == 1:  # the slots must contain the contacts of the last accepted state
            geometry_of(g).renew(g, g.committed)
        copy_into(g.depth, g.pressed)
        copy_into(g.depth, g.pressed_before)
        g.numbers[index.MOST] = most


@kernel
def advanced(g: ContactArrays, count: int, change: np.ndarray, per_second: float) -> np.ndarray:
    """Depths (count,), m, of the last tangent after a change (n_bodies, 3 or 6) of the poses, see `advance_depths`."""
    depth: np.ndarray = advance_depths(
        g.bodies[:count], g.gradient[:count], change, per_second, g.at[:count], g.normal_force[:count], g.acting[:count],
        g.by_depth[:count], g.by_closing[:count],
    )  # fmt: skip
    return depth


@kernel
def _advance(groups: np.ndarray, change: np.ndarray, per_second: float) -> None:
    """Advance the depths of the last tangent of statics by a change (n_bodies, 3 or 6) of the poses, to first order.

    Contacts with a tensile force are released. `per_second` (1/s) is the inverse of the time since the last state.
    """
    for k in range(groups.shape[0]):
        g = index.contacts_at(groups, k)
        count, slot, pressed = g.state[index.ACTIVE], g.slot, g.pressed
        copy_into(pressed, g.pressed_before)
        pressed[:] = 0.0
        if count == 0:
            continue
        depth = advanced(g, count, change, per_second)
        for i in range(count):
            pressed[slot[i]] = depth[i]


# steps ------------------------------------------------------------------------------------------------------------------


@kernel
def _passed(table: np.ndarray, groups: np.ndarray) -> bool:
    """Whether sides have passed through each other since the last accepted state."""
    poses = floats_2d(table, POSES)
    for k in range(groups.shape[0]):
        g = index.contacts_at(groups, k)
        contact_state.renew_search(g, poses)
        if geometry_of(g).passed(g, poses) >= 0:
            return True
    return False


@kernel
def part_before_impacts(g: ContactArrays, unit_energy: np.ndarray, step: float) -> float:
    """Fraction of a step that ends before the impacts of the evaluated contacts begin, see `fraction_before`."""
    count = unit_energy.shape[0]
    return float(fraction_before(
        index.rules_of(g), g.bodies[:count], g.gradient[:count], g.gap[:count],
        contact_state.column_of(g.rate[:count], 0, 1.0),
        g.normal_force[:count], g.onset_of[:count], unit_energy, g.rates_before, step,
    ))  # fmt: skip


@kernel
def longest_of_impacts(g: ContactArrays, unit_energy: np.ndarray, t: float, rates: np.ndarray) -> float:
    """Longest step that resolves the impacts of the measured contacts, s, see `longest_step`."""
    count = unit_energy.shape[0]
    slot = g.slot[:count]
    return float(longest_step(
        index.rules_of(g), t, g.bodies[:count], g.gradient[:count], g.gap[:count],
        contact_state.column_of(g.rate[:count], 0, 1.0),
        contact_state.values_at(g.onset, slot), contact_state.values_at(g.began, slot), unit_energy, rates,
    ))  # fmt: skip


@kernel
def _part_of_step(table: np.ndarray, groups: np.ndarray, laws: LawKernels, t: float, step: float) -> float:
    """Return 1 to accept a step, or the factor by which a rejected step is shortened; see `ContactSet.rejection`."""
    poses, rates, part = floats_2d(table, POSES), floats_2d(table, RATES), 1.0
    if _passed(table, groups):
        return 0.5
    for k in range(groups.shape[0]):
        g = index.contacts_at(groups, k)
        if g.state[index.STARTED] == 0 or not index.resolves(g):
            continue
        count = contact_state.find_slots(g, poses, 0.0)
        if count == 0:
            continue
        contact_state.evaluate(g, laws, t, poses, rates, False, count, False)
        of_unit = contact_state.unit_energies(g, laws, contact_state.values_at(g.share, g.slot[:count]))
        part = min(part, part_before_impacts(g, of_unit, step))
    return part


@kernel
def _longest_step(table: np.ndarray, groups: np.ndarray, laws: LawKernels, t: float) -> float:
    """Longest step that resolves impacts, s."""
    poses, rates, longest = floats_2d(table, POSES), floats_2d(table, RATES), np.inf
    for k in range(groups.shape[0]):
        g = index.contacts_at(groups, k)
        if not index.resolves(g):
            continue
        count = contact_state.find_slots(g, poses, g.numbers[index.MARGIN])
        if count == 0:
            continue
        contact_state.measure_slots(g, poses, rates, count)
        of_unit = contact_state.unit_energies(g, laws, contact_state.values_at(g.share, g.slot[:count]))
        longest = min(longest, longest_of_impacts(g, of_unit, t, rates))
    return longest


@kernel
def _accept(table: np.ndarray, groups: np.ndarray, laws: LawKernels, t: float, mean_rates: bool) -> None:
    """Update the memory of all contacts; see `ContactGroup.commit`; `mean_rates` as for `evaluate`."""
    poses, rates = floats_2d(table, POSES), floats_2d(table, RATES)
    for k in range(groups.shape[0]):
        g = index.contacts_at(groups, k)
        of_unit = g.gap[:0]
        count = contact_state.find_slots(g, poses, 0.0)
        if count > 0:
            contact_state.evaluate(g, laws, t, poses, rates, mean_rates, count, False)
            of_unit = contact_state.unit_energies(g, laws, np.full(count, CORNER_WEIGHT))
        accept_group(g, of_unit, t, poses, rates)


@kernel
def accept_group(
    g: ContactArrays, unit_energy: np.ndarray, t: float, poses: np.ndarray, rates: np.ndarray
) -> None:
    """Update the memory of a group after an accepted step: onset of the evaluated contacts and deflection of bristles.

    `unit_energy` (J) is the energy of each contact at the depth 1 m and the weight `CORNER_WEIGHT`.
    """
    young = g.state[:0]
    if unit_energy.shape[0] > 0:
        young = _remember(g, unit_energy, t, poses)
    else:
        _forget(g)
    g.numbers[index.COMMITTED_AT] = t
    copy_into(rates, g.rates_before)
    copy_into(poses, g.committed)
    g.state[index.STARTED] = 1
    geometry_of(g).settle(g, poses, young, False)


@kernel
def _forget(g: ContactArrays) -> None:
    g.onset[:] = 0.0
    g.began[:] = 0.0
    g.depth[:] = 0.0
    g.deflection[:] = 0.0


@kernel
def _remember(g: ContactArrays, unit_energy: np.ndarray, t: float, poses: np.ndarray) -> np.ndarray:
    """Write the memory of contacts, and return the slots of continuing impacts."""
    count = unit_energy.shape[0]
    slot, state, gap, rate = g.slot, g.state, g.gap, g.rate
    bodies, gradient, known = g.bodies[:count], g.gradient[:count], g.onset_of
    began, onset, age = contact_state.values_at(g.began, slot[:count]), np.empty(count), np.empty(count)
    for i in range(count):
        if known[i] == 0.0:
            began[i] = t
        # an external force may close an impact faster than its initial speed
        onset[i] = max(known[i], max(-rate[i, 0], index.floor_of(g)))
        age[i] = t - began[i]
    deflection = g.deflected[:count]
    if state[index.STARTED] == 1 and state[index.FRICTION] == 1 and poses.shape[1] == 7:
        first = np.empty(count, dtype=np.int64)
        for i in range(count):
            first[i] = bodies[i, 0]
        deflection = carried(deflection, g.committed, poses, first)
    _forget(g)
    onsets, begans, depths, memory = g.onset, g.began, g.depth, g.deflection
    for i in range(count):
        onsets[slot[i]], begans[slot[i]], depths[slot[i]] = onset[i], began[i], -gap[i]
        for c in range(memory.shape[1]):
            memory[slot[i], c] = deflection[i, c]
    young = young_impacts(index.rules_of(g), age, bodies, gradient, onset, unit_energy)
    out, number = np.empty(count, dtype=np.int64), 0
    for i in range(count):
        if young[i]:
            out[number] = slot[i]
            number += 1
    return out[:number]


# energies ---------------------------------------------------------------------------------------------------------------


@shared
def sums(g: ContactArrays, laws: LawKernels, count: int, pairs: int) -> np.ndarray:
    """Sums (6, pairs) over the evaluated contacts of every pair, see `sums_of_pairs`."""
    return _sums(g, contact_state.elastic_force(g, laws, -g.gap[:count], g.share_of[:count]), pairs)


@kernel
def _sums(g: ContactArrays, elastic: np.ndarray, pairs: int) -> np.ndarray:
    """Sums with the forces (N) of the contacts at rest."""
    count = elastic.shape[0]
    slot, share, own, part = g.slot[:count], g.share_of, g.share, np.empty(count)
    for i in range(count):
        part[i] = share[i] / own[slot[i]]
    found: np.ndarray = sums_of_pairs(
        g.pair, slot, g.area, part, g.normal_force[:count], g.pull[:count], elastic, g.rate[:count], g.effort[:count], pairs
    )
    return found


@kernel
def _stored(table: np.ndarray, groups: np.ndarray, laws: LawKernels, t: float) -> float:
    """Energy of all contacts, J; writes the normal forces of all pairs."""
    poses, rates, pair_force, stored = floats_2d(table, POSES), floats_2d(table, RATES), floats_1d(table, PAIR_FORCE), 0.0
    pair_force[:] = 0.0
    for k in range(groups.shape[0]):
        g = index.contacts_at(groups, k)
        count = contact_state.find_slots(g, poses, 0.0)
        if count == 0:
            continue
        contact_state.evaluate(g, laws, t, poses, rates, False, count, False)
        energy = laws.energy(-g.gap[:count], g.share_of[:count], g.normal)
        for i in range(energy.shape[0]):
            stored += energy[i]
        of_pair = sums(g, laws, count, pair_force.shape[0])
        for p in range(pair_force.shape[0]):
            pair_force[p] += of_pair[FORCES, p]
    return stored


@kernel
def deepest_of_pairs(g: ContactArrays, tapered: np.ndarray, count: int, gap: np.ndarray) -> None:
    """Reduce the gaps (n_pairs,) of pairs to those of the evaluated contacts, m."""
    depth = -g.gap[:count]
    if g.state[index.FADES] == 1 and tapered.shape[0] > 0:
        for i in range(count):
            depth[i] *= min(g.share_of[i] / g.share[g.slot[i]], 1.0)
    smallest_gaps(g.pair, g.slot[:count], -depth, gap)


@kernel
def close_gaps(g: ContactArrays, poses: np.ndarray, gap: np.ndarray) -> None:
    """Reduce the gaps (n_pairs,) of pairs, m, to those of contacts within the margin that do not touch.

    All slots of sheets belong to one pair, and few of them are near: the bound of the search grows until there is one.
    """
    below = g.numbers[index.MARGIN]
    if g.state[index.RENUMBERS] == 1:
        if g.pair.shape[0] == 0 or gap[g.pair[0]] <= 0.0:
            return
        below /= 64.0
        while below < g.numbers[index.MARGIN] and contact_state.find_slots(g, poses, below) == 0:
            below = min(8.0 * below, g.numbers[index.MARGIN])
    near = contact_state.find_slots(g, poses, below)
    smallest_gaps(g.pair, g.slot[:near], np.maximum(g.gap[:near], 0.0), gap)


@kernel
def _state_of_pairs(
    table: np.ndarray, groups: np.ndarray, laws: LawKernels, t: float, mean_rates: bool, out: np.ndarray
) -> tuple[float, float]:
    """Energy (J) and dissipated power (W) of all contacts; see `ContactGroup.observe`.

    Writes the sums over the contacts of every pair, and in the last row its gap (m), to `out` (7, n_pairs).
    """
    poses, rates, stored, power = floats_2d(table, POSES), floats_2d(table, RATES), 0.0, 0.0
    pairs, last = out.shape[1], out.shape[0] - 1
    out[:] = 0.0
    out[last] = np.inf
    for k in range(groups.shape[0]):
        g = index.contacts_at(groups, k)
        gap = np.full(pairs, g.numbers[index.MARGIN])
        count = contact_state.find_slots(g, poses, 0.0)
        if count > 0:
            weighed, _ = contact_state.evaluate(g, laws, t, poses, rates, mean_rates, count, False)
            energy = laws.energy(-g.gap[:count], g.share_of[:count], g.normal)
            for i in range(count):
                stored += energy[i]
            of_pair = sums(g, laws, count, pairs)
            for p in range(pairs):
                for row in range(last):
                    out[row, p] += of_pair[row, p]
                for row in range(2):
                    power += of_pair[SLIDING + row, p]
            deepest_of_pairs(g, weighed.rows, count, gap)
        close_gaps(g, poses, gap)
        for p in range(pairs):
            out[last, p] = min(out[last, p], gap[p])
    return stored, power


@kernel
def _losses(
    table: np.ndarray, groups: np.ndarray, laws: LawKernels, t: float, of_pairs: np.ndarray
) -> float:
    """Dissipated power (W) of all contacts at the present rates; the power of each pair is added to `of_pairs` (2,
    n_pairs).
    """
    poses, rates, power = floats_2d(table, POSES), floats_2d(table, RATES), 0.0
    for k in range(groups.shape[0]):
        g = index.contacts_at(groups, k)
        if g.state[index.LOSSY] == 0:
            continue
        count = contact_state.find_slots(g, poses, 0.0)
        if count == 0:
            continue
        contact_state.evaluate(g, laws, t, poses, rates, False, count, False)
        of_pair = sums(g, laws, count, of_pairs.shape[1])
        for p in range(of_pairs.shape[1]):
            for row in range(2):
                power += of_pair[SLIDING + row, p]
                of_pairs[row, p] += of_pair[SLIDING + row, p]
    return power


CONTACTS = ContactKernels(
    _force, _tangent, _part_of_step, _accept, _longest_step, _stored, _losses, _advance, _passed, _state_of_pairs,
    _press,
)
