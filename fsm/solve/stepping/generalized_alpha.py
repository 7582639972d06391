"""One step of the generalized-alpha method on Lie groups, with error control: M u' = h(t, q, u), q' = T(q) u.

A step from t_n to t_{n+1} = t_n + h, with x the increment of the configuration [2, 3]:

    (1 - alpha_m) a_{n+1} + alpha_m a_n = (1 - alpha_f) u'_{n+1} + alpha_f u'_n                          (1)
    x = h u_n + (1/2 - beta) h^2 a_n + beta h^2 a_{n+1},   q_{n+1} = retract(q_n, x)                     (2)
    u_{n+1} = u_n + (1 - gamma) h a_n + gamma h a_{n+1}                                                  (3)
    M u'_{n+1} = h(t_{n+1}, q_{n+1}, u_{n+1})                                                            (4)

Newton's method solves for x; (1) to (3) give a, u and u' from x. The matrix, for increments d at q_{n+1}, is

    S = K + (c_d D + c_m M) increment_map(x),   c_d = gamma/(beta h),   c_m = (1 - alpha_m)/((1 - alpha_f) beta h^2)

Choices:

* a_n belongs to t_n + (alpha_m - alpha_f) h, so a - u' is proportional to h. A change of h rescales it, for order 2 [4].
* The local error is C h^3 times a derivative of u', from differences of u'. In modes that are too stiff for the step these
  differences are noise. The filter S^-1 c_m M removes them and does not change the other modes.
* A step as short as the system's `shortest_step` is accepted with any error. Shorter steps would resolve waves that the mesh
  does not resolve. Numerical damping removes these waves.
* M is constant for segments and ANCF elements, and is evaluated once.
* The method starts again where an event ends a step, and at breaks if forces jump. The step up to there has the forces
  before the jump.
* The numerical dissipation of a step is the work of all forces less the gain of kinetic energy:

      W + int_0^1 (f(t_n + s h, retract(q_n, s x), x/h).x - h P) ds - (u_n + u_{n+1})/2 . M (u_{n+1} - u_n)          (5)

  W is the work put in that the energy balance has, and P the input power along the step, so the integral is the work of
  springs and dampers. Along the step bodies have the mean velocities x/h, as in the mean-force method. Two Gauss points
  have an error of h^5, and none for linear forces; a step in which contacts begin or end has up to 16. (5) needs no stored
  energy: the energy balance still shows forces that contradict the energies. (5) contains numerical damping and the errors
  of x and u in a step, of order h^3.
* The energy that contacts dissipate is that at the same points, because their forces begin and end in few steps: the mean of
  both ends of a step has an error of 2e-4 of the energy of a ball that bounces.
* Locked directions (`fsm.solve.stepping.model.lock`) have efforts lambda + r x in Newton's method, which advances lambda
  with each increment. Ends of steps are projected, so that no direction drifts and multipliers are those of the state.

References
----------
[1] Chung, Hulbert, J. Appl. Mech. 60 (1993) 371-375. [2] Arnold, Bruls, Multibody Syst. Dyn. 18 (2007) 185-202.
[3] Bruls, Cardona, Arnold, Mech. Mach. Theory 48 (2012) 121-137. [4] Bruls, Arnold, J. Comput. Nonlin. Dyn. 3 (2008) 041007.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.jit import shared
from fsm.kernels.vector import error_norm, largest_distance, mean_ratio, weighted_mean_square
from fsm.solve.stepping import model as calls
from fsm.solve.stepping import vectors
from fsm.solve.stepping.outcomes import NO_SOLUTION, OBJECTED, STEP_TOO_SMALL, STEPPED, UNABLE

TIME, STEP_SIZE, MAX_STEP, PRESENT, BEFORE, LAST_ERROR, LONGEST, FACTORISED, CONTRACTION = range(9)
UNSEEN, SPENT = range(9, 11)
"""Indices of `Motion.sizes`, in s; the last error and the contraction have no unit. The last two are energies of the last
step, J: numerical dissipation (5) without the work put in, and energy that elements dissipated along the step."""
STEPS, REJECTED, FAILED, ITERATIONS, FORCES, LINEARISATIONS, FACTORISATIONS, DIVISION, STARTED, SLOW, TANGENT = range(11)
TOUCHING = 11
"""Indices of `Motion.counts`. `STARTED`, `SLOW` and `TANGENT` are 0 or 1; `TANGENT`: the model has a tangent. `TOUCHING`:
contacts with a force at the end of the last step."""

_NEWTON = 1e-2
"""Jump of the forces relative to the tolerance, above which the accelerations are computed again."""
_MOST, _PATIENT = 10, 50
"""Largest number of Newton iterations, and that with a new tangent in a fixed step. The tangent jumps where films
become slack or taut; corrections then grow before they decrease."""
_SLOW = 0.2
"""Ratio of successive corrections above which the tangent is evaluated again."""
_SURE = 0.02
"""Lower bound of the ratio of successive corrections."""
_SAFETY = 0.9
_SHRINK = 0.2
GROWTH_OF_STEADY_STEPS = 1.2
"""Smallest growth of a step; below this growth, step size and factorisation are reused. Limits of growth are at least
this value."""
_HOP = 0.2
"""Largest correction of a prediction, relative to the span or in radians; a larger one rejects the step."""
_CUT = 0.25
"""Factor on a step size for which Newton's method did not converge."""
_FIRST = 1e-4
"""Largest first step relative to the remaining time."""
_FIRST_SHORTEST = 1e-2
"""Largest first step relative to the system's shortest step."""
_FINEST = 64
"""Largest number of parts of a fixed step for which Newton's method did not converge."""
_SAME = 1e-9
"""Relative difference below which two step sizes are equal."""
_EARLY, _LATE = 0.5 - math.sqrt(3.0) / 6.0, 0.5 + math.sqrt(3.0) / 6.0
"""Gauss points of a step."""
_CLOSED = 1e-3
"""Change of the work in (5), relative to the kinetic energy times the tolerance, up to which the parts of a step are halved
in which contacts begin or end."""
_SMALLEST = 16.0 * float(np.finfo(float).eps)
"""Smallest step relative to the present time."""


