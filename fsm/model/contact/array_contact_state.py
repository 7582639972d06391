"""Contacts of one state for a compiled model (`ArrayModel`): contact search, forces, and sums of the forces on each body.

The results are in the first rows of arrays of the table `g`; see `fsm.model.bodies.contact_arrays`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.body_poses import pose_difference
from fsm.kernels.jit import kernel
from fsm.model.bodies.contact_arrays import (
    BELOW,
    BRISTLE,
    CHANGES,
    COMMITTED_AT,
    EVALUATIONS,
    FOUND,
    FRICTION,
    KIND,
    MARGIN,
    MEASURED,
    MOST,
    SHAPES,
    SHEETS,
    STARTED,
    ContactArrays,
    ContactParts,
    GeometryKernels,
    LawKernels,
    exponent_of,
)
from fsm.solve.stepping.vectors import copy_into


class Weighed(NamedTuple):
    """Rows of contacts whose weights change with the poses, and derivatives of these weights with respect to the poses."""

    rows: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray


@kernel
def geometry_of(g: ContactArrays, parts: ContactParts) -> GeometryKernels:
    """Kernels of the geometry of a group."""
    if g.state[KIND] == SHEETS:
        return parts.sheets
    return parts.shapes if g.state[KIND] == SHAPES else parts.surfaces


@kernel
def _equal(a: np.ndarray, b: np.ndarray) -> bool:
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            if a[i, k] != b[i, k]:
                return False
    return True


@kernel
def values_at(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Selected rows of an array."""
    out = np.empty(rows.shape[0])
    for i in range(rows.shape[0]):
        out[i] = values[rows[i]]
    return out


@kernel
def column_of(values: np.ndarray, column: int, sign: float) -> np.ndarray:
    """Column of an array times a sign."""
    out = np.empty(values.shape[0])
    for i in range(values.shape[0]):
        out[i] = sign * values[i, column]
    return out


