"""Check of the summary in a results file: figures and tables use its entries without further checks."""

from __future__ import annotations

import math
from typing import Any

_ITEMS = {
    "stages": ("name", ("travel", "force")), "events": ("kind", ("travel", "end_travel", "force", "end_force")),
    "loads": ("name", ("size", "displacement")),
    "drives": ("name", ("peak_force", "peak_travel", "final_force", "final_travel")),
    "report": ("name", ()), "reactions": ("joint", ()), "margins": ("joint", ("margin", "angle", "available", "required")),
}  # fmt: skip
"""Lists in a summary: the key of the item's name, and the keys of its numbers."""
_NUMBERS = (
    "peak_force", "peak_travel", "frequency_hz", "frequency_fft_hz", "frequency_resolution_hz", "decay_rate", "free_from",
    "dynamic_peak_force", "dynamic_peak_travel",
)  # fmt: skip
"""Numbers that figures show, if present."""
_TOGETHER = {
    "stages": ("peak_force", "peak_travel"), "frequency_hz": ("frequency_fft_hz", "frequency_resolution_hz"),
    "dynamic_peak_force": ("dynamic_peak_travel",),
}  # fmt: skip
"""Numbers that must be present with another entry."""
_STATE = ("smallest_stress", "largest_stress", "slack_fraction")
"""Numbers of `tension_state`."""


def check_summary(summary: dict[str, Any]) -> dict[str, Any]:
    """Check the types of the entries of a summary and return it unchanged.

    Raises
    ------
    ValueError
        An entry that figures and tables use has the wrong type, or is missing although another one needs it.
    """
    for key, (name, numbers) in _ITEMS.items():
        items = summary.get(key, [])
        if not isinstance(items, list) or not all(_is_item(item, name, numbers) for item in items):
            raise ValueError(f"`{key}` in the summary is not a list of entries with `{name}` and finite numbers")
    warnings = summary.get("warnings", [])
    if not isinstance(warnings, list) or not all(isinstance(text, str) for text in warnings):
        raise ValueError("`warnings` in the summary is not a list of texts")
    for key in _NUMBERS:
        if not isinstance(summary.get(key), int | float | None):
            raise ValueError(f"{key} in the summary is not a number")
    for first, others in _TOGETHER.items():
        for key in others:
            if summary.get(first) is not None and summary.get(key) is None:
                raise ValueError(f"{key} in the summary is missing")
    state, modes = summary.get("tension_state"), summary.get("modes_hz", [])
    if isinstance(state, dict) and not all(isinstance(state.get(key), int | float) for key in _STATE):
        raise ValueError(f"tension_state in the summary needs the numbers {', '.join(_STATE)}")
    if not isinstance(modes, list) or not all(isinstance(value, int | float) for value in modes):
        raise ValueError("modes_hz in the summary is not a list of numbers")
    return summary


def _is_item(item: Any, name: str, numbers: tuple[str, ...]) -> bool:
    if not isinstance(item, dict) or not isinstance(item.get(name), str):
        return False
    values = [item.get(key, math.nan) for key in numbers]
    return all(value is None or (isinstance(value, int | float) and math.isfinite(value)) for value in values)
