"""Mesh of the film of a case: elements, supports, points, and corners that are pulled."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsm.case.derived.membrane import MeshLines, PlacedPatch, coarser_lines, finer_lines, mesh_lines, place_patches
from fsm.case.models.case import Case
from fsm.case.models.membrane import CornerCable, EdgeCable, Membrane, Support
from fsm.model.nodes.films.air import air_mass
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.mesh import Mesh
from fsm.model.nodes.shape import membrane_shape
from fsm.model.nodes.system.build import CableMaterial, FilmGrid, MeshBuilder

CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
"""Signs of x and y at the corners, in order."""
_PARTS = 8
"""Quadrature points along a side of an element, for distributed forces."""
_LEAST = 1.5
"""Smallest ratio of the numbers of elements of both meshes between edges of film and patches."""
_MANY = 200
"""Number of elements above which the comparison mesh is coarser, to save time."""
_NAMES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True, eq=False)
class FilmPoint:
    """Material point of the film; its position is weights @ vectors of q.

    Attributes
    ----------
    vectors : (12,) int array
        First coordinates of the vectors of its element.
    weights, along, across : (12,) arrays
        Weights of the position, and of the slopes along length and width.
    """

    vectors: np.ndarray
    weights: np.ndarray
    along: np.ndarray
    across: np.ndarray

    def position(self, q: np.ndarray) -> np.ndarray:
        """Position, (3,), m."""
        return np.asarray(self.weights @ q[self.vectors[:, None] + np.arange(3)])

    def axes(self, q: np.ndarray) -> np.ndarray:
        """Unit vectors along the length, across it within the film, and normal to it, the rows of (3, 3)."""
        vectors = q[self.vectors[:, None] + np.arange(3)]
        first = self.along @ vectors
        first /= np.linalg.norm(first)
        normal = np.cross(first, self.across @ vectors)
        normal /= np.linalg.norm(normal)
        return np.array([first, np.cross(normal, first), normal])

    def load(self, count: int, force: np.ndarray) -> np.ndarray:
        """Generalised forces (count,) of a force (3,), N, on the point."""
        out = np.zeros(count)
        np.add.at(out, (self.vectors[:, None] + np.arange(3)).ravel(), np.outer(self.weights, force).ravel())
        return out


@dataclass(frozen=True, eq=False)
class FilmMesh:
    """Mesh of a film without supports, and the places of its parts.

    Attributes
    ----------
    mesh : Mesh
        Mesh in which only unused coordinates are fixed.
    grid : FilmGrid
    lines : MeshLines
    patches : places of the patches
    cells : (nx, ny) int array
        0 for the film, k + 1 for the patch of section k.
    ends : (4,) int array
        First coordinates of the pulled points: ends of the cables, or corners.
    outwards : (4, 3) array
        Unit vectors along the diagonals.
    """

    mesh: Mesh
    grid: FilmGrid
    lines: MeshLines
    patches: tuple[PlacedPatch, ...]
    cells: np.ndarray
    ends: np.ndarray
    outwards: np.ndarray

    def point(self, x: float, y: float) -> FilmPoint:
        """Material point at coordinates x, y (m) from the centre of the film."""
        grid = self.grid
        i = int(np.clip(np.searchsorted(grid.x, x, side="right") - 1, 0, len(grid.x) - 2))
        j = int(np.clip(np.searchsorted(grid.y, y, side="right") - 1, 0, len(grid.y) - 2))
        b, c = grid.x[i + 1] - grid.x[i], grid.y[j + 1] - grid.y[j]
        at = (x - grid.x[i]) / b, (y - grid.y[j]) / c
        weights, along, across = (membrane_shape(*at, b, c, derivative=d) for d in ((0, 0), (1, 0), (0, 1)))
        return FilmPoint(grid.vectors(i, j), weights, along, across)

    def element(self, x: float, y: float) -> tuple[float, float]:
        """Length and width of the element at a point, m."""
        grid = self.grid
        sides = []
        for lines, place in ((grid.x, x), (grid.y, y)):
            k = int(np.clip(np.searchsorted(lines, place, side="right") - 1, 0, len(lines) - 2))
            sides.append(float(lines[k + 1] - lines[k]))
        return sides[0], sides[1]

    def load(self, x: float, y: float, sides: tuple[float, float], force: np.ndarray) -> np.ndarray:
        """Generalised forces of a force (3,), N, at a point, or spread evenly over a rectangle of these sides (m)."""
        count = len(self.mesh.coordinates)
        xs, ys = (
            place + side * ((np.arange(parts) + 0.5) / parts - 0.5)
            for place, side, parts in zip((x, y), sides, self._parts(sides), strict=True)
        )
        out = np.zeros(count)
        for here in xs:
            for there in ys:
                point = self.point(float(here), float(there))
                np.add.at(out, point.vectors[:, None] + np.arange(3), np.outer(point.weights, force) / (len(xs) * len(ys)))
        return out

    def _parts(self, sides: tuple[float, float]) -> list[int]:
        """Numbers of parts into which the sides of a rectangle are divided for the integration."""
        smallest = (float(np.diff(self.grid.x).min()), float(np.diff(self.grid.y).min()))
        return [_PARTS * math.ceil(side / least) if side else 1 for side, least in zip(sides, smallest, strict=True)]

    def held_by(self, support: Support) -> np.ndarray:
        """Coordinates that a support holds; at edges also the slopes along them, so that edges stay straight."""
        fixed = np.array([_NAMES[name] for name in support.fixed])
        nodes, vectors = self._held_vectors(support)
        if support.clamped:
            slopes = (3,) if support.at == "cables" else (3, 6)
            vectors = np.concatenate([nodes + slope for slope in (0, *slopes)])
        return np.asarray((vectors[:, None] + fixed).ravel())

    def _held_vectors(self, support: Support) -> tuple[np.ndarray, np.ndarray]:
        """First coordinates of the positions that a support holds, and of all vectors if it does not clamp."""
        if support.at == "point":
            assert support.position is not None
            nodes = np.array([self.grid.nearest(*support.position)])
        elif support.at == "cables":
            nodes = self.ends
        elif support.at == "corners":
            nodes = self.corners
        else:
            sides = () if support.at == "edges" else (support.at,)
            vectors = self.grid.edge(*sides)
            return np.intersect1d(vectors, self.grid.position), vectors
        return nodes, nodes

    @property
    def corners(self) -> np.ndarray:
        """First coordinates of the positions of the film's corners, in the order of `CORNERS`."""
        return np.array([self.grid.position[0 if x < 0 else -1, 0 if y < 0 else -1] for x, y in CORNERS])


