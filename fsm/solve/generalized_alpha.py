"""The generalized-alpha method on Lie groups, with error control: M u' = h(t, q, u), q' = T(q) u.

A step from t_n to t_{n+1} = t_n + h, with x the increment of the configuration [2, 3]:

    (1 - alpha_m) a_{n+1} + alpha_m a_n = (1 - alpha_f) u'_{n+1} + alpha_f u'_n                          (1)
    x = h u_n + (1/2 - beta) h^2 a_n + beta h^2 a_{n+1},   q_{n+1} = retract(q_n, x)                     (2)
    u_{n+1} = u_n + (1 - gamma) h a_n + gamma h a_{n+1}                                                  (3)
    M u'_{n+1} = h(t_{n+1}, q_{n+1}, u_{n+1})                                                            (4)

Newton's unknown is x; (1) to (3) give a, u and u' for it. Its matrix, for increments d at q_{n+1}, is

    S = K + (c_d D + c_m M) increment_map(x),   c_d = gamma/(beta h),   c_m = (1 - alpha_m)/((1 - alpha_f) beta h^2)

Choices:

* a_n belongs to t_n + (alpha_m - alpha_f) h, so a - u' grows with h: it is rescaled when h changes, which keeps order 2 [4].
* The local error is C h^3 times a derivative of u', taken from differences of u'. In modes too stiff to be resolved those
  differences are noise that moves nothing; S^-1 c_m M takes them out and leaves the others as they are.
* A step as short as the system's `shortest_step` is taken whatever its error. Shorter ones would follow waves that the mesh
  does not resolve; these are damped instead.
* M is constant, as it is for segments and ANCF, and taken once.

References
----------
[1] Chung, Hulbert, J. Appl. Mech. 60 (1993) 371-375. [2] Arnold, Bruls, Multibody Syst. Dyn. 18 (2007) 185-202.
[3] Bruls, Cardona, Arnold, Mech. Mach. Theory 48 (2012) 121-137. [4] Bruls, Arnold, J. Comput. Nonlin. Dyn. 3 (2008) 041007.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsm.blocks import BlockMatrix, BlockPattern
from fsm.errors import NotConverged
from fsm.kernels.block_sum import effective_stiffness
from fsm.solve.linear import LinearSolver
from fsm.solve.renewal import State
from fsm.solve.status import Outcome, StepFailed
from fsm.system import Linearised, System

__all__ = ["RHO_INF", "Coefficients", "GeneralizedAlpha"]

RHO_INF = 0.6
"""Spectral radius at infinity unless another is asked for."""

_NEWTON, _LOOSEST = 1e-2, 1e-3
"""Error left by Newton's method over the error allowed to a step, but no more than at this relative tolerance."""
_ITERATIONS, _PATIENT = 10, 50
"""Of Newton's method, and of its last try at a step that may not be cut: where films slacken and tauten the tangent jumps,
and corrections grow before they fall."""
_SLOW = 0.2
"""Contraction from which on the tangent is renewed."""
_SURE = 0.02
"""Contraction below which a measured one is not believed."""
_SAFETY = 0.9
_GROWTH, _SHRINK = 2.0, 0.2
_STEADY = 1.2
"""A step that could grow by less is kept, and the factorisation with it; no limit of growth is below."""
_HOP = 0.2
"""Correction of a prediction, over the span or in radians, that is not believed."""
_CUT = 0.25
"""Factor on a step whose equations were not solved."""
_FIRST = 1e-4
"""First step over the time to go, at most."""
_FLOOR_AT = 1e-6
"""Relative tolerance below which the system's shortest step falls, with its cube root as errors do."""
_FIRST_SHORTEST = 1e-2
"""First step over the system's shortest step, at most."""
_FINEST = 64
"""Parts, at most, of a fixed step whose equations were not solved."""
_SAME = 1e-9
"""Steps that differ by less, relatively, are the same."""
_SMALLEST = 16.0 * np.finfo(float).eps
"""Smallest step over the time reached."""