@kernel
def increments(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Increments (n_bodies, 3 or 6) between two sets of poses."""
    if start.shape[1] == 7:
        return pose_difference(start.reshape(-1), end.reshape(-1)).reshape(-1, 6)
    return end - start


# search -----------------------------------------------------------------------------------------------------------------


@kernel
def renew_search(g: ContactArrays, geometry: GeometryKernels, poses: np.ndarray) -> None:
    """Update the broad phase and the weights of faces, if poses have changed."""
    state = g.state
    changed = state[CHANGES] == 1 and state[STARTED] == 1 and not _equal(poses, g.committed)
    renewed = geometry.renew(g, poses)
    if (renewed == 1 or changed) and state[KIND] == SHAPES:
        geometry.settle(g, poses, state[:0], True)


@kernel
def find_slots(g: ContactArrays, geometry: GeometryKernels, poses: np.ndarray, below: float) -> int:
    """Find the slots (possible contacts) with a gap below a bound, and return their number. A repeated call with the same
    poses uses the stored result.
    """
    state, numbers, seen = g.state, g.numbers, g.found_poses
    if state[FOUND] >= 0 and numbers[BELOW] == below and _equal(poses, seen):
        return int(state[FOUND])
    renew_search(g, geometry, poses)
    count = geometry.find(g, poses, below)
    state[FOUND], state[MEASURED], numbers[BELOW] = count, 0, below
    copy_into(poses, seen)
    return int(count)


@kernel
def find_pressed(g: ContactArrays, geometry: GeometryKernels, poses: np.ndarray) -> int:
    """Find the touching contacts, and those that an iteration of statics has opened slightly but that still have a depth.

    Returns their number.
    """
    pressed, slot, gap = g.pressed, g.slot, g.gap
    count, kept, among = find_slots(g, geometry, poses, 0.0), 0, 0
    for k in range(pressed.shape[0]):
        kept += 1 if pressed[k] > 0.0 else 0
    for i in range(count):
        among += 1 if pressed[slot[i]] > 0.0 else 0
    if among == kept:
        return count
    near, active = find_slots(g, geometry, poses, g.numbers[MARGIN]), 0
    rows = np.empty(near, dtype=np.int64)
    for i in range(near):
        if gap[i] < 0.0 or pressed[slot[i]] > 0.0:
            slot[active], gap[active], rows[active] = slot[i], gap[i], i
            active += 1
    geometry.select(g, rows[:active])
    g.state[FOUND] = -1
    return active


@kernel
def measure_slots(g: ContactArrays, geometry: GeometryKernels, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    """Compute rates and gradients of the contacts that were found. A repeated call with the same state uses the stored
    result.
    """
    state, seen = g.state, g.found_rates
    if state[MEASURED] == 1 and _equal(rates, seen):
        return
    geometry.measure(g, poses, rates, count)
    state[MEASURED] = 1
    copy_into(rates, seen)


# forces -----------------------------------------------------------------------------------------------------------------


@kernel
def _write_mean_slip(g: ContactArrays, poses: np.ndarray, count: int, duration: float, out: np.ndarray) -> None:
    """Write the mean slip velocity since the last accepted state, which increases the deflection of the bristles."""
    bodies, gradient, moved = g.bodies, g.gradient, increments(g.committed, poses)
    size = moved.shape[1]
    for i in range(count):
        for c in range(out.shape[1]):
            out[i, c] = 0.0
            for b in range(bodies.shape[1]):
                for k in range(size):
                    out[i, c] += gradient[i, 1 + c, b * size + k] * moved[bodies[i, b], k] / duration


@kernel
def _set_friction(g: ContactArrays, laws: LawKernels, t: float, poses: np.ndarray, mean_rates: bool, count: int) -> bool:
    """Write friction and its derivatives; return whether bristles have a stiffness."""
    state, normal, slip = g.state, g.normal_force[:count], g.slip[:count]
    if state[FRICTION] == 0:
        return False
    params = g.friction
    if state[BRISTLE] == 0:
        efforts, slopes, parts = laws.friction(slip, normal, params)
        copy_into(efforts, g.effort[:count])
        copy_into(slopes, g.by_slip[:count])
        copy_into(parts, g.by_normal[:count])
        return False
    duration, memory = max(0.0, t - g.numbers[COMMITTED_AT]), g.deflection
    slot, shape = g.slot, (count, slip.shape[1])
    mean, deflection = np.empty(shape), np.empty(shape)
    copy_into(slip, mean)
    if not mean_rates and duration != 0.0 and state[STARTED] == 1:
        _write_mean_slip(g, poses, count, duration, mean)
    for i in range(count):
        for c in range(deflection.shape[1]):
            deflection[i, c] = memory[slot[i], c]
    effort, by_slip, by_mean, by_normal, deflected = laws.bristle(slip, mean, normal, deflection, duration, params)
    copy_into(effort, g.effort[:count])
    copy_into(by_normal, g.by_normal[:count])
    copy_into(deflected, g.deflected[:count])
    own, by_distance = g.by_slip, g.by_distance
    for i in range(count):
        for c in range(by_slip.shape[1]):
            for e in range(by_slip.shape[2]):
                own[i, c, e] = by_slip[i, c, e] + (by_mean[i, c, e] if mean_rates else 0.0)
                by_distance[i, c, e] = by_mean[i, c, e] / duration if duration > 0.0 else 0.0
    return not mean_rates and duration > 0.0


@kernel
def _set_arguments(g: ContactArrays, count: int) -> None:
    """Write penetrations, closing speeds, slip velocities, shares, and initial closing speeds of the contacts."""
    slot, gap, rate = g.slot, g.gap, g.rate
    at, closing, slip = g.at, g.closing, g.slip
    share, onset, of_slots, memory = g.share_of, g.onset_of, g.share, g.onset
    for i in range(count):
        at[i], closing[i] = -gap[i], -rate[i, 0]
        share[i], onset[i] = of_slots[slot[i]], memory[slot[i]]
        for c in range(slip.shape[1]):
            slip[i, c] = rate[i, 1 + c]


@kernel
def _set_depths(g: ContactArrays, laws: LawKernels, tapered: np.ndarray, count: int) -> None:
    """Write the depths at which statics linearises the normal law, m.

    A contact without a depth begins at its penetration, or where its force is `MOST`. Tapered contacts are linearised at
    their penetration.
    """
    at, slot, gap, pressed, most, new = g.at, g.slot, g.gap, g.pressed, g.numbers[MOST], 0
    for i in range(count):
        new += 0 if pressed[slot[i]] > 0.0 else 1
    if new > 0 and most > 0.0:
        force, _ = laws.normal(at[:count], g.closing[:count], g.onset_of[:count], g.share_of[:count], g.normal)
        for i in range(count):
            if not pressed[slot[i]] > 0.0 and force[i] > most:
                at[i] *= (most / force[i]) ** (1.0 / exponent_of(g))
    for i in range(count):
        if pressed[slot[i]] > 0.0:
            at[i] = pressed[slot[i]]
    for k in range(tapered.shape[0]):
        at[tapered[k]] = -gap[tapered[k]]


@kernel
def evaluate(
    g: ContactArrays, geometry: GeometryKernels, laws: LawKernels, t: float, poses: np.ndarray, rates: np.ndarray,
    mean_rates: bool, count: int, at_depths: bool,
) -> tuple[Weighed, bool]:  # fmt: skip
    """Compute the forces of the contacts that have been found; also return whether bristles have a stiffness.

    With `mean_rates`, the rates are means over the step, and the deflection of the bristles follows from the same means.
    With `at_depths`, the normal law is linearised at the depths of statics.
    """
    g.state[EVALUATIONS] += 1
    measure_slots(g, geometry, poses, rates, count)
    _set_arguments(g, count)
    rows, part, gradient, hessian = geometry.tapered(g, poses, count)
    share, params = g.share_of[:count], g.normal
    for k in range(rows.shape[0]):
        share[rows[k]] *= part[k]
    closing, onset, at, gap = g.closing[:count], g.onset_of[:count], g.at, g.gap
    if at_depths:
        _set_depths(g, laws, rows, count)
    normal, slopes = laws.normal(at[:count], closing, onset, share, params)
    own, by_depth, by_closing, acting = g.normal_force, g.by_depth, g.by_closing, g.acting
    for i in range(count):
        own[i], by_depth[i], by_closing[i] = normal[i], slopes[i, 0], slopes[i, 1]
        acting[i] = normal[i] + slopes[i, 0] * (-gap[i] - at[i]) if at_depths else normal[i]
    bristles = _set_friction(g, laws, t, poses, mean_rates, count)
    return Weighed(rows, gradient, hessian), bristles


@kernel
def add_forces(g: ContactArrays, laws: LawKernels, weighed: Weighed, count: int, total: np.ndarray) -> None:
    """Add the forces of contacts to the forces of all bodies."""
    bodies, gradient, size = g.bodies, g.gradient, total.shape[1]
    normal, acting, efforts, by_normal = g.normal_force, g.acting, g.effort, g.by_normal
    slips = efforts.shape[1] if g.state[FRICTION] == 1 else 0
    for i in range(count):
        for b in range(bodies.shape[1]):
            for c in range(size):
                along = b * size + c
                change = -acting[i] * gradient[i, 0, along]
                for k in range(slips):
                    effort = efforts[i, k]
                    if acting[i] != normal[i]:
                        effort += by_normal[i, k] * (acting[i] - normal[i])
                    change += effort * gradient[i, 1 + k, along]
                total[bodies[i, b], c] -= change
    rows = weighed.rows
    if rows.shape[0] == 0:
        return
    slot, gap, share = g.slot, g.gap, g.share
    depth, whole = np.empty(rows.shape[0]), np.empty(rows.shape[0])
    for k in range(rows.shape[0]):
        depth[k], whole[k] = -gap[rows[k]], share[slot[rows[k]]]
    energy = laws.energy(depth, whole, g.normal)
    for k in range(rows.shape[0]):  # force due to the change of the weight with the pose
        for b in range(bodies.shape[1]):
            for c in range(size):
                total[bodies[rows[k], b], c] -= energy[k] * weighed.gradient[k, b * size + c]


@kernel
def elastic_force(g: ContactArrays, laws: LawKernels, depth: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Normal forces of contacts with zero rates."""
    force: np.ndarray
    force, _ = laws.normal(depth, np.zeros(depth.shape[0]), np.ones(depth.shape[0]), share, g.normal)
    return force
