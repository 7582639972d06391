"""Plan of a run: its steps, and the programs of its drives."""

from __future__ import annotations

from dataclasses import dataclass

from fsm.case.models.loads import Load
from fsm.case.models.scene import Scene
from fsm.case.models.solve import Save, Solve
from fsm.case.models.steps import Kind
from fsm.model.bodies.drive import Travel
from fsm.model.plan.in_python import COMPILED, InPython


@dataclass(frozen=True)
class PlannedStep:
    """One step of a run.

    Attributes
    ----------
    name, kind : see `fsm.case.models.steps.Step`
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
