"""Study file of `fsm calibrate force`: the case, the tests, the parameters and the prediction."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from fsm.case.loading.model_file import read_file
from fsm.case.schema.model import Model
from fsm.case.schema.units import Count, Force, Length, Number

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
