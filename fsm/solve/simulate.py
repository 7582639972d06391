"""Solution of a system with its energy balance, and output of states at requested times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from fsm.solve.interface.system import System
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import AcceptedStep, CurvePoint, InitialState, OutputRequest, SavedState, Statistics, Watch
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.statics.static import follow

if TYPE_CHECKING:
    from fsm.solve.time.run import Run


def simulate(
    system: System,
    settings: Settings | PathSettings,
    save_times: Sequence[float],
    on_save: Callable[[SavedState], None],
    on_step: Callable[[AcceptedStep], None] | None = None,
    start: tuple[float, np.ndarray, np.ndarray] | None = None,
    energy_balance: EnergyBalance | None = None,
    points: list[CurvePoint] | None = None,
    after: AcceptedStep | None = None,
    watch: Watch | None = None,
    each_step: bool = False,
    several: bool = False,
) -> tuple[Statistics, EnergyBalance]:
    """Integrate a system, or follow its equilibria, and report states at the requested times.

    Parameters
    ----------
    system : System
    settings : Settings of time integration, or PathSettings
    save_times, on_save, on_step, watch, each_step, several : see `OutputRequest`; events happen in motions only, and
        motions call `on_step` as they do without `each_step` and `on_save` without `several`
    start, energy_balance, points, after : see `InitialState`; after a restart the times belong to the whole solve

    Raises
    ------
    NotConverged
        The message states the time, the worst body and a remedy. Earlier states are already saved.
    EnergyAbort
    """
    if isinstance(settings, PathSettings):
        rest = start, energy_balance, points, after, each_step, several
        return follow(system, settings, save_times, on_save, on_step, *rest)
    from fsm.solve.time.stepwise_run import STEPWISE, StepwiseRun  # imports all methods of time integration

    kind: type[Run] = StepwiseRun
    if settings.method not in STEPWISE:
        from fsm.solve.time.dense_run import DenseRun  # imports SciPy's integrators

        kind = DenseRun
    initial_state = InitialState(start, energy_balance, [] if points is None else points, after)
    run = kind(system, settings, OutputRequest(save_times, on_save, on_step, watch=watch), initial_state)
    run.go()
    return run.statistics, run.energy_balance
