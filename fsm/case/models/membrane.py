"""Sections of a case with `analysis = "vibrate"`: the tensioned film.

The film lies in the plane z = 0 with its centre at the origin. The film's length is along x, its width along y, its normal
along z.
"""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Key, Model, Name
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

    length: Length = Key("size along x", gt=0)
    width: Length = Key("size along y", gt=0)
    thickness: Length = Key("thickness of the film", gt=0)
    mesh: tuple[Annotated[Count, Field(ge=1, le=200)], Annotated[Count, Field(ge=1, le=200)]] = Key(
        "elements along length and width; lines are added at the edges of patches", default=(12, 12)
    )


class _Patch(Model):
    """Square with a thickness and a material that differ from those of the film; its sides are parallel to the sides of the
    film.
    """

    size: Length = Key("side of the square", gt=0)
    thickness: Length = Key("thickness of the patch", gt=0)
    young: Stress = Key("Young's modulus", gt=0)
    poisson: Number = Key("Poisson's ratio", default=0.3, gt=-1, lt=0.5)
    density: Density = Key("density", gt=0)


class CentrePatch(_Patch):
    """Patch at the centre of the film."""

    place: Literal["centre"] = Key(_PLACE)


class DiagonalPatch(_Patch):
    """Patch on a half diagonal, at `distance` from the centre of the film towards the corner `arm`."""

    place: Literal["diagonal"] = Key(_PLACE)
    distance: Length = Key(_DISTANCE, gt=0)
    arm: Literal["++", "-+", "--", "+-"] = Key("signs of x and y of the corner", default="++")


class DiagonalsPatch(_Patch):
    """Patches on all four half diagonals: `count` on each, at 1, 2, ... times `distance` from the centre."""

    place: Literal["diagonals"] = Key(_PLACE)
    distance: Length = Key(_DISTANCE, gt=0)
    count: Count = Key("number of patches on each half diagonal", default=1, ge=1, le=100)


class PositionPatch(_Patch):
    """Patch at `position`."""

    place: Literal["position"] = Key(_PLACE)
    position: Place = Key("position of its centre", within="on the film")


class GridPatch(_Patch):
    """Grid of patches about the centre of the film: `count` along length and width, with the distance `spacing`."""

    place: Literal["grid"] = Key(_PLACE)
    count: tuple[Annotated[Count, Field(ge=1, le=100)], Annotated[Count, Field(ge=1, le=100)]] = Key(
        "number of patches along length and width"
    )
    spacing: tuple[Annotated[Length, Field(gt=0)], Annotated[Length, Field(gt=0)]] = Key(
        "distance between centres along length and width"
    )


Patch = Annotated[
    CentrePatch | DiagonalPatch | DiagonalsPatch | PositionPatch | GridPatch, Field(discriminator="place")
]


class _Cable(Model):
    """Round cable with bending stiffness."""

    diameter: Length = Key("diameter of the round section", gt=0)
    young: Stress = Key("Young's modulus", gt=0)
    density: Density = Key("density", gt=0)


class CornerCable(_Cable):
    """Cable from every corner of the film outwards along the diagonal, with `length` and number of `elements`."""

    place: Literal["corners"] = Key(_PLACE_OF_CABLE)
    length: Length = Key("length of each cable", gt=0)
    elements: Count = Key("number of elements of each cable", default=4, ge=1, le=200)


class EdgeCable(_Cable):
    """Cable along all edges of the film; it shares the positions and slopes of the film."""

    place: Literal["edges"] = Key(_PLACE_OF_CABLE)


Cable = Annotated[CornerCable | EdgeCable, Field(discriminator="place")]


class Support(Model):
    """Support of the film during the vibration, after the tension is applied."""

    at: Literal["edges", "left", "right", "bottom", "top", "corners", "cables", "point"] = Key(
        "supported part; edges are held straight"
    )
    position: Place | None = Key('position of "point"; the closest node is supported', default=None, within="on the film")
    fixed: Literal["xyz", "xy", "xz", "yz", "x", "y", "z"] = Key("directions without motion", default="xyz")
    clamped: bool = Key("slopes are held as well", default=False)

    @model_validator(mode="after")
    def _one_point(self) -> Self:
        if (self.at == "point") != (self.position is not None):
            raise ValueError('at = "point" requires `position`, and other supports do not use it')
        return self


