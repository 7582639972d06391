"""ANCF cable: a thin beam of two nodes with positions and slopes, 12 coordinates (Sun et al. 2024, eqs. 2 to 10).

    eps = (r'.r' - 1)/2,   kappa = |r' x r''|/|r'|^2,   U = 1/2 int EA eps^2 + EI kappa^2 dX

kappa is the material curvature, dtheta/dX. The printed equation has |r'|^3, which gives the geometric curvature and couples
bending with stretch. With A = r'.r', B = r''.r'', C = r'.r'', kappa^2 = B/A - C^2/A^2, which is smooth for a straight cable.

A tension-only cable carries no compression. For eps <= 0 a small fraction of EA remains, with an additional constant force
as in `fsm.model.nodes.tension_field`. The bending stiffness remains.

For a material that is linear in the engineering strain, eps = |r'| - 1 (`engineering`). The engineering strain and
Green's strain differ by eps^2/2.

Stretch has 5 Gauss points. This rule is exact, because r' is quadratic and eps^2 has the degree 8. Bending has 3 Gauss
points, because its integrand is rational (see `POINTS`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.nodes.arrays import AT_REST, DAMPERS, DAMPING, FORCE, IN_MOTION, STIFFNESS, Q, U
from fsm.model.nodes.assembly import gather, scatter_force
from fsm.model.nodes.group import ElementGroup, MassPart
from fsm.model.nodes.shape import cable_shape, gauss
from fsm.model.nodes.tension_field import REMAINDER

POINTS = (5, 3)
"""Gauss points of stretch and of bending. Error of the tip of a cantilever under 3 E I/L^2 with 8 elements, relative to L:
2.8e-5 with (5, 3) points. With one more point in bending the error changes by 5e-8; with one less it doubles. With one
less in stretch it changes by 1e-7."""

_VISCOSITY, _ENGINEERING, _SLOTS = 11, 12, 13
"""Rows of a group's table after those of `CableArrays`."""


class CableArrays(NamedTuple):
    """Arrays of all cables for the kernels.

    Attributes
    ----------
    vectors, scale, length : (m, 4) int, (m, 4), (m,) arrays
    stiffness : (m, 2) array
        EA (N) and EI (N m^2).
    remainder : (1,) array
        Fraction of EA under compression; below 1 for tension-only cables.
    release : (m, s) array, N
        Force P of tension-only cables; zero for others.
    stretch_rows, bend_rows : (s, 1, 4), (p, 2, 4) arrays
        First derivatives, and first and second derivatives, of the shape functions of a unit element.
    stretch_weights, bend_weights : (s,), (p,) arrays
    products : (s + 4 p, 16) array
        Products of the derivatives of two shape functions, for all pairs of functions. The first rows belong to the points
        of stretch, the others to the points of bending: both first derivatives, first and second, second and first, both
        second.
    """

    vectors: np.ndarray
    scale: np.ndarray
    length: np.ndarray
    stiffness: np.ndarray
    remainder: np.ndarray
    release: np.ndarray
    stretch_rows: np.ndarray
    bend_rows: np.ndarray
    stretch_weights: np.ndarray
    bend_weights: np.ndarray
    products: np.ndarray


@kernel(inline=True)
def _derivatives(e: np.ndarray, rows: np.ndarray, length: float, g: np.ndarray) -> None:
    """Compute r', and r'' if `rows` contains it, at one point into g (3,) or (6,)."""
    factor = 1.0
    for p in range(rows.shape[0]):
        factor /= length
        for a in range(3):
            total = 0.0
            for i in range(4):
                total += rows[p, i] * e[a, i]
            g[3 * p + a] = factor * total


@kernel(inline=True)
def _products(g: np.ndarray) -> tuple[float, float, float]:
    """Products A = r'.r', B = r''.r'', C = r'.r''."""
    aa = g[0] * g[0] + g[1] * g[1] + g[2] * g[2]
    bb = g[3] * g[3] + g[4] * g[4] + g[5] * g[5]
    ab = g[0] * g[3] + g[1] * g[4] + g[2] * g[5]
    return aa, bb, ab


