"""A planar lattice of rigid squares on compliant hinges: the section [lattice] of a case."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model
from fsm.scene.units import Angle, AngularStiffness, Count, Density, Length, Stiffness, Time

__all__ = ["Edge", "Lattice"]

MOST_SQUARES = 20_000

Edge = Literal["bottom", "top", "left", "right"]


class Lattice(Model):
    """Rotating squares: columns (along x) by rows (along z) of equal squares, each turned against its neighbours.

    Square (i, j) is centred at (i, j) times the spacing and turned by (-1)^(i + j + 1) times the angle; its corners at
    right, top, left and bottom point at those of its neighbours, `hinge_length` away, and a ligament joins each pair.

    Attributes
    ----------
    columns, rows : int
    spacing : m
        Between centres of neighbours.
    hinge_length : m
        Between the corners that a hinge joins, free of force.
    angle : rad
        That every square is turned by, from a square whose corners point along x and z.
    axial, shear : N/m
        Stiffness of a hinge against a change of its length, and against a displacement of its ends across it.
    rotational : N m/rad
        Stiffness of a hinge against a turn of one square to the other.
    depth : m
        Across the plane.
    density : kg/m^3
        Of the squares.
    damping : s
        Kelvin-Voigt time of the hinges.
    held : edges whose squares do not move; absent means the bottom
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
            raise ValueError("hinge_length must be less than spacing: the squares are as large as it leaves them")
        if self.columns * self.rows > MOST_SQUARES:
            raise ValueError(f"columns x rows = {self.columns * self.rows:,} squares; {MOST_SQUARES:,} at most")
        return self

    @property
    def held_edges(self) -> tuple[Edge, ...]:
        """Those that are named, or the bottom."""
        return ("bottom",) if self.held is None else self.held
