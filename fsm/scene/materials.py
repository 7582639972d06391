"""Sections [material] and [crease] of a case."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from fsm.scene.model import Model
from fsm.scene.units import Angle, AngularStiffness, Density, Length, Moment, Number, StiffnessOfLine, Stress, Time, to_si

__all__ = ["UNREAD", "Crease", "FamilyCrease", "LinearCrease", "Material", "SplineCrease"]


DAMPING = 1e-3
"""Default Kelvin-Voigt time of a material, s."""


class Material(Model):
    """Isotropic sheet material.

    Attributes
    ----------
    young : Pa
    poisson : -
    density : kg/m^3
    plate : bool
        Whether a wide strip has cylindrical bending about the crease direction, with E/(1 - nu^2) instead of E.
    damping : s
        Kelvin-Voigt time beta: every joint has the damping c = beta k. Absent: `DAMPING`, and less for a strip with a slow
        drive (`fsm.scene.builders.strip.strip_damping`).
    """

    young: Annotated[Stress, Field(gt=0)]
    poisson: Annotated[Number, Field(gt=-1, lt=0.5)] = 0.3
    density: Annotated[Density, Field(gt=0)]
    plate: bool = False
    damping: Annotated[Time, Field(ge=0)] | None = None

    def bending(self, width: float, thickness: float) -> float:
        """Bending stiffness of a sheet, E w t^3/12, N m^2; divided by 1 - nu^2 if `plate` is true."""
        try:
            bending = self.young * width * thickness**3 / 12
        except OverflowError:  # the product of floats overflows to infinity, while a power raises an error
            return math.inf
        return bending / (1 - self.poisson**2) if self.plate else bending


FoldAngle = Annotated[Angle, Field(ge=0, le=math.pi)]
"""Angle of a crease from the flat sheet, rad: 0 flat, pi closed."""
DataZero = Annotated[Angle, Field(ge=-2 * math.pi, le=2 * math.pi)]
"""Angle of a crease from the flat sheet at which the angle of the data is zero, rad; it may be outside the data."""


class LinearCrease(Model):
    """Linear crease moment, M = k (psi - rest).

    Attributes
    ----------
    stiffness : N m/rad
        Stiffness k of the whole width of the strip.
    stiffness_per_length : N m/rad per m
        Stiffness of a crease of a [sheet] over its length, instead of `stiffness`.
    rest_angle : rad
        Angle from the flat sheet at which the moment is zero (0 flat, pi closed); absent: the angle as folded.
    """

    law: Literal["linear"] = "linear"
    stiffness: Annotated[AngularStiffness, Field(ge=0)]
    stiffness_per_length: Annotated[StiffnessOfLine, Field(ge=0)] | None = None
    rest_angle: FoldAngle | None = None

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> Mapping[str, Any]:
        """Section with a `stiffness` of zero if it gives only a stiffness per length."""
        return {"stiffness": 0.0, **written} if "stiffness_per_length" in written else written

    @model_validator(mode="after")
    def _one_stiffness(self) -> Self:
        if self.stiffness_per_length is not None and self.stiffness:
            raise ValueError("give `stiffness` (of a strip) or `stiffness_per_length` (of a sheet), not both")
        return self

    @property
    def mean_stiffness(self) -> float:
        """Stiffness of the whole width, N m/rad."""
        return self.stiffness


def _angle_unit(text: str) -> str:
    to_si(f"1 {text}", "rad")
    return text


def _moment_unit(text: str) -> str:
    to_si(f"1 {text}", "N m")
    return text


class SplineCrease(Model):
    """Measured crease moment M(psi), interpolated.

    The data are in a CSV file (see `fsm.scene.crease_data`) with the columns (angle, moment) or (angle, force, lever_arm),
    or in lists. An angle of the data is the opening: the rotation of the crease from its rest angle towards flat. A positive
    moment resists the opening.

    Attributes
    ----------
    data : path of the CSV file, relative to the case file
    angle_unit, moment_unit : str
        Units of columns without a unit in the header, e.g. "deg" and "mN m". Absent: the units of plain numbers in the case
        (rad, and N m or N mm). A file without a header requires both.
    angle, moment : curve as lists, rad and N m, instead of `data`
    interpolation : "cubic" (not-a-knot spline) or "pchip" (keeps monotone data monotone)
    rest_angle : rad
        Angle from the flat sheet at which the angle of the data is zero; absent: the angle as folded.
    scale : -
        Factor on the moment, for example for a test of another width.
    width : m
        Width of the tested crease; required in a [sheet], whose creases have the moment times their length over this width.
    unloading : N m
        Moments at the same angles while the crease closes; the crease dissipates the area between both curves
        (`fsm.laws.crease_hysteresis`). Absent: the crease is elastic.
    reversal : rad
        Angle over which the moment changes between the loading and the unloading curve after a reversal; absent: 2 % of the
        range of angles.
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
    width: Annotated[Length, Field(gt=0)] | None = None
    unloading: tuple[Moment, ...] | None = None
    reversal: Annotated[Angle, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        listed = self.angle is not None and self.moment is not None
        if (self.data is None) == (not listed) or (self.angle is None) != (self.moment is None):
            raise ValueError("give either `data` (a CSV file) or both `angle` and `moment`")
        if self.data is None and (self.angle_unit or self.moment_unit):
            raise ValueError("`angle_unit` and `moment_unit` are used with `data` only; give units in the lists instead")
        return self

    @property
    def mean_stiffness(self) -> float:
        """Magnitude of the slope between the ends of the curve, N m/rad; the value is 0 before the file is read."""
        if self.angle is None or self.moment is None:
            return 0.0
        return abs(self.moment[-1] - self.moment[0]) / (self.angle[-1] - self.angle[0]) * self.scale

    @model_validator(mode="after")
    def _two_ways(self) -> Self:
        if self.unloading is None:
            if self.reversal is not None:
                raise ValueError("`reversal` is used with `unloading` only; remove `reversal`, or give `unloading`")
        elif self.angle is None:
            raise ValueError("`unloading` needs the lists `angle` and `moment`; give both lists, or remove `unloading`")
        elif len(self.unloading) != len(self.angle):
            raise ValueError(
                f"`unloading` has {len(self.unloading)} moments, but `angle` has {len(self.angle)} angles; "
                "give one moment for each angle"
            )
        return self


class FamilyCrease(Model):
    """Crease moment M(psi) from a file of `fsm calibrate crease`; reading the case replaces it by a `SplineCrease`.

    Attributes
    ----------
    file : path of the HDF5 file, relative to the case file
    press_time : s
        Time for which the crease was pressed, interpolated between measured times. Required if the file has several.
    opening : -
        Number of openings of the crease, including the present opening. Required if the file has several.
    hysteresis : bool
        Whether the crease follows the unloading curve while it closes; false: elastic along the loading curve.
    since_release : s
        Time since the release of the crease; the relaxation in the file then gives `rest_angle`.
    reversal, rest_angle, scale, width : as in `SplineCrease`
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
    width: Annotated[Length, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _choices(self) -> Self:
        if self.reversal is not None and not self.hysteresis:
            raise ValueError("`reversal` is used with `hysteresis = true` only")
        if self.since_release is not None and self.rest_angle is not None:
            raise ValueError("give `since_release` or `rest_angle`, not both")
        return self

    @property
    def mean_stiffness(self) -> float:
        """The value is zero, because the stiffness is known only after the file is read."""
        return 0.0


UNREAD = "is read with a case file only; in Python, get the curve with `fsm.scene.crease_family`"
"""Message for a family crease that was not replaced by its curve."""


_ONE_LAW = {"file": "family", "stiffness_per_length": "linear"}
"""Keys that only one law has, by the name of this law."""


def _law_of_key(written: Any) -> Any:
    """Section with a law; if the section names no law, a key that belongs to only one law determines the law."""
    if isinstance(written, Mapping) and "law" not in written:
        law = next((law for key, law in _ONE_LAW.items() if key in written), None)
        return written if law is None else {"law": law, **written}
    return written


Crease = Annotated[
    LinearCrease | SplineCrease | FamilyCrease, Field(discriminator="law"), BeforeValidator(_law_of_key)
]
