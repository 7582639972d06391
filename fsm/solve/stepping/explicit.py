"""One step of an explicit Runge-Kutta method of order 8 with error control: M u' = h(t, q, u), q' = T(q) u.

For mechanisms and free bodies without stiff springs, whose motion takes long steps at a small tolerance. The method is that
of Dormand and Prince with 12 stages (Hairer, Norsett, Wanner 1993, DOP853), with errors of order 5 and 3. Quaternions are
integrated as four numbers. Accelerations with locked directions come from the equations at acceleration level
(`fsm.solve.stepping.model.consistent`). All stages and the end of each step are projected to opening rates of zero. The end,
and the stages of mechanisms with loops, are also projected to openings of zero. Trees of joints have minimal coordinates
instead (`fsm.solve.stepping.model.to_minimal`), and are projected at the ends of several steps only, against round-off. Work
and dissipated energy are integrated with the same stages.

Steps end at events, for example where a stop is hit. In minimal coordinates the forces of a step are smooth up to its first
event (`fsm.model.elements.joint_laws.stops_after`), whose time comes from the interpolation of order 7 between both ends of
the step. Other steps are repeated until one ends there.

Springs and dampers bound the step: h omega < 6 for a spring, h c/m < 6 for a damper.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.addresses import floats_1d
from fsm.kernels.jit import kernel, shared
from fsm.kernels.pointers import borrowed
from fsm.kernels.rotation import increments_of_rates, pose_rates, with_unit_quaternions
from fsm.kernels.vector import mean_ratio
from fsm.solve.stepping import generalized_alpha as alpha
from fsm.solve.stepping import model as calls
from fsm.solve.stepping.march import end_step
from fsm.solve.stepping.outcomes import NO_SOLUTION, OBJECTED, STEP_TOO_SMALL, STEPPED, UNABLE
from fsm.solve.stepping.vectors import copy_into

DONE, LOST = 9, 10
"""Indices of `ExplicitMotion.sizes` after those of `fsm.solve.stepping.generalized_alpha`: work and dissipated energy of the
last step, J."""
COORDINATES, SPEEDS = 11, 12
"""Indices of `ExplicitMotion.counts`: numbers of minimal coordinates and of their rates, zero without them."""
_SAFETY, _SHRINK, _GROW = 0.9, 0.2, 5.0
"""Factor on a step size, and bounds of its change."""
_ORDER = 8.0
_OF_ERROR, _OF_LAST = 0.7 / _ORDER, 0.4 / _ORDER
"""Powers of the error of a step and of the last one in the size of the next step (Gustafsson 1991)."""
_WANTED = _SAFETY**_ORDER
"""Error of a step over the tolerance, which the size of the next step aims at."""
_LEAST_ERROR = 1e-4
"""Least error of the last step that counts."""
_SMALLEST = 16.0 * float(np.finfo(float).eps)
"""Smallest step relative to the present time."""
_STAGES, _SEARCHES = 12, 60
"""Stages of a step, and largest number of interpolated states in the search of an event."""
_REPEATED = 1e-8
"""Tolerance below which a step is repeated up to its event, because the order of the interpolation is lower."""


class ExplicitRules(NamedTuple):
    """Constants of the method, tolerances and scales.

    Attributes
    ----------
    rtol : -
    nodes, weights : (12,) arrays
    stages : (12, 12) array
        Row i: weights of the earlier rates in stage i.
    error_5, error_3 : (12,) arrays
        Weights of the errors.
    tolerance, velocity, increment : (nu,) arrays
        Tolerance of the increments, and scales of `fsm.solve.interface.scales.Scales`.
    breaks : increasing times, s
    more_nodes, more_stages : (3,) and (3, 16) arrays
        The same for the rates of the interpolation, after the rate at the end of the step.
    between : (4, 16) array
        Weights of the interpolation.
    """

    rtol: float
    nodes: np.ndarray
    weights: np.ndarray
    stages: np.ndarray
    error_5: np.ndarray
    error_3: np.ndarray
    tolerance: np.ndarray
    velocity: np.ndarray
    increment: np.ndarray
    breaks: np.ndarray
    more_nodes: np.ndarray
    more_stages: np.ndarray
    between: np.ndarray


class ExplicitMotion(NamedTuple):
    """State of the method, changed in place.

    Attributes
    ----------
    q, u, rate : configuration (nq,), velocity and acceleration (nu,)
    sizes, counts : (11,) float and (13,) int arrays
        See the indices above and in `fsm.solve.stepping.generalized_alpha`.
    y, v : (nq,) and (nu,) arrays
        Minimal coordinates and their rates, in the first places.
    of_q, of_u : (16, nq) and (16, nu) arrays
        Rates of q and u, or of y and v, in all stages, at the end, and for the interpolation.
    at_q, at_u, moved, faster : (nq,), (nu,), (nu,) and (nu,) arrays, work space
    of_energy : (16, 2) array, W
        The same of work and dissipated energy.
    pairs, drives : (2, n_pairs) and (n_drives,) arrays, work space
    record : record of a step (`fsm.solve.stepping.model`), work space
    """

    q: np.ndarray
    u: np.ndarray
    rate: np.ndarray
    sizes: np.ndarray
    counts: np.ndarray
    y: np.ndarray
    v: np.ndarray
    of_q: np.ndarray
    of_u: np.ndarray
    at_q: np.ndarray
    at_u: np.ndarray
    moved: np.ndarray
    faster: np.ndarray
    of_energy: np.ndarray
    pairs: np.ndarray
    drives: np.ndarray
    record: np.ndarray


@shared
def take_step(model: Any, motion: ExplicitMotion, rules: ExplicitRules, until: float) -> int:
    """Take one step that ends at `until` or before, and return the outcome."""
    sizes, counts = motion.sizes, motion.counts
    t, target = sizes[alpha.TIME], until
    for b in rules.breaks:
        if b > t:
            target = min(target, b)
    y, v = _state(motion)
    first, second = motion.at_q[: y.shape[0]], motion.at_u[: v.shape[0]]
    copy_into(y, first)
    copy_into(v, second)
    counts[alpha.FORCES] += 1
    if not _stage(
        model, np.nextafter(t, math.inf), first, second, motion.of_q[0], motion.of_u[0], motion.of_energy[0], motion.pairs,
        motion.drives, counts[SPEEDS] > 0, rules.weights[0] != 0.0, False,
    ):  # fmt: skip
        return UNABLE if calls.unable(model) else NO_SOLUTION
    if counts[alpha.STARTED] == 0:
        if counts[SPEEDS] == 0:
            copy_into(motion.of_u[0], motion.rate)
        else:
            calls.from_minimal_changes(model, y, motion.of_q[0], motion.of_u[0], motion.moved, motion.rate)
        sizes[alpha.LONGEST], counts[alpha.STARTED] = calls.longest_step(model, t, motion.q, motion.u), 1
        if sizes[alpha.STEP_SIZE] == 0.0:
            sizes[alpha.STEP_SIZE] = _first_size(motion, rules, until - t)
    grow, most = True, math.inf
    while True:
        h, end = _next_size(motion, target, most)
        at = 1.0
        if not end > t:
            return STEP_TOO_SMALL
        if not _stages(model, motion, rules, t, end, h):
            return UNABLE if calls.unable(model) else NO_SOLUTION
        y, v = _state(motion)
        y, v = _sum(y, motion.of_q, rules.weights, h), _sum(v, motion.of_u, rules.weights, h)
        q, u, turns = y, v, math.inf
        error, part = _error(model, motion, rules, y, h), 1.0
        if error < math.inf:
            if counts[SPEEDS] > 0:
                q, u = motion.q.copy(), motion.u.copy()
                turns = calls.from_minimal(model, y, v, q, u)
            else:
                with_unit_quaternions(q, u.shape[0])
                if error <= 1.0 and not _accelerate(model, np.nextafter(end, -math.inf), q, u, motion.rate, False):
                    return UNABLE if calls.unable(model) else NO_SOLUTION  # before the end, since motors jump at breaks
            part = calls.part_of_step(model, end, q, u, h)
            if error <= 1.0 and part < 1.0 and counts[SPEEDS] > 0:
                if not _more_stages(model, motion, rules, t, end, h, y, v):
                    return UNABLE if calls.unable(model) else NO_SOLUTION
                last, rate = y.copy(), v.copy()
                at = _part_to_event(model, motion, rules, h, part, last, rate, y, v, q, u)
                if at > 0.0 and rules.rtol < _REPEATED and most == math.inf:
                    part, at = at, 1.0
                elif at > 0.0:
                    part, turns = 1.0, calls.from_minimal(model, y, v, q, u)
                    end = t + at * h
            if error <= 1.0 and part >= 1.0:
                break
        counts[alpha.REJECTED] += 1
        grow = False
        most = h * part if part < 1.0 and (error <= 1.0 or counts[SPEEDS] == 0) else math.inf
        if error > 1.0:
            sizes[alpha.STEP_SIZE] = h * (max(_SHRINK, _SAFETY * error ** (-1.0 / _ORDER)) if error < math.inf else _SHRINK)
        if min(most, sizes[alpha.STEP_SIZE]) < _SMALLEST * max(abs(t), until - t):
            return OBJECTED if part < 1.0 else STEP_TOO_SMALL
    sizes[DONE], sizes[LOST] = _energy(motion, rules, h, at, 0), _energy(motion, rules, h, at, 1)
    if counts[SPEEDS] > 0:
        copy_into(y, motion.y[: counts[COORDINATES]])
        copy_into(v, motion.v[: counts[SPEEDS]])
    copy_into(q, motion.q)
    copy_into(u, motion.u)
    sizes[alpha.STEP_SIZE], sizes[alpha.TIME] = _following(sizes, h, error, grow), end
    counts[alpha.STEPS] += 1
    before = calls.stored(model, end, motion.q, motion.u, motion.record)[1] if at < 1.0 or part > 1.0 else 0.0
    sizes[alpha.LONGEST] = min(calls.accept(model, end, motion.q, motion.u), turns)
    if at < 1.0 or part > 1.0:  # a latch that opens loses its energy
        sizes[LOST] += before - calls.stored(model, end, motion.q, motion.u, motion.record)[1]
    return STEPPED


@kernel
def _following(sizes: np.ndarray, h: float, error: float, grow: bool) -> float:
    """Size of the step after one of size h, which may `grow` unless the step was repeated.

    A step that is shortened to end at a given time or at an event neither reduces the size of later steps nor counts as the
    last one.
    """
    if h < sizes[alpha.STEP_SIZE]:
        longer = h * min(_GROW, _SAFETY * max(error, 1e-12) ** (-1.0 / _ORDER)) if grow else 0.0
        return max(longer, sizes[alpha.STEP_SIZE])
    factor = (max(error, 1e-12) / _WANTED) ** -_OF_ERROR
    if sizes[alpha.LAST_ERROR] > 0.0:
        factor *= (sizes[alpha.LAST_ERROR] / _WANTED) ** _OF_LAST
    sizes[alpha.LAST_ERROR] = max(error, _LEAST_ERROR)
    return h * min(factor, _GROW if grow else 1.0)


@shared
def _state(motion: ExplicitMotion) -> tuple[np.ndarray, np.ndarray]:
    """Minimal coordinates and their rates; without them q and u."""
    if motion.counts[SPEEDS] > 0:
        return motion.y[: motion.counts[COORDINATES]], motion.v[: motion.counts[SPEEDS]]
    return motion.q, motion.u


@shared
def _begin(model: Any, motion: ExplicitMotion) -> None:
    """Change to minimal coordinates, if the model has them."""
    counts = motion.counts
    counts[COORDINATES], counts[SPEEDS] = calls.to_minimal(
        model, motion.sizes[alpha.TIME], motion.q, motion.u, motion.y, motion.v
    )


@shared
def _end(model: Any, motion: ExplicitMotion, outcome: int) -> int:
    """Change from minimal coordinates, and find the multipliers at the end of the last step; returns the outcome."""
    if motion.counts[SPEEDS] > 0:
        before = np.nextafter(motion.sizes[alpha.TIME], -math.inf)
        _accelerate(model, before, motion.q, motion.u, motion.rate, False)
        motion.counts[COORDINATES] = motion.counts[SPEEDS] = 0
    return outcome


@shared
def _next_size(motion: ExplicitMotion, target: float, most: float) -> tuple[float, float]:
    """Size and end of the next step, which is `most` at the most; a step ends exactly at `target`, without a tiny step
    before it.
    """
    sizes = motion.sizes
    left = target - sizes[alpha.TIME]
    h = min(sizes[alpha.STEP_SIZE], sizes[alpha.MAX_STEP], sizes[alpha.LONGEST], most)
    if h >= left * (1.0 - 1e-9):
        return left, target
    h = min(h, 0.5 * left)
    return h, sizes[alpha.TIME] + h


@shared
def _first_size(motion: ExplicitMotion, rules: ExplicitRules, left: float) -> float:
    """Step in which velocities and positions change by a small part of their scales, s."""
    pace = max(mean_ratio(motion.rate, rules.velocity), mean_ratio(motion.u, rules.increment))
    return float(min(1e-2 * left, 0.1 * rules.rtol ** (1.0 / _ORDER) / pace if pace > 0.0 else left))


@shared
def _accelerate(model: Any, t: float, q: np.ndarray, u: np.ndarray, rate: np.ndarray, inside: bool) -> bool:
    """Project q and u, and write their acceleration; false if the mass is singular."""
    if calls.consistent(model, t, q, u, rate, inside):
        return True
    if not calls.factorise_mass(model):
        return False
    copy_into(calls.solve(model, calls.force(model, t, q, u)), rate)
    return True


@shared
def _stage(
    model: Any, t: float, q: np.ndarray, u: np.ndarray, of_q: np.ndarray, of_u: np.ndarray, of_energy: np.ndarray,
    pairs: np.ndarray, drives: np.ndarray, minimal: bool, counts: bool, inside: bool,
) -> bool:  # fmt: skip
    """Write the rates of a stage, and its powers if it `counts`; q and u are projected, but quaternions keep their lengths
    in their rates. `minimal`: q and u are minimal coordinates and their rates. Other arguments are rows of `ExplicitMotion`.
    """
    if minimal:
        good, of_energy[0], of_energy[1] = calls.minimal_rates(model, t, q, u, of_q, of_u, pairs, drives, counts)
        return good
    raw = q.copy()
    with_unit_quaternions(q, u.shape[0])
    of_u[:] = 0.0
    if not _accelerate(model, t, q, u, of_u, inside):
        return False
    copy_into(pose_rates(raw, u), of_q)
    if counts:
        of_energy[0], of_energy[1] = calls.powers(model, t, q, u, pairs, drives)
    return True


@shared
def _stages(model: Any, motion: ExplicitMotion, rules: ExplicitRules, t: float, end: float, h: float) -> bool:
    """Write the rates of all stages after the first one, which are inside the step: forces jump at breaks."""
    first, last = np.nextafter(t, math.inf), np.nextafter(end, -math.inf)
    y, v = _state(motion)
    q, u, minimal = motion.at_q[: y.shape[0]], motion.at_u[: v.shape[0]], motion.counts[SPEEDS] > 0
    for i in range(1, rules.nodes.shape[0]):
        _add(y, motion.of_q, rules.stages[i], i, h, q)
        _add(v, motion.of_u, rules.stages[i], i, h, u)
        motion.counts[alpha.FORCES] += 1
        if not _stage(
            model, min(max(t + rules.nodes[i] * h, first), last), q, u, motion.of_q[i], motion.of_u[i], motion.of_energy[i],
            motion.pairs, motion.drives, minimal, rules.weights[i] != 0.0, True,
        ):  # fmt: skip
            return False
    return True


@kernel
def _sum(start: np.ndarray, rates: np.ndarray, weights: np.ndarray, h: float) -> np.ndarray:
    """Start plus h times the weighted sum of rates (m, n)."""
    out = np.empty(start.shape[0])
    _add(start, rates, weights, weights.shape[0], h, out)
    return out


@kernel
def _add(start: np.ndarray, rates: np.ndarray, weights: np.ndarray, count: int, h: float, out: np.ndarray) -> None:
    """Write start plus h times the weighted sum of the first rates (m, n)."""
    for k in range(out.shape[0]):
        out[k] = start[k]
    for i in range(count):
        if weights[i] != 0.0:
            factor = h * weights[i]
            for k in range(out.shape[0]):
                out[k] += factor * rates[i, k]


@shared
def _energy(motion: ExplicitMotion, rules: ExplicitRules, h: float, at: float, column: int) -> float:
    """Work or dissipated energy up to a part of the step, J."""
    total = 0.0
    for i in range(_STAGES):
        total += h * rules.weights[i] * motion.of_energy[i, column]
    if at < 1.0:
        return _interpolated(0.0, total, motion.of_energy, column, rules.between, h, at)
    return total


@kernel
def _interpolated(
    start: float, end: float, rates: np.ndarray, column: int, between: np.ndarray, h: float, at: float
) -> float:
    """Value at a part of a step (Hairer, Norsett, Wanner 1993, II.6), from the rates (16, n) of its stages."""
    first, change = h * rates[0, column], end - start
    total, factor, left = 0.0, at, 1.0 - at
    for m in range(3, -1, -1):
        row = 0.0
        for i in range(between.shape[1]):
            row += between[m, i] * rates[i, column]
        total = (total + h * row) * (factor if m % 2 == 1 else left)
    total = (total + 2.0 * change - first - h * rates[_STAGES, column]) * factor
    total = (total + first - change) * left
    return start + (total + change) * factor


@shared
def _more_stages(
    model: Any, motion: ExplicitMotion, rules: ExplicitRules, t: float, end: float, h: float, y: np.ndarray, v: np.ndarray
) -> bool:  # fmt: skip
    """Write the rates at the end of a step in minimal coordinates, (y, v), and those of the interpolation."""
    start, faster = _state(motion)
    q, u = motion.at_q[: y.shape[0]], motion.at_u[: v.shape[0]]
    first, last = np.nextafter(t, math.inf), np.nextafter(end, -math.inf)
    for number in range(1 + rules.more_nodes.shape[0]):
        i, time = _STAGES + number, last
        if number == 0:
            copy_into(y, q)
            copy_into(v, u)
        else:
            time = min(max(t + rules.more_nodes[number - 1] * h, first), last)
            _add(start, motion.of_q, rules.more_stages[number - 1], i, h, q)
            _add(faster, motion.of_u, rules.more_stages[number - 1], i, h, u)
        motion.counts[alpha.FORCES] += 1
        if not _stage(
            model, time, q, u, motion.of_q[i], motion.of_u[i], motion.of_energy[i], motion.pairs, motion.drives, True,
            True, True,
        ):  # fmt: skip
            return False
    return True


@shared
def _part_to_event(
    model: Any, motion: ExplicitMotion, rules: ExplicitRules, h: float, part: float, end: np.ndarray, rate: np.ndarray,
    y: np.ndarray, v: np.ndarray, q: np.ndarray, u: np.ndarray,
) -> float:  # fmt: skip
    """Part of a step in minimal coordinates up to its first event, or up to the latest state that is known to be before it;
    zero if there is none. The state there is written to y, v, q and u.

    `part` is an estimate, and (end, rate) is the end of the step.
    """
    start, faster = _state(motion)
    t, before, after, at, found = motion.sizes[alpha.TIME], 0.0, 1.0, part, part
    for _ in range(_SEARCHES):
        _state_between(motion, rules, start, faster, end, rate, h, at, y, v)
        calls.from_minimal(model, y, v, q, u)
        found = calls.part_of_step(model, t + at * h, q, u, at * h)
        if found > 1.0:
            return at
        wide, following = after - before, at * found
        if found == 1.0:
            before, following = at, 0.0
        else:
            after = at
        if not after - before > _SMALLEST:
            break
        at = following if before < following < after and after - before <= 0.5 * wide else 0.5 * (before + after)
    if before > 0.0:
        _state_between(motion, rules, start, faster, end, rate, h, before, y, v)
        calls.from_minimal(model, y, v, q, u)
    return before


@shared
def _state_between(
    motion: ExplicitMotion, rules: ExplicitRules, start: np.ndarray, faster: np.ndarray, end: np.ndarray, rate: np.ndarray,
    h: float, at: float, y: np.ndarray, v: np.ndarray,
) -> None:  # fmt: skip
    """Write minimal coordinates y and rates v at a part of a step from (start, faster) to (end, rate)."""
    for k in range(y.shape[0]):
        y[k] = _interpolated(start[k], end[k], motion.of_q, k, rules.between, h, at)
    for k in range(v.shape[0]):
        v[k] = _interpolated(faster[k], rate[k], motion.of_u, k, rules.between, h, at)


@shared
def _weighed(
    model: Any, motion: ExplicitMotion, rules: ExplicitRules, y: np.ndarray, weights: np.ndarray, h: float
) -> float:
    """Sum of the squares of the errors of increments and velocities over their tolerances, at the new coordinates y."""
    speeds = motion.counts[SPEEDS] if motion.counts[SPEEDS] > 0 else motion.u.shape[0]
    of_q, of_u = _sum(np.zeros(y.shape[0]), motion.of_q, weights, h), _sum(np.zeros(speeds), motion.of_u, weights, h)
    if motion.counts[SPEEDS] > 0:
        calls.from_minimal_changes(model, y, of_q, of_u, motion.moved, motion.faster)
        of_q, of_u = motion.moved, motion.faster
    else:
        of_q = increments_of_rates(y, of_q, of_u.shape[0])
    return _sum_of_squares(of_q, of_u, motion.u, rules.tolerance, rules.velocity, rules.rtol)


@kernel
def _sum_of_squares(
    of_q: np.ndarray, of_u: np.ndarray, u: np.ndarray, tolerance: np.ndarray, velocity: np.ndarray, rtol: float
) -> float:
    total = 0.0
    for i in range(of_u.shape[0]):
        total += (of_q[i] / tolerance[i]) ** 2
        total += (of_u[i] / (rtol * (velocity[i] + abs(u[i])))) ** 2
    return total


@shared
def _error(model: Any, motion: ExplicitMotion, rules: ExplicitRules, y: np.ndarray, h: float) -> float:
    """Error of a step over the tolerance, from both estimates as in DOP853."""
    fifth = _weighed(model, motion, rules, y, rules.error_5, h)
    third = _weighed(model, motion, rules, y, rules.error_3, h)
    if not math.isfinite(fifth + third):
        return math.inf
    below = fifth + 0.01 * third
    return float(fifth / math.sqrt(below * 2.0 * max(motion.u.shape[0], 1))) if below > 0.0 else 0.0


@shared
def march_explicit(
    model: Any, motion: ExplicitMotion, rules: ExplicitRules, balance: np.ndarray, until: float, most: int,
    records: np.ndarray,
) -> int:  # fmt: skip
    """Take at most `most` steps up to `until`, with the energy balance, as `fsm.solve.stepping.march.march`."""
    sizes, last = motion.sizes, records.shape[0] - 1
    _begin(model, motion)
    for number in range(most):
        begin, record = sizes[alpha.TIME], records[min(number, last)]
        if not begin < until:
            break
        outcome = take_step(model, motion, rules, until)
        if outcome != STEPPED:
            return _end(model, motion, outcome)
        kinetic, potential, _, power, driven = calls.energies(model, sizes[alpha.TIME], motion.q, motion.u, 0.0, record)
        if end_step(balance, record, motion, begin, sizes[DONE], sizes[LOST], 0.0, kinetic, potential, power, driven):
            break
    return _end(model, motion, STEPPED)


class Through(NamedTuple):
    """Times through which a march goes, and its states there.

    Attributes
    ----------
    times : (s,) array, s
    states : (n, k) array, n <= s
        Rows of the first n times: first numbers of the record of the last step, balance, q, u, internal variables.
    passed : (1,) int array
        Number of states that are written.
    memory : table of `fsm.kernels.addresses`
        Arrays of the internal variables.
    """

    times: np.ndarray
    states: np.ndarray
    passed: np.ndarray
    memory: np.ndarray


@kernel
def _keep_state(
    motion: ExplicitMotion, balance: np.ndarray, record: np.ndarray, memory: np.ndarray, row: np.ndarray
) -> None:
    """Write a state of `Through`."""
    at = calls.DRIVES
    copy_into(record[:at], row[:at])
    for part in (balance, motion.q, motion.u):
        copy_into(part, row[at : at + part.shape[0]])
        at += part.shape[0]
    for i in range(memory.shape[0]):
        part = floats_1d(memory, i)
        copy_into(part, row[at : at + part.shape[0]])
        at += part.shape[0]


@shared
def _march_through(
    model: Any, motion: ExplicitMotion, rules: ExplicitRules, balance: np.ndarray, through: Through, most: int,
    records: np.ndarray,
) -> int:  # fmt: skip
    """Take at most `most` steps through given times, as `march_explicit`, and write the states there."""
    begun = motion.counts[alpha.STEPS]
    for number in range(through.times.shape[0]):
        t, left = through.times[number], most - (motion.counts[alpha.STEPS] - begun)
        outcome = march_explicit(model, motion, rules, balance, t, left, records)
        if outcome != STEPPED or motion.sizes[alpha.TIME] < t:
            return outcome
        if number < through.states.shape[0]:
            _keep_state(motion, balance, records[0], through.memory, through.states[number])
            through.passed[0] = number + 1
    return STEPPED


@kernel
def march_explicit_arrays(
    model: Any, motion: ExplicitMotion, rules: ExplicitRules, balance: np.ndarray, through: Through, most: int,
    records: np.ndarray,
) -> int:  # fmt: skip
    """Compiled march of an `ArrayModel` through given times."""
    return _march_through(
        borrowed(model), borrowed(motion), borrowed(rules), borrowed(balance), borrowed(through), most, borrowed(records)
    )
