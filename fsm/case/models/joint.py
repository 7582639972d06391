"""Section [[scene.joints]] of a case: ideal joints between two bodies."""

from __future__ import annotations

import math
from typing import Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from fsm.case.models.joint_action import Damper, Friction, Harness, Latch, Spring, Stop, action_of
from fsm.case.models.joint_motor import Motor
from fsm.case.schema.model import Model, Name
from fsm.case.schema.units import Angle, Length, Number

JointKind = Literal[
    "fixed", "revolute", "prismatic", "cylindrical", "spherical", "universal", "planar", "in-line", "in-plane", "distance",
    "screw",
]  # fmt: skip
WITHOUT_AXIS = ("spherical", "distance", "fixed")
"""Kinds that have no axis."""
WITH_TO = ("in-line", "in-plane", "distance")
"""Kinds with a point of the second body apart from `at`."""
TURNING = ("revolute", "cylindrical", "planar", "screw")
"""Kinds with one angle about their axis."""
_SQUARE = 1e-6
"""Cosine of the angle of two axes below which the angle is a right one."""

Axis = tuple[Number, Number, Number]


class SceneJoint(Model):
    """Ideal joint: its locked directions do not open, and it has no mass and no friction.

    Points and axes are in inertial axes at the start. Both bodies carry them from there on.
    """

    name: Name = Field(description="name of the joint", json_schema_extra={"range": "different from all other joints"})
    kind: JointKind = Field(description="what the joint leaves free, see below")
    first: str = Field(
        description="first body, which carries the axis; on flexible parts a frame, or an end or edge by its name, as "
        '`"beam 1.end"` and `"film 1.left"`',
        json_schema_extra={"range": 'a body, "ground", a frame, or an end or edge of a flexible part'},
    )
    second: str = Field(
        description="second body, whose motion relative to the first is the motion of the joint",
        json_schema_extra={"range": "as `first`"},
    )
    at: tuple[Length, Length, Length] = Field(description="place of the joint at the start, inertial axes")
    axis: Axis | None = Field(
        default=None,
        description="axis of the joint at the start, inertial axes, of any length: of turning, of sliding, of the line, or "
        "the normal of the plane",
        json_schema_extra={"default": "required, but not with spherical, fixed and distance"},
    )
    second_axis: Axis | None = Field(
        default=None,
        description="universal: axis of the cross on the second body at the start, at a right angle to `axis`, that on the "
        "first body",
        json_schema_extra={"default": "required with universal only"},
    )
    to: tuple[Length, Length, Length] | None = Field(
        default=None,
        description="in-line, in-plane and distance: the point of the second body at the start, inertial axes",
        json_schema_extra={"default": "required with these kinds only"},
    )
    angle: Angle = Field(
        default=0.0, description="angle of the joint at the start; turns are counted from here on",
        json_schema_extra={"range": "kinds that turn about one axis"},
    )  # fmt: skip

    pitch: Length | None = Field(
        default=None,
        description="screw: displacement along the axis for one turn about it, negative for a left-hand thread",
        json_schema_extra={"default": "required with screw only"},
    )

    spring: Spring | None = Field(
        default=None, description="spring on the coordinate, or the law of a crease with the keys of `[crease]`"
    )
    damper: Damper | None = Field(default=None, description="damper on the coordinate")
    friction: Friction | None = Field(default=None, description="friction on the coordinate")
    stop: Stop | None = Field(default=None, description="spring and damper beyond a limit")
    latch: Latch | None = Field(default=None, description="stop against the way back, from the moment it is reached")
    harness: Harness | None = Field(default=None, description="moment or force of a cable harness, with hysteresis")
    motor: Motor | None = Field(default=None, description="prescribed motion of the coordinate, or a moment or force on it")

    @field_validator("spring", "damper", "friction", "stop", "latch", "harness", "motor", mode="before")
    @classmethod
    def _of_coordinate(cls, value: Any, info: ValidationInfo) -> Any:
        return action_of(value, info, info.data.get("kind") in ("revolute", "screw"), info.data.get("kind") == "prismatic")

    @field_validator("axis", "second_axis")
    @classmethod
    def _not_zero(cls, value: Axis | None) -> Axis | None:
        if value is not None and not math.hypot(*value) > 0.0:
            raise ValueError("an axis has a direction; give a vector that is not zero, for example [0, 1, 0]")
        return value

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.first == self.second:
            raise ValueError(f"joint {self.name!r} joins {self.first!r} to itself; `first` and `second` must differ")
        needs = self.kind not in WITHOUT_AXIS
        self._given("axis", self.axis is not None, needs)
        self._given("second_axis", self.second_axis is not None, self.kind == "universal")
        self._given("to", self.to is not None, self.kind in WITH_TO)
        self._given("pitch", self.pitch is not None, self.kind == "screw")
        if self.pitch == 0.0:
            raise ValueError(f"the screw {self.name!r} has no pitch; use kind revolute")
        if self.angle and self.kind not in TURNING:
            raise ValueError(f"joint {self.name!r} of kind {self.kind!r} has no `angle`; remove this key")
        if self.latch is not None and self.latch.at == self.angle:
            raise ValueError(f"the latch of {self.name!r} is where the joint starts; use kind fixed, or another `latch.at`")
        if self.kind == "distance" and self.to == self.at:
            raise ValueError(f"joint {self.name!r} keeps a distance of zero; use kind spherical, or another point `to`")
        if self.kind == "universal":
            assert self.axis is not None and self.second_axis is not None
            both = sum(a * b for a, b in zip(self.axis, self.second_axis, strict=True))
            if abs(both) > _SQUARE * math.hypot(*self.axis) * math.hypot(*self.second_axis):
                text = f"the two axes of the cross of {self.name!r} are not at a right angle"
                raise ValueError(f"{text}; correct `second_axis`")
        return self

    def _given(self, key: str, given: bool, needed: bool) -> None:
        if needed and not given:
            raise ValueError(f"joint {self.name!r} of kind {self.kind!r} needs `{key}`")
        if given and not needed:
            raise ValueError(f"joint {self.name!r} of kind {self.kind!r} has no `{key}`; remove this key")
