"""SciPy's Radau with the linear algebra of a mechanical system: half the unknowns, dense blocks, identical steps.

Radau uses the Jacobian only to solve (gamma I - J)(a, b) = (f, g), once for a real and once for a complex gamma. Hairer and
Wanner, Solving ODEs II, section IV.8, eq. (8.19), give the same reduction for y'' = f. Here, with q' = T(q) u and M u' = h,

    gamma a - Q a - T b = f,        g = gamma b + M^-1 (K P a + D b),        Q = dq'/dq,  P = dx/dq,

with a small block of Q, T and P for each node. Therefore a = R (f + T b) with R = (gamma I - Q)^-1. With the increment
x = P a in the tangent space as unknown

    [(gamma M + D) G + K] x = M g + (gamma M + D) G c,      c = P R f,   G = (P R T)^-1,   b = G (x - c),

where the matrix has the pattern of K. In planar motion the configurations are a vector space. Then G = gamma I, and the
equation becomes (gamma^2 M + gamma D + K) a = M g + (gamma M + D) f, with b = gamma a - f. M is constant.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.integrate import Radau

from fsm.kernels.block_lu import multiply_blocks
from fsm.kernels.blocks import BlockMatrix, BlockPattern
from fsm.kernels.jit import kernel
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.interface.system import System


@dataclass(frozen=True, eq=False)
class _Kinematics:
    """Blocks of Q (n, c, c), T (n, c, d) and P (n, d, c): c components of q and d of u a node."""

    by_q: np.ndarray
    by_u: np.ndarray
    increment: np.ndarray


@dataclass(frozen=True, eq=False)
class _Few:
    """Nonzero blocks of a pattern, which also contains all possible contacts.

    Attributes
    ----------
    place : (m,) int array
        Numbers of the blocks in the pattern.
    indptr, indices : int arrays
        Compressed rows of the nonzero blocks.
    """

    place: np.ndarray
    indptr: np.ndarray
    indices: np.ndarray

    @classmethod
    def of(cls, pattern: BlockPattern, used: np.ndarray) -> _Few:
        """Select the blocks by a mask (n_blocks,)."""
        place = np.flatnonzero(used)
        indptr = np.searchsorted(pattern.rows[place], np.arange(pattern.order + 1))
        return cls(place, indptr, pattern.indices[place])

    def multiply(self, data: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Product (n d,) of the matrix of these blocks, data (m, d, d), with x."""
        return np.asarray(multiply_blocks(self.indptr, self.indices, data, x))


@dataclass(frozen=True, eq=False)
class SecondOrderJacobian:
    """dy'/dy of y = (q, u), stored as separate parts without forming their products.

    Attributes
    ----------
    stiffness : BlockMatrix
        K.
    heavy, damped : places of the blocks of M, and of the blocks of M or D
    inertia : array
        Blocks of M at the places `heavy`.
    inertia_damped, damping : arrays
        Blocks of M and of D at the places `damped`.
    kinematics : blocks of q' = T u, or None for q' = u
    """

    stiffness: BlockMatrix
    heavy: _Few
    damped: _Few
    inertia: np.ndarray
    inertia_damped: np.ndarray
    damping: np.ndarray
    kinematics: _Kinematics | None


def second_order_jacobian(system: System, t: float, y: np.ndarray) -> SecondOrderJacobian:
    """The Jacobian of y' = (T u, M^-1 h) at a state, in its parts.

    Parameters
    ----------
    system : System
    t : s
    y : (nq + nu,) array
    """
    q, u = y[: system.nq], y[system.nq :]
    linear = system.linearise(t, q, u)
    pattern, damping = linear.stiffness.pattern, linear.damping.data
    inertia = system.inertia(q, pattern)
    has_inertia, has_damping = np.any(inertia, axis=(1, 2)), np.any(damping, axis=(1, 2))
    heavy, damped = _Few.of(pattern, has_inertia), _Few.of(pattern, has_inertia | has_damping)
    return SecondOrderJacobian(
        linear.stiffness, heavy, damped,
        inertia[heavy.place], inertia[damped.place], damping[damped.place],
        _kinematics(system, q, u, pattern.order),
    )  # fmt: skip


