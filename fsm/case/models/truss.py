"""Trusses of a [scene]: points, bars with axial laws between them, and rotational springs about lines between points."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Key, Model, Name
from fsm.case.schema.units import Angle, AngularStiffness, Count, Force, Length, Mass, Number, Time

AXIAL_LAWS = {
    "linear": "force in proportion to the elongation", "green": "stress in proportion to the Green strain",
    "ogden": "Ogden law",
}  # fmt: skip
"""Names of the laws of bars, with their descriptions."""

AxialLaw = Literal["linear", "green", "ogden"]
Number0 = Annotated[Count, Field(ge=0)]


class SceneTruss(Model):
    """Points that bars join, with rotational springs between triangles of points: a bar-and-hinge model."""

    name: Name = Key("name of the truss", within="different from all other names")
    points: tuple[tuple[Length, Length, Length], ...] = Key("positions at the start", min_length=2)
    mass: tuple[Annotated[Mass, Field(gt=0)], ...] = Key("masses of the points", within="> 0, one for each point")
    bars: tuple[tuple[Number0, Number0], ...] = Key("two numbers of points of each bar, from 0", min_length=1)
    stiffness: tuple[Annotated[Force, Field(gt=0)], ...] = Key(
        "stiffness of each bar: Young's modulus times the area", within="> 0, one for each bar"
    )
    law: AxialLaw = Key(
        'energy over E A L as a function of the stretch s. "linear": (s - 1)^2/2. "green": (s^2 - 1)^2/8. '
        '"ogden": [(s^a - 1)/a - (s^b - 1)/b]/(a - b)', default="linear",
    )  # fmt: skip
    exponents: tuple[Number, Number] = Key('a and b of "ogden"', default=(5.0, 1.0), within="different")
    folds: tuple[tuple[Number0, Number0, Number0, Number0], ...] = Key(
        "four numbers of points of each rotational spring: a point of the left triangle, both ends of the "
        "line, a point of the right triangle", default=(),
    )  # fmt: skip
    fold_stiffness: tuple[Annotated[AngularStiffness, Field(ge=0)], ...] = Key(
        "stiffness of each rotational spring", default=(), within=">= 0, one for each fold"
    )
    fold_rest: tuple[Angle, ...] = Key(
        "fold angle at which the moment is zero; 0 is flat, a valley is positive", default=(), within="one for each fold"
    )
    bend_lines: Number0 = Key(
        "number of folds at the end of the list that are bend lines; their energy counts as energy of the " "panels",
        default=0, within="at most the number of folds"
    )  # fmt: skip
    linear_to: Angle = Key(
        "fold angle beyond which moments rise like a tangent function, and faster in the last twentieth of the "
        "range, to infinity at 180 degrees", default=math.pi, gt=0, le=math.pi,
    )  # fmt: skip
    viscosity: Time = Key("Kelvin-Voigt damping of bars and springs: c = viscosity k", default=0.0, ge=0)
    faces: tuple[Annotated[tuple[Number0, ...], Field(min_length=3, max_length=4)], ...] = Key(
        "drawn faces", default=(), within=">= 0, 3 or 4 points each"
    )
    held: tuple[tuple[Number0, Annotated[str, Field(pattern="^[xyz]{1,3}$")]], ...] = Key(
        'number of a point and its fixed directions, for example `[[0, "xyz"], [5, "z"]]`', default=()
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        count = len(self.points)
        for name, of, size in (
            ("mass", "points", count), ("stiffness", "bars", len(self.bars)),
            ("fold_stiffness", "folds", len(self.folds)), ("fold_rest", "folds", len(self.folds)),
        ):  # fmt: skip
            if len(getattr(self, name)) != size:
                raise ValueError(f"`{name}` has {len(getattr(self, name))} items, but `{of}` has {size}; give {size}")
        for name, rows in (("bars", self.bars), ("folds", self.folds), ("faces", self.faces)):
            for number, row in enumerate(rows):
                if max(row) >= count or len(set(row)) < len(row):
                    text = f"its point numbers must differ and lie between 0 and {count - 1}"
                    raise ValueError(f"{name}.{number} is {list(row)}; {text}")
        for number, (first, last) in enumerate(self.bars):
            if self.points[first] == self.points[last]:
                raise ValueError(f"bars.{number} has no length: points {first} and {last} are at the same place")
        for point, _ in self.held:
            if point >= count:
                raise ValueError(f"`held` names point {point}; give a point number between 0 and {count - 1}")
        if self.law == "ogden" and self.exponents[0] == self.exponents[1]:
            raise ValueError(f"both `exponents` are {self.exponents[0]:g}; give two different exponents")
        if self.bend_lines > len(self.folds):
            raise ValueError(f"`bend_lines` is {self.bend_lines}, and there are {len(self.folds)} folds; reduce it")
        return self
