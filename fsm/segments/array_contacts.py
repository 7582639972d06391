"""Kernels of contacts of a model of arrays, called by their addresses; see `fsm.segments.contact_arrays`.

They are for all geometries and laws. `fsm.segments.contacts` computes the same step by step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.bristle import add_way_stiffness, carried
from fsm.interactions.end_taper import add_taper_tangent
from fsm.interactions.impacts import CORNER_WEIGHT, fraction_before, longest_step, shared_weight, young_impacts
from fsm.interactions.pair_sums import FORCE as FORCES
from fsm.interactions.pair_sums import SLIDING, sums_of_pairs
from fsm.interactions.shapes import ContactForces
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, table_at
from fsm.kernels.body_poses import pose_difference
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import scatter_efforts
from fsm.segments.arrays import BEFORE, DAMPING, FORCE, PAIR_ENERGY, POSES, RATES, STIFFNESS
from fsm.segments.contact_arrays import (
    AREA,
    BEGAN,
    BRISTLE,
    CHANGES,
    COMMITTED,
    COMMITTED_AT,
    DEFLECTION,
    DEPTH,
    EVALUATIONS,
    FRICTION,
    LOADED,
    LOSSY,
    MARGIN,
    NORMAL,
    NUMBERS,
    OF_FRICTION,
    ONSET,
    PAIR,
    RATES_BEFORE,
    SHARE,
    STARTED,
    STATE,
    SURFACES,
    ContactKernels,
    ContactParts,
    GeometryKernels,
    LawKernels,
    floor_of,
    index_of,
    resolves,
    rules_of,
)
from fsm.stepping.vectors import copy_into

__all__ = ["CONTACTS", "NO_CONTACTS"]


class _Found(NamedTuple):
    """Contacts of a state with their forces.

    `by_distance` is the stiffness of bristles; `rows`, `part`, `part_gradient` and `part_hessian` are of contacts whose
    weights change with the poses.
    """

    slot: np.ndarray
    gap: np.ndarray
    bodies: np.ndarray
    rate: np.ndarray
    gradient: np.ndarray
    share: np.ndarray
    onset: np.ndarray
    forces: ContactForces
    deflection: np.ndarray
    by_distance: np.ndarray
    rows: np.ndarray
    part_gradient: np.ndarray
    part_hessian: np.ndarray


@kernel
def _geometry_of(g: np.ndarray, parts: ContactParts) -> GeometryKernels:
    return parts.surfaces if integers_1d(g, STATE)[SURFACES] == 1 else parts.shapes


@kernel
def _equal(a: np.ndarray, b: np.ndarray) -> bool:
    one, two, same = a.reshape(-1), b.reshape(-1), True
    for i in range(one.shape[0]):
        same = same and one[i] == two[i]
    return same


@kernel
def _taken(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    out = np.empty(rows.shape[0])
    for i in range(rows.shape[0]):
        out[i] = values[rows[i]]
    return out


@kernel
def _column(values: np.ndarray, column: int, sign: float) -> np.ndarray:
    out = np.empty(values.shape[0])
    for i in range(values.shape[0]):
        out[i] = sign * values[i, column]
    return out


@kernel
def _renew(g: np.ndarray, geometry: GeometryKernels, poses: np.ndarray) -> None:
    """Renew the broad phase and weights of faces, if poses have changed."""
    state = integers_1d(g, STATE)
    changed = state[CHANGES] == 1 and state[STARTED] == 1 and not _equal(poses, floats_2d(g, COMMITTED))
    if geometry.renew(g, poses) == 1 or changed:
        geometry.settle(g, poses, state[:0], True)


@kernel
def _find(g: np.ndarray, geometry: GeometryKernels, poses: np.ndarray, below: float) -> tuple[np.ndarray, np.ndarray]:
    """Slots with a gap below a bound, and their gaps."""
    _renew(g, geometry, poses)
    found: tuple[np.ndarray, np.ndarray] = geometry.find(g, poses, below)
    return found


@kernel
def _slip_of(rate: np.ndarray) -> np.ndarray:
    out = np.empty((rate.shape[0], rate.shape[1] - 1))
    for i in range(out.shape[0]):
        for c in range(out.shape[1]):
            out[i, c] = rate[i, 1 + c]
    return out


@kernel
def _moved(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Increments (n_bodies, 3 or 6) between two sets of poses."""
    if start.shape[1] == 7:
        return pose_difference(start.reshape(-1), end.reshape(-1)).reshape(-1, 6)
    return end - start