def _kinematics(system: System, q: np.ndarray, u: np.ndarray, count: int) -> _Kinematics | None:
    if system.increment_map(np.zeros(system.nu)) is None:
        return None
    by_q, by_u = system.kinematic_jacobian(q, u)
    return _Kinematics(
        _diagonal_blocks(by_q, count), _diagonal_blocks(by_u, count), _diagonal_blocks(system.tangent_map(q), count)
    )


def _diagonal_blocks(matrix: sparse.csr_matrix, count: int) -> np.ndarray:
    """Blocks (count, rows, columns) of a block diagonal matrix."""
    if count == 0:
        return np.zeros((0, 1, 1))
    rows, columns = matrix.shape[0] // count, matrix.shape[1] // count
    found = matrix.tobsr((rows, columns))
    node = np.repeat(np.arange(count), np.diff(found.indptr))
    if np.any(node != found.indices):
        raise ValueError(
            "the kinematics of one node depend on another node, which Radau-blocks does not support; "
            'use method = "Radau"'
        )
    blocks = np.zeros((count, rows, columns))
    blocks[node] = found.data
    return blocks


class _Multiple:
    """gamma times the identity, for `MU / h * I - J` in SciPy's source."""

    __array_ufunc__ = None  # with this attribute, a NumPy scalar calls __rmul__ of this class

    def __init__(self, gamma: complex) -> None:
        self.gamma = gamma

    def __rmul__(self, factor: complex) -> _Multiple:
        return _Multiple(factor * self.gamma)

    def __sub__(self, jacobian: SecondOrderJacobian) -> _Shifted:
        return _Shifted(self.gamma, jacobian)


@dataclass(frozen=True, eq=False)
class _Shifted:
    """gamma I - J."""

    gamma: complex
    jacobian: SecondOrderJacobian


class _Reduced:
    """A factorised gamma I - J; see the module docstring for the symbols.

    Parameters
    ----------
    shifted : _Shifted
    solver : LinearSolver
        Solver whose factorisation is valid until the next object factorises.
    """

    def __init__(self, shifted: _Shifted, solver: LinearSolver) -> None:
        jacobian, gamma = shifted.jacobian, shifted.gamma
        self.gamma, self.jacobian, self.solver = gamma, jacobian, solver
        self.size = jacobian.stiffness.order
        self.damped = gamma * jacobian.inertia_damped + jacobian.damping
        kinematics = jacobian.kinematics
        if kinematics is None:
            product = gamma * self.damped
        else:
            self.resolvent, self.by_velocity, self.rate = _eliminate(
                gamma, kinematics.by_q, kinematics.by_u, kinematics.increment
            )
            product = _multiply_pairs(self.damped, self.rate, jacobian.damped.indices)
        data = jacobian.stiffness.data.astype(product.dtype)
        data[jacobian.damped.place] += product
        solver.factorise(jacobian.stiffness.with_data(data))

    def solve(self, right: np.ndarray) -> np.ndarray:
        """(a, b) for (f, g)."""
        f, g = right[: len(right) - self.size], right[len(right) - self.size :]
        kinematics = self.jacobian.kinematics
        if kinematics is None:
            x = self._increment(f, g)
            return np.concatenate([x, self.gamma * x - f])
        a = _apply(self.resolvent, f)
        c = _apply(kinematics.increment, a)
        b = _apply(self.rate, self._increment(_apply(self.rate, c), g) - c)
        return np.concatenate([a + _apply(self.by_velocity, b), b])

    def _increment(self, velocity: np.ndarray, g: np.ndarray) -> np.ndarray:
        """The increment x from M g + (gamma M + D) velocity, where velocity = G c."""
        jacobian = self.jacobian
        right = jacobian.heavy.multiply(jacobian.inertia, g) + jacobian.damped.multiply(self.damped, velocity)
        return self.solver.solve(right)


