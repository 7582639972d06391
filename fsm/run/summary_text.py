"""Lines of text about a run from its summary."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fsm.results.reported import ROUND_OFF, event_lines, shown_name
from fsm.results.summary_file import largest_errors
from fsm.text.load_names import load_units
from fsm.text.shown_units import ShownUnit, count, margin_texts, shown_unit, turns

_LISTED = 6
"""Largest number of limit points of a step, of errors of a cause, of loads, drives and channels that the text lists."""
_SMALL = 1e-3
"""Dynamic peak relative to the quasi-static one, below which it is not printed."""
_AT_ONCE = 1e-4
"""Travel relative to the travel at the end, below which a stage begins with the motion."""
_NEGLIGIBLE = 1e-7
"""Force relative to the largest one, below which it is round-off and printed as 0."""


def summary_lines(summary: Mapping[str, Any], folder: Path) -> list[str]:
    """Lines printed after a run: numbers that depend on its kind, counters, warnings and the folder of the files."""
    lines = [
        *_film_lines(summary),
        *(f"report      {text}" for text in report_texts(summary)),
        *(f"margin      {text}" for text in margin_texts(summary.get("margins", ()))),
        *_step_lines(summary.get("step", ())),
        *(text for step in summary.get("step", ()) for text in _limit_points(step)),
        *_pull_lines(summary),
        *(f"load        {text}" for text in _load_texts(summary.get("loads", ()))),
        *(f"event       {text}" for text in event_lines(summary.get("joint_events", ()))),
        *_sheet_lines(summary),
        *_array_lines(summary),
        *_contact_lines(summary),
        *_solve_lines(summary),
    ]
    lines += [f"error       {text}" for text in _error_texts(summary.get("errors", {}))]
    lines += [f"warning     {text}" for text in summary.get("warnings", ())]
    return [*lines, f"results     {folder}"]


def report_texts(summary: Mapping[str, Any]) -> list[str]:
    """One text for each of the first channels that the case asks for, then one for the reactions of joints."""
    rows = [row for row in summary.get("report", ()) if "end" in row]
    texts = [_report_text(row) for row in rows[:_LISTED]]
    if len(rows) > _LISTED:
        texts.append(f"and {len(rows) - _LISTED} more; see report in summary.json")
    largest = [_largest_text(summary.get("reactions", ()), key, unit) for key, unit in (("force", "N"), ("moment", "N m"))]
    named = ", ".join(text for text in largest if text)
    return [*texts, *([f"reactions of joints: {named}"] if named else [])]


def _largest_text(reactions: Sequence[Mapping[str, Any]], key: str, unit: str) -> str:
    """Largest reaction of all joints; empty for round-off."""
    row = max(reactions, key=lambda one: float(one.get(key, 0.0)), default={})
    if row.get(key, 0.0) <= ROUND_OFF:
        return ""
    return f"largest {key} {shown_unit(unit, row[key]).text(row[key])} in {row['joint']} at {row[f'{key}_time']:.4g} s"


def _report_text(row: Mapping[str, Any]) -> str:
    unit = shown_unit(row["unit"], max(abs(row["min"]), abs(row["max"])))
    end, low, high = (unit.text(0.0 if abs(row[key]) < ROUND_OFF else row[key]) for key in ("end", "min", "max"))
    at = f"from {low} at {row['min_time']:.4g} s to {high} at {row['max_time']:.4g} s"
    return f"{shown_name(row['name'])} {end} at the end, {at}"


def summary_travel_unit(summary: Mapping[str, Any]) -> ShownUnit:
    """Unit of all travels of the first drive in a summary: of turns, if it turns."""
    keys = ("final_travel", "peak_travel", "dynamic_peak_travel", "largest_magnitude_travel")
    largest = max((abs(summary.get(key) or 0.0) for key in keys), default=0.0)
    return shown_unit("rad" if turns(summary) else "m", largest)


def _film_lines(summary: Mapping[str, Any]) -> Iterator[str]:
    if summary.get("frequency_hz") is not None:
        yield (
            f"frequency   {summary['frequency_hz']:.5g} Hz by fit, {summary['frequency_fft_hz']:.5g} Hz by FFT "
            f"(resolution {summary['frequency_resolution_hz']:.3g} Hz)"
        )
        yield f"decay       {summary['decay_rate']:.4g} 1/s, damping ratio {summary['damping_ratio']:.3g}"
    for name in ("center", "patch"):
        amplitude = summary.get(f"amplitude_{name}")
        if amplitude is not None:
            yield f"amplitude   {shown_unit('m', amplitude).text(amplitude)} at the {name}"
    modes = summary.get("modes_hz")
    if modes:
        yield f"modes       {_frequencies(modes)}"
    if summary.get("tension_state"):
        state = summary["tension_state"]
        unit = shown_unit("Pa", max(abs(state["smallest_stress"]), abs(state["largest_stress"])))
        low, high = unit.factor * state["smallest_stress"], unit.factor * state["largest_stress"]
        span = f"{low:.4g}" if f"{low:.4g}" == f"{high:.4g}" else f"{low:.4g} to {high:.4g}"
        yield f"tension     {span} {unit.name}, {100 * state['slack_fraction']:.3g} % slack"


def _frequencies(found: Sequence[float]) -> str:
    more = " ..." if len(found) > _LISTED else ""
    return f"{', '.join(f'{f:.4g}' for f in found[:_LISTED])}{more} Hz"


def _pull_lines(summary: Mapping[str, Any]) -> Iterator[str]:
    """Peaks of the first drive, or of every drive if there are several; then stages."""
    if "peak_kind" not in summary:
        return
    turning, unit = turns(summary), summary_travel_unit(summary)
    effort, way = ("N m", "turn") if turning else ("N", "travel")
    of = "" if unit.name == "turns" else f" of {way}"
    force = summary["peak_force"]
    word = "moment" if turning else "force"
    drives = summary.get("drives", ())
    for drive in drives[:_LISTED]:
        yield f"{f'peak {word}':<12}{_drive_text(drive)}"
    if not drives:
        yield f"{f'peak {word}':<12}{force:.4g} {effort} at {unit.text(summary['peak_travel'])}{of} ({summary['peak_kind']})"
    if summary.get("start_up_force") is not None:
        at, start = unit.text(summary["start_up_travel"]), f"start of the drive, first 2 % of the {way}"
        yield f"            {summary['start_up_force']:.4g} {effort} at {at}{of} ({start})"
    magnitude = summary.get("largest_magnitude")
    if magnitude is not None and magnitude > force:
        at = unit.text(summary["largest_magnitude_travel"])
        yield f"            -{magnitude:.4g} {effort} at {at}{of} (largest magnitude)"
    if (summary.get("dynamic_peak_force") or 0.0) > _SMALL * abs(force) and summary["peak_kind"] != "dynamic":
        at = unit.text(summary["dynamic_peak_travel"])
        yield f"dynamic     {summary['dynamic_peak_force']:.4g} {effort} at {at}{of} (dynamic peak)"
    stages = summary.get("stages", ())
    several = len(stages) > 1 and stages[-1]["travel"] > _AT_ONCE * abs(summary.get("final_travel", 0.0))
    for stage in stages if several else ():
        value = stage["force"] if abs(stage["force"]) > _NEGLIGIBLE * abs(force) else 0.0
        yield f"stage       {stage['name']} from {unit.text(stage['travel'])}{of}, {word} {value:.4g} {effort}"


def _drive_text(drive: Mapping[str, Any]) -> str:
    turning = drive["name"].endswith("(turn)")
    at = shown_unit("rad" if turning else "m", drive["peak_travel"]).text(drive["peak_travel"])
    return f"{drive['peak_force']:.4g} {'N m' if turning else 'N'} at {at} of {drive['name']} ({drive['peak_kind']})"


def _error_texts(errors: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """One text for each cause of errors: the errors and how they were found, or why there are none."""
    texts = []
    for cause, stated in errors.items():
        named = [f"{name} {100.0 * error:.2g} %" for name, error in largest_errors(stated)]
        more = f", and {len(named) - _LISTED} more" if len(named) > _LISTED else ""
        listed = f"{', '.join(named[:_LISTED])}{more} ({stated['by']})"
        texts.append(f"{cause}: {listed if named else stated['by']}")
    return texts


def _step_lines(steps: Sequence[dict[str, Any]]) -> list[str]:
    """One line for each step of a case with `[[step]]`; no lines for other cases."""
    if {step["name"] for step in steps} <= {"start", "hold", "deploy", "vibrate"}:
        return []
    lines = []
    for step in steps:
        when = f"{'until' if step['end_time'] > step.get('start_time', 0.0) else 'at'} {step['end_time']:.4g} s"
        text = f"step        {step['name']}: {step['kind']} {when}"
        if step.get("peak_force"):
            turning = step["drive"].endswith("(turn)")
            text += f", peak {'moment' if turning else 'force'} {step['peak_force']:.4g} {'N m' if turning else 'N'}"
        if step.get("frequencies_hz"):
            text += f", natural frequencies {_frequencies(step['frequencies_hz'])}"
        lines.append(text)
    return lines


def _limit_points(step: dict[str, Any]) -> list[str]:
    """One line for each of the first limit points of a path by arc length."""
    points, lines = step.get("limit_points", ()), []
    for point in points[:_LISTED]:
        loads = [_load_text(name, load, " at") for name, load in point["loads"].items()]
        text = ", ".join(loads) or f"program time {point['program_time']:.4g} s"
        lines.append(f"limit point {text}; negative modes beyond it: {point['negative_modes']}")
    if len(points) > _LISTED:
        lines.append(f"            and {len(points) - _LISTED} more; see step.limit_points in summary.json")
    return lines


def _load_texts(loads: Sequence[Mapping[str, Any]]) -> Iterable[str]:
    """Loads and their displacements at the end."""
    texts = [
        _load_text(load["name"].removeprefix("load "), load, f": {load_units(load['name']).curve}") + " at the end"
        for load in loads[:_LISTED]
    ]
    return [*texts, *([f"and {len(loads) - _LISTED} more; see loads in summary.json"] if len(loads) > _LISTED else [])]


def _load_text(name: str, load: Mapping[str, Any], between: str) -> str:
    units = load_units(name)
    moved = shown_unit(units.displacement, load["displacement"]).text(load["displacement"])
    return f"{name} {load['size']:.4g} {units.size}{between} {moved}"


def _sheet_lines(summary: Mapping[str, Any]) -> Iterator[str]:
    """Displacements of probes, and how far a sheet has folded itself."""
    for name, moved in summary.get("probe_displacement", {}).items():
        unit = shown_unit("m", max(map(abs, moved), default=0.0))
        values = ", ".join(f"{unit.factor * x:.4g}" for x in moved)
        yield f"probe       {name}: displacement ({values}) {unit.name} at the end"
    folded = summary.get("folded")
    if folded and "median" in folded:
        median, least = (f"{100 * folded[key]:.3g} %" for key in ("median", "least"))
        yield f"folded      {median} of the rest angles (median of the creases), {least} at least"


def _array_lines(summary: Mapping[str, Any]) -> Iterator[str]:
    stress = summary.get("max_stress")
    if stress:
        error = summary.get("max_stress_error")
        of = "" if error is None else f", error {100 * error:.2g} %"
        yield f"stress      {shown_unit('Pa', stress).text(stress)} in the bars at most{of}"


def _contact_lines(summary: Mapping[str, Any]) -> Iterator[str]:
    """Contact of a run without a drive; the force of a drive shows contacts otherwise."""
    touching = summary.get("contact", ())
    if touching and "peak_kind" not in summary:
        most = max(touching, key=lambda one: one["largest_force"])
        force = shown_unit("N", most["largest_force"]).text(most["largest_force"])
        yield f"contact     {count(len(touching), 'pair')}; largest force {force}, {most['pair']}"


def _solve_lines(summary: Mapping[str, Any]) -> Iterator[str]:
    """Number of steps, and error of the energy balance."""
    steps, ends = summary.get("steps"), [step["end_time"] for step in summary.get("step", ())]
    if steps and ends and "energy_error" in summary:
        error = f"energy balance residual {100 * summary['energy_error']:.2g} %"
        if summary.get("numerical_dissipation"):
            error += f", numerical dissipation {100 * summary['numerical_dissipation']:.2g} %"
        yield f"solved      {ends[-1]:.4g} s in {count(steps, 'step')}; {error}"