class Tension(Model):
    """Tension that is applied to the film before its supports are fixed, by `pull` or by `strain`."""

    pull: Annotated[Force, Field(ge=0)] | None = Key(
        "force on every corner, outwards along its diagonal; give this or `strain`", default=None
    )
    strain: Number | tuple[Number, Number] | None = Key(
        "outward displacement of the edges over length and width", default=None, within="one value, or two"
    )
    film: Literal["plain", "tension-field", "wrinkles", "auto"] = Key(
        'behaviour of the film in compression. "plain": it carries compression; "tension-field": it carries '
        'none, and has wrinkled and slack regions; "wrinkles": wrinkles that the mesh resolves; "auto": "plain" if both '
        'principal stresses are tensile everywhere and the film is stable, else "tension-field"', default="plain",
    )  # fmt: skip
    imperfection: Annotated[Length, Field(gt=0)] | None = Key(
        '"wrinkles": amplitude of the initial waves', default=None,
        shown="amplitude of the closed form, or a tenth of the thickness"
    )  # fmt: skip

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.pull is None) == (self.strain is None):
            raise ValueError("give either `pull` (force at the corners) or `strain` (of the edges)")
        if self.imperfection is not None and self.film != "wrinkles":
            raise ValueError('`imperfection` is used with film = "wrinkles" only; remove `imperfection`')
        return self


class Air(Model):
    """Added mass of air, 0.68 x density x length per unit area, for the motion normal to the film (Minami, 1998)."""

    density: Density = Key("density of the air", default=1.2, gt=0)
    length: Annotated[Length, Field(gt=0)] | None = Key(
        "the added mass is 0.68 x density x length per unit area, for the motion normal to the film", default=None,
        shown="length of the film"
    )  # fmt: skip


class Damping(Model):
    """Damping of the vibration of a film."""

    material: Time = Key("Kelvin-Voigt time of film, patches and cables", default=0.0, ge=0)
    air: Rate = Key("damping force over mass times velocity; amplitudes decay as exp(-air t/2)", default=0.0, ge=0)


class _Pulse(Model):
    """Short force normal to the film at `point`, from time zero."""

    point: Place = Key("point at which the force acts", default=(0.0, 0.0), within="on the film")
    size: Annotated[Length, Field(gt=0)] | None = Key(
        "side of the square around `point` over which the force is spread evenly. Absent: a force at a point; "
        "the displacement at this point then grows with the logarithm of the number of elements", default=None,
    )  # fmt: skip


class HalfSinePulse(_Pulse):
    """Half sine wave with `duration` and the maximum `force`."""

    pulse: Literal["half-sine"] = Key(_PULSE)
    force: Force = Key("maximum force")
    duration: Time = Key(_DURATION, gt=0)


class RectanglePulse(_Pulse):
    """Constant `force` for `duration`."""

    pulse: Literal["rectangle"] = Key(_PULSE)
    force: Force = Key("constant force")
    duration: Time = Key(_DURATION, gt=0)


class MeasuredPulse(_Pulse):
    """Measured pulse: forces (N) at times (s), linear between them and zero outside."""

    pulse: Literal["table"] = Key(_PULSE)
    time: tuple[Time, ...] = Key("times of the forces, with linear interpolation", within="increasing, two or more")
    force: tuple[Force, ...] = Key("list of forces")

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

    duration: Time = Key("duration of the motion", default=1.0, gt=0)
    modes: Count = Key("number of natural modes, also of the reduced model", default=20, ge=1, le=500)
    probes: dict[Name, Place] = Field(
        default_factory=dict, max_length=1000,
        description='points with sampled motion, by name, `{ edge = [0.15, 0] }`; "center" and "patch" (the first) always '
        "exist",
        json_schema_extra={"range": "points on the film, m"},
    )
    sampling: Annotated[Time, Field(gt=0)] | None = Key(
        "time between samples of the probes", default=None, shown="a tenth of the period of the highest mode"
    )
    model: Literal["auto", "full", "reduced"] = Key(
        '"full": all coordinates; "reduced": modes; "auto": modes if they are accurate enough', default="auto"
    )
    stretch: bool = Key('"reduced": include the cubic terms due to the stretching of the film', default=False)


class Deployed(Model):
    """Film model of a deployed strip, with its panels and creases at the end of the travel."""

    elements_per_panel: Count = Key("number of elements along a panel", default=4, ge=1, le=200)
    elements_across: Count = Key(
        "number of elements over the width. The tension varies over the width, so this number affects the " "frequencies",
        default=6, ge=1, le=200
    )  # fmt: skip
    crease_width: Annotated[Length, Field(gt=0)] | None = Key(
        "distance between the mesh lines on both sides of a crease; panels of a thin strip bend close to their " "creases",
        default=None, shown="a tenth of a panel"
    )  # fmt: skip
