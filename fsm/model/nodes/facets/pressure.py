"""Pressure on triangles of a sheet: forces and tangents of a load that stays normal to the deformed surface.

With shapes N_i over the nodal vectors r_i, the position is r = sum N_i r_i, and the force of a pressure p on r_i is

    f_i = p int N_i (r_,X x r_,Y) dX dY = p sum_{j<k} C_ijk r_j x r_k,   C_ijk = int N_i (N_j,X N_k,Y - N_k,X N_j,Y) dX dY

The coefficients C are constant. If the edges of the loaded surface are held, or if it is closed, the surface bounds a
volume. The force f is then p times the gradient of this volume, and the tangent is symmetric (Schweizerhof and Ramm,
1984). At a free edge the load has no potential, and the tangent is not symmetric. Flexible facets have the cubic shape
of Zienkiewicz; neighbours have the same shape along their common edge. Triangles of vertices have a linear shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.kernels.jit import kernel
from fsm.model.nodes.facets.facet_shape import cubic_shapes

_POINTS = 5
"""Gauss points per side of the square that is mapped to the triangle: exact for the degree 7 of C."""
_BATCH = 1000
"""Number of triangles whose coefficients are computed together."""


@dataclass(frozen=True, eq=False)
class PressedFaces:
    """Triangles that can carry a pressure.

    Attributes
    ----------
    vectors : (m, v) int array
        First coordinates of the nodal vectors.
    facet : (m,) int array
        Facet of the sheet to which each triangle belongs.
    plane, angle : (m, 3, 2) and (m, 3) arrays, m and rad
        As in `FacetGroup`, for cubic shapes; empty for linear shapes.
    weight : (m,) array
        Part of the pressure on each triangle; absent: 1. Two pairs of triangles with half of the pressure may cover a cell.
    """

    vectors: np.ndarray
    facet: np.ndarray
    plane: np.ndarray
    angle: np.ndarray
    weight: np.ndarray | None = None

    def of(self, facets: np.ndarray) -> PressedFaces:
        """Selected triangles, which belong to the given facets."""
        here = np.isin(self.facet, facets)
        linear = not len(self.plane)
        return PressedFaces(
            np.ascontiguousarray(self.vectors[here]), self.facet[here],
            self.plane if linear else self.plane[here], self.angle if linear else self.angle[here],
            None if self.weight is None else self.weight[here],
        )  # fmt: skip

    def straight(self) -> PressedFaces:
        """The same triangles with linear shapes between their corners, which all facets at a crease share."""
        if not len(self.plane):
            return self
        vectors = np.ascontiguousarray(self.vectors[:, ::3])
        return PressedFaces(vectors, self.facet, np.zeros((0, 3, 2)), np.zeros((0, 3)), self.weight)

    @cached_property
    def _coefficients(self) -> np.ndarray:
        if len(self.plane):
            found = cubic_coefficients(self.plane, self.angle)
        else:
            found = np.broadcast_to(linear_coefficients(), (len(self.vectors), 3, 3)).copy()
        return found if self.weight is None else found * self.weight[:, None, None]

    @cached_property
    def _pairs(self) -> tuple[np.ndarray, np.ndarray]:
        first, second = np.triu_indices(self.vectors.shape[1], 1)
        return first.astype(np.int64), second.astype(np.int64)

    def add_force(self, q: np.ndarray, pressure: float, force: np.ndarray) -> None:
        """Add the forces of a pressure (Pa) on all coordinates to `force` (n,)."""
        _add_force(self.vectors, *self._pairs, self._coefficients, q, pressure, force)

    def add_stiffness(self, q: np.ndarray, pressure: float, slots: np.ndarray, stiffness: np.ndarray) -> None:
        """Add -df/dq of a pressure (Pa) to block data; `slots` as in `ElementGroup.add_linearised`."""
        arrays = self.vectors, *self._pairs, self._coefficients
        _add_stiffness(*arrays, q, pressure, slots, stiffness.shape[1], stiffness.reshape(-1))

    def swept(self, start: np.ndarray, end: np.ndarray) -> float:
        """Volume between the surfaces of two configurations (n,) of the nodes, along straight lines, m^3.

        It has the sign of the work of a positive pressure. Simpson's rule is exact for the quadratic force.
        """
        total = np.zeros_like(start)
        for weight, q in ((1.0, start), (4.0, 0.5 * (start + end)), (1.0, end)):
            self.add_force(q, weight / 6.0, total)
        return float(total @ (end - start))


def linear_coefficients() -> np.ndarray:
    """C (3, 3) of a triangle with linear shapes, for the pairs (0, 1), (0, 2), (1, 2)."""
    return np.tile(np.array([1.0, -1.0, 1.0]) / 6.0, (3, 1))


def cubic_coefficients(plane: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """C (m, 9, 36) of triangles with cubic shapes, for all pairs j < k of the nine nodal vectors.

    Parameters
    ----------
    plane, angle : see `FacetGroup`
    """
    points, weights = np.polynomial.legendre.leggauss(_POINTS)
    points, weights = 0.5 * (points + 1.0), 0.5 * weights
    x, y = (grid.ravel() for grid in np.meshgrid(points, points, indexing="ij"))
    at = np.stack([1.0 - x, x * (1.0 - y), x * y], axis=1)
    weight = np.outer(weights * points, weights).ravel()
    one, two = np.triu_indices(9, 1)
    out = np.empty((len(plane), 9, len(one)))
    for begin in range(0, len(plane), _BATCH):
        part = slice(begin, begin + _BATCH)
        value, slope = cubic_shapes(plane[part], angle[part], at)
        along = np.roll(plane[part], -1, axis=1) - plane[part]
        double = along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0]
        turned = slope[:, :, 0, one] * slope[:, :, 1, two] - slope[:, :, 0, two] * slope[:, :, 1, one]
        out[part] = double[:, None, None] * np.einsum("p,mpi,mpk->mik", weight, value, turned, optimize=True)
    return out


@kernel
def _add_force(
    vectors: np.ndarray, one: np.ndarray, two: np.ndarray, coefficients: np.ndarray, q: np.ndarray, pressure: float,
    force: np.ndarray,
) -> None:
    count = vectors.shape[1]
    for m in range(vectors.shape[0]):
        for pair in range(len(one)):
            j, k = vectors[m, one[pair]], vectors[m, two[pair]]
            x = q[j + 1] * q[k + 2] - q[j + 2] * q[k + 1]
            y = q[j + 2] * q[k] - q[j] * q[k + 2]
            z = q[j] * q[k + 1] - q[j + 1] * q[k]
            for i in range(count):
                w = pressure * coefficients[m, i, pair]
                at = vectors[m, i]
                force[at] += w * x
                force[at + 1] += w * y
                force[at + 2] += w * z


@kernel
def _add_stiffness(
    vectors: np.ndarray, one: np.ndarray, two: np.ndarray, coefficients: np.ndarray, q: np.ndarray, pressure: float,
    slots: np.ndarray, size: int, into: np.ndarray,
) -> None:
    count = vectors.shape[1]
    axial = np.empty((count, count, 3))
    for m in range(vectors.shape[0]):
        axial[:] = 0.0
        for pair in range(len(one)):
            j, k = one[pair], two[pair]
            for i in range(count):
                w = pressure * coefficients[m, i, pair]
                for a in range(3):
                    axial[i, j, a] += w * q[vectors[m, k] + a]
                    axial[i, k, a] -= w * q[vectors[m, j] + a]
        # -df_i = sum_j axial_ij x dr_j
        for i in range(count):
            for j in range(count):
                x, y, z = axial[i, j, 0], axial[i, j, 1], axial[i, j, 2]
                at = slots[m, i, j]
                into[at + 1] -= z
                into[at + 2] += y
                into[at + size] += z
                into[at + size + 2] -= x
                into[at + 2 * size] -= y
                into[at + 2 * size + 1] += x
