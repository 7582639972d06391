"""What a contact pair names: a surface, the plate of a body, a group of plates, or an obstacle."""

from __future__ import annotations

from typing import Literal, NamedTuple

from fsm.scene.scene import GROUND, Scene

__all__ = ["ContactSide", "contact_sides"]


class ContactSide(NamedTuple):
    """One side of a contact pair.

    Attributes
    ----------
    kind : "surface", "plate", "group" or "obstacle"
    bodies : names of the bodies that it is part of, in a surface's order
    """

    kind: Literal["surface", "plate", "group", "obstacle"]
    bodies: tuple[str, ...]


def contact_sides(scene: Scene) -> dict[str, ContactSide]:
    """All that a contact pair may name; a surface comes before a body of the same name (a panel of one segment)."""
    known = {obstacle.name: ContactSide("obstacle", (obstacle.body or GROUND,)) for obstacle in scene.obstacles}
    known |= {body.name: ContactSide("plate", (body.name,)) for body in scene.bodies if body.plate is not None}
    known |= {group.name: ContactSide("group", group.bodies) for group in scene.groups}
    return known | {surface.name: ContactSide("surface", surface.bodies) for surface in scene.surfaces}
