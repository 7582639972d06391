"""Files of a whole table of cases: `summary.csv`, `study.parquet`, and `extremes.csv` of the recorded channels.

Results of a table of cases as text: the printed table, and lines of progress.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from fsm.case.loading.table import COLLECTED, EXTREMES, PARQUET, load_reference
from fsm.io.atomic_write import atomic_write
from fsm.io.csv_file import write_parquet
from fsm.results.reported import shown_name
from fsm.results.summary_file import heading
from fsm.text.load_names import load_units
from fsm.text.shown_units import count, shown_unit, turns

_FIRST = ("peak_force", "peak_travel", "frequency_hz", "amplitude_center", "amplitude_patch")
"""Numbers in the first columns, before displacements of loads."""
_LAST_OF_FIRST = ("exit_code", "warnings", "error")
_KEPT = ("loads", "drives", "warnings", "channels", "report")
"""Parts of a summary that rows have as they are."""
_SEPARATOR = " | "
"""Text between several warnings or lines of an error in a cell."""
_EXTREMES = ("unit", "min", "min_time", "min_travel", "min_at", "max", "max_time", "max_travel", "max_at")
"""Entries of a channel in the summary of a run."""


def flat_numbers(summary: Mapping[str, Any], nested: bool = False) -> dict[str, Any]:
    """Numbers and texts of a summary; keys of nested tables are joined by "_".

    Stages give the travel at their start, probes a number for each axis. The result also has the lists `loads`, `drives`,
    `report` and `warnings`, and the dict `channels`, unless it is of a `nested` table. Other lists are left out, and the
    peak of a run without a drive.
    """
    flat: dict[str, Any] = {}
    for key, value in summary.items():
        if key in _KEPT:
            flat |= {} if nested else {key: value}
        elif key == "stages":
            flat |= {f"stage_{stage['name'].replace(' ', '_')}_travel": stage["travel"] for stage in value}
        elif key == "probe_displacement":
            for name, moved in value.items():
                flat |= {f"{key}_{name} {axis}": x for axis, x in zip("xyz", moved, strict=True)}
        elif isinstance(value, Mapping):
            flat |= {f"{key}_{below}": number for below, number in flat_numbers(value, True).items()}
        elif not isinstance(value, list) and not (key in ("peak_force", "peak_travel") and "peak_kind" not in summary):
            flat[key] = value
    return flat


def write_summaries(folder: Path, rows: Sequence[Mapping[str, Any]], units: Mapping[str, str]) -> None:
    """Write `summary.csv`, one row for each case, and `study.parquet` with the same columns, if pyarrow is installed.

    The first columns are the name, the inputs of the table, the peak (films: frequency and amplitudes), the displacements of
    loads, the channels of `report`, the exit code, warnings and errors as text. Numbers are in SI, with the unit in the
    heading.

    Parameters
    ----------
    folder : folder of the table
    rows : rows as `fsm.run.table.run_table` returns them
    units : SI units of the inputs by their paths
    """
    if not len(rows):
        return
    first, loads, rest = dict[str, None](), dict[str, None](), dict[str, None]()
    for row in rows:
        for known, found in zip((first, loads, rest), _columns(row, set(units)), strict=True):
            known |= dict.fromkeys(found)
    inputs = {f"{path} ({unit})" if unit else path: path for path, unit in units.items()}
    columns = ["case", *inputs, *first, *loads, *_LAST_OF_FIRST, *rest]

    def line(row: Mapping[str, Any]) -> dict[str, Any]:
        first, loads, rest = _columns(row, set(units))
        return rest | loads | first | {name: row.get(path) for name, path in inputs.items()} | {
            "case": row["case"], "exit_code": row.get("exit_code", 0), "warnings": _SEPARATOR.join(row.get("warnings", ())),
            "error": _SEPARATOR.join(str(row.get("error", "")).splitlines()),
        }  # fmt: skip

    def lines() -> Iterator[list[Any]]:
        return ([cells.get(name) for name in columns] for cells in map(line, rows))

    _write(folder / COLLECTED, columns, lines())
    write_parquet(folder / PARQUET, columns, lines)


def _columns(row: Mapping[str, Any], paths: set[str]) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """First numbers, numbers of loads, and all other numbers of a row, by heading."""
    turning = turns(row)
    first = {heading(key, turning): row[key] for key in _FIRST if row.get(key) is not None}
    loads: dict[str, Any] = {}
    for load in row.get("loads", ()):
        units = load_units(load["name"])
        loads[f"{load['name']} ({units.size})"] = load["size"]
        loads[f"{units.way} of {load['name']} ({units.displacement})"] = load["displacement"]
    for channel in row.get("report", ()):
        loads |= {f"{channel['name']} {key} ({channel['unit']})": channel.get(key) for key in ("end", "min", "max")}
    rest: dict[str, Any] = {}
    for drive in row.get("drives", ()):
        of = drive["name"].endswith("(turn)")
        rest |= {f"{drive['name']}: {heading(key, of)}": value for key, value in drive.items() if key != "name"}
    own = {"case", "loads", "drives", "channels", "report", *_FIRST, *_LAST_OF_FIRST, *paths}
    rest |= {heading(key, turning): value for key, value in row.items() if key not in own}
    return first, loads, rest


def write_extremes(folder: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write `extremes.csv`: smallest and largest value of every recorded channel, one row for each case and channel.

    Without channels the file of an earlier table is deleted.
    """
    known, turning = set[str](), set[bool]()
    for row in rows:
        if row.get("channels"):
            turning.add(turns(row))
            known.update(*row["channels"].values())
    if not known:
        (folder / EXTREMES).unlink(missing_ok=True)
        return
    travel = " or ".join("rad" if one else "m" for one in sorted(turning))
    units = {"time": "s", "travel": travel}
    headings = {f"{end}_{name}": f"{end}_{name} ({unit})" for end in ("min", "max") for name, unit in units.items()}
    keys = [key for key in _EXTREMES if key in known]
    lines = ([row["case"], name, *map(entry.get, keys)] for row in rows for name, entry in row.get("channels", {}).items())
    _write(folder / EXTREMES, ["case", "channel", *(headings.get(key, key) for key in keys)], lines)


def _write(path: Path, heading: Sequence[str], lines: Iterable[Sequence[Any]]) -> None:
    """Write lines as CSV; None is an empty cell."""
    with atomic_write(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(heading)
        writer.writerows(lines)


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
