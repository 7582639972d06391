"""Step a system through time, keep the energy ledger, and hand states over as they are wanted."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fsm.solve.dense_run import DenseRun
from fsm.solve.handed_over import Saved, Statistics, StepEnd
from fsm.solve.ledger import Ledger
from fsm.solve.settings import Settings
from fsm.solve.stepwise_run import GENERALIZED_ALPHA, NEWMARK, StepwiseRun
from fsm.system import DriveState, System

__all__ = ["simulate"]


def simulate(
    system: System,
    settings: Settings,
    save_times: Sequence[float],
    on_save: Callable[[Saved], None],
    on_step: Callable[[StepEnd], None] | None = None,
    start: tuple[float, np.ndarray, np.ndarray] | None = None,
    ledger: Ledger | None = None,
    seen: list[tuple[DriveState, np.ndarray]] | None = None,
    after: StepEnd | None = None,
) -> tuple[Statistics, Ledger]:
    """Integrate a system and report states at the times asked for.

    Parameters
    ----------
    system : System
    settings : Settings
    save_times : increasing times, s
    on_save : called with each saved state, in order
    on_step : called after every step
    start : time, q, u to begin with; the system's initial state if absent
    ledger, seen : to begin or go on with; changed in place
    after : StepEnd
        A renewal point of another solve of the same system to go on from, with its ledger and what it had seen there, as
        that one did: to the bit. Saved times are those of the whole.

    Raises
    ------
    NotConverged
        With the time, the worst body and what to try. What was saved until then has been handed over.
    EnergyAbort
    """
    kind = StepwiseRun if settings.method in (GENERALIZED_ALPHA, NEWMARK) else DenseRun
    run = kind(system, settings, save_times, on_save, on_step, start, ledger, [] if seen is None else seen, after)
    run.go()
    return run.statistics, run.ledger
