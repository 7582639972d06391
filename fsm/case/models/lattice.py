"""Section [lattice] of a case: planar lattice of rigid squares with compliant hinges."""

from typing import Literal, Self

from pydantic import model_validator

from fsm.case.schema.model import Key, Model
from fsm.case.schema.units import Angle, AngularStiffness, Count, Density, Length, Stiffness, Stress, Time

MOST_SQUARES = 20_000
_SPRINGS = ("axial", "shear", "rotational")
_BEAM = ("hinge_young", "hinge_thickness")

Edge = Literal["bottom", "top", "left", "right"]


class Lattice(Model):
    """Rotating squares: a grid of equal squares in columns (along x) and rows (along z); neighbours are rotated in opposite
    senses.

    Square (i, j) has its centre at (i, j) times the spacing. The square is rotated by (-1)^(i + j + 1) times the angle.
    Each of its four corners (right, top, left, bottom) has the distance `hinge_length` from a corner of a neighbour. A
    ligament joins each pair of corners. Its stiffness is given by three springs or follows from a beam.
    """

    columns: Count = Key("number of squares along x", ge=1, le=1000)
    rows: Count = Key("number of squares along z", ge=1, le=1000)
    spacing: Length = Key("distance between centres of neighbours", gt=0)
    hinge_length: Length = Key("length of a hinge without force", gt=0)
    angle: Angle = Key("rotation of every square, from the position with corners along x and z", ge=0, lt=0.7853981633974483)
    axial: Stiffness | None = Key(
        "stiffness of a hinge against a change of its length", default=None, gt=0, shown="needed without `hinge_young`"
    )
    shear: Stiffness | None = Key(
        "stiffness of a hinge against a displacement of its ends across it", default=None, ge=0,
        shown="needed without `hinge_young`"
    )  # fmt: skip
    rotational: AngularStiffness | None = Key(
        "stiffness of a hinge against a relative rotation of its squares", default=None, ge=0,
        shown="needed without `hinge_young`"
    )  # fmt: skip
    hinge_young: Stress | None = Key(
        "Young's modulus of hinges that are beams as wide as `depth`, in place of the three stiffnesses", default=None, gt=0
    )
    hinge_thickness: Length | None = Key("thickness of these beams", default=None, gt=0, shown="needed with `hinge_young`")
    hinge_clamp: Length | None = Key(
        "depth inside each square at which these beams are clamped; their free length is `hinge_length` + 2 "
        "`hinge_clamp`", default=None, gt=0, shown="0, at the corners",
    )  # fmt: skip
    depth: Length = Key("size normal to the plane", gt=0)
    density: Density = Key("density of the squares", gt=0)
    damping: Time = Key("Kelvin-Voigt time of the hinges", default=0.0, ge=0)
    held: tuple[Edge, ...] | None = Key("edges whose squares do not move", default=None, shown='["bottom"]')

    @model_validator(mode="after")
    def _one_kind_of_hinge(self) -> Self:
        springs = [key for key in _SPRINGS if getattr(self, key) is not None]
        beam = [key for key in (*_BEAM, "hinge_clamp") if getattr(self, key) is not None]
        if springs and beam:
            raise ValueError(
                f"{springs[0]} is a spring and {beam[0]} belongs to a beam; give {', '.join(_SPRINGS)} or {', '.join(_BEAM)}"
            )
        for key in _BEAM if beam else _SPRINGS:
            if getattr(self, key) is None:
                other = "" if beam else f", or give {' and '.join(_BEAM)}"
                raise ValueError(f"{key} is missing; add it{other}")
        return self

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
    def clamp(self) -> float:
        """Depth inside each square at which its hinges begin, m."""
        return self.hinge_clamp or 0.0

    @property
    def stiffness(self) -> tuple[float, float, float]:
        """Stiffness of a hinge along its chord (N/m), across it (N/m) and against rotation (N m/rad); 12 EI/l^3 = shear."""
        if self.hinge_young is None or self.hinge_thickness is None:
            assert self.axial is not None and self.shear is not None and self.rotational is not None
            return self.axial, self.shear, self.rotational
        length = self.hinge_length + 2.0 * self.clamp
        axial = self.hinge_young * self.depth * self.hinge_thickness / length
        rotational = axial * self.hinge_thickness**2 / 12.0
        return axial, 12.0 * rotational / length**2, rotational

    @property
    def held_edges(self) -> tuple[Edge, ...]:
        """Held edges; the bottom if none is given."""
        return ("bottom",) if self.held is None else self.held
