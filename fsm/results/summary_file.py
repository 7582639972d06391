"""Reading and writing of `summary.json`, which carries a checksum and is written in one step.

Check of the summary in a results file: figures and tables use its entries without further checks.

Names of the errors that a summary states.

Units of the numbers of a summary, for the headings of tables.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from fsm.errors import CaseError
from fsm.io.atomic_write import atomic_write

SUMMARY = "summary.json"
"""Name of the summary file; a folder that has it holds a solved case."""

_KEY = "checksum"


def write_summary(summary: Mapping[str, Any], path: str | Path) -> None:
    """Write a summary as JSON; the key `checksum` is the SHA-256 of the other keys."""
    with atomic_write(path, to_disk=True) as part:
        part.write_text(json.dumps({**summary, _KEY: _checksum(summary)}, indent=2) + "\n", encoding="utf-8")


def read_summary(path: str | Path) -> dict[str, Any]:
    """Read a summary, without its checksum.

    Raises
    ------
    CaseError
        The file is missing, is not a summary, or was changed after it was written.
    """
    try:
        summary = json.loads(Path(path).read_text(encoding="utf-8"))
        stored = summary.pop(_KEY)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise CaseError(f"is not a summary of a run ({error}); run the case again", str(path)) from None
    if stored != _checksum(summary):
        raise CaseError("is damaged or was edited: its checksum differs; run the case again", str(path))
    return dict(summary)


def _checksum(summary: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(summary, sort_keys=True).encode()).hexdigest()


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


_LABELS = {
    "positions_along": "positions along", "probes": "probe", "frequencies": "frequencies of", "loads": "displacement of",
    "limit_points": "limit points of",
}  # fmt: skip


def largest_errors(stated: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Names of the numbers of a statement, and the error of each; the largest error where there are several.

    >>> largest_errors({"by": "comparison", "peak_force": 0.02, "probes": {"tip": 0.01}, "positions_along": {"z": 0.3}})
    [('peak force', 0.02), ('probe tip', 0.01), ('positions along z', 0.3)]
    """
    found: list[tuple[str, float]] = []
    for name, errors in stated.items():
        if name in ("by", "positions_since") or errors is None:
            continue
        each = errors.items() if isinstance(errors, Mapping) else [("", errors)]
        for one, error in each:
            known = [e for e in (error if isinstance(error, Sequence) else [error]) if e is not None]
            if known:
                found.append((f"{_LABELS.get(name, name.replace('_', ' '))} {one}".strip(), float(max(known))))
    return found


_EXACT = {
    "joint_opening": "m", "decay_rate": "1/s", "largest_magnitude": "N", "free_from": "s", "max_stress": "Pa",
    "folded_strain_energy": "J",
}  # fmt: skip
_ENDINGS = {
    "_force": "N", "_travel": "m", "_hz": "Hz", "_s": "s", "_time": "s", "_stress": "Pa", "_opening": "m",
    "_displacement": "m", "_energy": "J", "_velocity": "m/s", "_acceleration": "m/s^2", "_moment": "N m",
}  # fmt: skip
"""Unit by the end of a key; a unit in the key itself is replaced by the one in brackets."""
_BEGINNINGS = {
    "amplitude_": "m", "probe_displacement_": "m", "max_difference_rigid_displacement": "m", "max_asynchronism_": "m",
    "folded_strain_energy_": "J",
}  # fmt: skip
_TURNED = {"m": "rad", "N": "N m"}
_OF_DRIVE = ("peak_", "final_", "dynamic_peak_", "start_up_", "largest_magnitude", "contact_", "bending_", "stage_")
"""Beginnings of the numbers of the first drive, which are a moment and a turn if this drive turns."""


@lru_cache(maxsize=10_000)
def heading(key: str, turns: bool = False) -> str:
    """Heading of a number of a summary, with its unit in brackets: "peak_force (N)", "wall_time (s)".

    Parameters
    ----------
    key : key of the number; keys of nested tables are joined by "_"
    turns : whether the first drive turns bodies, so that its numbers are in N m and rad
    """
    unit = _EXACT.get(key) or next((unit for end, unit in _ENDINGS.items() if key.endswith(end)), "")
    unit = unit or next((unit for begin, unit in _BEGINNINGS.items() if key.startswith(begin)), "")
    if not unit:
        return key
    if turns and key.startswith(_OF_DRIVE) and unit in _TURNED:
        return f"{key.replace('force', 'moment').replace('travel', 'turn')} ({_TURNED[unit]})"
    return f"{key.removesuffix('_hz').removesuffix('_s')} ({unit})"
