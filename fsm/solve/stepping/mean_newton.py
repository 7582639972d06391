"""Newton's method for a step of the mean-force method, and its energies; see `fsm.solve.stepping.mean_force`."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.jit import shared
from fsm.kernels.vector import mean_ratio
from fsm.solve.stepping import model as calls
from fsm.solve.stepping.secants import add, clear, improved, no_secants
from fsm.solve.stepping.vectors import changed_rate, copy_into, end_velocity, inner, mean_balance, moved, scaled, subtracted

(
    TIME, LAST, LAST_BEFORE, NEXT, ERROR_BEFORE, STORED, START, TURNOVER, OFF, ROUND_OFF, COST, FACTORED, LONGEST, WORK,
    DISSIPATED, EXTRAPOLATED,
) = range(16)  # fmt: skip
"""Indices of `MeanMotion.sizes`: time, sizes of the last two steps and of the next one (s), last error (-), energies (J),
mean cost of a step in iterations, step size of the last factors and longest step (s), energies of the last step (J), and 1
if the mean rate is extrapolated, else 0."""
STEPS, REJECTED, FAILED, ITERATIONS, FORCES, LINEARISATIONS, FACTORISATIONS, DIVISION, KNOWN = range(9)
"""Indices of `MeanMotion.counts`; all except the last are those of generalized-alpha. KNOWN: number of known mean rates."""

_EARLY, _LATE = 0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0)
"""Gauss points over the step, of equal weight."""
_WORK = 1e-7
"""Bound of the work of the residual in a fixed step, relative to the reference energy."""
_ITERATIONS = 30
_SURE = 0.02
"""Lower bound of the ratio of successive corrections."""
_OVERSHOT = 0.5
"""Ratio of the work of the residual at the end of a correction to the work at its start. Above it, the
correction is shortened."""
_CUTS, _SHORTEST = 3, 0.3
"""Largest number of cuts of a correction, and smallest factor of a cut."""


class MeanRules(NamedTuple):
    """Tolerances and scales.

    Attributes
    ----------
    rtol, newton_tolerance : -
    slow : -
        Ratio of successive corrections above which the tangent is evaluated again.
    fixed_step : s; 0 with error control
    shortest, max_step : s
        Error control accepts all steps of the first size, and takes no step above the second.
    size, weight : (nu,) arrays
        Scales of increments, and the inverse of their squares.
    breaks : increasing times, s
    """

    rtol: float
    newton_tolerance: float
    slow: float
    fixed_step: float
    shortest: float
    max_step: float
    size: np.ndarray
    weight: np.ndarray
    breaks: np.ndarray


class MeanMotion(NamedTuple):
    """State of the method, changed in place.

    Attributes
    ----------
    q, u : configuration (nq,) and velocity (nu,)
    consistent : (nu,) array
        Velocity without the part of u that opens locked directions; u without locked directions.
    mean, mean_before : (nu,) arrays
        Mean rates of the last two steps; rates at the ends contain stiff vibrations.
    rate : (nu,) array
        Acceleration half-way between the last two steps.
    sizes, counts : (16,) float and (9,) int arrays
        `TIME` and the names after it are the indices of sizes; `STEPS` and the names after it are those of counts.
    of_pairs : (2, n_pairs) array, J
        Energy dissipated by every contact pair in the last step.
    all_pairs : (2, n_pairs) array, J
        Energy dissipated by every contact pair in all steps of `march_mean_force`.
    drive_force : (n_drives,) array, N
        Mean force over the last step. Rates at the ends of a step contain stiff vibrations, which would cause damper
        forces.
    """

    q: np.ndarray
    u: np.ndarray
    consistent: np.ndarray
    mean: np.ndarray
    mean_before: np.ndarray
    rate: np.ndarray
    sizes: np.ndarray
    counts: np.ndarray
    of_pairs: np.ndarray
    all_pairs: np.ndarray
    drive_force: np.ndarray


class StepEnergies(NamedTuple):
    """Work and dissipated energy of a step, and stored (without driven bodies) and kinetic energy at its end, J.

    `of_pairs` and `drive_force` as in `MeanMotion`.
    """

    work: float
    dissipated: float
    stored: float
    kinetic: float
    of_pairs: np.ndarray
    drive_force: np.ndarray


@shared
def same_size(motion: MeanMotion, h: float) -> float:
    """Size of the previous step if h equals this size except for round-off, so that its factorisation is reused; else h."""
    last = motion.sizes[LAST]
    return last if abs(h - last) <= 1e-9 * h else h


@shared
def reference(motion: MeanMotion, found: StepEnergies) -> float:
    """Reference energy at the end of a step, J."""
    return max(found.kinetic, abs(found.stored - motion.sizes[START]), motion.sizes[TURNOVER])


@shared
def quadrature_error(motion: MeanMotion, found: StepEnergies) -> float:
    """Energy error of the quadrature of a step, J."""
    return found.stored - motion.sizes[STORED] + found.dissipated - found.work


@shared
def _at(motion: MeanMotion, h: float, part: float) -> float:
    return motion.sizes[TIME] + part * h


@shared
def _residual(model: Any, motion: MeanMotion, h: float, x: np.ndarray) -> np.ndarray:
    """Residual of forces and inertia, N."""
    motion.counts[FORCES] += 2
    rate, q = scaled(1.0 / h, x), motion.q
    calls.measure_step(model, motion.sizes[TIME], h, q, x)
    calls.halfway(model, motion.sizes[TIME], h, q, x)
    early = calls.force(model, _at(motion, h, _EARLY), calls.retract(model, q, scaled(_EARLY, x)), rate)
    late = calls.force(model, _at(motion, h, _LATE), calls.retract(model, q, scaled(_LATE, x)), rate)
    calls.halfway(model, motion.sizes[TIME], 0.0, q, x)
    return mean_balance(early, late, calls.mass_times(model, changed_rate(x, h, motion.u)))


@shared
def _factorise(model: Any, motion: MeanMotion, h: float, x: np.ndarray) -> bool:
    rate, q = scaled(1.0 / h, x), motion.q
    calls.halfway(model, motion.sizes[TIME], h, q, x)
    while True:  # contacts that are found at one of the points may add blocks to the pattern
        motion.counts[LINEARISATIONS] += 1
        calls.renewed_force(model, _at(motion, h, _EARLY), calls.retract(model, q, scaled(_EARLY, x)), rate)
        calls.keep_tangent(model, 0.5 * _EARLY, 0.5, True)
        calls.renewed_force(model, _at(motion, h, _LATE), calls.retract(model, q, scaled(_LATE, x)), rate)
        if calls.keep_tangent(model, 0.5 * _LATE, 0.5, False):
            break
    calls.halfway(model, motion.sizes[TIME], 0.0, q, x)
    motion.counts[FACTORISATIONS] += 1
    motion.sizes[FACTORED] = h
    # increments at the point s are s times the increments of x, except for the rotation of the axes
    return calls.factorise(model, 1.0 / h, 2.0 / h**2, scaled(0.5, x), True)


@shared
def predicted_rate(motion: MeanMotion, rules: MeanRules, h: float) -> np.ndarray:
    """Mean rate of the next step, as a start for Newton's method; see the module docstring."""
    if rules.fixed_step > 0.0:
        return motion.mean_before
    return moved(motion.mean, motion.sizes[EXTRAPOLATED], _extrapolated_change(motion, h))


