"""Settings of time integration and of quasi-static paths."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsm.solve.interface.records import DriveState
from fsm.solve.outcome.energy_balance import JUDGED_FROM

RHO_INF = 0.6
"""Default spectral radius of generalized-alpha at infinite frequency."""


@dataclass(frozen=True)
class Settings:
    """Settings of time integration; see `fsm.case.models.case.Solve`.

    Attributes
    ----------
    method : "Radau", "Radau-blocks", "BDF", "LSODA", "generalized-alpha", "newmark", "mean-force" or "explicit"
    rtol : -
    end_time, max_step : s
    max_steps : int
    energy_abort : -
    judge_losses : bool
        Whether `energy_abort` also bounds losses of energy; numerical damping dissipates motion too fast for the steps.
    start_time : s
        Start of the step of the run, which may be before that of a resumed solve.
    rho_inf, step : -, s
        Generalized-alpha only: spectral radius at infinite frequency. Stepwise methods: fixed step; None: error control.
    """

    method: str
    rtol: float
    end_time: float
    max_step: float = math.inf
    max_steps: int = 200_000
    energy_abort: float = math.inf
    rho_inf: float = RHO_INF
    step: float | None = None
    judge_losses: bool = True
    start_time: float = 0.0


@dataclass(frozen=True)
class PathSettings:
    """Settings of quasi-static path following.

    Attributes
    ----------
    end_time : s
    first_step, max_step : s
    rtol : -
        Predictor tolerance: sqrt(rtol) times the structure's span (rotations: rad); it sets the step size.
    max_steps : int
    imperfection : -
        Sign of the critical mode (largest component positive) along which the path continues after a bifurcation.
        Zero: the side of lower energy.
    energy_abort : -
        Energy error over the reference energy at which the solve stops, after a tenth of the time.
    start_time : s
        Start of the step of the run, which may be before that of a resumed solve.
    force_limit : N
        Magnitude of the force of the first drive at which the path ends.
    """

    end_time: float
    first_step: float
    max_step: float = math.inf
    rtol: float = 1e-4
    max_steps: int = 200_000
    imperfection: float = 0.0
    energy_abort: float = math.inf
    start_time: float = 0.0
    force_limit: float = math.inf

    def force_ratio(self, drive: DriveState) -> float:
        """Magnitude of the force of the first drive over its limit; 0 without a limit or a drive."""
        return float(np.abs(drive.force[:1]).max(initial=0.0)) / self.force_limit

    @property
    def judged_from(self) -> float:
        """Time from which an energy error stops the solve, s."""
        return self.start_time + JUDGED_FROM * (self.end_time - self.start_time)
