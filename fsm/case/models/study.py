"""File of `fsm study`: parameters of a case with their scatter, the design of the runs, and the responses.

Numbers of a parameter have the unit of its key in the case, so they are read when the case is known.

File of `fsm optimise`: variables of a case with bounds, the objective, and constraints.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Model
from fsm.case.schema.units import Count, Number

Value = float | str
"""Number in the unit system of the case, or text with a unit."""
Design = Literal["sobol", "latin", "grid", "one-at-a-time", "csv"]
Distribution = Literal["uniform", "normal", "lognormal", "triangular"]

NEEDED: dict[str, tuple[str, ...]] = {
    "uniform": ("low", "high"), "normal": ("sigma",), "lognormal": ("sigma",), "triangular": ("low", "high"),
}  # fmt: skip
"""Keys that a distribution needs."""
OPTIONAL: dict[str, tuple[str, ...]] = {
    "uniform": (), "normal": ("mean",), "lognormal": ("mean",), "triangular": ("mode",),
}  # fmt: skip
"""Keys that a distribution may have."""
_NUMBERS = ("low", "high", "mean", "sigma", "mode")


class StudyDesign(Model):
    """Which runs are made."""

    kind: Design = Field(
        default="sobol",
        description='"sobol": runs for Sobol indices, from a Sobol sequence (Saltelli 2010); "latin": Latin hypercube; '
        '"grid": all combinations; "one-at-a-time": each parameter alone, the others nominal; "csv": rows of `file`',
    )
    sample: Annotated[Count, Field(ge=2, le=1_048_576)] = Field(
        default=64,
        description='size of the base sample: "latin" makes as many runs, "sobol" `sample` times (number of independent '
        "parameters + 2)",
        json_schema_extra={"range": '2 to 1048576; "sobol": a power of 2'},
    )
    points: Annotated[Count, Field(ge=2, le=1000)] = Field(
        default=3, description='number of values of each parameter of "grid" and "one-at-a-time", equally spaced'
    )
    file: Path | None = Field(
        default=None,
        description='CSV file of "csv": one column for each parameter, with its path as heading, and one row for each run',
        json_schema_extra={"default": 'needed by "csv"'},
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.kind == "csv" and self.file is None:
            raise ValueError('"csv" needs the key `file` with the name of a CSV file')
        if self.kind == "sobol" and self.sample & (self.sample - 1):
            near = 1 << (self.sample.bit_length() - 1)
            raise ValueError(
                f"sample = {self.sample} is no power of 2, which a Sobol sequence needs; give {near} or {2 * near}"
            )
        return self


class StudyParameter(Model):
    """A number of the case, with its range or its scatter."""

    path: str = Field(description="dotted path of a number of the case, as for `--set`; for a function any name")
    low: Value | None = Field(
        default=None, description="smallest value", json_schema_extra={"default": 'needed by a range and by "triangular"'}
    )
    high: Value | None = Field(
        default=None, description="largest value", json_schema_extra={"default": 'needed by a range and by "triangular"'}
    )
    distribution: Distribution | None = Field(
        default=None,
        description='"uniform" from `low` to `high`; "normal", "lognormal" with `mean` and `sigma`; "triangular"',
        json_schema_extra={"default": '"uniform"'},
    )
    mean: Value | None = Field(
        default=None, description="mean of the distribution", json_schema_extra={"default": "value of the case"}
    )
    sigma: Value | None = Field(
        default=None,
        description='standard deviation; `"5 %"` is a part of the mean',
        json_schema_extra={"default": 'needed by "normal" and "lognormal"'},
    )
    mode: Value | None = Field(
        default=None, description='most probable value of "triangular"', json_schema_extra={"default": "value of the case"}
    )
    values: tuple[Value, ...] | None = Field(
        default=None, description="equally probable values, also whole numbers, in place of a range or distribution"
    )
    posterior: Path | None = Field(
        default=None,
        description="calibration.json of `fsm calibrate`, or crease.h5 beside it: value, standard error and correlations of "
        "calibrated parameters, in place of a range or distribution",
    )
    quantity: str | None = Field(
        default=None,
        description="name of the quantity in the file of `posterior`",
        json_schema_extra={"default": "`path`, or the only quantity whose name ends with it"},
    )
    unit: str = Field(default="", description="SI unit of a parameter of a function; that of a case is known")

    @model_validator(mode="after")
    def _complete(self) -> Self:
        given = [key for key in _NUMBERS if getattr(self, key) is not None]
        others = [key for key in ("values", "posterior") if getattr(self, key) is not None]
        if others:
            wrong = [*others[1:], *given, *(["distribution"] if self.distribution else [])]
            if wrong:
                raise ValueError(f"{self.path}: `{others[0]}` is the whole scatter; remove {', '.join(wrong)}")
            if self.values is not None and len(self.values) < 2:
                raise ValueError(f"{self.path}: values needs at least two values")
            return self
        kind = self.distribution or "uniform"
        missing = [key for key in NEEDED[kind] if key not in given]
        if missing:
            what = f'distribution = "{kind}"' if self.distribution else "a parameter without a distribution"
            also = "" if self.distribution else ", or a distribution, or posterior, or values"
            raise ValueError(f"{self.path}: {what} needs {' and '.join(missing)}{also}")
        unused = [key for key in given if key not in (*NEEDED[kind], *OPTIONAL[kind])]
        if unused:
            raise ValueError(f'{self.path}: "{kind}" does not use {", ".join(unused)}; remove it')
        return self


class StudyCorrelation(Model):
    """Correlation of two parameters."""

    between: tuple[str, str] = Field(description="paths of the two parameters")
    value: Annotated[Number, Field(gt=-1, lt=1)] = Field(
        description="correlation of their normal scores (Gaussian copula); of two normal numbers the usual correlation"
    )


class StudyResponse(Model):
    """A number of each run."""

    name: str | None = Field(
        default=None,
        description="number of the summary, with the name in summary.csv without its unit: `peak_force`; for a function the "
        "key of its result",
        json_schema_extra={"default": "needed, or `channel`"},
    )
    channel: str | None = Field(default=None, description="name of an output channel, whose extreme is the response")
    of: Literal["max", "min"] = Field(default="max", description="which extreme of the channel")
    unit: str = Field(default="", description="SI unit of a result of a function; that of a summary or channel is known")

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.name is None) == (self.channel is None):
            raise ValueError("a response has either a name (of the summary) or a channel; give one of them")
        return self

    @property
    def key(self) -> str:
        """Name in tables and figures."""
        return self.name if self.name is not None else f"{self.of} of {self.channel}"


class StudyFile(Model):
    """Content of a study file."""

    title: str = Field(default="", description="title of the page")
    case: Path | None = Field(
        default=None,
        description="case file, relative to this file",
        json_schema_extra={"default": "needed, or `function`"},
    )
    function: str | None = Field(
        default=None,
        description='Python function in place of a case, `"model.py:peak"`: it gets the parameters by name and returns a '
        "number or a dict of numbers; the file is executed",
    )
    set: tuple[str, ...] = Field(default=(), description="changes of the case, as for `--set`: `strip.panels=8`")
    seed: Annotated[Count, Field(ge=0, lt=2**63)] = Field(default=0, description="seed of all random numbers")
    level: Annotated[Number, Field(ge=0.5, le=0.9999)] = Field(
        default=0.95, description="level of confidence intervals, and part of the runs inside the bands"
    )
    design: StudyDesign = Field(default=StudyDesign(), description="which runs are made")
    parameter: tuple[StudyParameter, ...] = Field(description="varied parameters, at least one")
    correlation: tuple[StudyCorrelation, ...] = Field(default=(), description="correlated parameters")
    response: tuple[StudyResponse, ...] = Field(
        default=(StudyResponse(name="peak_force"),),
        description="numbers that are recorded of each run",
        json_schema_extra={"default": "`peak_force`"},
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.case is None) == (self.function is None):
            raise ValueError("a study has either a case or a function; give one of them")
        if not self.parameter or not self.response:
            raise ValueError(f"a study needs a [[{'response' if self.parameter else 'parameter'}]]; add one")
        paths = [one.path for one in self.parameter]
        for names, what in ((paths, "parameter"), ([one.key for one in self.response], "response")):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise ValueError(f"{what} {twice[0]} is given twice; remove one")
        for pair in self.correlation:
            unknown = [path for path in pair.between if path not in paths]
            if unknown:
                raise ValueError(
                    f"correlation names {unknown[0]}, which is no [[parameter]]; the parameters are {', '.join(paths)}"
                )
            if pair.between[0] == pair.between[1]:
                raise ValueError(f"correlation of {pair.between[0]} with itself; name two parameters")
        if self.function is not None and any(one.channel for one in self.response):
            raise ValueError("a function has no channels; give its responses by name")
        return self


class OptimiseVariable(Model):
    """A number of the case that the optimisation varies."""

    path: str = Field(description="dotted path of a number of the case, as for `--set`")
    low: Value = Field(description="lower bound")
    high: Value = Field(description="upper bound")
    start: Value | None = Field(
        default=None,
        description="first value",
        json_schema_extra={"default": "value of the case, if it is between the bounds; else their mean"},
    )


class Objective(StudyResponse):
    """The response that the optimisation changes."""

    goal: Literal["minimise", "maximise"] = Field(default="minimise", description="direction of the optimisation")


class Constraint(StudyResponse):
    """Bounds of a response; equal bounds prescribe its value."""

    low: Value | None = Field(default=None, description="lower bound", json_schema_extra={"default": "none"})
    high: Value | None = Field(default=None, description="upper bound", json_schema_extra={"default": "none"})
    value: Value | None = Field(default=None, description="prescribed value, in place of bounds")

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        if self.value is not None and (self.low is not None or self.high is not None):
            raise ValueError(f"{self.key}: a constraint has a value or bounds, not both; remove one")
        if self.value is None and self.low is None and self.high is None:
            raise ValueError(f"{self.key}: a constraint needs low, high or value")
        return self


class OptimiseFile(Model):
    """Content of an optimisation file."""

    title: str = Field(default="", description="title of the figure")
    case: Path | None = Field(
        default=None,
        description="case file, relative to this file",
        json_schema_extra={"default": "needed, or `function`"},
    )
    function: str | None = Field(default=None, description="Python function in place of a case, as in a study")
    set: tuple[str, ...] = Field(default=(), description="changes of the case, as for `--set`")
    runs: Annotated[Count, Field(ge=3, le=10_000)] = Field(default=40, description="largest number of runs")
    tolerance: Annotated[Number, Field(gt=0, lt=0.1)] = Field(
        default=1e-3, description="relative accuracy of variables and constraints"
    )
    variable: tuple[OptimiseVariable, ...] = Field(description="varied numbers, at least one")
    objective: Objective = Field(description="response that is minimised or maximised")
    constraint: tuple[Constraint, ...] = Field(default=(), description="bounds of other responses")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.case is None) == (self.function is None):
            raise ValueError("an optimisation has either a case or a function; give one of them")
        if not self.variable:
            raise ValueError("an optimisation needs a [[variable]]; add one")
        paths = [one.path for one in self.variable]
        twice = sorted({path for path in paths if paths.count(path) > 1})
        if twice:
            raise ValueError(f"variable {twice[0]} is given twice; remove one")
        return self
