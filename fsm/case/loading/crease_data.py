"""Moment-angle data of a crease from a CSV file.

A header names the columns, with units if they differ from the units of the case::

    # clamped side 20 mm, turned side 35 mm
    angle (deg), moment (N mm)
    0.0,  0.0
    5.0,  1.2

The columns can also be ``angle [deg]; force [N]; lever_arm [mm]``; the moment is then force times lever arm. Lines that
start with ``#`` are comments. Commas, semicolons, tabs or blanks separate values. A file without a header has the columns
angle and moment; the case must then give both units, for example ``angle_unit = "deg"`` and ``moment_unit = "mN m"``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fsm.case.loading import csv_columns as csv
from fsm.case.models.materials import SplineCrease
from fsm.case.schema.units import did_you_mean, to_si, unit_in
from fsm.errors import CaseError, Fault

MOST_ROWS = 20_000
FEWEST_ROWS = {"cubic": 4, "pchip": 2}
_SI = {"angle": "rad", "moment": "N m", "force": "N", "lever_arm": "m"}
_CHOICES = ({"angle", "moment"}, {"angle", "force", "lever_arm"})


@dataclass(frozen=True)
class CreaseData:
    """Measured curve with increasing angles.

    Attributes
    ----------
    angle : rad
    moment : N m
    """

    angle: tuple[float, ...]
    moment: tuple[float, ...]


@dataclass(frozen=True)
class _Column:
    name: str
    unit: str


def read_crease_data(
    file: Path, crease: SplineCrease, system: str = "SI", path: str = "crease.data"
) -> CreaseData:
    """Read a crease file.

    Parameters
    ----------
    file : Path
    crease : SplineCrease
        Section with the interpolation, and with units for a file without units.
    system : str
        Unit system of plain numbers.
    path : str
        Dotted path of the key that names the file, for messages.

    Raises
    ------
    CaseError
        All faults of the file, each with its row number as in a text editor.
    """
    rows = csv.text_rows(file, path, "it must have two columns, angle and moment")
    separator = csv.separator_of(rows[0][1])
    columns, rows = _columns(rows, separator, crease, path)
    columns = _with_units(columns, crease, system, path)
    numbers, faults = _numbers(rows, separator, len(columns), path)
    if faults:
        raise CaseError(csv.first_row_faults(faults, path))
    names = [column.name for column in columns]
    scale = {column.name: to_si(f"1 {column.unit}", _SI[column.name]) for column in columns}
    angle = [values[names.index("angle")] for _, values in numbers]
    moment = [
        math.prod(value * scale[name] for name, value in zip(names, values, strict=True) if name != "angle")
        for _, values in numbers
    ]
    unit = next(column.unit for column in columns if column.name == "angle")
    return check_curve(
        angle,
        moment,
        crease.interpolation,
        path,
        places=[f"{path} row {row}" for row, _ in numbers],
        unit=unit,
    )


def check_curve(
    angle: Sequence[float],
    moment: Sequence[float],
    interpolation: str,
    path: str,
    places: Sequence[str],
    unit: str = "rad",
) -> CreaseData:
    """Curve for interpolation, after a check of its rows and of the order of its angles.

    Decreasing angles are reversed.

    Parameters
    ----------
    angle : sequence of float; its unit is `unit`
    moment : sequence of float, N m
    interpolation : "cubic" or "pchip"
    path : str
        Dotted path of the curve, for messages.
    places : sequence of str
        Path of each row, for messages.
    unit : str
        Unit of the angles.

    Raises
    ------
    CaseError
        Rows are out of order, or there are too few or too many rows.
    """
    if len(angle) != len(moment):
        raise CaseError(
            Fault(path, f"has {len(angle)} angles and {len(moment)} moments; give one moment for each angle")
        )
    fewest = FEWEST_ROWS[interpolation]
    if len(angle) < fewest:
        hint = '; or write interpolation = "pchip"' if 2 <= len(angle) < fewest else ""
        raise CaseError(
            Fault(path, f"has {len(angle)} rows; {interpolation} interpolation needs at least {fewest}{hint}")
        )
    if len(angle) > MOST_ROWS:
        what = f"has {len(angle):,} rows; at most {MOST_ROWS:,} are allowed; reduce the rows by `fsm calibrate crease`"
        raise CaseError(Fault(path, what))
    faults = _order_faults(angle, places, unit) or _size_faults(angle, places, unit)
    if faults:
        raise CaseError(csv.first_row_faults(faults, path))
    turn = slice(None, None, -1 if angle[-1] < angle[0] else 1)
    radians = [to_si(f"{value!r} {unit}", "rad") for value in angle]
    return CreaseData(tuple(radians[turn]), tuple(moment[turn]))


def _columns(
    rows: list[tuple[int, str]], separator: str, crease: SplineCrease, path: str
) -> tuple[list[_Column], list[tuple[int, str]]]:
    """Names of the columns of the file, and the rows below the header."""
    number, line = rows[0]
    cells = csv.headings_of(line, separator)
    if not cells or any(csv.number_in(cell, separator) is not None for cell in csv.cells_of(line, separator)):
        return _bare_columns(csv.cells_of(line, separator), number, crease, path), rows
    cells, names, units, body = csv.columns_of(rows, separator, _SI)
    columns, faults = [], []
    for cell, name, unit in zip(cells, names, units, strict=True):
        if name not in _SI:
            known = did_you_mean(name, _SI) or "; use angle and moment, or angle, force and lever_arm"
            faults.append(Fault(f"{path} row {number}", f'unknown column "{cell}"{known}'))
        columns.append(_Column(name, unit))
    if not faults and (set(names) not in _CHOICES or len(set(names)) < len(names)):
        required = "use angle and moment, or angle, force and lever_arm"
        faults.append(Fault(f"{path} row {number}", f"columns are {', '.join(names)}; {required}"))
    if faults:
        raise CaseError(faults)
    return columns, body


def _bare_columns(cells: list[str], number: int, crease: SplineCrease, path: str) -> list[_Column]:
    """Columns of a file without a header."""
    if len(cells) != 2:
        raise CaseError(
            Fault(
                f"{path} row {number}",
                f"has {len(cells)} columns and no header; give a header, for example `angle (deg), moment (N mm)`",
            )
        )
    if not (crease.angle_unit and crease.moment_unit):
        raise CaseError(
            Fault(
                f"{path} row {number}",
                "has no header; add a header, for example `angle (deg), moment (N mm)`, or give `angle_unit` and "
                "`moment_unit` beside `data`",
            )
        )
    return [_Column("angle", crease.angle_unit), _Column("moment", crease.moment_unit)]


def _with_units(columns: list[_Column], crease: SplineCrease, system: str, path: str) -> list[_Column]:
    """Columns with their units; a unit comes from the header, else from the case, else from the unit system."""
    of_case = {"angle": crease.angle_unit, "moment": crease.moment_unit}
    full, faults = [], []
    for column in columns:
        si = _SI[column.name]
        unit = column.unit or of_case.get(column.name) or unit_in(si, system)
        try:
            to_si(f"1 {unit}", si)
        except ValueError as error:
            faults.append(Fault(path, f"the unit of the column {column.name} is wrong: {error}"))
        full.append(_Column(column.name, unit))
    if faults:
        raise CaseError(faults)
    return full


def _numbers(
    rows: list[tuple[int, str]], separator: str, width: int, path: str
) -> tuple[list[tuple[int, list[float]]], list[Fault]]:
    numbers, faults = [], []
    for row, line in rows:
        cells = csv.cells_of(line, separator)
        values = [csv.number_in(cell, separator) for cell in cells]
        good = [value for value in values if value is not None and math.isfinite(value)]
        if len(cells) != width:
            values_given = f"has {len(cells)} value{'s' * (len(cells) != 1)}"
            faults.append(Fault(f"{path} row {row}", f"{values_given}; the header has {width} columns"))
        elif len(good) < width:
            bad = next(c for c, v in zip(cells, values, strict=True) if v is None or not math.isfinite(v))
            faults.append(
                Fault(f"{path} row {row}", f'"{bad}" is not a finite number; correct or remove the row')
            )
        else:
            numbers.append((row, good))
    return numbers, faults


def _order_faults(angle: Sequence[float], places: Sequence[str], unit: str) -> list[Fault]:
    """Faults of rows whose angle breaks the increasing or decreasing order of the column."""
    sign = -1.0 if angle[-1] < angle[0] else 1.0
    faults = []
    for before, after, place in zip(angle, angle[1:], places[1:], strict=False):
        if sign * (after - before) > 0:
            continue
        if after == before:
            what = f"the angle {after:g} {unit} appears twice; keep one row for each angle, or the mean of its rows"
        else:
            way = "decreases" if sign > 0 else "increases"
            what = f"the angle {way} ({after:g} {unit} after {before:g} {unit}); sort the rows, and keep one branch only"
        faults.append(Fault(place, what))
    return faults


def _size_faults(angle: Sequence[float], places: Sequence[str], unit: str) -> list[Fault]:
    """Fault of the largest angle if it exceeds one turn, probably because degrees were read as radians."""
    worst = max(range(len(angle)), key=lambda index: abs(angle[index]))
    if abs(to_si(f"{angle[worst]!r} {unit}", "rad")) <= 2 * math.pi * (1 + 1e-9):
        return []
    return [
        Fault(
            places[worst],
            f"{angle[worst]:g} {unit} is more than one turn; for degrees, write the header `angle (deg)`",
        )
    ]
