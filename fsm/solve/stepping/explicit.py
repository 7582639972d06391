"""One step of an explicit Runge-Kutta method of order 8 with error control: M u' = h(t, q, u), q' = T(q) u.

For mechanisms and free bodies without stiff springs, whose motion takes long steps at a small tolerance. The method is that
of Dormand and Prince with 12 stages (Hairer, Norsett, Wanner 1993, DOP853), with errors of order 5 and 3. Quaternions are
integrated as four numbers. Accelerations with locked directions come from the equations at acceleration level
(`fsm.solve.stepping.model.consistent`). All stages and the end of each step are projected to opening rates of zero, and the
end also to openings of zero. Trees of joints have minimal coordinates instead (`fsm.solve.stepping.model.to_minimal`), and
are projected at the ends of several steps only, against round-off. Work and dissipated energy are integrated with the same
stages.

Steps end at events, for example where a stop is hit; their forces are smooth up to there
(`fsm.solve.stepping.explicit_events`).

Springs and dampers bound the step: h omega < 6 for a spring, h c/m < 6 for a damper.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.addresses import floats_1d
from fsm.kernels.jit import kernel, shared
from fsm.kernels.pointers import borrowed
from fsm.kernels.rotation import increments_of_rates
from fsm.kernels.vector import mean_ratio
from fsm.solve.stepping import generalized_alpha as alpha
from fsm.solve.stepping import model as calls
from fsm.solve.stepping.explicit_events import SMALLEST, end_at_event, energy_up_to
from fsm.solve.stepping.explicit_stages import (
    COORDINATES,
    SPEEDS,
    ExplicitMotion,
    ExplicitRules,
    accelerate,
    evaluate_stage,
    evaluate_stages,
    place_bodies,
    state_of,
    sum_rates,
)
from fsm.solve.stepping.march import end_step
from fsm.solve.stepping.outcomes import NO_SOLUTION, OBJECTED, STEP_TOO_SMALL, STEPPED, UNABLE
from fsm.solve.stepping.vectors import copy_into

DONE, LOST = 9, 10
"""Indices of `ExplicitMotion.sizes` after those of `fsm.solve.stepping.generalized_alpha`: work and dissipated energy of the
last step, J."""
_SAFETY, _SHRINK, _GROW = 0.9, 0.2, 5.0
"""Factor on a step size, and bounds of its change."""
_ORDER = 8.0
_OF_ERROR, _OF_LAST = 0.7 / _ORDER, 0.4 / _ORDER
"""Powers of the error of a step and of the last one in the size of the next step (Gustafsson 1991)."""
_WANTED = _SAFETY**_ORDER
"""Error of a step over the tolerance, which the size of the next step aims at."""
_LEAST_ERROR = 1e-4
"""Least error of the last step that counts."""
_REPEATED = 1e-8
"""Tolerance below which a step is repeated up to its event, because the order of the interpolation is lower."""


@shared
def take_step(model: Any, motion: ExplicitMotion, rules: ExplicitRules, until: float) -> int:
    """Take one step that ends at `until` or before, and return the outcome."""
    sizes, counts = motion.sizes, motion.counts
    t, target = sizes[alpha.TIME], until
    for b in rules.breaks:
        if b > t:
            target = min(target, b)
    y, v = state_of(motion)
    first, second = motion.at_q[: y.shape[0]], motion.at_u[: v.shape[0]]
    copy_into(y, first)
    copy_into(v, second)
    counts[alpha.FORCES] += 1
    if not evaluate_stage(
        model, np.nextafter(t, math.inf), first, second, motion.of_q[0], motion.of_u[0], motion.of_energy[0],
        motion.all_pairs, motion.drives, counts[SPEEDS] > 0, rules.weights[0] != 0.0, False,
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
    q, u = motion.q.copy(), motion.u.copy()
    while True:
        h, end = _next_size(motion, target, most)
        if not end > t:
            return STEP_TOO_SMALL
        if not evaluate_stages(model, motion, rules, t, end, h):
            return UNABLE if calls.unable(model) else NO_SOLUTION
        y, v = state_of(motion)
        y, v = sum_rates(y, motion.of_q, rules.weights, h), sum_rates(v, motion.of_u, rules.weights, h)
        error, part, at = _error(model, motion, rules, y, h), 1.0, 1.0
        if error <= 1.0:
            good, turns = place_bodies(model, motion, end, y, v, q, u)
            part = calls.part_of_step(model, end, q, u, h) if good else 1.0
            if part < 1.0:
                at, turns = end_at_event(model, motion, rules, end, h, part, y, v, q, u)
                good = at >= 0.0
                if at > 0.0 and rules.rtol < _REPEATED and most == math.inf:
                    part, at = at, 1.0
                elif at > 0.0:
                    part, end = 1.0, t + at * h
            if not good:
                return UNABLE if calls.unable(model) else NO_SOLUTION
            if part >= 1.0:
                break
        counts[alpha.REJECTED] += 1
        grow, most = False, h * part if part < 1.0 else math.inf
        if error > 1.0:
            sizes[alpha.STEP_SIZE] = h * (max(_SHRINK, _SAFETY * error ** (-1.0 / _ORDER)) if error < math.inf else _SHRINK)
        if min(most, sizes[alpha.STEP_SIZE]) < SMALLEST * max(abs(t), until - t):
            return OBJECTED if part < 1.0 else STEP_TOO_SMALL
    sizes[DONE], sizes[LOST] = energy_up_to(motion, rules, h, at, 0), energy_up_to(motion, rules, h, at, 1)
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
        accelerate(model, before, motion.q, motion.u, motion.rate, False)
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
def _weighed(
    model: Any, motion: ExplicitMotion, rules: ExplicitRules, y: np.ndarray, weights: np.ndarray, h: float
) -> float:
    """Sum of the squares of the errors of increments and velocities over their tolerances, at the new coordinates y."""
    speeds = motion.counts[SPEEDS] if motion.counts[SPEEDS] > 0 else motion.u.shape[0]
    of_q = sum_rates(np.zeros(y.shape[0]), motion.of_q, weights, h)
    of_u = sum_rates(np.zeros(speeds), motion.of_u, weights, h)
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
