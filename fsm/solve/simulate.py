"""Time integration of a system with its energy balance, and output of states at requested times."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fsm.solve.dense_run import DenseRun
from fsm.solve.handed_over import Beginning, CurvePoint, Saved, Statistics, StepEnd, Wanted
from fsm.solve.ledger import Ledger
from fsm.solve.settings import Settings
from fsm.solve.stepwise_run import GENERALIZED_ALPHA, MEAN_FORCE, NEWMARK, StepwiseRun
from fsm.system import System

__all__ = ["simulate"]


def simulate(
    system: System,
    settings: Settings,
    save_times: Sequence[float],
    on_save: Callable[[Saved], None],
    on_step: Callable[[StepEnd], None] | None = None,
    start: tuple[float, np.ndarray, np.ndarray] | None = None,
    ledger: Ledger | None = None,
    seen: list[CurvePoint] | None = None,
    after: StepEnd | None = None,
) -> tuple[Statistics, Ledger]:
    """Integrate a system and report states at the requested times.

    Parameters
    ----------
    system : System
    settings : Settings
    save_times, on_save, on_step : see `Wanted`
    start, ledger, seen, after : see `Beginning`; after a restart the times are those of the whole solve

    Raises
    ------
    NotConverged
        The message states the time, the worst body and a remedy. Earlier states are already saved.
    EnergyAbort
    """
    kind = StepwiseRun if settings.method in (GENERALIZED_ALPHA, NEWMARK, MEAN_FORCE) else DenseRun
    beginning = Beginning(start, ledger, [] if seen is None else seen, after)
    run = kind(system, settings, Wanted(save_times, on_save, on_step), beginning)
    run.go()
    return run.statistics, run.ledger
