"""Compilation of the contact pairs of a scene to contact groups: geometries with the laws of the scene."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from fsm.case.derived.contact_points import contact_points, pairs_by_geometry
from fsm.case.models.contact import Contact, Friction
from fsm.case.models.scene import Body, Scene
from fsm.laws.friction import FRICTION_LAWS as BUILT_IN
from fsm.laws.normal import NORMAL_LAWS
from fsm.model.contact.contact_forces import FrictionForce, NormalForce
from fsm.model.contact.contact_table import ContactTable
from fsm.model.contact.contacts import ContactGroup
from fsm.model.contact.touching import Touching
from fsm.registry import CONTACT_LAWS, FRICTION_LAWS, GEOMETRIES

if TYPE_CHECKING:
    from fsm.model.system.system import SegmentSystem

_OF_TABLES = {"law", "thickness_in_gap", "points_per_segment"}
"""Keys of `[contact]` on which tables depend."""
_SIDES = ("surfaces", "groups", "obstacles", "pairs", "frames")
"""Parts of a scene on which tables depend."""
_PLACES = ("position", "orientation", "held", "plate")
"""Fields of bodies on which tables depend."""


class Compiled(NamedTuple):
    """Scene and its system."""

    scene: Scene
    system: SegmentSystem


def compile_contacts(
    scene: Scene, bodies: tuple[Body, ...], poses: np.ndarray, spatial: bool, like: Compiled | None = None
) -> tuple[ContactGroup, ...]:
    """Contact groups of a scene; empty without a contact law or without a pair with a movable body.

    Parameters
    ----------
    scene : Scene
    bodies : all bodies in the order of the system, starting with the ground
    poses : (n_bodies, 3 or 7) array
        Poses of the scene as given.
    spatial : whether each body of the system has six degrees of freedom
    like : Compiled, optional
        Another scene. If its sides of contacts are the same, the new groups have the same tables.
    """
    contact = scene.contact
    if contact is None:
        return ()
    if like is not None and same_sides(scene, like.scene):
        groups = [group.with_laws(_normal(contact), _friction(scene.friction)) for group in like.system.contacts]
        shared = tuple(group for group in groups if group is not None)
        if len(shared) == len(groups):
            return shared
    geometries: list[ContactTable] = []
    for name, pairs in pairs_by_geometry(scene).items():
        build = GEOMETRIES[name].law if name in GEOMETRIES else _of_sides(name)
        geometries += build(Touching(scene, bodies, poses, spatial, tuple(pairs)))
    normal, friction = _normal(contact), _friction(scene.friction)
    mobility = _mobility(scene, bodies, spatial)
    # points of films, cables, beams and facets yield when they are hit, like bodies with a force element
    held = {name for element in scene.elements for name in (element.inner, element.outer)}
    held |= {point.frame.name for points in contact_points(scene).values() for point in points}
    loose = mobility.any(axis=1) & np.array([body.name not in held for body in bodies])
    count = len(scene.pairs)
    return tuple(ContactGroup(geometry, normal, friction, mobility, loose, count) for geometry in geometries)


def same_sides(one: Scene, other: Scene) -> bool:
    """Whether the tables of contacts of two scenes with the same topology are equal."""
    numbers = [None if scene.contact is None else scene.contact.model_dump(include=_OF_TABLES) for scene in (one, other)]
    if numbers[0] != numbers[1] or one.built.across_cuts != other.built.across_cuts:
        return False
    if any(getattr(one, name) != getattr(other, name) for name in _SIDES):
        return False
    if (one.groups or any(pair.geometry for pair in one.pairs)) and one.elements != other.elements:
        return False
    return one.bodies is other.bodies or all(
        getattr(first, name) == getattr(second, name)
        for first, second in zip(one.bodies, other.bodies, strict=True)
        for name in _PLACES
    )


def _of_sides(name: str) -> Callable[[Touching], tuple[ContactTable, ...]]:
    """Function that builds the tables of a geometry of `OF_SIDES`; its module imports the kernels of the geometry."""
    found: Any = getattr(import_module(f"fsm.model.compile.compile_{name}"), f"compile_{name}")
    return cast(Callable[[Touching], tuple[ContactTable, ...]], found)


def _normal(contact: Contact) -> NormalForce:
    law = NORMAL_LAWS[contact.law] if contact.law in NORMAL_LAWS else CONTACT_LAWS[contact.law].law
    return NormalForce(law, law.params(contact), contact.exponent, contact.speed_floor)


def _friction(friction: Friction | None) -> FrictionForce | None:
    if friction is None:
        return None
    law = BUILT_IN[friction.law] if friction.law in BUILT_IN else FRICTION_LAWS[friction.law].law
    bends = friction.presliding if law.bristle else None
    return FrictionForce(law, law.params(friction), np.inf if bends is None else bends, friction.across)


def _mobility(scene: Scene, bodies: tuple[Body, ...], spatial: bool) -> np.ndarray:
    """Inverse masses and moments of inertia, (n_bodies, 3 or 6); zero for held and driven bodies.

    Points of a film have the mass of the film area that they represent.
    """
    driven = {name for drive in scene.drives for name in drive.moved}
    mobility = np.zeros((len(bodies), 6 if spatial else 3))
    for row, body in zip(mobility, bodies, strict=True):
        if not body.held and body.name not in driven:
            inertia = body.inertia if spatial else body.inertia[1:2]
            row[:] = 1.0 / np.array([*[body.mass] * (3 if spatial else 2), *inertia])
    index = {body.name: i for i, body in enumerate(bodies)}
    for point in (point for points in contact_points(scene).values() for point in points):
        mobility[index[point.frame.name], :3] = 1.0 / point.mass
    return mobility
