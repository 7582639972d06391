"""Summary of a run: its numbers, its warnings, and the comparison with expected values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from fsm.analyses.analysis import MODAL, Analysis, counted
from fsm.analyses.comparison import Statement
from fsm.case.models.case import Case
from fsm.model.plan.in_python import cost_in_python
from fsm.results.quantities import in_motion
from fsm.results.solution import Layout, Solution
from fsm.results.summary_file import largest_errors
from fsm.run.round_off import RoundOff
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import Statistics
from fsm.solve.outcome.status import Event
from fsm.solve.settings import Settings
from fsm.solve.statics.arc_length import ArcSettings
from fsm.text.load_names import load_units
from fsm.text.shown_units import count, shown_unit, travel_text

_COARSE, _LATE = 0.05, 0.02
"""Errors due to cells and segments, and errors of positions due to steps, above which there is a warning."""
_MANY, _COSTLY = 30000, 2.0
"""Iterations, and ratio of times, above which there is a warning on steps in Python; they then take over 10 s longer."""
_LISTED_EVENTS = 6
"""Largest number of events with a warning each."""
_LISTED_LOADS = 3
"""Largest number of loads that a warning lists."""

_PULL_DEFAULTS: dict[str, Any] = {"peak_force": 0.0, "peak_travel": 0.0, "stages": [], "contact": [], "contact_stats": {}}
"""Keys of a pull that every summary has, with their values for a run without a drive."""


def summary_of(
    analysis: Analysis,
    solution: Solution,
    statistics: Statistics,
    energy_balance: EnergyBalance,
    warnings: list[str],
    round_off: RoundOff,
    arcs: Sequence[int] = (),
) -> dict[str, Any]:
    """Content of summary.json without run times: results of the analysis, counters, energy error and warnings.

    Parameters
    ----------
    analysis : analysis of the case
    solution : all records
    statistics, energy_balance : counters and energy balance of the solve
    warnings : warnings before and during the solve
    round_off : round-off of the forces; its part is a lower bound of the energy error
    arcs : numbers of the steps by arc length, from 1; they pass unstable equilibria without a snap
    """
    in_python = analysis.in_python()
    passages = unstable_passages(solution, statistics.events, arcs)
    events = sorted([*statistics.events, *passages], key=lambda event: event.time)
    summary: dict[str, Any] = {**_PULL_DEFAULTS}
    if solution.layout.drive_names:
        summary["drive"] = solution.layout.drive_names[0]
    summary |= analysis.summarise(solution, statistics)
    summary |= {
        "steps": statistics.steps,
        "newton_iterations": statistics.newton_iterations,
        "energy_error": max(energy_balance.relative_error, round_off.part),
        "energy_drift": max(energy_balance.relative_drift, round_off.part),
        "numerical_dissipation": energy_balance.relative_numerical,
        "unstable_equilibria": int(np.sum(solution.negative_pivots > 0)),
        "events": [asdict(event) for event in events],
        "solve_time_s": statistics.wall_time,
        "method": statistics.method,
        "steps_compiled": not in_python,
        "steps_in_python_because": list(in_python),
        "dof": analysis.system.dof,
        "dimension": solution.layout.dimension,
    }
    found = []
    evaluations, cost = statistics.newton_iterations, cost_in_python(analysis.system.dof)
    if in_python and evaluations > _MANY and cost > _COSTLY:
        text = f"about {cost:.0f} times slower than compiled steps: {'; '.join(in_python)}"
        found.append(f"{count(evaluations, 'iteration')} took their steps in Python, {text}")
    if round_off.warning():
        found.append(round_off.warning())
    if energy_balance.relative_drift > max(1e-3, round_off.part):
        residual = energy_balance.relative_error > 0.5 * energy_balance.relative_drift
        name = "energy balance residual" if residual else "numerical dissipation"
        part = f"{name}: {energy_balance.relative_drift:.3g} of the reference energy, above 0.001"
        found.append(f"{part}; {_remedy(analysis, statistics.method)}")
    listed = [event for event in events if event.kind != "vibration"]
    layout = solution.layout
    found += [_event_text(event, layout) for event in listed[:_LISTED_EVENTS]]
    if len(listed) > _LISTED_EVENTS:
        more = count(len(listed) - _LISTED_EVENTS, "more event")
        found.append(f"{more} until {_where(listed[-1], layout)}; `events` in summary.json lists all")
    summary["warnings"] = [*warnings, *found, *analysis.warnings(solution, summary)]
    return summary


def _remedy(analysis: Analysis, method: str) -> str:
    """Remedy for a large energy balance residual; a tolerance affects neither a reduced model nor fixed steps."""
    if method == MODAL:
        return 'increase vibration.modes, or set vibration.model = "full"'
    settings = [step.settings for step in analysis.steps()]
    if method == "arc-length":
        longest = [one.longest * one.end_time for one in settings if isinstance(one, ArcSettings)]
        return f"give solve.max_step = {0.5 * min(longest):.3g} s or less" if longest else "give a smaller solve.max_step"
    fixed = any(isinstance(one, Settings) and one.step is not None for one in settings)
    return "reduce solve.step" if fixed else "tighten rtol"


def state_errors(summary: dict[str, Any], errors: dict[str, Statement]) -> None:
    """Add errors to a summary, also under the names of single errors, and warnings on large errors.

    Parameters
    ----------
    summary : changed in place
    errors : errors by their causes, "mesh" and "steps"
    """
    summary["errors"] = errors
    mesh, steps = (errors.get(cause, {}) for cause in ("mesh", "steps"))
    for key, of, name in (
        ("mesh_error", mesh, "peak_force"), ("mesh_error_final", mesh, "final_force"), ("motion_error", steps, "positions"),
    ):  # fmt: skip
        if name in of:
            summary.setdefault(key, of[name])
    coarse = [pair for pair in largest_errors(mesh) if pair[1] > _COARSE and "along" not in pair[0]]
    large = ", ".join(f"{name}: error about {100.0 * error:.2g} %" for name, error in coarse)
    if large and "positions" in mesh:  # errors of films have their own warnings
        summary["warnings"].append(f"the mesh of the facets is coarse: {large}; give smaller cells")
    elif large and "segments" in mesh["by"]:
        cause = "snaps depend on the segments" if "snaps" in mesh["by"] else "the segments are coarse"
        summary["warnings"].append(f"{cause}: {large}; raise strip.segments_per_panel")
    late = [
        f"{name} have an error of about {100.0 * error:.2g} % of the largest displacement"
        for name, error in largest_errors(steps)
        if name.startswith("positions") and error > _LATE
    ]
    if not late and "positions_since" in steps:
        late = ["positions depend on the steps in time, and their error is unknown"]
    if late:
        since = f" (above 2 % from t = {steps['positions_since']:.4g} s on)" if "positions_since" in steps else ""
        remedy = "solve.step" if "steps of twice" in steps["by"] else "solve.rtol"
        summary["warnings"].append(
            f"{', '.join(late)}{since}, due to the steps in time: reduce {remedy}. If the error remains, small changes of "
            "the case change the motion as much"
        )


def joined(deployment: dict[str, Any], vibration: dict[str, Any]) -> dict[str, Any]:
    """Summary of two stages: all keys of the vibration, keys of the deployment alone, and the deployment as `deploy`."""
    pull = {key: value for key, value in deployment.items() if key not in vibration or key in _PULL_DEFAULTS}
    warnings = [*deployment["warnings"], *vibration["warnings"]]
    return vibration | pull | {"warnings": warnings, "deploy": deployment}


def unstable_passages(solution: Solution, events: Sequence[Event], arcs: Sequence[int] = ()) -> list[Event]:
    """Events for unstable records that no event of the solve covers; successive records give one event.

    An event lasts from the last stable record before to the first stable record after. The event is a "vibration" if the
    drive stands still during it, or if inertia matters at its beginning (`in_motion`): a snap begins near an equilibrium.
    The solver of a dynamic run reports no events. Steps by arc length (`arcs`) have no such events.
    """
    time, unstable = solution.time, (solution.negative_pivots > 0) & ~np.isin(solution.step, arcs)
    for event in events:
        unstable &= ~((time >= event.time) & (time <= event.end_time))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], unstable, [False]]).astype(int)))
    driven = solution.travel.shape[1] > 0
    travel, force = ((values[:, 0] if driven else np.zeros(len(time))) for values in (solution.travel, solution.force))
    if not edges.size:
        return []
    found, moving = [], in_motion(solution.energy)
    for begin, end in zip(np.maximum(edges[::2] - 1, 0), np.minimum(edges[1::2], len(time) - 1), strict=True):
        ends = [float(values[k]) for values in (time, travel, force) for k in (begin, end)]
        found.append(Event("vibration" if moving[begin] or (driven and travel[begin] == travel[end]) else "unstable", *ends))
    return found


def _where(event: Event, layout: Layout) -> str:
    """Travel of the first drive at the start of an event; the time if this drive does not move in it."""
    return layout.travel_text(event.travel) if _drives(event) else f"{event.time:.4g} s"


def _drives(event: Event) -> bool:
    """Whether the travel of the first drive tells when an event occurs: it moves, or the event takes no time."""
    return event.travel != event.end_travel or (event.travel != 0.0 and event.time == event.end_time)


def _event_text(event: Event, layout: Layout) -> str:
    """Warning about an event, without drives with the loads at its start."""
    driven, (effort, unit) = bool(layout.drive_names), ("moment", "N m") if layout.turns() else ("force", "N")
    loads = "" if driven else _loads_text(event)
    where = f"at {_where(event, layout)}" + (f" ({loads})" if loads else "")
    until = travel_text(layout.turns(), event.end_travel) if driven and _drives(event) else f"{event.end_time:.4g} s"
    inertia = f"solved with inertia until {until}"
    path = "" if driven else '; set solve.method = "arc-length", which follows the equilibria through limit points'
    forces = f"; {effort} {event.force:.4g} {unit} before, {event.end_force:.4g} {unit} after" if driven else ""
    if event.kind == "bifurcation":
        return f"bifurcation {where}: the path is unstable there; the run follows a stable branch (see solve.imperfection)"
    if event.kind == "force limit":
        return f"the force of the drive reached solve.force_limit {where}, {event.end_force:.4g} N; the run ends there"
    if event.kind == "release":
        there = f"; {effort} {event.end_force:.4g} {unit} there" if driven else ""
        start = f"the state at {event.time:.4g} s" if event.time else "the start"
        return f"{start} is not in equilibrium: {inertia}{there}"
    if event.kind == "motion" and not driven:
        return f"the load was too fast for statics {where}: {inertia}; let it grow more slowly, or {path.removeprefix('; ')}"
    if event.kind == "motion":
        advice = "" if layout.turns() else "; drive slower"  # a machine has inertia at any speed
        return f"motion {where}: too fast for statics, {inertia}{forces}{advice}"
    if event.kind == "damped snap":
        return f"snap {where}: states are unstable until {until}, and dampers slow the motion{forces}{path}"
    if event.kind == "unstable":
        return f"snap {where}: saved states until {until} are unstable{forces}{path}"
    if driven:
        return f"snap {where}: {inertia}{forces}"
    return f"limit load reached {where}: the structure snaps, {inertia}{path}"


def _loads_text(event: Event) -> str:
    """Sizes of the first loads of an event, and displacements of their points."""
    texts = []
    for name, (size, moved) in list(event.loads.items())[:_LISTED_LOADS]:
        units = load_units(name)
        there = shown_unit(units.displacement, moved).text(moved)
        texts.append(f"{name} {shown_unit(units.size, size).text(size)} at {there}")
    return ", ".join(texts)


def missed_expectations(case: Case, summary: dict[str, Any]) -> list[str]:
    """One line for each number that is outside its bounds in [expect]."""
    lines = []
    for name, expect in case.expect.items():
        value = summary.get(name)
        bound = (expect.atol or 0.0) + (expect.rtol or 0.0) * abs(expect.value)
        if value is None:
            lines.append(f"expect.{name}: {expect.value:g} expected, but this event did not occur in the run")
        elif not abs(value - expect.value) <= bound:
            lines.append(f"expect.{name}: {value:.6g}, expected {expect.value:g} +- {bound:.3g}")
    return lines


def counters_of(statistics: Statistics) -> dict[str, Any]:
    """Counters of a solve for the results file."""
    found = counted(statistics)
    smallest = found.pop("smallest_step")
    renamed = {"rejected_steps": found.pop("rejected"), "solve_time_s": found.pop("wall_time")}
    renamed["smallest_step_s"] = smallest if math.isfinite(smallest) else 0.0
    return {"method": statistics.method, "outcome": statistics.outcome.name.lower()} | found | renamed
