"""Curves of joints from CSV files: harnesses (coordinate, opening, closing) and motors (speed, torque)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fsm.case.loading.csv_columns import columns_of, numbers_of, separator_of, text_rows
from fsm.case.models.joint import SceneJoint
from fsm.errors import CaseError, Fault


def with_curves(joint: SceneJoint, folder: Path, system: str, path: str) -> tuple[SceneJoint, list[Fault]]:
    """A joint with the rows of the files of its harness and its motor, and the faults of these files."""
    update: dict[str, Any] = {}
    faults: list[Fault] = []
    slides, effort = joint.kind == "prismatic", "N" if joint.kind == "prismatic" else "N m"
    harness, motor = joint.harness, joint.motor
    wanted: list[tuple[str, Any, str, str, dict[str, str]]] = []
    if harness is not None and harness.data is not None:
        way = ("travel", "m") if slides else ("angle", "rad")
        wanted.append(("harness", harness, "table", harness.data, {way[0]: way[1], "opening": effort, "closing": effort}))
    curve = getattr(motor, "torque_speed", None)
    if motor is not None and isinstance(curve, str):
        wanted.append(("motor", motor, "torque_speed", curve, {"speed": "rad/s", "torque": effort}))
    for key, section, rows, name, columns in wanted:
        place = f"{path}.{key}.{'data' if key == 'harness' else rows}"
        try:
            read = _read(folder / name, columns, system, place)
            data = section.model_dump(exclude_none=True, exclude={"data"}) | {rows: read}
            update[key] = type(section).model_validate(data)
        except CaseError as error:
            faults += error.faults
        except ValidationError as error:
            faults.append(Fault(place, f"{folder / name}: {error.errors()[0]['msg'].removeprefix('Value error, ')}"))
    return joint.model_copy(update=update), faults


def _read(file: Path, columns: dict[str, str], system: str, path: str) -> tuple[tuple[float, ...], ...]:
    example = ", ".join(f"{name} ({unit})" for name, unit in columns.items())
    needed = f"the file needs a header with these columns: {example}"
    rows = text_rows(file, path, needed)
    separator = separator_of(rows[0][1])
    _, names, units, body = columns_of(rows, separator, columns)
    if sorted(names) != sorted(columns):
        raise CaseError(Fault(path, f"{file} has the columns {', '.join(names)}; {needed}"))
    each = [(name, unit, columns[name]) for name, unit in zip(names, units, strict=True)]
    found = numbers_of(file, body, each, separator, system, path)
    return tuple(zip(*(found[name] for name in columns), strict=True))
