"""The energy-conserving mean-force method, step by step; see `fsm.solve.stepping.mean_force` for the equations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fsm.solve.interface.records import DriveState, Observation
from fsm.solve.interface.system import System
from fsm.solve.stepping import mean_newton as stepping
from fsm.solve.stepping.mean_force import BETWEEN, march_mean_force, march_mean_force_arrays, take_step
from fsm.solve.stepping.mean_newton import MeanMotion, MeanRules
from fsm.solve.time.array_steps import StepMethod

_NEWTON, _LOOSEST = 1e-3, 1e-6
"""Tolerance of Newton's method relative to the scales and rtol, and the largest rtol for it. The residual does work in every
step: with 1e-4, a strip after an impact gained 5 % of its energy in 2640 steps (2026-11-23)."""
_EXACT = 1e-5
"""The same tolerance with error control: the residual does more work in longer steps."""
_SLOW, _SLOW_AND_EXACT = 0.7, 0.6
"""Ratio of successive corrections above which the tangent is evaluated again, for fixed steps and for error control. Two
tangents and their factorisation cost ten times as much as two forces. Error control has a tighter tolerance."""
_ROUND_OFF = 1e-13
"""Energy that counts as round-off, relative to the stored energy at the start, the work of the loads along the span, and the
kinetic energy at the speed of the drives, with ideal joints at the scales of velocities. While a load begins to
grow, all energies are far below this value."""


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
    """

    one_step, in_python = staticmethod(take_step), staticmethod(march_mean_force)
    in_kernel = staticmethod(march_mean_force_arrays)
    following = stepping.NEXT
    kept = "u", "consistent", "mean", "mean_before", "rate", "sizes", "counts"

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
        size, observed = system.scales().increment, system.observe(t, q, u)
        self.rules = MeanRules(
            rtol, (_NEWTON if step is not None else _EXACT) * min(rtol, _LOOSEST),
            _SLOW if step is not None else _SLOW_AND_EXACT, step or 0.0, system.shortest_step(), max_step,
            size, 1.0 / size**2, np.array(sorted(system.break_times()), dtype=float),
        )  # fmt: skip
        sizes, counts, pairs = np.zeros(16), np.zeros(9, dtype=np.int64), np.zeros((2, len(observed.pairs.force)))
        sizes[stepping.ERROR_BEFORE], sizes[stepping.COST] = 1.0, BETWEEN
        q, u = np.array(q, dtype=float), np.array(u, dtype=float)
        forces = np.zeros(len(observed.drive.force))
        motion = MeanMotion(
            q, u, u.copy(), u.copy(), u.copy(), np.zeros(len(u)), sizes, counts, pairs, pairs.copy(), forces
        )
        super().__init__(system, t, q, motion, step is None)

    def _begin(self) -> None:
        """See `StepMethod`; before the first step, energies of the initial state are stored too."""
        super()._begin()
        self.motion = self.motion._replace(consistent=self.motion.consistent.copy())
        sizes = self.motion.sizes
        if sizes[stepping.LAST] == 0.0:
            energy = self.system.energy(self.t, self.q, self.u)
            sizes[stepping.START] = sizes[stepping.STORED] = energy.stored_except_driven
            sizes[stepping.TURNOVER] = energy.kinetic
            scales = self.system.scales()
            driven = 0.5 * float(scales.driven_velocity @ self.system.momentum(self.q, scales.driven_velocity))
            if self.system.lock(0.0):  # motors of joints also start from rest without any energy
                driven += 0.5 * float(scales.velocity @ self.system.momentum(self.q, scales.velocity))
            whole = sum(map(abs, energy.potential.values())) + scales.work + driven
            sizes[stepping.ROUND_OFF] = _ROUND_OFF * whole

    @property
    def u(self) -> np.ndarray:
        """Present velocity, (nu,), at which no locked direction opens."""
        return np.asarray(self.motion.consistent)

    def observe(self) -> Observation:
        """Quantities of the present state; forces of drives are means over the last step."""
        observed = super().observe()
        if not self.steps:
            return observed
        return replace(observed, drive=DriveState(observed.drive.travel, self.motion.drive_force.copy()))

    @property
    def _pace(self) -> np.ndarray:
        return np.asarray(self.u / self.rules.size)

    def _without_factors(self) -> None:
        self.motion.sizes[stepping.FACTORED] = 0.0
