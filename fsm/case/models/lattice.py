"""Section [lattice] of a case: planar lattice of rigid squares with compliant hinges."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Model
from fsm.case.schema.units import Angle, AngularStiffness, Count, Density, Length, Stiffness, Time

MOST_SQUARES = 20_000

Edge = Literal["bottom", "top", "left", "right"]


class Lattice(Model):
    """Rotating squares: a grid of equal squares in columns (along x) and rows (along z); neighbours are rotated in opposite
    senses.

    Square (i, j) has its centre at (i, j) times the spacing. The square is rotated by (-1)^(i + j + 1) times the angle.
    Each of its four corners (right, top, left, bottom) has the distance `hinge_length` from a corner of a neighbour. A
    ligament joins each pair of corners.
    """

    columns: Count = Field(ge=1, le=1000, description="number of squares along x")
    rows: Count = Field(ge=1, le=1000, description="number of squares along z")
    spacing: Length = Field(gt=0, description="distance between centres of neighbours")
    hinge_length: Length = Field(gt=0, description="length of a hinge without force")
    angle: Angle = Field(
        ge=0, lt=0.7853981633974483, description="rotation of every square, from the position with corners along x and z"
    )
    axial: Stiffness = Field(gt=0, description="stiffness of a hinge against a change of its length")
    shear: Stiffness = Field(ge=0, description="stiffness of a hinge against a displacement of its ends across it")
    rotational: AngularStiffness = Field(ge=0, description="stiffness of a hinge against a relative rotation of its squares")
    depth: Length = Field(gt=0, description="size normal to the plane")
    density: Density = Field(gt=0, description="density of the squares")
    damping: Time = Field(default=0.0, ge=0, description="Kelvin-Voigt time of the hinges")
    held: tuple[Edge, ...] | None = Field(
        default=None, description="edges whose squares do not move", json_schema_extra={"default": '["bottom"]'}
    )

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
