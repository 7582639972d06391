"""Points of films, cables, beams and sheets that touch bodies and obstacles: frames that each represent an area.

A film has two Gauss points along each side of each element, or the number in `contact.points_per_segment`, or more near
round obstacles. A cable and a beam have such points along each element; the area is diameter or width times length. The sum
of the areas does not depend on the mesh. Flexible facets and facets of bars have a grid of points on each triangle. A round
obstacle penetrates by at most 2 % of its radius between these points, and a plate or a box has four of them along a side.

Sides of a contact pair, and the geometry of the pair that follows from them.

A side is a surface, the plate of a body, a group of plates, an obstacle, a film, a cable or a sheet. In a pair that names
its geometry, a side is a body or the ground.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from fsm.case.models.flexible import SceneBeam, SceneCable, SceneFilm, SceneFrame, unstressed_length
from fsm.case.models.flexible_facets import SHEET
from fsm.case.models.scene import GROUND, ContactPair, Scene
from fsm.case.models.touching import SheetPoint, TouchingSheet

MOST = 5
"""Largest number of points along a side of an element."""
_ALONG_SIDE = 4
"""Points of a sheet along the smaller side of the face of a plate or a box."""
_SUNK = 0.02
"""Ratio of the depth between two points to the radius of a round obstacle, above which more points are used."""


class ContactPoint(NamedTuple):
    """Point of a film or a cable for contact.

    Attributes
    ----------
    frame : SceneFrame
        Frame at the point; the contact force has no moment about it.
    area, radius, mass : m^2, m, kg
        Area that the point represents, half the thickness or the diameter, and mass of the area.
    """

    frame: SceneFrame
    area: float
    radius: float
    mass: float


def contact_points(scene: Scene) -> dict[str, tuple[ContactPoint, ...]]:
    """Points of every film, cable and beam, and of flexible facets, that are in a contact pair."""
    if scene.contact is None:
        return {}
    named = {name for pair in scene.pairs for name in (pair.first, pair.second)}
    found = {film.name: _of_film(film, points_along(scene, film)) for film in scene.films if film.name in named}
    if scene.built.touching is not None and SHEET in named:
        found[SHEET] = _of_sheet(scene.built.touching, sheet_parts(scene))
    return found | {name: _of_line(line, points_along(scene, line)) for name, line in scene.lines.items() if name in named}


def points_along(scene: Scene, part: SceneFilm | SceneCable | SceneBeam) -> int:
    """Points along each side of the elements of a film, a cable or a beam in contact.

    There are more than `contact.points_per_segment` points if a round obstacle would otherwise penetrate too far
    between them.
    """
    assert scene.contact is not None
    count = scene.contact.points_per_segment
    others = {name for pair in scene.pairs for name in (pair.first, pair.second) if part.name in (pair.first, pair.second)}
    radii = [o.radius for o in scene.obstacles if o.name in others and o.radius is not None]
    while radii and count < MOST and penetration_between(part, count, min(radii)) > _SUNK * min(radii):
        count += 1
    return count


def point_spacing(part: SceneFilm | SceneCable | SceneBeam, count: int) -> tuple[float, float]:
    """Largest distances of neighbouring points along both sides of an element, m; zero across a cable or a beam."""
    places = np.concatenate([[-1.0], np.polynomial.legendre.leggauss(count)[0], [1.0]])
    gaps = 0.5 * np.diff(places)
    widest = max(2.0 * float(gaps[0]), float(gaps[1:-1].max(initial=0.0)))
    if isinstance(part, SceneFilm):
        return widest * part.length / part.mesh[0], widest * part.width / part.mesh[1]
    return widest * unstressed_length(part) / part.elements, 0.0


def penetration_between(part: SceneFilm | SceneCable | SceneBeam, count: int, radius: float) -> float:
    """Depth of a sphere between the contact points of a flat film, m."""
    along, across = point_spacing(part, count)
    return (along**2 + across**2) / (8.0 * radius)


def _of_film(film: SceneFilm, count: int) -> tuple[ContactPoint, ...]:
    along, across = (
        _gauss(side, elements, count) for side, elements in zip((film.length, film.width), film.mesh, strict=True)
    )
    radius, surface_density = 0.5 * film.thickness, film.density * film.thickness
    return tuple(
        ContactPoint(_frame(film.name, k, (x, y)), a * b, radius, surface_density * a * b)
        for k, ((x, a), (y, b)) in enumerate((one, other) for one in along for other in across)
    )


def _of_line(cable: SceneCable | SceneBeam, count: int) -> tuple[ContactPoint, ...]:
    length = unstressed_length(cable)
    if isinstance(cable, SceneBeam):
        width, radius, section = cable.width, 0.5 * cable.thickness, cable.width * cable.thickness
    else:
        width, radius, section = cable.diameter, 0.5 * cable.diameter, 0.25 * np.pi * cable.diameter**2
    normal = _across(np.subtract(cable.end, cable.start))
    return tuple(
        ContactPoint(_frame(cable.name, k, (x + 0.5 * length,), normal), a * width, radius, cable.density * section * a)
        for k, (x, a) in enumerate(_gauss(length, cable.elements, count))
    )


def sheet_spacing(scene: Scene) -> tuple[float, float]:
    """Wanted distance of the points of a sheet, m, and the distance at which a body could pass between them.

    Both are infinite if the sheet touches nothing but itself and planes. An obstacle counts as a body.
    """
    others = {name for pair in scene.pairs if SHEET in (pair.first, pair.second) for name in (pair.first, pair.second)}
    bodies = {name for group in scene.groups if group.name in others for name in group.bodies} | others
    sides = [min(body.plate.length, body.plate.width) for body in scene.bodies if body.plate and body.name in bodies]
    wanted, passing = [side / _ALONG_SIDE for side in sides], sides
    for obstacle in (obstacle for obstacle in scene.obstacles if obstacle.name in others):
        if obstacle.size is not None:
            side = sorted(obstacle.size)[1]
            wanted.append(side / _ALONG_SIDE)
            passing.append(side)
        elif obstacle.radius is not None:
            # a sphere between three points of an equilateral triangle with the side s penetrates by s^2/(6 R)
            wanted.append(math.sqrt(6.0 * _SUNK) * obstacle.radius)
            passing.append(math.sqrt(3.0) * obstacle.radius if obstacle.length is None else obstacle.length)
    return min(wanted, default=math.inf), min(passing, default=math.inf)


def sheet_parts(scene: Scene) -> int:
    """Parts into which the points divide each edge of the triangles of a sheet."""
    assert scene.built.touching is not None
    return scene.built.touching.parts(sheet_spacing(scene)[0])


def points_inside(scene: Scene) -> dict[str, SheetPoint]:
    """Contact points of the sheet inside and on the edges of its triangles, by name; without the nodes."""
    named = {name for pair in scene.pairs for name in (pair.first, pair.second)}
    if scene.built.touching is None or scene.contact is None or SHEET not in named:
        return {}
    points = scene.built.touching.points(sheet_parts(scene))
    return {name: point for name, point in points.items() if len(point.nodes) > 1}


def _of_sheet(sheet: TouchingSheet, parts: int) -> tuple[ContactPoint, ...]:
    radius, density = 0.5 * sheet.thickness, sheet.areal_density
    return tuple(
        ContactPoint(point.frame, point.area, radius, density * point.area) for point in sheet.points(parts).values()
    )


def _frame(
    name: str, k: int, at: tuple[float, ...], normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
) -> SceneFrame:
    return SceneFrame(name=f"{name} point {k + 1}", on=name, at=at, normal=normal)


def _across(direction: np.ndarray) -> tuple[float, float, float]:
    """Unit vector along the axis that is farthest from a direction."""
    out = [0.0, 0.0, 0.0]
    out[int(np.argmin(np.abs(direction)))] = 1.0
    return (out[0], out[1], out[2])


def _gauss(side: float, elements: int, count: int) -> list[tuple[float, float]]:
    """Positions of the Gauss points along a side of equal elements, from its middle, and their lengths, m."""
    places, weights = np.polynomial.legendre.leggauss(count)
    size = side / elements
    return [
        (float((k + 0.5 + 0.5 * place) * size - 0.5 * side), float(0.5 * weight * size))
        for k in range(elements)
        for place, weight in zip(places, weights, strict=True)
    ]


OF_SIDES = ("surfaces", "shapes", "sheets", "boxes")
"""Geometries that follow from the sides of a pair; `fsm/model/compile/compile_<name>.py` builds their tables."""


class ContactSide(NamedTuple):
    """One side of a contact pair.

    Attributes
    ----------
    kind : "surface", "plate", "group", "obstacle" or "film", also for a cable and for flexible facets; "body": without
        a plate
    bodies : names of the bodies of the side, in order along a surface; for a film, names of its points
    face : area to which the whole contact stiffness belongs, m^2; None: the area of each plate
    """

    kind: Literal["surface", "plate", "group", "obstacle", "film", "body"]
    bodies: tuple[str, ...]
    face: float | None = None


def contact_sides(scene: Scene) -> dict[str, ContactSide]:
    """All possible sides of contact pairs by name.

    If a surface and a body have the same name (a panel of one segment), the name means the surface.
    """
    known = {name: ContactSide("body", (name,)) for name in (GROUND, *(body.name for body in scene.bodies))}
    known |= {obstacle.name: ContactSide("obstacle", (obstacle.body or GROUND,)) for obstacle in scene.obstacles}
    known |= {body.name: ContactSide("plate", (body.name,)) for body in scene.bodies if body.plate is not None}
    for name, points in contact_points(scene).items():
        face = scene.built.touching.mean_facet if scene.built.touching is not None and name == SHEET else None
        known[name] = ContactSide("film", tuple(point.frame.name for point in points), face)
    known |= {group.name: ContactSide("group", group.bodies, group.face) for group in scene.groups}
    return known | {surface.name: ContactSide("surface", surface.bodies) for surface in scene.surfaces}


def pairs_of_boxes(scene: Scene) -> list[ContactPair]:
    """Contact pairs of two obstacles that are boxes."""
    boxes = {obstacle.name for obstacle in scene.obstacles if obstacle.shape == "box"}
    return [pair for pair in scene.pairs if pair.geometry is None and {pair.first, pair.second} <= boxes]


def pairs_by_geometry(scene: Scene) -> dict[str, list[tuple[int, ContactPair]]]:
    """Numbers of the contact pairs, and the pairs, by the name of their geometry."""
    known, boxes = contact_sides(scene), pairs_of_boxes(scene)
    found: dict[str, list[tuple[int, ContactPair]]] = {name: [] for name in OF_SIDES}
    for number, pair in enumerate(scene.pairs):
        name = pair.geometry
        if name is None:
            both = {known[pair.first].kind, known[pair.second].kind}
            of_sheet = pair.first == pair.second == SHEET and both == {"film"}
            name = "sheets" if of_sheet else "surfaces" if both == {"surface"} else "shapes"
            name = "boxes" if pair in boxes else name
        found.setdefault(name, []).append((number, pair))
    return {name: pairs for name, pairs in found.items() if pairs}
