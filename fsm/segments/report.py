"""What a case is made of and what is left out of it, in plain words, without compiling it (`fsm check`)."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.errors import CaseError, Fault
from fsm.overlap import find_overlaps
from fsm.scene.builders.strip import build_scene
from fsm.scene.case import Case
from fsm.scene.choice import automatic_method
from fsm.scene.loads import Drive
from fsm.scene.materials import SplineCrease
from fsm.scene.party import Party, parties
from fsm.scene.planar import out_of_plane
from fsm.scene.scene import GROUND, Body, ContactPair, ForceElement, Scene
from fsm.segments.check_scene import check_scene
from fsm.segments.drive import PrescribedMotion
from fsm.segments.save_times import save_times

__all__ = ["SURFACE_TIP", "describe"]

SURFACE_TIP = 0.025
"""`fsm.interactions.surface.TIP`, which comes with the compiler; a test holds the two together."""

_LABEL = 14


def describe(case: Case, source: str = "") -> list[str]:
    """What is computed, what is left out and why, and the approximations that apply, a line each.

    Parameters
    ----------
    case : Case
    source : str
        Name of the case file, for the faults.

    Raises
    ------
    CaseError
        All faults of the scene, and panels that overlap as folded.
    """
    scene = build_scene(case)
    faults = check_scene(scene) or [*_overlaps(case, scene), *_endless(case, scene)]
    if faults:
        raise CaseError(faults, source)
    view = _View(case, scene)
    lines = []
    for label, section in _SECTIONS:
        for text in section(view):
            lines.append(f"{label:<{_LABEL}}{text}")
            label = ""
    return lines


# faults -----------------------------------------------------------------------------------------------------


def _overlaps(case: Case, scene: Scene) -> Iterator[Fault]:
    if scene.contact is None or out_of_plane(scene):
        return
    for first, second, depth in find_overlaps(scene):
        yield Fault(
            "strip" if case.strip else "scene",
            f"{first} and {second} overlap at the start by {1e3 * depth:.3g} mm; "
            "use a smaller fold_angle or thickness, or thickness_in_gap = false",
        )


def _endless(case: Case, scene: Scene) -> Iterator[Fault]:
    if case.solve.end_time is None and not scene.drives:
        yield Fault("solve.end_time", "missing, and there is no drive either: nothing says when to stop")


# what the sections look at ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _View:
    case: Case
    scene: Scene

    @cached_property
    def reasons(self) -> list[str]:
        return out_of_plane(self.scene)

    @property
    def spatial(self) -> bool:
        return self.case.solve.spatial or bool(self.reasons)

    @cached_property
    def bodies(self) -> dict[str, Body]:
        return {body.name: body for body in self.scene.bodies}

    @cached_property
    def free(self) -> list[Body]:
        driven = {drive.body for drive in self.scene.drives}
        return [body for body in self.scene.bodies if not body.held and body.name not in driven]

    @cached_property
    def elements(self) -> list[ForceElement]:
        """Those that do something."""
        return [
            e
            for e in self.scene.elements
            if e.crease is not None
            or any((*e.translation, *e.rotation, *e.translation_damping, *e.rotation_damping))
        ]

    @cached_property
    def parties(self) -> dict[str, Party]:
        """What the pairs name."""
        return parties(self.scene)

    @cached_property
    def pairs(self) -> list[ContactPair]:
        """Those that can meet."""
        if self.scene.contact is None:
            return []
        return [
            pair
            for pair in self.scene.pairs
            if not all(
                name == GROUND or self.bodies[name].held
                for end in (pair.first, pair.second)
                for name in self.parties[end].bodies
            )
        ]

    @property
    def segment(self) -> float:
        """Median length of the plates that move, m; 0 without any."""
        lengths = [body.plate.length for body in self.free if body.plate is not None]
        return float(np.median(lengths)) if lengths else 0.0

    @property
    def method(self) -> str:
        """What solves it."""
        chosen = self.case.solve.method
        return automatic_method(self.scene)[0] if chosen == "auto" else chosen

    @cached_property
    def motions(self) -> list[PrescribedMotion]:
        return [_motion(number, drive) for number, drive in enumerate(self.scene.drives)]

    @property
    def end(self) -> float:
        if self.case.solve.end_time is not None:
            return self.case.solve.end_time
        return max(motion.end_time for motion in self.motions)


def _motion(number: int, drive: Drive) -> PrescribedMotion:
    direction = np.array(drive.direction, dtype=float)
    run_up = 0.01 * drive.travel if drive.run_up is None else drive.run_up
    return PrescribedMotion(number, direction / np.linalg.norm(direction), drive.speed, drive.travel, run_up)


# sections ---------------------------------------------------------------------------------------------------


def _title(view: _View) -> Iterator[str]:
    if view.case.title:
        yield view.case.title


def _dimension(view: _View) -> Iterator[str]:
    if not view.spatial:
        yield "planar: everything lies and moves in the plane y = 0"
    elif view.reasons:
        yield f"spatial: {'; '.join(view.reasons)}"
    else:
        yield "spatial: asked for, though everything lies in the plane y = 0"


def _bodies(view: _View) -> Iterator[str]:
    held = sum(body.held for body in view.scene.bodies)
    yield f"{len(view.free)} free, {held} held, {len(view.scene.drives)} driven"
    each = 6 if view.spatial else 3
    yield f"{each * len(view.free)} degrees of freedom, {each} a free body"


def _joints(view: _View) -> Iterator[str]:
    kinds = Counter(element.kind for element in view.elements if element.kind != "crease")
    if kinds["panel"]:
        yield f"{_count(kinds['panel'], 'joint')} between the segments of panels, linear springs"
    if kinds["joint"]:
        yield f"{_count(kinds['joint'], 'joint')}, linear springs"
    if kinds["drive"]:
        yield f"{_count(kinds['drive'], 'half joint')} from the pulled crease line to the segments beside it"
    creases = [element for element in view.elements if element.kind == "crease" or element.crease is not None]
    tabulated = [element for element in creases if element.crease is not None]
    if len(creases) > len(tabulated):
        yield f"{_count(len(creases) - len(tabulated), 'crease')}, linear"
    if tabulated:
        yield f"{_count(len(tabulated), 'crease')}, tabulated: {_curve(tabulated[0])}"
    if not view.elements:
        yield "none: the bodies move freely"


def _curve(element: ForceElement) -> str:
    crease = element.crease
    if not isinstance(crease, SplineCrease) or crease.angle is None:
        return "linear law"
    kind = "cubic spline" if crease.interpolation == "cubic" else "monotone (PCHIP) curve"
    first, last = math.degrees(crease.angle[0]), math.degrees(crease.angle[-1])
    return f"{kind} through {len(crease.angle)} points from {first:.4g} to {last:.4g} deg, straight outside"


def _half_cell(view: _View) -> Iterator[str]:
    strip = view.case.strip
    if strip is None:
        corrected = sum(element.crease_flexibility > 0 for element in view.elements)
        yield f"in {_count(corrected, 'crease')}, as the scene gives it" if corrected else "none in the scene"
    elif strip.half_cell:
        yield "on: the half segments next to a crease bend too, in series with it"
    else:
        yield "off: the half segments next to a crease are rigid, which makes the strip too stiff"


def _contact(view: _View) -> Iterator[str]:
    contact = view.scene.contact
    if contact is None or not view.pairs:
        return
    names = ", ".join(f"{pair.first} - {pair.second}" for pair in view.pairs)
    yield f"{_count(len(view.pairs), 'pair')} watched: {names}"
    damping = f", damped: C = {contact.damping:.4g} N s/m" if contact.damping else ", not damped"
    yield f"Hertz law, K = {contact.stiffness:.4g} N/m^{contact.exponent:g} of a whole face{damping}"
    yield f"{_count(_contact_points(view), 'contact point')}, both faces of a pair watching each other"
    if contact.thickness_in_gap:
        yield "faces touch at half the sum of their thicknesses"
    else:
        yield "middle surfaces touch: no thickness in the gap"


def _contact_points(view: _View) -> int:
    assert view.scene.contact is not None
    per_segment = view.scene.contact.points_per_segment + 1
    # as in the compiler: plates that are not held, driven ones among them
    moving = [body.plate.length for body in view.scene.bodies if body.plate is not None and not body.held]
    mean = float(np.mean(moving)) if moving else 0.0
    total = rigid = 0
    for pair in view.pairs:
        total -= 2 if pair.shared == "end-start" else 0  # none on the crease itself
        sides = [view.parties[pair.first], view.parties[pair.second]]
        if any(side.kind != "surface" for side in sides):
            # rigid plates: a grid of points each in space
            plates = sum(len(side.bodies) for side in sides if side.kind != "obstacle")
            rigid += plates * per_segment ** (2 if view.spatial else 1)
            continue
        for name in (*sides[0].bodies, *sides[1].bodies):
            body = view.bodies[name]
            assert body.plate is not None  # checked
            held = body.held and mean > 0.0
            # a held plate is cut into cells about as long as the segments that move
            total += per_segment * (max(1, round(body.plate.length / mean)) if held else 1)
    return total * (2 if view.spatial else 1) + rigid


def _friction(view: _View) -> Iterator[str]:
    law = view.scene.friction
    if law is None or not view.pairs:
        return
    if law.law == "step":
        yield (
            f"two STEPs: {law.mu_static:g} at {_mm(law.v_static)}/s, "
            f"{law.mu_dynamic:g} from {_mm(law.v_dynamic or law.v_static)}/s on"
        )
    else:
        yield f"{law.mu_dynamic:g} tanh(v / {_mm(law.v_static)}/s)"


def _damping(view: _View) -> Iterator[str]:
    material = view.case.material
    if view.case.strip is not None and material is not None:
        beta = material.damping
        yield f"every spring c = {1e3 * beta:.4g} ms x k (Kelvin-Voigt)" if beta else "none in the springs"
    else:
        damped = sum(any(e.translation_damping) or any(e.rotation_damping) for e in view.elements)
        yield f"in {damped} of {_count(len(view.elements), 'force element')}"


def _drives(view: _View) -> Iterator[str]:
    for drive, motion in zip(view.scene.drives, view.motions, strict=True):
        along = ", ".join(f"{x:.4g}" for x in motion.direction)
        yield (
            f"{drive.body} pulled along ({along}) at {_mm(drive.speed)}/s: run-up {_mm(motion.run_up)}, "
            f"travel {_mm(drive.travel)}, {motion.end_time:.4g} s"
        )
        if view.case.strip is not None:
            guided = "guided: the line moves along the pull only and does not turn"
            yield guided if drive.guide else "unguided: the line is free across the pull"


def _loads(view: _View) -> Iterator[str]:
    for load in view.scene.loads:
        kind = "follower" if load.follower else "dead"
        wrench = f"force {_triple(load.force)} N, moment {_triple(load.moment)} N m"
        yield f"on {load.body}: {kind}, {wrench}, {load.time.kind}"
    if any(view.scene.gravity):
        yield f"gravity {_triple(view.scene.gravity)} m/s^2"


def _method(view: _View) -> Iterator[str]:
    solve = view.case.solve
    name, reason = automatic_method(view.scene)
    if solve.method == "auto":
        yield f"{name}, chosen by auto: {reason}"
    else:
        yield f"{solve.method}, asked for"
    yield f"rtol {solve.rtol:g}, to {view.end:.4g} s"
    yield f"stops when the energy balance is off by {100 * solve.energy_abort:g} %"


def _saved(view: _View) -> Iterator[str]:
    save = view.case.save
    motion = view.motions[0] if view.motions else None
    records = len(save_times(view.case, motion, view.end))
    if save.every is not None and motion is not None:
        what = f"one every {_mm(save.every)} of travel"
    elif save.interval is not None:
        what = f"one every {save.interval:.4g} s"
    else:
        what = "evenly over the travel" if motion else "evenly over the time"
    yield f"{records} records, {what}"


def _left_out(view: _View) -> Iterator[str]:
    scene = view.scene
    if scene.contact is None:
        yield "contact: no [contact]; panels pass through each other"
    elif not view.pairs:
        yield "contact: [contact] is there, but no two sides of its pairs can meet"
    elif scene.friction is None:
        yield "friction: no [friction]; faces slide freely"
    if not any(element.crease is not None for element in view.elements):
        yield "crease curves: no crease is tabulated"
    held = sum(body.held for body in scene.bodies)
    if held:
        yield f"degrees of freedom of {_count(held, 'held body', 'held bodies')}"
    idle = len(scene.elements) - len(view.elements)
    if idle:
        yield f"{_count(idle, 'force element')} without stiffness"
    if not any(scene.gravity):
        yield "gravity: none given"
    if not view.spatial:
        yield "motion out of the plane: nothing pushes that way; --spatial lets it move there"
        if view.case.strip is not None and scene.drives:
            yield "sway of the crease line: it is guided; guide = false sets it free, in space"


def _approximations(view: _View) -> Iterator[str]:
    yield from _of_segments(view)
    if view.pairs:
        yield from _of_contact(view)
    if view.pairs and view.scene.friction is not None:
        yield _of_friction(view)
    if view.case.material is not None and view.case.material.damping:
        yield "damping is Kelvin-Voigt, c = beta k, not measured: halve material.damping to see its part"
    if view.scene.drives and view.method == "static":
        yield "inertia is dropped but at snaps, where the motion is solved with it until it has died"
    elif view.scene.drives:
        yield "the pull is slow but dynamic: halve the speed to check that the force stays"


def _of_segments(view: _View) -> Iterator[str]:
    strip = view.case.strip
    if strip is None or strip.segments_per_panel == 1 or not view.segment:
        return
    length = f"segments of {_mm(view.segment)}"
    trial = "the trial strip's peak force is off by"
    if strip.half_cell:
        yield f"{length}: error O(l^2); {trial} 2, 0.6, 0.1 % with 10, 20, 40 a panel"
    else:
        yield f"{length}: error O(l) without the half cell; {trial} 4, 2.4, 1.3 % with 10, 20, 40 a panel"


def _of_contact(view: _View) -> Iterator[str]:
    contact = view.scene.contact
    assert contact is not None
    if view.segment:
        off = _mm(view.segment / 8 * math.radians(10))
        yield f"the contact surface departs from the segments by l alpha/8: {off} at a joint bent by 10 deg"
    if contact.thickness_in_gap and any(pair.shared == "end-start" for pair in view.pairs):
        yield "next to a shared crease the thickness in the gap is tapered to nothing: layers join there"
    yield (
        f"a surface goes on by {100 * SURFACE_TIP:g} % of its length beyond its ends, rounded off: "
        "all of it meets ends of other panels, half of it their other points"
    )
    if contact.pairs is not None:
        yield "only the pairs above touch: faces of other panels pass through each other"
    if view.spatial:
        yield "edges do not touch: points beyond a panel's sides, |y| > width/2, meet nothing"


def _of_friction(view: _View) -> str:
    law = view.scene.friction
    assert law is not None
    if law.law == "step":
        return (
            "friction creeps instead of sticking: on a slope a at v_static tan(a)/mu_static at most, "
            f"{_mm(law.v_static)}/s at the limit"
        )
    return (
        "friction creeps instead of sticking: on a slope a it slides at v_static atanh(tan(a)/mu), "
        f"about v_static tan(a)/mu; v_static is {_mm(law.v_static)}/s"
    )


_SECTIONS: tuple[tuple[str, Callable[[_View], Iterator[str]]], ...] = (
    ("case", _title),
    ("dimension", _dimension),
    ("bodies", _bodies),
    ("elements", _joints),
    ("half cell", _half_cell),
    ("contact", _contact),
    ("friction", _friction),
    ("damping", _damping),
    ("drive", _drives),
    ("loads", _loads),
    ("method", _method),
    ("saved", _saved),
    ("left out", _left_out),
    ("approximate", _approximations),
)


def _count(number: int, one: str, many: str = "") -> str:
    return f"{number} {one if number == 1 else many or one + 's'}"


def _mm(length: float) -> str:
    return f"{1e3 * length:.4g} mm"


def _triple(vector: tuple[float, float, float]) -> str:
    return "(" + ", ".join(f"{x:g}" for x in vector) + ")"