@kernel
def _mean_slip(
    g: np.ndarray, poses: np.ndarray, slip: np.ndarray, bodies: np.ndarray, gradient: np.ndarray, duration: float
) -> np.ndarray:
    """Mean slip velocity since the last accepted state, which bends the bristles."""
    if duration == 0.0 or integers_1d(g, STATE)[STARTED] == 0:
        return slip
    moved, out = _moved(floats_2d(g, COMMITTED), poses), np.zeros(slip.shape)
    size = moved.shape[1]
    for i in range(slip.shape[0]):
        for c in range(slip.shape[1]):
            for b in range(bodies.shape[1]):
                for k in range(size):
                    out[i, c] += gradient[i, 1 + c, b * size + k] * moved[bodies[i, b], k] / duration
    return out


@kernel
def _evaluate(
    g: np.ndarray, geometry: GeometryKernels, laws: LawKernels, t: float, poses: np.ndarray, rates: np.ndarray,
    mean_rates: bool, slot: np.ndarray, gap: np.ndarray,
) -> _Found:  # fmt: skip
    """Contacts with their forces. With `mean_rates`, the rates are means, which bend the bristles too."""
    state = integers_1d(g, STATE)
    state[EVALUATIONS] += 1
    bodies, rate, gradient = geometry.measure(g, poses, rates, slot)
    rows, part, part_gradient, part_hessian = geometry.tapered(g, poses, slot, bodies)
    share, onset = _taken(floats_1d(g, SHARE), slot), _taken(floats_1d(g, ONSET), slot)
    for k in range(rows.shape[0]):
        share[rows[k]] *= part[k]
    slip, count = _slip_of(rate), slot.shape[0]
    slips = slip.shape[1]
    normal, slopes = laws.normal(-gap, _column(rate, 0, -1.0), onset, share, floats_1d(g, NORMAL))
    effort, by_slip, by_normal = np.zeros((count, slips)), np.zeros((count, slips, slips)), np.zeros((count, slips))
    by_distance, deflection = np.zeros((0, slips, slips)), np.zeros((count, slips))
    if state[FRICTION] == 1 and state[BRISTLE] == 1:
        duration, mean, memory = max(0.0, t - floats_1d(g, NUMBERS)[COMMITTED_AT]), slip, floats_2d(g, DEFLECTION)
        if not mean_rates:
            mean = _mean_slip(g, poses, slip, bodies, gradient, duration)
        for i in range(count):
            for c in range(slips):
                deflection[i, c] = memory[slot[i], c]
        effort, by_slip, by_mean, by_normal, deflection = laws.bristle(
            slip, mean, normal, deflection, duration, floats_1d(g, OF_FRICTION)
        )
        if duration > 0.0:
            by_distance = by_mean / duration
    elif state[FRICTION] == 1:
        effort, by_slip, by_normal = laws.friction(slip, normal, floats_1d(g, OF_FRICTION))
    forces = ContactForces(
        normal, _column(slopes, 0, 1.0), _column(slopes, 1, 1.0), effort, by_slip, by_normal, state[FRICTION] == 1
    )
    return _Found(
        slot, gap, bodies, rate, gradient, share, onset, forces, deflection, by_distance, rows, part_gradient, part_hessian
    )


@kernel
def _scatter(g: np.ndarray, laws: LawKernels, found: _Found, total: np.ndarray) -> None:
    """Add the forces of contacts to those of all bodies."""
    slips = found.rate.shape[1] - 1 if found.forces.friction else 0
    effort = np.empty((found.slot.shape[0], 1 + slips))
    for i in range(effort.shape[0]):
        effort[i, 0] = -found.forces.normal[i]
        for c in range(slips):
            effort[i, 1 + c] = found.forces.effort[i, c]
    scatter_efforts(found.bodies, found.gradient, effort, effort.shape[0], total)
    rows, size = found.rows, total.shape[1]
    if rows.shape[0] == 0:
        return
    depth, whole = -_taken(found.gap, rows), _taken(floats_1d(g, SHARE), _chosen(found.slot, rows))
    energy = laws.energy(depth, whole, floats_1d(g, NORMAL))
    for k in range(rows.shape[0]):  # force from the change of the weight
        for b in range(found.bodies.shape[1]):
            for c in range(size):
                total[found.bodies[rows[k], b], c] -= energy[k] * found.part_gradient[k, b * size + c]


