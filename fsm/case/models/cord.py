"""Section [[scene.cords]] of a case: cords from point to point, over small pulleys."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Self

from pydantic import Field, model_validator

from fsm.case.models.time_program import Table, TimeFunction
from fsm.case.schema.model import Model, Name
from fsm.case.schema.units import Damping, Length, Number, Speed, Stiffness

Place = tuple[Length, Length, Length]


class CordPoint(Model):
    """Pulley without size, on a body or the ground."""

    body: str = Field(description="body that carries the pulley", json_schema_extra={"range": "as of a joint"})
    at: Place = Field(description="place of the pulley at the start, inertial axes")
    friction: Number = Field(
        default=0.0, ge=0,
        description="coefficient of friction between cord and pulley (capstan): the tensions of a sliding cord are in the "
        "ratio exp(friction times angle)",
    )  # fmt: skip


class SceneCord(Model):
    """Cord without mass, which pulls and never pushes."""

    name: Name = Field(description="name of the cord", json_schema_extra={"range": "different from all other cords"})
    first: str = Field(description="body at its first end", json_schema_extra={"range": "as of a joint"})
    second: str = Field(description="body at its second end", json_schema_extra={"range": "as of a joint"})
    at: Place = Field(description="first end at the start, inertial axes")
    to: Place = Field(description="second end at the start, inertial axes")
    over: tuple[CordPoint, ...] = Field(default=(), description="pulleys in their order from the first end")
    stiffness: Stiffness = Field(gt=0, description="tension over elongation of the whole cord")
    damping: Damping = Field(default=0.0, ge=0, description="tension over the rate of the elongation, while it is taut")
    free_length: Length | None = Field(
        default=None, gt=0, description="length without tension", json_schema_extra={"default": "the length at the start"}
    )
    reel: Length = Field(default=0.0, description="change of the free length by a spool, times `time`; negative winds up")
    time: TimeFunction | None = Field(
        default=None, description="[function of time](#functions-of-time) of `reel`", json_schema_extra={"default": "absent"}
    )

    slip_speed: Speed = Field(
        default=1e-3, gt=0, description="speed of the cord over a pulley, v, in the friction times tanh(speed/v)"
    )

    @model_validator(mode="after")
    def _spool(self) -> Self:
        if (self.time is None) != (self.reel == 0.0):
            raise ValueError("a spool needs `reel` and `time`, a function of time")
        if isinstance(self.time, Table) and self.time.amount is not None:
            raise ValueError("the table of a cord has the columns `time` and `value`, factors on `reel`")
        points = [self.at, *(pulley.at for pulley in self.over), self.to]
        if any(a == b for a, b in pairwise(points)):
            raise ValueError(f"cord {self.name!r} has two points of its way in one place; move or remove one")
        return self

    @property
    def way(self) -> list[tuple[str, Place]]:
        """Bodies and places of all points at the start."""
        return [(self.first, self.at), *((pulley.body, pulley.at) for pulley in self.over), (self.second, self.to)]

    @property
    def free(self) -> float:
        """Free length at first, m."""
        return self.free_length or sum(math.dist(a, b) for (_, a), (_, b) in pairwise(self.way))
