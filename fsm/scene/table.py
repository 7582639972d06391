"""Tables of cases: a CSV whose columns are dotted paths into a base case.

The base is ``case.toml`` beside the CSV, or the file that the first line names::

    # base = other.toml
    case, strip.fold_angle, crease.stiffness
    80-low, 80 deg, 0.002
    83-low, 83 deg,

A line ``# reference = paper.csv`` names percentages to compare with, see `load_reference`.

A cell holds what `--set` takes: a TOML value or bare text, ``none`` to take the key or section out; an empty
cell leaves the base as it is. File names in cells count from the folder of the base. The column ``case``
names the rows; without it names are made of the values.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsm.errors import CaseError, Fault
from fsm.scene.load_case import LoadedCase, few, read_case, read_text, read_toml
from fsm.scene.overrides import apply_overrides, check_path, split_override
from fsm.scene.toml_text import case_text

__all__ = ["COLLECTED", "OVERLAY", "STUDY", "TableCase", "load_reference", "load_table"]

NAME = "case"
BASE = "case.toml"

COLLECTED, OVERLAY, STUDY = "summary.csv", "overlay.png", "study.png"
"""Files that a table writes beside the folders of its rows."""

_LONGEST = 200
"""Bytes of a row's name; file systems allow 255, and files that are being written have longer names."""


@dataclass(frozen=True)
class TableCase:
    """A row of a table.

    Attributes
    ----------
    name : str
        Unique in its table, and fit for the name of a folder.
    overrides : dict
        Path to text, of the cells that are not empty.
    loaded : LoadedCase
    """

    name: str
    overrides: dict[str, str]
    loaded: LoadedCase


@dataclass(frozen=True)
class _Row:
    number: int
    name: str
    values: dict[str, str]


def load_table(path: str | Path, overrides: Sequence[str] = ()) -> list[TableCase]:
    """Read a table and check all of its cases.

    Parameters
    ----------
    path : str or Path
    overrides : sequence of str
        ``"path=value"``, applied to every row after its own values.

    Raises
    ------
    CaseError
        All faults of all rows, with row numbers as a text editor counts them; what every row gets wrong in
        the same way is told once, of the base.
    """
    base, lines = _lines(path)
    rows, faults = _rows(lines)
    split = [split_override(text) for text in overrides]
    faults += [item for item in split if isinstance(item, Fault)]
    if faults:
        raise CaseError(faults, str(path))
    file = Path(path).parent / base
    data, unknown = _base(file, [item for item in split if not isinstance(item, Fault)], str(path))
    cases, faults = _read_rows(rows, data, [item for item in split if not isinstance(item, Fault)], file)
    if unknown or faults:
        raise CaseError(few([*unknown, *faults]), str(path))
    return cases


def _lines(path: str | Path) -> tuple[str, list[tuple[int, list[str]]]]:
    """Name of the base and the rows of cells with their numbers, header first."""
    text = read_text(path)
    lines = text.splitlines()
    return _named(lines, "base") or BASE, _cells(lines)


def _named(lines: Sequence[str], key: str) -> str:
    """What a comment before the first row says of a file, ``# key = name``; empty if nothing does."""
    for line in lines:
        if line.strip() and not line.lstrip().startswith("#"):
            break
        match = re.match(rf"#\s*{key}\s*=\s*[\"']?(.+?)[\"']?\s*$", line.strip())
        if match:
            return match[1]
    return ""


def _cells(lines: Sequence[str]) -> list[tuple[int, list[str]]]:
    """Cells of all lines but comments and empty ones, with their numbers."""
    kept = [
        (n, line)
        for n, line in enumerate(lines, 1)
        if line.strip(" \t,;") and not line.lstrip().startswith("#")
    ]
    header = kept[0][1] if kept else ""
    separator = next((mark for mark in (";", "\t") if mark in header), ",")
    rows = []
    for number, line in kept:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
        rows.append((number, [cell.strip() for cell in cells]))
    return rows


def load_reference(path: str | Path) -> dict[str, dict[str, float]]:
    """Changes that a table is compared with: of each row by name, numbers of the summary by name, in % of the first row.

    The file that the table names has a column ``case`` and one for each number; a column ``<number> band`` says how far off
    it may be by how it was measured, in %. An empty cell says nothing. Empty if the table names none.

    Raises
    ------
    CaseError
        It cannot be read, or a cell is not a number.
    """
    name = _named(read_text(path).splitlines(), "reference")
    if not name:
        return {}
    file = Path(path).parent / name
    rows = _cells(read_text(file).splitlines())
    if len(rows) < 2 or NAME not in rows[0][1]:
        raise CaseError(f"needs a column `{NAME}` and a row for each case that is compared", str(file))
    header = rows[0][1]
    found: dict[str, dict[str, float]] = {}
    for number, cells in rows[1:]:
        values = dict(zip(header, cells, strict=False))
        name = values.pop(NAME, "")
        try:
            found[name] = {key: float(value) for key, value in values.items() if value}
        except ValueError as error:
            raise CaseError([Fault(f"row {number}", f"{error}; percentages are plain numbers")], str(file)) from None
    return found


