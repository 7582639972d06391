"""Contacts of one state for a compiled model (`ArrayModel`): contact search, forces, and sums of the forces on each body.

The results are in the first rows of arrays of the table `g`; see `fsm.model.bodies.contact_arrays`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.contact.impacts import shared_weight
from fsm.kernels.body_poses import pose_difference
from fsm.kernels.jit import kernel, shared
from fsm.model.bodies import contact_arrays as row
from fsm.model.bodies.contact_arrays import ContactArrays, LawKernels
from fsm.model.contact.geometry_calls import geometry_of
from fsm.solve.stepping.vectors import copy_into


class Weighed(NamedTuple):
    """Rows of contacts whose weights change with the poses, and derivatives of these weights with respect to the poses."""

    rows: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray


@kernel
def equal_poses(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two sets of poses or rates are the same numbers."""
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
def renew_search(g: ContactArrays, poses: np.ndarray) -> int:
    """Update the broad phase and the weights of faces, if poses have changed; return 1 if the broad phase was updated."""
    state = g.state
    changed = state[row.CHANGES] == 1 and state[row.STARTED] == 1 and not equal_poses(poses, g.committed)
    renewed = geometry_of(g).renew(g, poses)
    if renewed == 1 or changed:
        geometry_of(g).settle(g, poses, state[:0], True)
    return int(renewed)


@kernel
def find_slots(g: ContactArrays, poses: np.ndarray, below: float) -> int:
    """Find the slots (possible contacts) with a gap below a bound, and return their number. A repeated call with the same
    poses, and the same bound or the bound 0, uses the stored result.
    """
    state, numbers, seen = g.state, g.numbers, g.found_poses
    known = state[row.FOUND] >= 0 and (numbers[row.BELOW] == below or below == 0.0 <= numbers[row.BELOW])
    if known and equal_poses(poses, seen):
        if numbers[row.BELOW] != below:
            _keep_touching(g)
        return int(state[row.FOUND])
    renew_search(g, poses)
    count = geometry_of(g).find(g, poses, below)
    state[row.FOUND], state[row.MEASURED], numbers[row.BELOW] = count, 0, below
    copy_into(poses, seen)
    return int(count)


@kernel
def _keep_touching(g: ContactArrays) -> None:
    """Reduce the contacts of the last search to those with a gap below 0."""
    slot, gap, state, count = g.slot, g.gap, g.state, 0
    rows = np.empty(state[row.FOUND], dtype=np.int64)
    for i in range(rows.shape[0]):
        if gap[i] < 0.0:
            slot[count], gap[count], rows[count] = slot[i], gap[i], i
            count += 1
    geometry_of(g).select(g, rows[:count])
    state[row.FOUND], state[row.MEASURED], g.numbers[row.BELOW] = count, 0, 0.0


@kernel
def find_pressed(g: ContactArrays, poses: np.ndarray) -> int:
    """Find the touching contacts, and those that an iteration of statics has opened slightly but that still have a depth.

    Returns their number.
    """
    pressed, slot, gap = g.pressed, g.slot, g.gap
    count, kept, among = find_slots(g, poses, 0.0), 0, 0
    for k in range(pressed.shape[0]):
        kept += 1 if pressed[k] > 0.0 else 0
    for i in range(count):
        among += 1 if pressed[slot[i]] > 0.0 else 0
    if among == kept:
        return count
    near, active = find_slots(g, poses, g.numbers[row.MARGIN]), 0
    rows = np.empty(near, dtype=np.int64)
    for i in range(near):
        if gap[i] < 0.0 or pressed[slot[i]] > 0.0:
            slot[active], gap[active], rows[active] = slot[i], gap[i], i
            active += 1
    geometry_of(g).select(g, rows[:active])
    g.state[row.FOUND] = -1
    return active


