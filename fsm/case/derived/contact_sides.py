"""Sides of a contact pair, and the geometry of the pair that follows from them.

A side is a surface, the plate of a body, a group of plates, an obstacle, a film, a cable or a sheet. In a pair that names
its geometry, a side is a body or the ground.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from fsm.case.derived.contact_points import contact_points
from fsm.case.models.flexible_facets import SHEET
from fsm.case.models.scene import GROUND, ContactPair, Scene

OF_SIDES = ("surfaces", "shapes", "sheets")
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
        face = scene.touching.mean_facet if scene.touching is not None and name == SHEET else None
        known[name] = ContactSide("film", tuple(point.frame.name for point in points), face)
    known |= {group.name: ContactSide("group", group.bodies, group.face) for group in scene.groups}
    return known | {surface.name: ContactSide("surface", surface.bodies) for surface in scene.surfaces}


def pairs_by_geometry(scene: Scene) -> dict[str, list[tuple[int, ContactPair]]]:
    """Numbers of the contact pairs, and the pairs, by the name of their geometry."""
    known = contact_sides(scene)
    found: dict[str, list[tuple[int, ContactPair]]] = {name: [] for name in OF_SIDES}
    for number, pair in enumerate(scene.pairs):
        name = pair.geometry
        if name is None:
            both = {known[pair.first].kind, known[pair.second].kind}
            of_sheet = pair.first == pair.second == SHEET and both == {"film"}
            name = "sheets" if of_sheet else "surfaces" if both == {"surface"} else "shapes"
        found.setdefault(name, []).append((number, pair))
    return {name: pairs for name, pairs in found.items() if pairs}
