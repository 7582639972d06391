"""Scene of a deployment case."""

from __future__ import annotations

from fsm.builders.lattice import build_lattice
from fsm.builders.strip import build_strip
from fsm.case.derived.frame_bodies import frame_faults, with_frames
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.case.plan.step_items import acting_steps, drives_of, loads_of

_PASSED = {"contact", "friction", "gravity", "load"}
"""Sections that the builders of strips and of sheets of rigid facets pass on."""


def build_scene(case: Case) -> Scene:
    """Scene of a case, on whose parts its events act."""
    scene = _built(case)
    if not case.event:
        return scene
    from fsm.case.derived.event_words import with_events

    return with_events(scene, case.event, case.units)


def rebuilt(case: Case, like: Case, scene: Scene) -> Scene:
    """Scene of a case that differs from another case in some numbers; where builders only pass these on, the other parts are
    those of the scene of the other case.
    """
    changed = {name for name in Case.model_fields if getattr(case, name) is not getattr(like, name)}
    passes = case.strip is not None or (case.sheet is not None and case.sheet.facets in ("rigid", "bend-lines"))
    if not passes or not changed <= _PASSED or case.scene is not None or case.step or case.event or scene.built.chambers:
        return build_scene(case)
    update: dict[str, object] = {name: getattr(case, name) for name in changed - {"load"}}
    if "load" in changed:
        from fsm.builders.sheet.sheet_loads import placed_loads  # imports patterns and meshes

        update["loads"] = placed_loads(case, case.load)
    return scene.model_copy(update=update)


def _built(case: Case) -> Scene:
    """Scene of a case: from its strip, lattice or sheet, or its [scene] with the contact, loads and drives of the case.

    A [scene] beside a [strip] or a [sheet] adds its parts.
    """
    written = case
    if case.step:
        case = _with_items_of_steps(case)
    if case.lattice is not None:
        return build_lattice(case)
    if case.sheet is not None:
        from fsm.builders.sheet.sheet import build_sheet  # imports patterns and meshes
        from fsm.builders.sheet.sheet_bars import build_bars

        bars = case.sheet.facets == "bars"
        scene = build_bars(case) if bars else build_sheet(case)
        if case.step and case.sheet.facets != "flexible":
            scene = _with_steps_of_places(written, scene)
        if case.scene is not None:
            from fsm.builders.sheet.beside_sheet import with_sheet_frames

            scene = _added(*with_sheet_frames(case, scene, case.scene))
        return _with_parts(scene) if bars or case.scene is not None else scene
    if case.strip is not None:
        scene = build_strip(case)
        return scene if case.scene is None else _with_parts(_added(scene, case.scene))
    assert case.scene is not None
    update = {
        name: value
        for name, value in (
            ("contact", case.contact),
            ("friction", case.friction),
            ("loads", case.load),
            ("obstacles", case.obstacle),
            ("drives", case.drive),
            ("gravity", case.gravity if any(case.gravity) else None),
        )
        if value
    }
    return _with_parts(case.scene.model_copy(update=update))


def _with_items_of_steps(case: Case) -> Case:
    """Case with the drives and loads of all its steps; of several drives with the same target, only the first is kept."""
    scene = case.scene
    if scene is not None:
        scene = scene.model_copy(update={"drives": (), "loads": ()})
    loads = tuple(load for _, load in loads_of(case))
    return case.model_copy(update={"drive": drives_of(case), "load": loads, "scene": scene})


def _with_steps_of_places(case: Case, scene: Scene) -> Scene:
    """Scene of a sheet in which the springs of a driven place act only in the steps in which it is driven.

    The springs carry no force at the start of the first of these steps.
    """
    massless = {body.name for body in scene.bodies if not body.mass}
    changes = {}
    for number, drive in enumerate(scene.drives):
        for body in massless.intersection(drive.moved):
            steps = acting_steps(case, number, body)
            changes[body] = {"steps": steps, "latch": True} if len(steps) < len(case.step) else {}
    elements = tuple(element.model_copy(update=changes.get(element.outer, {})) for element in scene.elements)
    return scene.model_copy(update={"elements": elements})


def _added(first: Scene, more: Scene) -> Scene:
    """Scene with the parts of another scene; contact, friction and gravity of the first one have priority."""
    single = {"contact", "friction", "gravity"}
    update = {name: (*getattr(first, name), *getattr(more, name)) for name in set(Scene.model_fields) - single}
    gravity = first.gravity if any(first.gravity) else more.gravity
    laws = {"contact": first.contact or more.contact, "friction": first.friction or more.friction}
    return first.model_copy(update=update | laws | {"gravity": gravity})


def _with_parts(scene: Scene) -> Scene:
    """Scene with its frames among the bodies and elements; a scene with faults is returned unchanged, and a later check
    reports its faults.
    """
    return scene if any(frame_faults(scene)) else with_frames(scene)