@kernel
def _chosen(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    out = np.empty(rows.shape[0], dtype=np.int64)
    for i in range(rows.shape[0]):
        out[i] = values[rows[i]]
    return out


@kernel
def _mark(g: np.ndarray, slot: np.ndarray, normal: np.ndarray) -> None:
    """Write which slots have a force."""
    loaded = integers_1d(g, LOADED)
    loaded[:] = 0
    for i in range(normal.shape[0]):
        if normal[i] > 0.0:
            loaded[slot[i]] = 1


@kernel
def _force(table: np.ndarray, groups: np.ndarray, parts: ContactParts, t: float) -> None:
    """Add the forces of all contacts."""
    poses, rates, total = floats_2d(table, POSES), floats_2d(table, RATES), floats_2d(table, FORCE)
    for k in range(groups.shape[0]):
        g = table_at(groups, k)
        geometry = _geometry_of(g, parts)
        slot, gap = _find(g, geometry, poses, 0.0)
        if slot.shape[0] == 0:
            integers_1d(g, LOADED)[:] = 0
            continue
        found = _evaluate(g, geometry, parts.laws, t, poses, rates, False, slot, gap)
        _mark(g, slot, found.forces.normal)
        _scatter(g, parts.laws, found, total)


@kernel
def _tangent(table: np.ndarray, groups: np.ndarray, parts: ContactParts, t: float) -> None:
    """Add the forces of all contacts, and their K and D."""
    poses, rates, total = floats_2d(table, POSES), floats_2d(table, RATES), floats_2d(table, FORCE)
    stiffness, damping = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    for k in range(groups.shape[0]):
        g = table_at(groups, k)
        geometry = _geometry_of(g, parts)
        slot, gap = _find(g, geometry, poses, 0.0)
        if slot.shape[0] == 0:
            integers_1d(g, LOADED)[:] = 0
            continue
        found = _evaluate(g, geometry, parts.laws, t, poses, rates, False, slot, gap)
        _mark(g, slot, found.forces.normal)
        _scatter(g, parts.laws, found, total)
        geometry.tangent(g, poses, rates, slot, found.bodies, found.gradient, found.forces, stiffness, damping)
        if found.rows.shape[0] > 0:
            _add_taper_tangent(g, parts.laws, found, stiffness)
        if found.by_distance.shape[0] > 0:
            dof, indptr, indices = index_of(g)
            add_way_stiffness(found.bodies, found.gradient, found.by_distance, dof, indptr, indices, stiffness)


@kernel
def _add_taper_tangent(g: np.ndarray, laws: LawKernels, found: _Found, stiffness: np.ndarray) -> None:
    rows, params = found.rows, floats_1d(g, NORMAL)
    slot = _chosen(found.slot, rows)
    depth, whole = -_taken(found.gap, rows), _taken(floats_1d(g, SHARE), slot)
    normal, _ = laws.normal(depth, -_taken(_column(found.rate, 0, 1.0), rows), _taken(found.onset, rows), whole, params)
    dof, indptr, indices = index_of(g)
    add_taper_tangent(
        found.bodies, found.gradient, rows, found.part_gradient, found.part_hessian, laws.energy(depth, whole, params),
        _elastic(g, laws, depth, whole), normal, found.forces.by_normal, dof, indptr, indices, stiffness,
    )  # fmt: skip


@kernel
def _elastic(g: np.ndarray, laws: LawKernels, depth: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Normal forces of contacts at rest."""
    force, _ = laws.normal(depth, np.zeros(depth.shape[0]), np.ones(depth.shape[0]), share, floats_1d(g, NORMAL))
    return np.asarray(force)


# steps ------------------------------------------------------------------------------------------------------------------


@kernel
def _unit_energy(g: np.ndarray, laws: LawKernels, share: np.ndarray) -> np.ndarray:
    energy = laws.energy(np.ones(share.shape[0]), shared_weight(share), floats_1d(g, NORMAL))
    return np.asarray(energy)


@kernel
def _part_of_step(table: np.ndarray, groups: np.ndarray, parts: ContactParts, t: float, step: float) -> float:
    """1 to accept a step, else the factor on its size; see `ContactSet.rejection`."""
    poses, rates, part = floats_2d(table, POSES), floats_2d(table, RATES), 1.0
    for k in range(groups.shape[0]):
        g = table_at(groups, k)
        geometry = _geometry_of(g, parts)
        _renew(g, geometry, poses)
        if geometry.passed(g, poses):
            return 0.5
    for k in range(groups.shape[0]):
        g = table_at(groups, k)
        if integers_1d(g, STATE)[STARTED] == 0 or not resolves(g):
            continue
        geometry = _geometry_of(g, parts)
        slot, gap = _find(g, geometry, poses, 0.0)
        if slot.shape[0] == 0:
            continue
        found = _evaluate(g, geometry, parts.laws, t, poses, rates, False, slot, gap)
        unit_energy = _unit_energy(g, parts.laws, _taken(floats_1d(g, SHARE), slot))
        before = fraction_before(
            rules_of(g), found.bodies, found.gradient, gap, _column(found.rate, 0, 1.0), found.forces.normal, found.onset,
            unit_energy, floats_2d(g, RATES_BEFORE), step,
        )  # fmt: skip
        part = min(part, before)
    return part


@kernel
def _longest_step(table: np.ndarray, groups: np.ndarray, parts: ContactParts, t: float) -> float:
    """Longest step that resolves impacts, s."""
    poses, rates, longest = floats_2d(table, POSES), floats_2d(table, RATES), np.inf
    for k in range(groups.shape[0]):
        g = table_at(groups, k)
        if not resolves(g):
            continue
        geometry = _geometry_of(g, parts)
        slot, gap = _find(g, geometry, poses, floats_1d(g, NUMBERS)[MARGIN])
        if slot.shape[0] == 0:
            continue
        bodies, rate, gradient = geometry.measure(g, poses, rates, slot)
        own = longest_step(
            rules_of(g), t, bodies, gradient, gap, _column(rate, 0, 1.0), _taken(floats_1d(g, ONSET), slot),
            _taken(floats_1d(g, BEGAN), slot), _unit_energy(g, parts.laws, _taken(floats_1d(g, SHARE), slot)), rates,
        )  # fmt: skip
        longest = min(longest, own)
    return longest


@kernel
def _accept(table: np.ndarray, groups: np.ndarray, parts: ContactParts, t: float) -> None:
    """Update the memory of all contacts; see `ContactGroup.commit`."""
    poses, rates = floats_2d(table, POSES), floats_2d(table, RATES)
    for k in range(groups.shape[0]):
        g = table_at(groups, k)
        state, geometry = integers_1d(g, STATE), _geometry_of(g, parts)
        slot, gap = _find(g, geometry, poses, 0.0)
        young = state[:0]
        if slot.shape[0] > 0:
            found = _evaluate(g, geometry, parts.laws, t, poses, rates, False, slot, gap)
            young = _remember(g, parts.laws, found, t, poses)
        else:
            _forget(g)
        floats_1d(g, NUMBERS)[COMMITTED_AT] = t
        copy_into(rates, floats_2d(g, RATES_BEFORE))
        copy_into(poses, floats_2d(g, COMMITTED))
        state[STARTED] = 1
        geometry.settle(g, poses, young, False)


@kernel
def _forget(g: np.ndarray) -> None:
    floats_1d(g, ONSET)[:] = 0.0
    floats_1d(g, BEGAN)[:] = 0.0
    floats_1d(g, DEPTH)[:] = 0.0
    floats_2d(g, DEFLECTION)[:] = 0.0


@kernel
def _remember(g: np.ndarray, laws: LawKernels, found: _Found, t: float, poses: np.ndarray) -> np.ndarray:
    """Write the memory of contacts, and return the slots of continuing impacts."""
    slot, count, state = found.slot, found.slot.shape[0], integers_1d(g, STATE)
    began, onset, age = _taken(floats_1d(g, BEGAN), slot), np.empty(count), np.empty(count)
    for i in range(count):
        if found.onset[i] == 0.0:
            began[i] = t
        # an external force may close an impact faster than its initial speed
        onset[i] = max(found.onset[i], max(-found.rate[i, 0], floor_of(g)))
        age[i] = t - began[i]
    deflection = found.deflection
    if state[STARTED] == 1 and state[FRICTION] == 1 and poses.shape[1] == 7:
        first = np.empty(count, dtype=np.int64)
        for i in range(count):
            first[i] = found.bodies[i, 0]
        deflection = carried(deflection, floats_2d(g, COMMITTED), poses, first)
    _forget(g)
    onsets, begans, depths, memory = floats_1d(g, ONSET), floats_1d(g, BEGAN), floats_1d(g, DEPTH), floats_2d(g, DEFLECTION)
    for i in range(count):
        onsets[slot[i]], begans[slot[i]], depths[slot[i]] = onset[i], began[i], -found.gap[i]
        for c in range(memory.shape[1]):
            memory[slot[i], c] = deflection[i, c]
    unit_energy = _unit_energy(g, laws, np.full(count, CORNER_WEIGHT))
    young = young_impacts(rules_of(g), age, found.bodies, found.gradient, onset, unit_energy)
    out, number = np.empty(count, dtype=np.int64), 0
    for i in range(count):
        if young[i]:
            out[number] = slot[i]
            number += 1
    return out[:number]


# energies ---------------------------------------------------------------------------------------------------------------


@kernel
def _sums(g: np.ndarray, laws: LawKernels, found: _Found, pairs: int) -> np.ndarray:
    part = np.empty(found.slot.shape[0])
    for i in range(part.shape[0]):
        part[i] = found.share[i] / floats_1d(g, SHARE)[found.slot[i]]
    elastic = _elastic(g, laws, -found.gap, found.share)
    return sums_of_pairs(
        integers_1d(g, PAIR), found.slot, floats_1d(g, AREA), part, found.forces.normal, elastic, found.rate,
        found.forces.effort, pairs,
    )  # fmt: skip


@kernel
def _stored(
    table: np.ndarray, groups: np.ndarray, parts: ContactParts, t: float, step: float, pair_force: np.ndarray
) -> tuple[float, float]:
    """Energy (J) and mean dissipated power (W) of all contacts; writes the normal forces of all pairs."""
    poses, rates, before = floats_2d(table, POSES), floats_2d(table, RATES), floats_2d(table, BEFORE)
    pair_energy, stored, power = floats_2d(table, PAIR_ENERGY), 0.0, 0.0
    pairs = pair_energy.shape[1]
    pair_force[:] = 0.0
    for k in range(groups.shape[0]):
        g = table_at(groups, k)
        geometry = _geometry_of(g, parts)
        slot, gap = _find(g, geometry, poses, 0.0)
        if slot.shape[0] == 0:
            continue
        found = _evaluate(g, geometry, parts.laws, t, poses, rates, False, slot, gap)
        energy = parts.laws.energy(-gap, found.share, floats_1d(g, NORMAL))
        for i in range(energy.shape[0]):
            stored += energy[i]
        sums = _sums(g, parts.laws, found, pairs)
        for p in range(pairs):
            pair_force[p] += sums[FORCES, p]
    if step > 0.0:
        mean = _moved(before, poses)
        for i in range(mean.shape[0]):
            for c in range(mean.shape[1]):
                mean[i, c] /= step
        for end in range(2):
            for k in range(groups.shape[0]):
                g = table_at(groups, k)
                if integers_1d(g, STATE)[LOSSY] == 0:
                    continue
                geometry, at = _geometry_of(g, parts), poses if end == 1 else before
                slot, gap = _find(g, geometry, at, 0.0)
                if slot.shape[0] == 0:
                    continue
                when = t if end == 1 else t - step
                found = _evaluate(g, geometry, parts.laws, when, at, mean, True, slot, gap)
                sums = _sums(g, parts.laws, found, pairs)
                for p in range(pairs):
                    for row in range(2):
                        power += 0.5 * sums[SLIDING + row, p]
                        pair_energy[row, p] += 0.5 * step * sums[SLIDING + row, p]
    copy_into(poses, before)
    return stored, power


# models without contacts ------------------------------------------------------------------------------------------------


@kernel
def _no_force(table: np.ndarray, groups: np.ndarray, parts: ContactParts, t: float) -> None:
    return


@kernel
def _whole_step(table: np.ndarray, groups: np.ndarray, parts: ContactParts, t: float, step: float) -> float:
    return 1.0


@kernel
def _any_step(table: np.ndarray, groups: np.ndarray, parts: ContactParts, t: float) -> float:
    return np.inf


@kernel
def _none_stored(
    table: np.ndarray, groups: np.ndarray, parts: ContactParts, t: float, step: float, pair_force: np.ndarray
) -> tuple[float, float]:
    return 0.0, 0.0


CONTACTS = ContactKernels(_force, _tangent, _part_of_step, _accept, _longest_step, _stored)
NO_CONTACTS = ContactKernels(_no_force, _no_force, _whole_step, _no_force, _any_step, _none_stored)
