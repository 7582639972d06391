"""Section [[scene.springs]] of a case: springs and dampers between two points.

Section [[scene.cords]] of a case: cords from point to point, over small pulleys.
"""

import math
from itertools import pairwise
from typing import Literal, Self

from pydantic import model_validator

from fsm.case.models.joint_action import SlideDamper, check_table
from fsm.case.models.time_program import Table, TimeFunction
from fsm.case.schema.model import Key, Model, Name
from fsm.case.schema.units import Damping, Force, Length, Number, Speed, Stiffness

ONLY = {"tension": 1.0, "compression": -1.0}
"""Sense of the force of a spring that acts in one sense only."""


class GasSpring(Model):
    """Gas spring: F (column/(column - compression))^exponent pushes both points apart."""

    force: Force = Key("force at the extended length", gt=0)
    length: Length | None = Key("extended length", default=None, gt=0, shown="the length at the start")
    column: Length = Key("length of the column of gas at the extended length: volume over piston area", gt=0)
    exponent: Number = Key("polytropic exponent: 1 slow, 1.4 fast in air or nitrogen", default=1.0, gt=0)


class SceneSpring(Model):
    """Spring and damper between two points of bodies or the ground; it has no mass."""

    name: Name = Key("name of the spring", within="different from all other springs")
    first: str = Key("first body", within="as of a joint")
    second: str = Key("second body", within="as of a joint")
    at: tuple[Length, Length, Length] = Key("point of the first body at the start, inertial axes")
    to: tuple[Length, Length, Length] = Key("point of the second body at the start, inertial axes")
    free_length: Length | None = Key("length without force", default=None, ge=0, shown="the length at the start")
    stiffness: Stiffness = Key("force over elongation", default=0.0, ge=0)
    table: tuple[tuple[Length, Force], ...] | None = Key(
        "rows (elongation, tension), straight between and beyond them, in place of `stiffness`", default=None
    )
    damper: SlideDamper | None = Key("damper: force against the rate of the length", default=None)
    force: Force = Key("constant tension, negative if it pushes, added to the others", default=0.0)
    gas: GasSpring | None = Key("gas spring, added to the others", default=None)
    only: Literal["tension", "compression"] | None = Key(
        "the only sense in which it acts; it is slack in the other one", default=None, shown="both"
    )

    @model_validator(mode="after")
    def _acts(self) -> Self:
        check_table(self.table, "elongation")
        if self.table is not None and self.stiffness:
            raise ValueError("a spring has `stiffness` or a `table`; remove one of them")
        if not (self.stiffness or self.table or self.damper or self.force or self.gas):
            raise ValueError(f"spring {self.name!r} has no force; give `stiffness`, `table`, `damper`, `force` or `gas`")
        if self.gas is not None and self.only is not None:
            raise ValueError("a gas spring only pushes; remove `only`")
        if self.gas is not None and self._beyond(self.gas):
            raise ValueError(f"the gas spring {self.name!r} has no column of gas left at the start; correct `gas.length`")
        if self.only is not None and not (self.stiffness or self.table or self.force):
            raise ValueError("`only` needs `stiffness`, `table` or `force`: a slack damper has no force")
        return self

    @property
    def length(self) -> float:
        """Length at the start, m."""
        return math.dist(self.at, self.to)

    @property
    def free(self) -> float:
        """Length without force, m."""
        return self.length if self.free_length is None else self.free_length

    def _beyond(self, gas: GasSpring) -> bool:
        return gas.length is not None and self.length <= gas.length - gas.column

    @property
    def rows(self) -> tuple[tuple[float, float], ...]:
        """Rows (elongation, tension) of the table, of which `only` leaves the part with its sense; empty without a table."""
        rows = self.table or ()
        if self.only is None:
            return rows
        sense = ONLY[self.only]
        whole = [(x, f + self.force) for x, f in rows] or [(x, self.stiffness * x + self.force) for x in (-1.0, 1.0)]
        return clipped(whole, sense)


def clipped(rows: list[tuple[float, float]], sense: float) -> tuple[tuple[float, float], ...]:
    """Rows of a piecewise linear function, with zero in place of values of the other sense, also beyond the rows."""
    ends = []
    for (x, f), (y, g), way in ((rows[0], rows[1], -1.0), (rows[-1], rows[-2], 1.0)):
        slope = (g - f) / (y - x)
        zero = x - f / slope if slope else x
        far = way * max(way * x, way * zero) + way
        ends.append((far, f + slope * (far - x)))
    found: list[tuple[float, float]] = []
    points = ends[0], *rows, ends[1]
    for (x, f), (y, g) in pairwise(points):
        found.append((x, f if sense * f > 0.0 else 0.0))
        if f * g < 0.0:
            found.append((x + (y - x) * f / (f - g), 0.0))
    y, g = points[-1]
    return (*found, (y, g if sense * g > 0.0 else 0.0))


Place = tuple[Length, Length, Length]


class CordPoint(Model):
    """Pulley without size, on a body or the ground."""

    body: str = Key("body that carries the pulley", within="as of a joint")
    at: Place = Key("place of the pulley at the start, inertial axes")
    friction: Number = Key(
        "coefficient of friction between cord and pulley (capstan): the tensions of a sliding cord are in the "
        "ratio exp(friction times angle)", default=0.0, ge=0,
    )  # fmt: skip


class SceneCord(Model):
    """Cord without mass, which pulls and never pushes."""

    name: Name = Key("name of the cord", within="different from all other cords")
    first: str = Key("body at its first end", within="as of a joint")
    second: str = Key("body at its second end", within="as of a joint")
    at: Place = Key("first end at the start, inertial axes")
    to: Place = Key("second end at the start, inertial axes")
    over: tuple[CordPoint, ...] = Key("pulleys in their order from the first end", default=())
    stiffness: Stiffness = Key("tension over elongation of the whole cord", gt=0)
    damping: Damping = Key("tension over the rate of the elongation, while it is taut", default=0.0, ge=0)
    free_length: Length | None = Key("length without tension", default=None, gt=0, shown="the length at the start")
    reel: Length = Key("change of the free length by a spool, times `time`; negative winds up", default=0.0)
    time: TimeFunction | None = Key("[function of time](#functions-of-time) of `reel`", default=None, shown="absent")

    slip_speed: Speed = Key("speed of the cord over a pulley, v, in the friction times tanh(speed/v)", default=1e-3, gt=0)

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