@shared
def _extrapolated_change(motion: MeanMotion, h: float) -> np.ndarray:
    """Change of the mean rate from the last step to the next one, extrapolated linearly; zero in the first two steps."""
    before = motion.sizes[LAST_BEFORE]
    change = (h + motion.sizes[LAST]) / (motion.sizes[LAST] + before) if before > 0.0 else 0.0
    return scaled(change, subtracted(motion.mean, motion.mean_before))


@shared
def choose_prediction(model: Any, motion: MeanMotion, h: float, x: np.ndarray) -> None:
    """Extrapolate the mean rate for the next step if this is nearer to that of the step h than the rate before it.

    The distance is the kinetic energy of the difference.
    """
    expected, change = _extrapolated_change(motion, h), subtracted(scaled(1.0 / h, x), motion.mean)
    momentum = calls.mass_times(model, expected)
    motion.sizes[EXTRAPOLATED] = 1.0 if 2.0 * inner(change, momentum) > inner(expected, momentum) else 0.0


@shared
def solved(model: Any, motion: MeanMotion, rules: MeanRules, h: float) -> tuple[bool, np.ndarray]:
    """Whether Newton's method converges, and the increment of the step."""
    fixed, tolerance = rules.fixed_step > 0.0, rules.newton_tolerance
    x = scaled(h, predicted_rate(motion, rules, h))
    locks = calls.lock(model, 2.0 / h**2)  # the penalties of locked directions turn with the bodies
    renew, before = locks or h != motion.sizes[FACTORED], 0.0
    residual = _residual(model, motion, h, x)
    secants = no_secants(rules.weight, _ITERATIONS)
    for _ in range(_ITERATIONS):
        if renew:
            if not _factorise(model, motion, h, x):
                return False, x
            clear(secants)
        motion.counts[ITERATIONS] += 1
        change = calls.solve(model, residual)
        if locks:
            calls.advance(model, change)
        dx = improved(secants, calls.mapped(model, change))
        size = mean_ratio(dx, rules.size)
        if not math.isfinite(size):
            return False, x
        contraction = size / before if before > 0.0 else 0.5
        left = size * max(contraction, _SURE) / max(1.0 - contraction, 1e-3)
        least = size <= 1e-3 * tolerance
        converged = left <= tolerance or least
        # contacts that have opened since the factorisation make it too stiff
        opened = converged and not renew and calls.touching(model)[1]
        exact = not fixed or least
        if converged and not opened and (exact or _residual_work(model, motion, h, x, residual) <= 1.0):
            return True, moved(x, 1.0, dx)
        start = x
        x, residual = _moved(model, motion, h, x, dx, residual, locks)
        if converged and not opened and _residual_work(model, motion, h, x, residual) <= 1.0:
            return True, x
        add(secants, subtracted(x, start), dx)
        renew = locks or opened or (before > 0.0 and contraction > rules.slow)
        before = size
    return False, x


