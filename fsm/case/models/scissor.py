"""Sections of a case with `analysis = "scissor"`: array of units of two crossing bars, joined at their tips.

An array of n units has the points a1 ... a(n+1) on its upper side, b1 ... b(n+1) on its lower side, and the middle hinges
h1 ... hn. Bar k.1 goes from b(k) to a(k+1), bar k.2 from a(k) to b(k+1). The array lies in the plane x, y. In results, which
have the axes of all scenes, its y axis is z.
"""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from fsm.case.models.time_program import Constant, Table, TimeFunction
from fsm.case.schema.model import Model
from fsm.case.schema.units import (
    Angle,
    AngularDamping,
    AngularSpeed,
    AngularStiffness,
    Count,
    Force,
    Length,
    Moment,
    Number,
    StopStiffness,
    TimePerAngle,
)

RIGHT_ANGLE = 1.5707963267948966


MOST_ELEMENTS = 50_000


class Scissor(Model):
    """Units, bars and mesh of an array."""

    shape: Literal["linear", "arched", "ring"] = Field(
        default="linear",
        description='"linear": straight bars with the hinge in the middle; "arched": hinges off the middle, so that the '
        'array becomes an arch; "ring": closed ring of bars with a kink at the hinge, which opens radially',
    )
    units: Count = Field(ge=1, le=5000, description="number of units; at least 3 in a ring")
    bar_length: Length = Field(gt=0, description="length of a whole bar, measured along it")
    hinge: Number = Field(
        default=0.5, gt=0, lt=1,
        description='"arched": distance of the hinge from the end on the lower side, over the length',
    )
    initial_angle: Angle = Field(
        gt=0, lt=RIGHT_ANGLE, description="angle of the bars with the long axis of the array: pi/2 stowed, 0 fully deployed"
    )
    element: Literal["section", "green", "cable"] = Field(
        default="section", description="beam with shear (strains of the section, or Green's strain), or without"
    )
    elements_per_bar: Count = Field(default=4, ge=2, le=1000, description="number of beam elements of a bar")
    rigid: bool = Field(default=False, description="rigid bars with stiff hinges, for comparison")

    @model_validator(mode="after")
    def _closed(self) -> Self:
        if self.units * self.elements_per_bar > MOST_ELEMENTS:
            count = self.units * self.elements_per_bar
            raise ValueError(f"units x elements_per_bar = {count:,}; at most {MOST_ELEMENTS:,} are allowed")
        if self.shape == "ring" and self.units < 3:
            raise ValueError(f"a ring needs at least 3 units; units = {self.units}")
        if self.shape in ("linear", "ring") and self.hinge != 0.5:
            what = "linear array" if self.shape == "linear" else "ring"
            raise ValueError(
                f'a {what} needs hinge = 0.5; it is {self.hinge:g}: remove this key, or give shape = "arched"'
            )
        if self.shape == "arched" and self.hinge == 0.5:
            raise ValueError(
                'an arched array with hinge = 0.5 is straight; give another value, for example 0.4, or shape = "linear"'
            )
        return self


class BarSection(Model):
    """Rectangular section of a bar: `height` in the plane of the array, `width` normal to it, m."""

    width: Length = Field(gt=0, description="size normal to the plane")
    height: Length = Field(gt=0, description="size in the plane")


class HingeJoint(Model):
    """Springs, dampers and dry friction of hinges; without this section hinges are free."""

    stiffness: AngularStiffness = Field(default=0.0, ge=0, description="torsional spring between the bars")
    rest_turn: Angle = Field(
        default=0.0,
        description="rotation from the start, in the sense of the deployment, at which the moment of the spring is zero",
    )
    damping: AngularDamping = Field(default=0.0, ge=0, description="moment of the damper over the rate of rotation")
    friction_moment: Moment = Field(default=0.0, ge=0, description="M of the regularised dry friction M tanh(w/w_s)")
    friction_speed: AngularSpeed = Field(
        default=0.01, gt=0, description="regularisation speed w_s; a sticking hinge creeps below it"
    )
    at: Literal["middle", "tips", "all"] = Field(default="all", description="hinges with these properties")


class Stop(Model):
    """End stop of the middle hinges, with the moment K d^1.5 (1 + damping d') at a depth d beyond `angle`."""

    angle: Angle = Field(
        gt=0, lt=RIGHT_ANGLE, description="angle of the bars at first contact of the stop, below `initial_angle`"
    )
    stiffness: StopStiffness = Field(gt=0, description="K")
    damping: TimePerAngle = Field(default=0.0, ge=0, description="factor on the rate d' of the depth")
    latch: bool = Field(
        default=False,
        description="after first contact the stop also acts in the other direction, with the same stiffness and damping",
    )


class PointSupport(Model):
    """Support of a point."""

    point: str = Field(description="supported point", json_schema_extra={"range": "a point"})
    kind: Literal["pinned", "slider"] = Field(
        default="pinned", description='"pinned": fixed position, free rotation; "slider": motion along `direction` only'
    )
    direction: tuple[Number, Number] | None = Field(
        default=None, description="direction of a slider", json_schema_extra={"range": "[1, 0] or [0, 1]"}
    )

    @model_validator(mode="after")
    def _directed(self) -> Self:
        if self.kind == "slider" and (self.direction is None or not any(self.direction)):
            raise ValueError("a slider needs the `direction` of its motion, for example [0, 1]")
        if self.kind == "pinned" and self.direction is not None:
            raise ValueError('a pinned point does not use `direction`; remove `direction`, or give kind = "slider"')
        return self


class PointForce(Model):
    """Force on a point (N) times a function of time: `force`, or `radial` away from the centre of a ring or an arch."""

    point: str = Field(description="loaded point", json_schema_extra={"range": "a point"})
    force: tuple[Force, Force] | None = Field(default=None, description="force along x and y; give this or `radial`")
    radial: Force | None = Field(default=None, description="away from the centre of a ring or an arch")
    time: TimeFunction = Field(
        default=Constant(), description="factor over time, as of a `[[load]]`", json_schema_extra={"default": "constant"}
    )

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.force is None) == (self.radial is None):
            raise ValueError("give either `force` = [x, y] or `radial`")
        if isinstance(self.time, Table) and self.time.amount is not None:
            raise ValueError(
                f"the table of a point force has `{self.time.amount}`; "
                "give the column `value` (factors) instead"
            )
        return self
