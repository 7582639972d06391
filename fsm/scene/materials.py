"""Material of the plain sheet and the law of a crease."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from fsm.scene.model import Model
from fsm.scene.units import Angle, AngularStiffness, Density, Moment, Number, Stress, Time, to_si

__all__ = ["UNREAD", "Crease", "FamilyCrease", "LinearCrease", "Material", "SplineCrease"]


DAMPING = 1e-3
"""Kelvin-Voigt time of a material that gives none, s."""


class Material(Model):
    """Isotropic sheet material.

    Attributes
    ----------
    young : Pa
    poisson : -
    density : kg/m^3
    plate : bool
        Cylindrical bending of a wide strip: E -> E/(1 - nu^2) in bending about the crease direction.
    damping : s
        Kelvin-Voigt time beta: every joint has the damping c = beta k. Absent: `DAMPING`, and less in a strip that is pulled
        slowly, see `fsm.scene.builders.strip`.
    """

    young: Annotated[Stress, Field(gt=0)]
    poisson: Annotated[Number, Field(gt=-1, lt=0.5)] = 0.3
    density: Annotated[Density, Field(gt=0)]
    plate: bool = False
    damping: Annotated[Time, Field(ge=0)] | None = None

    def bending(self, width: float, thickness: float) -> float:
        """E w t^3/12 of a plain sheet, N m^2; over 1 - nu^2 where it bends as a plate."""
        try:
            bending = self.young * width * thickness**3 / 12
        except OverflowError:  # a power of Python raises where a product is infinite
            return math.inf
        return bending / (1 - self.poisson**2) if self.plate else bending


FoldAngle = Annotated[Angle, Field(ge=0, le=math.pi)]
"""Angle of a crease from the flat sheet: 0 flat, pi closed, rad."""
DataZero = Annotated[Angle, Field(ge=-2 * math.pi, le=2 * math.pi)]
"""Angle of a crease from the flat sheet at which the angle of measured data is zero, rad; it may lie outside the data."""


class LinearCrease(Model):
    """M = k (psi - rest): `stiffness` over the whole width of the strip, N m/rad.

    `rest_angle` is the fold angle at which the crease is free of moment, measured from the flat sheet
    (0 flat, pi closed); absent means at rest as folded.
    """

    law: Literal["linear"] = "linear"
    stiffness: Annotated[AngularStiffness, Field(ge=0)]
    rest_angle: FoldAngle | None = None


def _angle_unit(text: str) -> str:
    to_si(f"1 {text}", "rad")
    return text


def _moment_unit(text: str) -> str:
    to_si(f"1 {text}", "N m")
    return text


class SplineCrease(Model):
    """M(psi) from a test, interpolated.

    Data come from a CSV file (see `fsm.scene.crease_data`) with the columns (angle, moment) or
    (angle, force, lever_arm), or as lists. Angles are opening angles: how far the crease is turned from the
    rest angle towards flat, moments resist it.

    Attributes
    ----------
    data : path of the CSV file, relative to the case file
    angle_unit, moment_unit : str
        Units of the file's columns where its header does not say, e.g. "deg" and "mN m"; absent means those
        of plain numbers in the case: rad, and N m or N mm. A file without a header needs both.
    angle, moment : the curve itself, rad and N m; instead of `data`
    interpolation : "cubic" (not-a-knot) or "pchip" (monotone data stay monotone)
    rest_angle : rad
        Angle of the crease from the flat sheet at which the data's angle is zero; absent means as folded.
    scale : -
        Factor on the moment, for example to carry a test of another width over.
    unloading : N m
        Moments at the same angles on the way back; what lies between the two curves is dissipated
        (`fsm.laws.crease_hysteresis`). Absent: the crease is elastic.
    reversal : rad
        Opening over which the moment goes from one curve to the other when the crease turns round; absent means
        2 % of the range of angles.
    """

    law: Literal["spline"]
    data: Path | None = None
    angle_unit: Annotated[str, AfterValidator(_angle_unit)] | None = None
    moment_unit: Annotated[str, AfterValidator(_moment_unit)] | None = None
    angle: tuple[Angle, ...] | None = None
    moment: tuple[Moment, ...] | None = None
    interpolation: Literal["cubic", "pchip"] = "cubic"
    rest_angle: DataZero | None = None
    scale: Annotated[Number, Field(gt=0)] = 1.0
    unloading: tuple[Moment, ...] | None = None
    reversal: Annotated[Angle, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        listed = self.angle is not None and self.moment is not None
        if (self.data is None) == (not listed) or (self.angle is None) != (self.moment is None):
            raise ValueError("give either `data` (a CSV file) or both `angle` and `moment`")
        if self.data is None and (self.angle_unit or self.moment_unit):
            raise ValueError("`angle_unit` and `moment_unit` belong to `data`; lists carry their own units")
        return self

    @model_validator(mode="after")
    def _two_ways(self) -> Self:
        if self.unloading is None:
            if self.reversal is not None:
                raise ValueError("`reversal` belongs to `unloading`; an elastic crease has no second curve")
        elif self.angle is None:
            raise ValueError("`unloading` belongs to the lists `angle` and `moment`; a CSV file holds one curve")
        elif len(self.unloading) != len(self.angle):
            raise ValueError(f"`unloading` has {len(self.unloading)} moments for {len(self.angle)} angles")
        return self


class FamilyCrease(Model):
    """M(psi) out of a file that `fsm calibrate crease` wrote; reading the case puts the curve in its place.

    Attributes
    ----------
    file : path of the HDF5 file, relative to the case file
    press_time : s
        How long the crease was pressed; interpolated between measured times. Needed where the file has several.
    opening : -
        How many times it has been opened, this time included. Needed where the file has several.
    hysteresis : bool
        Follow the unloading curve on the way back and dissipate what lies between; false: the loading curve, elastic.
    since_release : s
        Time since the crease was let go: `rest_angle` by the relaxation in the file, from the flat sheet.
    reversal, rest_angle, scale : as in `SplineCrease`
    """

    law: Literal["family"] = "family"
    file: Path
    press_time: Annotated[Time, Field(ge=0)] | None = None
    opening: Annotated[Number, Field(ge=1)] | None = None
    hysteresis: bool = False
    since_release: Annotated[Time, Field(ge=0)] | None = None
    reversal: Annotated[Angle, Field(gt=0)] | None = None
    rest_angle: DataZero | None = None
    scale: Annotated[Number, Field(gt=0)] = 1.0

    @model_validator(mode="after")
    def _choices(self) -> Self:
        if self.reversal is not None and not self.hysteresis:
            raise ValueError("`reversal` is used with `hysteresis = true` only")
        if self.since_release is not None and self.rest_angle is not None:
            raise ValueError("give `since_release` or `rest_angle`, not both")
        return self


UNREAD = "is read with the case file; in Python, take the curve with `fsm.scene.crease_family`"
"""What to say of a family whose curve was not put in its place."""


def _law_of_file(written: Any) -> Any:
    """A section that names a file of calibrated curves need not say its law."""
    if isinstance(written, Mapping) and "file" in written and "law" not in written:
        return {"law": "family", **written}
    return written


Crease = Annotated[
    LinearCrease | SplineCrease | FamilyCrease, Field(discriminator="law"), BeforeValidator(_law_of_file)
]
