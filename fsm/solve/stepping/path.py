"""Steps of a quasi-static path: prediction, correction, and the conditions for acceptance.

As for time steps, Python runs `follow` for any system, and a kernel compiles it for compiled models
(`fsm.solve.stepping.quasi_static.StaticModel`). A `Path` holds the state; its arrays are changed in place.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fsm.kernels.jit import kernel, shared
from fsm.kernels.vector import largest_ratio
from fsm.solve.stepping import march
from fsm.solve.stepping import path_state as index
from fsm.solve.stepping.path_state import Path, PathRules
from fsm.solve.stepping.vectors import copy_into, inner, subtracted

_DEEP = 1e4
"""Contact forces of a prediction relative to reactions and previous contact forces, above which the prediction
penetrates too far."""
_GROWTH, _SHRINK, CUT = 2.0, 0.4, 0.35
"""Factors on the step: largest and smallest after an accepted step, and after a rejected one."""
_ITERATIONS = 6
"""Newton iterations above which steps do not grow."""
MOVING = 1e-3
"""Kinetic energy relative to the reference energy, above which inertia is not negligible."""
_COARSE = 3.0
"""Energy error of one step, relative to the reference energy and rtol, above which the step has missed a kink of the
force."""
_KINK = 1e-2
"""Smallest step relative to the first step, for cuts because of the energy balance or a contact that closes."""
EXACT = 1e-3
"""Relative error of the force at which the path ends because of `force_limit`."""
AT_FIRST = 5e-3
"""Displacement relative to the extent of the structure; the largest reaction times this displacement is the first scale
of energy."""
_SMALL_LOSS = 1e-6
"""Dissipation relative to the reference energy, below which the forces at the end of a step are accurate enough."""
RESTS = 1e-3
"""Residual without damper forces, relative to the largest reaction, below which a state is an equilibrium."""
SAME = 1e-12
"""Times whose relative difference is below this are equal."""


# functions of a model ---------------------------------------------------------------------------------------------------


def progress_at(model: Any, t: float) -> float:
    """Path parameter, see `System.progress`."""
    return float(model.progress(t))


def difference(model: Any, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Increment (nu,) between two configurations."""
    return np.asarray(model.difference(start, end))


def retracted(model: Any, q: np.ndarray, dx: np.ndarray) -> np.ndarray:
    """Configuration (nq,) after an increment."""
    return np.asarray(model.retract(q, dx))


def contact_force(model: Any, t: float, q: np.ndarray) -> float:
    """Largest component of the forces of contacts at rest, N."""
    return float(model.contact_force(t, q))


def balance_at_rest(model: Any, t: float, q: np.ndarray, force: np.ndarray, drives: np.ndarray) -> None:
    """Write the force (nu,) and the forces of all drives (n_drives,) at rest."""
    model.balance_at_rest(t, q, force, drives)


def power_before(model: Any, t: float, q: np.ndarray, end: float, found: np.ndarray) -> float:
    """Power of loads (W) in the state before a step, with the mean velocities of the step to the state `found` at `end`."""
    return float(model.power_before(t, q, end, found))


def tangent_guess(model: Any, path: Path, t: float) -> int:
    """Write the increment and the efforts at t from the tangent; the outcome is ACCEPTED, SINGULAR or UNABLE."""
    return int(model.tangent_guess(path, t))


def equilibrium(model: Any, path: Path, rules: PathRules, t: float, guess: np.ndarray) -> int:
    """Find the equilibrium at t, and write it to `path.found` and `path.found_efforts`."""
    return int(model.equilibrium(path, rules, t, guess))


def look(model: Any, path: Path, rules: PathRules, t: float, record: np.ndarray) -> int:
    """Write the record of the state that was found; the outcome is ACCEPTED, CROSSED, UNSTABLE or DOUBTFUL."""
    return int(model.look(path, rules, t, record))


def stability(model: Any, path: Path, rules: PathRules, t: float) -> int:
    """Whether an equilibrium with dampers is stable at rest: ACCEPTED, SLOWED, UNSTABLE, DOUBTFUL or UNABLE."""
    return int(model.stability(path, rules, t))


def accept(model: Any, path: Path, t: float) -> None:
    """Accept the state that was found: update internal variables."""
    model.accept(path, t)


# one step ---------------------------------------------------------------------------------------------------------------


@kernel
def _add(factor: float, vector: np.ndarray, out: np.ndarray) -> None:
    """Add a multiple of a vector."""
    for i in range(out.shape[0]):
        out[i] += factor * vector[i]


