"""Compiles a scissor array to a system: bars, hinges, supports, forces."""

from __future__ import annotations

import math

import numpy as np

from fsm.case.derived.scissor import Array, array_at
from fsm.case.models.materials import DAMPING, Material
from fsm.case.models.scissor import BarSection, HingeJoint, PointForce, PointSupport, Scissor, Stop
from fsm.model.bodies.drive import time_function
from fsm.model.nodes.beams.bars import BarMaterial, BarMesh, BarNodes, end_to_end
from fsm.model.nodes.beams.hinge import HingeGroup, Latches
from fsm.model.nodes.group import ElementGroup
from fsm.model.nodes.loading import Forcing, Loading
from fsm.model.nodes.mesh import Mesh, node_pattern
from fsm.model.nodes.system.scissor_system import ScissorSystem


def compile_array(
    scissor: Scissor,
    section: BarSection,
    material: Material,
    supports: tuple[PointSupport, ...],
    forces: tuple[PointForce, ...],
    hinge: HingeJoint | None = None,
    stop: Stop | None = None,
    gravity: tuple[float, float] = (0.0, 0.0),
) -> ScissorSystem:
    """System of an array with flexible bars, from a checked case (`fsm.case.checks.check_scissor`)."""
    array = array_at(scissor, scissor.initial_angle)
    damping = DAMPING if material.damping is None else material.damping
    bar_material = BarMaterial(
        material.young, material.poisson, material.density, section.width, section.height, damping
    )
    mesh, points = _bars(scissor, array, bar_material)
    units = _units(mesh)
    order = end_to_end(units)
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    mesh = mesh.renumbered(order)
    points = {name: int(2 * place[first // 2]) for name, first in points.items()}
    hinges, names = _hinges(scissor, array, mesh, points, hinge, stop)
    latches = Latches(hinges, names) if hinges is not None and stop is not None and stop.latch else None
    groups: tuple[ElementGroup, ...] = (mesh.group(),) if hinges is None else (mesh.group(), hinges)
    count = len(mesh.values)
    fixed = np.zeros(2 * count, dtype=bool)
    for support in supports:
        first = points[support.point]
        across = support.direction is None, support.direction is None
        if support.direction is not None:
            across = support.direction[0] == 0.0, support.direction[1] == 0.0
        fixed[first], fixed[first + 1] = across
    whole = Mesh(
        np.array(mesh.values).ravel(), fixed, groups, (), np.zeros((0, 4), dtype=np.int64), tuple(mesh.names),
        node_pattern(count, 2, groups, ()), 2, np.array(sorted(mesh.positions)),
    )  # fmt: skip
    forcings = tuple(_forcing(force, array, points, 2 * count) for force in forces)
    return ScissorSystem(
        whole, Loading(forcings, gravity=(*gravity, 0.0)), points, tuple(mesh.bars), bar_material, hinges, latches
    )


def _bars(scissor: Scissor, array: Array, material: BarMaterial) -> tuple[BarMesh, dict[str, int]]:
    """All bars, in the order of the array."""
    mesh = BarMesh(scissor.element, material)
    points = {name: mesh.position(at, name) for name, at in array.points.items()}
    lower = min(max(round(scissor.elements_per_bar * scissor.hinge), 1), scissor.elements_per_bar - 1)
    upper = scissor.elements_per_bar - lower
    for bar in array.bars:
        counts = (lower, upper) if bar.points[0].startswith("b") else (upper, lower)
        mesh.bar(bar.name, [points[name] for name in bar.points], counts)
    return mesh, points


def _units(mesh: BarMesh) -> list[list[int]]:
    """Vectors of the bars of each unit; the vectors of its left ends come first."""
    units = []
    vectors = mesh.group().vectors // 2
    for first, second in zip(mesh.bars[::2], mesh.bars[1::2], strict=True):
        left = [int(first.positions[0] // 2), int(second.positions[0] // 2)]
        used = np.concatenate([vectors[first.elements].ravel(), vectors[second.elements].ravel()])
        units.append([*left, *(int(i) for i in dict.fromkeys(used.tolist()))])
    return units


def _hinges(
    scissor: Scissor, array: Array, mesh: BarMesh, points: dict[str, int], hinge: HingeJoint | None, stop: Stop | None
) -> tuple[HingeGroup | None, tuple[str, ...]]:
    """Hinges with a moment (None if there are none), and their names."""
    points_of: dict[str, list[str]] = {"middle": [], "tips": []}
    if stop is not None or (hinge is not None and hinge.at in ("middle", "all")):
        points_of["middle"] = [f"h{k + 1}" for k in range(array.units)]
    if hinge is not None and hinge.at in ("tips", "all"):
        points_of["tips"] = [name for name in array.points if name[0] in "ab"]
    found = [
        (slopes, kind, name)
        for kind, names in points_of.items()
        for name, slopes in ((name, _directions_at(mesh, points[name])) for name in names)
        if len(slopes) == 2
    ]
    if not found:
        return None, ()
    vectors = np.array([slopes for slopes, _, _ in found], dtype=np.int64)
    start = np.array(mesh.values)
    p, q = start[vectors[:, 0] // 2], start[vectors[:, 1] // 2]
    initial = np.arctan2(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0], np.sum(p * q, axis=1))
    law = np.zeros((len(found), 8))
    law[:, 4], law[:, 5] = 1.0, math.inf
    for k, (_, kind, _) in enumerate(found):
        if hinge is not None and hinge.at in ("all", kind):
            law[k, :5] = hinge.rest_turn, hinge.stiffness, hinge.damping, hinge.friction_moment, hinge.friction_speed
        if stop is not None and kind == "middle":
            law[k, 5:] = 2.0 * (scissor.initial_angle - stop.angle), stop.stiffness, stop.damping
    group = HingeGroup(vectors, initial, _senses(scissor, mesh, points, vectors, initial), law)
    return group, tuple(name for _, _, name in found)


def _directions(bar: BarNodes) -> np.ndarray:
    """First coordinates of the directions at the nodes of a bar; these are its sections, or the slopes of a cable
    element.
    """
    return bar.sections if len(bar.sections) else bar.slopes


def _directions_at(mesh: BarMesh, point: int) -> tuple[int, ...]:
    """First coordinates of the directions of the bars at a point; the rising bar comes first."""
    return tuple(int(_directions(bar)[i]) for bar in mesh.bars for i in np.flatnonzero(bar.positions == point))


def _senses(
    scissor: Scissor, mesh: BarMesh, points: dict[str, int], vectors: np.ndarray, initial: np.ndarray
) -> np.ndarray:
    """Sense of rotation of each hinge in a small deployment of rigid bars."""
    later = array_at(scissor, scissor.initial_angle * (1.0 - 1e-4)).points
    named = {first: name for name, first in points.items()}
    direction: dict[int, np.ndarray] = {}
    for bar in mesh.bars:
        nodes = [i for i, first in enumerate(bar.positions) if int(first) in named]
        # the bars are rigid in this state, so all sections of a bar equal those of its first half
        from_, to = (later[named[int(bar.positions[i])]] for i in nodes[:2])
        for at in nodes:
            direction[int(_directions(bar)[at])] = np.subtract(to, from_)
    p, q = (np.array([direction[int(first)] for first in vectors[:, side]]) for side in (0, 1))
    angle = np.arctan2(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0], np.sum(p * q, axis=1))
    turn = np.remainder(angle - initial + math.pi, 2.0 * math.pi) - math.pi
    return np.where(turn < 0.0, -1.0, 1.0)


def _forcing(force: PointForce, array: Array, points: dict[str, int], count: int) -> Forcing:
    first = points[force.point]
    vector = np.zeros(count)
    if force.force is not None:
        vector[first : first + 2] = force.force
    elif force.radial is not None and array.centre is not None:
        away = np.subtract(array.points[force.point], array.centre)
        vector[first : first + 2] = force.radial * away / np.linalg.norm(away)
    return Forcing(vector, time_function(force.time))
