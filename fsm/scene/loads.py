"""What acts on a scene from outside: wrenches as functions of time, prescribed motion, gravity."""

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
    """Factor from 0 at `start` to 1 at `end`, by the C1 step s^2 (3 - 2s)."""

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
    """Factor linear between the rows (time, value), constant outside."""

    kind: Literal["table"]
    time: tuple[Time, ...]
    value: tuple[Number, ...]

    @model_validator(mode="after")
    def _sorted(self) -> Self:
        if len(self.time) != len(self.value) or len(self.time) < 2:
            raise ValueError(
                f"a table needs as many values as times, and at least two; it has {len(self.time)} times and "
                f"{len(self.value)} values"
            )
        if any(b <= a for a, b in zip(self.time, self.time[1:], strict=False)):
            raise ValueError("the times of a table must increase")
        return self


TimeFunction = Annotated[Constant | Ramp | Table, Field(discriminator="kind")]


class Load(Model):
    """A wrench on a body: force at a point and couple, times a function of time.

    `point` in body axes from the centre of mass; `force` and `moment` in inertial axes, or in body axes when
    `follower` is true.
    """

    body: str
    point: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    force: tuple[Force, Force, Force] = (0.0, 0.0, 0.0)
    moment: tuple[Moment, Moment, Moment] = (0.0, 0.0, 0.0)
    follower: bool = False
    time: TimeFunction = Constant()


class Drive(Model):
    """Prescribed motion of a crease line (of a strip) or of a body; its reaction is the pull force.

    The travel grows at `speed` after a smooth start over the first `run_up` of travel, and ends at `travel`.

    Attributes
    ----------
    crease : number of the crease, from 1; or
    body : name of the body, translated without turning; or
    bodies : names of bodies that are translated together without turning, the force is the sum of all; or
    edge : "bottom", "top", "left" or "right"
        Squares of a lattice that are, likewise.
    direction : -
        Need not be a unit vector.
    speed, travel : m/s, m
    run_up : m
        Travel over which the speed grows from zero (C1); absent means 1 % of the travel.
    guide : bool
        Crease line only: held in all directions but the pulled one, and kept from turning as a line. Without
        it the line is pulled along `direction` and free otherwise.
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
        """Names of the bodies that are moved; none of a crease or an edge."""
        return self.bodies or (() if self.body is None else (self.body,))

    @model_validator(mode="after")
    def _one_target(self) -> Self:
        targets = (self.crease, self.body, self.bodies, self.edge)
        if sum(target is not None for target in targets) != 1:
            raise ValueError("give either `crease` (its number), `body` (its name), `bodies`, or `edge` (of a lattice)")
        if not any(self.direction):
            raise ValueError("direction [0, 0, 0] has no length; give for example [0, 0, 1]")
        if self.run_up is not None and self.run_up > self.travel:
            raise ValueError(
                f"run_up = {self.run_up:g} m is longer than travel = {self.travel:g} m; make it shorter"
            )
        return self
