"""Bodies and ideal joints of a wing."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from fsm.case.derived.frame_bodies import matrix_quaternion
from fsm.case.models.coupling import SceneCoupling
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
    for name in sorted(bodies & {part.name for part in _parts(wing)}):
        yield Fault("wing", f"a body of [scene] has the name {name!r} of a part of the wing; rename it")


def with_wing(wing: Wing, scene: Scene | None) -> Scene:
    """Scene of a wing without faults, with the parts of a [scene] beside it.

    In the deployed wing all parts lie in one plane. With turns about the hinge axis of alternating senses, positive angles
    fold it as an accordion. Hinge lines between parts lie half a gap off this plane, on the side on which they fold.
    """
    scene = Scene() if scene is None else scene
    bodies, joints = [], []
    along, axis = (np.array(v) / np.linalg.norm(v) for v in (wing.along, wing.hinge_axis))
    axes = np.array([along, axis, np.cross(along, axis)])
    gap = wing.thickness if wing.gap is None else wing.gap
    point, turned, before, sense, side = np.array(wing.at), 0.0, wing.base, -1.0, 0.0
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
    parts: dict[str, Any] = {"bodies": bodies, "joints": joints, "couplings": _cables(wing, joints)}
    return scene.model_copy(update={name: (*getattr(scene, name), *more) for name, more in parts.items()})


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
    length, width, thickness = part.size
    forward, up = _in_plane(turned)
    rotation = np.array([forward @ axes, axes[1], up @ axes]).T
    squares = length**2, width**2, thickness**2
    inertia = tuple(part.mass * (sum(squares) - own) / 12.0 for own in squares)
    return Body(
        name=part.name, mass=part.mass, inertia=inertia, position=tuple(centre.tolist()),
        orientation=matrix_quaternion(rotation), plate=Plate(length=length, width=width, thickness=thickness),
    )  # fmt: skip
