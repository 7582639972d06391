"""Content of the files that sections of a case name: curves of creases, harnesses and motors, and programs over time.

CSV files have a header that names the columns, with units if they differ from the units of the case::

    time (s), travel (mm)
    0, 0
    1, 12

The second column of a program is `value` (factors), `travel`, `turn`, `force`, `moment` or `pressure`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from fsm.case.loading.crease_data import check_curve, read_crease_data
from fsm.case.loading.csv_columns import columns_of, numbers_of, separator_of, text_rows
from fsm.case.models.joint_action import SlideHarness, TurnHarness
from fsm.case.models.joint_motor import TurnMotor
from fsm.case.models.materials import FamilyCrease, SplineCrease
from fsm.case.models.sheet import Sheet
from fsm.case.models.time_program import AMOUNTS, Table
from fsm.case.schema.units import did_you_mean
from fsm.errors import CaseError, Fault
from fsm.library import entries

_PROGRAM = {"time": "s", "value": "", "travel": "m", "turn": "rad", "force": "N", "moment": "N m", "pressure": "Pa"}
"""Columns of a program, with their SI units."""
_NEEDED = f"the file needs a header with `time` and one of value, {', '.join(AMOUNTS)}, for example: time (s), travel (mm)"
MOST_ROWS = 100_000
"""Largest number of rows of a program."""

_Read = tuple[Any, list[Fault]]
"""Section with the content of its files, and the faults of these files."""


def with_files(item: Any, folder: Path, system: str, path: str) -> _Read:
    """Part of a case with the content of all files that its sections name.

    Parameters
    ----------
    item : section, list of sections, or mapping of sections
        A part without files is returned as it is.
    folder : Path
        Folder to which names of files are relative.
    system : str
        Unit system of columns without units.
    path : str
        Dotted path of the part, for messages.

    Returns
    -------
    Part of the case, and the faults of its files.
    """
    if isinstance(item, tuple | dict):
        parts = dict(item) if isinstance(item, dict) else dict(enumerate(item))
        each = {key: with_files(part, folder, system, f"{path}.{key}") for key, part in parts.items()}
        found = {key: part for key, (part, _) in each.items()}
        faults = [fault for _, of_part in each.values() for fault in of_part]
        return (found if isinstance(item, dict) else tuple(found.values())), faults
    if not isinstance(item, BaseModel):
        return item, []
    keys = {key: part for key in _keys_with_files(type(item)) if (part := getattr(item, key)) is not None}
    read = {key: with_files(part, folder, system, f"{path}.{key}") for key, part in keys.items()}
    faults = [fault for _, each in read.values() for fault in each]
    changed = {key: part for key, (part, _) in read.items() if part is not keys[key]}
    try:
        if any(isinstance(part, Table) for part in changed.values()):  # what a table may have depends on its section
            given = {key: part.model_dump(exclude_none=True) for key, part in changed.items()}
            item = type(item).model_validate(item.model_dump(exclude_none=True) | given)
        elif changed:
            item = item.model_copy(update=changed)
        if type(item) in _READERS and not faults:
            item = _READERS[type(item)](item, folder, system, path)
        return item, faults
    except CaseError as error:
        return item, list(error.faults)
    except ValidationError as error:
        return item, [Fault(path, _reason(error))]


@cache
def _keys_with_files(section: type[BaseModel]) -> tuple[str, ...]:
    """Keys of a section whose values, or parts of them, may name files."""
    return tuple(
        key for key, field in section.model_fields.items()
        if any(model in _READERS or _keys_with_files(model) for model in _sections_in(field.annotation))
    )  # fmt: skip


def _sections_in(kind: Any) -> Iterator[type[BaseModel]]:
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        yield kind
    for inner in get_args(kind):
        yield from _sections_in(inner)


def _reason(error: ValidationError) -> str:
    return str(error.errors()[0].get("ctx", {}).get("error", error.errors()[0]["msg"]))


def _read_columns(
    file: Path, known: Mapping[str, str], system: str, path: str, needed: str
) -> tuple[list[str], Callable[[], dict[str, list[float]]]]:
    """Names of the columns of a file, and a function that reads their numbers in SI; `known` has the SI units."""
    rows = text_rows(file, path, needed)
    separator = separator_of(rows[0][1])
    _, names, units, body = columns_of(rows, separator, known)
    if len(body) > MOST_ROWS:
        raise CaseError(Fault(path, f"{file} has {len(body):,} rows; at most {MOST_ROWS:,} are allowed"))

    def numbers() -> dict[str, list[float]]:
        columns = [(name, unit, known[name]) for name, unit in zip(names, units, strict=True)]
        return numbers_of(file, body, columns, separator, system, path)

    return names, numbers


def _with_program(table: Table, folder: Path, system: str, path: str) -> Table:
    """Table with the rows of its file."""
    if table.file is None:
        return table
    file, path = folder / table.file, f"{path}.file"
    names, numbers = _read_columns(file, _PROGRAM, system, path, _NEEDED)
    for name in names:
        if name not in _PROGRAM:
            raise CaseError(Fault(path, f"{file}: unknown column `{name}`{did_you_mean(name, _PROGRAM)}; {_NEEDED}"))
    if len(names) != 2 or "time" not in names or names[0] == names[1]:
        raise CaseError(Fault(path, f"{file} has the columns {', '.join(names)}; {_NEEDED}"))
    update: dict[str, Any] = {name: tuple(values) for name, values in numbers().items()}
    try:
        return Table.model_validate({"kind": "table", "interpolation": table.interpolation} | update)
    except ValidationError as error:
        raise CaseError(Fault(path, f"{file}: {_reason(error)}")) from None


def _with_rows(key: str, to: str, columns: Mapping[str, str]) -> Callable[[Any, Path, str, str], Any]:
    """Reader of the rows of a curve, whose file is the text of a key, into another key."""
    example = ", ".join(f"{name} ({unit})" for name, unit in columns.items())
    needed = f"the file needs a header with these columns: {example}"

    def read(section: Any, folder: Path, system: str, path: str) -> Any:
        name, path = getattr(section, key), f"{path}.{key}"
        if not isinstance(name, str):
            return section
        file = folder / name
        names, numbers = _read_columns(file, columns, system, path, needed)
        if sorted(names) != sorted(columns):
            raise CaseError(Fault(path, f"{file} has the columns {', '.join(names)}; {needed}"))
        found = numbers()
        rows = tuple(zip(*(found[column] for column in columns), strict=True))
        try:
            return type(section).model_validate(section.model_dump(exclude_none=True, exclude={key}) | {to: rows})
        except ValidationError as error:
            raise CaseError(Fault(path, f"{file}: {_reason(error)}")) from None

    return read


def _with_curve(crease: SplineCrease, folder: Path, system: str, path: str) -> SplineCrease:
    """Measured crease with its curve."""
    width = crease.width
    if crease.library is not None and crease.angle is None:
        tested = entries()[crease.library]
        curve = read_crease_data(tested.file, crease, system, f"{path}.library")
        width = width or (tested.width if isinstance(tested.width, float) else None)
    elif crease.data is not None:
        curve = read_crease_data(folder / crease.data, crease, system, f"{path}.data")
    else:
        angle, moment = crease.angle or (), crease.moment or ()
        places = [f"{path}.angle.{index}" for index in range(len(angle))]
        curve = check_curve(angle, moment, crease.interpolation, f"{path}.angle", places)
    read = {
        "data": None, "angle_unit": None, "moment_unit": None, "angle": curve.angle, "moment": curve.moment, "width": width,
    }  # fmt: skip
    if crease.unloading is not None and crease.angle is not None and crease.angle[-1] < crease.angle[0]:
        read["unloading"] = crease.unloading[::-1]
    return _at_rest(crease.model_copy(update=read), path)


def _from_family(crease: FamilyCrease, folder: Path, system: str, path: str) -> SplineCrease:
    """Measured curve of a crease, from its calibrated family of curves."""
    # this module imports numpy, so it is imported only where needed
    from fsm.case.loading.crease_family import family_curve, read_family, rest_angle

    family = read_family(folder / crease.file, f"{path}.file")
    curve = family_curve(family, crease.press_time, crease.opening, path)
    if crease.hysteresis and curve.unloading is None:
        what = f"is true, but {curve.name} of {crease.file} has no unloading branch; set this key to false"
        raise CaseError(Fault(f"{path}.hysteresis", what))
    back = curve.unloading if crease.hysteresis else None
    released = crease.since_release
    spline = SplineCrease(
        law="spline",
        angle=tuple(curve.angle.tolist()),
        moment=tuple(curve.loading.tolist()),
        interpolation="pchip" if family.interpolation == "pchip" else "cubic",
        rest_angle=crease.rest_angle if released is None else rest_angle(family, released, path),
        scale=crease.scale,
        unloading=None if back is None else tuple(back.tolist()),
        reversal=crease.reversal,
    )
    return _at_rest(spline, path)


def _at_rest(crease: SplineCrease, path: str) -> SplineCrease:
    """The same crease; an error for a rest angle for which no data are at possible crease angles, 0 to 180 degrees."""
    if crease.rest_angle is None or crease.angle is None:
        return crease
    low, high = (math.degrees(crease.rest_angle - end) for end in (crease.angle[-1], crease.angle[0]))
    if low <= 180.0 and high >= 0.0:
        return crease
    what = f"{math.degrees(crease.rest_angle):.4g} deg places the data at crease angles of {low:.4g} to {high:.4g} deg"
    text = f"{what}; crease angles are 0 (flat) to 180 deg (closed); correct value or data"
    raise CaseError(Fault(f"{path}.rest_angle", text))


def _with_pattern(sheet: Sheet, folder: Path, system: str, path: str) -> Sheet:
    """Sheet with the pattern of its file."""
    if sheet.pattern is None:
        return sheet
    from fsm.case.pattern_files.file import with_pattern  # this module imports numpy

    found, faults = with_pattern(sheet, folder)
    if faults:
        raise CaseError(faults)
    return found


_READERS: Mapping[type[BaseModel], Callable[[Any, Path, str, str], Any]] = {
    Table: _with_program,
    TurnHarness: _with_rows("data", "table", {"angle": "rad", "opening": "N m", "closing": "N m"}),
    SlideHarness: _with_rows("data", "table", {"travel": "m", "opening": "N", "closing": "N"}),
    TurnMotor: _with_rows("torque_speed", "torque_speed", {"speed": "rad/s", "torque": "N m"}),
    SplineCrease: _with_curve,
    FamilyCrease: _from_family,
    Sheet: _with_pattern,
}
"""Readers of the sections that name a file: section, folder, unit system and path, to the section with its content."""
