"""A deployable array of scissor-like elements: two bars crossing at a hinge, units joined at their tips.

The points of an array of n units are a1 ... a(n+1) on its upper side, b1 ... b(n+1) on its lower side and h1 ... hn, the
middle hinges. Bar k.1 runs from b(k) to a(k+1), bar k.2 from a(k) to b(k+1). The plane of an array is x, y; in the results,
whose axes are those of all scenes, y is z.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.loads import Constant, TimeFunction
from fsm.scene.model import Model
from fsm.scene.units import (
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

__all__ = ["BarSection", "HingeJoint", "PointForce", "PointSupport", "Scissor", "Stop"]

RIGHT_ANGLE = 1.5707963267948966


MOST_ELEMENTS = 50_000


class Scissor(Model):
    """Units, bars and mesh of an array.

    Attributes
    ----------
    shape : str
        "linear": straight bars, hinge in the middle; "arched": straight bars, hinge off the middle, the array bends as it
        deploys; "ring": a closed ring of bars that are bent at their hinge by 2 pi/units, so that it opens radially.
    units : int
    bar_length : m
        Of a whole bar, along it.
    hinge : -
        Where on a bar its hinge is: part of the length from the bar's end on the lower side (of both bars of a unit).
    initial_angle : rad
        Of the bars with the line across their unit: pi/2 folded up, 0 all out.
    element : str
        "section": shear-deformable beam, strains of the section (Reissner); "green": the same with Green's strain over
        the section, as seed 004 has it; "cable": no shear.
    elements_per_bar : int
    rigid : bool
        Bars as rigid bodies, joined by stiff springs; for comparison.
    """

    shape: Literal["linear", "arched", "ring"] = "linear"
    units: Annotated[Count, Field(ge=1, le=5000)]
    bar_length: Annotated[Length, Field(gt=0)]
    hinge: Annotated[Number, Field(gt=0, lt=1)] = 0.5
    initial_angle: Annotated[Angle, Field(gt=0, lt=RIGHT_ANGLE)]
    element: Literal["section", "green", "cable"] = "section"
    elements_per_bar: Annotated[Count, Field(ge=2, le=1000)] = 4
    rigid: bool = False

    @model_validator(mode="after")
    def _closed(self) -> Self:
        if self.units * self.elements_per_bar > MOST_ELEMENTS:
            count = self.units * self.elements_per_bar
            raise ValueError(f"units x elements_per_bar = {count:,}; {MOST_ELEMENTS:,} at most")
        if self.shape == "ring" and self.units < 3:
            raise ValueError(f"a ring closes with 3 units or more; units = {self.units}")
        if self.shape in ("linear", "ring") and self.hinge != 0.5:
            what = "of a linear array" if self.shape == "linear" else "of a ring"
            raise ValueError(
                f'the bars {what} have their hinge in the middle; hinge = {self.hinge:g}: take it out, or shape = "arched"'
            )
        if self.shape == "arched" and self.hinge == 0.5:
            raise ValueError(
                'an arched array needs a hinge off the middle, or it is straight; give hinge = 0.4, or shape = "linear"'
            )
        return self


class BarSection(Model):
    """Rectangular section of a bar: `height` in the plane of the array, `width` across it, m."""

    width: Annotated[Length, Field(gt=0)]
    height: Annotated[Length, Field(gt=0)]


class HingeJoint(Model):
    """What every hinge resists with; all absent means free hinges.

    Attributes
    ----------
    stiffness : N m/rad
        Torsional spring between the two bars at a hinge, at rest at `rest_turn` from the initial angle.
    rest_turn : rad
        How far the bars must turn, in the sense in which the array deploys, for the spring to be at rest.
    damping : N m s/rad
    friction_moment : N m
        Dry friction, M tanh(w/w_s).
    friction_speed : rad/s
        w_s: how fast what should stick creeps.
    at : which hinges
    """

    stiffness: Annotated[AngularStiffness, Field(ge=0)] = 0.0
    rest_turn: Angle = 0.0
    damping: Annotated[AngularDamping, Field(ge=0)] = 0.0
    friction_moment: Annotated[Moment, Field(ge=0)] = 0.0
    friction_speed: Annotated[AngularSpeed, Field(gt=0)] = 0.01
    at: Literal["middle", "tips", "all"] = "all"


class Stop(Model):
    """End stop of the middle hinges: from `angle` (of the bars, as `initial_angle`) on they resist with K turn^1.5.

    Attributes
    ----------
    angle : rad
    stiffness : N m/rad^1.5
    damping : s/rad
        Factor on the rate: K turn^1.5 (1 + damping rate), never pulling.
    latch : bool
        A hinge that has reached the stop is held there from both sides, for good, by the stop's spring and damping.
    """

    angle: Annotated[Angle, Field(gt=0, lt=RIGHT_ANGLE)]
    stiffness: Annotated[StopStiffness, Field(gt=0)]
    damping: Annotated[TimePerAngle, Field(ge=0)] = 0.0
    latch: bool = False


class PointSupport(Model):
    """A point that is held.

    Attributes
    ----------
    point : name
    kind : "pinned" (to the ground, free to turn) or "slider" (moves along `direction` only)
    direction : -
        Of a slider.
    """

    point: str
    kind: Literal["pinned", "slider"] = "pinned"
    direction: tuple[Number, Number] | None = None

    @model_validator(mode="after")
    def _directed(self) -> Self:
        if self.kind == "slider" and (self.direction is None or not any(self.direction)):
            raise ValueError("a slider needs the `direction` it moves along, for example [0, 1]")
        if self.kind == "pinned" and self.direction is not None:
            raise ValueError('a pinned point moves nowhere: take `direction` out, or kind = "slider"')
        return self


class PointForce(Model):
    """A force on a point, N, times a function of time; `radial` acts away from the centre of a ring instead of `force`."""

    point: str
    force: tuple[Force, Force] | None = None
    radial: Force | None = None
    time: TimeFunction = Constant()

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.force is None) == (self.radial is None):
            raise ValueError("give either `force` = [x, y] or `radial`")
        return self