@kernel(inline=True)
def _stretch(g: np.ndarray, engineering: bool) -> tuple[float, float, float]:
    """Strain eps, and its first and second derivatives with respect to r'.r'/2."""
    squared = g[0] * g[0] + g[1] * g[1] + g[2] * g[2]
    if not engineering:
        return 0.5 * (squared - 1.0), 1.0, 0.0
    size = math.sqrt(squared)
    return size - 1.0, 1.0 / size, -1.0 / (size * squared)


@kernel(inline=True)
def _force(axial: float, strain: float, remainder: float) -> tuple[float, float]:
    """Force (N) of a strain without P, and its derivative; `remainder` is the fraction of EA under compression."""
    part = axial if strain > 0.0 else remainder * axial
    return part * strain, part


@kernel
def release_at(cable: CableArrays, engineering: bool, q: np.ndarray) -> None:
    """Set the forces P so that no cable is under compression in this configuration."""
    e, g = np.empty((3, 4)), np.empty(3)
    for k in range(cable.vectors.shape[0]):
        gather(cable.vectors[k], cable.scale[k], q, e)
        for point in range(cable.stretch_weights.shape[0]):
            _derivatives(e, cable.stretch_rows[point], cable.length[k], g)
            strain, _, _ = _stretch(g, engineering)
            cable.release[k, point] = -cable.stiffness[k, 0] * min(strain, 0.0)


@kernel(inline=True)
def _bend_hessian(g: np.ndarray, bending: float, length: float, hessian: np.ndarray) -> None:
    """Compute second derivatives (6, 6) of the bending energy per length with respect to r' and r'' (natural coordinate)."""
    aa, bb, ab = _products(g)
    a2 = aa * aa
    by_a = 0.5 * (-bb / a2 + 2.0 * ab * ab / (a2 * aa))
    by_b, by_c = 0.5 / aa, -ab / a2
    by_aa = 0.5 * (2.0 * bb / (a2 * aa) - 6.0 * ab * ab / (a2 * a2))
    by_ab, by_ac, by_cc = -0.5 / a2, 2.0 * ab / (a2 * aa), -1.0 / a2
    first, second = 1.0 / length, 1.0 / (length * length)
    for a in range(3):
        for b in range(3):
            same = 1.0 if a == b else 0.0
            x, y, s, t = g[a], g[3 + a], g[b], g[3 + b]
            slopes = 2.0 * by_a * same + 4.0 * by_aa * x * s + 2.0 * by_ac * (x * t + y * s) + by_cc * y * t
            mixed = by_c * same + 4.0 * by_ab * x * t + 2.0 * by_ac * x * s + by_cc * y * s
            bends = 2.0 * by_b * same + by_cc * x * s
            hessian[a, b] = bending * first * first * slopes
            hessian[a, 3 + b] = bending * first * second * mixed
            hessian[3 + b, a] = bending * first * second * mixed
            hessian[3 + a, 3 + b] = bending * second * second * bends


@kernel(inline=True)
def _scatter(
    slots: np.ndarray, scale: np.ndarray, size: int, symmetric: bool, blocks: np.ndarray, flat: np.ndarray
) -> None:
    """Add an element matrix to the flat block data, from blocks (6 or 9, 16) for pairs of components.

    There are 6 pairs a <= b of a symmetric matrix, else 9.
    """
    pair = 0
    for a in range(3):
        for b in range(a if symmetric else 0, 3):
            for i in range(4):
                for j in range(4):
                    value = scale[i] * scale[j] * blocks[pair, 4 * i + j]
                    flat[slots[i, j] + a * size + b] += value
                    if symmetric and b > a:
                        flat[slots[j, i] + b * size + a] += value
            pair += 1


# on tables --------------------------------------------------------------------------------------------------------------

@kernel
def _cables_of(t: np.ndarray) -> CableArrays:
    return CableArrays(
        integers_2d(t, 0), floats_2d(t, 1), floats_1d(t, 2), floats_2d(t, 3), floats_1d(t, 4), floats_2d(t, 5),
        floats_3d(t, 6), floats_3d(t, 7), floats_1d(t, 8), floats_1d(t, 9), floats_2d(t, 10),
    )  # fmt: skip


