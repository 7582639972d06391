"""How to step a system through time."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fsm.solve.generalized_alpha import RHO_INF

__all__ = ["Settings"]


@dataclass(frozen=True)
class Settings:
    """How to integrate; see `fsm.scene.case.Solve`.

    Attributes
    ----------
    method : "Radau", "Radau-blocks", "BDF", "LSODA", "generalized-alpha", "newmark" or "mean-force"
    rtol : -
    end_time, max_step : s
    max_steps : int
    energy_abort : -
    judge_losses : bool
        Whether lost energy counts for that, too: numerical damping takes that of motion too fast for the steps.
    rho_inf, step : -, s
        Of generalized-alpha only: spectral radius at infinity. Of stepwise methods: fixed step, None for error control,
        which "mean-force" does not have.
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