class Rules(NamedTuple):
    """Constants of the method [1], tolerances and scales.

    Attributes
    ----------
    alpha_m, alpha_f, beta, gamma : -
    shift : -
        a_n belongs to t_n + shift h.
    error_x, error_u : -
        Local errors error_x h^3 u'' of x and error_u h^3 u''' of u.
    rtol, newton_tolerance, growth : -
        `growth` is the largest ratio of successive step sizes.
    fixed_step : s; 0 with error control
    shortest : s
        Error control accepts every step of this size.
    balances : -
        Largest number of parts of a step in which contacts begin or end, for its energies `UNSEEN` and `SPENT`; 0 if steps
        do not compute them.
    tolerance, resolved, velocity, increment, span : (nu,) arrays
        Tolerances of the increment x for the local error and for Newton's method, and scales of
        `fsm.solve.interface.scales.Scales`.
    breaks : increasing times, s
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    shift: float
    error_x: float
    error_u: float
    rtol: float
    newton_tolerance: float
    growth: float
    fixed_step: float
    shortest: float
    balances: float
    tolerance: np.ndarray
    resolved: np.ndarray
    velocity: np.ndarray
    increment: np.ndarray
    span: np.ndarray
    breaks: np.ndarray


class Motion(NamedTuple):
    """State of the method, changed in place.

    Attributes
    ----------
    q, u : configuration (nq,) and velocity (nu,)
    rate, a, slope : (nu,) arrays
        u', the algorithmic acceleration, and the latest slope of u'.
    sizes, counts : (11,) float and (12,) int arrays
        See the indices above.
    of_pairs, all_pairs : (2, n_pairs) arrays, J
        Energy dissipated by every contact pair in the last step, and in all steps of `fsm.solve.stepping.march`.
    drive_force : (n_drives,) array
        Work space.
    """

    q: np.ndarray
    u: np.ndarray
    rate: np.ndarray
    a: np.ndarray
    slope: np.ndarray
    sizes: np.ndarray
    counts: np.ndarray
    of_pairs: np.ndarray
    all_pairs: np.ndarray
    drive_force: np.ndarray


class _Trial(NamedTuple):
    """Result of Newton's method for a step. `solved`: the method has converged; `renewed`: it used a new tangent."""

    solved: bool
    renewed: bool
    x: np.ndarray
    q: np.ndarray
    u: np.ndarray
    a: np.ndarray
    rate: np.ndarray