def build_film(case: Case, lines: MeshLines | None = None) -> FilmMesh:
    """Mesh of the film of a case, with its patches, cables and air, flat and without stress; by default with the mesh lines
    of the case.
    """
    membrane, material, tension = case.membrane, case.material, case.tension
    assert membrane is not None and material is not None and tension is not None
    placed = place_patches(membrane, dict(enumerate(case.patch)))
    lines = lines or mesh_lines(membrane, placed)
    shape = (len(lines.x) - 1, len(lines.y) - 1)
    of = [[lines.patch_of(placed, i, j) for j in range(shape[1])] for i in range(shape[0])]
    cells = np.array([[0 if number is None else number + 1 for number in row] for row in of], dtype=np.int64)
    film = FilmMaterial(material.young, material.poisson, material.density, membrane.thickness)
    patches = [FilmMaterial(patch.young, patch.poisson, patch.density, patch.thickness) for patch in case.patch]
    viscosity = case.damping.material if case.damping else 0.0
    builder = MeshBuilder()
    grid = builder.film(
        np.array(lines.x), np.array(lines.y), (film, *patches), cells, _tension_fields(case, film, patches), viscosity,
        air=air_mass(case.air.length or membrane.length, case.air.density) if case.air else 0.0,
    )  # fmt: skip
    outwards = _outwards(membrane)
    corners = np.array([grid.position[0 if x < 0 else -1, 0 if y < 0 else -1] for x, y in CORNERS])
    ends = _cables(builder, case, membrane, grid, corners, outwards, viscosity)
    return FilmMesh(builder.build(), grid, lines, tuple(placed), cells, ends, outwards)


