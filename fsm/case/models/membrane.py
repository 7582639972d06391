"""Sections of a case with `analysis = "vibrate"`: the tensioned film.

The film lies in the plane z = 0 with its centre at the origin. The film's length is along x, its width along y, its normal
along z.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Model, Name
from fsm.case.schema.units import Count, Density, Force, Length, Number, Stress, Time, Unit

_PLACE = "position of the patches"
_DISTANCE = "distance of the centre of a patch from the centre of the film"
_PLACE_OF_CABLE = (
    '"corners": cables from every corner outwards along its diagonal; "edges": cables along the edges of the film'
)
_PULSE = "force over time: half a sine wave, constant, or given values"
_DURATION = "time after which the force is zero"

Rate = Annotated[float, Unit("1/s")]
Place = tuple[Length, Length]
"""Point of the film: coordinates from the centre along length and width, m."""


class Membrane(Model):
    """Rectangular film."""

    length: Length = Field(gt=0, description="size along x")
    width: Length = Field(gt=0, description="size along y")
    thickness: Length = Field(gt=0, description="thickness of the film")
    mesh: tuple[Annotated[Count, Field(ge=1, le=200)], Annotated[Count, Field(ge=1, le=200)]] = Field(
        default=(12, 12), description="elements along length and width; lines are added at the edges of patches"
    )


class _Patch(Model):
    """Square with a thickness and a material that differ from those of the film; its sides are parallel to the sides of the
    film.
    """

    size: Length = Field(gt=0, description="side of the square")
    thickness: Length = Field(gt=0, description="thickness of the patch")
    young: Stress = Field(gt=0, description="Young's modulus")
    poisson: Number = Field(default=0.3, gt=-1, lt=0.5, description="Poisson's ratio")
    density: Density = Field(gt=0, description="density")


class CentrePatch(_Patch):
    """Patch at the centre of the film."""

    place: Literal["centre"] = Field(description=_PLACE)


class DiagonalPatch(_Patch):
    """Patch on a half diagonal, at `distance` from the centre of the film towards the corner `arm`."""

    place: Literal["diagonal"] = Field(description=_PLACE)
    distance: Length = Field(gt=0, description=_DISTANCE)
    arm: Literal["++", "-+", "--", "+-"] = Field(default="++", description="signs of x and y of the corner")


class DiagonalsPatch(_Patch):
    """Patches on all four half diagonals: `count` on each, at 1, 2, ... times `distance` from the centre."""

    place: Literal["diagonals"] = Field(description=_PLACE)
    distance: Length = Field(gt=0, description=_DISTANCE)
    count: Count = Field(default=1, ge=1, le=100, description="number of patches on each half diagonal")


class PositionPatch(_Patch):
    """Patch at `position`."""

    place: Literal["position"] = Field(description=_PLACE)
    position: Place = Field(description="position of its centre", json_schema_extra={"range": "on the film"})


class GridPatch(_Patch):
    """Grid of patches about the centre of the film: `count` along length and width, with the distance `spacing`."""

    place: Literal["grid"] = Field(description=_PLACE)
    count: tuple[Annotated[Count, Field(ge=1, le=100)], Annotated[Count, Field(ge=1, le=100)]] = Field(
        description="number of patches along length and width"
    )
    spacing: tuple[Annotated[Length, Field(gt=0)], Annotated[Length, Field(gt=0)]] = Field(
        description="distance between centres along length and width"
    )


Patch = Annotated[
    CentrePatch | DiagonalPatch | DiagonalsPatch | PositionPatch | GridPatch, Field(discriminator="place")
]


class _Cable(Model):
    """Round cable with bending stiffness."""

    diameter: Length = Field(gt=0, description="diameter of the round section")
    young: Stress = Field(gt=0, description="Young's modulus")
    density: Density = Field(gt=0, description="density")


class CornerCable(_Cable):
    """Cable from every corner of the film outwards along the diagonal, with `length` and number of `elements`."""

    place: Literal["corners"] = Field(description=_PLACE_OF_CABLE)
    length: Length = Field(gt=0, description="length of each cable")
    elements: Count = Field(default=4, ge=1, le=200, description="number of elements of each cable")


class EdgeCable(_Cable):
    """Cable along all edges of the film; it shares the positions and slopes of the film."""

    place: Literal["edges"] = Field(description=_PLACE_OF_CABLE)


Cable = Annotated[CornerCable | EdgeCable, Field(discriminator="place")]


class Support(Model):
    """Support of the film during the vibration, after the tension is applied."""

    at: Literal["edges", "left", "right", "bottom", "top", "corners", "cables", "point"] = Field(
        description="supported part; edges are held straight"
    )
    position: Place | None = Field(
        default=None,
        description='position of "point"; the closest node is supported',
        json_schema_extra={"range": "on the film"},
    )
    fixed: Literal["xyz", "xy", "xz", "yz", "x", "y", "z"] = Field(default="xyz", description="directions without motion")
    clamped: bool = Field(default=False, description="slopes are held as well")

    @model_validator(mode="after")
    def _one_point(self) -> Self:
        if (self.at == "point") != (self.position is not None):
            raise ValueError('at = "point" requires `position`, and other supports do not use it')
        return self


class Tension(Model):
    """Tension that is applied to the film before its supports are fixed, by `pull` or by `strain`."""

    pull: Annotated[Force, Field(ge=0)] | None = Field(
        default=None, description="force on every corner, outwards along its diagonal; give this or `strain`"
    )
    strain: Number | tuple[Number, Number] | None = Field(
        default=None,
        description="outward displacement of the edges over length and width",
        json_schema_extra={"range": "one value, or two"},
    )
    film: Literal["plain", "tension-field", "wrinkles", "auto"] = Field(
        default="plain",
        description='behaviour of the film in compression. "plain": it carries compression; "tension-field": it carries '
        'none, and has wrinkled and slack regions; "wrinkles": wrinkles that the mesh resolves; "auto": "plain" if both '
        'principal stresses are tensile everywhere and the film is stable, else "tension-field"',
    )
    imperfection: Annotated[Length, Field(gt=0)] | None = Field(
        default=None,
        description='"wrinkles": amplitude of the initial waves',
        json_schema_extra={"default": "amplitude of the closed form, or a tenth of the thickness"},
    )

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.pull is None) == (self.strain is None):
            raise ValueError("give either `pull` (force at the corners) or `strain` (of the edges)")
        if self.imperfection is not None and self.film != "wrinkles":
            raise ValueError('`imperfection` is used with film = "wrinkles" only; remove `imperfection`')
        return self


class Air(Model):
    """Added mass of air, 0.68 x density x length per unit area, for the motion normal to the film (Minami, 1998)."""

    density: Density = Field(default=1.2, gt=0, description="density of the air")
    length: Annotated[Length, Field(gt=0)] | None = Field(
        default=None,
        description="the added mass is 0.68 x density x length per unit area, for the motion normal to the film",
        json_schema_extra={"default": "length of the film"},
    )


class Damping(Model):
    """Damping of the vibration of a film."""

    material: Time = Field(default=0.0, ge=0, description="Kelvin-Voigt time of film, patches and cables")
    air: Rate = Field(
        default=0.0, ge=0, description="damping force over mass times velocity; amplitudes decay as exp(-air t/2)"
    )


class _Pulse(Model):
    """Short force normal to the film at `point`, from time zero."""

    point: Place = Field(
        default=(0.0, 0.0), description="point at which the force acts", json_schema_extra={"range": "on the film"}
    )
    size: Annotated[Length, Field(gt=0)] | None = Field(
        default=None,
        description="side of the square around `point` over which the force is spread evenly. Absent: a force at a point; "
        "the displacement at this point then grows with the logarithm of the number of elements",
    )


class HalfSinePulse(_Pulse):
    """Half sine wave with `duration` and the maximum `force`."""

    pulse: Literal["half-sine"] = Field(description=_PULSE)
    force: Force = Field(description="maximum force")
    duration: Time = Field(gt=0, description=_DURATION)


class RectanglePulse(_Pulse):
    """Constant `force` for `duration`."""

    pulse: Literal["rectangle"] = Field(description=_PULSE)
    force: Force = Field(description="constant force")
    duration: Time = Field(gt=0, description=_DURATION)


class MeasuredPulse(_Pulse):
    """Measured pulse: forces (N) at times (s), linear between them and zero outside."""

    pulse: Literal["table"] = Field(description=_PULSE)
    time: tuple[Time, ...] = Field(
        description="times of the forces, with linear interpolation", json_schema_extra={"range": "increasing, two or more"}
    )
    force: tuple[Force, ...] = Field(description="list of forces")

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
    """Vibration analysis of the tensioned film."""

    duration: Time = Field(default=1.0, gt=0, description="duration of the motion")
    modes: Count = Field(default=20, ge=1, le=500, description="number of natural modes, also of the reduced model")
    probes: dict[Name, Place] = Field(
        default_factory=dict, max_length=1000,
        description='points with sampled motion, by name, `{ edge = [0.15, 0] }`; "center" and "patch" (the first) always '
        "exist",
        json_schema_extra={"range": "points on the film, m"},
    )
    sampling: Annotated[Time, Field(gt=0)] | None = Field(
        default=None,
        description="time between samples of the probes",
        json_schema_extra={"default": "a tenth of the period of the highest mode"},
    )
    model: Literal["auto", "full", "reduced"] = Field(
        default="auto", description='"full": all coordinates; "reduced": modes; "auto": modes if they are accurate enough'
    )
    stretch: bool = Field(default=False, description='"reduced": include the cubic terms due to the stretching of the film')


class Deployed(Model):
    """Film model of a deployed strip, with its panels and creases at the end of the travel."""

    elements_per_panel: Count = Field(default=4, ge=1, le=200, description="number of elements along a panel")
    elements_across: Count = Field(
        default=6, ge=1, le=200,
        description="number of elements over the width. The tension varies over the width, so this number affects the "
        "frequencies",
    )
    crease_width: Annotated[Length, Field(gt=0)] | None = Field(
        default=None,
        description="distance between the mesh lines on both sides of a crease; panels of a thin strip bend close to their "
        "creases",
        json_schema_extra={"default": "a tenth of a panel"},
    )
