"""Section [lattice] of a case: planar lattice of rigid squares with compliant hinges."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model
from fsm.scene.units import Angle, AngularStiffness, Count, Density, Length, Stiffness, Time

__all__ = ["Edge", "Lattice"]

MOST_SQUARES = 20_000

Edge = Literal["bottom", "top", "left", "right"]


class Lattice(Model):
    """Rotating squares: a grid of equal squares in columns (along x) and rows (along z); neighbours are rotated in opposite
    senses.

    Square (i, j) has its centre at (i, j) times the spacing. The square is rotated by (-1)^(i + j + 1) times the angle.
    Each of its four corners (right, top, left, bottom) has the distance `hinge_length` from a corner of a neighbour. A
    ligament joins each pair of corners.

    Attributes
    ----------
    columns, rows : int
    spacing : m
        Distance between the centres of neighbours.
    hinge_length : m
        Length of a hinge without force, between the two corners that it joins.
    angle : rad
        Rotation of every square, from the position with corners along x and z.
    axial, shear : N/m
        Stiffness of a hinge against a change of its length, and against a relative displacement of its ends across the
        hinge.
    rotational : N m/rad
        Stiffness of a hinge against a relative rotation of its squares.
    depth : m
        Size of the squares normal to the plane.
    density : kg/m^3
        Density of the squares.
    damping : s
        Kelvin-Voigt time of the hinges.
    held : edges whose squares do not move; absent: the bottom
    """

    columns: Annotated[Count, Field(ge=1, le=1000)]
    rows: Annotated[Count, Field(ge=1, le=1000)]
    spacing: Annotated[Length, Field(gt=0)]
    hinge_length: Annotated[Length, Field(gt=0)]
    angle: Annotated[Angle, Field(ge=0, lt=0.7853981633974483)]
    axial: Annotated[Stiffness, Field(gt=0)]
    shear: Annotated[Stiffness, Field(ge=0)]
    rotational: Annotated[AngularStiffness, Field(ge=0)]
    depth: Annotated[Length, Field(gt=0)]
    density: Annotated[Density, Field(gt=0)]
    damping: Annotated[Time, Field(ge=0)] = 0.0
    held: tuple[Edge, ...] | None = None

    @model_validator(mode="after")
    def _sized(self) -> Self:
        if self.hinge_length >= self.spacing:
            raise ValueError(
                f"hinge_length = {self.hinge_length:g} m must be less than spacing = {self.spacing:g} m, or no square fits"
            )
        if self.columns * self.rows > MOST_SQUARES:
            raise ValueError(f"columns x rows = {self.columns * self.rows:,} squares; at most {MOST_SQUARES:,} are allowed")
        return self

    @property
    def held_edges(self) -> tuple[Edge, ...]:
        """Held edges; the bottom if none is given."""
        return ("bottom",) if self.held is None else self.held
