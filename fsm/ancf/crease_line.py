"""Creases of a film: lines along which its slope jumps, with a torsional spring.

The slopes a = r_X before the line and b = r_X behind it are separate. The tangent c = r_Y of the line is common. The
rotation psi about c from a to b is the argument of

    z = p + i s,    p = (c.c)(a.b) - (a.c)(b.c),    s = |c| b.(a x c),

which is invariant to rigid motions and to stretch. The moment is k (psi - psi_free) + tau k psi', positive upwards: from x
towards z for a line along y. Each node has a share of k in proportion to its share of the width. Derivatives of psi follow
from log z: grad psi = Im(grad z/z), and the second derivatives are Im(grad grad z/z - grad z grad z^T/z^2).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.ancf.group import MassPart

__all__ = ["CreaseLineGroup"]

_LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_i, _j, _k], _LEVI_CIVITA[_i, _k, _j] = 1.0, -1.0


@dataclass(frozen=True, eq=False)
class CreaseLineGroup:
    """Nodes of crease lines; see the module docstring.

    Attributes
    ----------
    vectors : (m, 3) int array
        First coordinates of a, b and c.
    stiffness : (m,) array, N m/rad
        Stiffness of each node's share of the line.
    free_turn : (m,) array, rad
        Rotation at zero moment.
    near : (m,) array, rad
        Rotations are taken within half a turn of this value.
    viscosity : s
        Kelvin-Voigt time tau.
    """

    vectors: np.ndarray
    stiffness: np.ndarray
    free_turn: np.ndarray
    near: np.ndarray
    viscosity: float = 0.0
    name: str = "creases"

    @property
    def rate_dependent(self) -> bool:
        """See `ElementGroup`."""
        return self.viscosity > 0.0

    def mass(self) -> MassPart:
        """See `ElementGroup`: none."""
        return MassPart(np.zeros((0, 3), dtype=np.int64), np.zeros((0, 3, 3)), np.eye(3))

    def turns(self, q: np.ndarray) -> np.ndarray:
        """Rotation at every node, (m,), rad."""
        return self._turn(_measure(self._slopes(q), derivatives=0)[0])

    def add_force(self, q: np.ndarray, u: np.ndarray | None, force: np.ndarray) -> None:
        """See `ElementGroup`."""
        z, first, _ = _measure(self._slopes(q), derivatives=1)
        gradient = (first / z[:, None]).imag
        np.subtract.at(force, self._places, self._moment(z, u, gradient)[:, None] * gradient)

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
        z, first, second = _measure(self._slopes(q), derivatives=2)
        ratio = first / z[:, None]
        gradient = ratio.imag
        hessian = (second / z[:, None, None] - ratio[:, :, None] * ratio[:, None, :]).imag
        moment = self._moment(z, u, gradient)
        np.subtract.at(force, self._places, moment[:, None] * gradient)
        product = gradient[:, :, None] * gradient[:, None, :]
        block = self.stiffness[:, None, None] * product + moment[:, None, None] * hessian
        if u is not None and self.viscosity:
            turned = np.einsum("mij,mj->mi", hessian, u[self._places])
            block += (self.viscosity * self.stiffness)[:, None, None] * gradient[:, :, None] * turned[:, None, :]
        self._scatter(block, slots, stiffness)
        if self.viscosity:
            self._scatter((self.viscosity * self.stiffness)[:, None, None] * product, slots, damping)

    def energy(self, q: np.ndarray, u: np.ndarray | None) -> tuple[float, float]:
        """See `ElementGroup`."""
        moving = u is not None and self.viscosity
        z, first, _ = _measure(self._slopes(q), derivatives=1 if moving else 0)
        stored = 0.5 * float(self.stiffness @ (self._turn(z) - self.free_turn) ** 2)
        if u is None or not moving:
            return stored, 0.0
        rate = np.einsum("mi,mi->m", (first / z[:, None]).imag, u[self._places])
        return stored, self.viscosity * float(self.stiffness @ rate**2)

    # inside -----------------------------------------------------------------------------------------------------------

    @cached_property
    def _places(self) -> np.ndarray:
        """Indices of the coordinates of a, b, c, (m, 9)."""
        return (self.vectors[:, :, None] + np.arange(3)).reshape(len(self.vectors), 9)

    def _slopes(self, q: np.ndarray) -> np.ndarray:
        return np.asarray(q[self._places].reshape(-1, 3, 3))

    def _turn(self, z: np.ndarray) -> np.ndarray:
        """Rotation at every node, (m,), rad, from its z."""
        return np.asarray(self.near + np.angle(z * self._turned_back))

    @cached_property
    def _turned_back(self) -> np.ndarray:
        return np.asarray(np.exp(-1j * self.near))

    def _moment(self, z: np.ndarray, u: np.ndarray | None, gradient: np.ndarray) -> np.ndarray:
        """Moment of every node against its rotation, (m,), N m."""
        turn = self._turn(z) - self.free_turn
        if u is not None and self.viscosity:
            turn = turn + self.viscosity * np.einsum("mi,mi->m", gradient, u[self._places])
        return np.asarray(self.stiffness * turn)

    @staticmethod
    def _scatter(blocks: np.ndarray, slots: np.ndarray, data: np.ndarray) -> None:
        """Add blocks (m, 9, 9) to block data."""
        count, size = len(slots), data.shape[1]
        parts = blocks.reshape(count, 3, 3, 3, 3)  # vector, component, vector, component
        inner = size * np.arange(3)[:, None] + np.arange(3)
        places = slots[:, :, None, :, None] + inner[None, None, :, None, :]
        np.add.at(data.reshape(-1), places.ravel(), parts.ravel())


def _cross(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Vector products of rows; several times faster than `np.cross` for a few rows."""
    return x[:, [1, 2, 0]] * y[:, [2, 0, 1]] - x[:, [2, 0, 1]] * y[:, [1, 2, 0]]


