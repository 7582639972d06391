"""Sections of a case with `analysis = "scissor"`: array of units of two crossing bars, joined at their tips.

An array of n units has the points a1 ... a(n+1) on its upper side, b1 ... b(n+1) on its lower side, and the middle hinges
h1 ... hn. Bar k.1 goes from b(k) to a(k+1), bar k.2 from a(k) to b(k+1). The array lies in the plane x, y. In results, which
have the axes of all scenes, its y axis is z.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.loads import Constant, Table, TimeFunction
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
        "linear": straight bars with the hinge in the middle; "arched": straight bars with the hinge off the middle, so the
        array becomes an arch; "ring": closed ring of bars with a kink of 2 pi/units at the hinge, which opens radially.
    units : int
    bar_length : m
        Length of a whole bar, measured along it.
    hinge : -
        Position of the hinge: distance from the end on the lower side, over the length of the bar.
    initial_angle : rad
        Angle of the bars with the long axis of the array (ring, arch: with the normal to the symmetry axis of their unit);
        pi/2 stowed, 0 fully deployed.
    element : str
        "section": shear-deformable beam with the strains of its section (Reissner, 1972); "green": shear-deformable beam
        with Green's strain over the section (Peng et al., 2019); "cable": beam without shear.
    elements_per_bar : int
    rigid : bool
        Whether bars are rigid bodies joined by stiff springs, for comparison.
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

    width: Annotated[Length, Field(gt=0)]
    height: Annotated[Length, Field(gt=0)]


class HingeJoint(Model):
    """Springs, dampers and dry friction of hinges; without this section hinges are free.

    Attributes
    ----------
    stiffness : N m/rad
        Torsional spring between the two bars at a hinge.
    rest_turn : rad
        Rotation from the initial state, in the sense of the deployment, at which the moment of the spring is zero.
    damping : N m s/rad
    friction_moment : N m
        Moment M of the regularised dry friction, M tanh(w/w_s).
    friction_speed : rad/s
        Regularisation speed w_s; a sticking hinge creeps at a part of it.
    at : hinges to which the section applies
    """

    stiffness: Annotated[AngularStiffness, Field(ge=0)] = 0.0
    rest_turn: Angle = 0.0
    damping: Annotated[AngularDamping, Field(ge=0)] = 0.0
    friction_moment: Annotated[Moment, Field(ge=0)] = 0.0
    friction_speed: Annotated[AngularSpeed, Field(gt=0)] = 0.01
    at: Literal["middle", "tips", "all"] = "all"


class Stop(Model):
    """End stop of the middle hinges, with the moment K d^1.5 (1 + damping d') at a depth d beyond `angle`.

    Attributes
    ----------
    angle : rad
        Angle of the bars at first contact of the stop, measured as `initial_angle`.
    stiffness : N m/rad^1.5
        Stiffness K.
    damping : s/rad
        Factor on the rate d' of the depth; the moment of a stop without latch is never tensile.
    latch : bool
        Whether the stop becomes bilateral after first contact, with the same stiffness and damping.
    """

    angle: Annotated[Angle, Field(gt=0, lt=RIGHT_ANGLE)]
    stiffness: Annotated[StopStiffness, Field(gt=0)]
    damping: Annotated[TimePerAngle, Field(ge=0)] = 0.0
    latch: bool = False


class PointSupport(Model):
    """Support of a point.

    Attributes
    ----------
    point : name
    kind : "pinned" (fixed position, free rotation) or "slider" (motion along `direction` only)
    direction : -
        Direction of a slider.
    """

    point: str
    kind: Literal["pinned", "slider"] = "pinned"
    direction: tuple[Number, Number] | None = None

    @model_validator(mode="after")
    def _directed(self) -> Self:
        if self.kind == "slider" and (self.direction is None or not any(self.direction)):
            raise ValueError("a slider needs the `direction` of its motion, for example [0, 1]")
        if self.kind == "pinned" and self.direction is not None:
            raise ValueError('a pinned point does not use `direction`; remove `direction`, or give kind = "slider"')
        return self


class PointForce(Model):
    """Force on a point (N) times a function of time: `force`, or `radial` away from the centre of a ring or an arch."""

    point: str
    force: tuple[Force, Force] | None = None
    radial: Force | None = None
    time: TimeFunction = Constant()

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
