"""Settings of time integration."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fsm.solve.generalized_alpha import RHO_INF

__all__ = ["Settings"]


@dataclass(frozen=True)
class Settings:
    """Settings of time integration; see `fsm.scene.case.Solve`.

    Attributes
    ----------
    method : "Radau", "Radau-blocks", "BDF", "LSODA", "generalized-alpha", "newmark" or "mean-force"
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