@shared
def extrapolate(model: Any, path: Path, aim: float) -> None:
    """Write increment and efforts at a path parameter, by the polynomial through the last states (two or three)."""
    last = path.counts[index.KNOWN] - 1
    path.increment[:] = 0.0
    copy_into(path.efforts[last], path.next_efforts)
    for k in range(last):
        weight = 1.0
        for other in range(last + 1):
            if other != k:
                weight *= (aim - path.progress[other]) / (path.progress[k] - path.progress[other])
        _add(weight, difference(model, path.states[last], path.states[k]), path.increment)
        _add(weight, subtracted(path.efforts[k], path.efforts[last]), path.next_efforts)


@shared
def remember(path: Path, progress: float, q: np.ndarray, efforts: np.ndarray) -> None:
    """Add a state to the states of the extrapolation."""
    known = path.counts[index.KNOWN]
    if known == index.KEPT:
        for k in range(index.KEPT - 1):
            path.progress[k] = path.progress[k + 1]
            copy_into(path.states[k + 1], path.states[k])
            copy_into(path.efforts[k + 1], path.efforts[k])
        known -= 1
    path.progress[known] = progress
    copy_into(q, path.states[known])
    copy_into(efforts, path.efforts[known])
    path.counts[index.KNOWN] = known + 1


@shared
def _head_on(model: Any, path: Path, rules: PathRules, t: float, guess: np.ndarray) -> bool:
    """Whether a prediction penetrates a closing contact too far for Newton's method."""
    begin = path.numbers[index.TIME]
    if rules.fixed_pattern or t - begin < _KINK * rules.first_step:
        return False
    force = contact_force(model, t, guess) / _DEEP
    return bool(force > path.numbers[index.REACTION]) and force > contact_force(model, begin, path.q)


@shared
def _bow(path: Path, k: int, record: np.ndarray) -> float:
    """Mean force of drive k at both ends minus its mean over the step, from the curvature of the force curve, N."""
    if path.counts[index.EARLIER] == 0:
        return 0.0
    force = index.DRIVES + path.resting_drives.shape[0] + k
    first = path.record[index.DRIVES + k] - path.earlier[index.DRIVES + k]
    second = record[index.DRIVES + k] - path.record[index.DRIVES + k]
    if first * second <= 0.0:  # the drive has stopped or reversed
        return 0.0
    bend = (record[force] - path.record[force]) / second - (path.record[force] - path.earlier[force]) / first
    bow: float = second**2 / (6.0 * (first + second)) * bend
    return bow


@shared
def _work(model: Any, path: Path, t: float, record: np.ndarray) -> float:
    """Work of drives and loads in a step, J: the integral of the parabola through the forces of the last three states."""
    begin, count = path.numbers[index.TIME], path.resting_drives.shape[0]
    work = 0.0
    for k in range(count):
        force = index.DRIVES + count + k
        travel = record[index.DRIVES + k] - path.record[index.DRIVES + k]
        work += (0.5 * (path.record[force] + record[force]) - _bow(path, k, record)) * travel
    loads = record[index.LOADS] * (t - begin)
    if loads != 0.0 or path.record[index.LOADS] != 0.0:  # mean of the loads at both ends of the step, along the same motion
        loads = 0.5 * (loads + power_before(model, begin, path.q, t, path.found) * (t - begin))
    return float(work + loads)


@shared
def _dissipated(model: Any, path: Path, t: float, record: np.ndarray) -> float:
    """Energy that dampers and friction dissipate in a step, J: mean force at both ends times the motion.

    At an equilibrium these forces are the residual without them. Small losses, and the first step, use the forces at the
    end only. The loss of rate-independent sliding is computed exactly.
    """
    counts, begin, count = path.counts, path.numbers[index.TIME], path.resting_drives.shape[0]
    alone = record[index.LOST] * (t - begin)
    if counts[index.EARLIER] == 0 or alone < _SMALL_LOSS * path.balance[march.TURNOVER]:
        counts[index.RESTING] = 0
        return float(alone)
    if counts[index.RESTING] == 0:
        balance_at_rest(model, begin, path.q, path.resting, path.resting_drives)
    balance_at_rest(model, t, path.found, path.next_resting, path.next_resting_drives)
    counts[index.RESTING] = 1
    moved = difference(model, path.q, path.found)
    taken = inner(path.resting, moved) + inner(path.next_resting, moved)
    for k in range(count):
        force = index.DRIVES + count + k
        driven = path.record[force] - path.resting_drives[k] + record[force] - path.next_resting_drives[k]
        taken += driven * (record[index.DRIVES + k] - path.record[index.DRIVES + k])
    return float(max(0.0, 0.5 * taken) + record[index.KEPT_LOSS] * (t - begin))


@shared
def little_work(reaction: float, extent: float) -> float:
    """Work of a force along a small part of the extent of the structure, J."""
    return AT_FIRST * reaction * extent


