"""Section [[margin]] of a case: motorisation margins of joints that turn."""

from itertools import pairwise
from typing import Annotated, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Key, Model
from fsm.case.schema.units import Angle, Moment, Number

_Factor = Annotated[Number, Field(ge=0)]
_Size = Annotated[Moment, Field(ge=0)]


class MarginFactors(Model):
    """Minimum factors of ECSS-E-ST-33-01C, 4.7.5.3, for values from theory; tests allow smaller ones."""

    inertia: _Factor = Key("of `inertia`", default=1.1)
    spring: _Factor = Key("of springs that act against the motion", default=1.2)
    motor: _Factor = Key("of `motor_losses`", default=1.5)
    friction: _Factor = Key("of friction", default=3.0)
    hysteresis: _Factor = Key("of `hysteresis`", default=3.0)
    harness: _Factor = Key("of `harness` and `harness_table`", default=3.0)
    adhesion: _Factor = Key("of `adhesion`", default=3.0)
    motorisation: _Factor = Key("of the sum of all of these", default=2.0)
    dynamic: _Factor = Key("of `dynamic`", default=1.25)


class Margin(Model):
    """Motorisation margin of joints that turn: available over required moment less 1, from the start to the end of travel.

    The springs of a joint belong to the available moment where they drive and to the required one where they resist. Its
    friction without the part that follows the reaction, and its harness, are required. Other moments are given here.
    """

    joint: str = Key("names of joints: `*` is any text, `?` any letter")
    end: Angle | None = Key(
        "angle at the end of travel", default=None, shown="that of the latch, else that of the motor, else 0"
    )
    actuator: _Size = Key("least moment of an actuator beside the springs of the joint", default=0.0)
    friction: _Size = Key("friction, beside that of the joint", default=0.0)
    harness: _Size = Key("resistance of a cable harness, beside that of the joint", default=0.0)
    harness_table: tuple[tuple[Angle, Moment], ...] | None = Key(
        "rows (angle, resistance of the harness), straight between them, sorted by the angle", default=None
    )
    hysteresis: _Size = Key("hysteresis of springs and harness", default=0.0)
    adhesion: _Size = Key("adhesion of separable surfaces", default=0.0)
    motor_losses: _Size = Key("magnetic losses of a motor", default=0.0)
    inertia: _Size = Key("inertial moment of the parts that accelerate", default=0.0)
    dynamic: _Size = Key("inertial moment of an acceleration that is specified", default=0.0)
    deliverable: _Size = Key("moment that the joint has to deliver, without a factor", default=0.0)
    factors: MarginFactors = Key("factors of the parts of the required moment", default=MarginFactors())

    @model_validator(mode="after")
    def _sorted(self) -> Self:
        table = self.harness_table
        if table is not None and (len(table) < 2 or any(b[0] <= a[0] for a, b in pairwise(table))):
            raise ValueError("`harness_table` has two rows or more, sorted by the angle")
        return self
