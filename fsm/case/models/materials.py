"""Sections [material] and [crease] of a case."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from fsm.case.schema.model import Key, Model
from fsm.case.schema.units import (
    Angle,
    AngularStiffness,
    Density,
    Length,
    Moment,
    Number,
    StiffnessOfLine,
    Stress,
    Time,
    to_si,
)
from fsm.library import entries

_LAW = (
    '"linear": M = k (psi - rest); "spline": a measured curve from `data`, the `library` or lists; "family": a curve from '
    "a `file` of `fsm calibrate crease`"
)
_REST = "crease angle at which the angle of the data is zero; all data must lie at crease angles from 0 to pi"
_SCALE = "factor on the moment, for example for another width"
_WIDTH = (
    "width of the tested crease. A sheet requires this width: the moment of each crease is the measured moment, times the "
    "length of the crease over this width"
)
_REVERSAL = "with two curves: angle over which the moment changes from one curve to the other after a reversal"

DAMPING = 1e-3
"""Default Kelvin-Voigt time of a material, s."""


class Material(Model):
    """Isotropic sheet material."""

    young: Stress = Key("Young's modulus", gt=0)
    poisson: Number = Key("Poisson's ratio", default=0.3, gt=-1, lt=0.5)
    density: Density = Key("density", gt=0)
    plate: bool = Key("bending about the creases with E/(1 - nu^2), for wide strips", default=False)
    damping: Annotated[Time, Field(ge=0)] | None = Key(
        "Kelvin-Voigt time beta: every spring has the damping c = beta k, which shifts the force by beta", default=None,
        shown="1e-3; strip with a slow drive: at most 5e-5 of its duration; sheet of flexible facets or bars: 0, "
        "with `fold_to` 1 % of `solve.end_time`",
    )  # fmt: skip

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
    """Linear crease moment, M = k (psi - rest)."""

    law: Literal["linear"] = Key(
        _LAW, default="linear",
        shown='needed, except beside `stiffness_per_length` ("linear"), `library` ("spline") and `file` ("family")'
    )  # fmt: skip
    stiffness: AngularStiffness = Key(
        "stiffness of the whole width of the strip", ge=0, shown="needed, or `stiffness_per_length` for a sheet"
    )
    stiffness_per_length: Annotated[StiffnessOfLine, Field(ge=0)] | None = Key(
        "stiffness of the creases of a sheet over their length, instead of `stiffness`", default=None
    )
    rest_angle: FoldAngle | None = Key(
        "crease angle (0 flat, pi closed) at which the moment is zero", default=None, shown="as folded"
    )

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

    The data are in a CSV file (see `fsm.case.loading.crease_data`) with the columns (angle, moment) or (angle, force,
    lever_arm), in the library of the package, or in lists. An angle of the data is the opening: the rotation of the crease
    from its rest angle towards flat. A positive moment resists the opening.
    """

    law: Literal["spline"] = Key(_LAW)
    data: Path | None = Key("CSV file, relative to the case file", default=None)
    angle_unit: Annotated[str, AfterValidator(_angle_unit)] | None = Key(
        "unit of angles if the header of the file has none", default=None, shown="unit of plain numbers"
    )
    moment_unit: Annotated[str, AfterValidator(_moment_unit)] | None = Key(
        "unit of moments if the header of the file has none", default=None, shown="unit of plain numbers"
    )
    angle: tuple[Angle, ...] | None = Key(
        'angles of the curve; "cubic" requires 4 points, "pchip" 2', default=None, within="increasing"
    )
    moment: tuple[Moment, ...] | None = Key("moments of the curve", default=None, within="as many as angles")
    library: str | None = Key(
        "name of a measured law of the package; `fsm help library` lists them. Beside `angle` and `moment`, as "
        "in the copy of a case in a result, it only names their source", default=None,
    )  # fmt: skip
    interpolation: Literal["cubic", "pchip"] = Key(
        "not-a-knot spline, or PCHIP, which keeps monotone data monotone", default="cubic"
    )
    rest_angle: DataZero | None = Key(_REST, default=None, shown="as folded")
    scale: Number = Key(_SCALE, default=1.0, gt=0)
    width: Annotated[Length, Field(gt=0)] | None = Key(_WIDTH, default=None)
    unloading: tuple[Moment, ...] | None = Key(
        "moments of the lists while the crease closes; the crease dissipates the area between both curves", default=None,
        within="as many as angles, not above `moment`"
    )  # fmt: skip
    reversal: Annotated[Angle, Field(gt=0)] | None = Key(_REVERSAL, default=None, shown="2 % of the range")

    @field_validator("library")
    @classmethod
    def _in_library(cls, name: str | None, info: ValidationInfo) -> str | None:
        if name is not None and name not in entries() and info.data.get("angle") is None:
            known = ", ".join(entries())
            raise ValueError(f'"{name[:60]}" is not in the library, which has {known}; see `fsm help library`')
        return name

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        listed = self.angle is not None and self.moment is not None
        found = listed or self.library is not None
        if (self.data is not None) == found or (self.angle is None) != (self.moment is None):
            raise ValueError("give `data` (a CSV file), `library` (a name), or both `angle` and `moment`")
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
    """Crease moment M(psi) from a file of `fsm calibrate crease`; reading the case replaces it by a `SplineCrease`."""

    law: Literal["family"] = Key(_LAW, default="family")
    file: Path = Key("file of calibrated creases, relative to the case file")
    press_time: Annotated[Time, Field(ge=0)] | None = Key(
        "time for which the crease was pressed; required if the file has several", default=None, shown="value of the file",
        within="measured range"
    )  # fmt: skip
    opening: Annotated[Number, Field(ge=1)] | None = Key(
        "number of the opening, counted from the first opening of a new crease; required if the file has " "several",
        default=None, shown="value of the file", within="measured range, >= 1"
    )  # fmt: skip
    hysteresis: bool = Key(
        "follow the unloading curve while the crease closes; false: elastic along the loading curve", default=False
    )
    since_release: Annotated[Time, Field(ge=0)] | None = Key(
        "time since the release of the crease, instead of `rest_angle`; the file gives the relaxation of the " "rest angle",
        default=None, within="measured range"
    )  # fmt: skip
    reversal: Annotated[Angle, Field(gt=0)] | None = Key(_REVERSAL, default=None, shown="2 % of the range")
    rest_angle: DataZero | None = Key(_REST, default=None, shown="as folded")
    scale: Number = Key(_SCALE, default=1.0, gt=0)
    width: Annotated[Length, Field(gt=0)] | None = Key(_WIDTH, default=None)

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


UNREAD = "is read with a case file only; in Python, get the curve with `fsm.case.loading.crease_family`"
"""Message for a family crease that was not replaced by its curve."""


_ONE_LAW = {"file": "family", "stiffness_per_length": "linear", "library": "spline"}
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
