"""Flexible facets as a group of ANCF-DKT triangles: material, shape at rest, mass, membrane efforts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.model.nodes.facets.array_facets import EDGES, EFFORTS, FACETS, GIVEN, POINTS, ROWS
from fsm.model.nodes.facets.facet import FacetArrays, facet_curvatures, facet_efforts, facet_energy, facet_strains
from fsm.model.nodes.facets.facet_shape import FacetRows, facet_masses, facet_rows, membrane_moduli, mid_edge_strains
from fsm.model.nodes.facets.facet_tension import REMAINDER
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.group import ElementGroup, MassPart


@dataclass(eq=False)
class FacetGroup(ElementGroup):
    """Triangles of one material; see `fsm.model.nodes.facets.facet`.

    Attributes
    ----------
    vectors : (m, 9) int array
        First coordinates of r, r_1, r_2 at the corners.
    plane : (m, 3, 2) array, m
        Corners in the plane of the flat triangle, counter-clockwise.
    angle : (m, 3) array, rad
        Angle of the direction of r_1 at each corner with the first axis of the plane.
    material : FilmMaterial
    rest : (n,) array or None
        All coordinates in the curved shape without stress; None: flat.
    first : index of the first coordinate of the facets in the coordinates of the mesh
    viscosity : s
        Kelvin-Voigt time tau.
    rounding : float or None
        Facets carry no compression (`fsm.model.nodes.facets.facet_tension`), and this is the half-width of the rounded
        kinks, as a strain. None: the plain law.
    name : name of its energy
    """

    vectors: np.ndarray
    plane: np.ndarray
    angle: np.ndarray
    material: FilmMaterial
    rest: np.ndarray | None = None
    first: int = 0
    viscosity: float = 0.0
    rounding: float | None = None
    name: str = "panels"
    kernels = FACETS

    @cached_property
    def table(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        own = [array.reshape(-1) if row in (EDGES, ROWS, POINTS) else array for row, array in enumerate(self.arrays)]
        bend, efforts = np.ascontiguousarray(self.rows.bend).reshape(-1), np.zeros((len(self.vectors), 5, 3))
        return [*own, bend, np.array([self.viscosity]), efforts, np.zeros(1)]

    @property
    def mixed(self) -> tuple[np.ndarray, np.ndarray]:
        """Membrane efforts of the table, flat, and (1,) 1 if they give the geometric stiffness, else 0."""
        return self.table[EFFORTS].reshape(-1), self.table[GIVEN]

    @property
    def effort_count(self) -> int:
        """Number of membrane efforts."""
        return 15 * len(self.vectors)

    @property
    def wave_speed(self) -> float:
        """Speed of axial waves, m/s."""
        return math.sqrt(self.material.stretch / self.material.areal_density)

    def mass(self) -> MassPart:
        """See `ElementGroup`."""
        masses = facet_masses(self.plane, self.angle, self.rows.area, self.material.areal_density)
        return MassPart(self.vectors, masses, np.eye(3))

    def give_efforts(self, efforts: np.ndarray | None) -> None:
        """Let these membrane efforts give the geometric stiffness from now on; None: those of the coordinates."""
        own, given = self.mixed
        given[0] = 0.0 if efforts is None else 1.0
        if efforts is not None:
            own[:] = efforts

    def energies(self, q: np.ndarray) -> tuple[float, float]:
        """Energy of stretch and of bending, J."""
        stretch, bend = facet_energy(self.arrays, q)
        return float(stretch), float(bend)

    def efforts(self, q: np.ndarray, dx: np.ndarray | None = None) -> np.ndarray:
        """Membrane efforts, flat: unknowns of the mixed Newton method. With `dx`, the efforts are linearised about q for
        this increment.

        Each triangle has three efforts of its edges, three at each corner and three of rotations, all times its area.
        """
        out = np.empty((len(self.vectors), 5, 3))
        facet_efforts(self.arrays, q, np.zeros_like(q) if dx is None else dx, out)
        return out.ravel()

    def curvatures(self, q: np.ndarray) -> np.ndarray:
        """Curvatures kxx, kyy, kxy at the middles of the edges, (m, 3, 3), 1/m."""
        return np.asarray(facet_curvatures(self.arrays, self.rows.bend, q))

    @cached_property
    def rows(self) -> FacetRows:
        """Rows over the nodal vectors."""
        return facet_rows(self.plane, self.angle)

    def _tension(self) -> tuple[np.ndarray, np.ndarray]:
        """Arrays of the tension field; empty if the law is plain."""
        material, count = self.material, len(self.vectors)
        if self.rounding is None:
            return np.zeros((0, 3, 3, 15)), np.zeros((0, 5))
        points = np.ascontiguousarray(mid_edge_strains(self.rows, self.plane, self.angle))
        tension = np.empty((count, 5))
        tension[:, 0] = self.rows.area / 3.0
        tension[:, 1:] = material.stretch, material.poisson, REMAINDER, self.rounding
        return points, tension

    @cached_property
    def arrays(self) -> FacetArrays:
        """Arrays of the kernels."""
        rows, material, count = self.rows, self.material, len(self.vectors)
        stretch, plate = material.moduli
        moduli = membrane_moduli(rows, self.plane, self.angle, stretch)
        turn = np.diag([1.0, 1.0, 2.0])  # curvatures have kxy, not 2 kxy
        bend = rows.area[:, None, None] / 3.0 * (turn @ plate @ turn)
        strains, rest = np.zeros((count, 5, 3)), np.zeros((0, 3, 3))
        if self.rest is None:
            bending = np.einsum("mpki,mkl,mplj->mij", rows.bend[:, :, 2:], bend, rows.bend[:, :, 2:])
            of_points = np.zeros((0, 3, 5, 9))
        else:
            bending, of_points = np.zeros((0, 9, 9)), np.ascontiguousarray(rows.bend)
        arrays = FacetArrays(
            np.ascontiguousarray(self.vectors), np.ascontiguousarray(rows.edges),
            np.ascontiguousarray(rows.bend[:, :, 1]), strains, moduli,
            np.ascontiguousarray(bending), of_points, np.ascontiguousarray(bend), rest, *self._tension(),
        )  # fmt: skip
        if self.rest is None:
            return arrays
        facet_strains(arrays, self.rest, strains)
        return arrays._replace(rest_curvature=facet_curvatures(arrays, of_points, self.rest))
