"""Data for the report of `fsm check`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.case.derived.contact_points import ContactSide, contact_sides
from fsm.case.derived.planar import out_of_plane
from fsm.case.models.case import Case
from fsm.case.models.loads import Drive
from fsm.case.models.scene import GROUND, Body, ContactPair, ForceElement, Scene
from fsm.model.bodies.drive import PrescribedMotion, program_of, unit
from fsm.model.plan.planned import Plan, PlannedStep, save_times


@dataclass(frozen=True)
class CheckContext:
    """Case and scene with the steps of the run, and values derived from them."""

    case: Case
    scene: Scene
    plan: Plan

    @cached_property
    def reasons(self) -> list[str]:
        """Reasons why the scene is not planar."""
        return out_of_plane(self.scene)

    @property
    def spatial(self) -> bool:
        """Whether the case is solved in space."""
        return self.case.solve.spatial or bool(self.reasons)

    @cached_property
    def records(self) -> int:
        """Number of records of the run."""
        return sum(self._records(step) for step in self.plan.steps)

    def _records(self, step: PlannedStep) -> int:
        """Number of records of a step; a step does not repeat the record at the end of the previous step."""
        if step.end == step.start:
            return int(step.kind == "relax" and step is not self.plan.steps[0])
        acting = next((program for program, acts in zip(self.plan.programs, step.acting, strict=True) if acts), None)
        return len(save_times(step.save, acting, step.end, step.start)) - int(step.start > 0.0)

    @cached_property
    def bodies(self) -> dict[str, Body]:
        """Bodies by name."""
        return {body.name: body for body in self.scene.bodies}

    @cached_property
    def free(self) -> list[Body]:
        """Bodies that are neither held nor driven."""
        driven = {name for drive in self.scene.drives for name in drive.moved}
        return [body for body in self.scene.bodies if not body.held and body.name not in driven]

    @cached_property
    def elements(self) -> list[ForceElement]:
        """Elements with stiffness or damping."""
        return [
            e
            for e in self.scene.elements
            if e.crease is not None
            or any((*e.translation, *e.rotation, *e.translation_damping, *e.rotation_damping))
        ]

    @cached_property
    def sides(self) -> dict[str, ContactSide]:
        """Sides of contact pairs by name."""
        return contact_sides(self.scene)

    @cached_property
    def pairs(self) -> list[ContactPair]:
        """Contact pairs with at least one moving side."""
        if self.scene.contact is None:
            return []
        return [
            pair
            for pair in self.scene.pairs
            if "film" in (self.sides[pair.first].kind, self.sides[pair.second].kind)
            or not all(
                name == GROUND or self.bodies[name].held
                for end in (pair.first, pair.second)
                for name in self.sides[end].bodies
            )
        ]

    @property
    def segment(self) -> float:
        """Median length of the moving plates, m; 0 if there are none."""
        lengths = [body.plate.length for body in self.free if body.plate is not None]
        return float(np.median(lengths)) if lengths else 0.0

    @property
    def method(self) -> str:
        """Method of the last step with a path or a motion."""
        return self.solved[-1].method if self.solved else self.plan.steps[-1].method

    @cached_property
    def solved(self) -> list[PlannedStep]:
        """Steps with a path or a motion."""
        return [step for step in self.plan.steps if step.solved]

    @cached_property
    def motions(self) -> list[PrescribedMotion]:
        """Motions of the drives."""
        return [_motion(number, drive) for number, drive in enumerate(self.scene.drives)]

    @property
    def end(self) -> float:
        """End time of the solve, s."""
        return self.plan.steps[-1].end


def _motion(number: int, drive: Drive) -> PrescribedMotion:
    return PrescribedMotion(np.array([number]), unit(drive.direction), program_of(drive, f"drive.{number}"))
