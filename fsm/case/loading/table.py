"""Tables of cases: a CSV file whose columns are dotted paths of a base case.

The base case is ``case.toml`` in the folder of the CSV file, or the file named in the first line::

    # base = other.toml
    case, strip.fold_angle, crease.stiffness
    80-low, 80 deg, 0.002
    83-low, 83 deg,

The row after the header may give units: ``units, deg, N mm/rad``. Tables with semicolons or tabs may have decimal commas.

A line ``# reference = paper.csv`` names a file of percentages for comparison, see `load_reference`.

A cell contains a value as for `--set`: a TOML value, plain text, or ``none`` to remove the key or section. An empty cell
keeps the value of the base case. File names in cells are relative to the folder of the base case. The column ``case`` gives
the names of the rows; without it, names consist of the values.
"""

from __future__ import annotations

import csv
import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from fsm.case.loading.load_case import LoadedCase, SharedSections, first_faults, read_case
from fsm.case.loading.overrides import REMOVE, apply_overrides, check_path, keys_of, place_at, split_override
from fsm.case.loading.toml_file import read_text, read_toml
from fsm.case.loading.toml_text import case_text
from fsm.case.models.case import Case
from fsm.case.schema.units import parse_unit
from fsm.errors import CaseError, Fault
from fsm.text.short_repr import ShortRepr

NAME = "case"
BASE = "case.toml"

COLLECTED, EXTREMES, PARQUET, STORE = "summary.csv", "extremes.csv", "study.parquet", "rows.db"
OVERLAY, STUDY, PEAKS = "overlay.png", "study.png", "peaks.png"
_FILES = COLLECTED, EXTREMES, PARQUET, STORE, OVERLAY, STUDY, PEAKS
"""Files that a table writes next to the folders of its rows."""

_MOST_TEXT = 256 * 2**20
"""Largest size of a table, bytes; a part of a long table reads the whole file."""
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_COMMA = re.compile(r"([-+]?\d*),(\d+)((?![\d.,]).*)")
"""Number with one comma, and what follows it."""
_LONGEST = 200
"""Largest length of a row's name, bytes; file systems allow 255, and temporary files have longer names."""


@dataclass(frozen=True, repr=False)
class TableCase(ShortRepr):
    """Row of a table.

    Attributes
    ----------
    number : int
        Number in the whole table, from 0.
    name : str
        Unique name, which is also the name of the row's folder.
    overrides : dict
        Text of each non-empty cell by its path.
    hash : str
        Hash of the complete case.
    base : BaseCase
    """

    number: int
    name: str
    overrides: dict[str, str]
    hash: str
    base: BaseCase = field(repr=False)

    @property
    def case(self) -> Case:
        """Case of the row, see `loaded`."""
        return self.loaded.case

    @property
    def loaded(self) -> LoadedCase:
        """Case with its text and the file of the base case, read here: a long table does not keep its cases.

        Raises
        ------
        CaseError
            A data file of the case has changed since the table was read.
        """
        case, _, _ = self.base.read(self.overrides)
        text = "" if case is None else case_text(case)
        if case is None or _digest(text) != self.hash:
            raise CaseError(f"a file of {self.name} has changed since the table was read; run it again", str(self.base.path))
        return LoadedCase(case, text, self.base.path)


class BaseCase:
    """Base case of a table.

    Parameters
    ----------
    path : Path
    data : tables of the base case
    pairs : sequence of (path, value)
        Changes of every row, after its own values.
    """

    def __init__(self, path: Path, data: Mapping[str, Any], pairs: Sequence[tuple[str, str]]) -> None:
        self.path, self._data, self._pairs, self._shared = path, data, pairs, SharedSections(data)

    def read(self, values: Mapping[str, str]) -> tuple[Case | None, list[Fault], list[Fault]]:
        """Case of a row with these cells, faults of their paths, and faults of the case."""
        data, wrong = apply_overrides(self._data, [*values.items(), *self._pairs], label="")
        case, found = read_case(data, self.path.parent, self._shared)
        own = {path for path, _ in self._pairs} - set(values)  # their faults are those of the base case
        return case, [fault for fault in wrong if fault.path not in own], found


