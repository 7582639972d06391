"""Plan of a run: its steps, and the programs of its drives.

Times at which a run saves its states.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsm.case.models.loads import Load
from fsm.case.models.scene import Scene
from fsm.case.models.solve import Kind, Save, Solve
from fsm.case.plan.record_count import record_count
from fsm.model.bodies.drive import Travel
from fsm.model.plan.in_python import COMPILED, InPython


@dataclass(frozen=True)
class PlannedStep:
    """One step of a run.

    Attributes
    ----------
    name, kind : see `fsm.case.models.solve.Step`
    start, end : s
    method, reason : method of the solver, and the reason
    solve, save : settings of this step
    acting : for every target of a drive, whether it is driven in this step
    loads : loads with functions of the time of the whole run
    held : names of the bodies that do not move
    still : whether all bodies are held or driven
    contact : whether contacts act
    modes : int
    described : texts about changes at the start of this step, for the report of `fsm check`
    in_python : reasons why its steps are computed in Python
    """

    name: str
    kind: Kind
    start: float
    end: float
    method: str
    reason: str
    solve: Solve
    save: Save
    acting: tuple[bool, ...]
    loads: tuple[Load, ...]
    held: frozenset[str]
    still: bool = False
    contact: bool = True
    modes: int = 10
    described: tuple[str, ...] = ()
    in_python: InPython = COMPILED

    @property
    def solved(self) -> bool:
        """Whether the step has a path or a motion."""
        return self.kind in ("static", "dynamic") and not self.still


@dataclass(frozen=True)
class Plan:
    """Steps of a run, and the programs of all targets of drives over its time.

    Attributes
    ----------
    steps, programs : of the run, and of all targets
    written : whether the case has `[[step]]`, so that bodies and drives may change between steps
    """

    steps: tuple[PlannedStep, ...]
    programs: tuple[Travel, ...]
    written: bool

    @property
    def begins_in_motion(self) -> bool:
        """Whether a run without `[[step]]` has initial velocities; equilibria have none."""
        return not self.written and self.steps[-1].kind == "dynamic"

    def name_for_joints(self, number: int) -> str:
        """Name of a step (number from 0) for its joints; joints of the first step also act while the initial equilibrium is
        computed.
        """
        names = [step.name for step in self.steps]
        return names[1] if number == 0 and names[0] == "start" and len(names) > 1 else names[number]

    def fixed(self, scene: Scene) -> frozenset[str]:
        """Names of the bodies that are held or driven in any step."""
        found: set[str] = set()
        for step in self.steps:
            found |= step.held
            found.update(name for drive, acts in zip(scene.drives, step.acting, strict=True) if acts for name in drive.moved)
        return frozenset(found)


def save_times(save: Save, program: Travel | None, end: float, start: float = 0.0) -> list[float]:
    """Times (s) at which a step saves states; its first and its last time are always included.

    Parameters
    ----------
    save : Save
    program : program of the first drive that acts, if there is one
    end, start : times at which the step ends and starts, s

    Raises
    ------
    CaseError
        Too many times to store.
    """
    gone = 0.0 if program is None else program.gone(start)
    way = 0.0 if program is None else program.gone(end) - gone
    if save.every is not None and program is not None and way > 0.0:
        record_count(way, save.every, "save.every")
        first = math.floor(gone / save.every * (1.0 + 1e-12)) + 1
        last = math.floor((gone + way) / save.every * (1.0 + 1e-12))
        times = [start, *(program.time_of(k * save.every) for k in range(first, last + 1))]
    elif save.interval is not None:
        count = record_count(end - start, save.interval, "save.interval")
        times = [start + k * save.interval for k in range(count + 1)]
    elif program is not None and way > 0.0:
        times = [program.time_of(float(x)) for x in np.linspace(gone, gone + way, save.number + 1)[1:]]
    else:
        times = [float(t) for t in np.linspace(start, end, save.number + 1)]
    if program is not None:
        times = sorted({*times, *program.reversals()})
    times = [start, *(t for t in times if start < t <= end)]
    if times[-1] < end * (1 - 1e-12):
        times.append(end)
    return times
