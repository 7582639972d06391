"""Report of `fsm check`: the model, the parts left out, and the approximations.

A case is compiled only if it records channels or has events; kernels are never compiled.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator

from fsm.builders.patterns.cuts import facet_areas
from fsm.builders.patterns.of_sheet import pattern_of
from fsm.builders.scene import build_scene
from fsm.builders.strip import bending_stiffness, strip_damping
from fsm.case.derived.planar import out_of_plane
from fsm.case.models.case import Case
from fsm.case.models.loads import Drive
from fsm.case.models.materials import SplineCrease
from fsm.case.models.scene import ForceElement, Scene
from fsm.case.plan.method_selection import solve_of
from fsm.case.plan.step_items import loads_of, start_of, with_paths_of_steps
from fsm.check import contact
from fsm.check.array import describe_array
from fsm.check.drive import drive_of_strip_lines, drives_line, pulled_beyond_length
from fsm.check.film import describe_film
from fsm.check.flexible import approximations_of_films, beam_lines, cable_lines, film_lines, truss_lines
from fsm.check.gas import gas_lines
from fsm.check.joints import joint_lines, margin_lines, margin_warnings
from fsm.check.library import library_lines, library_warnings
from fsm.check.numbers import body_lines, crease_lines, element_lines, lattice_lines, material_lines, strip_lines
from fsm.check.sheet import pressure_line, sheet_lines, sheet_support_lines
from fsm.check.view import CheckContext
from fsm.errors import CaseError, Fault
from fsm.model.bodies.drive import PrescribedMotion, run_up_of
from fsm.model.faults.check_contacts import gas_faults
from fsm.model.faults.check_scene import check_scene
from fsm.model.faults.crease_checks import crease_faults, crease_warnings
from fsm.model.faults.overlap import find_overlaps
from fsm.model.plan.in_python import cost_in_python
from fsm.model.plan.joint_state import JointsAtStart
from fsm.model.plan.plan import plan_of
from fsm.model.plan.plan_warnings import plan_warnings
from fsm.text.shown_units import count, labelled, shown, shown_points, triple


def _describe_segments(case: Case) -> list[str]:
    """Lines on a deployment; raises all faults of the scene, and panels that overlap as folded."""
    scene = build_scene(case)
    steep = crease_faults(scene, case.strip is not None)
    checked = _once_driven(scene) if case.step else scene
    faults = check_scene(checked) or [*steep, *_overlaps(case, scene), *_endless(case, scene)]
    if faults:
        raise CaseError(with_paths_of_steps(case, faults))
    plan = plan_of(case, scene) if case.step else None  # the faults of the plan have the paths of the steps
    faults = list(gas_faults(case, scene, plan))
    if faults:
        raise CaseError(faults)
    view = CheckContext(case, scene, plan or plan_of(case, scene))
    faults = list(_opened(view))
    if faults:
        raise CaseError(faults)
    return labelled(_SECTIONS, view)


def _once_driven(scene: Scene) -> Scene:
    """Scene with the first drive of every body only; steps may drive a body several times, one after the other."""
    seen: set[str] = set()
    drives = []
    for drive in scene.drives:
        if not seen & set(drive.moved):
            drives.append(drive)
        seen |= set(drive.moved)
    return scene.model_copy(update={"drives": tuple(drives)})


# faults -----------------------------------------------------------------------------------------------------


def _overlaps(case: Case, scene: Scene) -> Iterator[Fault]:
    if scene.contact is None or out_of_plane(scene):
        return
    for first, second, depth in find_overlaps(scene):
        yield Fault(
            "strip" if case.strip else "scene",
            f"{first} and {second} overlap at the start by {shown(depth, 'm')}; "
            "use a smaller fold_angle or thickness, or thickness_in_gap = false",
        )


def _opened(view: CheckContext) -> Iterator[Fault]:
    if view.scene.joints and not view.scene.flexible and view.plan.begins_in_motion:
        yield from JointsAtStart(view.scene).velocity_faults()


def _endless(case: Case, scene: Scene) -> Iterator[Fault]:
    if case.solve.end_time is None and not scene.drives and not case.step:
        yield Fault("solve.end_time", "missing, and there is no drive, so the run has no end; give one of them")


# sections ---------------------------------------------------------------------------------------------------


def _title(view: CheckContext) -> Iterator[str]:
    if view.case.title:
        yield view.case.title


def _dimension(view: CheckContext) -> Iterator[str]:
    if not view.spatial:
        yield "planar: all bodies move in the plane y = 0"
    elif view.reasons:
        yield f"spatial: {'; '.join(view.reasons)}"
    else:
        yield "spatial: set by solve.spatial, although all bodies are in the plane y = 0"


def _bodies(view: CheckContext) -> Iterator[str]:
    frames = len(view.scene.frames)
    held = sum(body.held for body in view.scene.bodies) - frames
    driven = sum(len(drive.moved) for drive in view.scene.drives)
    on_elements = f", {count(frames, 'frame')} on flexible parts" if frames else ""
    if not (view.free or held or driven):
        yield f"none{on_elements}"
        return
    yield f"{len(view.free)} free, {held} held, {driven} driven{on_elements}"
    each = 6 if view.spatial else 3
    yield f"{each * len(view.free)} degrees of freedom, {each} for each free body"


def _joints(view: CheckContext) -> Iterator[str]:
    kinds = Counter(element.kind for element in view.elements if element.kind != "crease")
    if kinds["panel"] and view.case.sheet is None:
        yield f"{count(kinds['panel'], 'joint')} between the segments of panels, linear springs"
    joints, scene = kinds["joint"], view.case.scene
    if view.case.sheet is not None:
        in_scene = 0 if scene is None else sum(element.kind == "joint" for element in scene.elements)
        if joints > in_scene:
            yield f"{count(joints - in_scene, 'spring')} of supports, driven vertices and seams"
        joints = in_scene
    if joints:
        yield f"{count(joints, 'joint')}, linear springs"
    if kinds["drive"]:
        yield f"{count(kinds['drive'], 'half joint')} between driven lines and the segments beside them"
    creases = [element for element in view.elements if element.kind == "crease" or element.crease is not None]
    tabulated = [element for element in creases if element.crease is not None]
    if len(creases) > len(tabulated):
        ligaments = sum(element.frame == "chord" for element in creases)
        linear = len(creases) - len(tabulated) - ligaments
        if ligaments:
            yield f"{count(ligaments, 'hinge')} with length, linear springs along and across the hinge"
        if linear:
            yield f"{count(linear, 'crease')}, linear"
    if tabulated:
        yield f"{count(len(tabulated), 'crease')}, tabulated: {_curve(tabulated[0])}"
    added = Counter(element.kind for element in view.scene.point_elements)
    for kind, number in added.items():
        yield f"{count(number, 'element')} of kind {kind!r} between points, by an extension; steps are solved in Python"
    for kind, number in Counter(coupling.kind for coupling in view.scene.couplings).items():
        yield f"{count(number, 'coupling')} of kind {kind!r} between joints"
    if view.free and not view.elements and not added and not view.scene.joints:
        yield "none: bodies move freely"


def _curve(element: ForceElement) -> str:
    crease = element.crease
    if not isinstance(crease, SplineCrease) or crease.angle is None:
        return "linear law"
    kind = "cubic spline" if crease.interpolation == "cubic" else "monotone (PCHIP) curve"
    first, last = math.degrees(crease.angle[0]), math.degrees(crease.angle[-1])
    back = "; with hysteresis, by a second curve for unloading" if crease.unloading is not None else ""
    return f"{kind} through {len(crease.angle)} points from {first:.4g} to {last:.4g} deg, linear outside{back}"


def _half_cell(view: CheckContext) -> Iterator[str]:
    strip = view.case.strip
    if view.case.sheet is not None or not view.elements:
        return
    if strip is None:
        corrected = sum(element.crease_flexibility > 0 for element in view.elements)
        own = f"on in {count(corrected, 'crease')} with crease_flexibility"
        yield own if corrected else "off: no crease has crease_flexibility"
    elif strip.half_cell:
        yield "on: the half segments beside a crease are flexible, in series with the crease"
    else:
        yield "off: the half segments beside a crease are rigid, so the strip is too stiff"


def _damping(view: CheckContext) -> Iterator[str]:
    material = view.case.material
    if view.case.strip is not None and material is not None:
        beta = strip_damping(view.case, view.scene)
        yield f"c = {shown(beta, 's')} x k for every spring (Kelvin-Voigt)" if beta else "none in the springs"
    elif view.elements:
        damped = sum(any(e.translation_damping) or any(e.rotation_damping) for e in view.elements)
        yield f"in {damped} of {count(len(view.elements), 'force element')}"


def _drives(view: CheckContext) -> Iterator[str]:
    for drive, motion in zip(view.scene.drives, view.motions, strict=True):
        yield f"{drive.part} {_motion(drive, motion)}, duration {motion.end_time:.4g} s"
        yield from drive_of_strip_lines(view, drive)


def _motion(drive: Drive, motion: PrescribedMotion) -> str:
    """Text on the motion of a drive."""
    if drive.turn is not None:
        how = f"turns about {triple(drive.axis)}"
        size, pace = shown(motion.travel, "rad"), shown(drive.fastest, "rad/s")
    else:
        how = f"moves along ({', '.join(f'{x:.4g}' for x in motion.direction)})"
        size, pace = shown(motion.travel, "m"), shown(drive.fastest, "m/s")
    if drive.time is None:
        run_up = f"run-up {shown(run_up_of(drive), 'm')}, " if drive.turn is None else ""
        name = "travel" if drive.turn is None else "turn"
        return f"{how} at {pace}: {run_up}{name} {size}"
    return f"{how} as a {drive.time.kind}: total path {size}, at most {pace}"


def _loads(view: CheckContext) -> Iterator[str]:
    loads = list(view.scene.loads) if view.case.sheet is None else [load for _, load in loads_of(view.case)]
    for load in loads if view.scene.built.facets is None else ():  # the lines on supports list loads on flexible facets
        if load.pressure is not None:
            assert view.case.sheet is not None
            yield pressure_line(load, facet_areas(pattern_of(view.case.sheet)))
            continue
        kind = "follower" if load.follower else "dead"
        wrench = f"force {shown_points([load.force], 'N')}, moment {shown_points([load.moment], 'N m')}"
        yield f"on {load.target}: {kind}, {wrench}, {load.time.kind if load.time else 'constant'}"
    if any(view.scene.gravity):
        yield f"gravity {triple(view.scene.gravity)} m/s^2"


def _start(view: CheckContext) -> Iterator[str]:
    start, reason = start_of(view.case, view.scene)
    state = {"as-folded": "as folded, at rest", "equilibrium": "in equilibrium, at rest"}[start]
    if view.case.strip is None and start == "as-folded":
        state = "as given"
    loads = view.scene.loads or any(view.scene.gravity)
    with_loads = ", with gravity and the loads at time zero" if start == "equilibrium" and loads else ""
    yield f"{state}{with_loads} ({reason})"
    if view.case.release is not None:
        yield f"held until {view.case.release.hold_time:.4g} s, then released"


def _method(view: CheckContext) -> Iterator[str]:
    solve = solve_of(view.case.solve, view.scene)
    for step in view.solved if view.plan.written else ():
        yield f"{step.method} in step {step.name!r}"
    if not view.plan.written and solve.method == "auto":
        yield f"{view.method}, selected by auto: {view.solved[-1].reason}"
    elif not view.plan.written:
        yield f"{solve.method}, set by solve.method"
    yield f"rtol {solve.rtol:g}, end time {view.end:.4g} s"
    yield f"the run stops if the energy drift exceeds {100 * solve.energy_abort:g} % of the reference energy"


def _compiled(view: CheckContext) -> Iterator[str]:
    """Whether kernels compute the steps of the solver."""
    for step in view.solved:
        reasons = step.in_python.of(step.method)
        if reasons and not view.scene.flexible:
            slower = f"about {cost_in_python((6 if view.spatial else 3) * len(view.free)):.2g} times slower"
        else:
            slower = "slower"
        where = f" in step {step.name!r}" if view.plan.written else ""
        yield f"steps in Python{where}, {slower}: {'; '.join(reasons)}" if reasons else f"steps in one kernel{where}"


def _saved(view: CheckContext) -> Iterator[str]:
    save = view.case.save
    motion = view.motions[0] if view.motions else None
    records = view.records
    if save.every is not None and motion is not None:
        spacing = f"one every {shown(save.every, 'm')} of travel"
    elif save.interval is not None:
        spacing = f"one every {save.interval:.4g} s"
    else:
        spacing = "at equal intervals of travel" if motion else "at equal intervals of time"
    yield f"{count(records, 'record')}, {spacing}"


def _steps(view: CheckContext) -> Iterator[str]:
    """Steps of the run, including steps that follow from other keys of the case."""
    for number, step in enumerate(view.plan.steps, 1):
        when = f"{step.start:.4g} to {step.end:.4g} s" if step.end > step.start else f"at {step.start:.4g} s"
        what = {"relax": "stable equilibrium", "modes": f"{step.modes} natural modes"}.get(step.kind, step.method)
        if step.still:
            what = "nothing moves"
        yield "; ".join([f"{number} {step.name}: {step.kind}, {when}, {what}", *step.described])


def _left_out(view: CheckContext) -> Iterator[str]:
    scene = view.scene
    if scene.contact is None:
        yield "contact: no [contact]; panels pass through each other"
    elif not view.pairs:
        yield "contact: [contact] has no pair with a moving side"
    elif scene.friction is None:
        yield "friction: no [friction]; faces slide without friction"
    if view.elements and not any(element.crease is not None for element in view.elements):
        yield "tabulated creases: none in this case"
    held = sum(body.held for body in scene.bodies) - len(scene.frames)
    if held:
        yield f"degrees of freedom of {count(held, 'held body', 'held bodies')}"
    idle = len(scene.elements) - len(view.elements)
    if idle:
        yield f"{count(idle, 'force element')} without stiffness"
    if not any(scene.gravity):
        yield "gravity: not given"
    if not view.spatial:
        yield "motion out of the plane: no load acts in this direction; --spatial includes it"
        if view.case.strip is not None and any(drive.guide and drives_line(drive) for drive in scene.drives):
            yield "transverse motion of the driven line: it is guided; guide = false includes it, in space"


def _approximations(view: CheckContext) -> Iterator[str]:
    yield from _of_segments(view)
    yield from approximations_of_films(view)
    if view.pairs:
        yield from contact.approximations_of_contact(view)
    if view.pairs and view.scene.friction is not None:
        yield contact.approximations_of_friction(view)
        yield from contact.stick_slip(view)
    yield from _of_damping(view)
    if view.scene.drives and view.method == "static":
        yield "inertia is neglected, except in a snap-through, which is solved as a motion until it comes to rest"
    elif view.scene.drives:
        yield "the force includes inertia: halve the speed, and check that the force does not change"


def _of_damping(view: CheckContext) -> Iterator[str]:
    if view.case.strip is None or view.case.material is None:
        return
    beta = strip_damping(view.case, view.scene)
    if not beta:
        return
    yield "damping is Kelvin-Voigt damping, c = beta k, not a measured value: halve material.damping to see its effect"
    if view.scene.drives and view.method == "static":
        delay = beta * max(drive.fastest for drive in view.scene.drives)
        shift = f"beta v = {shown(delay, 'm')} of travel"
        yield f"dampers shift the force curve by {shift}, visible where the force rises steeply"


def _of_segments(view: CheckContext) -> Iterator[str]:
    strip = view.case.strip
    if strip is None or strip.segments_per_panel == 1 or not view.segment:
        return
    length = f"segments of {shown(view.segment, 'm')}"
    peak = "the peak of folding_cases/strip_trial has an error of"
    meshes = "with 10, 20 and 40 segments per panel"
    if strip.half_cell:
        yield f"{length}: error O(l^2); {peak} 3.4, 0.7 and 0.13 % {meshes}"
    else:
        yield f"{length}: error O(l) without half cells; {peak} 4, 2.4 and 1.3 % {meshes}"
    if view.case.material is not None and view.scene.drives:
        tension = bending_stiffness(strip, view.case.material) / view.segment**2
        yield f"segments resolve the bending beside creases of taut panels up to a tension of EI/l^2 = {shown(tension, 'N')}"


def _warnings(view: CheckContext) -> Iterator[str]:
    yield from contact.soft_contact(view)
    yield from margin_warnings(view)
    yield from library_warnings(view)
    yield from crease_warnings(view.scene, view.case.strip is not None)
    if view.scene.joints and not view.scene.flexible and view.plan.begins_in_motion:
        yield from JointsAtStart(view.scene).velocity_warnings()
    yield from plan_warnings(view.case, view.scene, view.plan if view.plan.written else None)
    yield from pulled_beyond_length(view)


_SECTIONS: tuple[tuple[str, Callable[[CheckContext], Iterator[str]]], ...] = (
    ("case", _title),
    ("dimension", _dimension),
    ("strip", strip_lines),
    ("lattice", lattice_lines),
    ("sheet", sheet_lines),
    ("supports", sheet_support_lines),
    ("material", material_lines),
    ("creases", crease_lines),
    ("library", library_lines),
    ("films", film_lines),
    ("cables", cable_lines),
    ("beams", beam_lines),
    ("trusses", truss_lines),
    ("bodies", _bodies),
    ("", body_lines),
    ("joints", joint_lines),
    ("margin", margin_lines),
    ("elements", _joints),
    ("", element_lines),
    ("half cell", _half_cell),
    ("contact", contact.contact_lines),
    ("friction", contact.friction_lines),
    ("damping", _damping),
    ("drive", _drives),
    ("loads", _loads),
    ("gas", gas_lines),
    ("start", _start),
    ("steps", _steps),
    ("method", _method),
    ("compiled", _compiled),
    ("saved", _saved),
    ("left out", _left_out),
    ("approximate", _approximations),
    ("warning", _warnings),
)


def describe(case: Case) -> list[str]:
    """Lines of the report: the model, the parts left out with the reason, and the approximations.

    Raises
    ------
    CaseError
        All faults that can be found without compilation.
    """
    kinds = {"deploy": _describe_segments, "vibrate": describe_film, "scissor": describe_array}
    lines = [line for step in case.steps for line in kinds[step](case)]
    if case.extensions:
        files = ", ".join(name.partition("#")[0] for name in case.extensions)
        lines = labelled([("extensions", lambda _: [f"{files} (Python code, executed with the case)"])], case) + lines
    if case.save.channels or case.report:
        from fsm.channels.sample import channel_lines  # this module imports numba, which other cases do not need

        lines += labelled([("channels", channel_lines)], case)
    if case.event:
        from fsm.channels.conditions import event_lines

        lines += labelled([("events", event_lines)], case)
    return lines
