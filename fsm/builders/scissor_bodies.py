"""Scene of a scissor array with rigid bars: a body for each bar, and a stiff spring element for each hinge.

The axes x, y of the array are x, z of the scene. The parts of a hinge separate by the force over the stiffness of the
springs. This stiffness is far above the axial stiffness of a bar, and low enough for double precision.
"""

from __future__ import annotations

import math

import numpy as np

from fsm.case.derived.scissor import Array, Bar, array_at
from fsm.case.models.loads import Load
from fsm.case.models.materials import Material
from fsm.case.models.scene import GROUND, Body, ForceElement, Plate, Scene
from fsm.case.models.scissor import BarSection, HingeJoint, PointForce, PointSupport, Scissor

_JOINED = 200.0
"""Stiffness of the springs that join rigid bars, relative to the axial stiffness EA/L of a bar of mean length."""


def build_bodies(
    scissor: Scissor,
    section: BarSection,
    material: Material,
    supports: tuple[PointSupport, ...],
    forces: tuple[PointForce, ...],
    hinge: HingeJoint | None = None,
    gravity: tuple[float, float] = (0.0, 0.0),
) -> Scene:
    """Scene of an array with rigid bars, including springs and dampers of hinges, without dry friction and stops."""
    array = array_at(scissor, scissor.initial_angle)
    bodies = {bar.name: _body(bar, array, section, material) for bar in array.bars}
    at_point: dict[str, list[Bar]] = {name: [] for name in array.points}
    for bar in array.bars:
        for name in bar.points:
            at_point[name].append(bar)
    mean = float(np.mean([body.plate.length for body in bodies.values() if body.plate is not None]))
    joined = _JOINED * material.young * section.width * section.height / mean
    elements = [
        _hinge(joined, name, array, bodies, meeting[0].name, meeting[1].name, hinge)
        for name, meeting in at_point.items()
        if len(meeting) == 2
    ]
    for support in supports:
        elements.append(_support(joined, support, array, bodies, at_point[support.point][0].name))
    loads = [_load(force, array, bodies[at_point[force.point][0].name]) for force in forces]
    return Scene(
        bodies=tuple(bodies.values()),
        elements=tuple(elements),
        loads=tuple(loads),
        gravity=(gravity[0], 0.0, gravity[1]),
    )


def _body(bar: Bar, array: Array, section: BarSection, material: Material) -> Body:
    """Body of a bar from its two halves, with the x axis from end to end."""
    start, middle, end = (np.array(array.points[name]) for name in bar.points)
    halves = [(middle - start, 0.5 * (start + middle)), (end - middle, 0.5 * (middle + end))]
    area = section.width * section.height
    masses = [material.density * area * float(np.linalg.norm(half)) for half, _ in halves]
    mass = sum(masses)
    centre = sum(m * at for m, (_, at) in zip(masses, halves, strict=True)) / mass
    along = end - start
    angle = math.atan2(along[1], along[0])
    inertia = sum(
        m * ((float(half @ half) + section.height**2) / 12.0 + float((at - centre) @ (at - centre)))
        for m, (half, at) in zip(masses, halves, strict=True)
    )
    length = float(np.linalg.norm(along))
    across = mass / 12.0 * (section.width**2 + section.height**2)
    return Body(
        name=bar.name,
        mass=mass,
        inertia=(across, float(inertia), float(inertia) + across),
        position=(float(centre[0]), 0.0, float(centre[1])),
        orientation=(math.cos(angle / 2.0), 0.0, -math.sin(angle / 2.0), 0.0),
        plate=Plate(length=length, width=section.width, thickness=section.height),
    )


def _local(body: Body, point: tuple[float, float]) -> tuple[float, float, float]:
    """Coordinates of a point of the plane in the axes of a body."""
    angle = -2.0 * math.atan2(body.orientation[2], body.orientation[0])
    x, z = point[0] - body.position[0], point[1] - body.position[2]
    cosine, sine = math.cos(angle), math.sin(angle)
    return cosine * x + sine * z, 0.0, cosine * z - sine * x


def _hinge(
    joined: float, name: str, array: Array, bodies: dict[str, Body], inner: str, outer: str, hinge: HingeJoint | None
) -> ForceElement:
    a, b = bodies[inner], bodies[outer]
    initial = 2.0 * (math.atan2(a.orientation[2], a.orientation[0]) - math.atan2(b.orientation[2], b.orientation[0]))
    initial = math.remainder(initial, 2.0 * math.pi)  # the angles of two bars of a ring may differ by more than pi
    sense = 1.0 if initial < 0.0 else -1.0  # rotation about y of the first bar relative to the second in the deployment
    resists = hinge is not None and (hinge.at == "all" or (hinge.at == "middle") == name.startswith("h"))
    stiffness = hinge.stiffness if hinge is not None and resists else 0.0
    damping = hinge.damping if hinge is not None and resists else 0.0
    rest = initial + (sense * hinge.rest_turn if hinge is not None and resists else 0.0)
    point = array.points[name]
    return ForceElement(
        name=f"hinge {name}",
        inner=inner,
        outer=outer,
        point_inner=_local(a, point),
        point_outer=_local(b, point),
        translation=(joined, 0.0, joined),
        translation_damping=(_damping(joined, a.mass + b.mass), 0.0, _damping(joined, a.mass + b.mass)),
        rotation=(0.0, stiffness, 0.0),
        rotation_damping=(0.0, damping, 0.0),
        rest_angle=rest,
        initial_angle=initial,
    )


def _damping(joined: float, mass: float) -> float:
    """Damping of the stiff springs of a hinge (N/m), N s/m, against vibrations of bars of this mass (kg) on the springs."""
    return math.sqrt(joined * mass)


def _support(joined: float, support: PointSupport, array: Array, bodies: dict[str, Body], bar: str) -> ForceElement:
    held = support.direction is None, support.direction is None
    if support.direction is not None:
        held = support.direction[0] == 0.0, support.direction[1] == 0.0
    x, z = array.points[support.point]
    damping = _damping(joined, bodies[bar].mass)
    return ForceElement(
        name=f"support {support.point}",
        inner=bar,
        outer=GROUND,
        point_inner=_local(bodies[bar], (x, z)),
        point_outer=(x, 0.0, z),
        translation=(joined if held[0] else 0.0, 0.0, joined if held[1] else 0.0),
        translation_damping=(damping if held[0] else 0.0, 0.0, damping if held[1] else 0.0),
    )


def _load(force: PointForce, array: Array, body: Body) -> Load:
    x, z = force.force or (0.0, 0.0)
    if force.radial is not None and array.centre is not None:
        away = np.subtract(array.points[force.point], array.centre)
        x, z = (float(c) for c in force.radial * away / np.linalg.norm(away))
    return Load(
        body=body.name, point=_local(body, array.points[force.point]), force=(x, 0.0, z), time=force.time
    )
