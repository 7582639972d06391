"""Steps of a run: each begins where the last one ended, on the same model."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fsm.case.models.loads import Drive, Load
from fsm.case.models.solve import Save, Solve
from fsm.case.schema.model import Model, Name
from fsm.case.schema.units import Count, Time

Kind = Literal["static", "dynamic", "modes", "relax"]


class Step(Model):
    """One step of a run."""

    name: Name | None = Field(
        default=None,
        description="name of the step in results, and for the key `step` of drives and loads",
        json_schema_extra={"default": '"step 1", "step 2", ...', "range": "all different"},
    )
    kind: Kind = Field(
        description='"static": path of equilibria; "dynamic": motion with inertia; "relax": change to the equilibrium near '
        'by; "modes": natural frequencies',
    )
    duration: Annotated[Time, Field(gt=0)] | None = Field(
        default=None,
        description='duration of the step; needed by "dynamic" without a drive',
        json_schema_extra={
            "default": 'until all drives and loads that begin in this step have ended; "static" without such drives and '
            "loads: 1 s",
        },
    )
    drive: tuple[Drive, ...] = Field(
        default=(), description="drives that begin with this step, `[[step.drive]]`, as `[[drive]]`"
    )
    load: tuple[Load, ...] = Field(default=(), description="loads that begin with this step, `[[step.load]]`, as `[[load]]`")
    hold: tuple[Name, ...] = Field(
        default=(),
        description='bodies that do not move from this step on: bodies, surfaces, "panel 2", or "all"',
        json_schema_extra={"range": "names of bodies"},
    )
    release: tuple[Name, ...] = Field(
        default=(),
        description='held bodies, drives and loads that end with the start of this step; "all": all drives, loads and '
        "`hold`. A released load decreases to zero over a static step",
        json_schema_extra={"range": "names of held bodies, drives and loads"},
    )
    contact: bool = Field(default=True, description="false: no contact and no friction in this step")
    modes: Count = Field(default=10, ge=1, le=500, description='"modes": number of natural modes')
    solve: Solve | None = Field(
        default=None,
        description="`[step.solve]`, settings for this step",
        json_schema_extra={"default": "as in the case", "range": "without `end_time`, `spatial`"},
    )
    save: Save | None = Field(
        default=None,
        description="`[step.save]`, spacing of records in this step",
        json_schema_extra={"default": "as in the case"},
    )
