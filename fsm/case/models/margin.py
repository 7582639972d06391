"""Section [[margin]] of a case: motorisation margins of joints that turn."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Model
from fsm.case.schema.units import Angle, Moment, Number

_Factor = Annotated[Number, Field(ge=0)]
_Size = Annotated[Moment, Field(ge=0)]


class MarginFactors(Model):
    """Minimum factors of ECSS-E-ST-33-01C, 4.7.5.3, for values from theory; tests allow smaller ones."""

    inertia: _Factor = Field(default=1.1, description="of `inertia`")
    spring: _Factor = Field(default=1.2, description="of springs that act against the motion")
    motor: _Factor = Field(default=1.5, description="of `motor_losses`")
    friction: _Factor = Field(default=3.0, description="of friction")
    hysteresis: _Factor = Field(default=3.0, description="of `hysteresis`")
    harness: _Factor = Field(default=3.0, description="of `harness` and `harness_table`")
    adhesion: _Factor = Field(default=3.0, description="of `adhesion`")
    motorisation: _Factor = Field(default=2.0, description="of the sum of all of these")
    dynamic: _Factor = Field(default=1.25, description="of `dynamic`")


class Margin(Model):
    """Motorisation margin of joints that turn: available over required moment less 1, from the start to the end of travel.

    The springs of a joint belong to the available moment where they drive and to the required one where they resist. Its
    friction without the part that follows the reaction, and its harness, are required. Other moments are given here.
    """

    joint: str = Field(description="names of joints: `*` is any text, `?` any letter")
    end: Angle | None = Field(
        default=None,
        description="angle at the end of travel",
        json_schema_extra={"default": "that of the latch, else that of the motor, else 0"},
    )
    actuator: _Size = Field(default=0.0, description="least moment of an actuator beside the springs of the joint")
    friction: _Size = Field(default=0.0, description="friction, beside that of the joint")
    harness: _Size = Field(default=0.0, description="resistance of a cable harness, beside that of the joint")
    harness_table: tuple[tuple[Angle, Moment], ...] | None = Field(
        default=None, description="rows (angle, resistance of the harness), straight between them, sorted by the angle"
    )
    hysteresis: _Size = Field(default=0.0, description="hysteresis of springs and harness")
    adhesion: _Size = Field(default=0.0, description="adhesion of separable surfaces")
    motor_losses: _Size = Field(default=0.0, description="magnetic losses of a motor")
    inertia: _Size = Field(default=0.0, description="inertial moment of the parts that accelerate")
    dynamic: _Size = Field(default=0.0, description="inertial moment of an acceleration that is specified")
    deliverable: _Size = Field(default=0.0, description="moment that the joint has to deliver, without a factor")
    factors: MarginFactors = Field(default=MarginFactors(), description="factors of the parts of the required moment")

    @model_validator(mode="after")
    def _sorted(self) -> Self:
        table = self.harness_table
        if table is not None and (len(table) < 2 or any(b[0] <= a[0] for a, b in pairwise(table))):
            raise ValueError("`harness_table` has two rows or more, sorted by the angle")
        return self
