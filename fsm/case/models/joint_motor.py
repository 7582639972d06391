"""Motors on the free coordinate of a joint that turns or slides."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, ClassVar, Self

from pydantic import model_validator

from fsm.case.models.time_program import Constant, Table, TimeFunction
from fsm.case.schema.model import Key, Model
from fsm.case.schema.units import Angle, AngularSpeed, Force, Length, Moment, Number, Speed


class _Motor(Model):
    """An amount times a function of time prescribes the rate, the way or the effort.

    `speed = {value = ..., time = {...}}` is the same as `speed = ...` with `time`.
    """

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> Mapping[str, Any]:
        """Amount and `time` of a section such as `speed = { value = "2 deg/s", kind = "ramp", end = "1 s" }`."""
        found = dict(written)
        for key in cls.amounts:
            given = found.get(key)
            if isinstance(given, Mapping) and "time" not in found:
                parts = dict(given)
                found[key] = parts.pop("value", None)
                time = parts["time"] if set(parts) == {"time"} and isinstance(parts["time"], Mapping) else parts
                found |= {"time": time} if time else {}
        return found

    amounts: ClassVar[tuple[str, str, str]]
    """Keys of rate, way and effort."""

    @property
    def way(self) -> float | None:
        """Prescribed change of the coordinate, times `time`; None without."""
        way: float | None = getattr(self, self.amounts[1])
        return way

    @property
    def effort(self) -> float | None:
        """Prescribed moment or force at the motor, times `time`; None without."""
        effort: float | None = getattr(self, self.amounts[2])
        return effort

    @property
    def curve(self) -> tuple[tuple[float, float], ...] | None:
        """Rows (rate, effort) at the motor."""
        rows = getattr(self, f"{self.amounts[2]}_speed")
        return None if isinstance(rows, str) else rows

    @property
    def prescribes(self) -> bool:
        """Whether the motor prescribes the coordinate, whatever moment that takes."""
        return self.effort is None and not getattr(self, f"{self.amounts[2]}_speed")

    @model_validator(mode="after")
    def _one(self) -> Self:
        given = [key for key in self.amounts if getattr(self, key) is not None]
        words = ", ".join(f"`{key}`" for key in self.amounts)
        curve = f"{self.amounts[2]}_speed"
        limited = getattr(self, curve) is not None
        if len(given) > 1 or not (given or limited):
            raise ValueError(f"a motor needs one of {words}, or `{curve}`")
        if limited and given not in ([], ["speed"]):
            raise ValueError(f"`{curve}` goes with `speed` or alone; remove `{given[0]}`")
        if self.way is not None and (self.time is None or isinstance(self.time, Constant)):
            raise ValueError(f"`{given[0]}` of a motor needs `time`, a function of time from 0 on")
        if isinstance(self.time, Table) and self.time.amount is not None:
            raise ValueError("the table of a motor has the columns `time` and `value`, factors on its amount")
        if self.time is not None and not given:
            raise ValueError("`time` multiplies an amount; give `speed`")
        if self.prescribes and (self.ratio != 1.0 or self.free_wheel):
            raise ValueError(f"a motor that prescribes the motion has no `ratio` and no `free_wheel`; give `{curve}`")
        rows = self.curve
        if rows is not None and (len(rows) < 2 or any(b[0] <= a[0] for a, b in pairwise(rows))):
            raise ValueError(f"`{curve}` has two rows or more, sorted by the speed")
        return self

    time: TimeFunction | None = Key("[function of time](#functions-of-time) of the amount", default=None, shown="constant")
    ratio: Number = Key("turns of the motor for one of the joint", default=1.0, gt=0)
    free_wheel: bool = Key("whether the joint may run ahead: the motor never brakes", default=False)


class TurnMotor(_Motor):
    """Prescribed angle or rate, or a moment."""

    amounts = "speed", "angle", "torque"
    speed: AngularSpeed | None = Key(
        "rate of the angle, times `time`; with `torque_speed` that up to which it pushes", default=None
    )
    angle: Angle | None = Key("change of the angle from the start, times `time`", default=None)
    torque: Moment | None = Key("moment of the motor, times `time`; times `ratio` at the joint", default=None)
    torque_speed: tuple[tuple[AngularSpeed, Moment], ...] | str | None = Key(
        "rows (speed, torque) of the motor, or a CSV file with the columns `speed` and `torque`; straight "
        "between and beyond the rows", default=None,
    )  # fmt: skip


class SlideMotor(_Motor):
    """Prescribed displacement or rate, or a force."""

    amounts = "speed", "travel", "force"
    speed: Speed | None = Key(
        "speed along the axis, times `time`; with `force_speed` that up to which it pushes", default=None
    )
    travel: Length | None = Key("displacement from the start, times `time`", default=None)
    force: Force | None = Key("force of the motor, times `time`; times `ratio` at the joint", default=None)
    force_speed: tuple[tuple[Speed, Force], ...] | None = Key(
        "rows (speed, force) of the motor, straight between and beyond them", default=None
    )


Motor = TurnMotor | SlideMotor
