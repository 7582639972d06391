"""The generalized-alpha method, step by step; see `fsm.stepping.generalized_alpha` for the equations."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsm.solve.array_steps import StepMethod
from fsm.solve.restart_points import State
from fsm.solve.settings import RHO_INF
from fsm.solve.status import Outcome, StepFailed
from fsm.solve.system_model import SystemModel
from fsm.stepping import generalized_alpha as stepping
from fsm.stepping.generalized_alpha import Motion, Rules, take_step
from fsm.stepping.march import march, march_arrays
from fsm.stepping.outcomes import NO_SOLUTION, OBJECTED, STEPPED
from fsm.system import System

__all__ = ["Coefficients", "GeneralizedAlpha"]

_NEWTON, _LOOSEST = 1e-2, 1e-3
"""Tolerance of Newton's method relative to the tolerance of a step, and the largest relative tolerance for it."""
_GROWTH = 2.0
_FLOOR_AT = 1e-6
"""Relative tolerance below which the system's shortest step decreases, with its cube root."""


@dataclass(frozen=True)
class Coefficients:
    """Constants of the method for a spectral radius at infinity (Chung and Hulbert 1993, eqs. 25 to 27), and local errors.

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
        """Constants for a spectral radius at infinite frequency, from 0 (most damping) to 1 (no numerical damping)."""
        alpha_m, alpha_f = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0), rho_inf / (rho_inf + 1.0)
        return cls._with(alpha_m, alpha_f, 1.0 / (1.0 + rho_inf) ** 2, 0.5 * (3.0 - rho_inf) / (1.0 + rho_inf))

    @classmethod
    def newmark(cls) -> Coefficients:
        """Newmark's method of constant mean acceleration, beta = 1/4, gamma = 1/2, without numerical damping."""
        return cls._with(0.0, 0.0, 0.25, 0.5)

    @classmethod
    def _with(cls, alpha_m: float, alpha_f: float, beta: float, gamma: float) -> Coefficients:
        shift = alpha_m - alpha_f
        # a_n = u'(t_n + shift h) + lag h^2 u''' + ..., by Taylor's series in (1)
        lag = 0.5 * ((1.0 - alpha_f) - (1.0 - alpha_m) * (1.0 + shift) ** 2 - alpha_m * shift**2)
        error_u = 0.5 * ((1.0 - gamma) * shift**2 + gamma * (1.0 + shift) ** 2) + lag - 1.0 / 6.0
        return cls(alpha_m, alpha_f, beta, gamma, shift, 0.5 * shift + beta - 1.0 / 6.0, error_u)