@shared
def take_step(model: Any, motion: Motion, rules: Rules, until: float) -> int:
    """Take one step that ends at `until` or before, and return the outcome."""
    sizes, counts = motion.sizes, motion.counts
    if counts[STARTED] == 0 and not _start(model, motion, rules, until, False):
        return UNABLE if calls.unable(model) else NO_SOLUTION
    if counts[TANGENT] == 0:
        counts[LINEARISATIONS] += 1
        calls.lock(model, inertial_factor(rules, sizes[PRESENT]))
        calls.renewed_force(model, sizes[TIME], motion.q, motion.u)
        _factorise(model, motion, rules, sizes[PRESENT], motion.u, False)
        counts[TANGENT] = 1
    t, target = sizes[TIME], until
    for b in rules.breaks:
        if b > t:
            target = min(target, b)
    grow, filtered, part = True, False, 1.0
    while True:
        h, end = _next_size(motion, rules, target)
        if not end > t:
            return STEP_TOO_SMALL
        # the present tangent is tried first if it converged well, then a new one
        inside = before_break(rules.breaks, end)
        trial = _newton(model, motion, rules, inside, h, counts[SLOW] == 1)
        if not trial.solved and not trial.renewed:
            trial = _newton(model, motion, rules, inside, h, True)
        if calls.unable(model):
            return UNABLE
        if not trial.solved:  # the last tangent may belong to a state that is far away, or not finite
            counts[LINEARISATIONS] += 1
            calls.lock(model, inertial_factor(rules, h))
            calls.renewed_force(model, t, motion.q, motion.u)
        if rules.fixed_step > 0.0:
            if trial.solved:
                counts[DIVISION] = max(1, counts[DIVISION] // 2)
                break
            counts[FAILED] += 1
            if sizes[BEFORE] == 0.0 and not filtered and _start(model, motion, rules, until, True):
                filtered = True
                continue
            counts[DIVISION] *= 2
            if counts[DIVISION] > _FINEST:
                return NO_SOLUTION
            continue
        part = 1.0
        if not trial.solved:
            counts[FAILED] += 1
            sizes[STEP_SIZE] = _CUT * h
        else:
            error = _error(model, motion, rules, h, trial)
            if calls.unable(model):
                return UNABLE
            small = error <= 1.0 or h <= rules.shortest
            if small:
                part = calls.part_of_step(model, end, trial.q, trial.u, h)
            if small and part >= 1.0:
                _adapt(motion, rules, h, error, grow)
                break
            counts[REJECTED] += 1
            if part < 1.0:
                sizes[STEP_SIZE] = h * part
            else:
                sizes[STEP_SIZE] = max(h * max(_SHRINK, _SAFETY * error ** (-1.0 / 3.0)), min(h, rules.shortest))
        grow = False
        if sizes[STEP_SIZE] < _SMALLEST * max(abs(t), until - t):
            if not trial.solved:
                return NO_SOLUTION
            return OBJECTED if part < 1.0 else STEP_TOO_SMALL
    if rules.balances > 0.0:
        _balance(model, motion, rules, h, trial)
    _accept(model, motion, rules, end, h, trial, part > 1.0)
    return STEPPED


@shared
def before_break(breaks: np.ndarray, t: float) -> float:
    """Time just before t (s) if t is a break, at which forces and powers may jump; else t."""
    for b in breaks:
        if b == t:
            return float(np.nextafter(t, -math.inf))
    return t


# start ------------------------------------------------------------------------------------------------------------------


@shared
def _start(model: Any, motion: Motion, rules: Rules, until: float, filtered: bool) -> bool:
    """Compute u' and a right after the present time; this is repeated wherever the forces jump. If `filtered`, u' passes
    the filter S^-1 c_m M: after a release, h^2 u' of modes that are too stiff for the step may be longer than the structure.
    """
    sizes, counts, q, u = motion.sizes, motion.counts, motion.q, motion.u
    # a drive that stops at this time is at rest right after it
    t = np.nextafter(sizes[TIME], math.inf)
    counts[LINEARISATIONS] += 1
    present = calls.renewed_force(model, t, q, u)
    counts[TOUCHING] = calls.touching(model)[0]
    counts[FACTORISATIONS] += 1
    if not calls.factorise_mass(model):
        return False
    vectors.copy_into(calls.solve(model, present), motion.rate)
    calls.consistent(model, t, q, u, motion.rate, False)
    if sizes[STEP_SIZE] == 0.0:
        sizes[STEP_SIZE] = _first_size(motion, rules, until - sizes[TIME])
    h = sizes[STEP_SIZE]
    if calls.lock(model, inertial_factor(rules, h)):
        present = calls.renewed_force(model, t, q, u)
    if not _factorise(model, motion, rules, h, u, False):
        return False
    if filtered:
        vectors.copy_into(calls.solve(model, vectors.scaled(inertial_factor(rules, h), present)), motion.rate)
    counts[FORCES] += 1
    ahead = 1e-3 * h
    change = vectors.scaled(1.0 / ahead, vectors.subtracted(calls.force(model, t + ahead, q, u), present))
    change = vectors.subtracted(
        vectors.subtracted(change, calls.stiffness_times(model, u)), calls.damping_times(model, motion.rate)
    )
    # u'' = M^-1 change; S in place of M differs by O(h), and bounds the contribution of stiff modes out of equilibrium
    vectors.copy_into(calls.solve(model, vectors.scaled(inertial_factor(rules, h), change)), motion.slope)
    vectors.start_a(motion.rate, rules.shift * h, motion.slope, motion.a)
    sizes[PRESENT], sizes[BEFORE] = h, 0.0
    sizes[CONTRACTION] = sizes[LAST_ERROR] = 1.0
    sizes[LONGEST] = calls.longest_step(model, sizes[TIME], q, u)
    counts[STARTED] = counts[TANGENT] = 1
    return True


@shared
def _first_size(motion: Motion, rules: Rules, left: float) -> float:
    if rules.fixed_step > 0.0:
        return rules.fixed_step
    # changes of u and q over the step are rtol^(1/3) of their scales, since errors are proportional to h^3
    pace = max(mean_ratio(motion.rate, rules.velocity), mean_ratio(motion.u, rules.increment))
    # modes that are too fast for the shortest step may be far from equilibrium; a long step h moves them by h^2 u'
    first = min(_FIRST * left, motion.sizes[MAX_STEP])
    if rules.shortest > 0.0:
        first = min(first, _FIRST_SHORTEST * rules.shortest)
    if pace > 0.0:
        first = min(first, rules.rtol ** (1.0 / 3.0) / pace)
    return first


# steps ------------------------------------------------------------------------------------------------------------------


@shared
def _next_size(motion: Motion, rules: Rules, target: float) -> tuple[float, float]:
    """Size and end of the next step; a step ends exactly at `target`, without a tiny step before it."""
    sizes = motion.sizes
    left = target - sizes[TIME]
    h = min(sizes[STEP_SIZE], sizes[MAX_STEP], sizes[LONGEST])
    if rules.fixed_step > 0.0:
        h = rules.fixed_step / motion.counts[DIVISION]
    count = math.ceil(left / h * (1.0 - 1e-9))
    if count <= 1:
        return _same(motion, left), target
    if count == 2 or rules.fixed_step > 0.0:
        h = _same(motion, left / count)
    return h, sizes[TIME] + h


@shared
def _same(motion: Motion, h: float) -> float:
    """Size of the previous step if h equals it except for round-off, so that its factorisation is reused; else h."""
    present = motion.sizes[PRESENT]
    return present if abs(h - present) <= _SAME * h else h


@shared
def _newton(model: Any, motion: Motion, rules: Rules, end: float, h: float, renew: bool) -> _Trial:
    """Newton's method for one step."""
    sizes, counts = motion.sizes, motion.counts
    present_size, old_a = sizes[PRESENT], motion.a
    if h != present_size:
        # a - u' is proportional to h; in modes that are too stiff for the step, scaling it up would excite these modes
        if not _factorise(model, motion, rules, h, motion.u, False):
            return _Trial(False, renew, motion.u, motion.q, motion.u, motion.a, motion.rate)
        growth = (1.0 - h / present_size) * inertial_factor(rules, h)
        old_a = vectors.subtracted(
            motion.a,
            calls.solve(model, vectors.scaled(growth, calls.mass_times(model, vectors.subtracted(motion.a, motion.rate))))
        )
    x, u, a, rate = vectors.predict(
        h, rules.alpha_m, rules.alpha_f, rules.beta, rules.gamma, old_a, motion.u, motion.rate, motion.slope
    )
    q = calls.retract(model, motion.q, x)
    by_u, by_rate, by_a = rules.gamma / (rules.beta * h), inertial_factor(rules, h), 1.0 / (rules.beta * h**2)
    weight = vectors.newton_weight(rules.resolved, rules.rtol / by_u, rules.velocity, motion.u)
    locks = calls.lock(model, by_rate)  # the penalties of locked directions turn with the bodies
    renew = renew or locks
    before, fresh, predicted = math.inf, renew, x.copy()
    last = fresh and rules.fixed_step > 0.0
    for iteration in range(_PATIENT if last else _MOST):
        if renew:
            counts[LINEARISATIONS] += 1
            present = calls.renewed_force(model, end, q, u)
            if not _factorise(model, motion, rules, h, x, True):
                break
        else:
            if h != sizes[FACTORISED] and not _factorise(model, motion, rules, h, x, True):
                break  # the previous step was shortened
            present = calls.force(model, end, q, u)
            counts[FORCES] += 1
        counts[ITERATIONS] += 1
        change = calls.solve(model, vectors.subtracted(present, calls.mass_times(model, rate)))
        if locks:
            calls.advance(model, change)
        size = weighted_mean_square(change, weight)
        if not math.isfinite(size):
            break
        contraction = size / before if before > 0.0 else 0.0
        if contraction > 1.0 and fresh and not renew:  # contacts have closed or opened since the tangent
            renew = True
            continue
        vectors.correct(calls.mapped(model, change), by_u, by_a, by_rate, x, u, a, rate)
        q = calls.retract(model, motion.q, x)
        if iteration > 0:
            # the first correction stretches stiff springs that rotate; the second removes this
            if contraction > 2.0 and not last and (not fresh or iteration > 1):
                break
            sizes[CONTRACTION] = contraction
            counts[SLOW] = 1 if contraction > _SLOW else 0
        elif renew or h != sizes[PRESENT]:
            sizes[CONTRACTION] = 1.0  # the rate of convergence with this matrix is not known yet
        left = max(sizes[CONTRACTION], _SURE) / max(1.0 - sizes[CONTRACTION], 1e-3)
        converged = size * left <= rules.newton_tolerance or size <= 1e-3 * rules.newton_tolerance
        if converged and not renew and calls.touching(model)[1]:
            renew, before = True, size
            continue
        if converged:
            # a correction as long as the structure would lead to another solution
            hopped = largest_distance(x, predicted, rules.span) > _HOP
            if locks:
                _make_consistent(model, end, q, u, a, rate)
            return _Trial(not hopped or rules.fixed_step > 0.0, fresh, x, q, u, a, rate)
        renew = locks or (iteration > 0 and counts[SLOW] == 1)
        before = size
    return _Trial(False, fresh, x, q, u, a, rate)


@shared
def _make_consistent(model: Any, end: float, q: np.ndarray, u: np.ndarray, a: np.ndarray, rate: np.ndarray) -> None:
    """Project q, u and u' at the end of a step; a - u' is kept."""
    found = rate.copy()
    calls.consistent(model, end, q, u, rate, False)
    for i in range(found.shape[0]):
        a[i] += rate[i] - found[i]


@shared
def _balance(model: Any, motion: Motion, rules: Rules, h: float, trial: _Trial) -> None:
    """Numerical dissipation of a step without W, by (5), and the energies dissipated along it."""
    sizes, counts, touching = motion.sizes, motion.counts, calls.touching(model)[0]
    work, changed = _along(model, motion, h, trial.x, 1)
    changed = changed or touching != counts[TOUCHING]
    counts[TOUCHING] = touching
    if changed:
        kinetic, parts, before = 0.5 * vectors.inner(trial.u, calls.mass_times(model, trial.u)), 1, math.inf
        while parts < rules.balances and abs(work - before) > _CLOSED * rules.rtol * kinetic:
            before, parts = work, 2 * parts
            work, _ = _along(model, motion, h, trial.x, parts)
    faster = vectors.subtracted(trial.u, motion.u)
    sizes[UNSEEN] = work - vectors.inner(vectors.moved(motion.u, 0.5, faster), calls.mass_times(model, faster))


@shared
def _along(model: Any, motion: Motion, h: float, x: np.ndarray, parts: int) -> tuple[float, bool]:
    """Work of all forces along a step without that of loads, from two Gauss points in each of equal parts, and whether the
    number of contacts with a force changes there. Writes the energies dissipated along the step.
    """
    sizes, of_pairs, changed = motion.sizes, motion.of_pairs, False
    mean, drive_force = vectors.scaled(1.0 / h, x), np.zeros(motion.drive_force.shape[0])
    of_pairs[:] = 0.0
    work = spent = 0.0
    for number in range(2 * parts):
        part = (number // 2 + (_EARLY if number % 2 == 0 else _LATE)) / parts
        t, q = sizes[TIME] + part * h, calls.retract(model, motion.q, vectors.scaled(part, x))
        work += vectors.inner(calls.force(model, t, q, mean), x)
        of_loads, of_dampers = calls.powers(model, t, q, mean, of_pairs, drive_force)
        work -= h * of_loads
        spent += h * of_dampers
        changed = changed or calls.touching(model)[0] != motion.counts[TOUCHING]
    motion.counts[FORCES] += 2 * parts
    sizes[SPENT] = 0.5 * spent / parts
    for row in range(2):
        for k in range(of_pairs.shape[1]):
            of_pairs[row, k] *= 0.5 * h / parts
            sizes[SPENT] -= of_pairs[row, k]
    return 0.5 * work / parts, changed


@shared
def _accept(model: Any, motion: Motion, rules: Rules, end: float, h: float, trial: _Trial, event: bool) -> None:
    sizes, counts = motion.sizes, motion.counts
    vectors.copy_into(vectors.slope_and_bend(trial.rate, motion.rate, motion.slope, h, h)[0], motion.slope)
    sizes[BEFORE], sizes[PRESENT], sizes[TIME] = h, h, end
    vectors.copy_into(trial.q, motion.q)
    vectors.copy_into(trial.u, motion.u)
    vectors.copy_into(trial.a, motion.a)
    vectors.copy_into(trial.rate, motion.rate)
    counts[STEPS] += 1
    sizes[LONGEST] = calls.accept(model, end, motion.q, motion.u)
    if event:
        counts[STARTED] = 0
    for b in rules.breaks:
        # multipliers jump with the accelerations of motors and drives
        if b == end and (calls.lock(model, 0.0) or _jumps(model, motion, rules)):
            counts[STARTED] = 0


@shared
def _jumps(model: Any, motion: Motion, rules: Rules) -> bool:
    """Whether the forces jump right after the present time, for example where a drive stops; a kink is no jump."""
    t = motion.sizes[TIME]
    motion.counts[FORCES] += 2
    after = calls.force(model, np.nextafter(t, math.inf), motion.q, motion.u)
    before = calls.force(model, np.nextafter(t, -math.inf), motion.q, motion.u)
    jump = calls.solve(model, vectors.subtracted(after, before))
    return mean_ratio(jump, rules.tolerance) > _NEWTON


# error ------------------------------------------------------------------------------------------------------------------


@shared
def _error(model: Any, motion: Motion, rules: Rules, h: float, trial: _Trial) -> float:
    """Ratio of the local error of x and u to the tolerance."""
    slope, bend = vectors.slope_and_bend(trial.rate, motion.rate, motion.slope, h, motion.sizes[BEFORE])
    filtered = inertial_factor(rules, h) * h**3
    error_x = calls.solve(model, vectors.scaled(rules.error_x * filtered, calls.mass_times(model, slope)))
    error_u = calls.solve(model, vectors.scaled(rules.error_u * filtered, calls.mass_times(model, bend)))
    return error_norm(error_x, error_u, rules.tolerance, rules.rtol, rules.velocity, motion.u, trial.u)


@shared
def _adapt(motion: Motion, rules: Rules, h: float, error: float, grow: bool) -> None:
    """Soderlind's PI controller (PI.4.2)."""
    sizes = motion.sizes
    error = max(error, 1e-8)
    factor = _SAFETY * error ** (-0.2) * sizes[LAST_ERROR] ** (1.0 / 15.0)
    sizes[LAST_ERROR] = error
    most = rules.growth if grow else 1.0
    free = h * factor
    factor = min(max(factor, _SHRINK), most)
    wanted = max(h * factor, min(h * most, rules.shortest))
    step_size = sizes[STEP_SIZE]
    # a step that is shortened to end at a given time does not reduce the size of later steps
    if grow and h < step_size and error * (step_size / h) ** 3 <= 1.0:
        wanted = max(wanted, step_size)
    # without numerical damping the growth limit is that of a steady step; then only the error decides whether the step
    # is kept
    possible = wanted if most > GROWTH_OF_STEADY_STEPS else max(wanted, free)
    if not (step_size <= wanted and possible <= GROWTH_OF_STEADY_STEPS * step_size) or not grow:
        sizes[STEP_SIZE] = min(wanted, sizes[MAX_STEP])


@shared
def _factorise(model: Any, motion: Motion, rules: Rules, h: float, x: np.ndarray, maps: bool) -> bool:
    motion.sizes[FACTORISED] = h
    motion.counts[FACTORISATIONS] += 1
    return calls.factorise(model, rules.gamma / (rules.beta * h), inertial_factor(rules, h), x, maps)


@shared
def inertial_factor(rules: Rules, h: float) -> float:
    """c_m = du'/dx, 1/s^2."""
    return (1.0 - rules.alpha_m) / ((1.0 - rules.alpha_f) * rules.beta * h * h)
