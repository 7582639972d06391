"""Faults of steps whose method does not have all parts of the scene."""

from __future__ import annotations

from collections.abc import Iterator

from fsm.case.models.scene import Scene
from fsm.case.plan.method_selection import WITH_JOINTS, beyond_explicit
from fsm.errors import Fault
from fsm.model.plan.planned import Plan

_WITH_EVENTS = "explicit", "generalized-alpha", "newmark", "mean-force"
"""Methods whose steps end at events."""


def method_faults(plan: Plan, scene: Scene) -> Iterator[Fault]:
    """Faults of all steps of a plan."""
    yield from _beyond_explicit(plan, scene)
    if scene.actions and not any(step.kind == "dynamic" and step.method in _WITH_EVENTS for step in plan.steps):
        methods = ", ".join(dict.fromkeys(f'"{step.method}"' for step in plan.steps))
        text = f"events happen in motions only, with {', '.join(_WITH_EVENTS)}; the steps of this case are {methods}"
        yield Fault("event", f"{text}; remove [[event]], or add a dynamic step")
    if scene.joints:
        yield from _unjointed(plan, tuple(name for name in WITH_JOINTS if name != "explicit" or not scene.flexible))


def _beyond_explicit(plan: Plan, scene: Scene) -> Iterator[Fault]:
    """Faults of explicit steps of a scene with parts that they do not have."""
    found = beyond_explicit(scene)
    for number, step in enumerate(plan.steps):
        if step.method == "explicit" and found:
            text = f'"explicit" is for bodies, joints and springs; the scene has {found}; use "auto"'
            yield Fault(f"step.{number}.solve.method" if plan.written else "solve.method", text)


def _unjointed(plan: Plan, methods: tuple[str, ...]) -> Iterator[Fault]:
    """Faults of steps whose method has no ideal joints; `methods` have them."""
    for number, step in enumerate(step for step in plan.steps if step.name != "start" or step.kind != "relax"):
        if step.kind in ("static", "dynamic") and step.method not in WITH_JOINTS and not step.still:
            text = f'"{step.method}" has no ideal joints, `[[scene.joints]]`; other methods have them: '
            yield Fault(f"step.{number}" if plan.written else "solve.method", text + ", ".join(methods))
