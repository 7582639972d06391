"""Trusses of a [scene]: points, bars with axial laws between them, and rotational springs about lines between points."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model, Name
from fsm.scene.units import Angle, AngularStiffness, Count, Force, Length, Mass, Number, Time

__all__ = ["AXIAL_LAWS", "AxialLaw", "SceneTruss"]

AXIAL_LAWS = {
    "linear": "force in proportion to the elongation", "green": "stress in proportion to the Green strain",
    "ogden": "Ogden law",
}  # fmt: skip
"""Names of the laws of bars, with their descriptions."""

AxialLaw = Literal["linear", "green", "ogden"]
Number0 = Annotated[Count, Field(ge=0)]


class SceneTruss(Model):
    """Points that bars join, with rotational springs between triangles of points: a bar-and-hinge model.

    Attributes
    ----------
    points : positions at the start, m
    mass : mass of each point, kg
    bars : two numbers of points of each bar, from 0
    stiffness : N
        Young's modulus times the area of each bar.
    law : str
        Energy over E A L as a function of the stretch s. "linear": (s - 1)^2/2. "green": (s^2 - 1)^2/8. "ogden":
        [(s^a - 1)/a - (s^b - 1)/b]/(a - b) with the exponents a and b (Liu and Paulino, 2017).
    exponents : -
        a and b of "ogden".
    folds : four numbers of points of each rotational spring
        A point of the left triangle, both ends of the line, a point of the right triangle. Angles follow `Pattern`.
    fold_stiffness : N m/rad
    fold_rest : rad
        Fold angle of each spring at which its moment is zero.
    bend_lines : number of springs at the end of the list that are bend lines; their energy counts as energy of the panels
    linear_to : rad
        Fold angle beyond which the moment of a spring rises like a tangent function, to infinity at 180 degrees.
    viscosity : s
        Kelvin-Voigt damping of bars and springs: c = viscosity k.
    faces : numbers of the three or four points of drawn faces
    held : number of a point, and its fixed directions, for example [0, "xyz"]
    """

    name: Name
    points: Annotated[tuple[tuple[Length, Length, Length], ...], Field(min_length=2)]
    mass: tuple[Annotated[Mass, Field(gt=0)], ...]
    bars: Annotated[tuple[tuple[Number0, Number0], ...], Field(min_length=1)]
    stiffness: tuple[Annotated[Force, Field(gt=0)], ...]
    law: AxialLaw = "linear"
    exponents: tuple[Number, Number] = (5.0, 1.0)
    folds: tuple[tuple[Number0, Number0, Number0, Number0], ...] = ()
    fold_stiffness: tuple[Annotated[AngularStiffness, Field(ge=0)], ...] = ()
    fold_rest: tuple[Angle, ...] = ()
    bend_lines: Number0 = 0
    linear_to: Annotated[Angle, Field(gt=0, le=math.pi)] = math.pi
    viscosity: Annotated[Time, Field(ge=0)] = 0.0
    faces: tuple[Annotated[tuple[Number0, ...], Field(min_length=3, max_length=4)], ...] = ()
    held: tuple[tuple[Number0, Annotated[str, Field(pattern="^[xyz]{1,3}$")]], ...] = ()

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
