"""Functions of time that multiply loads and prescribed motions: constant, ramp, table and cycle."""

import math
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Key, Model
from fsm.case.schema.units import Angle, Force, Length, Moment, Number, Stress, Time

AMOUNTS = ("travel", "turn", "force", "moment", "pressure")
"""Columns of a table that have a unit."""


_KIND = '"constant": the factor 1; "ramp": from 0 at `start` to 1 at `end`; "table": given rows; "cycle": periodic'


class Constant(Model):
    """Factor 1 at all times."""

    kind: Literal["constant"] = Key(_KIND, default="constant")


class Ramp(Model):
    """Factor that increases from 0 at `start` to 1 at `end`."""

    kind: Literal["ramp"] = Key(_KIND)
    start: Time = Key("time at which the ramp begins", default=0.0)
    end: Time = Key("time at which the ramp ends", within="> start")
    shape: Literal["smooth", "linear", "unbounded"] = Key(
        '"smooth" has a continuous slope; "unbounded" is linear also before `start` and after `end`, for loads '
        'with "arc-length"', default="smooth",
    )  # fmt: skip

    @model_validator(mode="after")
    def _forward(self) -> Self:
        if self.end <= self.start:
            raise ValueError(
                f"a ramp must end after it starts; end = {self.end:g} s, start = {self.start:g} s"
            )
        return self


class Table(Model):
    """Rows of a program over time; constant before the first and after the last row."""

    kind: Literal["table"] = Key(_KIND)
    time: tuple[Time, ...] | None = Key("times of the rows", default=None, within="increasing, two or more")
    value: tuple[Number, ...] | None = Key(
        "factors; give this, one of the next five keys, or `file`", default=None, within="as many as times"
    )
    travel: tuple[Length, ...] | None = Key(
        "travel of a drive, instead of `drive.travel`", default=None, within="as many as times"
    )
    turn: tuple[Angle, ...] | None = Key("turn of a drive, instead of `drive.turn`", default=None, within="as many as times")
    force: tuple[Force, ...] | None = Key(
        "force of a load along the vector `load.force`, of any length", default=None, within="as many as times"
    )
    moment: tuple[Moment, ...] | None = Key(
        "moment of a load along the vector `load.moment`", default=None, within="as many as times"
    )
    pressure: tuple[Stress, ...] | None = Key(
        "pressure of a load, instead of `load.pressure`", default=None, within="as many as times"
    )
    file: str | None = Key("CSV file with the columns `time` and one of the others, relative to the case file", default=None)
    interpolation: Literal["linear", "smooth"] | None = Key(
        '"linear", or "smooth": cubic pieces without overshoot, at rest at both ends', default=None,
        shown='"smooth" for a drive, "linear" for a load'
    )  # fmt: skip

    @property
    def amount(self) -> str | None:
        """Name of the column with a unit, or None."""
        return next((name for name in AMOUNTS if getattr(self, name) is not None), None)

    @model_validator(mode="after")
    def _sorted(self) -> Self:
        columns = [name for name in ("value", *AMOUNTS) if getattr(self, name) is not None]
        if self.file is not None:
            if self.time is not None or columns:
                raise ValueError("a table has either a `file` or its own rows; remove one of them")
            return self
        if self.time is None or len(columns) != 1:
            given = f"; it has {' and '.join(columns)}" if columns else ""
            raise ValueError(f"a table needs a `file`, or `time` and exactly one of value, {', '.join(AMOUNTS)}{given}")
        rows = len(getattr(self, columns[0]))
        if len(self.time) != rows or rows < 2:
            raise ValueError(
                f"a table needs one {columns[0]} for each time, and at least two; it has {len(self.time)} times and "
                f"{rows} {columns[0]}s"
            )
        if any(b <= a for a, b in zip(self.time, self.time[1:], strict=False)):
            raise ValueError("the times of a table must increase; sort the rows, and give each time once")
        return self


class Cycle(Model):
    """Periodic factor from `start` on, with one sine wave a period."""

    kind: Literal["cycle"] = Key(_KIND)
    period: Time = Key("duration of a period", gt=0)
    start: Time = Key("time at which the first period begins", default=0.0)
    cycles: Annotated[Number, Field(gt=0)] | None = Key(
        "number of periods; required for a drive; a load without it has no end", default=None
    )
    form: Literal["pulsating", "alternating"] = Key(
        '"pulsating" is (1 - cos)/2, which starts at rest and lies between 0 and 1; "alternating" is sin, '
        "between -1 and 1", default="pulsating",
    )  # fmt: skip


TimeFunction = Annotated[Constant | Ramp | Table | Cycle, Field(discriminator="kind")]


def normalised(table: Table, interpolation: Literal["linear", "smooth"]) -> tuple[Table, float]:
    """Table with factors between -1 and 1 instead of amounts, and the amount of the factor 1.

    Raises
    ------
    ValueError
        All rows are zero.
    """
    name = table.amount
    assert name is not None
    rows: tuple[float, ...] = getattr(table, name)
    largest = max(abs(row) for row in rows)
    if largest == 0.0:
        raise ValueError(f"all rows of {name} are zero; give at least one row that is not zero, or remove the table")
    update = {name: None, "value": tuple(row / largest for row in rows)}
    return table.model_copy(update=update | {"interpolation": table.interpolation or interpolation}), largest


def shifted(function: TimeFunction, by: float) -> TimeFunction:
    """Function that is delayed by a time (s)."""
    if by == 0.0 or isinstance(function, Constant):
        return function
    if isinstance(function, Ramp):
        return function.model_copy(update={"start": function.start + by, "end": function.end + by})
    if isinstance(function, Cycle):
        return function.model_copy(update={"start": function.start + by})
    assert function.time is not None
    return function.model_copy(update={"time": tuple(at + by for at in function.time)})


def end_of(function: TimeFunction) -> float | None:
    """Time after which a time function is constant, s; None for a cycle without end."""
    if isinstance(function, Constant):
        return 0.0
    if isinstance(function, Ramp):
        return function.end
    if isinstance(function, Cycle):
        return None if function.cycles is None else function.start + function.cycles * function.period
    assert function.time is not None
    return function.time[-1]


def steepest(function: TimeFunction) -> float:
    """Largest slope of a time function, 1/s; an upper bound for a smooth table."""
    if isinstance(function, Constant):
        return 0.0
    if isinstance(function, Ramp):
        return (1.5 if function.shape == "smooth" else 1.0) / (function.end - function.start)
    if isinstance(function, Cycle):
        return (math.pi if function.form == "pulsating" else 2.0 * math.pi) / function.period
    assert function.time is not None and function.value is not None
    rows = pairwise(zip(function.time, function.value, strict=True))
    largest = max(abs(w - v) / (t - s) for (s, v), (t, w) in rows)
    return 1.5 * largest if function.interpolation == "smooth" else largest