def on_other_mesh(case: Case) -> tuple[MeshLines, float] | None:
    """Lines of the comparison mesh, and the ratio of its number of elements in a direction to that of the case.

    Every element is halved in both directions, also beside and in patches. If the film has many elements, the comparison
    mesh has half as many elements between the edges of film and patches; None if these edges determine the mesh.
    """
    membrane = case.membrane
    assert membrane is not None
    placed = place_patches(membrane, dict(enumerate(case.patch)))
    lines = mesh_lines(membrane, placed)
    if (len(lines.x) - 1) * (len(lines.y) - 1) <= _MANY:
        return finer_lines(membrane, placed), 2.0
    coarser, ratio = coarser_lines(membrane, placed)
    return (coarser, 1.0 / ratio) if ratio >= _LEAST else None


def _tension_fields(case: Case, film: FilmMaterial, patches: list[FilmMaterial]) -> tuple[bool, ...]:
    """Whether the film and each kind of patch carry no compression. A patch carries no compression if it buckles at a
    compression lower than the tension of the film.

    A square plate of side a on simple supports buckles under a compression of 4 pi^2 D/a^2 (N/m).
    """
    if case.tension is None or case.tension.film != "tension-field":
        return (False,) * (1 + len(patches))
    tension = mean_strain(case) * film.stretch * (1.0 + film.poisson)
    buckles = [4.0 * math.pi**2 * made.bending / patch.size**2 for made, patch in zip(patches, case.patch, strict=True)]
    return (True, *(load < tension for load in buckles))


def mean_strain(case: Case) -> float:
    """Approximate strain of the film along length and width due to the tension."""
    tension, membrane, material = case.tension, case.membrane, case.material
    assert tension is not None and membrane is not None and material is not None
    if tension.pull is None:
        assert tension.strain is not None
        return max(tension.strain) if isinstance(tension.strain, tuple) else tension.strain
    resultant = tension.pull * math.sqrt(2.0) / math.sqrt(membrane.length * membrane.width)
    return resultant * (1.0 - material.poisson) / (material.young * membrane.thickness)


def _outwards(membrane: Membrane) -> np.ndarray:
    reach = math.hypot(membrane.length, membrane.width)
    return np.array([[x * membrane.length / reach, y * membrane.width / reach, 0.0] for x, y in CORNERS])


def _cables(
    builder: MeshBuilder,
    case: Case,
    membrane: Membrane,
    grid: FilmGrid,
    corners: np.ndarray,
    outwards: np.ndarray,
    viscosity: float,
) -> np.ndarray:
    """Add the cables, and return the first coordinates of the pulled points."""
    ends = corners
    tension_only = case.tension is not None and case.tension.film == "tension-field"
    half = np.array([0.5 * membrane.length, 0.5 * membrane.width, 0.0])
    for cable in case.cable:
        material = CableMaterial(cable.young, cable.density, cable.diameter)
        if isinstance(cable, CornerCable):
            tips = []
            for corner, signs, outward in zip(corners, CORNERS, outwards, strict=True):
                start = half * np.array([*signs, 0.0])
                nodes = builder.cable(
                    start, start + cable.length * outward, material, cable.elements, int(corner), viscosity=viscosity,
                    tension_only=tension_only,
                )  # fmt: skip
                tips.append(nodes[-1, 0])
            ends = np.array(tips)
        elif isinstance(cable, EdgeCable):
            builder.edge_cables(grid, material, viscosity, tension_only)
    return ends
