"""States inside a step of the explicit Runge-Kutta method by interpolation: at events, whose time is found, and at given
times.

The forces of a step are smooth up to its first event (`fsm.solve.interface.system.System.hold`), whose time comes from the
interpolation of order 7 between both ends of the step (Hairer, Norsett, Wanner 1993, II.6). Its three further stages and the
rate at the end are computed only in steps that need it. States between the ends are projected as the end is; see
`fsm.solve.stepping.explicit`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.addresses import ROW, floats_1d
from fsm.kernels.jit import kernel, shared
from fsm.solve.stepping import generalized_alpha as alpha
from fsm.solve.stepping import model as calls
from fsm.solve.stepping.explicit_stages import (
    SPEEDS,
    STAGES,
    ExplicitMotion,
    ExplicitRules,
    accelerate,
    add_rates,
    evaluate_stage,
    place_bodies,
    state_of,
    sum_rates,
)
from fsm.solve.stepping.march import BALANCE, DISSIPATED, DRIVEN, WORK, add_up
from fsm.solve.stepping.vectors import copy_into

SMALLEST = 16.0 * float(np.finfo(float).eps)
"""Smallest step relative to the present time, and smallest part of a step that is searched for an event."""
_SEARCHES = 60
"""Largest number of interpolated states in the search of an event."""


@shared
def energy_up_to(motion: ExplicitMotion, rules: ExplicitRules, h: float, at: float, column: int) -> float:
    """Work or dissipated energy up to a part of the step, J."""
    total = 0.0
    for i in range(STAGES):
        total += h * rules.weights[i] * motion.of_energy[i, column]
    if at < 1.0:
        return _interpolated(0.0, total, motion.of_energy, column, rules.between, h, at)
    return total


@kernel
def _interpolated(
    start: float, end: float, rates: np.ndarray, column: int, between: np.ndarray, h: float, at: float
) -> float:
    """Value at a part of a step, from the rates (16, n) of its stages."""
    first, change = h * rates[0, column], end - start
    total, factor, left = 0.0, at, 1.0 - at
    for m in range(3, -1, -1):
        row = 0.0
        for i in range(between.shape[1]):
            row += between[m, i] * rates[i, column]
        total = (total + h * row) * (factor if m % 2 == 1 else left)
    total = (total + 2.0 * change - first - h * rates[STAGES, column]) * factor
    total = (total + first - change) * left
    return start + (total + change) * factor


@shared
def _evaluate_interpolation(
    model: Any, motion: ExplicitMotion, rules: ExplicitRules, t: float, end: float, h: float, y: np.ndarray, v: np.ndarray
) -> bool:  # fmt: skip
    """Write the rates at the end (y, v) of a step, and those of the interpolation."""
    start, faster = state_of(motion)
    q, u = motion.at_q[: y.shape[0]], motion.at_u[: v.shape[0]]
    first, last = np.nextafter(t, math.inf), np.nextafter(end, -math.inf)
    for number in range(1 + rules.more_nodes.shape[0]):
        i, time = STAGES + number, last
        if number == 0:
            copy_into(y, q)
            copy_into(v, u)
        else:
            time = min(max(t + rules.more_nodes[number - 1] * h, first), last)
            add_rates(start, motion.of_q, rules.more_stages[number - 1], i, h, q)
            add_rates(faster, motion.of_u, rules.more_stages[number - 1], i, h, u)
        motion.counts[alpha.FORCES] += 1
        if not evaluate_stage(
            model, time, q, u, motion.of_q[i], motion.of_u[i], motion.of_energy[i], motion.all_pairs, motion.drives,
            motion.counts[SPEEDS] > 0, True, True,
        ):  # fmt: skip
            return False
    return True


@shared
def end_at_event(
    model: Any, motion: ExplicitMotion, rules: ExplicitRules, end: float, h: float, part: float, y: np.ndarray,
    v: np.ndarray, q: np.ndarray, u: np.ndarray,
) -> tuple[float, float]:  # fmt: skip
    """Part of a step of size h up to its first event, or up to the latest state that is known to be before it; zero if there
    is none, and negative if the mass is singular. Then the longest step from there that resolves the turns, s.

    Parameters
    ----------
    end : time at the end of the step, s
    part : estimate
    y, v, q, u : end of the step, with its bodies and their velocities; replaced by the state at the event
    """
    t, before, after, at, found, turns = motion.sizes[alpha.TIME], 0.0, 1.0, part, part, math.inf
    if not _evaluate_interpolation(model, motion, rules, t, end, h, y, v):
        return -1.0, turns
    last, faster = y.copy(), v.copy()
    for _ in range(_SEARCHES):
        turns = _place_between(model, motion, rules, h, at, last, faster, y, v, q, u)
        found = calls.part_of_step(model, t + at * h, q, u, at * h)
        if found > 1.0:
            return at, turns
        wide, following = after - before, at * found
        if found == 1.0:
            before, following = at, 0.0
        else:
            after = at
        if not after - before > SMALLEST:
            break
        at = following if before < following < after and after - before <= 0.5 * wide else 0.5 * (before + after)
    if before > 0.0:
        turns = _place_between(model, motion, rules, h, before, last, faster, y, v, q, u)
    return before, turns


@shared
def _place_between(
    model: Any, motion: ExplicitMotion, rules: ExplicitRules, h: float, at: float, last: np.ndarray, faster: np.ndarray,
    y: np.ndarray, v: np.ndarray, q: np.ndarray, u: np.ndarray,
) -> float:  # fmt: skip
    """Write the state at a part of a step that ends at (last, faster); returns the longest step that resolves turns, s."""
    start, slower = state_of(motion)
    for k in range(y.shape[0]):
        y[k] = _interpolated(start[k], last[k], motion.of_q, k, rules.between, h, at)
    for k in range(v.shape[0]):
        v[k] = _interpolated(slower[k], faster[k], motion.of_u, k, rules.between, h, at)
    _, turns = place_bodies(model, motion, motion.sizes[alpha.TIME] + at * h, y, v, q, u)
    return turns


class Through(NamedTuple):
    """Times through which a march goes, and its states there.

    Attributes
    ----------
    times : (s,) array, s
    states : (n, k) array, n <= s
        Rows of the first n times: first numbers of the record of the state, balance, q, u, internal variables.
    passed : (1,) int array
        Number of states that are written.
    memory : table of `fsm.kernels.addresses`
        Arrays of the internal variables.
    """

    times: np.ndarray
    states: np.ndarray
    passed: np.ndarray
    memory: np.ndarray


NOTHING = Through(np.zeros(0), np.zeros((0, 0)), np.zeros(1, dtype=np.int64), np.zeros((0, ROW), dtype=np.int64))
"""No times."""


@kernel
def keep_state(balance: np.ndarray, q: np.ndarray, u: np.ndarray, record: np.ndarray, through: Through) -> np.ndarray:
    """Write the next state of `Through`; returns its row."""
    row, at = through.states[through.passed[0]], calls.DRIVES
    copy_into(record[:at], row[:at])
    for part in (balance, q, u):
        copy_into(part, row[at : at + part.shape[0]])
        at += part.shape[0]
    _keep_memory(through.memory, row[at:])
    through.passed[0] += 1
    return row


@kernel
def _keep_memory(memory: np.ndarray, row: np.ndarray) -> None:
    at = 0
    for i in range(memory.shape[0]):
        part = floats_1d(memory, i)
        copy_into(part, row[at : at + part.shape[0]])
        at += part.shape[0]


@kernel
def _restore_memory(memory: np.ndarray, row: np.ndarray) -> None:
    at = 0
    for i in range(memory.shape[0]):
        part = floats_1d(memory, i)
        copy_into(row[at : at + part.shape[0]], part)
        at += part.shape[0]


@shared
def keep_between(
    model: Any, motion: ExplicitMotion, rules: ExplicitRules, balance: np.ndarray, through: Through, h: float, part: float,
    end: float,
) -> int:  # fmt: skip
    """Keep the states at the given times before the `end` of an accepted step, which is this part of a step of size h.
    Returns their number, or -1 if the mass is singular. The model keeps the multipliers of the last one.
    """
    first, most = through.passed[0], through.states.shape[0]
    if first >= most or not through.times[first] < end:
        return 0
    t, (start, slower) = motion.sizes[alpha.TIME], state_of(motion)
    y, v = sum_rates(start, motion.of_q, rules.weights, h), sum_rates(slower, motion.of_u, rules.weights, h)
    if part == 1.0 and not _evaluate_interpolation(model, motion, rules, t, end, h, y, v):
        return -1
    last, faster, q, u = y.copy(), v.copy(), motion.q.copy(), motion.u.copy()
    memory = np.empty(through.states.shape[1])
    _keep_memory(through.memory, memory)
    while through.passed[0] < most and through.times[through.passed[0]] < end:
        time = through.times[through.passed[0]]
        at = (time - t) / h
        _place_between(model, motion, rules, h, at, last, faster, y, v, q, u)
        if motion.counts[SPEEDS] > 0:
            accelerate(model, time, q, u, motion.rate, False)
        kinetic, potential, _, _, driven = calls.energies(model, time, q, u, 0.0, motion.record)
        calls.accept(model, time, q, u)  # angles with their turns
        own = keep_state(balance, q, u, motion.record, through)[calls.DRIVES : calls.DRIVES + BALANCE]
        own[WORK] += energy_up_to(motion, rules, h, at, 0) + driven - own[DRIVEN]
        own[DISSIPATED] += energy_up_to(motion, rules, h, at, 1)
        own[DRIVEN] = driven
        add_up(own, kinetic + potential, kinetic)
        _restore_memory(through.memory, memory)
    return int(through.passed[0] - first)
