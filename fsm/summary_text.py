"""Lines of text about a run from its summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fsm.load_names import load_units
from fsm.results.stated_errors import largest_errors

__all__ = ["summary_lines"]

_ERRORS = 6
"""Largest number of errors that the text lists for a cause."""
_LIMIT_POINTS = 6
"""Largest number of limit points that the text lists for a step."""


def summary_lines(summary: Mapping[str, Any], folder: Path) -> list[str]:
    """Lines printed after a run: peak, stages, warnings and the folder of the files."""
    lines = []
    if summary.get("frequency_hz") is not None:
        lines.append(
            f"frequency   {summary['frequency_hz']:.5g} Hz by fit, {summary['frequency_fft_hz']:.5g} Hz by FFT "
            f"(resolution {summary['frequency_resolution_hz']:.3g} Hz)"
        )
        lines.append(f"decay       {summary['decay_rate']:.4g} 1/s, damping ratio {summary['damping_ratio']:.3g}")
    for name in ("center", "patch"):
        if summary.get(f"amplitude_{name}") is not None:
            lines.append(f"amplitude   {1e3 * summary[f'amplitude_{name}']:.4g} mm at the {name}")
    if summary.get("modes_hz"):
        lines.append(f"modes       {', '.join(f'{f:.4g}' for f in summary['modes_hz'][:6])} ... Hz")
    if summary.get("tension_state"):
        state = summary["tension_state"]
        lines.append(
            f"tension     {1e-6 * state['smallest_stress']:.4g} to {1e-6 * state['largest_stress']:.4g} MPa, "
            f"{100 * state['slack_fraction']:.3g} % slack"
        )
    lines += _step_lines(summary.get("step", ()))
    lines += [text for step in summary.get("step", ()) for text in _limit_points(step)]
    turns = any(step.get("drive", "").endswith("(turn)") for step in summary.get("step", ()))
    unit, way = ("N m", "mrad of turn") if turns else ("N", "mm of travel")
    if summary.get("peak_force"):
        lines.append(
            f"peak force  {summary['peak_force']:.4g} {unit} at {summary['peak_travel'] * 1e3:.2f} {way}"
            f" ({summary.get('peak_kind', 'quasi-static')})"
        )
    magnitude = summary.get("largest_magnitude")
    if magnitude is not None and magnitude > summary.get("peak_force", 0.0):
        at = summary["largest_magnitude_travel"] * 1e3
        lines.append(f"            -{magnitude:.4g} {unit} at {at:.2f} {way} (largest magnitude)")
    if summary.get("dynamic_peak_force") is not None and summary.get("peak_kind") != "dynamic":
        at = summary["dynamic_peak_travel"] * 1e3
        lines.append(f"dynamic     {summary['dynamic_peak_force']:.4g} {unit} at {at:.2f} {way} (dynamic peak)")
    for stage in summary.get("stages", ()):
        lines.append(
            f"stage       {stage['name']} from {stage['travel'] * 1e3:.2f} {way}, force {stage['force']:.4g} {unit}"
        )
    lines += [f"error       {text}" for text in _error_texts(summary.get("errors", {}))]
    lines += [f"warning     {text}" for text in summary.get("warnings", ())]
    lines.append(f"results     {folder}")
    return lines


def _error_texts(errors: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """One text for each cause of errors: the errors and how they were found, or why there are none."""
    texts = []
    for cause, stated in errors.items():
        named = [f"{name} {100.0 * error:.2g} %" for name, error in largest_errors(stated)]
        more = f", and {len(named) - _ERRORS} more" if len(named) > _ERRORS else ""
        listed = f"{', '.join(named[:_ERRORS])}{more} ({stated['by']})"
        texts.append(f"{cause}: {listed if named else stated['by']}")
    return texts


def _step_lines(steps: Sequence[dict[str, Any]]) -> list[str]:
    """One line for each step of a case with `[[step]]`; no lines for other cases."""
    if {step["name"] for step in steps} <= {"start", "hold", "deploy", "vibrate"}:
        return []
    lines = []
    for step in steps:
        text = f"step        {step['name']}: {step['kind']}, until {step['end_time']:.4g} s"
        if step.get("peak_force"):
            unit = "N m" if step["drive"].endswith("(turn)") else "N"
            text += f", peak force {step['peak_force']:.4g} {unit}"
        if "frequencies_hz" in step:
            text += f", {', '.join(f'{f:.4g}' for f in step['frequencies_hz'][:6])} Hz"
        lines.append(text)
    return lines


def _limit_points(step: dict[str, Any]) -> list[str]:
    """One line for each of the first limit points of a path by arc length."""
    points, lines = step.get("limit_points", ()), []
    for point in points[:_LIMIT_POINTS]:
        loads = [
            f"{name} {load['size']:.4g} {load_units(name).size} at {1e3 * load['displacement']:.4g} {load_units(name).shown}"
            for name, load in point["loads"].items()
        ]
        text = ", ".join(loads) or f"program time {point['program_time']:.4g} s"
        lines.append(f"limit point {text}; negative modes beyond it: {point['negative_modes']}")
    if len(points) > _LIMIT_POINTS:
        lines.append(f"            and {len(points) - _LIMIT_POINTS} more; see step.limit_points in summary.json")
    return lines
