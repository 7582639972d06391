"""System of a step, with its free, driven and held bodies, its loads, and the active elements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fsm.case.models.loads import Drive
from fsm.case.models.scene import Scene
from fsm.model.bodies.drive import Axis, PrescribedMotion, unit
from fsm.model.bodies.group import Group
from fsm.model.bodies.loads import LoadGroup, applied
from fsm.model.bodies.turns import turned_pose
from fsm.model.contact.contacts import ContactGroup
from fsm.model.elements.elements import BushingGroup
from fsm.model.plan.planned import Plan
from fsm.model.system.merge import merged
from fsm.model.system.system import SegmentSystem


def whole_system(system: SegmentSystem, scene: Scene, plan: Plan) -> SegmentSystem:
    """System of all bodies that are free in any step, with the motions of all drives over the whole run."""
    bodies = system.bodies
    always = [all(step.acting[k] for step in plan.steps) for k in range(len(scene.drives))]
    motions = _motions(system, scene, plan, tuple(always), bodies.pose)
    groups = tuple(group for group in system.groups if not isinstance(group, LoadGroup))
    found = system.variant(bodies, motions, groups)
    found.steps_of, found.in_python = system.steps_of, system.in_python
    return found


def system_in_step(
    whole: SegmentSystem, scene: Scene, plan: Plan, number: int, states: dict[str, np.ndarray] | None
) -> SegmentSystem:
    """System of a step.

    Parameters
    ----------
    whole : SegmentSystem
        System of the whole run; its groups are shared, and keep their memory.
    scene, plan : Scene, Plan
    number : number of the step, from 0
    states : states of all bodies at the end of the step before; None for the first step
    """
    step, bodies = plan.steps[number], whole.bodies
    pose = (bodies.pose if states is None else states["poses"]).copy()
    motions = _motions(whole, scene, plan, step.acting, pose)
    driven = np.zeros(len(bodies.names), dtype=bool)
    for motion in motions:
        driven[motion.bodies] = True
        _rewind(pose, motion, motion.at(step.start)[0])
    held = {"ground", *step.held, *(frame.name for frame in scene.frames)}
    free = [i for i, name in enumerate(bodies.names) if name not in held and not driven[i]]
    moved = replace(bodies, pose=pose, free=np.array(free, dtype=np.int64))
    groups, latched = _groups(whole, plan, number, states)
    system = whole.variant(moved, motions, groups, tuple(load for load in step.loads if load.pressure is not None))
    system.in_python = step.in_python
    system.latched, system.spread = latched, whole.spread  # all steps have the scales of the initial state of the run
    if states is not None:
        if _switched(whole, plan, number) == _switched(whole, plan, number - 1):
            system.restore(states["memory"])
        elif plan.steps[number].contact and not plan.steps[number - 1].contact:
            system.contacts.restore(np.zeros(0))
    return system


def _switched(whole: SegmentSystem, plan: Plan, number: int) -> list[bool]:
    """Whether each group that does not act in all steps acts in this step."""
    step = plan.steps[number]
    return [step.contact, *(plan.name_for_joints(number) in steps.names for _, steps in whole.steps_of)]


def _motions(
    system: SegmentSystem, scene: Scene, plan: Plan, acting: tuple[bool, ...], pose: np.ndarray
) -> tuple[PrescribedMotion, ...]:
    """Motions of all drives; inactive drives have no bodies."""
    index = {name: i for i, name in enumerate(system.bodies.names)}
    found = []
    for drive, acts, program in zip(scene.drives, acting, plan.programs, strict=True):
        bodies = np.array([index[name] for name in drive.moved], dtype=np.int64)
        direction, axis = _line(drive, system.spatial, pose[bodies[0]])
        found.append(PrescribedMotion(bodies if acts else bodies[:0], direction, program, axis))
    return tuple(found)


def _line(drive: Drive, spatial: bool, pose: np.ndarray) -> tuple[np.ndarray, Axis | None]:
    direction = np.array(drive.direction)[[0, 1, 2] if spatial else [0, 2]]
    if drive.turn is None:
        return direction / np.linalg.norm(direction), None
    here = pose[:3] if spatial else np.array([pose[0], 0.0, pose[1]])
    return 0.0 * direction, Axis(unit(drive.axis), here.copy() if drive.point is None else np.array(drive.point))


def _rewind(pose: np.ndarray, motion: PrescribedMotion, travel: float) -> None:
    """Move driven bodies back by a travel, so that the motion by this travel ends at their present positions."""
    for body in motion.bodies.tolist():
        if motion.axis is not None:
            pose[body] = turned_pose(pose[body], motion.axis, -travel)
        else:
            pose[body, : len(motion.direction)] -= travel * motion.direction


def _groups(
    whole: SegmentSystem, plan: Plan, number: int, states: dict[str, np.ndarray] | None
) -> tuple[tuple[Group, ...], dict[str, np.ndarray]]:
    """Groups that act in a step, with its loads, and the deformations at which latches have closed."""
    name = plan.name_for_joints(number)
    groups, latched = list(whole.groups), {}
    if not plan.steps[number].contact:
        groups = [group for group in groups if not isinstance(group, ContactGroup)]
    for k, (group, steps) in enumerate(whole.steps_of):
        place = next(i for i, one in enumerate(groups) if one is group)
        if name not in steps.names:
            del groups[place]
            continue
        if steps.latch and isinstance(group, BushingGroup):
            known = {"poses": whole.bodies.pose, "rates": whole.bodies.rate} if states is None else states
            rest = known.get(f"latch {k}")
            if rest is None:
                rest = np.asarray(group.measure(known["poses"], known["rates"], group.bodies, *group.geometry)[0])
            latched[f"latch {k}"] = rest
            plain = np.zeros(group.locked.shape, dtype=bool)  # these are springs about the position in which they latch
            groups[place] = replace(group, rest=np.ascontiguousarray(rest), locked=plain)
    index = {body: i for i, body in enumerate(whole.bodies.names)}
    on_bodies = (load for load in plan.steps[number].loads if load.pressure is None)
    loads = tuple(applied(load, index[load.target], whole.spatial) for load in on_bodies)
    return merged([*groups, LoadGroup(loads)] if loads else groups), latched
