"""Springs, dampers, friction, stops, latches and harnesses on the free coordinate of a joint."""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError, ValidationInfo, field_validator, model_validator

from fsm.case.models.joint_motor import SlideMotor, TurnMotor
from fsm.case.models.law_keys import refuse
from fsm.case.models.materials import FamilyCrease, LinearCrease, SplineCrease
from fsm.case.schema.model import Key, Model
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

    law: Literal["spring"] = Key("a spring with the keys of this section", default="spring", shown='"spring"')
    stiffness: AngularStiffness = Key("stiffness of a torsional spring", default=0.0, ge=0, shown="0")
    rest: Angle | None = Key("angle at which the moment is zero", default=None, shown="that at the start")
    moment: Moment | None = Key(
        "moment against the angle at the start, in place of `rest`: positive drives the angle down", default=None,
        shown="0, or that of `rest`"
    )  # fmt: skip
    table: tuple[tuple[Angle, Moment], ...] | None = Key(
        "rows (angle, moment against the angle), straight between and beyond them, in place of the other keys", default=None
    )


class SlideSpring(_Spring):
    """Spring along the axis; its force on the second body is against the displacement."""

    stiffness: Stiffness = Key("stiffness of a spring along the axis", default=0.0, ge=0)
    rest: Length | None = Key("displacement at which the force is zero", default=None, shown="0")
    force: Force | None = Key(
        "force against the displacement at the start, in place of `rest`", default=None, shown="0, or that of `rest`"
    )
    table: tuple[tuple[Length, Force], ...] | None = Key(
        "rows (displacement, force against it), straight between and beyond them, in place of the other keys", default=None
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

    coefficient: AngularDamping | None = Key("moment over the rate of the angle", default=None, ge=0)
    table: tuple[tuple[AngularSpeed, Moment], ...] | None = Key(
        "rows (rate, moment against it), straight between and beyond, in place of a coefficient", default=None
    )


class SlideDamper(_Damper):
    """Force against the rate of the displacement."""

    coefficient: Damping | None = Key("force over the rate of the displacement", default=None, ge=0)
    table: tuple[tuple[Speed, Force], ...] | None = Key(
        "rows (rate, force against it), straight between and beyond, in place of a coefficient", default=None
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

    lower: Angle | None = Key("smallest free angle", default=None, shown="none")
    upper: Angle | None = Key("largest free angle", default=None, shown="none")
    stiffness: AngularStiffness = Key("stiffness beyond them", gt=0)
    damping: AngularDamping = Key("damping beyond them; a stop never pulls", default=0.0, ge=0)
    restitution: Number | None = Key(_REBOUND, default=None, ge=0, le=1)


class SlideStop(_Stop):
    """Spring beyond a displacement."""

    lower: Length | None = Key("least free displacement", default=None, shown="none")
    upper: Length | None = Key("most free displacement", default=None, shown="none")
    stiffness: Stiffness = Key("stiffness beyond them", gt=0)
    damping: Damping = Key("damping beyond them; a stop never pulls", default=0.0, ge=0)
    restitution: Number | None = Key(_REBOUND, default=None, ge=0, le=1)


class _Latch(Model):
    @field_validator("rate_below", mode="before", check_fields=False)
    @classmethod
    def _any(cls, value: Any) -> Any:
        return None if value == "none" else value


class TurnLatch(_Latch):
    """Latch that closes when the angle reaches it, and then holds the joint against the way back."""

    at: Angle = Key("angle at which it closes, on either side of that at the start")
    play: Angle = Key("way back that it leaves", default=0.0, ge=0)
    stiffness: AngularStiffness = Key("stiffness against the way back", gt=0)
    damping: AngularDamping = Key("damping against it", default=0.0, ge=0)
    rate_below: Annotated[AngularSpeed, Field(gt=0)] | None = Key(
        'largest rate at which it closes, or "none" for any', default=None, shown="any"
    )
    opens_at: Annotated[Moment, Field(gt=0)] | None = Key(
        "moment against the way back at which it opens for good", default=None, shown="it never opens"
    )


class SlideLatch(_Latch):
    """Latch that closes when the displacement reaches it, and then holds the joint against the way back."""

    at: Length = Key("displacement at which it closes, on either side of 0")
    play: Length = Key("way back that it leaves", default=0.0, ge=0)
    stiffness: Stiffness = Key("stiffness against the way back", gt=0)
    damping: Damping = Key("damping against it", default=0.0, ge=0)
    rate_below: Annotated[Speed, Field(gt=0)] | None = Key(
        'largest speed at which it closes, or "none" for any', default=None, shown="any"
    )
    opens_at: Annotated[Force, Field(gt=0)] | None = Key(
        "force against the way back at which it opens for good", default=None, shown="it never opens"
    )


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

    moment: Moment | None = Key("moment during sliding", default=None, ge=0)
    coefficient: Number | None = Key(
        "moment over radius and reaction force of the joint, added to `moment`", default=None, ge=0
    )
    radius: Annotated[Length, Field(gt=0)] | None = Key("radius of the bearing", default=None)
    law: Literal["coulomb", "lugre"] = Key(_LAW, default="coulomb")
    slip_rate: Annotated[AngularSpeed, Field(gt=0)] | None = Key(
        '"coulomb": M tanh(rate/slip_rate); "lugre": rate below which bristles damp', default=None,
        shown='1e-3 rad/s; "lugre": presliding/(10 ms)'
    )  # fmt: skip
    presliding: Annotated[Angle, Field(gt=0)] | None = Key(
        '"lugre": deflection of sliding bristles', default=None, shown="1e-3 rad"
    )


class SlideFriction(_Friction):
    """Force of friction against the rate of the displacement."""

    @property
    def steepest(self) -> float:
        """Largest slope of the constant part of law "coulomb" by the rate, N s/m."""
        return (self.force or 0.0) / (self.slip_rate or LEAST_RATE[False])

    force: Force | None = Key("force during sliding", default=None, ge=0)
    coefficient: Number | None = Key("force over the reaction force of the joint, added to `force`", default=None, ge=0)
    law: Literal["coulomb", "lugre"] = Key(_LAW, default="coulomb")
    slip_rate: Annotated[Speed, Field(gt=0)] | None = Key(
        '"coulomb": F tanh(rate/slip_rate); "lugre": rate below which bristles damp', default=None,
        shown='1e-4 m/s; "lugre": presliding/(10 ms)'
    )  # fmt: skip
    presliding: Annotated[Length, Field(gt=0)] | None = Key(
        '"lugre": deflection of sliding bristles', default=None, shown="1e-5 m"
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

    data: str | None = Key(
        "CSV file with the columns `angle`, `opening` and `closing`, relative to the case file", default=None
    )
    table: tuple[tuple[Angle, Moment, Moment], ...] | None = Key(_CURVES, default=None)
    reversal: Angle = Key(
        "change of the angle from the mean to either curve after a reversal", default=math.radians(1.0), gt=0
    )


class SlideHarness(_Harness):
    """Force of a cable harness over the displacement, with hysteresis."""

    data: str | None = Key(
        "CSV file with the columns `travel`, `opening` and `closing`, relative to the case file", default=None
    )
    table: tuple[tuple[Length, Force, Force], ...] | None = Key(_CURVES, default=None)
    reversal: Length = Key("way from the mean to either curve after a reversal", default=1e-3, gt=0)


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
        refuse(f"acts on the one coordinate of a revolute, prismatic or screw joint, not on kind {info.data.get('kind')!r}")
    try:
        if turning and key == "spring":
            return _HINGE_SPRING.validate_python(value, context=info.context)
        return (OF_TURNS if turning else OF_SLIDES)[key].model_validate(value, context=info.context)
    except ValidationError as error:
        refuse("; ".join(_fault(detail) for detail in error.errors(include_url=False)))


def _fault(detail: Any) -> str:
    place = ".".join(str(key) for key in detail["loc"] if key not in _LAWS)
    if detail["type"] == "extra_forbidden":
        return f"{place}: unknown key"
    if detail["type"] == "missing":
        return f"{place}: missing; this key is required"
    message = str(detail["ctx"]["error"]) if detail["type"] == "value_error" else detail["msg"]
    return f"{place}: {message}" if place else message