def _rows(lines: list[tuple[int, list[str]]]) -> tuple[list[_Row], list[Fault]]:
    """Named rows of values, and the faults of header and names."""
    if len(lines) < 2:
        return [], [Fault("", "has no rows; write a header of dotted paths and one row a case")]
    header = lines[0][1]
    faults = _header_faults(header)
    rows = []
    for number, cells in lines[1:]:
        if len(cells) != len(header):
            faults.append(Fault(f"row {number}", f"has {len(cells)} cells; the header has {len(header)}"))
            continue
        values = dict(zip(header, cells, strict=True))
        rows.append(_Row(number, _name(values), {k: v for k, v in values.items() if v and k != NAME}))
    return rows, faults + _name_faults(rows, NAME in header)


def _header_faults(header: Sequence[str]) -> list[Fault]:
    faults = []
    for index, column in enumerate(header):
        problem = (
            "" if column == NAME else check_path(column) if column else "column without a name; give its path"
        )
        if column and column in header[:index]:
            problem = "stands twice in the header; leave one of them"
        if problem:
            faults.append(Fault(f"column {column or index + 1}", problem))
    return faults


def _name(values: Mapping[str, str]) -> str:
    """Name of a row: the one given, or last part of the path and value of every cell; fit for a folder."""
    name = values.get(NAME, "")
    if not name:
        name = "_".join(
            f"{path.split('.')[-1]}-{value}" for path, value in values.items() if value and path != NAME
        )
    safe = re.sub(r"[^\w.+ -]+", "_", " ".join(name.split())).strip("._ ")
    return safe.encode()[:_LONGEST].decode(errors="ignore").rstrip("._ ") or "base"


def _name_faults(rows: Sequence[_Row], named: bool) -> list[Fault]:
    """Rows whose name is taken by another row or by a file of the table; case does not distinguish folders everywhere."""
    faults: list[Fault] = []
    first: dict[str, int] = {}
    for row in rows:
        key = row.name.casefold()
        if key in (COLLECTED, OVERLAY, STUDY):
            faults.append(Fault(f"row {row.number}", f'the name "{row.name}" is that of a file of the table; give another'))
        if key in first:
            why = f'the name "{row.name}" is' if named else "the same values are"
            hint = (
                "give each row its own"
                if named
                else f"give the rows names in a column `{NAME}`, or delete one"
            )
            faults.append(Fault(f"row {row.number}", f"{why} in row {first[key]} already; {hint}"))
        first.setdefault(key, row.number)
    return faults


def _base(file: Path, pairs: Sequence[tuple[str, str]], source: str) -> tuple[dict[str, Any], list[Fault]]:
    """Tables of the base, and the overrides for all rows that lead nowhere."""
    try:
        data = read_toml(file)
    except CaseError as error:
        raise CaseError([Fault(f"base {file}", str(fault)) for fault in error.faults], source) from None
    return data, apply_overrides(data, pairs)[1]


def _read_rows(
    rows: Sequence[_Row], base: Mapping[str, Any], pairs: Sequence[tuple[str, str]], file: Path
) -> tuple[list[TableCase], list[Fault]]:
    cases, faults = [], []
    for row in rows:
        data, wrong = apply_overrides(base, row.values.items(), label="")
        data, _ = apply_overrides(data, pairs)
        case, found = read_case(data, file.parent)
        faults.append((row.number, [*wrong, *found]))
        if case is not None:
            cases.append(TableCase(row.name, row.values, LoadedCase(case, case_text(case), file)))
    return cases, _merge(faults, file)


def _merge(faults: Iterable[tuple[int, list[Fault]]], file: Path) -> list[Fault]:
    """Faults with their row; those that all rows share once, with the base."""
    by_row = list(faults)
    shared = (
        [fault for fault in by_row[0][1] if all(fault in found for _, found in by_row)]
        if len(by_row) > 1
        else []
    )
    merged = [
        Fault(f"base {file}: {fault.path}" if fault.path else f"base {file}", fault.message)
        for fault in shared
    ]
    for number, found in by_row:
        merged += [
            Fault(f"row {number}: {fault.path}" if fault.path else f"row {number}", fault.message)
            for fault in found
            if fault not in shared
        ]
    return merged
