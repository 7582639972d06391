"""Settings of the solver and of records."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Model, Name
from fsm.case.schema.units import Count, Force, Length, Number, Time

Method = Literal[
    "auto", "static", "arc-length", "generalized-alpha", "mean-force", "newmark", "explicit", "Radau-blocks", "Radau",
    "BDF", "LSODA",
]  # fmt: skip


class Solve(Model):
    """Settings of the solver."""

    method: Method = Field(
        default="auto",
        description='"auto" selects the method; "static": sequence of stable equilibria; "arc-length": whole equilibrium '
        'path with force control; "generalized-alpha", "mean-force", "newmark", "Radau-blocks": dynamics; '
        '"explicit": dynamics of mechanisms without stiff springs; "Radau", "BDF", "LSODA": references of SciPy',
    )
    rtol: Number = Field(
        default=1e-6, ge=1e-12, le=1e-2,
        description='relative tolerance; absolute tolerances follow from it and the sizes of the scene. "static": '
        "predictor tolerance sqrt(rtol) times the size of the structure (rotations: rad)",
        json_schema_extra={"default": "1e-6; 1e-9 with ideal joints"},
    )
    end_time: Annotated[Time, Field(gt=0)] | None = Field(
        default=None,
        description="required without a drive. A drive takes (`travel` + `run_up`)/`speed`, 1 % more than travel over "
        "speed by default; a shorter end time stops it before its end, with a warning",
        json_schema_extra={"default": "end of the travel"},
    )
    max_step: Annotated[Time, Field(gt=0)] | None = Field(
        default=None,
        description='largest step size; "arc-length": largest change of the program time in a step, 2 % of the step at most',
        json_schema_extra={"default": "none"},
    )
    max_steps: Count = Field(
        default=200_000, ge=1,
        description="number of steps after which the run stops (exit code 3); steps of the motion after a snap count",
    )
    spatial: bool = Field(
        default=False, description="6 degrees of freedom for each body, also if all bodies move in the plane y = 0"
    )
    energy_abort: Number = Field(
        default=0.05, gt=0,
        description="bound of the energy drift, the energy balance residual with numerical dissipation, over the reference "
        "energy ([glossary](glossary.md)). Above it "
        "the run stops (exit code 5), but not in the first tenth of the step. In dynamics a residual below 0.5 stops the "
        "run only if it persists until twice the time at which it began, or to the end. Times count from the start of the "
        "step",
    )
    increment: Annotated[Length, Field(gt=0)] | None = Field(
        default=None,
        description='"static" and "auto" only: first increment of the travel',
        json_schema_extra={"default": "a 200th of the travel"},
    )
    imperfection: Number = Field(
        default=0.0, ge=-1, le=1,
        description='"static" and "auto" only: branch followed after a bifurcation. > 0: along the critical mode (the '
        "first of its largest components is positive); < 0: against it; 0: branch of lower energy",
    )
    force_limit: Annotated[Force, Field(gt=0)] | None = Field(
        default=None,
        description='"static", also if "auto" selects it, without [[step]]: magnitude of the force of the first drive at '
        "which the run ends, with a warning that states the travel; the last state is saved. The force in the motion after "
        "a snap counts too; without damping a snap is a jump, which may end above the limit. For structures that are "
        "pressed until they lock",
    )
    branch: Literal[-1, 1] | None = Field(
        default=None,
        description='"arc-length" only: at its first bifurcation the path takes the branch along the critical mode (1: '
        "the first of its largest components is positive) or against it (-1); absent: the path stays on the primary branch",
    )
    rho_inf: Annotated[Number, Field(ge=0, le=1)] | None = Field(
        default=None,
        description='"generalized-alpha" only: spectral radius at infinite frequency (1: no numerical damping; 0: most)',
        json_schema_extra={"default": "0.6"},
    )
    step: Annotated[Time, Field(gt=0)] | None = Field(
        default=None,
        description='"generalized-alpha", "mean-force" and "newmark": fixed step size, shortened at saved times',
        json_schema_extra={"default": "error control"},
    )
    error_estimates: Literal["auto", "all", "off"] = Field(
        default="auto",
        description="further runs of the case that show the errors due to cells of facets and to steps in time "
        '([Errors](errors.md)). "auto": if the run is short and no static path with friction or snaps, and in motions of a '
        '`[scene]` with impacts; "all": always; "off": never. One setting for the whole case',
    )


class SavedPoint(Model):
    """Point of a rigid body or of a frame: `at` in body axes from the centre of mass, m."""

    body: Name = Field(description="body or frame with the point", json_schema_extra={"range": "name of a body or a frame"})
    at: tuple[Length, Length, Length] = Field(
        default=(0.0, 0.0, 0.0), description="place in the axes of the body, from its centre of mass"
    )


class Save(Model):
    """Spacing of records: `every` in travel of the first drive, or `interval` in time; by default 200 intervals."""

    every: Annotated[Length, Field(gt=0)] | None = Field(
        default=None, description="distance between records in travel of the first drive"
    )
    interval: Annotated[Time, Field(gt=0)] | None = Field(
        default=None, description="time between records; give `every` or `interval`"
    )
    channels: tuple[Annotated[str, Field(min_length=1, max_length=200)], ...] = Field(
        default=(), description="patterns of the channels to record: `*` is any text, `?` any letter"
    )
    points: dict[str, SavedPoint] = Field(
        default_factory=dict,
        description='points of bodies for the channels `point.<name>...`: `points = { tip = { body = "arm", at = [0.1, 0, '
        "0] } }`",
        json_schema_extra={"range": "sections by name"},
    )

    @model_validator(mode="after")
    def _one(self) -> Self:
        if self.every is not None and self.interval is not None:
            raise ValueError("give `every` (travel) or `interval` (time), not both")
        return self
