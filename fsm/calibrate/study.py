"""The study file of `fsm calibrate force`: which case, which tests, which parameters, what to predict."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, model_validator

from fsm.errors import CaseError, Fault
from fsm.scene.faults import dotted, unknown_key
from fsm.scene.load_case import read_toml
from fsm.scene.model import Model
from fsm.scene.units import Count, Force, Length, Number

__all__ = ["Curve", "Predict", "Prior", "Study", "Varied", "read_study"]

Value = float | str


class Varied(Model):
    """A parameter: numbers in the case's units, or text with a unit.

    Attributes
    ----------
    path : dotted path of a number of the case
    lower, upper : bounds
    start : where to begin; the case's own value if absent
    """

    path: str
    lower: Value
    upper: Value
    start: Value | None = None


class Prior(Model):
    """What is known of the ratio of two parameters before any test.

    Attributes
    ----------
    above, below : paths of the two
    lower, upper : bounds of the ratio, in the case's units
        Its logarithm is taken to have the mean and the standard deviation of one spread evenly between these.
    """

    above: str
    below: str
    lower: Annotated[float, Field(gt=0)]
    upper: Annotated[float, Field(gt=0)]

    @model_validator(mode="after")
    def _order(self) -> Self:
        if self.upper <= self.lower:
            raise ValueError(f"upper = {self.upper:g} must be more than lower = {self.lower:g}")
        return self


class Curve(Model):
    """One test.

    Attributes
    ----------
    name : str
    data : CSV with displacement and force; half_band or repeat if known
    set : "path=value" texts
        What the case has of its own in this test.
    coverage : -
        Part of tests that lie within the half band: a normal scatter of so much.
    alike : m
        Travel over which scatter is alike; 0: every point has its own.
    zero : N
        Standard deviation of the zero of the load cell; 0: not off.
    drag : N
        Standard deviation of a force of hysteresis that builds up as the loading begins; 0: there is none.
    drag_over : m
        Travel over which it does.
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
    """What to predict with the calibrated case.

    Attributes
    ----------
    name : str
    set : "path=value" texts
    points : int
        Evenly over the drive's travel.
    samples : int
        Of the Monte Carlo band; 0: the linear one.
    zero, drag, drag_over : N, N, m
        As of a curve: what a test of it would add. The band is then one of what is measured.
    """

    name: str
    set: tuple[str, ...] = ()
    points: Annotated[Count, Field(ge=2, le=10_000)] = 51
    samples: Annotated[Count, Field(ge=0, le=100_000)] = 200
    zero: Annotated[Force, Field(ge=0)] = 0.0
    drag: Annotated[Force, Field(ge=0)] = 0.0
    drag_over: Annotated[Length, Field(gt=0)] = 1e-3


class Study(Model):
    """A whole study.

    Attributes
    ----------
    case : case file, relative to the study
    starts : how often to begin, from points drawn within the bounds
    """

    title: str = ""
    case: Path
    starts: Annotated[Count, Field(ge=1, le=1000)] = 3
    curve: Annotated[tuple[Curve, ...], Field(min_length=1)]
    parameter: Annotated[tuple[Varied, ...], Field(min_length=1)]
    prior: tuple[Prior, ...] = ()
    predict: Predict | None = None

    @model_validator(mode="after")
    def _named(self) -> Self:
        paths = [one.path for one in self.parameter]
        for names, what in (([one.name for one in self.curve], "curve"), (paths, "parameter")):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise ValueError(f"{what} {twice[0]!r} stands twice")
        for prior in self.prior:
            for path in (prior.above, prior.below):
                if path not in paths:
                    raise ValueError(f"a prior speaks of {path!r}, which is no [[parameter]]")
        return self


def read_study(path: Path) -> Study:
    """Read a study file.

    Raises
    ------
    CaseError
        All its faults.
    """
    data = read_toml(path)
    try:
        return Study.model_validate(data)
    except ValidationError as error:
        raise CaseError([_fault(detail) for detail in error.errors()], str(path)) from None


_KEYS: dict[str, type[Model]] = {"curve": Curve, "parameter": Varied, "prior": Prior, "predict": Predict}


def _fault(detail: Any) -> Fault:
    where = list(detail["loc"])
    if detail["type"] == "extra_forbidden":
        model = _KEYS.get(str(where[0]), Study) if len(where) > 1 else Study
        return Fault(dotted(where), unknown_key(str(where[-1]), list(model.model_fields)))
    if detail["type"] == "missing":
        return Fault(dotted(where), "missing; it must be given")
    if detail["type"] == "tuple_type" and where[-1] == "set":
        return Fault(dotted(where), 'must be a list of texts as --set takes them, e.g. ["strip.fold_angle=75 deg"]')
    if detail["type"] == "tuple_type":
        return Fault(dotted(where), f"must be a list of sections; write its name in two brackets, [[{where[-1]}]]")
    message = str(detail["msg"]).removeprefix("Value error, ")
    return Fault(dotted(where), message[:1].lower() + message[1:])