@shared
def _residual_work(model: Any, motion: MeanMotion, h: float, x: np.ndarray, residual: np.ndarray) -> float:
    """Work of a residual in a step over its bound."""
    rate = scaled(1.0 / h, x)
    turnover = max(motion.sizes[TURNOVER], 0.5 * inner(rate, calls.mass_times(model, rate)))
    return abs(inner(residual, x)) / max(_WORK * turnover, motion.sizes[ROUND_OFF], 1e-300)


@shared
def _moved(
    model: Any, motion: MeanMotion, h: float, x: np.ndarray, dx: np.ndarray, residual: np.ndarray, whole: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Increment after a correction that does not overshoot, or after the `whole` one, and its residual."""
    part, start = 1.0, inner(dx, residual)
    later = moved(x, part, dx)
    after = _residual(model, motion, h, later)
    for _ in range(0 if whole else _CUTS):
        end = inner(dx, after)
        if end >= -_OVERSHOT * abs(start):
            break
        part = max(part * start / (start - end), _SHORTEST)
        later = moved(x, part, dx)
        after = _residual(model, motion, h, later)
    return later, after


@shared
def step_energies(model: Any, motion: MeanMotion, h: float, x: np.ndarray, end: float) -> StepEnergies:
    """Energies of a step: at its end, and work and dissipation over it."""
    drives, pairs = motion.drive_force.shape[0], motion.of_pairs.shape[1]
    rate, q, of_pairs, drive_force = scaled(1.0 / h, x), motion.q, np.zeros((2, pairs)), np.zeros(drives)
    calls.halfway(model, motion.sizes[TIME], h, q, x)
    early = calls.powers(
        model, _at(motion, h, _EARLY), calls.retract(model, q, scaled(_EARLY, x)), rate, of_pairs, drive_force
    )
    late = calls.powers(model, _at(motion, h, _LATE), calls.retract(model, q, scaled(_LATE, x)), rate, of_pairs, drive_force)
    calls.halfway(model, motion.sizes[TIME], 0.0, q, x)
    record = np.zeros(calls.DRIVES + 2 * drives + pairs)
    kinetic, total = calls.stored(model, end, calls.retract(model, q, x), end_velocity(x, h, motion.u), record)
    for k in range(drives):
        drive_force[k] *= 0.5
    for row in range(2):
        for k in range(pairs):
            of_pairs[row, k] *= 0.5 * h
    work, dissipated = 0.5 * h * (early[0] + late[0]), 0.5 * h * (early[1] + late[1])
    return StepEnergies(work, dissipated, total, kinetic, of_pairs, drive_force)


@shared
def accept_step(
    model: Any, motion: MeanMotion, h: float, x: np.ndarray, end: float, found: StepEnergies, at_event: bool
) -> None:
    """Go to the end of a step; the energy of a latch that opens `at_event` is dissipated."""
    sizes, counts = motion.sizes, motion.counts
    sizes[WORK], sizes[DISSIPATED] = found.work, found.dissipated
    copy_into(found.of_pairs, motion.of_pairs)
    copy_into(found.drive_force, motion.drive_force)
    sizes[TURNOVER] = reference(motion, found)
    sizes[OFF] += quadrature_error(motion, found)
    sizes[STORED] = found.stored
    rate = scaled(1.0 / h, x)
    if counts[KNOWN] > 0:
        copy_into(scaled(1.0 / (0.5 * (h + sizes[LAST])), subtracted(rate, motion.mean)), motion.rate)
    counts[KNOWN] = min(counts[KNOWN] + 1, 2)
    copy_into(motion.mean, motion.mean_before)
    copy_into(rate, motion.mean)
    sizes[LAST_BEFORE], sizes[LAST] = sizes[LAST], h
    later, faster = end_velocity(x, h, motion.u), changed_rate(x, h, motion.u)
    copy_into(calls.retract(model, motion.q, x), motion.q)
    copy_into(later, motion.u)
    copy_into(later, motion.consistent)
    before = np.nextafter(end, -math.inf)  # motors jump at breaks
    calls.consistent(model, before, motion.q.copy(), motion.consistent, faster, False)
    sizes[TIME] = end
    counts[STEPS] += 1
    sizes[LONGEST] = calls.accept(model, end, motion.q, motion.u)
    if at_event:
        record = np.zeros(calls.DRIVES + 2 * motion.drive_force.shape[0] + motion.of_pairs.shape[1])
        sizes[STORED] = calls.stored(model, end, motion.q, motion.u, record)[1]
        sizes[DISSIPATED] += found.stored - sizes[STORED]
