"""Sections of a case with `analysis = "scissor"`: array of units of two crossing bars, joined at their tips.

An array of n units has the points a1 ... a(n+1) on its upper side, b1 ... b(n+1) on its lower side, and the middle hinges
h1 ... hn. Bar k.1 goes from b(k) to a(k+1), bar k.2 from a(k) to b(k+1). The array lies in the plane x, y. In results, which
have the axes of all scenes, its y axis is z.
"""

from typing import Literal, Self

from pydantic import model_validator

from fsm.case.models.time_program import Constant, Table, TimeFunction
from fsm.case.schema.model import Key, Model
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

    shape: Literal["linear", "arched", "ring"] = Key(
        '"linear": straight bars with the hinge in the middle; "arched": hinges off the middle, so that the '
        'array becomes an arch; "ring": closed ring of bars with a kink at the hinge, which opens radially',
        default="linear",
    )  # fmt: skip
    units: Count = Key("number of units; at least 3 in a ring", ge=1, le=5000)
    bar_length: Length = Key("length of a whole bar, measured along it", gt=0)
    hinge: Number = Key(
        '"arched": distance of the hinge from the end on the lower side, over the length', default=0.5, gt=0, lt=1
    )
    initial_angle: Angle = Key(
        "angle of the bars with the long axis of the array: pi/2 stowed, 0 fully deployed", gt=0, lt=RIGHT_ANGLE
    )
    element: Literal["section", "green", "cable"] = Key(
        "beam with shear (strains of the section, or Green's strain), or without", default="section"
    )
    elements_per_bar: Count = Key("number of beam elements of a bar", default=4, ge=2, le=1000)
    rigid: bool = Key("rigid bars with stiff hinges, for comparison", default=False)

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

    width: Length = Key("size normal to the plane", gt=0)
    height: Length = Key("size in the plane", gt=0)


class HingeJoint(Model):
    """Springs, dampers and dry friction of hinges; without this section hinges are free."""

    stiffness: AngularStiffness = Key("torsional spring between the bars", default=0.0, ge=0)
    rest_turn: Angle = Key(
        "rotation from the start, in the sense of the deployment, at which the moment of the spring is zero", default=0.0
    )
    damping: AngularDamping = Key("moment of the damper over the rate of rotation", default=0.0, ge=0)
    friction_moment: Moment = Key("M of the regularised dry friction M tanh(w/w_s)", default=0.0, ge=0)
    friction_speed: AngularSpeed = Key("regularisation speed w_s; a sticking hinge creeps below it", default=0.01, gt=0)
    at: Literal["middle", "tips", "all"] = Key("hinges with these properties", default="all")


class Stop(Model):
    """End stop of the middle hinges, with the moment K d^1.5 (1 + damping d') at a depth d beyond `angle`."""

    angle: Angle = Key("angle of the bars at first contact of the stop, below `initial_angle`", gt=0, lt=RIGHT_ANGLE)
    stiffness: StopStiffness = Key("K", gt=0)
    damping: TimePerAngle = Key("factor on the rate d' of the depth", default=0.0, ge=0)
    latch: bool = Key(
        "after first contact the stop also acts in the other direction, with the same stiffness and damping", default=False
    )


class PointSupport(Model):
    """Support of a point."""

    point: str = Key("supported point", within="a point")
    kind: Literal["pinned", "slider"] = Key(
        '"pinned": fixed position, free rotation; "slider": motion along `direction` only', default="pinned"
    )
    direction: tuple[Number, Number] | None = Key("direction of a slider", default=None, within="[1, 0] or [0, 1]")

    @model_validator(mode="after")
    def _directed(self) -> Self:
        if self.kind == "slider" and (self.direction is None or not any(self.direction)):
            raise ValueError("a slider needs the `direction` of its motion, for example [0, 1]")
        if self.kind == "pinned" and self.direction is not None:
            raise ValueError('a pinned point does not use `direction`; remove `direction`, or give kind = "slider"')
        return self


class PointForce(Model):
    """Force on a point (N) times a function of time: `force`, or `radial` away from the centre of a ring or an arch."""

    point: str = Key("loaded point", within="a point")
    force: tuple[Force, Force] | None = Key("force along x and y; give this or `radial`", default=None)
    radial: Force | None = Key("away from the centre of a ring or an arch", default=None)
    time: TimeFunction = Key("factor over time, as of a `[[load]]`", default=Constant(), shown="constant")

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
