"""Settings of the solver and of records.

Steps of a run: each begins where the last one ended, on the same model.
"""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.models.loads import Drive, Load
from fsm.case.schema.model import Key, Model, Name
from fsm.case.schema.units import Count, Force, Length, Number, Time

Method = Literal[
    "auto", "static", "arc-length", "generalized-alpha", "mean-force", "newmark", "explicit", "Radau-blocks", "Radau",
    "BDF", "LSODA",
]  # fmt: skip


MOST_RECORDS = 1_000_000
"""Largest number of records of a run."""


class Solve(Model):
    """Settings of the solver."""

    method: Method = Key(
        '"auto" selects the method; "static": sequence of stable equilibria; "arc-length": whole equilibrium '
        'path with force control; "generalized-alpha", "mean-force", "newmark", "Radau-blocks": dynamics; '
        '"explicit": dynamics of mechanisms without stiff springs; "Radau", "BDF", "LSODA": references of SciPy',
        default="auto",
    )  # fmt: skip
    rtol: Number = Key(
        'relative tolerance; absolute tolerances follow from it and the sizes of the scene. "static": '
        "predictor tolerance sqrt(rtol) times the size of the structure (rotations: rad)", default=1e-6, ge=1e-12, le=1e-2,
        shown="1e-6; 1e-9 with ideal joints",
    )  # fmt: skip
    end_time: Annotated[Time, Field(gt=0)] | None = Key(
        "required without a drive. A drive takes (`travel` + `run_up`)/`speed`, 1 % more than travel over "
        "speed by default; a shorter end time stops it before its end, with a warning", default=None,
        shown="end of the travel",
    )  # fmt: skip
    max_step: Annotated[Time, Field(gt=0)] | None = Key(
        'largest step size; "arc-length": largest change of the program time in a step, 2 % of the step at most',
        default=None, shown="none"
    )  # fmt: skip
    max_steps: Count = Key(
        "number of steps after which the run stops (exit code 3); steps of the motion after a snap count", default=200_000,
        ge=1
    )  # fmt: skip
    spatial: bool = Key("6 degrees of freedom for each body, also if all bodies move in the plane y = 0", default=False)
    energy_abort: Number = Key(
        "bound of the energy drift, the energy balance residual with numerical dissipation, over the reference "
        "energy ([glossary](glossary.md)). Above it "
        "the run stops (exit code 5), but not in the first tenth of the step. In dynamics a residual below 0.5 stops the "
        "run only if it persists until twice the time at which it began, or to the end. Times count from the start of the "
        "step", default=0.05, gt=0,
    )  # fmt: skip
    increment: Annotated[Length, Field(gt=0)] | None = Key(
        '"static" and "auto" only: first increment of the travel', default=None, shown="a 200th of the travel"
    )
    imperfection: Number = Key(
        '"static" and "auto" only: branch followed after a bifurcation. > 0: along the critical mode (the '
        "first of its largest components is positive); < 0: against it; 0: branch of lower energy", default=0.0, ge=-1, le=1,
    )  # fmt: skip
    force_limit: Annotated[Force, Field(gt=0)] | None = Key(
        '"static", also if "auto" selects it, without [[step]]: magnitude of the force of the first drive at '
        "which the run ends, with a warning that states the travel; the last state is saved. The force in the motion after "
        "a snap counts too; without damping a snap is a jump, which may end above the limit. For structures that are "
        "pressed until they lock", default=None,
    )  # fmt: skip
    branch: Literal[-1, 1] | None = Key(
        '"arc-length" only: at its first bifurcation the path takes the branch along the critical mode (1: '
        "the first of its largest components is positive) or against it (-1); absent: the path stays on the primary branch",
        default=None,
    )  # fmt: skip
    rho_inf: Annotated[Number, Field(ge=0, le=1)] | None = Key(
        '"generalized-alpha" only: spectral radius at infinite frequency (1: no numerical damping; 0: most)', default=None,
        shown="0.6"
    )  # fmt: skip
    step: Annotated[Time, Field(gt=0)] | None = Key(
        '"generalized-alpha", "mean-force" and "newmark": fixed step size, shortened at saved times', default=None,
        shown="error control"
    )  # fmt: skip
    error_estimates: Literal["auto", "all", "off"] = Key(
        "further runs of the case that show the errors due to cells of facets, to segments of a strip whose path snaps, and "
        'to steps in time ([Errors](errors.md)). "auto": if the run is short, for steps only if it is no static path with '
        'friction or snaps, and in motions of a `[scene]` with impacts; "all": always; "off": never. One setting for the '
        "whole case, also in tables and studies", default="auto",
    )  # fmt: skip


