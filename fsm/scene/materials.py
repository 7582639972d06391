"""Material of the plain sheet and the law of a crease."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from fsm.scene.model import Model
from fsm.scene.units import Angle, AngularStiffness, Density, Moment, Number, Stress, Time, to_si

__all__ = ["Crease", "LinearCrease", "Material", "SplineCrease"]


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
        Kelvin-Voigt time beta: every joint has the damping c = beta k.
    """

    young: Annotated[Stress, Field(gt=0)]
    poisson: Annotated[Number, Field(gt=-1, lt=0.5)] = 0.3
    density: Annotated[Density, Field(gt=0)]
    plate: bool = False
    damping: Annotated[Time, Field(ge=0)] = 1e-3


class LinearCrease(Model):
    """M = k (psi - rest): `stiffness` over the whole width of the strip, N m/rad.

    `rest_angle` is the fold angle at which the crease is free of moment, measured from the flat sheet
    (0 flat, pi closed); absent means at rest as folded.
    """

    law: Literal["linear"] = "linear"
    stiffness: Annotated[AngularStiffness, Field(ge=0)]
    rest_angle: Angle | None = None


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
    """

    law: Literal["spline"]
    data: Path | None = None
    angle_unit: Annotated[str, AfterValidator(_angle_unit)] | None = None
    moment_unit: Annotated[str, AfterValidator(_moment_unit)] | None = None
    angle: tuple[Angle, ...] | None = None
    moment: tuple[Moment, ...] | None = None
    interpolation: Literal["cubic", "pchip"] = "cubic"
    rest_angle: Angle | None = None
    scale: Annotated[Number, Field(gt=0)] = 1.0

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        listed = self.angle is not None and self.moment is not None
        if (self.data is None) == (not listed) or (self.angle is None) != (self.moment is None):
            raise ValueError("give either `data` (a CSV file) or both `angle` and `moment`")
        if self.data is None and (self.angle_unit or self.moment_unit):
            raise ValueError("`angle_unit` and `moment_unit` belong to `data`; lists carry their own units")
        return self


Crease = Annotated[LinearCrease | SplineCrease, Field(discriminator="law")]
