"""The generalized-alpha method, step by step; see `fsm.solve.stepping.generalized_alpha` for the equations."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsm.solve.interface.records import Observation
from fsm.solve.interface.system import System
from fsm.solve.outcome.restart_points import State
from fsm.solve.settings import RHO_INF
from fsm.solve.stepping import generalized_alpha as stepping
from fsm.solve.stepping.generalized_alpha import Motion, Rules, take_step
from fsm.solve.stepping.march import march, march_arrays
from fsm.solve.time.array_steps import StepMethod

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
    first : Observation, optional
        Observation of the state to start from, for runs with an energy balance: steps compute their numerical dissipation.
    parts : -
        Largest number of parts of a step in which contacts begin or end, for its energies.
    """

    one_step, in_python, in_kernel = staticmethod(take_step), staticmethod(march), staticmethod(march_arrays)
    following = stepping.STEP_SIZE
    kept = "rate", "a", "slope", "sizes", "counts"

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
        first: Observation | None = None,
        parts: int = 8,
    ) -> None:
        still, sizes, counts = np.zeros(len(u)), np.zeros(11), np.zeros(12, dtype=np.int64)
        sizes[stepping.MAX_STEP], sizes[stepping.LONGEST] = max_step, math.inf
        sizes[stepping.CONTRACTION] = sizes[stepping.LAST_ERROR] = 1.0
        q, u = np.array(q, dtype=float), np.array(u, dtype=float)
        pairs, drives = (0, 0) if first is None else (len(first.pairs.force), len(first.drive.force))
        of_pairs = np.zeros((2, pairs))
        motion = Motion(
            q, u, still, still.copy(), still.copy(), sizes, counts, of_pairs, of_pairs.copy(), np.zeros(drives)
        )
        super().__init__(system, t, q, motion, fixed_step is None)
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
            min(1.0, rtol / _FLOOR_AT) ** (1.0 / 3.0) * system.shortest_step(),
            0.0 if first is None else float(parts), tolerance,
            # the tolerance of Newton's method is tighter where forces require it; the tolerance of steps is not
            np.minimum(tolerance, scales.resolution / newton), scales.velocity, scales.increment, scales.span,
            np.array(sorted(system.break_times()), dtype=float),
        )  # fmt: skip

    @property
    def max_step(self) -> float:
        """Largest step, s."""
        return float(self.motion.sizes[stepping.MAX_STEP])

    @max_step.setter
    def max_step(self, size: float) -> None:
        self.motion.sizes[stepping.MAX_STEP] = size

    @property
    def _pace(self) -> np.ndarray:
        return np.asarray(self.motion.rate / self.rules.velocity)

    def resume(self, state: State) -> None:
        """See `StepMethod`."""
        super().resume(state)
        self.motion.sizes[stepping.CONTRACTION], self.motion.counts[stepping.SLOW] = 1.0, 0

    def _without_factors(self) -> None:
        self.motion.counts[stepping.TANGENT] = 0
