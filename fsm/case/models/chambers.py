"""Gas of a scene: its chambers with their lids, and the surfaces of rigid panels around them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fsm.case.models.gas import Gas


@dataclass(frozen=True, eq=False)
class Lid:
    """Lid over a ring of nodes: triangles of its edges and of its tip.

    The ends of a ring that is not whole lie in one or two planes of symmetry. The tip is the mean of the nodes of the whole
    ring, which mirror images complete. It therefore lies in these planes.

    Attributes
    ----------
    nodes : (k,) int array
        Nodes of the ring, counter-clockwise around the normal of the lid.
    whole : bool
        Whether the ring is closed.
    weights : (k,) array
        Part of each node in the tip; their sum is 1.
    planes : axes and positions (m) of the planes in which the tip lies
    """

    nodes: np.ndarray
    whole: bool
    weights: np.ndarray
    planes: tuple[tuple[int, float], ...]

    @property
    def edges(self) -> np.ndarray:
        """Positions (m, 2) in `nodes` of the ends of each edge of the ring."""
        first = np.arange(len(self.nodes) - (not self.whole))
        return np.column_stack([first, (first + 1) % len(self.nodes)])

    @property
    def axes(self) -> tuple[int, ...]:
        """Components of the tip that follow the nodes."""
        return tuple(axis for axis in range(3) if axis not in dict(self.planes))

    def tip(self, positions: np.ndarray) -> np.ndarray:
        """Tip (3,) of the lid over a ring at given positions (k, 3), m."""
        out = self.weights @ positions
        for axis, at in self.planes:
            out[axis] = at
        return np.asarray(out)


@dataclass(frozen=True, eq=False)
class Chamber:
    """Chamber of a gas.

    Attributes
    ----------
    gas : Gas
    facets : numbers of its facets
    axes : axes a of the sum for the volume
    origin : (3,) array, m
    caps : lids
    sign : 1, or -1 if the normals of the facets point into the chamber
    volume : m^3
        At the start, with straight edges.
    area : m^2
    """

    gas: Gas
    facets: tuple[int, ...]
    axes: tuple[int, ...]
    origin: np.ndarray
    caps: tuple[Lid, ...]
    sign: float
    volume: float
    area: float


@dataclass(frozen=True, eq=False)
class PanelSurface:
    """Corners of all panels as points of rigid bodies, and the closed surfaces of chambers.

    Attributes
    ----------
    bodies : (n,) names of the body of each corner
    points : (n, 3) array, m
        Corners in the axes of their bodies.
    start : (n, 3) array, m
        Corners at the start.
    triangles : (m, 3) int array of corners, for each chamber
    lids : lids over rings of corners, for each chamber
    folds : corners (4,) of each crease by name: of the left panel, both ends, of the right panel
    """

    bodies: tuple[str, ...]
    points: np.ndarray
    start: np.ndarray
    triangles: tuple[np.ndarray, ...]
    lids: tuple[tuple[Lid, ...], ...]
    folds: Mapping[str, tuple[int, int, int, int]]
