"""Flexible facets as a group of ANCF-DKT triangles: material, shape at rest, mass, membrane efforts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.model.nodes.facets.array_facets import EFFORTS, FACETS, GIVEN, POINTS
from fsm.model.nodes.facets.facet import FacetArrays, facet_efforts, facet_energy, facet_states, packed
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
        own = [array.reshape(-1) if row == POINTS else array for row, array in enumerate(self.arrays)]
        return [*own, np.array([self.viscosity]), np.zeros((len(self.vectors), 5, 3)), np.zeros(1)]

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
        own, count = self.arrays, len(self.vectors)
        strains, curvatures = np.empty((count, 15)), np.empty((count, 9))
        facet_states(own, q, strains, curvatures)
        return curvatures.reshape(-1, 3, 3) + self._at_rest[1].reshape(-1, 3, 3)

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
    def _at_rest(self) -> tuple[np.ndarray, np.ndarray]:
        """Strains (m, 15) and curvatures (m, 9) at rest; zero if it is flat."""
        strains, curvatures = np.zeros((len(self.vectors), 15)), np.zeros((len(self.vectors), 9))
        if self.rest is not None:
            facet_states(self._arrays(strains.copy(), curvatures.copy()), self.rest, strains, curvatures)
        return strains, curvatures

    @cached_property
    def arrays(self) -> FacetArrays:
        """Arrays of the kernels."""
        return self._arrays(*self._at_rest)

    def _arrays(self, strains: np.ndarray, curvatures: np.ndarray) -> FacetArrays:
        """Arrays for strains and curvatures at rest."""
        rows, material, count = self.rows, self.material, len(self.vectors)
        stretch, plate = material.moduli
        moduli = membrane_moduli(rows, self.plane, self.angle, stretch)
        turn = np.diag([1.0, 1.0, 2.0])  # curvatures have kxy, not 2 kxy
        bend = rows.area[:, None, None] / 3.0 * (turn @ plate @ turn)
        bending = np.zeros((0, 9, 9))
        if self.rest is None:
            bending = np.einsum("mpki,mkl,mplj->mij", rows.bend[:, :, 2:], bend, rows.bend[:, :, 2:])
        # slopes along the edges contain those at their middles, which `rows.bend` repeats
        parts = rows.edges, rows.bend[:, :, 1], rows.bend[:, :, 2:], strains, moduli, bend, curvatures
        return FacetArrays(
            np.ascontiguousarray(self.vectors), packed(self.vectors),
            packed(np.concatenate([part.reshape(count, -1) for part in parts], axis=1)),
            packed(bending) if self.rest is None else np.zeros((0, 0)), *self._tension(),
        )  # fmt: skip
