"""Springs, dampers, stops and motors on the free coordinate of a joint that turns or slides."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, ValidationInfo, model_validator
from pydantic_core import PydanticCustomError

from fsm.case.models.time_program import TimeFunction
from fsm.case.schema.model import Model
from fsm.case.schema.units import (
    Angle,
    AngularDamping,
    AngularSpeed,
    AngularStiffness,
    Damping,
    Force,
    Length,
    Moment,
    Speed,
    Stiffness,
)

Sections = Mapping[str, type[Model]]


class _Spring(Model):
    @model_validator(mode="after")
    def _one_rest(self) -> Self:
        table, load = getattr(self, "table", None), getattr(self, self._load())
        if load is not None and getattr(self, "rest", None) is not None:
            raise ValueError(f"give `rest` or `{self._load()}` at the start, not both")
        if table is not None:
            if getattr(self, "stiffness", 0.0) or load is not None or getattr(self, "rest", None) is not None:
                raise ValueError("a `table` is the whole law; remove the other keys")
            if len(table) < 2 or any(b[0] <= a[0] for a, b in pairwise(table)):
                raise ValueError("a `table` has two rows or more, sorted by the coordinate")
        return self

    def _load(self) -> str:
        return "moment" if isinstance(self, TurnSpring) else "force"


class TurnSpring(_Spring):
    """Torsional spring; its moment on the second body is against the angle."""

    stiffness: AngularStiffness = Field(default=0.0, ge=0, description="stiffness of a torsional spring")
    rest: Angle | None = Field(
        default=None, description="angle at which the moment is zero", json_schema_extra={"default": "that at the start"}
    )
    moment: Moment | None = Field(
        default=None,
        description="moment on the second body at the start, positive in the sense of the angle, in place of `rest`",
        json_schema_extra={"default": "0, or that of `rest`"},
    )
    table: tuple[tuple[Angle, Moment], ...] | None = Field(
        default=None,
        description="rows (angle, moment against the angle), straight between and beyond them, in place of the other keys",
    )


class SlideSpring(_Spring):
    """Spring along the axis; its force on the second body is against the displacement."""

    stiffness: Stiffness = Field(default=0.0, ge=0, description="stiffness of a spring along the axis")
    rest: Length | None = Field(
        default=None, description="displacement at which the force is zero", json_schema_extra={"default": "0"}
    )
    force: Force | None = Field(
        default=None,
        description="force on the second body at the start, positive along the axis, in place of `rest`",
        json_schema_extra={"default": "0, or that of `rest`"},
    )
    table: tuple[tuple[Length, Force], ...] | None = Field(
        default=None,
        description="rows (displacement, force against it), straight between and beyond them, in place of the other keys",
    )


class TurnDamper(Model):
    """Moment against the rate of the angle."""

    coefficient: AngularDamping = Field(ge=0, description="moment over the rate of the angle")


class SlideDamper(Model):
    """Force against the rate of the displacement."""

    coefficient: Damping = Field(ge=0, description="force over the rate of the displacement")


class _Stop(Model):
    @model_validator(mode="after")
    def _one_side(self) -> Self:
        lower, upper = getattr(self, "lower", None), getattr(self, "upper", None)
        if lower is None and upper is None:
            raise ValueError("a stop needs `lower`, `upper` or both")
        if lower is not None and upper is not None and lower >= upper:
            raise ValueError(f"`lower` {lower:g} is not below `upper` {upper:g}")
        return self


class TurnStop(_Stop):
    """Spring beyond an angle."""

    lower: Angle | None = Field(default=None, description="smallest free angle", json_schema_extra={"default": "none"})
    upper: Angle | None = Field(default=None, description="largest free angle", json_schema_extra={"default": "none"})
    stiffness: AngularStiffness = Field(gt=0, description="stiffness beyond them")
    damping: AngularDamping = Field(default=0.0, ge=0, description="damping beyond them; a stop never pulls")


class SlideStop(_Stop):
    """Spring beyond a displacement."""

    lower: Length | None = Field(default=None, description="least free displacement", json_schema_extra={"default": "none"})
    upper: Length | None = Field(default=None, description="most free displacement", json_schema_extra={"default": "none"})
    stiffness: Stiffness = Field(gt=0, description="stiffness beyond them")
    damping: Damping = Field(default=0.0, ge=0, description="damping beyond them; a stop never pulls")


class TurnMotor(Model):
    """Prescribed angle: a constant rate, or a turn as a function of time."""

    rate: AngularSpeed | None = Field(default=None, description="constant rate of the angle; or give `turn` and `time`")
    turn: Angle | None = Field(default=None, description="change of the angle from the start, times `time`")
    time: TimeFunction | None = Field(default=None, description="[function of time](#functions-of-time) of `turn`")

    @model_validator(mode="after")
    def _one(self) -> Self:
        return _one_program(self, "rate", "turn")


class SlideMotor(Model):
    """Prescribed displacement: a constant speed, or a travel as a function of time."""

    speed: Speed | None = Field(default=None, description="constant speed along the axis; give this, or `travel` and `time`")
    travel: Length | None = Field(default=None, description="displacement, times `time`")
    time: TimeFunction | None = Field(default=None, description="[function of time](#functions-of-time) of `travel`")

    @model_validator(mode="after")
    def _one(self) -> Self:
        return _one_program(self, "speed", "travel")


class TurnLatch(Model):
    """Latch that closes when the angle reaches it, and then holds the joint against the way back."""

    at: Angle = Field(description="angle at which it closes, on either side of that at the start")
    play: Angle = Field(default=0.0, ge=0, description="way back that it leaves")
    stiffness: AngularStiffness = Field(gt=0, description="stiffness against the way back")
    damping: AngularDamping = Field(default=0.0, ge=0, description="damping against it")
    rate_below: AngularSpeed | None = Field(
        default=None, gt=0, description="largest rate at which it closes", json_schema_extra={"default": "any"}
    )


class SlideLatch(Model):
    """Latch that closes when the displacement reaches it, and then holds the joint against the way back."""

    at: Length = Field(description="displacement at which it closes, on either side of 0")
    play: Length = Field(default=0.0, ge=0, description="way back that it leaves")
    stiffness: Stiffness = Field(gt=0, description="stiffness against the way back")
    damping: Damping = Field(default=0.0, ge=0, description="damping against it")
    rate_below: Speed | None = Field(
        default=None, gt=0, description="largest speed at which it closes", json_schema_extra={"default": "any"}
    )


Motor = TurnMotor | SlideMotor


def _one_program(motor: Any, pace: str, way: str) -> Any:
    steady, programmed = getattr(motor, pace) is not None, getattr(motor, way) is not None
    if steady == programmed or programmed != (motor.time is not None):
        raise ValueError(f"a motor needs either `{pace}`, or `{way}` and `time`")
    return motor


OF_TURNS: Sections = {"spring": TurnSpring, "damper": TurnDamper, "stop": TurnStop, "latch": TurnLatch, "motor": TurnMotor}
OF_SLIDES: Sections = {
    "spring": SlideSpring, "damper": SlideDamper, "stop": SlideStop, "latch": SlideLatch, "motor": SlideMotor
}  # fmt: skip
Spring = Annotated[TurnSpring | SlideSpring, Field()]
Damper = Annotated[TurnDamper | SlideDamper, Field()]
Stop = Annotated[TurnStop | SlideStop, Field()]
Latch = Annotated[TurnLatch | SlideLatch, Field()]


def action_of(value: Any, info: ValidationInfo, turning: bool, sliding: bool) -> Any:
    """Section of an action with the units of the joint's coordinate.

    Raises
    ------
    PydanticCustomError
        The joint has no single coordinate, or the section has faults.
    """
    if value is None or isinstance(value, Model):
        return value
    key = str(info.field_name)
    if turning == sliding:
        _refuse(f"acts on the one coordinate of a revolute or a prismatic joint, not on kind {info.data.get('kind')!r}")
    try:
        return (OF_TURNS if turning else OF_SLIDES)[key].model_validate(value, context=info.context)
    except ValidationError as error:
        _refuse("; ".join(_fault(detail) for detail in error.errors(include_url=False)))


def _fault(detail: Any) -> str:
    place = ".".join(str(key) for key in detail["loc"])
    if detail["type"] == "extra_forbidden":
        return f"{place}: unknown key"
    if detail["type"] == "missing":
        return f"{place}: missing; this key is required"
    message = str(detail["ctx"]["error"]) if detail["type"] == "value_error" else detail["msg"]
    return f"{place}: {message}" if place else message


def _refuse(text: str) -> Any:
    raise PydanticCustomError("quantity", "{text}", {"text": text})
