"""The tensioned film: what a case with `analysis = "vibrate"` is made of.

The film lies in the plane z = 0, its centre at the origin, its length along x and its width along y; z is its normal.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model, Name
from fsm.scene.units import Count, Density, Force, Length, Number, Stress, Time, Unit

__all__ = [
    "Air", "Cable", "CentrePatch", "CornerCable", "Damping", "Deployed", "DiagonalPatch", "DiagonalsPatch", "EdgeCable",
    "GridPatch", "HalfSine", "Impact", "Measured", "Membrane", "Patch", "Place", "PositionPatch", "Rectangle", "Support",
    "Tension", "Vibration",
]  # fmt: skip

Rate = Annotated[float, Unit("1/s")]
Place = tuple[Length, Length]
"""A point of the film by its distance from the centre along length and width, m."""


class Membrane(Model):
    """A rectangular film.

    Attributes
    ----------
    length, width, thickness : m
    mesh : elements along length and width
        Lines are added where patches have their edges.
    """

    length: Annotated[Length, Field(gt=0)]
    width: Annotated[Length, Field(gt=0)]
    thickness: Annotated[Length, Field(gt=0)]
    mesh: tuple[Annotated[Count, Field(ge=1, le=200)], Annotated[Count, Field(ge=1, le=200)]] = (12, 12)


class _Patch(Model):
    """A square of another thickness and material than the film, its sides along the film's.

    Attributes
    ----------
    size : m
        Its side.
    thickness : m
        In place of the film's; its middle surface is that of the film.
    young, poisson, density : Pa, -, kg/m^3
    """

    size: Annotated[Length, Field(gt=0)]
    thickness: Annotated[Length, Field(gt=0)]
    young: Annotated[Stress, Field(gt=0)]
    poisson: Annotated[Number, Field(gt=-1, lt=0.5)] = 0.3
    density: Annotated[Density, Field(gt=0)]


class CentrePatch(_Patch):
    """In the middle of the film."""

    place: Literal["centre"]


class DiagonalPatch(_Patch):
    """On a half diagonal, `distance` from the film's centre to its own; `arm` says towards which corner."""

    place: Literal["diagonal"]
    distance: Annotated[Length, Field(gt=0)]
    arm: Literal["++", "-+", "--", "+-"] = "++"


class DiagonalsPatch(_Patch):
    """Evenly along all four half diagonals: `count` on each, at `distance`, twice `distance`, ... from the centre."""

    place: Literal["diagonals"]
    distance: Annotated[Length, Field(gt=0)]
    count: Annotated[Count, Field(ge=1, le=100)] = 1


class PositionPatch(_Patch):
    """At `position`."""

    place: Literal["position"]
    position: Place


class GridPatch(_Patch):
    """Periodic: `count` along length and width, `spacing` from one centre to the next, about the film's centre."""

    place: Literal["grid"]
    count: tuple[Annotated[Count, Field(ge=1, le=100)], Annotated[Count, Field(ge=1, le=100)]]
    spacing: tuple[Annotated[Length, Field(gt=0)], Annotated[Length, Field(gt=0)]]


Patch = Annotated[
    CentrePatch | DiagonalPatch | DiagonalsPatch | PositionPatch | GridPatch, Field(discriminator="place")
]


class _Cable(Model):
    """A round cable, which can bend.

    Attributes
    ----------
    diameter : m
    young, density : Pa, kg/m^3
    """

    diameter: Annotated[Length, Field(gt=0)]
    young: Annotated[Stress, Field(gt=0)]
    density: Annotated[Density, Field(gt=0)]


class CornerCable(_Cable):
    """From every corner of the film outwards along its diagonal, of `length`, in so many `elements`."""

    place: Literal["corners"]
    length: Annotated[Length, Field(gt=0)]
    elements: Annotated[Count, Field(ge=1, le=200)] = 4


class EdgeCable(_Cable):
    """Along the edges of the film, whose positions and slopes it shares."""

    place: Literal["edges"]


Cable = Annotated[CornerCable | EdgeCable, Field(discriminator="place")]


class Support(Model):
    """What is held, after the tension has been put on.

    Attributes
    ----------
    at : "edges", "left", "right", "bottom", "top" (all or one of the edges), "corners", "cables" (outer ends of the corner
        cables) or "point"
    position : m
        Of "point": the nearest node.
    fixed : directions in which it cannot move
    clamped : bool
        Slopes are held as well.
    """

    at: Literal["edges", "left", "right", "bottom", "top", "corners", "cables", "point"]
    position: Place | None = None
    fixed: Literal["xyz", "xy", "xz", "yz", "x", "y", "z"] = "xyz"
    clamped: bool = False

    @model_validator(mode="after")
    def _one_point(self) -> Self:
        if (self.at == "point") != (self.position is not None):
            raise ValueError('at = "point" needs `position`, and nothing else has it')
        return self


