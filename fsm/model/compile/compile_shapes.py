"""Compile contact pairs of rigid plates and obstacles to contact geometries.

`compile_surfaces` compiles pairs of two surfaces: panels divided into segments have smooth contact surfaces.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from fsm.case.derived.contact_points import ContactSide, contact_points, contact_sides
from fsm.case.models.flexible_facets import SHEET
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import GROUND, Body, Scene
from fsm.interactions.shapes.shape_distance import BOX, CYLINDER, HALF_SPACE, SPHERE
from fsm.model.contact.contact_table import ContactTable
from fsm.model.contact.shapes.plate_shapes import corner_neighbours, plate_shapes
from fsm.model.contact.shapes.shape_tables import Shape
from fsm.model.contact.shapes.side_contacts import Side, SideContacts
from fsm.model.contact.touching import Touching


def compile_shapes(touching: Touching) -> tuple[ContactTable, ...]:
    """Compile the geometries of pairs of plates, obstacles and films, without pairs of which no body can move.

    Joined bodies that touch in the poses of the given scene have no contact there.

    Notes
    -----
    The gap always includes the thickness of these plates. Without thickness, plates would have no rounding, and points could
    not penetrate.
    """
    compiler = _ShapeCompiler(touching)
    built: tuple[ContactTable | None, ...] = (
        compiler.plates(), compiler.obstacles(), compiler.solids(), compiler.films(touching.scene),
    )  # fmt: skip
    return tuple(geometry for geometry in built if geometry is not None)


class _ShapeCompiler:
    def __init__(self, touching: Touching) -> None:
        scene, bodies, poses, spatial, pairs = touching
        assert scene.contact is not None
        self.points, self.poses, self.spatial = scene.contact.points_per_segment, poses, spatial
        self.bodies = bodies
        self.index = {body.name: i for i, body in enumerate(bodies)}
        self.solid_list = [self._shape(obstacle) for obstacle in scene.obstacles]
        joined, neighbours, across = _joined(scene, bodies), corner_neighbours(bodies), self._across_cuts(scene)
        self.joined = np.concatenate([joined, neighbours, across])
        # corners on both sides of a cut are at one place too
        apart = np.isin(neighbours @ [len(bodies), 1], np.sort(across, axis=1) @ [len(bodies), 1])
        self.creased = np.concatenate([joined, neighbours[~apart]])
        # plates of all contact sides, in the order of their names in the pairs
        self.plate_list: list[Shape] = []
        self.number: dict[str, np.ndarray] = {}
        # contact sides and their numbers
        self.sides: list[Side] = []
        self.side_number: dict[str, int] = {}
        # pairs of two sides, of a side and an obstacle, and of two obstacles, each with the number of its contact pair
        self.plate_pairs: list[tuple[int, int, int]] = []
        self.obstacle_pairs: list[tuple[int, int, int]] = []
        self.solid_pairs: list[tuple[int, int, int]] = []
        # films, each with the name of the other side
        self.film_pairs: list[tuple[str, str, int]] = []
        self.known = known = contact_sides(scene)
        self.place = place = {obstacle.name: i for i, obstacle in enumerate(scene.obstacles)}
        for row, pair in pairs:
            first, second = known[pair.first], known[pair.second]
            if "film" not in (first.kind, second.kind) and self._fixed(first, second):
                continue
            if first.kind == "film":
                self.film_pairs.append((pair.first, pair.second, row))
            elif second.kind == "film":
                self.film_pairs.append((pair.second, pair.first, row))
            elif first.kind == second.kind == "obstacle":
                self.solid_pairs.append((*self._probing_first(place[pair.first], place[pair.second]), row))
            elif second.kind == "obstacle":
                self.obstacle_pairs.append((self._side(pair.first), place[pair.second], row))
            elif first.kind == "obstacle":
                self.obstacle_pairs.append((self._side(pair.second), place[pair.first], row))
            else:
                self.plate_pairs.append((self._side(pair.first), self._side(pair.second), row))

    def _fixed(self, *sides: ContactSide) -> bool:
        return all(self.bodies[self.index[name]].held for side in sides for name in side.bodies)

    def _plates(self, name: str) -> np.ndarray:
        """Numbers of the shapes of a body's plate."""
        if name not in self.number:
            plate = self.bodies[self.index[name]].plate
            assert plate is not None
            shapes = plate_shapes(self.index[name], plate)
            self.number[name] = len(self.plate_list) + np.arange(len(shapes))
            self.plate_list += shapes
        return self.number[name]

    def _side(self, name: str) -> int:
        """Number of a side of a contact. The plates of a surface each represent a part of its length; each plate of a group
        is a complete face.
        """
        if name not in self.side_number:
            party = self.known[name]
            of_bodies = [self._plates(body) for body in party.bodies]
            plates = np.concatenate(of_bodies)
            lengths = np.array([self.plate_list[plate].size[0] for plate in plates])
            areas = np.array([self.plate_list[plate].face for plate in plates])
            number = np.repeat(np.arange(len(of_bodies)), [len(shapes) for shapes in of_bodies])
            whole = np.bincount(number, areas)[number]
            parts = lengths / lengths.sum() if party.kind == "surface" else areas / (party.face or whole)
            self.side_number[name] = len(self.sides)
            self.sides.append(Side(plates, parts))
        return self.side_number[name]

    def _contacts(
        self, pairs: list[tuple[int, int, int]], shapes: list[Shape], sides: list[Side], sizes: list[float], **more: Any
    ) -> SideContacts | None:
        """Contacts of pairs of sides; None if there are none. The margin is a quarter of the mean of the sizes, m."""
        if not pairs:
            return None
        rows, margin = np.array(pairs), 0.25 * float(np.mean(sizes))
        given: dict[str, Any] = {"joined": self.joined} | more
        return SideContacts(
            shapes, rows[:, :2], self.spatial, margin, self.points, sides, rows[:, 2], reference=self.poses, **given
        )

    def plates(self) -> SideContacts | None:
        """Contacts of pairs of plates; None if there are none."""
        return self._contacts(self.plate_pairs, self.plate_list, self.sides, _sizes(self.plate_list), creased=self.creased)

    def obstacles(self) -> SideContacts | None:
        """Contacts of plates with obstacles; None if there are none."""
        first, count = len(self.plate_list), len(self.sides)
        sides = [*self.sides, *(Side.alone(first + k) for k in range(len(self.solid_list)))]
        pairs = [(side, count + obstacle, row) for side, obstacle, row in self.obstacle_pairs]
        return self._contacts(pairs, self.plate_list + self.solid_list, sides, _sizes(self.plate_list))

    def solids(self) -> SideContacts | None:
        """Contacts of obstacles with obstacles; None if there are none."""
        named = sorted({obstacle for *both, _ in self.solid_pairs for obstacle in both})
        solids = [self.solid_list[k] for k in named]
        pairs = [(named.index(one), named.index(two), row) for one, two, row in self.solid_pairs]
        return self._contacts(pairs, solids, [Side.alone(k) for k in range(len(solids))], _sizes(solids))

    def _probing_first(self, one: int, two: int) -> tuple[int, int]:
        """Order a pair of obstacles: a sphere comes first, a half-space last."""
        kinds = self.solid_list[one].kind, self.solid_list[two].kind
        turned = kinds[0] == HALF_SPACE or (kinds[1] == SPHERE and kinds[0] != SPHERE)
        return (two, one) if turned else (one, two)

    def films(self, scene: Scene) -> SideContacts | None:
        """Contacts of films and cables; None if there are none."""
        if not self.film_pairs:
            return None
        known, names = contact_points(scene), list(dict.fromkeys(film for film, *_ in self.film_pairs))
        points = [point for name in names for point in known[name]]
        others = list(dict.fromkeys(name for _, name, _ in self.film_pairs))
        solids = [name for name in others if self.known[name].kind == "obstacle"]
        others = [name for name in others if name not in solids]
        of_others = [self.sides[self._side(name)] for name in others]
        shapes = [Shape(self.index[point.frame.name], SPHERE, (point.radius,) * 3) for point in points]
        areas, ends = np.array([point.area for point in points]), np.cumsum([0, *(len(known[name]) for name in names)])
        sides = [
            Side(np.arange(a, b), areas[a:b] / (self.known[name].face or areas[a:b].sum()))
            for name, (a, b) in zip(names, pairwise(ends.tolist()), strict=True)
        ]
        first, last = len(points), len(points) + len(self.plate_list)
        sides += [Side(first + side.shapes, side.parts) for side in of_others]
        sides += [Side.alone(last + k) for k in range(len(solids))]
        touched = self.plate_list + [self.solid_list[self.place[name]] for name in solids]
        number = {name: k for k, name in enumerate([*names, *others, *solids])}
        return self._contacts(
            [(number[film], number[name], row) for film, name, row in self.film_pairs],
            shapes + touched, sides, _sizes(touched) or [16.0 * math.sqrt(areas.mean())],
            joined=np.concatenate([self.joined, self._joined_to_films(scene)]), areas=areas,
        )  # fmt: skip

    def _across_cuts(self, scene: Scene) -> np.ndarray:
        """Pairs (m, 2) of bodies that are facets across a cut of a sheet of rigid facets."""
        facets = [self.index[name] for group in scene.groups if group.name == SHEET for name in group.bodies]
        pairs = np.array(scene.built.across_cuts if facets else (), dtype=np.int64).reshape(-1, 2)
        return np.array(facets, dtype=np.int64)[pairs]

    def _joined_to_films(self, scene: Scene) -> np.ndarray:
        """Pairs (m, 2) of the points of films and the bodies that force elements join to the films."""
        on = {frame.name: frame.on for frame in scene.frames}
        ends = [(element.inner, element.outer) for element in scene.elements]
        joined = {(on[a], b) for one, two in ends for a, b in ((one, two), (two, one)) if a in on and b not in on}
        known = contact_points(scene)
        found = [(self.index[p.frame.name], self.index[b]) for film, b in sorted(joined) for p in known.get(film, ())]
        return np.array(found, dtype=np.int64).reshape(-1, 2)

    def _shape(self, obstacle: Obstacle) -> Shape:
        kind, size = HALF_SPACE, (0.0, 0.0, 0.0)
        if obstacle.size is not None:
            x, y, z = obstacle.size
            kind, size = BOX, (x / 2, y / 2, z / 2)
        elif obstacle.radius is not None and obstacle.length is not None:
            kind, size = CYLINDER, (obstacle.radius, obstacle.length / 2, obstacle.radius)
        elif obstacle.radius is not None:
            kind, size = SPHERE, (obstacle.radius, obstacle.radius, obstacle.radius)
        return Shape(
            self.index[obstacle.body or GROUND], kind, size, 0.0, obstacle.position, obstacle.orientation
        )


def _sizes(shapes: list[Shape]) -> list[float]:
    """Lengths of plates and of solids with a limited size, m."""
    return [shape.length for shape in shapes if shape.kind != HALF_SPACE]


def _joined(scene: Scene, bodies: tuple[Body, ...]) -> np.ndarray:
    """Pairs (m, 2) of bodies joined by a force element, directly or through a body without a plate (a crease line)."""
    index = {body.name: i for i, body in enumerate(bodies)}
    beside: dict[int, set[int]] = {}
    for element in scene.elements:
        one, two = index[element.inner], index[element.outer]
        beside.setdefault(one, set()).add(two)
        beside.setdefault(two, set()).add(one)
    found = {(min(one, two), max(one, two)) for one, others in beside.items() for two in others}
    for middle, ends in beside.items():
        if middle != index[GROUND] and bodies[middle].plate is None:
            found |= {(one, two) for one in ends for two in ends if one < two}
    return np.array(sorted(found), dtype=np.int64).reshape(-1, 2)
