"""Builder of meshes: rectangles of film with patches, flexible facets, cables, point masses, supports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fsm.model.nodes.cable import CableGroup
from fsm.model.nodes.facets.facet_group import FacetGroup
from fsm.model.nodes.films.air import added_mass
from fsm.model.nodes.films.film import FilmMaterial, MembraneGroup
from fsm.model.nodes.group import ElementGroup, MassPart
from fsm.model.nodes.mesh import Mesh, node_pattern


@dataclass(frozen=True)
class CableMaterial:
    """Isotropic material and round section of a cable.

    Attributes
    ----------
    young : Pa
    density : kg/m^3
    diameter : m
    """

    young: float
    density: float
    diameter: float

    @property
    def area(self) -> float:
        """pi d^2/4, m^2."""
        return np.pi * self.diameter**2 / 4.0

    @property
    def second_moment(self) -> float:
        """pi d^4/64, m^4."""
        return np.pi * self.diameter**4 / 64.0


@dataclass(frozen=True)
class BeamMaterial:
    """Isotropic material and rectangular section of a beam.

    Attributes
    ----------
    young : Pa
    density : kg/m^3
    width, thickness : m
        Width along the axis of bending, and thickness across this axis.
    """

    young: float
    density: float
    width: float
    thickness: float

    @property
    def area(self) -> float:
        """b t, m^2."""
        return self.width * self.thickness

    @property
    def second_moment(self) -> float:
        """b t^3/12, m^4."""
        return self.width * self.thickness**3 / 12.0


@dataclass(frozen=True, eq=False)
class FilmGrid:
    """Nodes of a rectangular film.

    Attributes
    ----------
    x, y : (nx + 1,), (ny + 1,) arrays, m
        Mesh lines.
    position : (nx + 1, ny + 1) int array
        First coordinate of the position of each node; slopes along x and y follow at + 3 and + 6.
    behind : (nx + 1, ny + 1) int array
        First coordinate of the slope along x that the elements on the side of larger x use; on folds this slope is separate.
    """

    x: np.ndarray
    y: np.ndarray
    position: np.ndarray
    behind: np.ndarray

    def vectors(self, i: np.ndarray | int, j: np.ndarray | int) -> np.ndarray:
        """First coordinates of the vectors of the elements in columns i and rows j, (..., 12)."""
        position, behind = self.position, self.behind
        corners = [position[i, j], position[i + 1, j], position[i + 1, j + 1], position[i, j + 1]]
        along = [behind[i, j], corners[1] + 3, corners[2] + 3, behind[i, j + 1]]
        triples = [np.stack([at, slope, at + 6], axis=-1) for at, slope in zip(corners, along, strict=True)]
        return np.concatenate(triples, axis=-1)

    def nearest(self, x: float, y: float) -> int:
        """First coordinate of the position of the node nearest to a material point (m)."""
        i, j = int(np.argmin(np.abs(self.x - x))), int(np.argmin(np.abs(self.y - y)))
        return int(self.position[i, j])

    def edge(self, *sides: str) -> np.ndarray:
        """First coordinates of the vectors that define edges: positions of their nodes and slopes along the edges.

        Parameters
        ----------
        sides : names of edges, from "left" (smallest x), "right", "bottom" (smallest y) and "top"; all four by default

        Notes
        -----
        Held positions alone do not keep an edge straight: between nodes the edge is a cubic that also follows from the
        slopes along it.
        """
        lines = {
            "left": (self.position[0], 6), "right": (self.position[-1], 6),
            "bottom": (self.position[:, 0], 3), "top": (self.position[:, -1], 3),
        }  # fmt: skip
        chosen = [lines[side] for side in (sides or tuple(lines))]
        return np.unique(np.concatenate([part for nodes, slope in chosen for part in (nodes, nodes + slope)]))


@dataclass
class MeshBuilder:
    """Builder of nodes and elements; `build` creates the mesh.

    Attributes
    ----------
    size : number of coordinates of a node
        9 (position and two slopes in space); 6 is sufficient without film.
    """

    size: int = 9
    _nodes: list[np.ndarray] = field(default_factory=list)
    _used: list[np.ndarray] = field(default_factory=list)
    _names: list[str] = field(default_factory=list)
    _groups: list[ElementGroup] = field(default_factory=list)
    _masses: list[MassPart] = field(default_factory=list)
    _quads: list[np.ndarray] = field(default_factory=list)
    _held: list[np.ndarray] = field(default_factory=list)

    def film(
        self,
        x: np.ndarray,
        y: np.ndarray,
        materials: tuple[FilmMaterial, ...],
        cells: np.ndarray | None = None,
        tension_field: bool | tuple[bool, ...] = False,
        viscosity: float = 0.0,
        air: float = 0.0,
        names: tuple[str, ...] = ("film", "patch"),
        folds: Sequence[int] = (),
    ) -> FilmGrid:
        """Add a rectangular film in the plane z = 0, on mesh lines.

        Parameters
        ----------
        x, y : increasing arrays, m
            Mesh lines.
        materials : materials of the film, then of the patches
        cells : (nx, ny) int array
            Number of the material of each cell; default: the film.
        tension_field : whether the film (without the patches) carries no compression; or one value for each material
        viscosity : s
            Kelvin-Voigt time.
        air : kg/m^2
            Mass of air that moves with the normal motion; see `fsm.model.nodes.films.air`.
        names : names of the energies of each material; the last name is used for all further materials
        folds : indices of the mesh lines of x on which the slope along x may jump
        """
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        nx, ny = len(x) - 1, len(y) - 1
        first = len(self._nodes)
        for i in range(nx + 1):
            for j in range(ny + 1):
                self._node([x[i], y[j], 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], 3, f"film node ({i}, {j})")
        node = self.size * (first + np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1))
        behind = node + 3
        for i in folds:
            for j in range(ny + 1):  # this node has only the slope; its position is not used
                at = self._node([x[i], y[j], 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 2, f"film node ({i}, {j}), behind")
                self._used[-1][:3], behind[i, j] = False, at + 3
        corners = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(-1, 4)
        grid = FilmGrid(x, y, node, behind)
        columns, rows = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
        vectors = grid.vectors(columns.ravel(), rows.ravel())
        sides = np.stack(np.meshgrid(np.diff(x), np.diff(y), indexing="ij"), axis=-1).reshape(-1, 2)
        kind = np.zeros(nx * ny, dtype=np.int64) if cells is None else np.asarray(cells, dtype=np.int64).ravel()
        others = (False,) * (len(materials) - 1)
        tension_only = tension_field if isinstance(tension_field, tuple) else (tension_field, *others)
        for k, material in enumerate(materials):
            here = kind == k
            if np.any(here):
                self._groups.append(
                    MembraneGroup(
                        vectors[here], sides[here], material, tension_only[k], viscosity, name=names[min(k, len(names) - 1)],
                    )
                )  # fmt: skip
        if air > 0.0:
            self._masses.append(added_mass(vectors, sides, air, np.array([0.0, 0.0, 1.0])))
        self._quads.append(corners)
        return grid

    def cable(
        self,
        start: np.ndarray,
        end: np.ndarray,
        material: CableMaterial | BeamMaterial,
        elements: int = 4,
        start_position: int | None = None,
        end_position: int | None = None,
        viscosity: float = 0.0,
        name: str = "cable",
        tension_only: bool = False,
        strain: float = 0.0,
        energy: str = "cable",
    ) -> np.ndarray:
        """Add a straight cable between two points (3,), m.

        Parameters
        ----------
        start_position, end_position : first coordinates of positions that the ends share, for example film corners
        viscosity : s
        tension_only : whether the cable carries no compression
        strain : -
            (l - l0)/l0 of the length l between the points and the unstressed length l0.
        energy : name of its energy

        Returns
        -------
        (elements + 1, 2) int array
            First coordinates of position and slope at the nodes of the cable.
        """
        start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        length = float(np.linalg.norm(end - start))
        direction = (end - start) / length
        shared = {0: start_position, elements: end_position}
        vectors = np.empty((elements + 1, 2), dtype=np.int64)
        for i in range(elements + 1):
            position = start + (end - start) * i / elements
            borrowed = shared.get(i)
            # this node has only the slope; its position is not used at a shared end
            at = self._node([*position, *((1.0 + strain) * direction), 0.0, 0.0, 0.0], 2, f"{name} node {i}")
            vectors[i] = at if borrowed is None else borrowed, at + 3
            if borrowed is not None:
                self._used[-1][:3] = False
        lengths = np.full(elements, length / (1.0 + strain) / elements)
        self._add_cable(vectors, lengths, material, viscosity, tension_only, energy)
        return vectors

    def edge_cables(
        self, grid: FilmGrid, material: CableMaterial, viscosity: float = 0.0, tension_only: bool = False
    ) -> None:
        """Add a cable along each edge of a film; it shares the positions and slopes of the film there."""
        at = grid.position
        for side in (0, -1):
            along_x, along_y = at[:, side], at[side]
            self._add_cable(np.stack([along_x, along_x + 3], axis=1), np.diff(grid.x), material, viscosity, tension_only)
            self._add_cable(np.stack([along_y, along_y + 6], axis=1), np.diff(grid.y), material, viscosity, tension_only)

    def _add_cable(
        self,
        vectors: np.ndarray,
        lengths: np.ndarray,
        material: CableMaterial | BeamMaterial,
        viscosity: float,
        tension_only: bool,
        energy: str = "cable",
    ) -> None:
        """Add elements of lengths (m,), m; `vectors` (m + 1, 2): first coordinates of position and slope at the nodes."""
        ends = np.concatenate([vectors[:-1], vectors[1:]], axis=1)
        ones = np.ones(len(lengths))
        self._groups.append(
            CableGroup(
                ends, lengths, material.young * material.area * ones, material.young * material.second_moment * ones,
                material.density * material.area * ones, viscosity, tension_only=tension_only, name=energy,
            )
        )  # fmt: skip

    def points(self, places: np.ndarray, name: str, faces: Sequence[Sequence[int]] = ()) -> np.ndarray:
        """Add points (n, 3), m, without slopes, and drawn faces of three or four; returns their first coordinates."""
        found = np.array([
            self._node([*place, *(0.0,) * 6], 1, f"{name} point {number}") for number, place in enumerate(places)
        ])  # fmt: skip
        corners = [found[[*face, face[-1]][:4]] for face in faces]
        self._quads.append(np.array(corners, dtype=np.int64).reshape(-1, 4))
        return found

    def add(self, group: ElementGroup) -> None:
        """Add a group of elements, for example torsional springs between the slopes before and behind a fold."""
        self._groups.append(group)

    def facets(
        self, start: np.ndarray, owner: np.ndarray, numbers: np.ndarray, plane: np.ndarray, angle: np.ndarray,
        material: FilmMaterial, curved: bool = False, viscosity: float = 0.0, rounding: float | None = None,
    ) -> int:  # fmt: skip
        """Add flexible facets; returns the first coordinate of their vector 0.

        Parameters
        ----------
        start : (s, 3, 3) array
            Position and two slopes of each node at the start.
        owner : (s,) int array
            Node whose position each node uses.
        numbers : (m, 9) int array
            Numbers of the vectors r, r_1, r_2 at the corners of each triangle; node s has the vectors 3 s, 3 s + 1, 3 s + 2.
        plane, angle, material, viscosity, rounding : see `FacetGroup`
        curved : whether the initial shape is free of stress; otherwise the flat facets are free of stress
        """
        first = self.size * len(self._nodes)
        for number, vectors in enumerate(start):
            self._node(vectors.ravel().tolist(), 3, f"sheet node {number + 1}")
            if owner[number] != number:
                self._used[-1][:3] = False
        vectors = first + 3 * numbers
        rest = np.concatenate([np.zeros(first), start.ravel()]) if curved else None
        self._groups.append(FacetGroup(vectors, plane, angle, material, rest, first, viscosity, rounding))
        self._quads.append(vectors[:, [0, 3, 6, 6]])
        return first

    def transform(
        self, first: int, rotation: np.ndarray, shift: np.ndarray, stretch: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Stretch along x and y, then rotate (3, 3) and shift (3,), m, all nodes from number `first` on."""
        factor = np.array([1.0 + stretch[0], 1.0 + stretch[1], 1.0])
        for node in range(first, len(self._nodes)):
            vectors = (self._nodes[node].reshape(-1, 3) * factor) @ rotation.T
            vectors[0] += shift
            self._nodes[node] = vectors.ravel()

    @property
    def count(self) -> int:
        """Number of nodes."""
        return len(self._nodes)

    def point_mass(self, position: int, mass: float) -> None:
        """Add a mass (kg) at the position with this first coordinate."""
        self._masses.append(MassPart(np.array([[position]]), np.array([[[mass]]]), np.eye(3)))

    def hold(self, vectors: np.ndarray | int, components: tuple[int, ...] = (0, 1, 2)) -> None:
        """Hold components of vectors (positions, slopes), given by their first coordinates."""
        first = np.atleast_1d(np.asarray(vectors, dtype=np.int64)).ravel()
        self._held.append((first[:, None] + np.asarray(components)).ravel())

    def build(self) -> Mesh:
        """Create the mesh."""
        coordinates, used = np.concatenate(self._nodes), np.concatenate(self._used)
        fixed = ~used
        for held in self._held:
            fixed[held] = True
        quads = np.concatenate([np.zeros((0, 4), dtype=np.int64), *self._quads])
        pattern = node_pattern(len(self._nodes), self.size, self._groups, self._masses)
        return Mesh(coordinates, fixed, tuple(self._groups), tuple(self._masses), quads, tuple(self._names), pattern)

    def _node(self, coordinates: list[float], vectors: int, name: str) -> int:
        """Add a node with this number of used vectors; returns its first coordinate."""
        self._nodes.append(np.array(coordinates[: self.size]))
        self._used.append(np.arange(self.size) < 3 * vectors)
        self._names.append(name)
        return self.size * (len(self._nodes) - 1)
