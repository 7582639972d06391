"""Results of a table of cases as text: the printed table, and lines of progress."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from fsm.case.loading.table import load_reference
from fsm.results.reported import shown_name
from fsm.text.load_names import load_units
from fsm.text.report_text import count
from fsm.text.shown_units import shown_unit, turns

_LOADS, _CHANNELS = 3, 4
"""Largest number of loads, and of channels of `report`, in the printed table."""
Row = Mapping[str, Any]


class _Column(NamedTuple):
    """Column: heading, function of a row that returns its number (SI), and SI unit.

    Numbers have four significant digits in the unit for the largest one; integers have all digits.
    """

    name: str
    of: Callable[[Row], Any]
    unit: str


def format_table(rows: Sequence[Row]) -> str:
    """Results as text: one line for each case, with the errors of failed rows below the table."""
    columns = [*_film_columns(rows), *_report_columns(rows), *_pull_columns(rows), *_load_columns(rows)]
    columns += [
        _Column("steps", lambda row: row.get("steps"), ""),
        _Column("run time", lambda row: row.get("wall_time_s"), "s"),
        _Column("warnings", lambda row: len(row["warnings"]) if "warnings" in row else None, ""),
    ]
    drawn = [_cells(column, rows) for column in columns]
    drawn.insert(0, ["case", *(str(row["case"]) for row in rows)])
    widths = [max(map(len, cells)) for cells in drawn]
    text = [
        "  ".join([line[0].ljust(widths[0]), *map(str.rjust, line[1:], widths[1:])]).rstrip()
        for line in zip(*drawn, strict=True)
    ]
    text.insert(1, "-" * (sum(widths) + 2 * len(widths) - 2))
    text += [f"{row['case']}: {line}" for row in rows for line in str(row.get("error", "")).splitlines()]
    return "\n".join(text)


def _film_columns(rows: Sequence[Row]) -> list[_Column]:
    if not any("frequency_hz" in row for row in rows):
        return []
    columns = {
        "frequency": ("frequency_hz", "Hz"), "center": ("amplitude_center", "m"), "patch": ("amplitude_patch", "m"),
        "decay": ("decay_rate", "1/s"), "largest stress": ("tension_state_largest_stress", "Pa"),
    }  # fmt: skip
    return [_Column(name, _number(key), unit) for name, (key, unit) in columns.items()]


def _pull_columns(rows: Sequence[Row]) -> list[_Column]:
    """Peak and stages of the first drive; separate columns for drives that turn."""
    columns = []
    for turning in sorted({turns(row) for row in rows if row.get("peak_force") is not None}):
        force, travel = ("moment", "turn") if turning else ("force", "travel")
        units = ("N m", "rad") if turning else ("N", "m")
        columns.append(_Column(f"peak {force}", _number("peak_force", turning), units[0]))
        columns.append(_Column(f"at {travel}", _number("peak_travel", turning), units[1]))
        stages = dict.fromkeys(key for row in rows if turns(row) == turning for key in row if _stage_name(key))
        columns += [_Column(f"{_stage_name(key)} from", _number(key, turning), units[1]) for key in stages]
    return columns


def _report_columns(rows: Sequence[Row]) -> list[_Column]:
    """Value at the end of the first channels of `report`."""
    units = {channel["name"]: channel["unit"] for row in rows for channel in row.get("report", ())}
    return [_Column(shown_name(name), _of_channel(name), units[name]) for name in list(units)[:_CHANNELS]]


def _of_channel(name: str) -> Callable[[Row], Any]:
    return lambda row: next((one.get("end") for one in row.get("report", ()) if one["name"] == name), None)


def _load_columns(rows: Sequence[Row]) -> list[_Column]:
    """Size and displacement of the first loads at the end."""
    names = list(dict.fromkeys(load["name"] for row in rows for load in row.get("loads", ())))[:_LOADS]
    columns = []
    for name in names:
        units = load_units(name)
        columns.append(_Column(name, _of_load(name, "size"), units.size))
        columns.append(_Column(units.way, _of_load(name, "displacement"), units.displacement))
    return columns


def _number(key: str, turning: bool | None = None) -> Callable[[Row], Any]:
    """Function for a number of rows whose first drive turns or not; None: of all rows."""
    return lambda row: row.get(key) if turning is None or turns(row) == turning else None


def _of_load(name: str, key: str) -> Callable[[Row], Any]:
    return lambda row: next((load[key] for load in row.get("loads", ()) if load["name"] == name), None)


def _cells(column: _Column, rows: Sequence[Row]) -> list[str]:
    """Heading and cells of a column."""
    values = [column.of(row) for row in rows]
    numbers = [value if isinstance(value, int | float) and not isinstance(value, bool) else None for value in values]
    unit = shown_unit(column.unit, max((abs(value) for value in numbers if value is not None), default=0.0))
    cells = [
        "-" if value is None else str(value) if isinstance(value, int) else f"{unit.factor * value:.4g}" for value in numbers
    ]
    return [f"{column.name} ({unit.name})" if unit.name else column.name, *cells]


def _stage_name(key: str) -> str:
    """Name of a stage from the key of its travel; empty for any other key, and for the stage at the start."""
    match = re.fullmatch(r"stage_(?!initial_)(.+)_travel", key)
    return match[1].replace("_", " ") if match else ""


def progress_line(row: Row) -> str:
    """Line about a finished row."""
    if row.get("error"):
        return f"{row['case']}: failed: {str(row['error']).splitlines()[0]}"
    parts = []
    if row.get("frequency_hz") is not None:
        parts.append(f"{row['frequency_hz']:.4g} Hz")
    if row.get("peak_force") is not None:
        at = shown_unit("rad" if turns(row) else "m", row["peak_travel"]).text(row["peak_travel"])
        parts.append(f"peak {row['peak_force']:.4g} {'N m' if turns(row) else 'N'} at {at}")
    elif row.get("report"):
        one = row["report"][0]
        if "end" in one:
            parts.append(f"{shown_name(one['name'])} {shown_unit(one['unit'], one['end']).text(one['end'])} at the end")
    elif row.get("loads"):
        load = row["loads"][0]
        units = load_units(load["name"])
        moved = shown_unit(units.displacement, load["displacement"]).text(load["displacement"])
        parts.append(f"{load['name']} {load['size']:.4g} {units.size}, {units.way} {moved}")
    if isinstance(row.get("wall_time_s"), int | float):
        parts.append(f"{row['wall_time_s']:.3g} s")
    if row.get("warnings"):
        parts.append(count(len(row["warnings"]), "warning"))
    return f"{row['case']}: {', '.join(parts)}"


def format_comparison(path: str | Path, rows: Sequence[Row]) -> str:
    """Comparison with the reference of a table, one line for each row and number; empty without a reference."""
    from fsm.views.plots.study import STUDY_RESULTS, relative_changes

    reference, lines = load_reference(path), []
    if not reference:
        return ""
    for name in STUDY_RESULTS:
        for row, found in zip(rows, relative_changes(rows, reference, name), strict=True):
            if found is not None:
                ours, theirs, band = found
                off = abs((100.0 + ours) / (100.0 + theirs) - 1.0)
                said = "within" if off <= 0.01 * band + 1e-12 else "outside"
                lines.append(
                    f"{row['case']}: {name} {ours:+.2f} %, reference {theirs:+.2f} %"
                    + (f", {said} its band of {band:g} %" if band else "")
                )
    return "\n".join(lines)
