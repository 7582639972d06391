"""Section [[scene.joints]] of a case: ideal joints between two bodies."""

import math
from typing import Any, Literal, Self

from pydantic import ValidationInfo, field_validator, model_validator

from fsm.case.models.joint_action import Damper, Friction, Harness, Latch, Spring, Stop, action_of
from fsm.case.models.joint_motor import Motor
from fsm.case.schema.model import Key, Model, Name
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

    name: Name = Key("name of the joint", within="different from all other joints")
    kind: JointKind = Key("what the joint leaves free, see below")
    first: str = Key(
        "first body, which carries the axis; on flexible parts a frame, or an end or edge by its name, as "
        '`"beam 1.end"`, `"film 1.left"` and `"sheet.left"`',
        within='a body, "ground", a frame, an end or edge of a flexible part, or a facet',
    )  # fmt: skip
    second: str = Key("second body, whose motion relative to the first is the motion of the joint", within="as `first`")
    at: tuple[Length, Length, Length] = Key("place of the joint at the start, inertial axes")
    axis: Axis | None = Key(
        "axis of the joint at the start, inertial axes, of any length: of turning, of sliding, of the line, or "
        "the normal of the plane", default=None, shown="required, but not with spherical, fixed and distance",
    )  # fmt: skip
    second_axis: Axis | None = Key(
        "universal: axis of the cross on the second body at the start, at a right angle to `axis`, that on the "
        "first body", default=None, shown="required with universal only",
    )  # fmt: skip
    to: tuple[Length, Length, Length] | None = Key(
        "in-line, in-plane and distance: the point of the second body at the start, inertial axes", default=None,
        shown="required with these kinds only"
    )  # fmt: skip
    angle: Angle = Key(
        "angle of the joint at the start; turns are counted from here on", default=0.0,
        within="kinds that turn about one axis"
    )  # fmt: skip

    pitch: Length | None = Key(
        "screw: displacement along the axis for one turn about it, negative for a left-hand thread", default=None,
        shown="required with screw only"
    )  # fmt: skip

    spring: Spring | None = Key("spring on the coordinate, or the law of a crease with the keys of `[crease]`", default=None)
    damper: Damper | None = Key("damper on the coordinate", default=None)
    friction: Friction | None = Key("friction on the coordinate", default=None)
    stop: Stop | None = Key("spring and damper beyond a limit", default=None)
    latch: Latch | None = Key("stop against the way back, from the moment it is reached", default=None)
    harness: Harness | None = Key("moment or force of a cable harness, with hysteresis", default=None)
    motor: Motor | None = Key("prescribed motion of the coordinate, or a moment or force on it", default=None)

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
