"""Sections of a case with `analysis = "vibrate"`: the tensioned film.

The film lies in the plane z = 0 with its centre at the origin. The film's length is along x, its width along y, its normal
along z.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model, Name
from fsm.scene.units import Count, Density, Force, Length, Number, Stress, Time, Unit

__all__ = [
    "Air", "Cable", "CentrePatch", "CornerCable", "Damping", "Deployed", "DiagonalPatch", "DiagonalsPatch", "EdgeCable",
    "GridPatch", "HalfSinePulse", "Impact", "MeasuredPulse", "Membrane", "Patch", "Place", "PositionPatch",
    "RectanglePulse", "Support", "Tension", "Vibration",
]  # fmt: skip

Rate = Annotated[float, Unit("1/s")]
Place = tuple[Length, Length]
"""Point of the film: coordinates from the centre along length and width, m."""


class Membrane(Model):
    """Rectangular film.

    Attributes
    ----------
    length, width, thickness : m
    mesh : number of elements along length and width
        Mesh lines are added at the edges of patches.
    """

    length: Annotated[Length, Field(gt=0)]
    width: Annotated[Length, Field(gt=0)]
    thickness: Annotated[Length, Field(gt=0)]
    mesh: tuple[Annotated[Count, Field(ge=1, le=200)], Annotated[Count, Field(ge=1, le=200)]] = (12, 12)


class _Patch(Model):
    """Square with a thickness and a material that differ from those of the film; its sides are parallel to the sides of the
    film.

    Attributes
    ----------
    size : m
        Side of the square.
    thickness : m
        Thickness instead of that of the film; the middle surfaces coincide.
    young, poisson, density : Pa, -, kg/m^3
    """

    size: Annotated[Length, Field(gt=0)]
    thickness: Annotated[Length, Field(gt=0)]
    young: Annotated[Stress, Field(gt=0)]
    poisson: Annotated[Number, Field(gt=-1, lt=0.5)] = 0.3
    density: Annotated[Density, Field(gt=0)]


class CentrePatch(_Patch):
    """Patch at the centre of the film."""

    place: Literal["centre"]


class DiagonalPatch(_Patch):
    """Patch on a half diagonal, at `distance` from the centre of the film towards the corner `arm`."""

    place: Literal["diagonal"]
    distance: Annotated[Length, Field(gt=0)]
    arm: Literal["++", "-+", "--", "+-"] = "++"


class DiagonalsPatch(_Patch):
    """Patches on all four half diagonals: `count` on each, at 1, 2, ... times `distance` from the centre."""

    place: Literal["diagonals"]
    distance: Annotated[Length, Field(gt=0)]
    count: Annotated[Count, Field(ge=1, le=100)] = 1


class PositionPatch(_Patch):
    """Patch at `position`."""

    place: Literal["position"]
    position: Place


class GridPatch(_Patch):
    """Grid of patches about the centre of the film: `count` along length and width, with the distance `spacing`."""

    place: Literal["grid"]
    count: tuple[Annotated[Count, Field(ge=1, le=100)], Annotated[Count, Field(ge=1, le=100)]]
    spacing: tuple[Annotated[Length, Field(gt=0)], Annotated[Length, Field(gt=0)]]


Patch = Annotated[
    CentrePatch | DiagonalPatch | DiagonalsPatch | PositionPatch | GridPatch, Field(discriminator="place")
]


class _Cable(Model):
    """Round cable with bending stiffness.

    Attributes
    ----------
    diameter : m
    young, density : Pa, kg/m^3
    """

    diameter: Annotated[Length, Field(gt=0)]
    young: Annotated[Stress, Field(gt=0)]
    density: Annotated[Density, Field(gt=0)]


class CornerCable(_Cable):
    """Cable from every corner of the film outwards along the diagonal, with `length` and number of `elements`."""

    place: Literal["corners"]
    length: Annotated[Length, Field(gt=0)]
    elements: Annotated[Count, Field(ge=1, le=200)] = 4


class EdgeCable(_Cable):
    """Cable along all edges of the film; it shares the positions and slopes of the film."""

    place: Literal["edges"]


Cable = Annotated[CornerCable | EdgeCable, Field(discriminator="place")]


class Support(Model):
    """Support of the film during the vibration, after the tension is applied.

    Attributes
    ----------
    at : "edges", "left", "right", "bottom", "top" (all edges or one), "corners", "cables" (outer ends of the corner
        cables) or "point"
    position : m
        Position of a "point"; the closest node is supported.
    fixed : directions without motion
    clamped : bool
        Whether slopes are held as well.
    """

    at: Literal["edges", "left", "right", "bottom", "top", "corners", "cables", "point"]
    position: Place | None = None
    fixed: Literal["xyz", "xy", "xz", "yz", "x", "y", "z"] = "xyz"
    clamped: bool = False

    @model_validator(mode="after")
    def _one_point(self) -> Self:
        if (self.at == "point") != (self.position is not None):
            raise ValueError('at = "point" requires `position`, and other supports do not use it')
        return self


class Tension(Model):
    """Tension that is applied to the film before its supports are fixed, by `pull` or by `strain`.

    Attributes
    ----------
    pull : N
        Force on every corner, or on the outer end of its cable, outwards along the diagonal.
    strain : -
        Outward displacement of the edges over the length and width of the film; one value, or one for each direction.
    film : "plain" (carries compression), "tension-field" (carries no compression, and has wrinkled and slack regions),
        "wrinkles" (wrinkles that the mesh resolves) or "auto" ("plain" if both principal stresses are tensile everywhere and
        the film is stable, else "tension-field")
    imperfection : m
        Amplitude of the initial waves, "wrinkles" only; absent: a tenth of the thickness.
    """

    pull: Annotated[Force, Field(ge=0)] | None = None
    strain: Number | tuple[Number, Number] | None = None
    film: Literal["plain", "tension-field", "wrinkles", "auto"] = "plain"
    imperfection: Annotated[Length, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.pull is None) == (self.strain is None):
            raise ValueError("give either `pull` (force at the corners) or `strain` (of the edges)")
        if self.imperfection is not None and self.film != "wrinkles":
            raise ValueError('`imperfection` is used with film = "wrinkles" only; remove `imperfection`')
        return self


class Air(Model):
    """Added mass of air, 0.68 x density x length per unit area, for the motion normal to the film (Minami, 1998).

    Attributes
    ----------
    density : kg/m^3
    length : m
        Absent: the length of the film.
    """

    density: Annotated[Density, Field(gt=0)] = 1.2
    length: Annotated[Length, Field(gt=0)] | None = None


class Damping(Model):
    """Damping of the vibration of a film.

    Attributes
    ----------
    material : s
        Kelvin-Voigt time beta of film, patches and cables: the viscous stress is beta times the elastic stress of the
        strain rate.
    air : 1/s
        Damping force over mass times velocity; amplitudes decay as exp(-air t/2).
    """

    material: Annotated[Time, Field(ge=0)] = 0.0
    air: Annotated[Rate, Field(ge=0)] = 0.0


class _Pulse(Model):
    """Short force normal to the film at `point`, from time zero.

    Attributes
    ----------
    point : m
    size : m
        Side of the square around `point` over which the force is spread evenly; absent: a force at a point.
    """

    point: Place = (0.0, 0.0)
    size: Annotated[Length, Field(gt=0)] | None = None


class HalfSinePulse(_Pulse):
    """Half sine wave with `duration` and the maximum `force`."""

    pulse: Literal["half-sine"]
    force: Force
    duration: Annotated[Time, Field(gt=0)]


class RectanglePulse(_Pulse):
    """Constant `force` for `duration`."""

    pulse: Literal["rectangle"]
    force: Force
    duration: Annotated[Time, Field(gt=0)]


class MeasuredPulse(_Pulse):
    """Measured pulse: forces (N) at times (s), linear between them and zero outside."""

    pulse: Literal["table"]
    time: tuple[Time, ...]
    force: tuple[Force, ...]

    @model_validator(mode="after")
    def _sorted(self) -> Self:
        if len(self.time) != len(self.force) or len(self.time) < 2:
            raise ValueError(
                f"a pulse needs one force for each time, and at least two; it has {len(self.time)} times and "
                f"{len(self.force)} forces"
            )
        if self.time[0] < 0.0 or any(b <= a for a, b in zip(self.time, self.time[1:], strict=False)):
            raise ValueError(f"the times of a pulse must increase and be at least 0 s; the first is {self.time[0]:g} s")
        return self


Impact = Annotated[HalfSinePulse | RectanglePulse | MeasuredPulse, Field(discriminator="pulse")]


class Vibration(Model):
    """Vibration analysis of the tensioned film.

    Attributes
    ----------
    duration : s
    modes : number of natural modes
    probes : points with sampled motion, by name; "center" and "patch" (the first patch) are added
    sampling : s
        Time between samples; absent: a tenth of the period of the highest mode.
    model : "full" (all degrees of freedom), "reduced" (modes) or "auto" (modes if they are accurate enough)
    stretch : bool
        Whether the reduced model includes the cubic terms due to the stretching of the film by its motion.
    """

    duration: Annotated[Time, Field(gt=0)] = 1.0
    modes: Annotated[Count, Field(ge=1, le=500)] = 20
    probes: Annotated[dict[Name, Place], Field(max_length=1000)] = Field(default_factory=dict)
    sampling: Annotated[Time, Field(gt=0)] | None = None
    model: Literal["auto", "full", "reduced"] = "auto"
    stretch: bool = False


class Deployed(Model):
    """Film model of a deployed strip, with its panels and creases at the end of the travel.

    Attributes
    ----------
    elements_per_panel : number of elements along a panel
    elements_across : number of elements over the width of the strip
    crease_width : m
        Width of the zone with the bending stiffness of the crease, along each crease; absent: a tenth of a panel.
    """

    elements_per_panel: Annotated[Count, Field(ge=1, le=200)] = 4
    elements_across: Annotated[Count, Field(ge=1, le=200)] = 6
    crease_width: Annotated[Length, Field(gt=0)] | None = None
