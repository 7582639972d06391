"""What a contact pair names: a surface, the plate of a body, a group of plates, or an obstacle."""

from __future__ import annotations

from typing import Literal, NamedTuple

from fsm.scene.scene import GROUND, Scene

__all__ = ["Party", "parties"]


class Party(NamedTuple):
    """One side of a contact pair.

    Attributes
    ----------
    kind : "surface", "plate", "group" or "obstacle"
    bodies : names of the bodies that it is part of, in a surface's order
    """

    kind: Literal["surface", "plate", "group", "obstacle"]
    bodies: tuple[str, ...]


def parties(scene: Scene) -> dict[str, Party]:
    """All that a contact pair may name; a surface comes before a body of the same name (a panel of one segment)."""
    known = {obstacle.name: Party("obstacle", (obstacle.body or GROUND,)) for obstacle in scene.obstacles}
    known |= {body.name: Party("plate", (body.name,)) for body in scene.bodies if body.plate is not None}
    known |= {group.name: Party("group", group.bodies) for group in scene.groups}
    return known | {surface.name: Party("surface", surface.bodies) for surface in scene.surfaces}