class SavedPoint(Model):
    """Point of a rigid body or of a frame: `at` in body axes from the centre of mass, m."""

    body: Name = Key("body or frame with the point", within="name of a body or a frame")
    at: tuple[Length, Length, Length] = Key(
        "place in the axes of the body, from its centre of mass", default=(0.0, 0.0, 0.0)
    )


class Save(Model):
    """Spacing of records: `every` in travel of the first drive, `interval` in time, or the number of `intervals`."""

    every: Annotated[Length, Field(gt=0)] | None = Key("distance between records in travel of the first drive", default=None)
    interval: Annotated[Time, Field(gt=0)] | None = Key("time between records", default=None)
    intervals: Annotated[Count, Field(gt=0, le=MOST_RECORDS)] | None = Key(
        "number of equal intervals between records; give one of `every`, `interval` and `intervals`", default=None,
        shown="200, if none is given",
    )
    channels: tuple[Annotated[str, Field(min_length=1, max_length=200)], ...] = Key(
        "patterns of the channels to record: `*` is any text, `?` any letter", default=()
    )
    points: dict[str, SavedPoint] = Field(
        default_factory=dict,
        description='points of bodies for the channels `point.<name>...`: `points = { tip = { body = "arm", at = [0.1, 0, '
        "0] } }`",
        json_schema_extra={"range": "sections by name"},
    )

    @model_validator(mode="after")
    def _one(self) -> Self:
        if [self.every, self.interval, self.intervals].count(None) < 2:
            raise ValueError("give only one of `every` (travel), `interval` (time) and `intervals` (number)")
        return self

    @property
    def number(self) -> int:
        """Number of intervals where neither `every` nor `interval` is given."""
        return 200 if self.intervals is None else self.intervals


Kind = Literal["static", "dynamic", "modes", "relax"]


class Step(Model):
    """One step of a run."""

    name: Name | None = Key(
        "name of the step in results, and for the key `step` of drives and loads", default=None,
        shown='"step 1", "step 2", ...', within="all different"
    )  # fmt: skip
    kind: Kind = Key(
        '"static": path of equilibria; "dynamic": motion with inertia; "relax": change to the equilibrium near '
        'by; "modes": natural frequencies',
    )  # fmt: skip
    duration: Annotated[Time, Field(gt=0)] | None = Key(
        'duration of the step; needed by "dynamic" without a drive', default=None,
        shown='until all drives and loads that begin in this step have ended; "static" without such drives and ' "loads: 1 s"
    )  # fmt: skip
    drive: tuple[Drive, ...] = Key("drives that begin with this step, `[[step.drive]]`, as `[[drive]]`", default=())
    load: tuple[Load, ...] = Key("loads that begin with this step, `[[step.load]]`, as `[[load]]`", default=())
    hold: tuple[Name, ...] = Key(
        'bodies that do not move from this step on: bodies, surfaces, "panel 2", or "all"', default=(),
        within="names of bodies"
    )  # fmt: skip
    release: tuple[Name, ...] = Key(
        'held bodies, drives and loads that end with the start of this step; "all": all drives, loads and '
        "`hold`. A released load decreases to zero over a static step", default=(),
        within="names of held bodies, drives and loads",
    )  # fmt: skip
    contact: bool = Key("false: no contact and no friction in this step", default=True)
    modes: Count = Key('"modes": number of natural modes', default=10, ge=1, le=500)
    solve: Solve | None = Key(
        "`[step.solve]`, settings for this step", default=None, shown="as in the case",
        within="without `end_time`, `spatial`"
    )  # fmt: skip
    save: Save | None = Key("`[step.save]`, spacing of records in this step", default=None, shown="as in the case")
