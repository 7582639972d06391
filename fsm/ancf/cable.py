"""ANCF cable: a thin beam of two nodes with positions and slopes, 12 coordinates (seed 000, eqs. 2 to 10).

    eps = (r'.r' - 1)/2,   kappa = |r' x r''|/|r'|^2,   U = 1/2 int EA eps^2 + EI kappa^2 dX

The curvature is the material one, dtheta/dX: the printed |r'|^3 is the geometric one and couples bending with stretch.
With A = r'.r', B = r''.r'', C = r'.r'' it is kappa^2 = B/A - C^2/A^2: smooth where the cable is straight.

Gauss points: 5. r' is quadratic, so eps^2 is of degree 8 and exact with 5; kappa^2 is rational. With 4 the converged tip of
the cantilever moves by 3e-6 of its length at 4 elements, with 6 by 2e-9 against 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.ancf.assembly import add_point, gather, scatter_force, scatter_matrix
from fsm.ancf.group import MassPart
from fsm.ancf.shape import cable_shape, gauss
from fsm.kernels.jit import kernel

__all__ = ["POINTS", "CableGroup"]

POINTS = 5
"""Gauss points of stretch and bending."""


@dataclass(frozen=True, eq=False)
class CableGroup:
    """Cables; see the module docstring.

    Attributes
    ----------
    vectors : (m, 4) int array
        First coordinates of r_A, r_A', r_B, r_B'.
    length : (m,) array, m
        Unstretched.
    axial : (m,) array, N
        EA.
    bending : (m,) array, N m^2
        EI.
    line_density : (m,) array, kg/m
    viscosity : s
        Kelvin-Voigt, of stretch: EA (eps + viscosity eps'). What thin cables dissipate in bending is left out.
    name : of its energy
    """

    vectors: np.ndarray
    length: np.ndarray
    axial: np.ndarray
    bending: np.ndarray
    line_density: np.ndarray
    viscosity: float = 0.0
    name: str = "cable"

    @property
    def rate_dependent(self) -> bool:
        """See `ElementGroup`."""
        return self.viscosity > 0.0

    def mass(self) -> MassPart:
        """See `ElementGroup`: exact, int rho A S_i S_j dX."""
        points, weights = gauss(4)
        shapes = cable_shape(points)
        unit = np.einsum("g,gi,gj->ij", weights, shapes, shapes)
        scalar = (self.line_density * self.length)[:, None, None] * unit * self._scale[:, :, None] * self._scale[:, None]
        return MassPart(self.vectors, scalar, np.eye(3))

    def add_force(self, q: np.ndarray, u: np.ndarray | None, force: np.ndarray) -> None:
        """See `ElementGroup`."""
        rates = q if u is None else u
        add_force(*self._arrays, q, rates, 0.0 if u is None else self.viscosity, force)

    def add_linearised(
        self,
        q: np.ndarray,
        u: np.ndarray | None,
        slots: np.ndarray,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
    ) -> None:
        """See `ElementGroup`."""
        self.add_force(q, u, force)
        rates = q if u is None else u
        viscosity = self.viscosity if u is not None else 0.0
        add_tangent(
            *self._arrays, q, rates, viscosity, self.viscosity, slots, stiffness.shape[1], stiffness.reshape(-1),
            damping.reshape(-1),
        )  # fmt: skip

    def energy(self, q: np.ndarray, u: np.ndarray | None) -> tuple[float, float]:
        """See `ElementGroup`."""
        stored = float(stored_energy(*self._arrays, q))
        if u is None or not self.viscosity:
            return stored, 0.0
        force = np.zeros_like(q)
        add_force(*self._arrays, q, u, self.viscosity, force)
        elastic = np.zeros_like(q)
        add_force(*self._arrays, q, u, 0.0, elastic)
        return stored, float((elastic - force) @ u)

    def tension(self, q: np.ndarray) -> np.ndarray:
        """Axial force at the middle of each cable, EA eps |r'|, (m,), N."""
        shape = cable_shape(0.5, derivative=1)
        coordinates = q[self.vectors[:, :, None] + np.arange(3)] * self._scale[:, :, None]
        slope = np.einsum("i,eia->ea", shape, coordinates) / self.length[:, None]
        squared = np.sum(slope**2, axis=1)
        return np.asarray(self.axial * 0.5 * (squared - 1.0) * np.sqrt(squared))

    @cached_property
    def _scale(self) -> np.ndarray:
        ones = np.ones_like(self.length)
        return np.ascontiguousarray(np.column_stack([ones, self.length, ones, self.length]))

    @cached_property
    def _arrays(self) -> tuple[np.ndarray, ...]:
        points, weights = gauss(POINTS)
        rows = np.stack([cable_shape(points, derivative=1), cable_shape(points, derivative=2)], axis=1)
        stiffness = np.ascontiguousarray(np.column_stack([self.axial, self.bending]))
        return self.vectors, self._scale, self.length, stiffness, np.ascontiguousarray(rows), weights


@kernel(inline=True)
def _derivatives(e: np.ndarray, rows: np.ndarray, length: float, g: np.ndarray) -> None:
    """r' and r'' at one point, g (6,)."""
    for p in range(2):
        factor = 1.0 / length if p == 0 else 1.0 / (length * length)
        for a in range(3):
            total = 0.0
            for i in range(4):
                total += rows[p, i] * e[a, i]
            g[3 * p + a] = factor * total


@kernel(inline=True)
def _invariants(g: np.ndarray) -> tuple[float, float, float]:
    """A = r'.r', B = r''.r'', C = r'.r''."""
    aa = g[0] * g[0] + g[1] * g[1] + g[2] * g[2]
    bb = g[3] * g[3] + g[4] * g[4] + g[5] * g[5]
    ab = g[0] * g[3] + g[1] * g[4] + g[2] * g[5]
    return aa, bb, ab


@kernel
def stored_energy(
    vectors: np.ndarray, scale: np.ndarray, length: np.ndarray, stiffness: np.ndarray, rows: np.ndarray,
    weights: np.ndarray, q: np.ndarray,
) -> float:  # fmt: skip
    """Energy of all cables, J; arguments as in `CableGroup._arrays`."""
    e, g = np.empty((3, 4)), np.empty(6)
    total = 0.0
    for k in range(vectors.shape[0]):
        gather(vectors[k], scale[k], q, e)
        for point in range(weights.shape[0]):
            _derivatives(e, rows[point], length[k], g)
            aa, bb, ab = _invariants(g)
            strain = 0.5 * (aa - 1.0)
            squared = bb / aa - ab * ab / (aa * aa)
            total += 0.5 * weights[point] * length[k] * (stiffness[k, 0] * strain * strain + stiffness[k, 1] * squared)
    return total


@kernel(inline=True)
def _effort(g: np.ndarray, v: np.ndarray, axial: float, bending: float, viscosity: float, effort: np.ndarray) -> None:
    """Derivatives (6,) of the energy per length by r' and r'', and with a viscosity those of the dissipation by rates v."""
    aa, bb, ab = _invariants(g)
    strain = 0.5 * (aa - 1.0)
    by_a = 0.5 * (-bb / (aa * aa) + 2.0 * ab * ab / (aa * aa * aa))
    by_b = 0.5 / aa
    by_c = -ab / (aa * aa)
    for a in range(3):
        effort[a] = axial * strain * g[a] + bending * (2.0 * by_a * g[a] + by_c * g[3 + a])
        effort[3 + a] = bending * (2.0 * by_b * g[3 + a] + by_c * g[a])
    if viscosity > 0.0:
        rate = g[0] * v[0] + g[1] * v[1] + g[2] * v[2]
        for a in range(3):
            effort[a] += viscosity * axial * rate * g[a]


@kernel
def add_force(
    vectors: np.ndarray, scale: np.ndarray, length: np.ndarray, stiffness: np.ndarray, rows: np.ndarray,
    weights: np.ndarray, q: np.ndarray, u: np.ndarray, viscosity: float, force: np.ndarray,
) -> None:  # fmt: skip
    """Add the forces of all cables; `u` matters where the viscosity is not zero."""
    e, rates, element = np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 4))
    g, v, effort = np.empty(6), np.zeros(6), np.empty(6)
    for k in range(vectors.shape[0]):
        gather(vectors[k], scale[k], q, e)
        if viscosity > 0.0:
            gather(vectors[k], scale[k], u, rates)
        element[:] = 0.0
        for point in range(weights.shape[0]):
            _derivatives(e, rows[point], length[k], g)
            if viscosity > 0.0:
                _derivatives(rates, rows[point], length[k], v)
            _effort(g, v, stiffness[k, 0], stiffness[k, 1], viscosity, effort)
            for p in range(2):
                factor = weights[point] if p == 0 else weights[point] / length[k]
                for a in range(3):
                    for i in range(4):
                        element[a, i] += factor * effort[3 * p + a] * rows[point, p, i]
        scatter_force(vectors[k], scale[k], -1.0, element, force)