@dataclass(frozen=True)
class Coefficients:
    """Constants of the method for a spectral radius at infinity, [1] eqs. (25) to (27) and the local errors of (2) and (3).

    Attributes
    ----------
    alpha_m, alpha_f, beta, gamma : -
    shift : -
        a_n belongs to t_n + shift h.
    error_x, error_u : -
        Local errors error_x h^3 u'' of x and error_u h^3 u''' of u.
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    shift: float
    error_x: float
    error_u: float

    @classmethod
    def of(cls, rho_inf: float) -> Coefficients:
        """Those of a spectral radius at infinity, 0 (stiff modes vanish in a step) to 1 (they are kept)."""
        alpha_m, alpha_f = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0), rho_inf / (rho_inf + 1.0)
        return cls._with(alpha_m, alpha_f, 1.0 / (1.0 + rho_inf) ** 2, 0.5 * (3.0 - rho_inf) / (1.0 + rho_inf))

    @classmethod
    def newmark(cls) -> Coefficients:
        """Newmark's method of constant mean acceleration, beta = 1/4, gamma = 1/2: no numerical damping at all."""
        return cls._with(0.0, 0.0, 0.25, 0.5)

    @classmethod
    def _with(cls, alpha_m: float, alpha_f: float, beta: float, gamma: float) -> Coefficients:
        shift = alpha_m - alpha_f
        # a_n = u'(t_n + shift h) + lag h^2 u''' + ..., by Taylor's series in (1)
        lag = 0.5 * ((1.0 - alpha_f) - (1.0 - alpha_m) * (1.0 + shift) ** 2 - alpha_m * shift**2)
        error_u = 0.5 * ((1.0 - gamma) * shift**2 + gamma * (1.0 + shift) ** 2) + lag - 1.0 / 6.0
        return cls(alpha_m, alpha_f, beta, gamma, shift, 0.5 * shift + beta - 1.0 / 6.0, error_u)


@dataclass
class _Trial:
    """A step that is being solved for; `old_a` is a_n, rescaled to the size of this step."""

    t: float
    h: float
    old_a: np.ndarray
    x: np.ndarray
    q: np.ndarray
    u: np.ndarray
    a: np.ndarray
    rate: np.ndarray


