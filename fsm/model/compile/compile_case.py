"""Compilation of a case to a system of equations, or to the list of its faults."""

from __future__ import annotations

import math

import numpy as np

from fsm.builders.scene import build_scene
from fsm.case.derived.contact_points import contact_sides
from fsm.case.derived.frame_bodies import frame_faults
from fsm.case.derived.planar import out_of_plane
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.case.plan.step_items import with_paths_of_steps
from fsm.errors import CaseError, Fault
from fsm.model.compile.compile import compile_scene
from fsm.model.faults.check_contacts import gas_faults
from fsm.model.faults.crease_checks import crease_faults, crease_warnings
from fsm.model.faults.overlap import find_overlaps, find_pierced
from fsm.model.faults.separate import overlaps, separate, shallowest
from fsm.model.plan.joint_state import JointsAtStart
from fsm.model.plan.plan import plan_of
from fsm.model.plan.plan_warnings import plan_warnings
from fsm.model.plan.planned import Plan
from fsm.model.system.system import SegmentSystem
from fsm.solve.settings import PathSettings
from fsm.text.shown_units import shown


def compile_case(case: Case, source: str = "", warnings: list[str] | None = None) -> tuple[Scene, SegmentSystem]:
    """Scene and system of a case; see `compile_planned`."""
    return compile_planned(case, source, warnings)[:2]


def compile_planned(
    case: Case, source: str = "", warnings: list[str] | None = None
) -> tuple[Scene, SegmentSystem, Plan | None]:
    """Build and compile a case.

    Parameters
    ----------
    case : Case
    source : str
        Name of the case file, for messages.
    warnings : list of str, optional
        Warnings are appended to this list.

    Returns
    -------
    Scene, SegmentSystem, Plan or None
        The plan of a case with `[[step]]`, else None. With `contact.resolve_overlap`, bodies that overlapped at the start
        are moved apart.

    Raises
    ------
    CaseError
        All faults of the scene; no body is free to move; bodies overlap at the start; a supply takes out more gas than its
        chamber has.
    """
    scene = build_scene(case)
    try:
        plan = plan_of(case, scene) if case.step else None
    except CaseError as error:
        raise CaseError(error.faults, source) from None
    faults = [*crease_faults(scene, case.strip is not None), *gas_faults(case, scene, plan)]
    if faults:
        raise CaseError(faults, source)
    if warnings is not None:
        warnings += crease_warnings(scene, case.strip is not None) + plan_warnings(case, scene, plan)
    try:
        system = compile_whole(case, scene, plan)
    except CaseError as error:
        raise CaseError(with_paths_of_steps(case, error.faults), source) from None
    rigid = scene.joints and not scene.flexible
    if rigid and system.nu and not case.step and plan_of(case, scene).begins_in_motion:
        joints = JointsAtStart(scene)
        opened = list(joints.velocity_faults())
        if opened:
            raise CaseError(opened, source)
        corrected = list(joints.velocity_warnings())
        if corrected:
            scene = joints.closed()
            system = compile_whole(case, scene, plan)
        if warnings is not None:
            warnings += corrected
    if not system.nu:
        where = next((name for name in ("strip", "lattice", "sheet") if getattr(case, name) is not None), "scene")
        text = "all bodies are held or driven, so the system has no degree of freedom; free at least one body"
        raise CaseError(Fault(where, text), source)
    found = _overlaps(scene, system, case)
    if found and scene.contact is not None and scene.contact.resolve_overlap:
        moved = _moved(scene, system, separate(system))
        if warnings is not None:
            warnings.append(_move_warning(scene, moved, found))
        scene, system = moved, compile_whole(case, moved, plan)
        found = _overlaps(scene, system, case)
    if found:
        raise CaseError(found, source)
    return scene, system, plan


def compile_whole(case: Case, scene: Scene, plan: Plan | None) -> SegmentSystem:
    """System in which every body is free that is free in any step, with the drives of all steps.

    Parameters
    ----------
    case : Case
    scene : Scene
        Scene with all drives and loads.
    plan : Plan, or None for a case without `[[step]]`
    """
    if plan is None:
        return _compiled(scene, case.solve.spatial)
    always = [all(step.acting[k] for step in plan.steps) for k in range(len(scene.drives))]
    driven = {name for drive, acts in zip(scene.drives, always, strict=True) if acts for name in drive.moved}
    never_free = frozenset.intersection(*(step.held | _driven(scene, step.acting) for step in plan.steps))
    held = never_free - driven
    bodies = tuple(body.model_copy(update={"held": body.name in held}) for body in scene.bodies)
    drives = tuple(drive for drive, acts in zip(scene.drives, always, strict=True) if acts)
    spatial = case.solve.spatial or bool(out_of_plane(scene))
    return _compiled(scene.model_copy(update={"bodies": bodies, "drives": drives}), spatial)