def inputs_of(case: Case, cells: Mapping[str, str], paths: Iterable[str]) -> dict[str, Any]:
    """Values of some paths of a row: numbers in SI, also those of the base case; texts as in the cells."""
    return {path: _value_at(case, path, cells.get(path, "")) for path in paths}


class Table(NamedTuple):
    """Table, or a part of it.

    Attributes
    ----------
    cases : rows of the part
    rows : number of rows of the whole table
    units : SI unit of each column by its path; empty for texts and numbers without a unit
    """

    cases: list[TableCase]
    rows: int
    units: dict[str, str]


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
        All faults of all rows, with row numbers as in a text editor. A fault that all rows share appears once, for the base
        case.
    """
    return read_table(path, overrides).cases


def read_table(
    path: str | Path, overrides: Sequence[str] = (), part: tuple[int, int] = (1, 1), most: int | None = None
) -> Table:
    """Read a table and check the cases of a part of it.

    Parameters
    ----------
    path, overrides : as for `load_table`
    part : (int, int)
        (3, 10): every tenth row, from the third.
    most : int, optional
        Largest number of rows of the part.

    Raises
    ------
    CaseError
        As `load_table`; or the part has too many rows.
    """
    base, lines = _lines(path)
    if most is not None:
        _check_length(lines, part, most, str(path))
    rows, faults = _rows(_cells(lines))
    taken = range(part[0] - 1, len(rows), part[1])
    split = [split_override(text) for text in overrides]
    faults += [item for item in split if isinstance(item, Fault)]
    if faults:
        raise CaseError(faults, str(path))
    file = Path(path).parent / base
    data, unknown = _base(file, [item for item in split if not isinstance(item, Fault)], str(path))
    pairs = [item for item in split if not isinstance(item, Fault)]
    cases, faults = _read_rows(rows, taken, data, pairs, file)
    if unknown or faults:
        raise CaseError(first_faults([*unknown, *faults]), str(path))
    columns = dict.fromkeys(key for row in rows for key in row.values)
    return Table(cases, len(rows), {path: _unit_at(data, rows, path) for path in columns})


def _unit_at(base: Mapping[str, Any], rows: Sequence[_Row], path: str) -> str:
    """SI unit of a column; a unit may depend on other keys of its section."""
    row = next(row for row in rows if path in row.values)
    place = place_at(apply_overrides(base, row.values.items())[0], path)
    return place.unit() if place is not None else ""


def _value_at(case: Any, path: str, cell: str) -> Any:
    """Number of a case at a path (SI), or the text of the cell if there is no number."""
    if cell.strip() == REMOVE:
        return REMOVE
    here = case
    for key in keys_of(path):
        inside = isinstance(here, tuple) and isinstance(key, int) and key < len(here)
        here = here[key] if inside else getattr(here, str(key), None)
    return here if isinstance(here, int | float | str) else cell


def _check_length(lines: Sequence[str], part: tuple[int, int], most: int, source: str) -> None:
    """Refuse a part with too many rows; a long table is counted, and not read."""
    kept = _kept(lines)
    first = _cells([line for _, line in kept[:2]])
    rows = len(kept) - 1 - bool(len(first) == 2 and _units(first[0][1], first[1][1]))
    taken = len(range(part[0] - 1, rows, part[1]))
    if taken > most:
        parts = -(-rows // most)
        text = f"has {taken:,} rows; a run takes at most {most:,}: run it in parts, --part 1/{parts} to {parts}/{parts}"
        raise CaseError(text, source)


def _lines(path: str | Path) -> tuple[str, list[str]]:
    """File name of the base case, and the lines of a table."""
    lines = read_text(path, _MOST_TEXT).splitlines()
    return _named(lines, "base") or BASE, lines


def _named(lines: Sequence[str], key: str) -> str:
    """File name in a comment ``# key = name`` before the first row; empty if there is none."""
    for line in lines:
        if line.strip() and not line.lstrip().startswith("#"):
            break
        match = re.match(rf"#\s*{key}\s*=\s*[\"']?(.+?)[\"']?\s*$", line.strip())
        if match:
            return match[1]
    return ""