@kernel
def _engineering(own: np.ndarray) -> bool:
    return bool(integers_1d(own, _ENGINEERING)[0] == 1)


@kernel
def _viscosity(own: np.ndarray, moving: float, least: float) -> float:
    """Kelvin-Voigt time (s) if the number of a kernel is `least` or above, else zero."""
    return float(floats_1d(own, _VISCOSITY)[0]) if moving >= least else 0.0


@kernel
def _add_forces(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    cable, engineering, viscosity = _cables_of(own), _engineering(own), _viscosity(own, moving, IN_MOTION)
    share = 0.0 if moving == DAMPERS else 1.0
    q, u, force = floats_1d(table, Q), floats_1d(table, U), floats_1d(table, FORCE)
    e, rates, element = np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 4))
    g, v = np.empty(6), np.empty(3)
    remainder = cable.remainder[0]
    for k in range(cable.vectors.shape[0]):
        gather(cable.vectors[k], cable.scale[k], q, e)
        if viscosity > 0.0:
            gather(cable.vectors[k], cable.scale[k], u, rates)
        length = cable.length[k]
        axial, bending = cable.stiffness[k]
        element[:] = 0.0
        for point in range(cable.stretch_weights.shape[0]):
            rows = cable.stretch_rows[point]
            _derivatives(e, rows, length, g)
            strain, slope, _ = _stretch(g, engineering)
            elastic, _ = _force(axial, strain, remainder)
            tension = share * (elastic + remainder * cable.release[k, point]) * slope
            if viscosity > 0.0:
                _derivatives(rates, rows, length, v)
                tension += viscosity * axial * (g[0] * v[0] + g[1] * v[1] + g[2] * v[2])
            for a in range(3):
                for i in range(4):
                    element[a, i] += cable.stretch_weights[point] * tension * g[a] * rows[0, i]
        for point in range(cable.bend_weights.shape[0] if share > 0.0 else 0):
            rows = cable.bend_rows[point]
            _derivatives(e, rows, length, g)
            aa, bb, ab = _products(g)
            by_a = 0.5 * (-bb / (aa * aa) + 2.0 * ab * ab / (aa * aa * aa))
            by_b, by_c = 0.5 / aa, -ab / (aa * aa)
            weight = cable.bend_weights[point] * bending
            for a in range(3):
                first = weight * (2.0 * by_a * g[a] + by_c * g[3 + a])
                second = weight / length * (2.0 * by_b * g[3 + a] + by_c * g[a])
                for i in range(4):
                    element[a, i] += first * rows[0, i] + second * rows[1, i]
        scatter_force(cable.vectors[k], cable.scale[k], -1.0, element, force)
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    _add_forces(table, own, moving)
    cable, engineering, viscosity = _cables_of(own), _engineering(own), _viscosity(own, moving, AT_REST)
    q, u, share = floats_1d(table, Q), floats_1d(table, U), 0.0 if moving == DAMPERS else 1.0
    stiffness, damping = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    (count, width), size, moving = cable.vectors.shape, stiffness.shape[1], _viscosity(own, moving, IN_MOTION)
    slots = integers_2d(own, _SLOTS).reshape(count, width, width)
    into_stiffness, into_damping = stiffness.reshape(-1), damping.reshape(-1)
    e, rates = np.empty((3, 4)), np.empty((3, 4))
    g, v, bend = np.empty(6), np.zeros(3), np.empty((6, 6))
    remainder, elements, points = cable.remainder[0], cable.vectors.shape[0], cable.stretch_weights.shape[0]
    symmetric = moving == 0.0
    pairs = 6 if symmetric else 9
    factors = np.empty((pairs * elements, cable.products.shape[0]))
    viscous = np.empty((6 * elements if viscosity > 0.0 else 0, points))
    for k in range(elements):
        gather(cable.vectors[k], cable.scale[k], q, e)
        if not symmetric:
            gather(cable.vectors[k], cable.scale[k], u, rates)
        length = cable.length[k]
        axial, bending = cable.stiffness[k]
        for point in range(points):
            rows = cable.stretch_rows[point]
            _derivatives(e, rows, length, g)
            if not symmetric:
                _derivatives(rates, rows, length, v)
            strain, slope, bow = _stretch(g, engineering)
            rate = g[0] * v[0] + g[1] * v[1] + g[2] * v[2]
            elastic, along = _force(axial, strain, remainder)
            elastic, along = share * (elastic + remainder * cable.release[k, point]), share * along
            factor = cable.stretch_weights[point] / length
            stiff = factor * (along * slope * slope + elastic * bow)
            same = factor * (elastic * slope + axial * moving * rate)
            row, other = pairs * k, 6 * k
            for a in range(3):
                for b in range(a if symmetric else 0, 3):
                    factors[row, point] = stiff * g[a] * g[b] + factor * axial * moving * g[a] * v[b]
                    if a == b:
                        factors[row, point] += same
                    row += 1
                if viscosity > 0.0:
                    for b in range(a, 3):
                        viscous[other, point] = factor * axial * viscosity * g[a] * g[b]
                        other += 1
        for point in range(cable.bend_weights.shape[0]):
            _derivatives(e, cable.bend_rows[point], length, g)
            _bend_hessian(g, share * cable.bend_weights[point] * length * bending, length, bend)
            first, row = points + 4 * point, pairs * k
            for a in range(3):
                for b in range(a if symmetric else 0, 3):
                    factors[row, first], factors[row, first + 1] = bend[a, b], bend[a, 3 + b]
                    factors[row, first + 2], factors[row, first + 3] = bend[3 + a, b], bend[3 + a, 3 + b]
                    row += 1
    blocks = np.dot(factors, cable.products)
    for k in range(elements):
        _scatter(slots[k], cable.scale[k], size, symmetric, blocks[pairs * k : pairs * (k + 1)], into_stiffness)
    if viscosity > 0.0:
        blocks = np.dot(viscous, cable.products[:points])
        for k in range(elements):
            _scatter(slots[k], cable.scale[k], size, True, blocks[6 * k : 6 * (k + 1)], into_damping)
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    cable, engineering, q = _cables_of(own), _engineering(own), floats_1d(table, Q)
    e, g = np.empty((3, 4)), np.empty(6)
    total = 0.0
    for k in range(cable.vectors.shape[0]):
        gather(cable.vectors[k], cable.scale[k], q, e)
        length = cable.length[k]
        axial, bending = cable.stiffness[k]
        for point in range(cable.stretch_weights.shape[0]):
            _derivatives(e, cable.stretch_rows[point], length, g)
            strain, _, _ = _stretch(g, engineering)
            elastic, _ = _force(axial, strain, cable.remainder[0])
            density = 0.5 * elastic * strain + cable.remainder[0] * cable.release[k, point] * strain
            total += cable.stretch_weights[point] * length * density
        for point in range(cable.bend_weights.shape[0]):
            _derivatives(e, cable.bend_rows[point], length, g)
            aa, bb, ab = _products(g)
            total += 0.5 * cable.bend_weights[point] * length * bending * (bb / aa - ab * ab / (aa * aa))
    return total


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    cable, viscosity = _cables_of(own), _viscosity(own, moving, IN_MOTION)
    q, u = floats_1d(table, Q), floats_1d(table, U)
    if viscosity == 0.0:
        return 0.0
    e, g, v = np.empty((3, 4)), np.empty(3), np.empty(3)
    power = 0.0
    for k in range(cable.vectors.shape[0]):
        length, axial = cable.length[k], cable.stiffness[k, 0]
        for point in range(cable.stretch_weights.shape[0]):
            gather(cable.vectors[k], cable.scale[k], q, e)
            _derivatives(e, cable.stretch_rows[point], length, g)
            gather(cable.vectors[k], cable.scale[k], u, e)
            _derivatives(e, cable.stretch_rows[point], length, v)
            rate = g[0] * v[0] + g[1] * v[1] + g[2] * v[2]
            power += viscosity * cable.stretch_weights[point] * length * axial * rate * rate
    return power