@kernel(inline=True)
def _hessian(g: np.ndarray, axial: float, bending: float, hessian: np.ndarray) -> None:
    """Second derivatives (6, 6) of the energy per length by r' and r''."""
    aa, bb, ab = _invariants(g)
    strain = 0.5 * (aa - 1.0)
    a2 = aa * aa
    by_a = 0.5 * (-bb / a2 + 2.0 * ab * ab / (a2 * aa))
    by_b = 0.5 / aa
    by_c = -ab / a2
    by_aa = 0.5 * (2.0 * bb / (a2 * aa) - 6.0 * ab * ab / (a2 * a2))
    by_ab = -0.5 / a2
    by_ac = 2.0 * ab / (a2 * aa)
    by_cc = -1.0 / a2
    for a in range(3):
        for b in range(3):
            same = 1.0 if a == b else 0.0
            x, y, s, t = g[a], g[3 + a], g[b], g[3 + b]
            hessian[a, b] = axial * (strain * same + x * s) + bending * (
                2.0 * by_a * same + 4.0 * by_aa * x * s + 2.0 * by_ac * (x * t + y * s) + by_cc * y * t
            )
            hessian[a, 3 + b] = bending * (
                by_c * same + 4.0 * by_ab * x * t + 2.0 * by_ac * x * s + by_cc * y * s
            )
            hessian[3 + b, a] = hessian[a, 3 + b]
            hessian[3 + a, 3 + b] = bending * (2.0 * by_b * same + by_cc * x * s)