def _kept(lines: Sequence[str]) -> list[tuple[int, str]]:
    """Lines that are neither comments nor empty, with their numbers."""
    return [(n, line) for n, line in enumerate(lines, 1) if line.strip(" \t,;") and not line.lstrip().startswith("#")]


def _cells(lines: Sequence[str]) -> list[tuple[int, list[str]]]:
    """Cells of all lines that are neither comments nor empty, with line numbers."""
    kept = _kept(lines)
    header = kept[0][1] if kept else ""
    separator = next((mark for mark in (";", "\t") if mark in header), ",")
    rows = []
    for number, line in kept:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
        rows.append((number, [cell.strip() for cell in cells]))
    return rows if separator == "," else _with_points(rows)


def _with_points(rows: list[tuple[int, list[str]]]) -> list[tuple[int, list[str]]]:
    """Rows with points in place of decimal commas, if a comma of the table cannot separate thousands."""
    commas = [match for _, cells in rows for cell in cells if (match := _COMMA.fullmatch(cell))]
    if all(re.fullmatch(r"[-+]?[1-9]\d{0,2},\d{3}", f"{match[1]},{match[2]}") for match in commas):
        return rows
    return [(number, [_COMMA.sub(r"\1.\2\3", cell) for cell in cells]) for number, cells in rows]


def load_reference(path: str | Path) -> dict[str, dict[str, float]]:
    """Reference changes of a table: for each row, numbers of the summary as changes from the first row in %.

    The reference file has a column ``case`` and one column for each number. A column ``<number> band`` gives the uncertainty
    of the reference in %. Empty cells are ignored. The result is empty if the table names no reference file.

    Raises
    ------
    CaseError
        The file cannot be read, or a cell is not a number.
    """
    name = _named(read_text(path, _MOST_TEXT).splitlines(), "reference")
    if not name:
        return {}
    file = Path(path).parent / name
    rows = _cells(read_text(file).splitlines())
    if len(rows) < 2 or NAME not in rows[0][1]:
        raise CaseError(f"needs a column `{NAME}` and one row for each compared case", str(file))
    header = rows[0][1]
    found: dict[str, dict[str, float]] = {}
    for number, cells in rows[1:]:
        values = dict(zip(header, cells, strict=False))
        name = values.pop(NAME, "")
        try:
            found[name] = {key: float(value) for key, value in values.items() if value}
        except ValueError as error:
            raise CaseError([Fault(f"row {number}", f"{error}; give percentages as plain numbers")], str(file)) from None
    return found


def _rows(lines: list[tuple[int, list[str]]]) -> tuple[list[_Row], list[Fault]]:
    """Rows with names and values, and the faults of header and names."""
    header, found, faults = _with_units(lines)
    if not header:
        return [], faults
    rows = [_Row(number, _name(values), {k: v for k, v in values.items() if v and k != NAME}) for number, values in found]
    return rows, _header_faults(header) + faults + _name_faults(rows, NAME in header)


def read_rows(path: str | Path) -> tuple[list[str], list[tuple[int, dict[str, str]]]]:
    """Header of a CSV file, and the cells of each row by the header with the units of a row of units; line numbers first.

    Raises
    ------
    CaseError
        The file cannot be read, has no rows, or a row has another number of cells than the header.
    """
    header, rows, faults = _with_units(_cells(read_text(path, _MOST_TEXT).splitlines()))
    if faults:
        raise CaseError(faults, str(path))
    return header, rows


def _with_units(lines: list[tuple[int, list[str]]]) -> tuple[list[str], list[tuple[int, dict[str, str]]], list[Fault]]:
    """Header and rows, as `read_rows`, and faults of the number of cells."""
    if len(lines) < 2:
        return [], [], [Fault("", "has no rows; give a header of dotted paths and one row for each case")]
    header, units, rows, faults = lines[0][1], _units(lines[0][1], lines[1][1]), [], []
    for number, cells in lines[2 if units else 1 :]:
        if len(cells) != len(header):
            faults.append(Fault(f"row {number}", f"has {len(cells)} cells; the header has {len(header)}"))
            continue
        values = {
            key: f"{cell} {units[key]}" if key in units and _NUMBER.fullmatch(cell) else cell
            for key, cell in zip(header, cells, strict=True)
        }
        rows.append((number, values))
    return header, rows, faults


