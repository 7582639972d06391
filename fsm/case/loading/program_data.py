"""Programs over time from CSV files.

A header names the columns, with units if they differ from the units of the case::

    time (s), travel (mm)
    0, 0
    1, 12

The second column is `value` (factors), `travel`, `turn`, `force`, `moment` or `pressure`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from fsm.case.loading.csv_columns import columns_of, numbers_of, separator_of, text_rows
from fsm.case.models.time_program import AMOUNTS, Table
from fsm.case.schema.model import Model
from fsm.case.schema.units import did_you_mean
from fsm.errors import CaseError, Fault

_SI = {"time": "s", "value": "", "travel": "m", "turn": "rad", "force": "N", "moment": "N m", "pressure": "Pa"}
_NEEDED = f"the file needs a header with `time` and one of value, {', '.join(AMOUNTS)}, for example: time (s), travel (mm)"
MOST_ROWS = 100_000

Timed = TypeVar("Timed", bound=Model)


def with_program(item: Timed, folder: Path, system: str, path: str) -> tuple[Timed, list[Fault]]:
    """A load, a drive or a force with the rows of the file of its table, and the faults of this file."""
    table = getattr(item, "time", None)
    if not isinstance(table, Table) or table.file is None:
        return item, []
    try:
        read = read_program(folder / table.file, table, system, f"{path}.time.file")
        data = item.model_dump(exclude_none=True) | {"time": read.model_dump(exclude_none=True)}
        return type(item).model_validate(data), []
    except CaseError as error:
        return item, list(error.faults)
    except ValidationError as error:
        return item, [Fault(path, _reason(error))]


def read_program(file: Path, table: Table, system: str, path: str) -> Table:
    """Table with the rows of its file.

    Parameters
    ----------
    file : Path
    table : Table
        Table that names the file.
    system : str
        Unit system of columns without unit.
    path : str
        Dotted path of the key that names the file, for messages.

    Raises
    ------
    CaseError
        All faults of the file.
    """
    rows = text_rows(file, path, _NEEDED)
    separator = separator_of(rows[0][1])
    _, names, units, body = columns_of(rows, separator, _SI)
    for name in names:
        if name not in _SI:
            near = did_you_mean(name, list(_SI))
            raise CaseError(Fault(path, f"{file}: unknown column `{name}`{near}; {_NEEDED}"))
    if len(names) != 2 or "time" not in names or names[0] == names[1]:
        raise CaseError(Fault(path, f"{file} has the columns {', '.join(names)}; {_NEEDED}"))
    if len(body) > MOST_ROWS:
        raise CaseError(Fault(path, f"{file} has {len(body):,} rows; at most {MOST_ROWS:,} are allowed"))
    columns = [(name, unit, _SI[name]) for name, unit in zip(names, units, strict=True)]
    found = numbers_of(file, body, columns, separator, system, path)
    update: dict[str, Any] = {name: tuple(values) for name, values in found.items()}
    try:
        return Table(kind="table", interpolation=table.interpolation, **update)
    except ValidationError as error:
        raise CaseError(Fault(path, f"{file}: {_reason(error)}")) from None


def _reason(error: ValidationError) -> str:
    return str(error.errors()[0].get("ctx", {}).get("error", error.errors()[0]["msg"]))