CABLES = (_add_forces, _tangent, _stored, _lost)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""


@dataclass(frozen=True, eq=False)
class CableGroup(ElementGroup):
    """Group of cables; see the module docstring.

    Attributes
    ----------
    vectors : (m, 4) int array
        First coordinates of r_A, r_A', r_B, r_B'.
    length : (m,) array, m
        Unstretched length.
    axial : (m,) array, N
        EA.
    bending : (m,) array, N m^2
        EI.
    line_density : (m,) array, kg/m
    viscosity : s
        Kelvin-Voigt time of stretch: EA (eps + viscosity eps'). Dissipation in bending is neglected.
    engineering : whether the axial force is linear in |r'| - 1 and not in Green's strain
    tension_only : whether the cables carry no compression
    name : name of the energy
    """

    vectors: np.ndarray
    length: np.ndarray
    axial: np.ndarray
    bending: np.ndarray
    line_density: np.ndarray
    viscosity: float = 0.0
    engineering: bool = False
    tension_only: bool = False
    name: str = "cable"
    kernels = CABLES

    @property
    def table(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return [*self.arrays, np.array([self.viscosity]), np.array([int(self.engineering)], dtype=np.int64)]

    @property
    def wave_speed(self) -> float:
        """Speed of axial waves, m/s."""
        return float(np.sqrt(np.max(self.axial / self.line_density)))

    def mass(self) -> MassPart:
        """See `ElementGroup`; the mass matrix is exact, int rho A S_i S_j dX."""
        points, weights = gauss(4)
        shapes = cable_shape(points)
        unit = np.einsum("g,gi,gj->ij", weights, shapes, shapes)
        mass = (self.line_density * self.length)[:, None, None] * unit
        return MassPart(self.vectors, mass * self._scale[:, :, None] * self._scale[:, None], np.eye(3))

    @property
    def tension_field(self) -> bool:
        """Whether `release` has an effect."""
        return self.tension_only

    def release(self, q: np.ndarray, remainder: float) -> None:
        """Set the forces P so that tension-only cables carry no compression at q; `remainder` is the fraction of EA that
        remains under compression.
        """
        if self.tension_only:
            release_at(self.arrays, self.engineering, q)
            self.arrays.remainder[0] = remainder

    def tension(self, q: np.ndarray) -> np.ndarray:
        """Axial force at the middle of each cable, (m,), N."""
        coordinates = q[self.vectors[:, :, None] + np.arange(3)] * self.arrays.scale[:, :, None]
        slope = np.einsum("i,eia->ea", cable_shape(0.5, derivative=1), coordinates) / self.length[:, None]
        size = np.linalg.norm(slope, axis=1)
        force = self.axial * (size - 1.0 if self.engineering else 0.5 * (size**2 - 1.0) * size)
        return np.asarray(np.maximum(force, 0.0) if self.tension_only else force)

    @cached_property
    def _scale(self) -> np.ndarray:
        ones = np.ones_like(self.length)
        return np.ascontiguousarray(np.column_stack([ones, self.length, ones, self.length]))

    @cached_property
    def arrays(self) -> CableArrays:
        """Arrays of the kernels."""
        (stretch, stretch_weights), (bend, bend_weights) = (gauss(count) for count in POINTS)
        stiffness = np.ascontiguousarray(np.column_stack([self.axial, self.bending]))
        derivatives = np.stack([cable_shape(bend, derivative=d) for d in (1, 2)], axis=1)
        first = cable_shape(stretch, derivative=1)[:, None]
        products = [np.einsum("pai,pbj->pabij", rows, rows).reshape(-1, 16) for rows in (first, derivatives)]
        return CableArrays(
            np.ascontiguousarray(self.vectors), self._scale, np.ascontiguousarray(self.length), stiffness,
            np.array([REMAINDER if self.tension_only else 1.0]), np.zeros((len(self.length), len(stretch_weights))),
            np.ascontiguousarray(first), np.ascontiguousarray(derivatives), stretch_weights, bend_weights,
            np.concatenate(products),
        )  # fmt: skip
