"""Steps of a run: each begins where the last one ended, on the same model."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fsm.scene.loads import Drive, Load
from fsm.scene.model import Model, Name
from fsm.scene.solve import Save, Solve
from fsm.scene.units import Count, Time

__all__ = ["Kind", "Step"]

Kind = Literal["static", "dynamic", "modes", "relax"]


class Step(Model):
    """One step of a run.

    Attributes
    ----------
    name : str
        Absent: "step 1", "step 2", and so on.
    kind : str
        "static": a path of equilibria; "dynamic": motion with inertia; "relax": the stable equilibrium near the state, in no
        time; "modes": natural frequencies and shapes about the state.
    duration : s
        Absent: until the drives and loads that begin here have ended. A static step without such an end lasts 1 s.
    drive, load : drives and loads that begin with this step
        A drive with the target of an earlier drive continues from its end position; a load with the name of an earlier one
        replaces it.
    hold : names
        Bodies that do not move from this step on; "panel 2" for all segments of a panel, "all" for all bodies.
    release : names
        Bodies, drives and loads that are released; "all" for all of them. A released load decreases to zero over a
        static step.
    contact : bool
        Whether contacts act in this step.
    modes : int
        Number of natural modes.
    solve, save : sections as in the case, for this step only
    """

    name: Name | None = None
    kind: Kind
    duration: Annotated[Time, Field(gt=0)] | None = None
    drive: tuple[Drive, ...] = ()
    load: tuple[Load, ...] = ()
    hold: tuple[Name, ...] = ()
    release: tuple[Name, ...] = ()
    contact: bool = True
    modes: Annotated[Count, Field(ge=1, le=500)] = 10
    solve: Solve | None = None
    save: Save | None = None
