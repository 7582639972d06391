"""Preview of a planar scene: a short animation of its motion.

The animation is a sketch with rigid pieces and rotary springs (pymunk). The animation makes wrong angles and wrong creases
visible. The animation computes no forces and no buckling. The animation shows motion in the x-z plane only.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsm.builders.scene import build_scene
from fsm.case.models.case import Case
from fsm.case.models.loads import Drive
from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.errors import CaseError, Fault
from fsm.io.atomic_write import atomic_write
from fsm.model.faults.overlap import axes_of, distance, length_of, outlines, panel_of_body, points_at
from fsm.text.shown_units import shown

Points = NDArray[np.float64]
Shot = list[list[Points]]
"""One frame: for each panel the ends of its pieces, (2, 2) arrays in m."""

FILM_TIME, FRAMES = 3.0, 60
PIECES = 4
"""Number of rigid pieces of a panel where panels can touch; whole rigid panels would jam."""
UNIT = 100.0
"""Mean length of a panel in units of the animation; the other units are the mass of a panel and the second."""
STIFFNESS = 1e6
"""Stiffness of a crease in these units; with it, panels come to rest within a small part of the animation."""
WORK_BUDGET = 350_000
"""Number of steps times number of bodies; a product of this size takes about a third of a second."""
SIZE = (480, 400)
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


def preview(case: Case, path: str | Path) -> list[str]:
    """Write an animation (GIF, 3 s) of the panels while the drives move over their travel.

    Panels are rigid, creases are rotary springs at rest as folded, and the drives are slow compared with the panels. If
    the case has contact, each panel is cut into `PIECES` rigid pieces joined by springs, and panels touch. Without
    contact, panels pass through each other, as in the simulation. The animation neglects loads and gravity.

    Returns
    -------
    list of str
        Notes for the user, for example why nothing moves.

    Raises
    ------
    CaseError
        The path is not that of a GIF; the case is a film, a scissor array or a lattice; the scene does not lie in the x-z
        plane; a drive does not pull in this plane.
    """
    path = Path(path)
    _check_path(path)
    _check_kind(case)
    mechanism = _mechanism(build_scene(case))
    shots, intact = _run(mechanism, PIECES if mechanism.touching else 1)
    if not intact:  # the pieces have separated, so the preview shows whole panels without contact
        shots, _ = _run(mechanism, 1)
    _write_film(mechanism, shots, path)
    note = "nothing moves: the case has no drive, and the preview leaves out loads and gravity"
    return [] if mechanism.pulls else [note]


def _check_path(path: Path) -> None:
    """Refuse an output path that does not name a GIF file, before any work."""
    if path.is_dir():
        raise CaseError(f"{path}: is a folder; the preview is one file, give --out FILE.gif")
    if path.suffix.lower() != ".gif":
        raise CaseError(f"{path}: this is not a GIF file; the preview writes no other format; give --out FILE.gif")


def _check_kind(case: Case) -> None:
    """Refuse a case that has no panels and creases."""
    shown = "shown by the preview; it shows panels and creases of a [strip] or a [scene] only; run the case instead"
    if case.steps[0] != "deploy":
        raise CaseError(Fault("analysis", f'"{case.steps[0]}" is not {shown}'))
    if case.lattice is not None:
        raise CaseError(Fault("lattice", "is not shown by the preview, whose hinges have no length; run the case instead"))


# -- mechanism ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Joint:
    """Point that joins two panels, or a panel and the ground (-1), with or without a spring."""

    first: int
    second: int
    point: Points
    spring: bool


@dataclass(frozen=True)
class _Pull:
    """Drive of a point of a panel, or of the whole panel if `point` is None, along a direction."""

    panel: int
    point: Points | None
    direction: Points
    travel: float
    duration: float
    guide: bool


@dataclass(frozen=True)
class _Mechanism:
    """Panels, joints and drives; lengths in m.

    `bending` is the stiffness of the spring between two pieces over the stiffness of a crease.
    """

    lines: list[Points]
    thickness: float
    held: set[int]
    joints: list[_Joint]
    pulls: list[_Pull]
    touching: bool
    bending: float


def _mechanism(scene: Scene) -> _Mechanism:
    panels = outlines(scene)
    if not panels:
        raise CaseError(Fault("scene.bodies", "the preview draws plates, and no body has a `plate`; add a `plate`"))
    numbers = {panel.name: number for number, panel in enumerate(panels)}
    member = {body: numbers[panel] for body, panel in panel_of_body(scene).items()}
    bodies = {body.name: body for body in scene.bodies}
    return _Mechanism(
        lines=[panel.points for panel in panels],
        thickness=max(panel.thickness for panel in panels),
        held={member[body.name] for body in scene.bodies if body.held and body.name in member},
        joints=_joints(scene, bodies, member),
        pulls=[_pull(scene, drive, bodies, member) for drive in scene.drives],
        touching=scene.contact is not None and bool(scene.pairs),
        bending=_bending(scene, float(np.mean([length_of(panel.points) for panel in panels]))),
    )


def _place(element: ForceElement, bodies: dict[str, Body]) -> Points:
    """Position of the inner end of an element, x and z, m."""
    arm = np.array(element.point_inner)
    if element.inner == GROUND:
        return arm[[0, 2]]
    body = bodies[element.inner]
    return (np.array(body.position) + axes_of(body) @ arm)[[0, 2]]


def _joints(scene: Scene, bodies: dict[str, Body], member: dict[str, int]) -> list[_Joint]:
    """Joints for the elements between different panels, or between a panel and the ground."""
    joints = []
    for element in scene.elements:
        ends = [-1 if name == GROUND else member.get(name, -2) for name in (element.inner, element.outer)]
        if -2 in ends or ends[0] == ends[1]:
            continue
        spring = element.crease is not None or element.rotation[1] > 0
        joints.append(_Joint(max(ends), min(ends), _place(element, bodies), spring))
    return joints


def _bending(scene: Scene, length: float) -> float:
    """Bending stiffness of a piece of panel over the stiffness of a crease, limited to .5 to 10."""
    plates = {body.name: body.plate for body in scene.bodies}
    rigidity, crease = [], []
    for element in scene.elements:
        inner, outer = plates.get(element.inner), plates.get(element.outer)
        if element.kind == "panel" and inner is not None and outer is not None:
            rigidity.append(element.rotation[1] * (inner.length + outer.length) / 2)
        elif element.kind == "crease" and element.rotation[1] > 0:
            crease.append(element.twist_stiffness)
    if not rigidity:
        return 10.0
    if not crease:
        return 2.0
    return float(np.clip(np.median(rigidity) * PIECES / length / np.median(crease), 0.5, 10))


def _pull(scene: Scene, drive: Drive, bodies: dict[str, Body], member: dict[str, int]) -> _Pull:
    name = drive.moved[0] if drive.moved else f"crease {drive.crease}"
    direction = np.array(drive.direction)[[0, 2]]
    size = float(np.linalg.norm(direction))
    if size == 0:
        raise CaseError(Fault(f"drive of {name}", "has no component in the x-z plane of the preview; run the case instead"))
    if drive.travel is None:
        raise CaseError(Fault(f"drive of {name}", "is a turn, which the preview does not show; run the case instead"))
    rest = (direction / size, drive.travel, drive.travel / drive.fastest, drive.guide)
    if name in member:
        return _Pull(member[name], None, *rest)
    if name in bodies:  # a crease line, which moves the panels at its joints
        point = np.array(bodies[name].position)[[0, 2]]
        for element in scene.elements:
            other = {element.inner: element.outer, element.outer: element.inner}.get(name, "")
            if other in member:
                return _Pull(member[other], point, *rest)
    raise CaseError(Fault(f"drive of {name}", "moves no panel; `fsm check` lists the names of panels"))


# -- motion -------------------------------------------------------------------------------------------------


def _run(mechanism: _Mechanism, pieces: int) -> tuple[list[Shot], bool]:
    """Frames of the motion, and whether the pieces of all panels stayed together."""
    import pymunk

    scale = UNIT / float(np.mean([length_of(line) for line in mechanism.lines]))
    moving = max(1, (len(mechanism.lines) - len(mechanism.held)) * pieces)
    steps = max(10, min(300, WORK_BUDGET // (moving * FRAMES)))
    dt = FILM_TIME / (FRAMES * steps)
    space = pymunk.Space()
    space.iterations, space.damping, space.collision_slop = 30, 1e-4, 0.05
    rows = [_add_panel(space, mechanism, number, pieces, scale) for number in range(len(mechanism.lines))]
    inertia = (UNIT / pieces) ** 3 / (12 * UNIT)
    # number of steps for which the explicit integration is stable
    limit = 0.1 * inertia / dt**2 / (max(1.0, mechanism.bending) if pieces > 1 else 1.0)
    _join(space, mechanism, rows, min(STIFFNESS, limit), scale)
    hooks = [_hook(space, pull, rows, scale) for pull in mechanism.pulls]
    shots: list[Shot] = []
    for frame in range(FRAMES):
        shots.append([[np.array(_ends(shape)) / scale for shape in row] for row in rows])
        for pull, hook in zip(mechanism.pulls, hooks, strict=True):
            speed = _speed(mechanism, pull, frame) * scale
            for body in hook:
                body.velocity = tuple(pull.direction * speed)
        for _ in range(steps):
            space.step(dt)
    return shots, max(map(_gap, shots)) * scale < 0.05 * UNIT


def _speed(mechanism: _Mechanism, pull: _Pull, frame: int) -> float:
    """Speed of a drive after a frame, m per second of animation; the slowest drive takes the whole animation."""
    share = pull.duration / max(other.duration for other in mechanism.pulls)
    last = (FRAMES - 1) * share
    left = min(1.0, max(0.0, last - frame))  # fraction of the time to the next frame
    return left * pull.travel / last * FRAMES / FILM_TIME


def _add_panel(space: Any, mechanism: _Mechanism, number: int, pieces: int, scale: float) -> list[Any]:
    """Rigid pieces of one panel as pymunk shapes; pieces of a held or driven panel cannot move by themselves."""
    import pymunk

    line = mechanism.lines[number] * scale
    driven = any(pull.panel == number and pull.point is None for pull in mechanism.pulls)
    free = not driven and number not in mechanism.held
    knots = points_at(line, np.linspace(0, length_of(line), 1 + (pieces if free else PIECES)))
    row = []
    for a, b in pairwise(knots):
        length, centre = float(np.linalg.norm(b - a)), (a + b) / 2
        if free:
            body = pymunk.Body(length / UNIT, length**3 / (12 * UNIT))
        else:
            body = pymunk.Body(body_type=pymunk.Body.KINEMATIC if driven else pymunk.Body.STATIC)
        body.position = tuple(centre)
        radius = float(np.clip(mechanism.thickness * scale / 2, 0.3, 2.0))
        shape = pymunk.Segment(body, tuple(a - centre), tuple(b - centre), radius)
        shape.filter = pymunk.ShapeFilter(group=number + 1 if mechanism.touching and pieces > 1 else 1)
        space.add(body, shape)
        row.append(shape)
    return row


def _join(space: Any, mechanism: _Mechanism, rows: list[list[Any]], stiffness: float, scale: float) -> None:
    """Add pivots and rotary springs between the pieces of a panel and between panels."""
    for row in rows:
        for a, b in pairwise(row):
            _pivot(space, a.body, b.body, a.body.local_to_world(a.b), stiffness * mechanism.bending)
    for joint in mechanism.joints:
        point = joint.point * scale
        first = _nearest(rows[joint.first], point)
        second = space.static_body if joint.second < 0 else _nearest(rows[joint.second], point)
        _pivot(space, first, second, tuple(point), stiffness if joint.spring else 0.0)


def _pivot(space: Any, a: Any, b: Any, point: Any, stiffness: float) -> None:
    import pymunk

    if pymunk.Body.DYNAMIC not in (a.body_type, b.body_type):
        return
    pivot = pymunk.PivotJoint(a, b, a.world_to_local(point), b.world_to_local(point))
    pivot.collide_bodies = False
    space.add(pivot)
    if stiffness > 0:
        space.add(pymunk.DampedRotarySpring(a, b, 0.0, stiffness, 0.02 * stiffness))


def _nearest(row: list[Any], point: Points) -> Any:
    """Piece of a panel that is closest to a point."""
    return min(row, key=lambda shape: float(distance(point[None], np.array(_ends(shape)))[0])).body


def _ends(shape: Any) -> tuple[Any, Any]:
    return shape.body.local_to_world(shape.a), shape.body.local_to_world(shape.b)


def _hook(space: Any, pull: _Pull, rows: list[list[Any]], scale: float) -> list[Any]:
    """Bodies that a drive moves: a hook at its point, or the whole panel."""
    import pymunk

    if pull.point is None:
        return [shape.body for shape in rows[pull.panel]]
    point = tuple(pull.point * scale)
    hook = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    hook.position = point
    body = _nearest(rows[pull.panel], pull.point * scale)
    if pull.guide:
        joint: Any = pymunk.PivotJoint(hook, body, (0, 0), body.world_to_local(point))
    else:
        across = np.array([-pull.direction[1], pull.direction[0]]) * 100 * UNIT
        joint = pymunk.GrooveJoint(hook, body, tuple(-across), tuple(across), body.world_to_local(point))
    joint.max_force = 1e3 * STIFFNESS / UNIT  # the joint yields when the panels are taut
    space.add(hook, joint)
    return [hook]


def _gap(shot: Shot) -> float:
    """Largest distance between two ends of pieces that should coincide, m."""
    gaps = [float(np.linalg.norm(a[1] - b[0])) for row in shot for a, b in pairwise(row)]
    return max(gaps, default=0.0)


# -- frames -------------------------------------------------------------------------------------------------


def _write_film(mechanism: _Mechanism, shots: list[Shot], path: Path) -> None:
    """Draw every frame at twice its size, reduce it, and write all frames as a GIF that repeats without end."""
    from PIL import Image, ImageDraw, ImageFont

    points = np.array([end for shot in shots for row in shot for piece in row for end in piece])
    low, high = points.min(axis=0), points.max(axis=0)
    width, height = 2 * SIZE[0], 2 * SIZE[1]
    margin, top = 50, 90
    room = np.array([width - 2 * margin, height - margin - top])
    scale = float(np.min(room / np.maximum(high - low, 1e-9)))
    left = (width - scale * (high[0] - low[0])) / 2
    font = ImageFont.load_default(size=26)
    pictures = []
    for frame, shot in enumerate(shots):
        picture = Image.new("RGB", (width, height), "white")
        draw = ImageDraw.Draw(picture)
        for number, row in enumerate(shot):
            knots = [row[0][0], *(piece[1] for piece in row)]
            pixels = [(left + scale * (x - low[0]), height - margin - scale * (z - low[1])) for x, z in knots]
            colour = "#777777" if number in mechanism.held else COLOURS[number % len(COLOURS)]
            draw.line(pixels, fill=colour, width=7, joint="curve")
        draw.text((margin, 20), _caption(mechanism, frame), fill="black", font=font)
        small = picture.reduce(2)
        pictures.append(small.quantize(48, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE))
    path.parent.mkdir(parents=True, exist_ok=True)
    step = round(1000 * FILM_TIME / FRAMES)
    with atomic_write(path) as part:
        durations = [step] * (FRAMES - 1) + [20 * step]
        pictures[0].save(part, save_all=True, append_images=pictures[1:], loop=0, duration=durations)


def _caption(mechanism: _Mechanism, frame: int) -> str:
    if not mechanism.pulls:
        return "sketch, no drive"
    first = mechanism.pulls[0]
    share = first.duration / max(pull.duration for pull in mechanism.pulls)
    travel = first.travel * min(1.0, frame / (FRAMES - 1) / share)
    return f"sketch, travel {shown(travel, 'm')} of {shown(first.travel, 'm')}"
