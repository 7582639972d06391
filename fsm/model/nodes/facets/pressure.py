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

from fsm.interactions.triangles.cubic import cubic_shapes
from fsm.kernels.addresses import address_table, floats_1d, floats_3d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import pieces_at, program_at
from fsm.kernels.programs import Pieces, Program, table_of
from fsm.model.nodes.arrays import FORCE, LAST, MEAN_OVER, NOW, NUMBERS, STIFFNESS, Q, U
from fsm.model.nodes.group import ElementGroup

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
    def coefficients(self) -> np.ndarray:
        """C (m, v, p) of all triangles, times their parts of the pressure."""
        if len(self.plane):
            found = cubic_coefficients(self.plane, self.angle)
        else:
            found = np.broadcast_to(linear_coefficients(), (len(self.vectors), 3, 3)).copy()
        return found if self.weight is None else found * self.weight[:, None, None]

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
def add_triangle_force(
    vectors: np.ndarray, one: np.ndarray, two: np.ndarray, coefficients: np.ndarray, q: np.ndarray, pressure: float,
    force: np.ndarray,
) -> None:
    """Add the forces of a pressure on a triangle with nodal vectors (v,), pairs `one` and `two` (p,) and C (v, p)."""
    for pair in range(len(one)):
        j, k = vectors[one[pair]], vectors[two[pair]]
        x = q[j + 1] * q[k + 2] - q[j + 2] * q[k + 1]
        y = q[j + 2] * q[k] - q[j] * q[k + 2]
        z = q[j] * q[k + 1] - q[j + 1] * q[k]
        for i in range(vectors.shape[0]):
            w = pressure * coefficients[i, pair]
            at = vectors[i]
            force[at] += w * x
            force[at + 1] += w * y
            force[at + 2] += w * z


@kernel
def add_triangle_stiffness(
    vectors: np.ndarray, one: np.ndarray, two: np.ndarray, coefficients: np.ndarray, q: np.ndarray, pressure: float,
    slots: np.ndarray, size: int, into: np.ndarray, axial: np.ndarray,
) -> None:
    """Add -df/dq of a triangle to flat block data; `slots` (v, v) as in `ElementGroup.add_linearised`, `axial` (v, v, 3) is
    work space.
    """
    count = vectors.shape[0]
    axial[:] = 0.0
    for pair in range(len(one)):
        j, k = one[pair], two[pair]
        for i in range(count):
            w = pressure * coefficients[i, pair]
            for a in range(3):
                axial[i, j, a] += w * q[vectors[k] + a]
                axial[i, k, a] -= w * q[vectors[j] + a]
    # -df_i = sum_j axial_ij x dr_j
    for i in range(count):
        for j in range(count):
            x, y, z = axial[i, j, 0], axial[i, j, 1], axial[i, j, 2]
            at = slots[i, j]
            into[at + 1] -= z
            into[at + 2] += y
            into[at + size] += z
            into[at + size + 2] -= x
            into[at + 2 * size] -= y
            into[at + 2 * size + 1] += x


# group ------------------------------------------------------------------------------------------------------------------

_VECTORS, _PAIRS, _COEFFICIENTS, _SIZE, _TIME = range(5)
_SLOTS = _TIME + len(Pieces._fields)
"""Rows of the table of a group."""


@kernel
def _add_force(own: np.ndarray, q: np.ndarray, pressure: float, force: np.ndarray) -> float:
    vectors, pairs, coefficients = integers_2d(own, _VECTORS), integers_2d(own, _PAIRS), floats_3d(own, _COEFFICIENTS)
    for m in range(vectors.shape[0]):
        add_triangle_force(vectors[m], pairs[0], pairs[1], coefficients[m], q, pressure, force)
    return 0.0


@kernel
def _pressure(table: np.ndarray, own: np.ndarray) -> float:
    return float(floats_1d(own, _SIZE)[0] * program_at(pieces_at(own, _TIME), 0, floats_1d(table, NUMBERS)[NOW])[0])


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return _add_force(own, floats_1d(table, Q), _pressure(table, own), floats_1d(table, FORCE))


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    vectors, pairs, coefficients = integers_2d(own, _VECTORS), integers_2d(own, _PAIRS), floats_3d(own, _COEFFICIENTS)
    stiffness, q, pressure = floats_3d(table, STIFFNESS), floats_1d(table, Q), _pressure(table, own)
    count, width = vectors.shape
    slots, axial = integers_2d(own, _SLOTS).reshape(count, width, width), np.empty((width, width, 3))
    flat = stiffness.reshape(-1)
    for m in range(count):
        add_triangle_stiffness(
            vectors[m], pairs[0], pairs[1], coefficients[m], q, pressure, slots[m], stiffness.shape[1], flat, axial
        )
    return _add_force(own, q, pressure, floats_1d(table, FORCE))


@kernel
def _nothing(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return 0.0


@kernel
def mean_rates(table: np.ndarray) -> np.ndarray:
    """Rates (n,) of the coordinates: means over a quasi-static step, else the present ones."""
    q, last, over = floats_1d(table, Q), floats_1d(table, LAST), floats_1d(table, NUMBERS)[MEAN_OVER]
    if over == 0.0:
        return floats_1d(table, U)
    out = np.empty(q.shape[0])
    for i in range(out.shape[0]):
        out[i] = (q[i] - last[i]) / over
    return out


@kernel
def _put_in(table: np.ndarray, own: np.ndarray, step: float) -> float:
    """Power at the present state, or, for a negative step, at the state before the present one."""
    force = np.zeros(floats_1d(table, Q).shape[0])
    _add_force(own, floats_1d(table, LAST if step < 0.0 else Q), _pressure(table, own), force)
    return float(force @ mean_rates(table))


class PressureGroup(ElementGroup):
    """Pressure on triangles over time, without a potential.

    Parameters
    ----------
    load : name of the load
    faces : PressedFaces
    pressure : Pa
    time : factor over time
    """

    name = ""
    kernels = (_force, _tangent, _nothing, _nothing, _put_in)

    def __init__(self, load: str, faces: PressedFaces, pressure: float, time: Program) -> None:
        self.load, self.pressure, self.time = load, pressure, time
        self.vectors = np.ascontiguousarray(faces.vectors)
        pairs = np.array(np.triu_indices(self.vectors.shape[1], 1), dtype=np.int64)
        arrays = self.vectors, pairs, np.ascontiguousarray(faces.coefficients), np.array([pressure])
        self._arrays = [*arrays, *table_of([time])]
        self._own = address_table(self._arrays)

    @property
    def table(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return self._arrays

    def size(self, t: float) -> float:
        """Pressure at a time, Pa."""
        return self.pressure * self.time.at(t)[0]

    def add_force_rate(self, t: float, q: np.ndarray, force: np.ndarray) -> None:
        """See `ElementGroup`."""
        _add_force(self._own, q, self.pressure * self.time.at(t)[1], force)

    def break_times(self) -> list[float]:
        """See `ElementGroup`."""
        return list(self.time.breaks())

    def peak_times(self) -> list[float]:
        """See `ElementGroup`."""
        return list(self.time.peaks())

    def swept(self, start: np.ndarray, end: np.ndarray) -> float:
        """Volume between the surfaces of two configurations (n,) of the nodes, along straight lines, m^3.

        It has the sign of the work of a positive pressure. Simpson's rule is exact for the quadratic force.
        """
        total = np.zeros_like(start)
        for weight, q in ((1.0, start), (4.0, 0.5 * (start + end)), (1.0, end)):
            _add_force(self._own, q, weight / 6.0, total)
        return float(total @ (end - start))