def _compiled(scene: Scene, spatial: bool) -> SegmentSystem:
    """System of a scene; the elements of films, cables and beams are imported when it has some."""
    if scene.flexible or scene.built.chambers or any(True for _ in frame_faults(scene)):
        from fsm.model.compile.compile_joined import compile_model

        return compile_model(scene, spatial)
    return compile_scene(scene, spatial)


def _driven(scene: Scene, acting: tuple[bool, ...]) -> frozenset[str]:
    """Bodies of the drives that act."""
    drives = zip(scene.drives, acting, strict=True)
    return frozenset(name for drive, acts in drives if acts for name in drive.moved)


def path_settings(case: Case, system: SegmentSystem, end: float, start: float = 0.0) -> PathSettings:
    """Settings of the equilibrium path of a case between two times (s)."""
    solve, first = case.solve, end / 200.0
    if system.motions:
        motion = system.motions[0]
        if motion.program.forward:
            first = motion.time_of(solve.increment or motion.travel / 200.0)
    return PathSettings(
        end, first, solve.max_step or math.inf, solve.rtol, solve.max_steps, solve.imperfection, solve.energy_abort,
        start, solve.force_limit or math.inf,
    )


def _overlaps(scene: Scene, system: SegmentSystem, case: Case) -> list[Fault]:
    """Faults of pairs of bodies that overlap at the start, one fault for each pair.

    Planar panels are checked by their outlines, with or without a contact pair, because outlines allow the overlap of
    layers beside a crease. All other bodies are checked by the depth of their contact.
    """
    if scene.contact is None:
        return []
    where = "strip" if case.strip else "scene"
    flat = not system.spatial or not out_of_plane(scene.model_copy(update={"obstacles": ()}))
    hint = "use a smaller fold_angle or thickness, or thickness_in_gap = false"
    faults: dict[frozenset[str], Fault] = {}
    if flat:
        for first, second, depth in find_overlaps(scene):
            if depth < shallowest(system):
                continue
            faults[frozenset((first, second))] = Fault(where, _line(first, second, depth, hint))
    else:
        for first, second in find_pierced(scene):
            text = f"{first} and {second} pass through each other at the start; move these bodies apart"
            faults[frozenset((first, second))] = Fault(where, text)
    known = contact_sides(scene)
    left = [p for p in scene.pairs if not (flat and known[p.first].kind == known[p.second].kind == "surface")]
    depths = dict(overlaps(system)) if left else {}
    for pair in left:
        depth = depths.get(f"{pair.first} - {pair.second}", 0.0)
        if depth > 0.0:
            fault = Fault(where, _line(pair.first, pair.second, depth, "move them apart, or set contact.resolve_overlap"))
            faults.setdefault(frozenset((pair.first, pair.second)), fault)
    return list(faults.values())


def _line(first: str, second: str, depth: float, hint: str) -> str:
    return f"{first} and {second} overlap at the start by {shown(depth, 'm')}; {hint}"


def _moved(scene: Scene, system: SegmentSystem, q: np.ndarray) -> Scene:
    """Scene with its free bodies at the configuration q."""
    names = [system.bodies.names[i] for i in system.bodies.free]
    rows = dict(zip(names, system.body_poses(q).tolist(), strict=True))
    bodies = []
    for body in scene.bodies:
        place = rows.get(body.name)
        if place is not None and system.spatial:
            body = body.model_copy(update={"position": tuple(place[:3]), "orientation": tuple(place[3:])})
        elif place is not None:
            x, z, phi = place
            turned = (math.cos(phi / 2), 0.0, math.sin(phi / 2), 0.0)
            body = body.model_copy(update={"position": (x, body.position[1], z), "orientation": turned})
        bodies.append(body)
    return scene.model_copy(update={"bodies": tuple(bodies)})


def _move_warning(before: Scene, after: Scene, found: list[Fault]) -> str:
    """Warning about bodies that were moved apart."""
    distances = [math.dist(one.position, two.position) for one, two in zip(before.bodies, after.bodies, strict=True)]
    farthest = int(np.argmax(distances))
    pairs = "1 pair" if len(found) == 1 else f"{len(found)} pairs"
    return (
        f"{pairs} overlapped at the start and were moved apart; the largest displacement is "
        f"{shown(distances[farthest], 'm')}, of {after.bodies[farthest].name}"
    )
