"""Warnings on loads and drives of a plan that have no effect, do not reach their end, or stretch a sheet.

Faults of steps whose method does not have all parts of the scene.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.case.plan.method_selection import REFERENCES, WITH_JOINTS, beyond_explicit
from fsm.case.plan.step_items import loads_of
from fsm.errors import Fault
from fsm.model.bodies.drive import program_of
from fsm.model.plan.planned import Plan
from fsm.text.shown_units import shown

_SHORT = 1e-6
"""Fraction of a travel that may be missing when the travel counts as complete."""


def plan_warnings(case: Case, scene: Scene, plan: Plan | None) -> list[str]:
    """Warnings on loads without effect, drives that `solve.end_time` stops, and drives that stretch a sheet.

    `plan` is that of a case with `[[step]]`.
    """
    return [*_loads_on_held(case, scene, plan), *_stopped_drives(case, scene), *_stretched_sheets(case)]


def _stretched_sheets(case: Case) -> Iterator[str]:
    """Warning for each drive that pulls a folded sheet beyond its full length."""
    if case.sheet is None:
        return
    from fsm.builders.sheet.reach import taut_travels  # this import loads all patterns

    for drive, travel in taut_travels(case):
        if drive.size > travel:
            yield (
                f"drive {drive.called!r}: the sheet is taut from {shown(travel, 'm')} of travel on, and the rest of the "
                f"{shown(drive.size, 'm')} stretches its facets; give a shorter travel"
            )


def _loads_on_held(case: Case, scene: Scene, plan: Plan | None) -> Iterator[str]:
    """Warning for each load on a body that is held whenever the load acts."""
    frames = {frame.name for frame in scene.frames}  # their parts carry them
    if plan is None:
        held = frozenset(body.name for body in scene.bodies if body.held) - frames
        acting = [(load, held) for _, load in loads_of(case)]
    else:
        acting = [(load, step.held - frames) for step in plan.steps for load in step.loads]
    moving = {load.called for load, held in acting if load.body not in held}
    for name, body in {load.called: load.body for load, _ in acting if load.called not in moving}.items():
        hint = "; strip.held lists the held panels" if case.strip is not None else ""
        yield f"load {name!r} has no effect: body {body!r} is held and does not move{hint}"


def _stopped_drives(case: Case, scene: Scene) -> list[str]:
    """Warning for each drive that `solve.end_time` stops before the end of its travel."""
    end, lines = case.solve.end_time, list[str]()
    if end is None or case.step:
        return lines
    for number, drive in enumerate(scene.drives):
        program = program_of(drive, f"drive.{number}")
        if program.gone(end) >= program.travel * (1.0 - _SHORT):
            continue
        scale, unit = (1e3, "mm") if drive.turn is None else (180.0 / math.pi, "deg")
        gone, travel = scale * program.gone(end), scale * program.travel
        lines.append(
            f"drive {drive.called!r} stops at {gone:.4g} of {travel:.4g} {unit}: solve.end_time = {end:.6g} s is less than "
            f"the duration of the drive with its run-up, {program.end_time:.6g} s; remove solve.end_time, or give this time"
        )
    return lines


_WITH_EVENTS = "explicit", "generalized-alpha", "newmark", "mean-force"
"""Methods whose steps end at events."""


def method_faults(plan: Plan, scene: Scene) -> Iterator[Fault]:
    """Faults of all steps of a plan."""
    yield from _beyond_method(plan, scene)
    if scene.built.actions and not any(step.kind == "dynamic" and step.method in _WITH_EVENTS for step in plan.steps):
        methods = ", ".join(dict.fromkeys(f'"{step.method}"' for step in plan.steps))
        text = f"events happen in motions only, with {', '.join(_WITH_EVENTS)}; the steps of this case are {methods}"
        yield Fault("event", f"{text}; remove [[event]], or add a dynamic step")
    if scene.joints:
        of_nodes = tuple(name for name in WITH_JOINTS if name != "explicit")
        yield from _unjointed(plan, of_nodes if scene.flexible else (*WITH_JOINTS, *REFERENCES))


def _beyond_method(plan: Plan, scene: Scene) -> Iterator[Fault]:
    """Faults of explicit steps, and with ideal joints of SciPy's methods, of a scene with parts that they do not have."""
    found, events = beyond_explicit(scene), any(joint.stop or joint.latch for joint in scene.joints)
    of_references = found or ("stops or latches of joints, at which their steps do not end" if events else "")
    for number, step in enumerate(plan.steps):
        reference = step.method in REFERENCES and scene.joints
        parts = found if step.method == "explicit" else of_references if reference else ""
        if parts:
            text = f'"{step.method}" is for bodies, joints and springs; the scene has {parts}; use "auto"'
            yield Fault(f"step.{number}.solve.method" if plan.written else "solve.method", text)


def _unjointed(plan: Plan, methods: tuple[str, ...]) -> Iterator[Fault]:
    """Faults of steps whose method has no ideal joints; `methods` have them."""
    for number, step in enumerate(step for step in plan.steps if step.name != "start" or step.kind != "relax"):
        if step.kind in ("static", "dynamic") and step.method not in (*WITH_JOINTS, *REFERENCES) and not step.still:
            text = f'"{step.method}" has no ideal joints, `[[scene.joints]]`; other methods have them: '
            yield Fault(f"step.{number}" if plan.written else "solve.method", text + ", ".join(methods))