def _measure(slopes: np.ndarray, derivatives: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """z (m,) of slopes a, b, c (m, 3, 3), with gradient (m, 9) and second derivatives (m, 9, 9) on request."""
    a, b, c = slopes[:, 0], slopes[:, 1], slopes[:, 2]
    count, unit = len(a), np.eye(3)
    cc, ab, ac, bc = (np.einsum("mi,mi->m", x, y) for x, y in ((c, c), (a, b), (a, c), (b, c)))
    size = np.sqrt(cc)
    by_b = _cross(a, c)
    triple = np.einsum("mi,mi->m", b, by_b)
    z = cc * ab - ac * bc + 1j * size * triple
    first = np.zeros((count, 9) if derivatives else (0, 9), dtype=complex)
    second = np.zeros((count, 9, 9) if derivatives > 1 else (0, 9, 9), dtype=complex)
    if not derivatives:
        return z, first, second
    by_a, by_c = _cross(c, b), _cross(b, a)
    scale = size[:, None]
    along = c / scale  # gradient of |c|
    first[:, 0:3] = cc[:, None] * b - bc[:, None] * c + 1j * scale * by_a
    first[:, 3:6] = cc[:, None] * a - ac[:, None] * c + 1j * scale * by_b
    first[:, 6:9] = 2 * ab[:, None] * c - bc[:, None] * a - ac[:, None] * b + 1j * (
        scale * by_c + triple[:, None] * along
    )
    if derivatives == 1:
        return z, first, second
    block = second.reshape(count, 3, 3, 3, 3)  # vector, component, vector, component; filled above the diagonal

    def outer(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return x[:, :, None] * y[:, None, :]

    def skew(x: np.ndarray) -> np.ndarray:
        """Matrix e with e_ij = epsilon_ijk x_k."""
        return np.asarray(np.einsum("ijk,mk->mij", _LEVI_CIVITA, x))

    wide = size[:, None, None]
    # triple = b.(a x c): its second derivatives are d2/da db = skew(-c), d2/da dc = skew(b), d2/db dc = skew(-a) transposed
    block[:, 0, :, 1] = cc[:, None, None] * unit - outer(c, c) + 1j * wide * skew(-c)
    block[:, 0, :, 2] = 2 * outer(b, c) - outer(c, b) - bc[:, None, None] * unit + 1j * (
        wide * skew(b) + outer(by_a, along)
    )
    block[:, 1, :, 2] = 2 * outer(a, c) - outer(c, a) - ac[:, None, None] * unit + 1j * (
        wide * skew(-a) + outer(by_b, along)
    )
    bend = (unit - outer(along, along)) / wide
    block[:, 2, :, 2] = 2 * ab[:, None, None] * unit - outer(a, b) - outer(b, a) + 1j * (
        triple[:, None, None] * bend + outer(by_c, along) + outer(along, by_c)
    )
    for row, column in ((0, 1), (0, 2), (1, 2)):
        block[:, column, :, row] = np.swapaxes(block[:, row, :, column], 1, 2)
    return z, first, second