@shared
def _imbalance(path: Path, rules: PathRules, record: np.ndarray, work: float, dissipated: float) -> float:
    """Energy balance residual of a step relative to the reference energy so far; 0 below round-off.

    At the start the residual is relative to the work of the largest reaction along a small part of the span.
    """
    balance, stored = path.balance, record[index.STORED] - path.record[index.STORED]
    turnover = max(balance[march.TURNOVER], abs(record[index.STORED] - balance[march.START]), abs(work))
    turnover = max(turnover, little_work(max(path.numbers[index.REACTION], record[index.LARGEST]), rules.extent))
    return float(abs(stored + dissipated - work) / turnover) if turnover > balance[march.ROUND_OFF] else 0.0


@shared
def _is_coarse(path: Path, rules: PathRules, duration: float, error: float) -> bool:
    """Whether the energy balance of a step requires a shorter step.

    If the residual does not decrease with the step size, the initial state was not an equilibrium, and the step is
    accepted. A step with many iterations is not accepted, since it may have reached another branch. Contacts cause
    kinks that a step may miss. Without contacts and dampers, the bound is the round-off of the forces if this is
    larger than rtol.
    """
    numbers = path.numbers
    longer, worse, jump = numbers[index.COARSE_STEP], numbers[index.COARSE_ERROR], False
    if numbers[index.COARSE_AT] == numbers[index.TIME] and duration < longer:
        jump = error > math.sqrt(duration / longer) * worse
    numbers[index.COARSE_AT], numbers[index.COARSE_STEP], numbers[index.COARSE_ERROR] = numbers[index.TIME], duration, error
    resolved = rules.rtol
    if rules.fixed_pattern and not rules.rate_dependent:
        resolved = max(resolved, numbers[index.FORCE_ROUND_OFF] / max(numbers[index.REACTION], 1e-300))
    return bool(error > _COARSE * resolved and not (jump and path.counts[index.LAST_ITERATIONS] <= _ITERATIONS))


@shared
def _adapt(path: Path, rules: PathRules, duration: float, correction: float) -> None:
    """Set the size of the next step from the error of the prediction, which is proportional to the cube of the step.

    The step does not grow after many Newton iterations.
    """
    factor = 0.9 * (rules.aim / max(correction, 1e-12)) ** (1.0 / 3.0)
    factor = min(factor, _GROWTH, _ITERATIONS / max(path.counts[index.LAST_ITERATIONS], 1))
    wanted = duration * max(_SHRINK, factor)
    # a step that is shortened to end at a given time gives no estimate for longer steps
    size = path.numbers[index.SIZE]
    path.numbers[index.SIZE] = wanted if duration >= 0.5 * size else max(wanted, size)


@shared
def _advance(model: Any, path: Path, t: float, record: np.ndarray, work: float, dissipated: float) -> None:
    """Make the state that was found the present state."""
    numbers, counts, balance = path.numbers, path.counts, path.balance
    drives, duration = path.resting_drives.shape[0], t - numbers[index.TIME]
    sums = record[index.DRIVES + 2 * drives :].reshape(7, path.pair_energy.shape[1])
    for p in range(path.pair_energy.shape[1]):
        path.pair_energy[0, p] += sums[index.PAIR_SLIDING, p] * duration
        path.pair_energy[1, p] += sums[index.PAIR_DAMPING, p] * duration
    accept(model, path, t)
    balance[march.WORK] += work
    balance[march.DISSIPATED] += dissipated
    march.add_up(balance, record[index.STORED], 0.0)
    numbers[index.REACTION] = max(numbers[index.REACTION], record[index.LARGEST])
    copy_into(path.record, path.earlier)
    copy_into(record, path.record)
    copy_into(path.next_resting, path.resting)
    copy_into(path.next_resting_drives, path.resting_drives)
    copy_into(path.q, path.q_before)
    copy_into(path.found, path.q)
    numbers[index.BEFORE], numbers[index.TIME] = numbers[index.TIME], t
    counts[index.EARLIER] = 1
    counts[index.STEPS] += 1
    remember(path, progress_at(model, t), path.q, path.found_efforts)


@shared
def _note(path: Path, held: int, row: np.ndarray) -> None:
    """Write the row of the present state."""
    row[index.AT], row[index.MOVING_ON] = path.numbers[index.TIME], 1.0 if held == index.SLOWED else 0.0
    first = index.BALANCE
    for part in (path.balance, path.record, path.pair_energy.reshape(-1), path.q):
        last = first + part.shape[0]
        copy_into(part, row[first:last])
        first = last


