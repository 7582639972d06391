"""Texts and tables of a result for the page: results, errors, warnings, events, steps, the case, and provenance."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from fsm.errors import FsmError
from fsm.results.quantities import touching_pairs
from fsm.results.reported import ROUND_OFF, shown_name
from fsm.results.solution import Solution
from fsm.text.load_names import load_units
from fsm.text.shown_units import shown, shown_range, shown_unit, travel_text, turns

_LABEL = 14
"""Width of the labels of `fsm check`."""
_RESULTS: dict[str, tuple[str, str, float]] = {
    "peak_force": ("peak force", "N", 1.0),
    "peak_travel": ("travel at the peak", "mm", 1e3),
    "peak_kind": ("kind of the peak", "", 1.0),
    "largest_magnitude": ("largest magnitude of a negative force", "N", 1.0),
    "dynamic_peak_force": ("dynamic peak force", "N", 1.0),
    "dynamic_peak_travel": ("travel at the dynamic peak", "mm", 1e3),
    "contact_travel": ("travel at the first contact", "mm", 1e3),
    "contact_force": ("force at the first contact", "N", 1.0),
    "bending_travel": ("travel at the onset of bending", "mm", 1e3),
    "bending_force": ("force at the onset of bending", "N", 1.0),
    "final_force": ("force at the end", "N", 1.0),
    "frequency_hz": ("frequency by fit", "Hz", 1.0),
    "frequency_fft_hz": ("frequency by FFT", "Hz", 1.0),
    "decay_rate": ("decay rate", "1/s", 1.0),
    "damping_ratio": ("damping ratio", "", 1.0),
    "amplitude_center": ("amplitude at the centre", "mm", 1e3),
    "amplitude_patch": ("amplitude at the patch", "mm", 1e3),
    "max_stress": ("largest stress", "MPa", 1e-6),
    "dof": ("degrees of freedom", "", 1.0),
    "steps": ("steps of the solver", "", 1.0),
}
"""Key of the summary: label, unit of the page and factor from SI, in the order of the page."""

_ERRORS: dict[str, tuple[str, str]] = {
    "energy_error": ("energy balance residual", "relative to the reference energy"),
    "numerical_dissipation": ("numerical dissipation", "relative to the reference energy"),
    "mesh_error": ("discretisation error of the peak force", "relative, estimated"),
    "mesh_error_final": ("discretisation error of the force at the end", "relative, estimated"),
    "motion_error": ("error of the motion in time", "relative, against a larger tolerance"),
    "mesh_error_frequency": ("discretisation error of the frequency", "relative, estimated"),
    "mesh_error_amplitude": ("discretisation error of the amplitude", "relative, estimated"),
    "max_stress_error": ("error of the largest stress", "relative, estimated"),
    "fit_residual": ("residual of the fit of the frequency", "relative to the history"),
}
_VERSIONS = ("fsm", "python", "numpy", "scipy", "numba")
_MOST_EVENTS = 200


def key_results(summary: dict[str, Any]) -> dict[str, tuple[float, str]]:
    """Named numbers of a summary with their units, in units of the page; a table of several results compares them."""
    turning = turns(summary)
    found = {}
    for key, (label, unit, factor) in _RESULTS.items():
        value = summary.get(key)
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
            if key in ("peak_force", "peak_travel") and not summary.get("peak_force"):
                continue
            unit, factor = _turned(key, unit, factor) if turning else (unit, factor)
            found[label] = (factor * float(value), unit)
    for key, (label, _) in _ERRORS.items():
        value = summary.get(key)
        if isinstance(value, int | float) and math.isfinite(value):
            found[label] = (100.0 * float(value), "%")
    return found


def sections_of(solution: Solution) -> list[dict[str, Any]]:
    """Sections of texts: title, and rows or a table or a list of lines."""
    summary = solution.summary
    described = describe_case(solution)
    return [
        section
        for section in (
            _rows("Results", _result_rows(summary) + _contact_rows(solution)),
            _lines("Warnings", [str(text) for text in summary.get("warnings", ())], "warning"),
            _channels(summary),
            _reactions(summary),
            _margins(summary),
            _latches(summary),
            _rows("Error estimates", _error_rows(summary)),
            _events(summary),
            _steps(summary),
            _rows("Case", [row for row in described if row[0] not in ("left out", "approximate")]),
            _lines("Left out of the model", [text for label, text in described if label == "left out"]),
            _lines("Approximations", [text for label, text in described if label == "approximate"]),
            _rows("Provenance", _provenance(solution)),
        )
        if section
    ]


def _turned(key: str, unit: str, factor: float) -> tuple[str, float]:
    if key.endswith("travel"):
        return "deg", 180.0 / math.pi
    return ("N m", factor) if unit == "N" else (unit, factor)


def _result_rows(summary: dict[str, Any]) -> list[list[str]]:
    errors = {label for label, _ in _ERRORS.values()}
    rows = [
        [label, f"{value:.5g} {unit}".strip()]
        for label, (value, unit) in key_results(summary).items()
        if label not in errors
    ]
    if summary.get("peak_kind") and summary.get("peak_force"):
        rows.append(["kind of the peak", str(summary["peak_kind"])])
    if summary.get("modes_hz"):
        rows.append(["first natural frequencies", ", ".join(f"{f:.4g}" for f in summary["modes_hz"][:6]) + " Hz"])
    state = summary.get("tension_state")
    if isinstance(state, dict):
        stress = shown_range(state["smallest_stress"], state["largest_stress"], "Pa")
        rows.append(["stress of the tensioned film", f"{stress}, {100 * state['slack_fraction']:.3g} % slack"])
    for stage in summary.get("stages", ()):
        travel = travel_text(turns(summary), stage["travel"])
        rows.append([f"stage: {stage['name']}", f"from {travel}, {stage['force']:.4g} {'N m' if turns(summary) else 'N'}"])
    for load in summary.get("loads", ()):
        units = load_units(load["name"])
        moved = shown_unit(units.displacement, load["displacement"]).text(load["displacement"])
        rows.append([load["name"], f"{load['size']:.4g} {units.size} at the end, {units.curve} {moved}"])
    return rows


def _contact_rows(solution: Solution) -> list[list[str]]:
    touching = touching_pairs(solution.pair_force)
    if not touching:
        return []
    record, pair = np.unravel_index(int(np.nanargmax(solution.pair_force)), solution.pair_force.shape)
    most = f"{solution.pair_force[record, pair]:.4g} N, {solution.layout.pair_names[pair]}, at {solution.time[record]:.5g} s"
    return [["contact pairs that touch", str(len(touching))], ["largest contact force", most]]


def _error_rows(summary: dict[str, Any]) -> list[list[str]]:
    rows = []
    for key, (label, text) in _ERRORS.items():
        value = summary.get(key)
        if isinstance(value, int | float) and math.isfinite(value):
            rows.append([label, f"{100.0 * value:.3g} % ({text})"])
    rows += [[f"errors due to {cause}", stated["by"]] for cause, stated in summary.get("errors", {}).items()]
    return rows or [["error estimates", "none for this kind of run"]]


def _events(summary: dict[str, Any]) -> dict[str, Any] | None:
    events = [event for event in summary.get("events", ()) if isinstance(event, dict)]
    if not events:
        return None
    head = ["kind", "time (s)", "travel (mm)", "force (N)", "until time (s)"]
    rows = [
        [
            str(e.get("kind", "")),
            _number(e.get("time")),
            _number(e.get("travel"), 1e3),
            _number(e.get("force")),
            _number(e.get("end_time")),
        ]
        for e in events[:_MOST_EVENTS]
    ]
    if turns(summary):
        head[2:4] = ["turn (rad)", "moment (N m)"]
        rows = [[*row[:2], _number(e.get("travel")), *row[3:]] for row, e in zip(rows, events, strict=False)]
    return {"title": "Events", "head": head, "table": rows, "times": [e.get("time") for e in events[:_MOST_EVENTS]]}


def _channels(summary: dict[str, Any]) -> dict[str, Any] | None:
    """Channels of `report`, in units of their sizes."""
    rows = []
    for one in summary.get("report", ()):
        if "end" in one:
            unit = shown_unit(one["unit"], max(abs(one["min"]), abs(one["max"])))
            values = [f"{unit.factor * one[key]:.5g}" for key in ("start", "end", "min", "max") if key in one]
            rows.append([shown_name(one["name"]), unit.name, *values])
    return {"title": "Motion", "head": ["", "unit", "start", "end", "smallest", "largest"], "table": rows} if rows else None


def _reactions(summary: dict[str, Any]) -> dict[str, Any] | None:
    rows = [
        [one["joint"], *(text for key in ("force", "moment") for text in _largest(one.get(key), one.get(f"{key}_time")))]
        for one in summary.get("reactions", ())
    ]
    head = ["joint", "largest force (N)", "at (s)", "largest moment (N m)", "at (s)"]
    return {"title": "Reactions of joints", "head": head, "table": rows} if rows else None


def _largest(size: Any, time: Any) -> tuple[str, str]:
    """Size and time of a reaction; only 0 for round-off."""
    return ("0", "") if size is not None and size <= ROUND_OFF else (_number(size), _number(time))


def _margins(summary: dict[str, Any]) -> dict[str, Any] | None:
    rows = [
        [
            one["joint"], "none required" if one["margin"] is None else f"{one['margin']:.3g}",
            f"{math.degrees(one['angle']):.4g}", _number(one["available"]), _number(one["required"]),
        ]
        for one in summary.get("margins", ())
    ]  # fmt: skip
    head = ["joint", "smallest", "at (deg)", "available (N m)", "required (N m)"]
    return {"title": "Motorisation margins", "head": head, "table": rows} if rows else None


def _latches(summary: dict[str, Any]) -> dict[str, Any] | None:
    """Events of latches, with the rate before them."""
    rows = [
        [
            event["joint"], event["what"].removeprefix("latch "), f"{event['time']:.5g}",
            *(shown(event[key], unit) for key, unit in zip(("rate_before", "impulse", "largest"), units, strict=True)),
        ]
        for event in summary.get("joint_events", ())
        for units in [("rad/s", "N m s", "N m") if event["unit"] == "rad" else ("m/s", "N s", "N")]
        if event["what"].startswith("latch")
    ]  # fmt: skip
    head = ["hinge", "latch", "at (s)", "rate before", "impulse", "largest moment or force"]
    return {"title": "Latches", "head": head, "table": rows[:_MOST_EVENTS]} if rows else None


def _steps(summary: dict[str, Any]) -> dict[str, Any] | None:
    steps = [step for step in summary.get("step", ()) if isinstance(step, dict)]
    if not steps:
        return None
    head = ["step", "kind", "method", "from (s)", "until (s)", "solver steps", "records", "peak force (N)"]
    keys = ("name", "kind", "method", "start_time", "end_time", "steps", "records", "peak_force")
    rows = [[_number(step.get(key)) for key in keys] for step in steps]
    known = [k for k in range(len(keys)) if any(row[k] for row in rows)]
    return {"title": "Steps", "head": [head[k] for k in known], "table": [[row[k] for k in known] for row in rows]}


def _number(value: Any, factor: float = 1.0) -> str:
    if value is None:
        return ""
    return f"{factor * value:.5g}" if isinstance(value, int | float) else str(value)


def _provenance(solution: Solution) -> list[list[str]]:
    """Versions, date and method; nothing about the machine or its folders."""
    known = solution.layout.provenance
    rows = [[name, str(known[name])] for name in _VERSIONS if name in known]
    rows += [
        [label, str(known[key])]
        for key, label in (("written", "solved"), ("method", "method"), ("source", "hash of the source"))
        if key in known
    ]
    stats = {
        key: solution.stats[key]
        for key in ("outcome", "steps", "newton_iterations", "factorisations")
        if key in solution.stats
    }
    return rows + [[f"solver: {key.replace('_', ' ')}", str(value)] for key, value in stats.items()]


def _rows(title: str, rows: list[list[str]]) -> dict[str, Any] | None:
    return {"title": title, "rows": rows} if rows else None


def _lines(title: str, lines: list[str], kind: str = "") -> dict[str, Any] | None:
    return {"title": title, "lines": lines, "kind": kind} if lines else None


def describe_case(solution: Solution) -> list[list[str]]:
    """Lines of `fsm check` for the stored case as (label, text); few lines if the case needs code of the user.

    Extensions of a case are Python code. A report never executes them.
    """
    case = dict(solution.layout.case)
    title = [["case", str(case.get("title") or "without title")]]
    if case.get("extensions"):
        return [
            *title,
            ["extensions", f"{', '.join(map(str, case['extensions']))}; they are not executed, so no model is described"],
        ]
    from fsm.case.loading.load_case import read_case
    from fsm.check.report import describe

    if isinstance(case.get("save"), dict):
        case["save"] = {key: value for key, value in case["save"].items() if key != "channels"}
    try:
        read, _ = read_case(case, Path())
        lines = describe(read) if read is not None else []
    except (FsmError, LookupError, TypeError, ValueError, AttributeError, ArithmeticError, OSError):
        lines = []
    return _labelled(lines) or [*title, ["model", "this version cannot read the case of the result"]]


def _labelled(lines: Iterable[str]) -> list[list[str]]:
    """Split lines of `fsm check` into label and text; a line without label has the label of the previous line."""
    rows: list[list[str]] = []
    for line in lines:
        label = line[:_LABEL].strip() or (rows[-1][0] if rows else "")
        rows.append([label, line[_LABEL:].strip()])
    return rows