@kernel
def measure_slots(g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    """Compute rates and gradients of the contacts that were found. A repeated call with the same state uses the stored
    result.
    """
    state, seen = g.state, g.found_rates
    if state[row.MEASURED] == 1 and equal_poses(rates, seen):
        return
    geometry_of(g).measure(g, poses, rates, count)
    state[row.MEASURED] = 1
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
def bristle_arguments(
    g: ContactArrays, t: float, poses: np.ndarray, mean_rates: bool, count: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """Mean slip velocities (m/s), deflections of bristles in the last accepted state (m), and the time since then (s)."""
    duration, memory, slot, slip = max(0.0, t - g.numbers[row.COMMITTED_AT]), g.deflection, g.slot, g.slip
    mean, deflection = np.empty((count, slip.shape[1])), np.empty((count, slip.shape[1]))
    copy_into(slip[:count], mean)
    if not mean_rates and duration != 0.0 and g.state[row.STARTED] == 1:
        _write_mean_slip(g, poses, count, duration, mean)
    for i in range(count):
        for c in range(deflection.shape[1]):
            deflection[i, c] = memory[slot[i], c]
    return mean, deflection, duration


@kernel
def write_friction(g: ContactArrays, effort: np.ndarray, by_slip: np.ndarray, by_normal: np.ndarray) -> None:
    """Write friction and its derivatives; `by_normal` is that by the force on the bodies."""
    count, pull = effort.shape[0], g.pull
    copy_into(effort, g.effort[:count])
    copy_into(by_slip, g.by_slip[:count])
    for i in range(count):
        for c in range(by_normal.shape[1]):
            g.by_normal[i, c] = by_normal[i, c] * pull[i]


@kernel
def write_bristles(g: ContactArrays, by_mean: np.ndarray, deflected: np.ndarray, duration: float, mean_rates: bool) -> bool:
    """Write the deflections of bristles, and their stiffness; return whether they have one.

    If the slip velocity is the mean velocity, its derivative includes that by the mean.
    """
    count, own, by_distance = deflected.shape[0], g.by_slip, g.by_distance
    copy_into(deflected, g.deflected[:count])
    for i in range(count):
        for c in range(by_mean.shape[1]):
            for e in range(by_mean.shape[2]):
                own[i, c, e] += by_mean[i, c, e] if mean_rates else 0.0
                by_distance[i, c, e] = by_mean[i, c, e] / duration if duration > 0.0 else 0.0
    return not mean_rates and duration > 0.0


@kernel
def _of_friction(
    g: ContactArrays, count: int
) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Coefficient across a plate, slip velocities, normal forces on the bodies, bodies, rates, derivatives by rotation, and
    parameters.
    """
    normal = g.normal_force[:count]
    if g.state[row.MEANS] == 1:
        normal = normal.copy()
        for i in range(count):
            normal[i] *= g.pull[i]
    return (
        g.numbers[row.ACROSS], g.slip[:count], normal, g.bodies[:count], g.rate[:count], g.by_turn[:count],
        g.friction,
    )  # fmt: skip


@shared
def _set_friction(g: ContactArrays, laws: LawKernels, t: float, poses: np.ndarray, mean_rates: bool, count: int) -> bool:
    """Write friction and its derivatives; return whether bristles have a stiffness."""
    state = g.state
    if state[row.FRICTION] == 0:
        return False
    across, slip, normal, bodies, rate, by_turn, params = _of_friction(g, count)
    if state[row.BRISTLE] == 0:
        if across != 1.0:
            laws.stretch(slip, poses, bodies, across)
        effort, by_slip, by_normal = laws.friction(slip, normal, params)
        if across != 1.0:
            laws.stretch_efforts(
                poses, bodies, across, rate, slip[:0], effort, by_slip, by_slip[:0], by_normal, by_turn
            )
        write_friction(g, effort, by_slip, by_normal)
        return False
    mean, deflection, duration = bristle_arguments(g, t, poses, mean_rates, count)
    seen = mean
    if across != 1.0:
        seen = mean.copy()
        laws.stretch(slip, poses, bodies, across)
        laws.stretch(seen, poses, bodies, across)
    effort, by_slip, by_mean, by_normal, deflected = laws.bristle(slip, seen, normal, deflection, duration, params)
    if across != 1.0:
        laws.stretch_efforts(poses, bodies, across, rate, mean, effort, by_slip, by_mean, by_normal, by_turn)
    write_friction(g, effort, by_slip, by_normal)
    return bool(write_bristles(g, by_mean, deflected, duration, mean_rates))


@kernel
def _set_arguments(g: ContactArrays, count: int) -> None:
    """Write penetrations, closing speeds, slip velocities, shares, and initial closing speeds of the contacts."""
    slot, gap, rate = g.slot, g.gap, g.rate
    at, closing, slip, pull = g.at, g.closing, g.slip, g.pull
    share, onset, of_slots, memory = g.share_of, g.onset_of, g.share, g.onset
    for i in range(count):
        at[i], closing[i] = -gap[i], -rate[i, 0]
        if g.state[row.MEANS] == 0:
            pull[i] = 1.0
        share[i], onset[i] = of_slots[slot[i]], memory[slot[i]]
        for c in range(slip.shape[1]):
            slip[i, c] = rate[i, 1 + c]


@kernel
def any_limited(g: ContactArrays, count: int) -> bool:
    """Whether any contact has no depth of statics, and its force is limited."""
    slot, pressed = g.slot, g.pressed
    for i in range(count):
        if not pressed[slot[i]] > 0.0:
            return bool(g.numbers[row.MOST] > 0.0)
    return False


@kernel
def set_depths(g: ContactArrays, force: np.ndarray, tapered: np.ndarray, count: int) -> None:
    """Write the depths at which statics linearises the normal law, m.

    A contact without a depth begins at its penetration, or where its force is `MOST`; `force` contains the forces (N) at the
    penetrations, or nothing if no force is limited. Tapered contacts are linearised at their penetration.
    """
    at, slot, gap, pressed, most = g.at, g.slot, g.gap, g.pressed, g.numbers[row.MOST]
    for i in range(force.shape[0]):
        if force[i] > most:
            at[i] *= (most / force[i]) ** (1.0 / row.exponent_of(g))
    for i in range(count):
        if pressed[slot[i]] > 0.0:
            at[i] = pressed[slot[i]]
    for k in range(tapered.shape[0]):
        at[tapered[k]] = -gap[tapered[k]]


@kernel
def write_normal(g: ContactArrays, normal: np.ndarray, slopes: np.ndarray) -> None:
    """Write normal forces and their slopes, and the forces of the linearised law."""
    own, by_depth, by_closing, acting, gap, at = g.normal_force, g.by_depth, g.by_closing, g.acting, g.gap, g.at
    for i in range(normal.shape[0]):
        own[i], by_depth[i], by_closing[i] = normal[i], slopes[i, 0], slopes[i, 1]
        acting[i] = normal[i] + slopes[i, 0] * (-gap[i] - at[i])


@kernel
def prepare(g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int) -> Weighed:
    """Write rates, gradients, and the arguments of the laws, of the contacts that have been found."""
    g.state[row.EVALUATIONS] += 1
    measure_slots(g, poses, rates, count)
    _set_arguments(g, count)
    rows, part, gradient, hessian = geometry_of(g).tapered(g, poses, count)
    share = g.share_of
    for k in range(rows.shape[0]):
        share[rows[k]] *= part[k]
    return Weighed(rows, gradient, hessian)


@kernel
def _of_normal(
    g: ContactArrays, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Arguments of the normal law: depths, closing speeds, initial closing speeds, shares and parameters."""
    return g.at[:count], g.closing[:count], g.onset_of[:count], g.share_of[:count], g.normal


@shared
def evaluate(
    g: ContactArrays, laws: LawKernels, t: float, poses: np.ndarray, rates: np.ndarray,
    mean_rates: bool, count: int, at_depths: bool,
) -> tuple[Weighed, bool]:  # fmt: skip
    """Compute the forces of the contacts that have been found; also return whether bristles have a stiffness.

    With `mean_rates`, the rates are means over the step, and the deflection of the bristles follows from the same means.
    With `at_depths`, the normal law is linearised at the depths of statics.
    """
    weighed = prepare(g, poses, rates, count)
    at, closing, onset, share, params = _of_normal(g, count)
    if at_depths:
        force = closing[:0]
        if any_limited(g, count):
            force, _ = laws.normal(at, closing, onset, share, params)
        set_depths(g, force, weighed.rows, count)
    normal, slopes = laws.normal(at, closing, onset, share, params)
    write_normal(g, normal, slopes)
    return weighed, _set_friction(g, laws, t, poses, mean_rates, count)


@kernel
def taper_arguments(g: ContactArrays, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Depths (m) and whole shares of contacts whose weights change with the poses."""
    slot, gap, share = g.slot, g.gap, g.share
    depth, whole = np.empty(rows.shape[0]), np.empty(rows.shape[0])
    for k in range(rows.shape[0]):
        depth[k], whole[k] = -gap[rows[k]], share[slot[rows[k]]]
    return depth, whole


@kernel
def add_forces(g: ContactArrays, weighed: Weighed, energy: np.ndarray, count: int, total: np.ndarray) -> None:
    """Add the forces of contacts to the forces of all bodies; `energy` (J) is that of the rows of `weighed`."""
    bodies, gradient, size = g.bodies, g.gradient, total.shape[1]
    normal, acting, efforts, by_normal = g.normal_force, g.acting, g.effort, g.by_normal
    slips = efforts.shape[1] if g.state[row.FRICTION] == 1 else 0
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
    for k in range(rows.shape[0]):  # force due to the change of the weight with the pose
        for b in range(bodies.shape[1]):
            for c in range(size):
                total[bodies[rows[k], b], c] -= energy[k] * weighed.gradient[k, b * size + c]


@shared
def taper_energy(g: ContactArrays, laws: LawKernels, rows: np.ndarray) -> np.ndarray:
    """Energies (J) of contacts whose weights change with the poses."""
    if rows.shape[0] == 0:
        return g.gap[:0]
    depth, whole = taper_arguments(g, rows)
    energy: np.ndarray = laws.energy(depth, whole, g.normal)
    return energy


@shared
def unit_energies(g: ContactArrays, laws: LawKernels, share: np.ndarray) -> np.ndarray:
    """Energies (J) of contacts with these shares at the depth 1 m."""
    energy: np.ndarray = laws.energy(np.ones(share.shape[0]), shared_weight(share), g.normal)
    return energy


@shared
def elastic_force(g: ContactArrays, laws: LawKernels, depth: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Normal forces of contacts with zero rates."""
    force: np.ndarray
    force, _ = laws.normal(depth, np.zeros(depth.shape[0]), np.ones(depth.shape[0]), share, g.normal)
    return force