@shared
def attempt(model: Any, path: Path, rules: PathRules, t: float, row: np.ndarray) -> int:
    """Try a step to time t, and return its outcome; an accepted step writes the row of its state."""
    numbers, balance, record = path.numbers, path.balance, path.next_record
    duration, extrapolated = t - numbers[index.TIME], path.counts[index.KNOWN] > 1
    if extrapolated:
        extrapolate(model, path, progress_at(model, t))
    else:
        outcome = tangent_guess(model, path, t)
        if outcome != index.ACCEPTED:
            return outcome
    guess = retracted(model, path.q, path.increment)
    if extrapolated and _head_on(model, path, rules, t, guess):
        return index.HEAD_ON
    outcome = equilibrium(model, path, rules, t, guess)
    if outcome != index.ACCEPTED:
        return outcome
    correction = largest_ratio(difference(model, guess, path.found), rules.span)
    if extrapolated and correction > rules.far:
        return index.FAR
    outcome = look(model, path, rules, t, record)
    if outcome != index.ACCEPTED:
        return outcome
    if 0.0 < record[index.PART] < 1.0 and duration > rules.smallest:
        numbers[index.SIZE] = max(record[index.PART] * duration, rules.smallest)
        return index.EVENT
    balance[march.ROUND_OFF] = max(balance[march.ROUND_OFF], numbers[index.FORCE_ROUND_OFF] * rules.length)
    # false without damping, since a motion would then not decay
    turnover = max(balance[march.TURNOVER], abs(record[index.STORED] - balance[march.START]))
    if rules.rate_dependent and record[index.KINETIC] > max(MOVING * turnover, rules.slow):
        return index.INERTIA
    drives = path.resting_drives.shape[0]
    longer = drives > 0 and duration > 10.0 * rules.smallest
    if longer and abs(record[index.DRIVES + drives]) / rules.force_limit > 1.0 + EXACT:
        return index.LIMIT
    work, dissipated = _work(model, path, t, record), _dissipated(model, path, t, record)
    error = _imbalance(path, rules, record, work, dissipated)
    if duration > _KINK * rules.first_step and _is_coarse(path, rules, duration, error):
        return index.COARSE
    held = stability(model, path, rules, t)
    if held not in (index.ACCEPTED, index.SLOWED):
        return held
    if record[index.OPENING] > rules.widest:
        return index.APART
    if extrapolated:
        _adapt(path, rules, duration, correction)
    _advance(model, path, t, record, work, dissipated)
    _note(path, held, row)
    return index.ACCEPTED


@shared
def is_off(balance: np.ndarray, reaction: float, extent: float, bound: float) -> bool:
    """Whether the energy error exceeds a bound relative to the reference energy, or relative to a small work if that is
    larger.

    The small work is needed where a body moves freely to its first contact, because the reference energy is then almost
    zero.
    """
    turnover = max(balance[march.TURNOVER], little_work(reaction, extent))
    error = balance[march.WORST] / balance[march.TURNOVER] if balance[march.TURNOVER] > balance[march.ROUND_OFF] else 0.0
    return bool(error > bound and balance[march.WORST] > bound * turnover)


@shared
def next_time(until: float, now: float, size: float, longest: float) -> tuple[float, float]:
    """Time at the end of the next step, at most `until`, and its duration, s."""
    left = until - now
    size = min(size, longest)
    if size >= 0.999 * left:
        return until, left
    duration = min(size, 0.5 * left)
    return now + duration, duration


@shared
def follow(model: Any, path: Path, rules: PathRules, stops: np.ndarray, rows: np.ndarray) -> int:
    """Take steps that end at each of the increasing times `stops` (s), up to the last one, at most one for each row.

    A rejected step is repeated with a shorter one. The result is ACCEPTED, or the reason of a rejection that a shorter step
    does not help. The function returns early if the energy error is too large or the drive reaches its limit.
    """
    numbers, counts, taken, stop = path.numbers, path.counts, 0, 0
    drives = path.resting_drives.shape[0]
    while taken < rows.shape[0]:
        while stop < stops.shape[0] and stops[stop] <= numbers[index.TIME] * (1.0 + SAME):
            stop += 1
        if stop == stops.shape[0]:
            break
        t, duration = next_time(stops[stop], numbers[index.TIME], numbers[index.SIZE], rules.max_step)
        outcome = attempt(model, path, rules, t, rows[taken])
        if outcome in (index.LACKS, index.DOUBTFUL, index.UNABLE):
            return outcome
        counts[index.JUDGED] = 0
        if outcome == index.ACCEPTED:
            taken += 1
            limit = drives > 0 and abs(path.record[index.DRIVES + drives]) / rules.force_limit >= 1.0 - EXACT
            late = numbers[index.TIME] >= rules.judged_from
            if path.record[index.PART] > 0.0:
                counts[index.AT_EVENT] = 1
                break
            if limit or (late and is_off(path.balance, numbers[index.REACTION], rules.extent, rules.abort)):
                break
            continue
        counts[index.REJECTED] += 1
        if outcome == index.EVENT:
            continue
        numbers[index.SIZE] = CUT * duration
        if outcome in (index.INERTIA, index.APART) or numbers[index.SIZE] < rules.smallest:
            return outcome
    return index.ACCEPTED
