"""Study file of `fsm calibrate force`: the case, the tests, the parameters and the prediction.

Access to numbers of a case by their dotted paths, in SI units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BaseModel, Field, model_validator

from fsm.case.loading.model_file import read_file
from fsm.case.loading.overrides import keys_of, place_at
from fsm.case.models.case import Case
from fsm.case.schema.model import Model
from fsm.case.schema.units import Count, Force, Length, Number
from fsm.errors import CaseError, Fault

Value = float | str
"""Number in the case's units, or text with a unit."""


class StudyParameter(Model):
    """Parameter to identify.

    Attributes
    ----------
    path : dotted path of a number of the case
    lower, upper : bounds
    start : start value; by default the value of the case
    """

    path: str
    lower: Value
    upper: Value
    start: Value | None = None


class StudyPrior(Model):
    """Prior knowledge of a parameter, or of the ratio of two parameters.

    Attributes
    ----------
    above, below : paths of numerator and denominator; without `below` the prior is for the parameter `above`
    lower, upper : bounds of the parameter or ratio; numbers in the case's units, or, for a parameter, texts with a unit
        Its logarithm has the mean and the standard deviation of a uniform distribution between the bounds.
    """

    above: str
    below: str | None = None
    lower: Value
    upper: Value

    @model_validator(mode="after")
    def _numbers(self) -> Self:
        for key in ("lower", "upper"):
            value = getattr(self, key)
            if self.below is not None and isinstance(value, str):
                raise ValueError(f"{key} = {value!r} bounds a ratio; give a number in the units of the case")
        return self


class MeasuredCurve(Model):
    """One test.

    Attributes
    ----------
    name : str
    data : CSV file with displacement and force, and optionally half_band or repeat
    set : "path=value" texts
        Changes of the case for this test.
    coverage : -
        Probability that a test lies within the half band, for normally distributed scatter.
    alike : m
        Correlation length of the scatter along the travel; 0: independent points.
    zero : N
        Standard deviation of the zero error of the load cell; 0: no zero error.
    drag : N
        Standard deviation of a hysteresis force that builds up at the beginning of the loading; 0: no drag.
    drag_over : m
        Travel over which the drag builds up.
    """

    name: str
    data: Path
    set: tuple[str, ...] = ()
    coverage: Annotated[Number, Field(gt=0.01, lt=0.9999)] = 0.95
    alike: Annotated[Length, Field(ge=0)] = 0.0
    zero: Annotated[Force, Field(ge=0)] = 0.0
    drag: Annotated[Force, Field(ge=0)] = 0.0
    drag_over: Annotated[Length, Field(gt=0)] = 1e-3


class Predict(Model):
    """Prediction with the calibrated case.

    Attributes
    ----------
    name : str
    set : "path=value" texts
        Changes of the case for the prediction.
    points : int
        Number of points, equally spaced over the travel of the drive.
    samples : int
        Number of samples of the Monte Carlo band; 0: linear band.
    zero, drag, drag_over : N, N, m
        Scatter as in `MeasuredCurve`; it widens the band to a band of measured forces.
    leave_out : bool
        Predict every test from the others; the error beyond the scatter of the test widens the band.
    """

    name: str
    set: tuple[str, ...] = ()
    points: Annotated[Count, Field(ge=2, le=10_000)] = 51
    samples: Annotated[Count, Field(ge=0, le=100_000)] = 200
    zero: Annotated[Force, Field(ge=0)] = 0.0
    drag: Annotated[Force, Field(ge=0)] = 0.0
    drag_over: Annotated[Length, Field(gt=0)] = 1e-3
    leave_out: bool = False


class Study(Model):
    """Complete study.

    Attributes
    ----------
    case : path of the case file, relative to the study
    starts : number of starts of the search; all except the first are random points within the bounds
    """

    title: str = ""
    case: Path
    starts: Annotated[Count, Field(ge=1, le=1000)] = 3
    curve: Annotated[tuple[MeasuredCurve, ...], Field(min_length=1)]
    parameter: Annotated[tuple[StudyParameter, ...], Field(min_length=1)]
    prior: tuple[StudyPrior, ...] = ()
    predict: Predict | None = None

    @model_validator(mode="after")
    def _named(self) -> Self:
        paths = [one.path for one in self.parameter]
        for names, section in (([one.name for one in self.curve], "curve"), (paths, "parameter")):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise ValueError(f"{section} {twice[0]!r} is given twice; delete or rename one")
        for prior in self.prior:
            for path in (prior.above, prior.below):
                if path is not None and path not in paths:
                    raise ValueError(f"a prior names {path!r}, which is not the path of a [[parameter]]")
        if self.predict is not None and self.predict.leave_out and len(self.curve) < 2:
            raise ValueError("predict.leave_out predicts every test from the others; add a [[curve]] or remove this key")
        return self


def read_study(path: Path) -> Study:
    """Read a study file.

    Raises
    ------
    CaseError
        The file has faults; all are listed.
    """
    return read_file(path, Study)


def value_at(case: Case, path: str) -> float:
    """Number at a dotted path of a case, in SI units.

    Raises
    ------
    CaseError
        The path has no value, or its value is not a continuous number.
    """
    value: Any = case
    for key in keys_of(path):
        value = _child(value, key)
        if value is None:
            raise CaseError(Fault(path, "the case has no number there; add the number, or correct the path"))
    if isinstance(value, bool) or not isinstance(value, float | int):
        raise CaseError(Fault(path, f"is {value!r}, not a number; only numbers can be varied"))
    if isinstance(value, int) and unit_of(case, path) == "":
        raise CaseError(Fault(path, f"is {value}, a whole number; only continuous numbers can be varied"))
    return float(value)


def with_values(case: Case, values: Mapping[str, float]) -> Case:
    """Copy of a case with other numbers (SI) at some paths.

    The paths must be valid for `value_at`. The bounds of the keys are not checked.
    """
    changed: Any = case
    for path, value in values.items():
        changed = _replace_at(changed, keys_of(path), float(value))
    assert isinstance(changed, Case)
    return changed


def unit_of(case: Case, path: str) -> str:
    """SI unit of the value at a path of a case (empty without unit)."""
    place = place_at(case.model_dump(), path)
    return place.unit() if place is not None else ""


def _child(parent: Any, key: str | int) -> Any:
    if isinstance(parent, BaseModel) and isinstance(key, str):
        return getattr(parent, key, None) if key in type(parent).model_fields else None
    if isinstance(parent, tuple | list) and isinstance(key, int):
        return parent[key] if key < len(parent) else None
    return None


def _replace_at(parent: Any, keys: Sequence[str | int], value: float) -> Any:
    if not keys:
        return value
    key, *rest = keys
    child = _replace_at(_child(parent, key), rest, value)
    if isinstance(parent, BaseModel):
        return parent.model_copy(update={str(key): child})
    assert isinstance(parent, tuple) and isinstance(key, int)
    return (*parent[:key], child, *parent[key + 1 :])