class GeneralizedAlpha(StepMethod):
    """The generalized-alpha method, step by step.

    Parameters
    ----------
    system : System
    t, q, u : time and state to start from
    rtol : -
        Bound of the local error of a step, root mean square over all components, relative to the system's scales; of
        velocities relative to scales and size.
    rho_inf : -
        Spectral radius at infinite frequency; None: Newmark's method.
    fixed_step : s
        Fixed step size, reduced to divide the time to the next end time, and down to a 64th if Newton's method does not
        converge. None: error control.
    max_step : s

    Attributes
    ----------
    t, q, u : present state
    rate, a : (nu,) arrays
        u' and the algorithmic acceleration.
    step_size : s
        Size of the next step, unless a given end time is earlier.
    steps, rejected, failed : int
        Steps taken; steps repeated because of the error, and because Newton's method did not converge.
    iterations, force_evaluations, linearisations, factorisations : int
    pair_energy : (2, n_pairs) array, J
        Energy that friction and damping of contact pairs dissipated in the last `march`.
    """

    in_python, in_kernel = staticmethod(march), staticmethod(march_arrays)

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
        super().__init__(system, SystemModel(system, q), fixed_step is None)
        self.coefficients = c = Coefficients.newmark() if rho_inf is None else Coefficients.of(rho_inf)
        # in modes that are too stiff for the step, h u decreases by the factor rho_inf in a step; if h grew faster, u of
        # these modes would increase
        fastest = 1.0 / max(1.0 if rho_inf is None else rho_inf, 1.0 / _GROWTH)
        growth = max(stepping.GROWTH_OF_STEADY_STEPS, min(_GROWTH, fastest))
        newton = _NEWTON * min(1.0, _LOOSEST / rtol)
        scales = system.scales()
        tolerance = rtol * scales.increment
        self.rules = Rules(
            c.alpha_m, c.alpha_f, c.beta, c.gamma, c.shift, c.error_x, c.error_u, rtol, newton, growth, fixed_step or 0.0,
            min(1.0, rtol / _FLOOR_AT) ** (1.0 / 3.0) * system.shortest_step(), tolerance,
            # the tolerance of Newton's method is tighter where forces require it; the tolerance of steps is not
            np.minimum(tolerance, scales.resolution / newton), scales.velocity, scales.increment, scales.span,
            np.array(sorted(system.break_times()), dtype=float),
        )  # fmt: skip
        still, sizes, counts = np.zeros(len(u)), np.zeros(9), np.zeros(11, dtype=np.int64)
        q, u = np.array(q, dtype=float), np.array(u, dtype=float)
        self.motion = Motion(q, u, still, still.copy(), still.copy(), sizes, counts)
        sizes[stepping.TIME], sizes[stepping.MAX_STEP], sizes[stepping.LONGEST] = t, max_step, math.inf
        sizes[stepping.CONTRACTION] = sizes[stepping.LAST_ERROR] = 1.0
        counts[stepping.DIVISION] = 1

    def step(self, until: float) -> None:
        """Take one step that ends at `until` or before.

        Raises
        ------
        StepFailed
            Newton's method does not converge, or the error is too large, even with the smallest step.
        """
        # callers may store the arrays of the previous state, so new arrays are created
        motion = self.motion = self.motion._replace(q=self.motion.q.copy(), u=self.motion.u.copy())
        with np.errstate(all="ignore"):  # iterates may overflow before the step is rejected
            outcome = take_step(self.model, motion, self.rules, until)
        if outcome != STEPPED:
            raise self._failure(outcome)

    # state ----------------------------------------------------------------------------------------------------------

    @property
    def rate(self) -> np.ndarray:
        """u', (nu,)."""
        return self.motion.rate

    @property
    def a(self) -> np.ndarray:
        """Algorithmic acceleration, (nu,)."""
        return self.motion.a

    @property
    def step_size(self) -> float:
        """Size of the next step, s, unless a given end time is earlier."""
        return float(self.motion.sizes[stepping.STEP_SIZE])

    @step_size.setter
    def step_size(self, size: float) -> None:
        self.motion.sizes[stepping.STEP_SIZE] = size

    @property
    def max_step(self) -> float:
        """Largest step, s."""
        return float(self.motion.sizes[stepping.MAX_STEP])

    @max_step.setter
    def max_step(self, size: float) -> None:
        self.motion.sizes[stepping.MAX_STEP] = size

    @property
    def factorisations(self) -> int:
        """Factorisations of matrices."""
        return int(self.motion.counts[stepping.FACTORISATIONS])

    # restart ------------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """State of the method for a restart, besides time, q and u."""
        motion = self.motion
        return {
            "rate": motion.rate.copy(),
            "a": motion.a.copy(),
            "slope": motion.slope.copy(),
            "sizes": motion.sizes.copy(),
            "counts": motion.counts.copy(),
        }

    def resume(self, state: State) -> None:
        """Continue from a restart point (see `state`), with a tangent at the present state."""
        motion, t = self.motion, self.t
        motion.rate[:], motion.a[:], motion.slope[:] = state["rate"], state["a"], state["slope"]
        motion.sizes[:], motion.counts[:] = state["sizes"], state["counts"]
        motion.sizes[stepping.TIME], motion.sizes[stepping.CONTRACTION] = t, 1.0
        motion.counts[stepping.SLOW] = motion.counts[stepping.TANGENT] = 0

    def _without_factors(self) -> None:
        self.motion.counts[stepping.TANGENT] = 0

    def _failure(self, outcome: int) -> StepFailed:
        reason = self.model.reason if outcome == OBJECTED else ""
        ending = Outcome.NO_SOLUTION if outcome == NO_SOLUTION else Outcome.STEP_TOO_SMALL
        worst = self.system.worst_body(self.rate / self.rules.velocity)
        return StepFailed(Outcome.TOO_SOFT if reason else ending, self.t, worst, reason)
