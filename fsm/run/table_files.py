"""Files of a whole table of cases: `summary.csv`, `study.parquet`, and `extremes.csv` of the recorded channels."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fsm.case.loading.table import COLLECTED, EXTREMES, PARQUET
from fsm.io.atomic_write import atomic_write
from fsm.io.parquet_file import write_parquet
from fsm.results.summary_units import heading
from fsm.text.load_names import load_units
from fsm.text.shown_units import turns

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
