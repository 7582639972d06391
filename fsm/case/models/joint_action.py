"""Springs, dampers, friction, stops, latches and harnesses on the free coordinate of a joint."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from fsm.case.models.joint_motor import SlideMotor, TurnMotor
from fsm.case.models.materials import FamilyCrease, LinearCrease, SplineCrease
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
    Number,
    Speed,
    Stiffness,
)

LEAST_REBOUND = 1e-4
"""Restitution that a smaller one counts as: an impact that keeps 1e-8 of its energy."""
LEAST_RATE = {True: 1e-3, False: 1e-4}
"""Rate (rad/s of joints that turn, m/s) below which friction decreases, and the restitution of a stop increases to 1."""
Sections = Mapping[str, type[Model]]


def check_table(table: tuple[tuple[float, ...], ...] | None, of: str) -> None:
    """Raise `ValueError` if the rows of a table are not sorted by their first number, or fewer than two."""
    if table is not None and (len(table) < 2 or any(b[0] <= a[0] for a, b in pairwise(table))):
        raise ValueError(f"a `table` has two rows or more, sorted by the {of}")


def _named(written: Any) -> Any:
    """Section with a law: that of a spring, unless it names another, or a file or the library has the crease."""
    if isinstance(written, Mapping) and "stiffness_per_length" in written:
        raise ValueError("`stiffness_per_length` is for the creases of a sheet; give `stiffness`")
    if not isinstance(written, Mapping) or "law" in written:
        return written
    return {"law": "family" if "file" in written else "spline" if "library" in written else "spring", **written}


class _Spring(Model):
    @model_validator(mode="after")
    def _one_rest(self) -> Self:
        table, load = getattr(self, "table", None), getattr(self, self._load())
        if load is not None and getattr(self, "rest", None) is not None:
            raise ValueError(f"give `rest` or `{self._load()}` at the start, not both")
        if table is not None:
            if getattr(self, "stiffness", 0.0) or load is not None or getattr(self, "rest", None) is not None:
                raise ValueError("a `table` is the whole law; remove the other keys")
            check_table(table, "coordinate")
        return self

    def _load(self) -> str:
        return "moment" if isinstance(self, TurnSpring) else "force"


class TurnSpring(_Spring):
    """Torsional spring; its moment on the second body is against the angle."""

    law: Literal["spring"] = Field(
        default="spring", description="a spring with the keys of this section", json_schema_extra={"default": '"spring"'}
    )
    stiffness: AngularStiffness = Field(
        default=0.0, ge=0, description="stiffness of a torsional spring", json_schema_extra={"default": "0"}
    )
    rest: Angle | None = Field(
        default=None, description="angle at which the moment is zero", json_schema_extra={"default": "that at the start"}
    )
    moment: Moment | None = Field(
        default=None,
        description="moment against the angle at the start, in place of `rest`: positive drives the angle down",
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
        description="force against the displacement at the start, in place of `rest`",
        json_schema_extra={"default": "0, or that of `rest`"},
    )
    table: tuple[tuple[Length, Force], ...] | None = Field(
        default=None,
        description="rows (displacement, force against it), straight between and beyond them, in place of the other keys",
    )


class _Damper(Model):
    @model_validator(mode="after")
    def _one_law(self) -> Self:
        check_table(getattr(self, "table", None), "rate")
        if (getattr(self, "coefficient", None) is None) == (getattr(self, "table", None) is None):
            raise ValueError("a damper has a `coefficient` or a `table`; give one of them")
        return self


class TurnDamper(_Damper):
    """Moment against the rate of the angle."""

    coefficient: AngularDamping | None = Field(default=None, ge=0, description="moment over the rate of the angle")
    table: tuple[tuple[AngularSpeed, Moment], ...] | None = Field(
        default=None, description="rows (rate, moment against it), straight between and beyond, in place of a coefficient"
    )


class SlideDamper(_Damper):
    """Force against the rate of the displacement."""

    coefficient: Damping | None = Field(default=None, ge=0, description="force over the rate of the displacement")
    table: tuple[tuple[Speed, Force], ...] | None = Field(
        default=None, description="rows (rate, force against it), straight between and beyond, in place of a coefficient"
    )


_REBOUND = "rate after an impact over that before it, in place of damping; 0: it does not bounce"


class _Stop(Model):
    @model_validator(mode="after")
    def _one_side(self) -> Self:
        lower, upper = getattr(self, "lower", None), getattr(self, "upper", None)
        if lower is None and upper is None:
            raise ValueError("a stop needs `lower`, `upper` or both")
        if lower is not None and upper is not None and lower >= upper:
            raise ValueError(f"`lower` {lower:g} is not below `upper` {upper:g}")
        if getattr(self, "restitution", None) is not None and getattr(self, "damping", None):
            raise ValueError("a stop has `damping` or `restitution`; remove one of them")
        return self


class TurnStop(_Stop):
    """Spring beyond an angle."""

    lower: Angle | None = Field(default=None, description="smallest free angle", json_schema_extra={"default": "none"})
    upper: Angle | None = Field(default=None, description="largest free angle", json_schema_extra={"default": "none"})
    stiffness: AngularStiffness = Field(gt=0, description="stiffness beyond them")
    damping: AngularDamping = Field(default=0.0, ge=0, description="damping beyond them; a stop never pulls")
    restitution: Number | None = Field(
        default=None, ge=0, le=1, description=_REBOUND
    )


class SlideStop(_Stop):
    """Spring beyond a displacement."""

    lower: Length | None = Field(default=None, description="least free displacement", json_schema_extra={"default": "none"})
    upper: Length | None = Field(default=None, description="most free displacement", json_schema_extra={"default": "none"})
    stiffness: Stiffness = Field(gt=0, description="stiffness beyond them")
    damping: Damping = Field(default=0.0, ge=0, description="damping beyond them; a stop never pulls")
    restitution: Number | None = Field(
        default=None, ge=0, le=1, description=_REBOUND
    )


class _Latch(Model):
    @field_validator("rate_below", mode="before", check_fields=False)
    @classmethod
    def _any(cls, value: Any) -> Any:
        return None if value == "none" else value


class TurnLatch(_Latch):
    """Latch that closes when the angle reaches it, and then holds the joint against the way back."""

    at: Angle = Field(description="angle at which it closes, on either side of that at the start")
    play: Angle = Field(default=0.0, ge=0, description="way back that it leaves")
    stiffness: AngularStiffness = Field(gt=0, description="stiffness against the way back")
    damping: AngularDamping = Field(default=0.0, ge=0, description="damping against it")
    rate_below: Annotated[AngularSpeed, Field(gt=0)] | None = Field(
        default=None, description='largest rate at which it closes, or "none" for any', json_schema_extra={"default": "any"}
    )
    opens_at: Annotated[Moment, Field(gt=0)] | None = Field(
        default=None, description="moment against the way back at which it opens for good",
        json_schema_extra={"default": "it never opens"},
    )  # fmt: skip


class SlideLatch(_Latch):
    """Latch that closes when the displacement reaches it, and then holds the joint against the way back."""

    at: Length = Field(description="displacement at which it closes, on either side of 0")
    play: Length = Field(default=0.0, ge=0, description="way back that it leaves")
    stiffness: Stiffness = Field(gt=0, description="stiffness against the way back")
    damping: Damping = Field(default=0.0, ge=0, description="damping against it")
    rate_below: Annotated[Speed, Field(gt=0)] | None = Field(
        default=None, description='largest speed at which it closes, or "none" for any', json_schema_extra={"default": "any"}
    )
    opens_at: Annotated[Force, Field(gt=0)] | None = Field(
        default=None, description="force against the way back at which it opens for good",
        json_schema_extra={"default": "it never opens"},
    )  # fmt: skip


class _Friction(Model):
    @model_validator(mode="after")
    def _one_size(self) -> Self:
        turning = isinstance(self, TurnFriction)
        size = getattr(self, "moment" if turning else "force")
        follows, radius = getattr(self, "coefficient", None), getattr(self, "radius", None)
        if turning and (follows is None) != (radius is None):
            raise ValueError("friction that follows the reaction needs `coefficient` and `radius`")
        if size is None and follows is None:
            words = "`moment`, or `coefficient` and `radius`" if turning else "`force` or `coefficient`"
            raise ValueError(f"friction needs {words}")
        if getattr(self, "presliding", None) is not None and getattr(self, "law", None) != "lugre":
            raise ValueError('`presliding` belongs to law "lugre"; remove it')
        return self


_LAW = '"coulomb": regularised, creeps below `slip_rate`; "lugre": elastic bristles, which stick'


class TurnFriction(_Friction):
    """Moment of friction against the rate of the angle."""

    @property
    def steepest(self) -> float:
        """Largest slope of the constant part of law "coulomb" by the rate, N m s/rad."""
        return (self.moment or 0.0) / (self.slip_rate or LEAST_RATE[True])

    moment: Moment | None = Field(default=None, ge=0, description="moment during sliding")
    coefficient: Number | None = Field(
        default=None, ge=0, description="moment over radius and reaction force of the joint, added to `moment`"
    )
    radius: Annotated[Length, Field(gt=0)] | None = Field(default=None, description="radius of the bearing")
    law: Literal["coulomb", "lugre"] = Field(default="coulomb", description=_LAW)
    slip_rate: Annotated[AngularSpeed, Field(gt=0)] | None = Field(
        default=None,
        description='"coulomb": M tanh(rate/slip_rate); "lugre": rate below which bristles damp',
        json_schema_extra={"default": '1e-3 rad/s; "lugre": presliding/(10 ms)'},
    )
    presliding: Annotated[Angle, Field(gt=0)] | None = Field(
        default=None, description='"lugre": deflection of sliding bristles', json_schema_extra={"default": "1e-3 rad"}
    )


class SlideFriction(_Friction):
    """Force of friction against the rate of the displacement."""

    @property
    def steepest(self) -> float:
        """Largest slope of the constant part of law "coulomb" by the rate, N s/m."""
        return (self.force or 0.0) / (self.slip_rate or LEAST_RATE[False])

    force: Force | None = Field(default=None, ge=0, description="force during sliding")
    coefficient: Number | None = Field(
        default=None, ge=0, description="force over the reaction force of the joint, added to `force`"
    )
    law: Literal["coulomb", "lugre"] = Field(default="coulomb", description=_LAW)
    slip_rate: Annotated[Speed, Field(gt=0)] | None = Field(
        default=None,
        description='"coulomb": F tanh(rate/slip_rate); "lugre": rate below which bristles damp',
        json_schema_extra={"default": '1e-4 m/s; "lugre": presliding/(10 ms)'},
    )
    presliding: Annotated[Length, Field(gt=0)] | None = Field(
        default=None, description='"lugre": deflection of sliding bristles', json_schema_extra={"default": "1e-5 m"}
    )


class _Harness(Model):
    @model_validator(mode="after")
    def _rows(self) -> Self:
        table, data = getattr(self, "table", None), getattr(self, "data", None)
        if (table is None) == (data is None):
            raise ValueError("a harness has a `table` or a file `data`; give one of them")
        check_table(table, "coordinate")
        for c, rising, falling in table or ():
            if falling > rising:
                raise ValueError(f"at {c:g} the effort of opening is below that of closing; exchange them")
        return self

    @property
    def rows(self) -> tuple[tuple[float, float, float], ...]:
        """Rows (coordinate, effort while it increases, effort while it decreases); a file has been read."""
        return getattr(self, "table", None) or ()


_CURVES = "rows (coordinate, effort against it while it increases, while it decreases), straight between and beyond them"


class TurnHarness(_Harness):
    """Moment of a cable harness over the angle, with hysteresis."""

    data: str | None = Field(
        default=None, description="CSV file with the columns `angle`, `opening` and `closing`, relative to the case file"
    )
    table: tuple[tuple[Angle, Moment, Moment], ...] | None = Field(default=None, description=_CURVES)
    reversal: Angle = Field(
        default=math.radians(1.0), gt=0, description="change of the angle from the mean to either curve after a reversal"
    )


class SlideHarness(_Harness):
    """Force of a cable harness over the displacement, with hysteresis."""

    data: str | None = Field(
        default=None, description="CSV file with the columns `travel`, `opening` and `closing`, relative to the case file"
    )
    table: tuple[tuple[Length, Force, Force], ...] | None = Field(default=None, description=_CURVES)
    reversal: Length = Field(default=1e-3, gt=0, description="way from the mean to either curve after a reversal")


OF_TURNS: Sections = {
    "spring": TurnSpring, "damper": TurnDamper, "friction": TurnFriction, "stop": TurnStop, "latch": TurnLatch,
    "harness": TurnHarness, "motor": TurnMotor,
}  # fmt: skip
OF_SLIDES: Sections = {
    "spring": SlideSpring, "damper": SlideDamper, "friction": SlideFriction, "stop": SlideStop, "latch": SlideLatch,
    "harness": SlideHarness, "motor": SlideMotor,
}  # fmt: skip
HingeSpring = Annotated[
    TurnSpring | LinearCrease | SplineCrease | FamilyCrease, Field(discriminator="law"), BeforeValidator(_named)
]
"""Springs of joints that turn: their own keys, or the law of a crease."""
Spring = Annotated[TurnSpring | SlideSpring | LinearCrease | SplineCrease | FamilyCrease, Field()]
Damper = Annotated[TurnDamper | SlideDamper, Field()]
Friction = Annotated[TurnFriction | SlideFriction, Field()]
Stop = Annotated[TurnStop | SlideStop, Field()]
Latch = Annotated[TurnLatch | SlideLatch, Field()]
Harness = Annotated[TurnHarness | SlideHarness, Field()]


_HINGE_SPRING: TypeAdapter[Any] = TypeAdapter(HingeSpring)
_LAWS = "spring", "linear", "spline", "family"


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
        _refuse(f"acts on the one coordinate of a revolute, prismatic or screw joint, not on kind {info.data.get('kind')!r}")
    try:
        if turning and key == "spring":
            return _HINGE_SPRING.validate_python(value, context=info.context)
        return (OF_TURNS if turning else OF_SLIDES)[key].model_validate(value, context=info.context)
    except ValidationError as error:
        _refuse("; ".join(_fault(detail) for detail in error.errors(include_url=False)))


def _fault(detail: Any) -> str:
    place = ".".join(str(key) for key in detail["loc"] if key not in _LAWS)
    if detail["type"] == "extra_forbidden":
        return f"{place}: unknown key"
    if detail["type"] == "missing":
        return f"{place}: missing; this key is required"
    message = str(detail["ctx"]["error"]) if detail["type"] == "value_error" else detail["msg"]
    return f"{place}: {message}" if place else message


def _refuse(text: str) -> Any:
    raise PydanticCustomError("quantity", "{text}", {"text": text})
