"""File of `fsm optimise`: variables of a case with bounds, the objective, and constraints."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.models.study import StudyResponse, Value
from fsm.case.schema.model import Model
from fsm.case.schema.units import Count, Number


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
