"""Bodies and ideal joints of a wing."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from fsm.case.derived.frame_bodies import matrix_quaternion, quaternion_matrix
from fsm.case.models.coupling import SceneCoupling
from fsm.case.models.event import Event
from fsm.case.models.flexible import SceneBeam, SceneFilm, SceneFrame
from fsm.case.models.joint import SceneJoint
from fsm.case.models.scene import GROUND, Body, Plate, Scene
from fsm.case.models.wing import Wing
from fsm.errors import Fault


class _Part(NamedTuple):
    """Yoke or panel: name, sizes (length, width, thickness), m, and mass, kg."""

    name: str
    size: tuple[float, float, float]
    mass: float


def wing_faults(wing: Wing, scene: Scene | None) -> Iterator[Fault]:
    """Faults of a wing beside the parts of a [scene]."""
    bodies = {GROUND} | {body.name for body in (() if scene is None else scene.bodies)}
    if wing.base not in bodies:
        yield Fault("wing.base", f'must be "ground" or a body of [scene]; it is {wing.base!r}')
    for name in sorted(bodies & set(wing.parts[1:])):
        yield Fault("wing", f"a body of [scene] has the name {name!r} of a part of the wing; rename it")


def with_wing(wing: Wing, scene: Scene | None) -> Scene:
    """Scene of a wing without faults, with the parts of a [scene] beside it.

    In the deployed wing all parts lie in one plane. With turns about the hinge axis of alternating senses, positive angles
    fold it as an accordion. Hinge lines between parts lie half a gap off this plane, on the side on which they fold.
    """
    scene = Scene() if scene is None else scene
    bodies, joints, sides = list[Body](), list[SceneJoint](), list[SceneJoint]()
    along, axis = (np.array(v) / np.linalg.norm(v) for v in (wing.along, wing.hinge_axis))
    axes = np.array([along, axis, np.cross(along, axis)])
    gap = wing.thickness if wing.gap is None else wing.gap
    point, turned, before, sense, side = np.array(wing.at), 0.0, wing.base, -1.0, 0.0
    beside = {f"panel {number}": number for number in wing.side_panels}
    for part, name, angle in zip(_parts(wing), wing.hinges, wing.stowed_angles, strict=True):
        turned += sense * angle
        forward, up = _in_plane(turned)
        centre = point + (0.5 * part.size[0] * forward - side * up) @ axes
        bodies.append(_body(part, centre, axes, turned))
        acting: dict[str, Any] = dict(wing.acting(name))
        joints.append(SceneJoint(
            name="root" if name == "root" else f"hinge {name}", kind="revolute", first=before, second=part.name,
            at=tuple(point.tolist()), axis=tuple((sense * axis).tolist()), angle=angle, **acting,
        ))  # fmt: skip
        sense, before = -sense, part.name
        side = -0.5 * sense * gap
        point = centre + (0.5 * part.size[0] * forward + side * up) @ axes
        if part.name in beside:
            face = -sense * up @ axes  # on which the next panel would be
            body, joint = _side_panel(wing, beside[part.name], bodies[-1], forward @ axes, axis, face)
            bodies.append(body)
            sides.append(joint)
    bending = [body for body in bodies if body.name in wing.flexible_parts]
    hinges = [_on_edges(joint, wing, bending) for joint in (*joints, *sides)]
    clamps = [_on_middles(joint, bending) for joint in _clamps(wing, bodies)]
    parts: dict[str, Any] = {
        "bodies": [body for body in bodies if body not in bending], "joints": [*hinges, *clamps],
        "couplings": _cables(wing, joints),
    } | _flexible_panels(wing, bending)  # fmt: skip
    return scene.model_copy(update={name: (*getattr(scene, name), *more) for name, more in parts.items()})


def _flexible_panels(wing: Wing, panels: Sequence[Body]) -> dict[str, Any]:
    """Films or beams in place of rigid panels, and frames in the middle of them for hold-downs."""
    bends = wing.flexible
    if bends is None:
        return {}
    films, beams, frames = list[SceneFilm](), list[SceneBeam](), list[SceneFrame]()
    for body in panels:
        assert body.plate is not None
        length, width, thickness = body.plate.length, body.plate.width, body.plate.thickness
        shared: dict[str, Any] = {
            "name": body.name, "young": bends.young, "density": body.mass / (length * width * thickness),
            "width": width, "thickness": thickness, "viscosity": bends.viscosity,
        }  # fmt: skip
        if bends.kind == "film":
            turned = {"position": body.position, "orientation": body.orientation, "mesh": bends.mesh}
            films.append(SceneFilm(**shared, **turned, length=length, poisson=bends.poisson))
        else:
            half = 0.5 * length * quaternion_matrix(body.orientation)[:, 0]
            start, end = (tuple((np.array(body.position) + way * half).tolist()) for way in (-1.0, 1.0))
            beams.append(SceneBeam(**shared, start=start, end=end, elements=bends.mesh[0]))
        if wing.hold_downs:
            at = (0.0, 0.0) if bends.kind == "film" else (0.5 * length,)
            frames.append(SceneFrame(name=f"{body.name}.middle", on=body.name, at=at))
    return {"films": films, "beams": beams, "frames": frames}


def _on_edges(joint: SceneJoint, wing: Wing, panels: Sequence[Body]) -> SceneJoint:
    """Hinge on the nearest edges or ends of the flexible panels that it joins."""
    update, beam = {}, wing.flexible is not None and wing.flexible.kind == "beam"
    for end in ("first", "second"):
        body = next((body for body in panels if body.name == getattr(joint, end)), None)
        if body is None or body.plate is None:
            continue
        x, y, _ = (np.array(joint.at) - np.array(body.position)) @ quaternion_matrix(body.orientation)
        along = beam or abs(x) / body.plate.length > abs(y) / body.plate.width
        names = (("start", "end") if beam else ("left", "right")) if along else ("bottom", "top")
        update[end] = f"{body.name}.{names[int((x if along else y) > 0.0)]}"
    return joint.model_copy(update=update)


def _on_middles(joint: SceneJoint, panels: Sequence[Body]) -> SceneJoint:
    """Hold-down on the middles of the flexible panels that it joins."""
    names = {body.name for body in panels}
    ends = {end: getattr(joint, end) for end in ("first", "second")}
    return joint.model_copy(update={end: f"{name}.middle" for end, name in ends.items() if name in names})


def wing_events(wing: Wing) -> list[Event]:
    """Releases of all hold-downs."""
    return [
        Event(
            name=f"hold-down {number}", when=f"time > {clamp.release!r} s",
            do=tuple(f"release {_clamp_name(number, part)}" for part in (clamp.parts or wing.parts)[1:]),
        )
        for number, clamp in enumerate(wing.hold_downs, 1)
    ]  # fmt: skip


def _clamp_name(number: int, part: str) -> str:
    return f"hold-down {number} of {part}"


def _clamps(wing: Wing, bodies: Sequence[Body]) -> Iterator[SceneJoint]:
    """Fixed joints of all hold-downs, from each of their parts to the next one."""
    centres = {body.name: body.position for body in bodies}
    for number, clamp in enumerate(wing.hold_downs, 1):
        for first, second in pairwise(clamp.parts or wing.parts):
            ends = [wing.base if name == "base" else name for name in (first, second)]
            at = centres[second if second in centres else first]
            yield SceneJoint(name=_clamp_name(number, second), kind="fixed", first=ends[0], second=ends[1], at=at)


def _side_panel(
    wing: Wing, number: int, panel: Body, forward: np.ndarray, axis: np.ndarray, face: np.ndarray
) -> tuple[Body, SceneJoint]:
    """Panel of the second row and its hinge: it turns about an edge of a panel, and lies on a face of it at 180 degrees.

    Directions of the panel are inertial: its length, the hinge axis of the wing, and the outward normal of the face.
    """
    row = wing.side
    assert row is not None
    width, gap = row.width or wing.width, wing.thickness if wing.gap is None else wing.gap
    out = axis if row.edge == "left" else -axis
    about = np.cross(out, face)
    turn = quaternion_matrix((math.cos(0.5 * row.stowed), *(math.sin(0.5 * row.stowed) * about)))
    at = np.array(panel.position) + 0.5 * wing.width * out + 0.5 * gap * face
    centre = at + turn @ (0.5 * width * out - 0.5 * gap * face)
    part = _Part(f"side {number}", (wing.length, width, wing.thickness), row.mass or wing.panel_mass * width / wing.width)
    turned = turn @ quaternion_matrix(panel.orientation)
    acting: dict[str, Any] = dict(wing.acting(f"side {number}"))
    joint = SceneJoint(
        name=f"hinge side {number}", kind="revolute", first=panel.name, second=part.name, at=tuple(at.tolist()),
        axis=tuple(about.tolist()), angle=row.stowed, **acting,
    )  # fmt: skip
    return _plate(part, centre, turned), joint


def _cables(wing: Wing, joints: Sequence[SceneJoint]) -> Iterator[SceneCoupling]:
    """Cables between neighbouring hinges, whose angles stay in the ratio of the stowed ones."""
    elastic = {} if wing.cable is None else wing.cable.model_dump(exclude_none=True)
    for (inner, outer), name in zip(pairwise(joints), wing.hinges[1:], strict=True):
        if wing.synchronisation is not None and f"cable {name}" not in wing.failed:
            yield SceneCoupling(
                name=f"cable {name}", kind="gear", joints=(inner.name, outer.name),
                parameters={"ratio": inner.angle / outer.angle, **elastic},
            )  # fmt: skip


def _parts(wing: Wing) -> Iterator[_Part]:
    yoke = wing.yoke
    if yoke is not None:
        yield _Part("yoke", (yoke.length, yoke.width or wing.width, yoke.thickness or wing.thickness), yoke.mass)
    for number in range(1, wing.panels + 1):
        yield _Part(f"panel {number}", (wing.length, wing.width, wing.thickness), wing.panel_mass)


def _in_plane(angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Direction of a part, and its normal, in the axes of the wing; `angle` is about the hinge axis."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c, 0.0, -s]), np.array([s, 0.0, c])


def _body(part: _Part, centre: np.ndarray, axes: np.ndarray, turned: float) -> Body:
    """Homogeneous plate whose length lies along the wing."""
    forward, up = _in_plane(turned)
    return _plate(part, centre, np.array([forward @ axes, axes[1], up @ axes]).T)


def _plate(part: _Part, centre: np.ndarray, rotation: np.ndarray) -> Body:
    """Homogeneous plate with its axes as columns (3, 3)."""
    length, width, thickness = part.size
    squares = length**2, width**2, thickness**2
    inertia = tuple(part.mass * (sum(squares) - own) / 12.0 for own in squares)
    return Body(
        name=part.name, mass=part.mass, inertia=inertia, position=tuple(centre.tolist()),
        orientation=matrix_quaternion(rotation), plate=Plate(length=length, width=width, thickness=thickness),
    )  # fmt: skip