@kernel
def add_tangent(
    vectors: np.ndarray, scale: np.ndarray, length: np.ndarray, stiffness: np.ndarray, rows: np.ndarray,
    weights: np.ndarray, q: np.ndarray, u: np.ndarray, moving: float, viscosity: float, slots: np.ndarray, size: int,
    into_stiffness: np.ndarray, into_damping: np.ndarray,
) -> None:  # fmt: skip
    """Add -dh/dq and -dh/du of all cables to the flat block data; `moving` is the viscosity, or 0 at rest."""
    e, rates = np.empty((3, 4)), np.empty((3, 4))
    g, v, work = np.empty(6), np.zeros(6), np.empty(4)
    scaled, hessian, viscous = np.empty((2, 4)), np.empty((6, 6)), np.zeros((6, 6))
    element, damped = np.empty((3, 3, 4, 4)), np.empty((3, 3, 4, 4))
    for k in range(vectors.shape[0]):
        gather(vectors[k], scale[k], q, e)
        if moving > 0.0:
            gather(vectors[k], scale[k], u, rates)
        element[:] = 0.0
        damped[:] = 0.0
        for point in range(weights.shape[0]):
            _derivatives(e, rows[point], length[k], g)
            _hessian(g, stiffness[k, 0], stiffness[k, 1], hessian)
            if moving > 0.0:
                _derivatives(rates, rows[point], length[k], v)
                rate = g[0] * v[0] + g[1] * v[1] + g[2] * v[2]
                for a in range(3):
                    hessian[a, a] += moving * stiffness[k, 0] * rate
                    for b in range(3):
                        hessian[a, b] += moving * stiffness[k, 0] * g[a] * v[b]
            for i in range(4):
                scaled[0, i] = rows[point, 0, i] / length[k]
                scaled[1, i] = rows[point, 1, i] / (length[k] * length[k])
            factor = weights[point] * length[k]
            hessian *= factor
            add_point(scaled, hessian, 2, 4, work, element)
            if viscosity > 0.0:
                for a in range(3):
                    for b in range(3):
                        viscous[a, b] = factor * viscosity * stiffness[k, 0] * g[a] * g[b]
                add_point(scaled, viscous, 2, 4, work, damped)
        scatter_matrix(slots[k], scale[k], size, element, into_stiffness)
        if viscosity > 0.0:
            scatter_matrix(slots[k], scale[k], size, damped, into_damping)
