"""What a run amounts to: its summary, its warnings, and whether it is what was expected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from fsm.analyses.analysis import Analysis
from fsm.analyses.reduced import MODAL
from fsm.results.solution import Solution
from fsm.round_off import RoundOff
from fsm.scene.case import Case
from fsm.solve.handed_over import Statistics
from fsm.solve.ledger import Ledger
from fsm.solve.settings import Settings
from fsm.solve.status import Event

__all__ = ["joined", "missed_expectations", "summary_of", "unstable_passages"]

_EVENTS_TOLD = 6
"""Events that have a warning each."""

_OF_PULL: dict[str, Any] = {"peak_force": 0.0, "peak_travel": 0.0, "stages": [], "contact": [], "contact_stats": {}}
"""What every summary has of a pull, and what that is where there is none."""


def summary_of(
    analysis: Analysis,
    solution: Solution,
    statistics: Statistics,
    ledger: Ledger,
    warnings: list[str],
    round_off: RoundOff,
) -> dict[str, Any]:
    """What summary.json holds, but for run times: what the analysis says, counters, energy error, warnings.

    Parameters
    ----------
    analysis : what was solved
    solution : all records
    statistics, ledger : of the solve
    warnings : what was noticed before and during it
    round_off : forces that are round-off; their part counts as an energy error too
    """
    events = sorted([*statistics.events, *unstable_passages(solution, statistics.events)], key=lambda event: event.time)
    summary: dict[str, Any] = {**_OF_PULL}
    summary |= analysis.summarise(solution, statistics)
    summary |= {
        "steps": statistics.steps,
        "newton_iterations": statistics.newton_iterations,
        "energy_error": max(ledger.relative_error, round_off.part),
        "unstable_equilibria": int(np.sum(solution.negative_pivots > 0)),
        "events": [asdict(event) for event in events],
        "solve_time_s": statistics.wall_time,
        "method": statistics.method,
        "dof": analysis.system.nu,
        "dimension": solution.layout.dimension,
    }
    found = []
    if round_off.warning():
        found.append(round_off.warning())
    if ledger.relative_error > max(1e-3, round_off.part):
        off = f"energy balance off by {ledger.relative_error:.2g} of the energy turned over"
        found.append(f"{off}; {_remedy(analysis, statistics.method)}")
    found += [_told(event) for event in events[:_EVENTS_TOLD]]
    if len(events) > _EVENTS_TOLD:
        found.append(f"{len(events) - _EVENTS_TOLD} more events until {_where(events[-1])}; `events` of the summary has all")
    summary["warnings"] = [*warnings, *found, *analysis.warnings(solution, summary)]
    return summary


def _remedy(analysis: Analysis, method: str) -> str:
    """What closes an energy balance that is off: neither the steps of a reduced model nor fixed ones go by a tolerance."""
    if method == MODAL:
        return 'take more vibration.modes, or vibration.model = "full"'
    settings = analysis.settings(method)
    fixed = isinstance(settings, Settings) and settings.step is not None
    return "take a shorter solve.step" if fixed else "tighten rtol"


def joined(deployment: dict[str, Any], vibration: dict[str, Any]) -> dict[str, Any]:
    """Summary of two stages: that of the vibration, what only the deployment has, and the deployment's whole as `deploy`."""
    of_pull = {key: value for key, value in deployment.items() if key not in vibration or key in _OF_PULL}
    warnings = [*deployment["warnings"], *vibration["warnings"]]
    return vibration | of_pull | {"warnings": warnings, "deploy": deployment}


def unstable_passages(solution: Solution, events: Sequence[Event]) -> list[Event]:
    """An event for every row of records with an unstable tangent that no event of the solve covers.

    It lasts from the last stable record before to the first one after. A motion that is solved with its inertia
    throughout has no events of its own.
    """
    time, unstable = solution.time, solution.negative_pivots > 0
    for event in events:
        unstable &= ~((time >= event.time) & (time <= event.end_time))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], unstable, [False]]).astype(int)))
    driven = solution.travel.shape[1] > 0
    travel, force = ((values[:, 0] if driven else np.zeros(len(time))) for values in (solution.travel, solution.force))
    found = []
    for begin, end in zip(np.maximum(edges[::2] - 1, 0), np.minimum(edges[1::2], len(time) - 1), strict=True):
        ends = (float(values[k]) for values in (time, travel, force) for k in (begin, end))
        found.append(Event("unstable", *ends))
    return found


def _where(event: Event) -> str:
    return f"{1e3 * event.travel:.4g} mm of travel" if event.travel else f"{event.time:.4g} s"


def _told(event: Event) -> str:
    """An event in words."""
    where = f"at {_where(event)}"
    if event.kind == "bifurcation":
        return f"bifurcation {where}: the path there is unstable, a stable branch was taken; solve.imperfection chooses it"
    until = f"{1e3 * event.end_travel:.4g} mm" if event.end_travel else f"{event.end_time:.4g} s"
    forces = f"force {event.force:.4g} N before, {event.end_force:.4g} N after"
    if event.kind == "release":
        return f"the start is no equilibrium: solved with inertia until {until}; force {event.end_force:.4g} N there"
    if event.kind == "damped snap":
        return f"snap {where}: unstable states until {until}, which the dampers slow down; {forces}"
    if event.kind == "unstable":
        return f"snap {where}: saved states until {until} are unstable; {forces}"
    return f"snap {where}: solved with inertia until {until}; {forces}"


def missed_expectations(case: Case, summary: dict[str, Any]) -> list[str]:
    """A line for every number of [expect] that was missed."""
    lines = []
    for name, expect in case.expect.items():
        value = summary.get(name)
        bound = (expect.atol or 0.0) + (expect.rtol or 0.0) * abs(expect.value)
        if value is None:
            lines.append(f"expect.{name}: {expect.value:g} expected, but the run never got there")
        elif not abs(value - expect.value) <= bound:
            lines.append(f"expect.{name}: {value:.6g}, expected {expect.value:g} +- {bound:.3g}")
    return lines
