"""One step of the energy-conserving mean-force method: the force of a step is its mean along the step.

With x the increment of the configuration from t_n to t_{n+1} = t_n + h [1, 2]:

    M (u_{n+1} - u_n)/h = int_0^1 f(t_n + s h, retract(q_n, s x), x/h) ds,    x/h = (u_n + u_{n+1})/2

f.x is then the difference of the potential. Therefore kinetic + potential + dissipated energy - work is constant,
except for the error of the quadrature. Two Gauss points are exact for potentials up to the fourth degree, for example
the potential of a stretched film. Rigid bodies rotate about their mean angular velocity, so gyroscopic moments do no
work. The method is of second order, has no numerical damping, and cannot gain energy. Newmark's method, and
generalized-alpha with little damping, can gain energy where a film stretches. Dampers dissipate energy at the mean
rates.

Newton's method solves for x with the matrix 2/h^2 M + D/h + int s K(q_n + s x) ds, by the same quadrature. Where films
become slack or taut, K differs between the two points by orders of magnitude; Newton's method with K at one point does
not converge there. Corrections that overshoot are cut where the work of the residual along them vanishes. The cut is
limited, because otherwise one region that becomes taut would stop the motion of all others. Broyden's good update [3]
corrects a reused tangent. Fixed steps with many iterations are halved, because both halves together may need fewer
iterations. Fixed steps are also halved where the quadrature does not conserve the energy.

The mean rates of undamped modes that are too fast for a fixed step change their sign in every step. The mean rate of
the step before the last one therefore predicts these modes; it also predicts slow modes. Linear extrapolation would
give these rates three times the size and the wrong sign, and would make taut films slack. With error control these
modes are damped, and the prediction is linear. It is the last mean rate where this was the better prediction in the last
step, as in steps that are long against the vibrations of a film.

Without a fixed step the error is controlled. The local error of x is h^3/12 times the derivative of u', from differences of
the mean rates. The filter 2/h^2 S^-1 M, with the matrix S of Newton's method, removes modes that are too fast for the step.
A step is also repeated if the quadrature loses too much energy, for example where a contact closes.

Locked directions (`fsm.solve.stepping.model.lock`) are closed at the end of each step, and their efforts act along a mean
gradient that does no work in a closed step: the discrete gradient of [4]. The velocity u_{n+1} then has a part of order h^2
across the joints, which alternates from step to step; records have the nearest consistent velocity, and its multipliers.

References
----------
[1] Simo, Tarnow, Z. angew. Math. Phys. 43 (1992) 757-792. [2] Quispel, McLaren, J. Phys. A 41 (2008) 045206.
[3] Kelley, Iterative Methods for Linear and Nonlinear Equations, SIAM 1995, chapter 7. [4] Gonzalez, Comput. Methods Appl.
Mech. Engrg. 174 (1999) 1-13.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fsm.kernels.jit import kernel, shared
from fsm.kernels.pointers import borrowed
from fsm.kernels.vector import mean_ratio
from fsm.solve.stepping import mean_newton as newton
from fsm.solve.stepping import model as calls
from fsm.solve.stepping.march import add_pairs, end_step
from fsm.solve.stepping.mean_newton import MeanMotion, MeanRules, StepEnergies
from fsm.solve.stepping.outcomes import NO_SOLUTION, OBJECTED, STEP_TOO_SMALL, STEPPED, UNABLE
from fsm.solve.stepping.vectors import end_velocity, scaled, subtracted

_FINEST = 64
"""Largest number of parts of a step for which Newton's method did not converge."""
_FACTORS = 5.0
"""Cost of a tangent and its factorisation, in iterations."""
_DEAR, _CHEAP, BETWEEN = 25.0, 9.0, 15.0
"""Mean cost of a fixed step, in iterations: bound for halving, bound for doubling, and initial value after a change.

Example, film with slack regions that become taut: 40 iterations for a step, 10 for each half, 6 for each quarter
(2026-11-23).
"""
_HALVES = 4
"""Largest number of parts into which an expensive step is divided."""
_MEMORY = 0.7
"""Weight of the previous mean in the running mean of the cost."""
_FIRST = 1e-4
"""Largest first step relative to the remaining time."""
_SAFETY, _GROWTH, _SHRINK, _STEADY = 0.9, 2.0, 0.2, 1.2
"""Constants of error control; the last constant is the growth below which step size and factorisation are reused."""
_CUT = 0.25
"""Factor on a step size for which Newton's method did not converge."""
_LOST, _AT_ONCE, _LEAST = 3e-6, 0.01, 1e-9
"""Bounds of the quadrature error of the energy, relative to the reference energy. First: bound for the sum of all
steps. Second: part of the remaining error that one step may use. Third: smallest bound for a step."""
_LOST_AT_ONCE = 1e-4
"""Bound of the quadrature error of the energy in a fixed step, relative to the reference energy. A step with a larger
error is divided into at most 16 parts, because regions of a film that become slack cause kinks of the force
(2026-11-23)."""
_SMALLEST = 16.0 * float(np.finfo(float).eps)
"""Smallest step relative to the present time."""


