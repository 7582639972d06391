"""Contact pairs of rigid plates and obstacles of a scene become geometries of contact.

Pairs of two surfaces are not here: panels cut into segments touch on smooth surfaces of their own.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.shape_distance import BOX, CYLINDER, HALF_SPACE, SPHERE
from fsm.scene.obstacle import Obstacle
from fsm.scene.party import Party, parties
from fsm.scene.scene import GROUND, Body, Scene
from fsm.segments.obstacle_contacts import ObstacleContacts
from fsm.segments.plate_contacts import PlateContacts
from fsm.segments.shape_contacts import ShapeContacts
from fsm.segments.shape_tables import Shape, as_rectangle

__all__ = ["compile_shapes"]


def compile_shapes(
    scene: Scene, bodies: tuple[Body, ...], poses: np.ndarray, spatial: bool
) -> tuple[ShapeContacts, ...]:
    """Geometries of all pairs that are not of two surfaces; none where nothing can touch or move.

    Parameters
    ----------
    scene : Scene
        Without faults.
    bodies : all bodies in the system's order, the ground first
    poses : (n_bodies, 3 or 7) array
        Of the scene as given; what is joined touches there for ever.
    spatial : bool

    Notes
    -----
    Without the thickness in the gap plates have no rounding, and nothing would be inside anything: these pairs always have
    the thickness.
    """
    if scene.contact is None:
        return ()
    compiler = _ShapeCompiler(scene, bodies)
    built = (compiler.plates(poses, spatial), compiler.obstacles(poses, spatial))
    return tuple(geometry for geometry in built if geometry is not None)


class _ShapeCompiler:
    def __init__(self, scene: Scene, bodies: tuple[Body, ...]) -> None:
        assert scene.contact is not None
        self.points = scene.contact.points_per_segment
        self.bodies = bodies
        self.index = {body.name: i for i, body in enumerate(bodies)}
        self.obstacle_list = scene.obstacles
        self.joined = _joined(scene, bodies)
        # plates that are part of something that touches, in the order in which they are named
        self.rectangles: list[Shape] = []
        self.number: dict[str, int] = {}
        # plate, plate and their parts of panels; plate, obstacle and its part; each with the pair's number
        self.plate_pairs: list[tuple[int, int, float, float, int]] = []
        self.obstacle_pairs: list[tuple[int, int, float, int]] = []
        known = parties(scene)
        place = {obstacle.name: i for i, obstacle in enumerate(scene.obstacles)}
        for row, pair in enumerate(scene.pairs):
            first, second = known[pair.first], known[pair.second]
            if first.kind == second.kind == "surface" or self._fixed(first, second):
                continue
            if second.kind == "obstacle":
                self._add_obstacle(first, place[pair.second], row)
            elif first.kind == "obstacle":
                self._add_obstacle(second, place[pair.first], row)
            else:
                self._add_plates(first, second, row)

    def _fixed(self, *sides: Party) -> bool:
        return all(self.bodies[self.index[name]].held for side in sides for name in side.bodies)

    def _rectangle(self, name: str) -> int:
        """Number of a body's plate."""
        if name not in self.number:
            plate = self.bodies[self.index[name]].plate
            assert plate is not None
            self.number[name] = len(self.rectangles)
            self.rectangles.append(as_rectangle(self.index[name], plate.length, plate.width, plate.thickness))
        return self.number[name]

    def _parts(self, side: Party) -> list[tuple[int, float]]:
        """Plates of one side, and the part of its length that each is."""
        plates = [self._rectangle(name) for name in side.bodies]
        length = sum(self.rectangles[plate].size[0] for plate in plates)
        return [(plate, self.rectangles[plate].size[0] / length) for plate in plates]

    def _add_plates(self, first: Party, second: Party, row: int) -> None:
        for one, part in self._parts(first):
            for two, other_part in self._parts(second):
                self.plate_pairs.append((one, two, part, other_part, row))

    def _add_obstacle(self, side: Party, obstacle: int, row: int) -> None:
        for plate, part in self._parts(side):
            self.obstacle_pairs.append((plate, obstacle, part, row))

    def _body_joined(self, one: int, two: int) -> bool:
        return (min(one, two), max(one, two)) in self.joined

    @property
    def _margin(self) -> float:
        """How near things are before they are watched: a quarter of the mean plate."""
        return 0.25 * float(np.mean([2 * plate.size[0] for plate in self.rectangles]))

    def plates(self, poses: np.ndarray, spatial: bool) -> PlateContacts | None:
        """Pairs of plates; None if there are none."""
        if not self.plate_pairs:
            return None
        rows = np.array(self.plate_pairs)
        pairs = rows[:, :2].astype(np.int64)
        joined = [self._body_joined(self.rectangles[i].body, self.rectangles[j].body) for i, j in pairs]
        return PlateContacts(
            self.rectangles, pairs, spatial, self._margin, self.points, rows[:, 2:4], rows[:, 4].astype(np.int64),
            np.array(joined), poses,
        )  # fmt: skip

    def obstacles(self, poses: np.ndarray, spatial: bool) -> ObstacleContacts | None:
        """Plates and obstacles; None if there are no such pairs."""
        if not self.obstacle_pairs:
            return None
        shapes = [self._shape(obstacle) for obstacle in self.obstacle_list]
        rows = np.array(self.obstacle_pairs)
        pairs = rows[:, :2].astype(np.int64)
        joined = [self._body_joined(self.rectangles[i].body, shapes[j].body) for i, j in pairs]
        return ObstacleContacts(
            self.rectangles, shapes, pairs, spatial, self._margin, self.points, rows[:, 2], rows[:, 3].astype(np.int64),
            np.array(joined), poses,
        )  # fmt: skip

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


def _joined(scene: Scene, bodies: tuple[Body, ...]) -> set[tuple[int, int]]:
    """Pairs of bodies with a force element between them, or one body without a plate (a crease line)."""
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
    return found