class GeneralizedAlpha:
    """The method as an object that goes step by step.

    Parameters
    ----------
    system : System
    t, q, u : time and state to start from
    rtol : -
        The local error of a step, root mean square over all components: rtol times the system's scales for increments,
        rtol times scales and size for velocities.
    rho_inf : -
        Spectral radius at infinity; None: Newmark's method.
    fixed_step : s
        Steps of this size, or the next smaller that divides the way to the next time that is to be hit, whatever the
        error; down to a 64th where equations are not solved. None: the error is controlled.
    max_step : s

    Attributes
    ----------
    t, q, u : present state
    rate, a : (nu,) arrays
        u' and the algorithmic acceleration.
    step_size : s
        Taken next, unless a time that has to be hit comes first.
    steps, rejected, failed : int
        Steps done; steps repeated because of their error, and because their equations were not solved.
    iterations, force_evaluations, linearisations : int
    linear : LinearSolver
    """

    def __init__(
        self,
        system: System,
        t: float,
        q: np.ndarray,
        u: np.ndarray,
        rtol: float,
        rho_inf: float | None = RHO_INF,
        fixed_step: float | None = None,
        max_step: float = math.inf,
    ) -> None:
        self.system = system
        self.t, self.q, self.u = t, q.copy(), u.copy()
        self.fixed_step, self.max_step = fixed_step, max_step
        self.coefficients = Coefficients.newmark() if rho_inf is None else Coefficients.of(rho_inf)
        # h u of modes too stiff to be resolved falls by rho_inf a step: with faster growth their u would rise
        self._growth = max(_STEADY, min(_GROWTH, 1.0 / max(1.0 if rho_inf is None else rho_inf, 1.0 / _GROWTH)))
        self.linear = LinearSolver()
        self.steps = self.rejected = self.failed = 0
        self.iterations = self.force_evaluations = self.linearisations = 0
        scales = system.scales()
        self._rtol, self._velocity = rtol, scales.velocity
        self._newton_tolerance = _NEWTON * min(1.0, _LOOSEST / rtol)
        self._increment, self._tolerance = scales.increment, rtol * scales.increment
        # Newton's method resolves more where forces need it; steps do not
        self._resolved = np.minimum(self._tolerance, scales.resolution / self._newton_tolerance)
        self._span = scales.span
        self._mass = system.mass(q)
        self._breaks = sorted(system.break_times())
        self._pattern: BlockPattern | None = None
        self._inertia = np.zeros((0, 0, 0))
        self._linear: Linearised | None = None
        self._map: np.ndarray | None = None
        self._size = 0.0
        self._contraction = 1.0
        self._last_error = 1.0
        self._started = self._slow = False
        self.step_size = 0.0
        self.rate = self.a = np.zeros_like(u)
        self._slope = np.zeros_like(u)
        self._before = self._present = 0.0
        self._longest = math.inf
        self._shortest = min(1.0, rtol / _FLOOR_AT) ** (1.0 / 3.0) * system.shortest_step()
        self._division = 1

    def step(self, until: float) -> None:
        """One step, that ends at `until` or before.

        Raises
        ------
        StepFailed
            The equations of even the smallest step have no solution that Newton's method finds, or its error is too large.
        """
        if not self._started:
            self._start(until)
        target = min([until, *(b for b in self._breaks if b > self.t)])
        grow = True
        while True:
            h, end = self._next_size(target)
            if not end > self.t:
                raise self._failure(Outcome.STEP_TOO_SMALL)
            trial = self._solve(end, h)
            if self.fixed_step is not None:
                if trial is not None:
                    self._division = max(1, self._division // 2)
                    break
                self.failed += 1
                self._division *= 2
                if self._division > _FINEST:
                    raise self._failure(Outcome.NO_SOLUTION)
                continue
            objection = None
            if trial is None:
                self.failed += 1
                self.step_size = _CUT * h
            else:
                error = self._error(trial)
                small = error <= 1.0 or h <= self._shortest
                objection = self.system.objection(trial.t, trial.q, trial.u, h) if small else None
                if small and objection is None:
                    self._adapt(h, error, grow)
                    break
                self.rejected += 1
                if objection is None:
                    self.step_size = max(h * max(_SHRINK, _SAFETY * error ** (-1.0 / 3.0)), min(h, self._shortest))
                else:
                    self.step_size = h * objection.part
            grow = False
            if self.step_size < _SMALLEST * max(abs(self.t), until - self.t):
                reason = objection.reason if objection is not None else ""
                outcome = Outcome.TOO_SOFT if reason else Outcome.STEP_TOO_SMALL
                raise self._failure(Outcome.NO_SOLUTION if trial is None else outcome, reason)
        self._accept(trial)

    # renewal ------------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """What another object goes on with from the present time, q and u."""
        sizes = (
            self.step_size, self.max_step, self._present, self._before, self._last_error, self._longest, self._division,
        )  # fmt: skip
        counts = (
            self.steps, self.rejected, self.failed, self.iterations, self.force_evaluations, self.linearisations,
            self.linear.factorisations,
        )  # fmt: skip
        return {
            "rate": self.rate,
            "a": self.a,
            "slope": self._slope,
            "sizes": np.array(sizes),
            "counts": np.array([*counts, self._started]),
        }

    def go_on(self, state: State) -> None:
        """Go on with what `state` gave, and a tangent at the present state."""
        self.rate, self.a, self._slope = state["rate"], state["a"], state["slope"]
        self.step_size, self.max_step, self._present, self._before, self._last_error, self._longest, division = (
            state["sizes"].tolist()
        )
        self._division = int(division)
        counts = [int(count) for count in state["counts"]]
        self.steps, self.rejected, self.failed, self.iterations, self.force_evaluations, self.linearisations = counts[:6]
        self.linear.factorisations = counts[6]
        self._started = bool(counts[7])
        if self._started:
            self._linearise(self.t, self.q, self.u)
            self._factorise(self._present, None)

    # start ----------------------------------------------------------------------------------------------------------

    def _start(self, until: float) -> None:
        """u' and a as they are right after the present time; needed again wherever the forces jump."""
        # drives that stop at this very time have stopped right after it
        t = math.nextafter(self.t, math.inf)
        linear = self._linearise(t, self.q, self.u)
        pattern = self._pattern
        assert pattern is not None
        self.linear.factorise(BlockMatrix(pattern, self._inertia))
        self.rate = self.linear.solve(linear.force)
        if self.step_size == 0.0:
            self.step_size = self._first_size(until - self.t)
        h = self.step_size
        self._factorise(h, None)
        self.force_evaluations += 1
        ahead = 1e-3 * h
        change = (self.system.force(t + ahead, self.q, self.u) - linear.force) / ahead
        change -= linear.stiffness.bsr() @ self.u + linear.damping.bsr() @ self.rate
        # u'' = M^-1 change; S in place of M differs by O(h), and stiff modes that the start is not at rest in do not explode
        self._slope = self.linear.solve(_inertial(self.coefficients, h) * change)
        self.a = self.rate + self.coefficients.shift * h * self._slope
        self._present, self._before = h, 0.0
        self._contraction, self._last_error = 1.0, 1.0
        self._longest = self.system.longest_step(self.t, self.q, self.u)
        self._started = True

    def _first_size(self, left: float) -> float:
        if self.fixed_step is not None:
            return self.fixed_step
        # changes of u and q over the step a part rtol^(1/3) of their scales: h^3 is what errors grow with
        pace = max(_rms(self.rate / self._velocity), _rms(self.u / self._increment))
        # u' of modes too fast for the shortest step may be far from equilibrium, and a long step moves them by h^2 u'
        least = _FIRST_SHORTEST * self._shortest if self._shortest > 0.0 else math.inf
        return min(_FIRST * left, self._rtol ** (1.0 / 3.0) / pace if pace > 0.0 else math.inf, self.max_step, least)

    # steps ----------------------------------------------------------------------------------------------------------

    def _next_size(self, target: float) -> tuple[float, float]:
        """Size and end of the next step; `target` is hit exactly, without a tiny step before it."""
        left = target - self.t
        h = min(self.step_size, self.max_step, self._longest)
        if self.fixed_step is not None:
            h = self.fixed_step / self._division
        count = math.ceil(left / h * (1.0 - 1e-9))
        if count <= 1:
            return self._same(left), target
        if count == 2 or self.fixed_step is not None:
            h = self._same(left / count)
        return h, self.t + h

    def _same(self, h: float) -> float:
        """The step before, if this one differs by round-off of the times alone: its factorisation serves on."""
        return self._present if abs(h - self._present) <= _SAME * h else h

    def _solve(self, end: float, h: float) -> _Trial | None:
        """A step with the tangent at hand if that was good, and with a new one if it does not do; None if neither does."""
        with np.errstate(all="ignore"):  # iterates may go anywhere before they are given up
            try:
                kept = None if self._slow else self._newton(end, h, False)
                return kept or self._newton(end, h, True)
            except NotConverged:  # a singular matrix
                return None

    def _newton(self, end: float, h: float, renew: bool) -> _Trial | None:
        """Newton's method for one step; None if it does not converge."""
        trial = self._predict(end, h)
        c = self.coefficients
        by_u, by_rate = c.gamma / (c.beta * h), _inertial(c, h)
        weight = 1.0 / np.minimum(self._resolved, (self._rtol / by_u) * (self._velocity + np.abs(self.u)))
        before, fresh, predicted = math.inf, renew, trial.x
        last = fresh and self.fixed_step is not None
        for iteration in range(_PATIENT if last else _ITERATIONS):
            if renew:
                force = self._linearise(end, trial.q, trial.u).force
                self._factorise(h, trial.x)
            else:
                if h != self._size:  # the step before was cut short
                    self._factorise(h, trial.x)
                force = self.system.force(end, trial.q, trial.u)
                self.force_evaluations += 1
            self.iterations += 1
            change = self.linear.solve(force - self._mass @ trial.rate)
            size = _rms(change * weight)
            if not math.isfinite(size):
                return None
            self._move(trial, _mapped(self._map, change), by_u, by_rate)
            if iteration:
                contraction = size / before if before > 0.0 else 0.0
                # stiff springs that turn are stretched by the first correction, and set right by the second
                if contraction > 2.0 and not last and (not fresh or iteration > 1):
                    return None
                self._contraction = contraction
                self._slow = contraction > _SLOW
            elif renew or h != self._present:
                # nothing is known of this matrix
                self._contraction = 1.0
            left = max(self._contraction, _SURE) / max(1.0 - self._contraction, 1e-3)
            converged = size * left <= self._newton_tolerance or size <= 1e-3 * self._newton_tolerance
            if converged and not renew and self.system.parted():
                renew, before = True, size
                continue
            if converged:
                # a correction as long as the structure has found some other root
                hopped = np.abs((trial.x - predicted) / self._span).max(initial=0.0) > _HOP
                return None if hopped and self.fixed_step is None else trial
            renew = iteration > 0 and self._slow
            before = size
        return None

    def _predict(self, end: float, h: float) -> _Trial:
        """The step with u' going on as it did."""
        c = self.coefficients
        old_a = self.a
        if h != self._present:
            # a - u' grows with h; in modes too stiff to be resolved it is no derivative, and growing it would excite them
            self._factorise(h, None)
            growth = h / self._present - 1.0
            old_a = old_a + self.linear.solve(growth * _inertial(c, h) * (self._mass @ (self.a - self.rate)))
        rate = self.rate + h * self._slope
        a = ((1.0 - c.alpha_f) * rate + c.alpha_f * self.rate - c.alpha_m * old_a) / (1.0 - c.alpha_m)
        x = h * self.u + h * h * ((0.5 - c.beta) * old_a + c.beta * a)
        u = self.u + h * ((1.0 - c.gamma) * old_a + c.gamma * a)
        return _Trial(end, h, old_a, x, self.system.retract(self.q, x), u, a, rate)

    def _move(self, trial: _Trial, dx: np.ndarray, by_u: float, by_rate: float) -> None:
        trial.x = trial.x + dx
        trial.q = self.system.retract(self.q, trial.x)
        trial.u = trial.u + by_u * dx
        trial.a = trial.a + dx / (self.coefficients.beta * trial.h**2)
        trial.rate = trial.rate + by_rate * dx

    def _accept(self, trial: _Trial) -> None:
        self._slope = (trial.rate - self.rate) / trial.h
        self._before, self._present = trial.h, trial.h
        self.t, self.q, self.u, self.a, self.rate = trial.t, trial.q, trial.u, trial.a, trial.rate
        self.steps += 1
        self.system.commit(self.t, self.q, self.u)
        self._longest = self.system.longest_step(self.t, self.q, self.u)
        if self.t in self._breaks and self._jumps():
            self._started = False

    def _jumps(self) -> bool:
        """Whether the forces jump right after the present time, as where a drive stops; kinks need no new start."""
        self.force_evaluations += 2
        after = self.system.force(math.nextafter(self.t, math.inf), self.q, self.u)
        jump = self.linear.solve(after - self.system.force(self.t, self.q, self.u))
        return _rms(jump / self._tolerance) > _NEWTON

    # error ----------------------------------------------------------------------------------------------------------

    def _error(self, trial: _Trial) -> float:
        """Local error of x and u over what is allowed."""
        c, h = self.coefficients, trial.h
        slope = (trial.rate - self.rate) / h
        bend = 2.0 * (slope - self._slope) / (h + self._before)
        filtered = _inertial(c, h) * h**3
        error_x = self.linear.solve(c.error_x * filtered * (self._mass @ slope))
        error_u = self.linear.solve(c.error_u * filtered * (self._mass @ bend))
        size = np.maximum(np.abs(self.u), np.abs(trial.u))
        parts = error_x / self._tolerance, error_u / (self._rtol * (self._velocity + size))
        return math.sqrt(0.5 * (_rms(parts[0]) ** 2 + _rms(parts[1]) ** 2))

    def _adapt(self, h: float, error: float, grow: bool) -> None:
        """Soderlind's PI controller (PI.4.2)."""
        error = max(error, 1e-8)
        factor = _SAFETY * error ** (-0.2) * self._last_error ** (1.0 / 15.0)
        self._last_error = error
        most = self._growth if grow else 1.0
        factor = min(max(factor, _SHRINK), most)
        wanted = max(h * factor, min(h * most, self._shortest))
        # a step cut short by a time that had to be hit says nothing against the size before it
        if grow and h < self.step_size and error * (self.step_size / h) ** 3 <= 1.0:
            wanted = max(wanted, self.step_size)
        if not self.step_size <= wanted <= _STEADY * self.step_size or not grow:
            self.step_size = min(wanted, self.max_step)

    # matrices -------------------------------------------------------------------------------------------------------

    def _linearise(self, t: float, q: np.ndarray, u: np.ndarray) -> Linearised:
        self.linearisations += 1
        self._linear = linear = self.system.linearise(t, q, u)
        if linear.stiffness.pattern is not self._pattern:
            self._pattern = linear.stiffness.pattern
            self._inertia = self.system.inertia(q, self._pattern)
        return linear

    def _factorise(self, h: float, x: np.ndarray | None) -> None:
        linear = self._linear
        assert linear is not None and self._pattern is not None
        c = self.coefficients
        moving = c.gamma / (c.beta * h) * linear.damping.data + _inertial(c, h) * self._inertia
        self._map = None if x is None else self.system.increment_map(x)
        data = effective_stiffness(linear.stiffness.data, moving, 1.0, self._map, self._pattern.indices)
        self.linear.factorise(BlockMatrix(self._pattern, data))
        self._size = h

    def _failure(self, outcome: Outcome, reason: str = "") -> StepFailed:
        return StepFailed(outcome, self.t, self.system.blame(self.rate / self._velocity), reason)


def _inertial(c: Coefficients, h: float) -> float:
    """c_m = du'/dx, 1/s^2."""
    return (1.0 - c.alpha_m) / ((1.0 - c.alpha_f) * c.beta * h * h)


def _mapped(blocks: np.ndarray | None, change: np.ndarray) -> np.ndarray:
    """The change of x that an increment at the end of it amounts to."""
    if blocks is None:
        return change
    return np.asarray(blocks @ change.reshape(len(blocks), -1, 1)).ravel()


def _rms(vector: np.ndarray) -> float:
    return math.sqrt(float(vector @ vector) / len(vector)) if len(vector) else 0.0