@shared
def take_step(model: Any, motion: MeanMotion, rules: MeanRules, until: float) -> int:
    """Take one step that ends at `until` or before, and return the outcome (see `fsm.solve.stepping.outcomes`)."""
    target = until
    for b in rules.breaks:
        if b > motion.sizes[newton.TIME]:
            target = min(target, b)
    if rules.fixed_step > 0.0:
        return _fixed_step(model, motion, rules, target)
    return _controlled_step(model, motion, rules, target, until)


# fixed steps ------------------------------------------------------------------------------------------------------------


@shared
def _fixed_step(model: Any, motion: MeanMotion, rules: MeanRules, target: float) -> int:
    sizes, counts = motion.sizes, motion.counts
    t, spent = sizes[newton.TIME], _spent(motion)
    while True:
        left = target - t
        count = math.ceil(left * counts[newton.DIVISION] / rules.fixed_step * (1.0 - 1e-9))
        h = newton.same_size(motion, left / max(count, 1))
        end = target if count <= 1 else t + h
        done, x = newton.solved(model, motion, rules, h)
        if calls.unable(model):
            return UNABLE
        if done:
            found = newton.step_energies(model, motion, h, x, end)
            done = math.isfinite(found.stored)
            if done and (counts[newton.DIVISION] >= _FINEST // 4 or _conserved(motion, found)):
                break
        counts[newton.FAILED] += 1
        sizes[newton.FACTORED] = 0.0
        counts[newton.DIVISION], sizes[newton.COST] = 2 * counts[newton.DIVISION], BETWEEN
        if counts[newton.DIVISION] > _FINEST:
            return NO_SOLUTION
    part = calls.part_of_step(model, end, calls.retract(model, motion.q, x), end_velocity(x, h, motion.u), h)
    newton.accept_step(model, motion, h, x, end, found, part != 1.0)
    if not calls.lock(model, 0.0):  # the tangent of locked directions is new in each iteration, also in shorter steps
        divide(motion, _spent(motion) - spent)
    return STEPPED


@shared
def _spent(motion: MeanMotion) -> float:
    return motion.counts[newton.ITERATIONS] + _FACTORS * motion.counts[newton.LINEARISATIONS]


@shared
def divide(motion: MeanMotion, cost: float) -> None:
    """Halve or double the next steps by the cost of the last ones."""
    sizes, counts = motion.sizes, motion.counts
    sizes[newton.COST] = _MEMORY * sizes[newton.COST] + (1.0 - _MEMORY) * cost
    if sizes[newton.COST] > _DEAR and counts[newton.DIVISION] < _HALVES:
        counts[newton.DIVISION], sizes[newton.COST] = 2 * counts[newton.DIVISION], BETWEEN
    elif sizes[newton.COST] < _CHEAP and counts[newton.DIVISION] > 1:
        counts[newton.DIVISION], sizes[newton.COST] = counts[newton.DIVISION] // 2, BETWEEN


@shared
def _conserved(motion: MeanMotion, found: StepEnergies) -> bool:
    """Whether the quadrature of a fixed step conserves the energy."""
    bound = max(_LOST_AT_ONCE * newton.reference(motion, found), motion.sizes[newton.ROUND_OFF])
    return abs(newton.quadrature_error(motion, found)) <= bound


# error control ----------------------------------------------------------------------------------------------------------


@shared
def _controlled_step(model: Any, motion: MeanMotion, rules: MeanRules, target: float, until: float) -> int:
    sizes, counts = motion.sizes, motion.counts
    t = sizes[newton.TIME]
    if sizes[newton.LONGEST] == 0.0:
        sizes[newton.LONGEST] = calls.longest_step(model, t, motion.q, motion.u)
    if sizes[newton.NEXT] == 0.0 and not _start(model, motion, rules, until - t):
        return UNABLE if calls.unable(model) else NO_SOLUTION
    grow = True
    while True:
        left, h = target - t, min(sizes[newton.NEXT], rules.max_step, sizes[newton.LONGEST])
        count = math.ceil(left / h * (1.0 - 1e-9))
        h = newton.same_size(motion, left / count if count <= 2 else h)
        end = target if count <= 1 else t + h
        if not end > t:
            return STEP_TOO_SMALL
        done, x = newton.solved(model, motion, rules, h)
        if calls.unable(model):
            return UNABLE
        part = 1.0
        # the end of a step may be beyond a state that the Gauss points do not reach, for example where facets meet
        if done:
            found = newton.step_energies(model, motion, h, x, end)
            done = math.isfinite(found.stored)
        if not done:
            counts[newton.FAILED] += 1
            sizes[newton.FACTORED] = 0.0
            sizes[newton.NEXT] = _CUT * h
        else:
            part = calls.part_of_step(model, end, calls.retract(model, motion.q, x), end_velocity(x, h, motion.u), h)
            if part >= 1.0:
                of_time = _error(model, motion, rules, h, x) if h > rules.shortest else 0.0
                error = max(of_time, _lost(motion, found) if h > rules.shortest / _FINEST else 0.0)
                if error <= 1.0:
                    _adapt(motion, rules, h, max(error, 1e-8), grow)
                    break
                sizes[newton.NEXT] = h * max(_SHRINK, _SAFETY * error ** (-1.0 / 3.0))
                if error == of_time:
                    sizes[newton.NEXT] = max(sizes[newton.NEXT], min(h, rules.shortest))
            else:
                sizes[newton.NEXT] = h * part
            counts[newton.REJECTED] += 1
        grow = False
        if sizes[newton.NEXT] < _SMALLEST * max(abs(t), until - t):
            if not done:
                return NO_SOLUTION
            return OBJECTED if part < 1.0 else STEP_TOO_SMALL
    newton.choose_prediction(model, motion, h, x)
    newton.accept_step(model, motion, h, x, end, found, part > 1.0)
    return STEPPED


@shared
def _start(model: Any, motion: MeanMotion, rules: MeanRules, left: float) -> bool:
    """Choose the first step, from the velocity and from u' right after the present time."""
    sizes = motion.sizes
    right = calls.renewed_force(model, np.nextafter(sizes[newton.TIME], math.inf), motion.q, motion.u)
    if not calls.factorise_mass(model):
        return False
    sizes[newton.FACTORED] = 0.0
    rate = calls.solve(model, right)
    calls.consistent(model, sizes[newton.TIME], motion.q.copy(), motion.u.copy(), rate, False)
    pace = max(mean_ratio(motion.u, rules.size), math.sqrt(mean_ratio(rate, rules.size)))
    sizes[newton.NEXT] = min(_FIRST * left, rules.max_step)
    if pace > 0.0:
        sizes[newton.NEXT] = min(sizes[newton.NEXT], rules.rtol ** (1.0 / 3.0) / pace)
    return True


@shared
def _error(model: Any, motion: MeanMotion, rules: MeanRules, h: float, x: np.ndarray) -> float:
    """Ratio of the local error of the increment to the tolerance; 0 until it is known.

    The error of the rate is not controlled; without damping, the fastest vibrations of stiff joints would determine the
    steps.
    """
    sizes, mean = motion.sizes, scaled(1.0 / h, x)
    if motion.counts[newton.KNOWN] == 0:
        return 0.0
    if motion.counts[newton.KNOWN] == 1:
        return h / rules.rtol ** (2.0 / 3.0) * mean_ratio(subtracted(mean, motion.mean), rules.size)
    rate = scaled(1.0 / (0.5 * (h + sizes[newton.LAST])), subtracted(mean, motion.mean))
    jerk = scaled(
        1.0 / (0.5 * (0.5 * h + sizes[newton.LAST] + 0.5 * sizes[newton.LAST_BEFORE])), subtracted(rate, motion.rate)
    )
    filtered = scaled(h / 6.0, calls.mass_times(model, jerk))  # factor h^3/12 times 2/h^2
    return mean_ratio(calls.solve(model, filtered), rules.size) / rules.rtol


@shared
def _lost(motion: MeanMotion, found: StepEnergies) -> float:
    """Ratio of the energy error of the quadrature to its bound."""
    sizes, turnover = motion.sizes, newton.reference(motion, found)
    most = max(_AT_ONCE * (_LOST * turnover - abs(sizes[newton.OFF])), _LEAST * turnover, sizes[newton.ROUND_OFF])
    return abs(newton.quadrature_error(motion, found)) / most if most > 0.0 else 0.0


@shared
def _adapt(motion: MeanMotion, rules: MeanRules, h: float, error: float, grow: bool) -> None:
    """Soderlind's PI controller (PI.4.2)."""
    sizes = motion.sizes
    factor = _SAFETY * error ** (-0.2) * sizes[newton.ERROR_BEFORE] ** (1.0 / 15.0)
    sizes[newton.ERROR_BEFORE] = error
    most, following = _GROWTH if grow else 1.0, sizes[newton.NEXT]
    wanted = max(h * min(max(factor, _SHRINK), most), min(h * most, rules.shortest))
    if grow and h < following and error * (following / h) ** 3 <= 1.0:
        wanted = max(wanted, following)
    if not following <= wanted <= _STEADY * following or not grow:
        sizes[newton.NEXT] = min(wanted, rules.max_step)


# many steps -------------------------------------------------------------------------------------------------------------


@shared
def march_mean_force(
    model: Any, motion: MeanMotion, rules: MeanRules, balance: np.ndarray, until: float, most: int, records: np.ndarray
) -> int:
    """Take at most `most` steps up to `until`, with the energy balance, as `fsm.solve.stepping.march.march`.

    `motion.all_pairs` is increased by the energies that contact pairs dissipate.
    """
    sizes, drives, last = motion.sizes, motion.drive_force.shape[0], records.shape[0] - 1
    for number in range(most):
        begin, record = sizes[newton.TIME], records[min(number, last)]
        if not begin < until:
            break
        outcome = take_step(model, motion, rules, until)
        if outcome != STEPPED:
            return outcome
        kinetic, potential, _, power, driven = calls.energies(model, sizes[newton.TIME], motion.q, motion.u, 0.0, record)
        for k in range(drives):
            record[calls.DRIVES + drives + k] = motion.drive_force[k]
        add_pairs(motion)
        done, lost = sizes[newton.WORK], sizes[newton.DISSIPATED]
        if end_step(balance, record, motion, begin, done, lost, 0.0, kinetic, potential, power, driven):
            break
    return STEPPED


@kernel
def march_mean_force_arrays(
    model: Any, motion: MeanMotion, rules: MeanRules, balance: np.ndarray, until: float, most: int, records: np.ndarray
) -> int:
    """Compiled `march_mean_force` for an `ArrayModel`."""
    return march_mean_force(
        borrowed(model), borrowed(motion), borrowed(rules), borrowed(balance), until, most, borrowed(records)
    )
