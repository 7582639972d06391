"""File of `fsm study`: parameters of a case with their scatter, the design of the runs, and the responses.

Numbers of a parameter have the unit of its key in the case, so they are read when the case is known.

File of `fsm optimise`: variables of a case with bounds, the objective, and constraints.
"""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Key, Model
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

    kind: Design = Key(
        '"sobol": runs for Sobol indices, from a Sobol sequence (Saltelli 2010); "latin": Latin hypercube; '
        '"grid": all combinations; "one-at-a-time": each parameter alone, the others nominal; "csv": rows of `file`',
        default="sobol",
    )  # fmt: skip
    sample: Annotated[Count, Field(ge=2, le=1_048_576)] = Key(
        'size of the base sample: "latin" makes as many runs, "sobol" `sample` times (number of independent '
        "parameters + 2)", default=64, within='2 to 1048576; "sobol": a power of 2',
    )  # fmt: skip
    points: Annotated[Count, Field(ge=2, le=1000)] = Key(
        'number of values of each parameter of "grid" and "one-at-a-time", equally spaced', default=3
    )
    file: Path | None = Key(
        'CSV file of "csv": one column for each parameter, with its path as heading, and one row for each run', default=None,
        shown='needed by "csv"'
    )  # fmt: skip

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

    path: str = Key("dotted path of a number of the case, as for `--set`; for a function any name")
    low: Value | None = Key("smallest value", default=None, shown='needed by a range and by "triangular"')
    high: Value | None = Key("largest value", default=None, shown='needed by a range and by "triangular"')
    distribution: Distribution | None = Key(
        '"uniform" from `low` to `high`; "normal", "lognormal" with `mean` and `sigma`; "triangular"', default=None,
        shown='"uniform"'
    )  # fmt: skip
    mean: Value | None = Key("mean of the distribution", default=None, shown="value of the case")
    sigma: Value | None = Key(
        'standard deviation; `"5 %"` is a part of the mean', default=None, shown='needed by "normal" and "lognormal"'
    )
    mode: Value | None = Key('most probable value of "triangular"', default=None, shown="value of the case")
    values: tuple[Value, ...] | None = Key(
        "equally probable values, also whole numbers, in place of a range or distribution", default=None
    )
    posterior: Path | None = Key(
        "calibration.json of `fsm calibrate`, or crease.h5 beside it: value, standard error and correlations of "
        "calibrated parameters, in place of a range or distribution", default=None,
    )  # fmt: skip
    quantity: str | None = Key(
        "name of the quantity in the file of `posterior`", default=None,
        shown="`path`, or the only quantity whose name ends with it"
    )  # fmt: skip
    unit: str = Key("SI unit of a parameter of a function; that of a case is known", default="")

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

    between: tuple[str, str] = Key("paths of the two parameters")
    value: Annotated[Number, Field(gt=-1, lt=1)] = Key(
        "correlation of their normal scores (Gaussian copula); of two normal numbers the usual correlation"
    )


class StudyResponse(Model):
    """A number of each run."""

    name: str | None = Key(
        "number of the summary, with the name in summary.csv without its unit: `peak_force`; for a function the "
        "key of its result", default=None, shown="needed, or `channel`",
    )  # fmt: skip
    channel: str | None = Key("name of an output channel, whose extreme is the response", default=None)
    of: Literal["max", "min"] = Key("which extreme of the channel", default="max")
    unit: str = Key("SI unit of a result of a function; that of a summary or channel is known", default="")

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

    title: str = Key("title of the page", default="")
    case: Path | None = Key("case file, relative to this file", default=None, shown="needed, or `function`")
    function: str | None = Key(
        'Python function in place of a case, `"model.py:peak"`: it gets the parameters by name and returns a '
        "number or a dict of numbers; the file is executed", default=None,
    )  # fmt: skip
    set: tuple[str, ...] = Key("changes of the case, as for `--set`: `strip.panels=8`", default=())
    seed: Annotated[Count, Field(ge=0, lt=2**63)] = Key("seed of all random numbers", default=0)
    level: Annotated[Number, Field(ge=0.5, le=0.9999)] = Key(
        "level of confidence intervals, and part of the runs inside the bands", default=0.95
    )
    design: StudyDesign = Key("which runs are made", default=StudyDesign())
    parameter: tuple[StudyParameter, ...] = Key("varied parameters, at least one")
    correlation: tuple[StudyCorrelation, ...] = Key("correlated parameters", default=())
    response: tuple[StudyResponse, ...] = Key(
        "numbers that are recorded of each run", default=(StudyResponse(name="peak_force"),), shown="`peak_force`"
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

    path: str = Key("dotted path of a number of the case, as for `--set`")
    low: Value = Key("lower bound")
    high: Value = Key("upper bound")
    start: Value | None = Key(
        "first value", default=None, shown="value of the case, if it is between the bounds; else their mean"
    )


class Objective(StudyResponse):
    """The response that the optimisation changes."""

    goal: Literal["minimise", "maximise"] = Key("direction of the optimisation", default="minimise")


class Constraint(StudyResponse):
    """Bounds of a response; equal bounds prescribe its value."""

    low: Value | None = Key("lower bound", default=None, shown="none")
    high: Value | None = Key("upper bound", default=None, shown="none")
    value: Value | None = Key("prescribed value, in place of bounds", default=None)

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        if self.value is not None and (self.low is not None or self.high is not None):
            raise ValueError(f"{self.key}: a constraint has a value or bounds, not both; remove one")
        if self.value is None and self.low is None and self.high is None:
            raise ValueError(f"{self.key}: a constraint needs low, high or value")
        return self


class OptimiseFile(Model):
    """Content of an optimisation file."""

    title: str = Key("title of the figure", default="")
    case: Path | None = Key("case file, relative to this file", default=None, shown="needed, or `function`")
    function: str | None = Key("Python function in place of a case, as in a study", default=None)
    set: tuple[str, ...] = Key("changes of the case, as for `--set`", default=())
    runs: Annotated[Count, Field(ge=3, le=10_000)] = Key("largest number of runs", default=40)
    tolerance: Annotated[Number, Field(gt=0, lt=0.1)] = Key("relative accuracy of variables and constraints", default=1e-3)
    variable: tuple[OptimiseVariable, ...] = Key("varied numbers, at least one")
    objective: Objective = Key("response that is minimised or maximised")
    constraint: tuple[Constraint, ...] = Key("bounds of other responses", default=())

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