@kernel
def _apply(blocks: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Blocks (n, i, j) of a block diagonal matrix times a vector (n j,)."""
    count, rows, columns = blocks.shape
    out = np.zeros(count * rows, dtype=vector.dtype)
    for n in range(count):
        for i in range(rows):
            for j in range(columns):
                out[n * rows + i] += blocks[n, i, j] * vector[n * columns + j]
    return out


@kernel
def _multiply_pairs(left: np.ndarray, right: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Products left[k] right[chosen[k]] of square blocks."""
    size = left.shape[1]
    out = np.zeros_like(left)
    for k in range(left.shape[0]):
        other = right[chosen[k]]
        for i in range(size):
            for j in range(size):
                factor = left[k, i, j]
                if factor != 0.0:
                    for m in range(size):
                        out[k, i, m] += factor * other[j, m]
    return out


@kernel
def _solve_small(matrix: np.ndarray, right: np.ndarray) -> None:
    """Gauss-Jordan with row exchanges: `right` becomes matrix^-1 right; `matrix` is overwritten."""
    size, columns = matrix.shape[0], right.shape[1]
    for k in range(size):
        row = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[row, k]):
                row = i
        if row != k:
            for j in range(size):
                matrix[k, j], matrix[row, j] = matrix[row, j], matrix[k, j]
            for j in range(columns):
                right[k, j], right[row, j] = right[row, j], right[k, j]
        scale = 1.0 / matrix[k, k]
        for j in range(k, size):
            matrix[k, j] *= scale
        for j in range(columns):
            right[k, j] *= scale
        for i in range(size):
            factor = matrix[i, k]
            if i != k and factor != 0.0:
                for j in range(k, size):
                    matrix[i, j] -= factor * matrix[k, j]
                for j in range(columns):
                    right[i, j] -= factor * right[k, j]


@kernel
def _eliminate(
    gamma: complex, by_q: np.ndarray, by_u: np.ndarray, increment: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """R = (gamma I - Q)^-1, R T and G = (P R T)^-1 of every node, from gamma and the blocks of Q, T and P."""
    count, size, rates = by_u.shape
    zero = 0.0 * gamma
    resolvent = np.full((count, size, size), zero)
    by_velocity = np.full((count, size, rates), zero)
    rate = np.full((count, rates, rates), zero)
    shifted, product = np.full((size, size), zero), np.full((rates, rates), zero)
    for n in range(count):
        for i in range(size):
            for j in range(size):
                shifted[i, j] = -by_q[n, i, j]
            shifted[i, i] += gamma
            resolvent[n, i, i] += 1.0
        _solve_small(shifted, resolvent[n])
        for i in range(size):
            for k in range(size):
                factor = resolvent[n, i, k]
                for j in range(rates):
                    by_velocity[n, i, j] += factor * by_u[n, k, j]
        for i in range(rates):
            for j in range(rates):
                product[i, j] = zero
                for k in range(size):
                    product[i, j] += increment[n, i, k] * by_velocity[n, k, j]
            rate[n, i, i] += 1.0
        _solve_small(product, rate[n])
    return resolvent, by_velocity, rate


class StructuredRadau(Radau):
    """SciPy's `Radau` for y = (q, u) of a System: `solve_ivp(fun, span, y0, method=StructuredRadau, system=system)`.

    SciPy computes steps, error estimate and dense output, and counts `nfev`, `njev` and `nlu`.

    Parameters
    ----------
    fun, t0, y0, t_bound, max_step, rtol, atol, vectorized, first_step : see `scipy.integrate.Radau`
        `fun(t, y)` is (T u, M^-1 h) of the system.
    system : System
    jac : callable, jac(t, y) -> SecondOrderJacobian
        Absent: Jacobian of the system.
    """

    def __init__(
        self,
        fun: Callable[[float, np.ndarray], np.ndarray],
        t0: float,
        y0: np.ndarray,
        t_bound: float,
        *,
        system: System,
        jac: Callable[[float, np.ndarray], SecondOrderJacobian] | None = None,
        **options: Any,
    ) -> None:
        size = len(y0)
        # with a constant sparse Jacobian SciPy does not compute one; it is replaced before the first step
        super().__init__(fun, t0, y0, t_bound, jac=sparse.csc_matrix((size, size)), **options)
        self._evaluate = jac or (lambda t, y: second_order_jacobian(system, t, y))
        self._real, self._complex = LinearSolver(), LinearSolver()
        self.I = _Multiple(1.0)
        self.lu, self.solve_lu = self._factorise, _Reduced.solve
        self.jac = self._counted
        self.J = self._counted(self.t, self.y)

    def _counted(self, t: float, y: np.ndarray, _: np.ndarray | None = None) -> SecondOrderJacobian:
        self.njev += 1
        return self._evaluate(t, y)

    def _factorise(self, shifted: _Shifted) -> _Reduced:
        self.nlu += 1
        # there are two solvers, because Radau uses a real and a complex factorisation
        return _Reduced(shifted, self._complex if isinstance(shifted.gamma, complex) else self._real)
