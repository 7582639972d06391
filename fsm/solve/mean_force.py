"""The energy-conserving mean-force method, step by step; see `fsm.stepping.mean_force` for the equations."""

from __future__ import annotations

import math

import numpy as np

from fsm.solve.array_steps import StepMethod
from fsm.solve.restart_points import State
from fsm.solve.status import Outcome, StepFailed
from fsm.solve.system_model import SystemModel
from fsm.stepping import mean_newton as stepping
from fsm.stepping.mean_force import BETWEEN, march_mean_force, march_mean_force_arrays, take_step
from fsm.stepping.mean_newton import MeanMotion, MeanRules
from fsm.stepping.outcomes import NO_SOLUTION, OBJECTED, STEPPED
from fsm.system import System

__all__ = ["MeanForce"]

_NEWTON, _LOOSEST = 1e-3, 1e-6
"""Tolerance of Newton's method relative to the scales and rtol, and the largest rtol for it. The residual does work in every
step: with 1e-4, a strip after an impact gained 5 % of its energy in 2640 steps (2026-11-23)."""
_EXACT = 1e-5
"""The same tolerance with error control: the residual does more work in longer steps."""
_SLOW, _SLOW_AND_EXACT = 0.7, 0.35
"""Ratio of successive corrections above which the tangent is evaluated again, for fixed steps and for error control. Two
tangents and their factorisation cost ten times as much as two forces. Error control has a tighter tolerance."""
_ROUND_OFF = 1e-13
"""Energy that counts as round-off, relative to the stored energy at the start, the work of the loads along the span, and the
kinetic energy at the speed of the drives. While a load begins to grow, all energies are far below this value."""


class MeanForce(StepMethod):
    """The mean-force method, step by step.

    Parameters
    ----------
    system : System
    t, q, u : time and state to start from
    rtol : -
    step : s
        Fixed step size. The step is reduced to divide the time to the next end time, and divided where steps need many
        iterations or do not conserve the energy. None: error control.
    max_step : s
        Largest step of error control.

    Attributes
    ----------
    t, q, u : present state
    work, dissipated : J
        Work and dissipated energy of the last step.
    of_pairs : (2, n_pairs) array, J
        Energy dissipated by every contact pair in the last step.
    drive_force : (n_drives,) array, N
        Mean force over the last step.
    steps, rejected, failed, iterations, force_evaluations, linearisations, factorisations : int
    """

    in_python, in_kernel = staticmethod(march_mean_force), staticmethod(march_mean_force_arrays)

    def __init__(
        self,
        system: System,
        t: float,
        q: np.ndarray,
        u: np.ndarray,
        rtol: float,
        step: float | None = None,
        max_step: float = math.inf,
    ) -> None:
        super().__init__(system, SystemModel(system, q), step is None)
        size, observed = system.scales().increment, system.observe(t, q, u)
        self.rules = MeanRules(
            rtol, (_NEWTON if step is not None else _EXACT) * min(rtol, _LOOSEST),
            _SLOW if step is not None else _SLOW_AND_EXACT, step or 0.0, system.shortest_step(), max_step,
            size, 1.0 / size**2, np.array(sorted(system.break_times()), dtype=float),
        )  # fmt: skip
        sizes, counts, pairs = np.zeros(15), np.zeros(9, dtype=np.int64), np.zeros((2, len(observed.pairs.force)))
        sizes[stepping.TIME], sizes[stepping.ERROR_BEFORE], sizes[stepping.COST] = t, 1.0, BETWEEN
        counts[stepping.DIVISION] = 1
        q, u = np.array(q, dtype=float), np.array(u, dtype=float)
        forces = np.zeros(len(observed.drive.force))
        self.motion = MeanMotion(
            q, u, u.copy(), u.copy(), np.zeros(len(u)), sizes, counts, pairs, pairs.copy(), forces
        )

    def step(self, until: float) -> None:
        """Take one step that ends at `until` or before.

        Raises
        ------
        StepFailed
            Newton's method does not converge, or the error is too large, even with the smallest step.
        """
        self._begin()
        # callers may store the arrays of the previous state, so new arrays are created
        motion = self.motion = self.motion._replace(q=self.motion.q.copy(), u=self.motion.u.copy())
        with np.errstate(all="ignore"):  # iterates may overflow before the step is rejected
            outcome = take_step(self.model, motion, self.rules, until)
        if outcome != STEPPED:
            raise self._failure(outcome)

    def march(self, balance: np.ndarray, until: float, most: int, every: bool = False) -> np.ndarray:
        """See `StepMethod`."""
        self._begin()
        self.motion.all_pairs[:] = 0.0
        records = super().march(balance, until, most, every)
        self.pair_energy = self.motion.all_pairs.copy()
        return records

    def _begin(self) -> None:
        """Store the energies of the initial state."""
        sizes = self.motion.sizes
        if sizes[stepping.LAST] == 0.0:
            energy = self.system.energy(self.t, self.q, self.u)
            sizes[stepping.START] = sizes[stepping.STORED] = energy.stored_except_driven
            sizes[stepping.TURNOVER] = energy.kinetic
            scales = self.system.scales()
            driven = 0.5 * float(scales.driven_velocity @ self.system.momentum(self.q, scales.driven_velocity))
            whole = sum(map(abs, energy.potential.values())) + scales.work + driven
            sizes[stepping.ROUND_OFF] = _ROUND_OFF * whole

    # state ----------------------------------------------------------------------------------------------------------

    @property
    def work(self) -> float:
        """Work in the last step, J."""
        return float(self.motion.sizes[stepping.WORK])

    @property
    def dissipated(self) -> float:
        """Energy dissipated in the last step, J."""
        return float(self.motion.sizes[stepping.DISSIPATED])

    @property
    def of_pairs(self) -> np.ndarray:
        """Energy dissipated by every contact pair in the last step, (2, n_pairs), J."""
        return self.motion.of_pairs.copy()

    @property
    def drive_force(self) -> np.ndarray:
        """Mean force of all drives over the last step, (n_drives,), N."""
        return self.motion.drive_force.copy()

    @property
    def factorisations(self) -> int:
        """Factorisations of matrices."""
        return int(self.motion.counts[stepping.FACTORISATIONS])

    # restart --------------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """State of the method for a restart, besides time, q and u."""
        motion = self.motion
        return {
            "mean": motion.mean.copy(),
            "mean_before": motion.mean_before.copy(),
            "rate": motion.rate.copy(),
            "sizes": motion.sizes.copy(),
            "counts": motion.counts.copy(),
        }

    def resume(self, state: State) -> None:
        """Continue from a restart point (see `state`)."""
        motion, t = self.motion, self.t
        motion.mean[:], motion.mean_before[:], motion.rate[:] = state["mean"], state["mean_before"], state["rate"]
        motion.sizes[:], motion.counts[:] = state["sizes"], state["counts"]
        motion.sizes[stepping.TIME], motion.sizes[stepping.FACTORED] = t, 0.0

    def _without_factors(self) -> None:
        self.motion.sizes[stepping.FACTORED] = 0.0

    def _failure(self, outcome: int) -> StepFailed:
        reason = self.model.reason if outcome == OBJECTED else ""
        ending = Outcome.NO_SOLUTION if outcome == NO_SOLUTION else Outcome.STEP_TOO_SMALL
        worst = self.system.worst_body(self.u / self.rules.size)
        return StepFailed(Outcome.TOO_SOFT if reason else ending, self.t, worst, reason)
