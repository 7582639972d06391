"""Tables of measured data: CSV files with units in the headings, or with units in a TOML file of the same name.

    angle [deg], moment [N mm], opening
    0.0,  0.00, 1
    5.0,  1.20, 1

A heading is `name [unit]`, `name (unit)` or `name_unit`. The order of the columns is arbitrary. Columns that are not needed
are ignored, with a note. The TOML file ``loop.toml`` supplements ``loop.csv``::

    columns = ["angle", "moment"]              # names, for a file without headings
    units = { angle = "deg", moment = "mN m" } # units of headings without a unit
    values = { press_time = "1 h", opening = 2, lever_arm = "30 mm" } # the same in every row
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fsm.case.loading import csv_columns as csv
from fsm.case.loading.toml_file import read_toml
from fsm.case.schema.faults import unknown_key
from fsm.case.schema.units import did_you_mean, to_si, with_unit
from fsm.errors import CaseError, Fault

SI = {"length": "m", "force": "N", "angle": "rad", "moment": "N m", "time": "s", "number": "", "branch": ""}
"""SI unit of every kind of quantity."""

BRANCHES = {"loading": 1.0, "unloading": -1.0}
"""Words of a column of the kind "branch", and their numbers."""

_SIDECAR_KEYS = ("columns", "units", "values")
_WITH_UNIT = re.compile(r"^[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*[A-Za-zµ°%].*$")


@dataclass(frozen=True)
class MeasuredTable:
    """Measured columns.

    Attributes
    ----------
    columns : dict of (n,) arrays
        Values in SI units; in a column of the kind "branch" 1 for loading and -1 for unloading.
    rows : (n,) int array
        Line numbers in the file, from 1.
    source : str
        Path of the file.
    notes : tuple of str
        Notes for the user: ignored columns, and values of the TOML file that a column replaces.
    units : dict of str
        Units in the file, for messages.
    """

    columns: dict[str, np.ndarray]
    rows: np.ndarray
    source: str
    notes: tuple[str, ...] = ()
    units: dict[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.rows)

    def shown(self, name: str, index: int) -> str:
        """Text of one value in the unit of the file."""
        unit = self.units.get(name, "")
        value = float(self.columns[name][index])
        return f"{value / to_si(f'1 {unit}', unit):.6g} {unit}" if unit else f"{value:.6g}"

    def fault(self, index: int, message: str) -> Fault:
        """Fault of one row."""
        return Fault(f"row {self.rows[index]}", message)


@dataclass(frozen=True)
class _Sidecar:
    """Content of the TOML file that belongs to the CSV file."""

    columns: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    name: str = ""


def read_table(path: str | Path, quantities: Mapping[str, str], required: Sequence[str]) -> MeasuredTable:
    """Read the columns of a measured table.

    Parameters
    ----------
    path : str or Path
    quantities : mapping
        Kind of each admissible column: "length", "force", "angle", "moment", "time", "number" or "branch".
    required : sequence of str
        Columns that must be given, in the CSV file or as `values` in the TOML file.

    Raises
    ------
    CaseError
        The file has faults; each is listed with its row.
    """
    file = Path(path)
    sidecar = _read_sidecar(file.with_suffix(".toml"), quantities)
    rows = csv.text_rows(file, "", f"required columns: {', '.join(required)}")
    separator = csv.separator_of(rows[0][1])
    cells = csv.cells_of(rows[0][1], separator)
    without_headings = all(csv.number_in(cell, separator) is not None for cell in cells)
    try:
        if without_headings:
            _check_column_names(cells, sidecar, rows[0][0], file, required, quantities)
            names, units, body = list(sidecar.columns), [""] * len(cells), rows
        else:
            cells = csv.headings_of(rows[0][1], separator)
            if not cells:
                raise CaseError(Fault("", f"row {rows[0][0]}: no headings; required columns: {', '.join(required)}"))
            cells, names, units, body = csv.columns_of(rows, separator, quantities)
        used, faults = _used_columns(names, cells, rows[0][0], quantities, required, sidecar, file)
        scale, found, more = _scales(used, units, quantities, sidecar, file)
        if not body:
            more.append(Fault("", "has headings but no rows"))
        numbers, bad = _numbers(body, separator, len(cells), used, quantities)
        if faults or more or bad:
            raise CaseError([*faults, *more, *csv.first_row_faults(bad, "")])
    except CaseError as error:
        raise CaseError(error.faults, str(file)) from None
    columns = {name: numbers[:, k] * scale[name] for k, name in enumerate(used)}
    columns |= {name: np.full(len(body), value) for name, value in sidecar.values.items() if name not in used}
    numbered = np.array([number for number, _ in body])
    return MeasuredTable(columns, numbered, str(file), _notes(cells, names, used, sidecar), found)


# TOML file of the same name ------------------------------------------------------------------------------------------


def _read_sidecar(file: Path, quantities: Mapping[str, str]) -> _Sidecar:
    if not file.exists():
        return _Sidecar()
    data = read_toml(file)
    faults = [
        Fault(key, f"{unknown_key(key, _SIDECAR_KEYS)}; this file describes the CSV file of the same name")
        for key in data
        if key not in _SIDECAR_KEYS
    ]
    columns, units, values = data.get("columns", []), data.get("units", {}), data.get("values", {})
    if not isinstance(columns, list) or not all(isinstance(name, str) for name in columns):
        faults.append(Fault("columns", 'must be a list of names, ["angle", "moment"]'))
    for key, section in (("units", units), ("values", values)):
        if not isinstance(section, dict):
            faults.append(Fault(key, f"must be a section; it is {with_unit(section, None)}"))
            continue
        faults += [Fault(f"{key}.{name}", unknown_key(name, list(quantities))) for name in section if name not in quantities]
    if faults:
        raise CaseError(faults, str(file))
    read = {}
    for name, unit in units.items():
        faults += _unit_faults(f"units.{name}", unit, quantities[name])
    for name, value in values.items():
        try:
            read[name] = _constant(value, quantities[name])
        except ValueError as error:
            faults.append(Fault(f"values.{name}", str(error)))
    if faults:
        raise CaseError(faults, str(file))
    return _Sidecar(tuple(columns), units, read, file.name)


def _unit_faults(path: str, unit: Any, kind: str) -> list[Fault]:
    try:
        to_si(f"1 {unit}", SI[kind])
    except ValueError as error:
        return [Fault(path, str(error))]
    return []


def _constant(value: Any, kind: str) -> float:
    if kind == "branch":
        if value not in BRANCHES:
            raise ValueError(f'must be "loading" or "unloading"; it is {with_unit(value, None)}')
        return BRANCHES[value]
    if SI[kind] and not isinstance(value, str):
        raise ValueError(f'{with_unit(value, None)} has no unit; write the value with a unit as text, "{value} {SI[kind]}"')
    return to_si(value, SI[kind])


# headings ------------------------------------------------------------------------------------------------------------


def _check_column_names(
    cells: list[str],
    sidecar: _Sidecar,
    row: int,
    file: Path,
    required: Sequence[str],
    quantities: Mapping[str, str],
) -> None:
    """Check that the TOML file names all columns of a file without headings."""
    example = ", ".join(f"{name} [{_EXAMPLES[quantities[name]]}]" for name in required)
    toml_name = file.with_suffix(".toml").name
    if not sidecar.columns:
        what = f"no headings; write `{example}` above, or `columns` and `units` in {toml_name}"
        raise CaseError(Fault(f"row {row}", what))
    if len(sidecar.columns) != len(cells):
        what = f"has {len(cells)} values, but `columns` in {toml_name} names {len(sidecar.columns)}"
        raise CaseError(Fault(f"row {row}", what))


_EXAMPLES = {"length": "mm", "force": "N", "angle": "deg", "moment": "N mm", "time": "s", "number": "-", "branch": "-"}


def _used_columns(
    names: list[str],
    cells: list[str],
    row: int,
    quantities: Mapping[str, str],
    required: Sequence[str],
    sidecar: _Sidecar,
    file: Path,
) -> tuple[dict[str, int], list[Fault]]:
    """Names and positions of the columns that are read, and the faults of the headings."""
    used: dict[str, int] = {}
    faults = []
    toml_name = file.with_suffix(".toml").name
    missing = [name for name in required if name not in names and name not in sidecar.values]
    for place, name in enumerate(names):
        if name in used:
            both = f"`{cells[used[name]]}`, `{cells[place]}`"
            faults.append(Fault(f"row {row}", f"column {name} is given twice ({both}); delete one"))
        elif name in quantities:
            used[name] = place
    for name in missing:
        unit = _EXAMPLES[quantities[name]]
        others = [other for other in names if other not in quantities]
        near = did_you_mean(name, others).replace("did you mean", "is it")
        what = f"no column {name} among {', '.join(cells)}; name it `{name} [{unit}]`{near}"
        what += f", or, if it is the same in every row, write values = {{ {name} = \"... {unit}\" }} in {toml_name}"
        faults.append(Fault(f"row {row}", what))
    return used, faults


def _scales(
    used: Mapping[str, int], units: Sequence[str], quantities: Mapping[str, str], sidecar: _Sidecar, file: Path
) -> tuple[dict[str, float], dict[str, str], list[Fault]]:
    """Factor to SI and unit of every column that is read, and the faults of the units."""
    scale: dict[str, float] = {}
    found: dict[str, str] = {}
    faults: list[Fault] = []
    for name, place in used.items():
        kind = quantities[name]
        unit = units[place] or sidecar.units.get(name, "")
        if SI[kind] and not unit:
            toml_name = file.with_suffix(".toml").name
            example = _EXAMPLES[kind]
            what = f"has no unit; write `{name} [{example}]`, or units = {{ {name} = \"{example}\" }} in {toml_name}"
            faults.append(Fault(f"column {name}", what))
            continue
        unit = "" if unit == "-" else unit
        bad = _unit_faults(f"column {name}", unit, kind)
        faults += bad
        if not bad:
            scale[name] = to_si(f"1 {unit}", SI[kind])
            found[name] = unit
    return scale, found, faults


def _notes(cells: Sequence[str], names: Sequence[str], used: Mapping[str, int], sidecar: _Sidecar) -> tuple[str, ...]:
    others = [cell for cell, name in zip(cells, names, strict=True) if name not in used] if names else []
    notes = [f"columns not read: {', '.join(others)}"] if others else []
    double = [name for name in sidecar.values if name in used]
    if double:
        notes.append(f"{', '.join(double)}: the column is used, and `values` in {sidecar.name} is ignored")
    return tuple(notes)


# rows ----------------------------------------------------------------------------------------------------------------


def _numbers(
    body: list[tuple[int, str]],
    separator: str,
    width: int,
    used: Mapping[str, int],
    quantities: Mapping[str, str],
) -> tuple[np.ndarray, list[Fault]]:
    """Values (n, len(used)) of the used columns, in the units of the file, and the faults of the rows."""
    if not body:
        return np.zeros((0, len(used))), []
    fast = _read_fast([line for _, line in body], separator, width, list(used.values()))
    if fast is not None:
        return fast, []
    numbers: list[list[float]] = []
    faults: list[Fault] = []
    for row, line in body:
        cells = csv.cells_of(line, separator)
        cells += [""] * (width - len(cells))
        if len(cells) > width:
            faults.append(Fault(f"row {row}", f"has {len(cells)} values, but there are {width} columns"))
            continue
        values = []
        for name, place in used.items():
            value = _value(cells[place], separator, quantities[name])
            if value is None:
                faults.append(Fault(f"row {row}", _bad_cell(cells[place], name, quantities[name])))
                break
            values.append(value)
        else:
            numbers.append(values)
    return np.array(numbers).reshape(len(numbers), len(used)), faults


def _read_fast(lines: list[str], separator: str, width: int, places: list[int]) -> np.ndarray | None:
    """Fast reading of files with very many rows; None if a row is incomplete or a cell is not a plain number."""
    if separator == " ":
        if any(len(line.split()) != width for line in lines):
            return None
    elif any(line.count(separator) != width - 1 for line in lines):
        return None
    delimiter = None if separator == " " else separator
    try:
        numbers = np.loadtxt(lines, delimiter=delimiter, usecols=places, comments=None, ndmin=2)
    except ValueError:
        return None
    return numbers if np.isfinite(numbers).all() else None


def _value(cell: str, separator: str, kind: str) -> float | None:
    if kind == "branch" and cell.lower() in BRANCHES:
        return BRANCHES[cell.lower()]
    value = csv.number_in(cell, separator)
    if value is None or not math.isfinite(value) or (kind == "branch" and abs(value) != 1.0):
        return None
    return value


def _bad_cell(cell: str, name: str, kind: str) -> str:
    if kind == "branch":
        return f'{name} is "{cell}"; write loading or unloading'
    if not cell:
        return f"{name} is empty; fill it in or delete the row"
    if _WITH_UNIT.match(cell):
        return f'{name} is "{cell}"; a column has one unit, in its heading: convert the cell and write the number alone'
    return f'{name} is "{cell}", not a finite number; correct or delete the row'
