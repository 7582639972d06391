"""Loads and drives of a scene: wrenches as functions of time, and prescribed motions."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.lattice import Edge
from fsm.scene.model import Model
from fsm.scene.units import Count, Force, Length, Moment, Number, Speed, Time

__all__ = ["Constant", "Drive", "Load", "Ramp", "Table", "TimeFunction", "Vector"]

Vector = tuple[float, float, float]


class Constant(Model):
    """Factor 1 at all times."""

    kind: Literal["constant"] = "constant"


class Ramp(Model):
    """Factor that increases from 0 at `start` to 1 at `end` as s^2 (3 - 2s), with continuous slope."""

    kind: Literal["ramp"]
    start: Time = 0.0
    end: Time

    @model_validator(mode="after")
    def _forward(self) -> Self:
        if self.end <= self.start:
            raise ValueError(
                f"a ramp must end after it starts; end = {self.end:g} s, start = {self.start:g} s"
            )
        return self


class Table(Model):
    """Factor that is linear between the rows (time, value) and constant outside."""

    kind: Literal["table"]
    time: tuple[Time, ...]
    value: tuple[Number, ...]

    @model_validator(mode="after")
    def _sorted(self) -> Self:
        if len(self.time) != len(self.value) or len(self.time) < 2:
            raise ValueError(
                f"a table needs one value for each time, and at least two; it has {len(self.time)} times and "
                f"{len(self.value)} values"
            )
        if any(b <= a for a, b in zip(self.time, self.time[1:], strict=False)):
            raise ValueError("the times of a table must increase")
        return self


TimeFunction = Annotated[Constant | Ramp | Table, Field(discriminator="kind")]


class Load(Model):
    """Wrench on a body: a force at a point and a couple, times a function of time.

    `point` is given in body axes from the centre of mass. `force` and `moment` are given in inertial axes, or in body axes
    if `follower` is true.
    """

    body: str
    point: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    force: tuple[Force, Force, Force] = (0.0, 0.0, 0.0)
    moment: tuple[Moment, Moment, Moment] = (0.0, 0.0, 0.0)
    follower: bool = False
    time: TimeFunction = Constant()


class Drive(Model):
    """Prescribed motion of a crease line of a strip, of bodies, or of an edge of a lattice; its reaction is the drive force.

    After a smooth start over the distance `run_up`, the speed is constant until the end of the travel. Give one of `crease`,
    `body`, `bodies` and `edge`.

    Attributes
    ----------
    crease : int
        Number of the crease, from 1.
    body : str
        Name of a body, which translates without rotation.
    bodies : tuple of str
        Names of bodies that translate together without rotation; the drive force is the sum over these bodies.
    edge : "bottom", "top", "left" or "right"
        Edge of a lattice, whose squares translate together without rotation.
    direction : -
        Direction of the motion, of any length.
    speed, travel : m/s, m
    run_up : m
        Travel over which the speed increases from zero, with continuous acceleration; absent: 1 % of the travel.
    guide : bool
        For a crease line only. True: the line moves along `direction` only and cannot rotate. False: only its motion along
        `direction` is prescribed.
    """

    crease: Count | None = None
    body: str | None = None
    bodies: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    edge: Edge | None = None
    direction: tuple[Number, Number, Number] = (0.0, 0.0, 1.0)
    speed: Annotated[Speed, Field(gt=0)]
    travel: Annotated[Length, Field(gt=0)]
    run_up: Annotated[Length, Field(ge=0)] | None = None
    guide: bool = True

    @property
    def moved(self) -> tuple[str, ...]:
        """Names of the driven bodies; empty for a crease or an edge."""
        return self.bodies or (() if self.body is None else (self.body,))

    @model_validator(mode="after")
    def _one_target(self) -> Self:
        targets = (self.crease, self.body, self.bodies, self.edge)
        if sum(target is not None for target in targets) != 1:
            raise ValueError("give either `crease` (its number), `body` (its name), `bodies`, or `edge` (of a lattice)")
        if not any(self.direction):
            raise ValueError("direction [0, 0, 0] is not a direction; give for example [0, 0, 1]")
        if self.run_up is not None and self.run_up > self.travel:
            raise ValueError(
                f"run_up = {self.run_up:g} m must be at most travel = {self.travel:g} m; reduce it"
            )
        return self