def _units(header: Sequence[str], cells: Sequence[str]) -> dict[str, str]:
    """Units of columns, if a row gives units and nothing else; else empty."""
    found = {}
    for key, cell in zip(header, cells, strict=False):
        unit = re.sub(r"^[\[(](.*)[\])]$", r"\1", cell).strip()
        if key == NAME and unit.lower() not in ("", "unit", "units"):
            return {}
        if key == NAME or unit in ("", "-"):
            continue
        try:
            parse_unit(unit)
        except ValueError:
            return {}
        if unit[0].isdigit():
            return {}
        found[key] = unit
    return found


def _header_faults(header: Sequence[str]) -> list[Fault]:
    faults = []
    for index, column in enumerate(header):
        problem = "" if column == NAME else check_path(column) if column else "has no name; give its path in the header"
        if column and column in header[:index]:
            problem = "appears twice in the header; remove one of them"
        if problem:
            faults.append(Fault(f"column {column or index + 1}", problem))
    return faults


def _name(values: Mapping[str, str]) -> str:
    """Name of the folder of a row: as given, or composed of the last key of each path and the value of its cell."""
    name = values.get(NAME, "")
    if not name:
        name = "_".join(f"{path.split('.')[-1]}-{value}" for path, value in values.items() if value and path != NAME)
    safe = re.sub(r"[^\w.+ -]+", "_", " ".join(name.split())).strip("._ ")
    return safe.encode()[:_LONGEST].decode(errors="ignore").rstrip("._ ") or "base"


def _name_faults(rows: Sequence[_Row], named: bool) -> list[Fault]:
    """Faults of rows whose name belongs to another row or to a file of the table; upper and lower case are equal."""
    faults: list[Fault] = []
    first: dict[str, int] = {}
    for row in rows:
        key = row.name.casefold()
        if key in _FILES:
            text = f'the table writes a file with the name "{row.name}"; give another name'
            faults.append(Fault(f"row {row.number}", text))
        if key in first:
            what = f'the name "{row.name}" is' if named else "the same values are"
            hint = "give each row its own name" if named else f"give the rows names in a column `{NAME}`, or remove one"
            faults.append(Fault(f"row {row.number}", f"{what} already in row {first[key]}; {hint}"))
        first.setdefault(key, row.number)
    return faults


def _base(file: Path, pairs: Sequence[tuple[str, str]], source: str) -> tuple[dict[str, Any], list[Fault]]:
    """Read the base case, and list the faults of the overrides that apply to every row."""
    try:
        data = read_toml(file)
    except CaseError as error:
        raise CaseError([Fault(f"base {file}", str(fault)) for fault in error.faults], source) from None
    return data, apply_overrides(data, pairs)[1]


def _read_rows(
    rows: Sequence[_Row], taken: range, base: Mapping[str, Any], pairs: Sequence[tuple[str, str]], file: Path
) -> tuple[list[TableCase], list[Fault]]:
    cases: list[TableCase] = []
    faults: list[tuple[int, list[Fault]]] = []
    of = BaseCase(file, base, pairs)
    for number in taken:
        row = rows[number]
        case, wrong, found = of.read(row.values)
        if wrong or found:
            faults.append((row.number, [*wrong, *found]))
        elif case is not None:
            cases.append(TableCase(number, row.name, row.values, _digest(case_text(case)), of))
    return cases, _merge(faults, file, len(taken))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _merge(by_row: Sequence[tuple[int, list[Fault]]], file: Path, rows: int) -> list[Fault]:
    """Faults of faulty rows with their numbers; a fault that all `rows` share appears once, for the base case."""
    shared = (
        [fault for fault in by_row[0][1] if all(fault in found for _, found in by_row)] if rows == len(by_row) > 1 else []
    )
    merged = [Fault(f"base {file}: {fault.path}" if fault.path else f"base {file}", fault.message) for fault in shared]
    for number, found in by_row:
        merged += [
            Fault(f"row {number}: {fault.path}" if fault.path else f"row {number}", fault.message)
            for fault in found
            if fault not in shared
        ]
    return merged
