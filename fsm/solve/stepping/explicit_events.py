"""Events in a step of the explicit Runge-Kutta method: their time and the state there by interpolation.

The forces of a step are smooth up to its first event (`fsm.solve.interface.system.System.hold`), whose time comes from the
interpolation of order 7 between both ends of the step (Hairer, Norsett, Wanner 1993, II.6). Its three further stages and the
rate at the end are computed in steps with an event only. States between the ends are projected as the end is; see
`fsm.solve.stepping.explicit`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fsm.kernels.jit import kernel, shared
from fsm.solve.stepping import generalized_alpha as alpha
from fsm.solve.stepping import model as calls
from fsm.solve.stepping.explicit_stages import (
    SPEEDS,
    STAGES,
    ExplicitMotion,
    ExplicitRules,
    add_rates,
    evaluate_stage,
    place_bodies,
    state_of,
)
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
