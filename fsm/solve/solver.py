"""Common interface of all methods: equilibria for `PathSettings`, time integration for `Settings`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fsm.solve.energy_balance import EnergyBalance
from fsm.solve.run_io import AcceptedStep, CurvePoint, SavedState, Statistics
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.static import PathSettings, follow
from fsm.system import System

__all__ = ["solve"]


def solve(
    system: System,
    settings: Settings | PathSettings,
    save_times: Sequence[float],
    on_save: Callable[[SavedState], None],
    on_step: Callable[[AcceptedStep], None] | None = None,
    start: tuple[float, np.ndarray, np.ndarray] | None = None,
    energy_balance: EnergyBalance | None = None,
    seen: list[CurvePoint] | None = None,
    after: AcceptedStep | None = None,
) -> tuple[Statistics, EnergyBalance]:
    """Solve a system and report states at the requested times; arguments as in `simulate`."""
    if isinstance(settings, PathSettings):
        return follow(system, settings, save_times, on_save, on_step, start, energy_balance, seen, after)
    return simulate(system, settings, save_times, on_save, on_step, start, energy_balance, seen, after)