class Tension(Model):
    """What the film is stretched by before its supports are held.

    Attributes
    ----------
    pull : N
        Force that draws every corner (the outer end of its cable, if it has one) outwards along its diagonal; or
    strain : -
        The edges are moved outwards by this part of the film's length and width; one value, or one of each.
    film : "plain" (carries compression), "tension-field" (none: wrinkled and slack regions) or "wrinkles" (those that the
        mesh resolves)
    imperfection : m
        "wrinkles" only: height of the waves that the flat film starts from; a tenth of the thickness if absent.
    """

    pull: Annotated[Force, Field(ge=0)] | None = None
    strain: Number | tuple[Number, Number] | None = None
    film: Literal["plain", "tension-field", "wrinkles"] = "plain"
    imperfection: Annotated[Length, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.pull is None) == (self.strain is None):
            raise ValueError("give either `pull` (force at the corners) or `strain` (of the edges)")
        if self.imperfection is not None and self.film != "wrinkles":
            raise ValueError('`imperfection` belongs to film = "wrinkles"; take it out')
        return self


class Air(Model):
    """Air that moves with the film: 0.68 x density x length per unit area, on the motion normal to the film.

    Attributes
    ----------
    density : kg/m^3
    length : m
        The film's length if absent.
    """

    density: Annotated[Density, Field(gt=0)] = 1.2
    length: Annotated[Length, Field(gt=0)] | None = None


class Damping(Model):
    """What takes energy from the vibration.

    Attributes
    ----------
    material : s
        Kelvin-Voigt time beta of film, patches and cables: stress gets beta times the elastic stress of the strain rate.
    air : 1/s
        Force against the motion, this times the moving mass: amplitudes fall as exp(-air t/2).
    """

    material: Annotated[Time, Field(ge=0)] = 0.0
    air: Annotated[Rate, Field(ge=0)] = 0.0


class _Pulse(Model):
    """A short force normal to the film at `point`, from time zero on."""

    point: Place = (0.0, 0.0)


class HalfSine(_Pulse):
    """Half a sine wave of `duration`, its top `force`."""

    pulse: Literal["half-sine"]
    force: Force
    duration: Annotated[Time, Field(gt=0)]


class Rectangle(_Pulse):
    """`force` for `duration`."""

    pulse: Literal["rectangle"]
    force: Force
    duration: Annotated[Time, Field(gt=0)]


class Measured(_Pulse):
    """A measured pulse: forces (N) at times (s), straight between them, zero outside."""

    pulse: Literal["table"]
    time: tuple[Time, ...]
    force: tuple[Force, ...]

    @model_validator(mode="after")
    def _sorted(self) -> Self:
        if len(self.time) != len(self.force) or len(self.time) < 2:
            raise ValueError(
                f"a pulse needs as many forces as times, and at least two; it has {len(self.time)} times and "
                f"{len(self.force)} forces"
            )
        if self.time[0] < 0.0 or any(b <= a for a, b in zip(self.time, self.time[1:], strict=False)):
            raise ValueError("the times of a pulse must increase, from 0 or later on")
        return self


Impact = Annotated[HalfSine | Rectangle | Measured, Field(discriminator="pulse")]


class Vibration(Model):
    """What is computed about the tensioned film.

    Attributes
    ----------
    duration : s
    modes : number of natural modes
    probes : points of the film by name whose motion is sampled; "center" and "patch" (of the first patch) are added
    sampling : s
        Time between two samples; a tenth of the period of the highest of the modes if absent.
    model : "full" (the whole film), "reduced" (its modes) or "auto" (the modes where they are good enough)
    stretch : bool
        Of the reduced model: with the cubic terms of the film's stretching by its own motion.
    """

    duration: Annotated[Time, Field(gt=0)] = 1.0
    modes: Annotated[Count, Field(ge=1, le=500)] = 20
    probes: Annotated[dict[Name, Place], Field(max_length=1000)] = Field(default_factory=dict)
    sampling: Annotated[Time, Field(gt=0)] | None = None
    model: Literal["auto", "full", "reduced"] = "auto"
    stretch: bool = False


class Deployed(Model):
    """How a deployed strip is taken for a film: its panels and creases as they are at the end of the travel.

    Attributes
    ----------
    elements_per_panel : along a panel
    elements_across : over the width of the strip
    crease_width : m
        Width of the line along every crease whose bending stiffness is that of the crease; a tenth of a panel if absent.
    """

    elements_per_panel: Annotated[Count, Field(ge=1, le=200)] = 6
    elements_across: Annotated[Count, Field(ge=1, le=200)] = 3
    crease_width: Annotated[Length, Field(gt=0)] | None = None
