"""Natural vibrations about an equilibrium: K phi = omega^2 M phi by shift-invert Lanczos, or by a dense solver where
this takes as little time.

Lanczos may miss modes of equal frequency, since one start vector contains only one of them. Sylvester's law of inertia
detects this: the number of negative pivots of K - sigma M is the number of modes below sigma. If modes are missing,
more modes are computed; if modes are still missing, the dense solver is used.

Modes with locked springs start from those with their stiffness. Inverse iterations then solve for x with the springs closed,
as in statics: (K - sigma M) x = M y - G^T lambda, lambda <- lambda + k G x with the gradients G and the stiffness k of the
locked springs (augmented Lagrangian; Bayo and Ledesma 1996). No mode belongs to the springs alone.
"""

from __future__ import annotations

import inspect
import math
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from fsm.errors import NotConverged
from fsm.kernels.blocks import BlockMatrix
from fsm.solve.equations.linear import LinearSolver, first_of_largest
from fsm.solve.interface.records import LockedSprings
from fsm.solve.interface.system import System

_DENSE_SIZE = 60
"""Largest number of unknowns for the dense solver."""
_DENSE_PART = 0.25
"""Part of all modes above which the dense solver is used."""
_BELOW_ZERO = 1e-9
"""Distance of the shift below zero, relative to the highest omega^2: above round-off, and below bending modes. A shift
nearer to zero lets rigid-body modes dominate the Lanczos vectors."""
_POLISHED = 3
"""Inverse iterations after Lanczos. The Lanczos vectors contain the errors of all solutions, and these errors are
largest with rigid-body modes.

On beams one iteration reduces residuals from several hundred times `resolution` to less than `resolution`; free bodies
need three iterations.
"""
_RESTARTS = 50
"""Largest number of restarts of Lanczos' method: ten are usually sufficient, but 4000 were not for slack films."""
_REPEATED = 1e-8
"""Smallest singular value of the openings of locked directions, relative to the largest, that does not follow from
others."""
_CLOSURES, _CLOSED, _ROUND_OFF, _CLOSES = 100, 1e-22, 1e-12, 0.7
"""Largest number of solutions that close locked springs; ratio of the energy of their deformation to the work at which they
are closed, and below which it may be round-off; and largest ratio of successive energies of springs that close."""
_INDEPENDENT = 1e-7
"""Smallest singular value of solutions with closed springs, relative to the largest, that belongs to a mode."""
_APART = 1e-6
"""Relative difference below which two frequencies may be equal."""
_SEED: dict[str, Any] = {"rng": 0} if "rng" in inspect.signature(eigsh).parameters else {}
"""Fixed start vector for reproducible results: ARPACK versions draw random ones differently."""


@dataclass(frozen=True)
class Modes:
    """Natural modes in the order of omega^2, M-orthonormal.

    Attributes
    ----------
    squared : (count,) array, rad^2/s^2
        omega^2: negative where the equilibrium is unstable.
    shapes : (count, nu) array
        Increments dx of the tangent space, phi^T M phi = 1; the largest entry (by its kinetic energy) is positive.
    residuals : (count,) array, rad^2/s^2
        |K phi - omega^2 M phi| in the norm of M^-1: bound of the distance from `squared` to an eigenvalue.
    resolution : rad^2/s^2
        Round-off of omega^2. A value below about 30 times this round-off counts as zero: a rigid-body motion or a
        mechanism.
    asymmetry : -
        Size of the unsymmetric part of K, which is neglected, relative to the symmetric part, both scaled to a unit
        diagonal. Above about 1e-8 the state is not an equilibrium, or loads follow the bodies; the modes are then
        the modes of the symmetric part, without flutter.
    method : "dense" or "lanczos"
    """

    squared: np.ndarray
    shapes: np.ndarray
    residuals: np.ndarray
    resolution: float
    asymmetry: float
    method: str

    @property
    def frequencies(self) -> np.ndarray:
        """sqrt(|omega^2|)/(2 pi), (count,), Hz; negative where omega^2 is: growth at the rate 2 pi |f| (1/s)."""
        return np.copysign(np.sqrt(np.abs(self.squared)), self.squared) / (2 * math.pi)

    @property
    def unstable(self) -> np.ndarray:
        """Whether omega^2 is negative by more than round-off, (count,)."""
        return self.squared < -100.0 * self.resolution


def modes(system: System, t: float, q: np.ndarray, count: int = 10, shift: float | None = None) -> Modes:
    """Natural modes of small vibrations about an equilibrium, undamped.

    Parameters
    ----------
    system : System
    t : s
        Time at which loads and drives are evaluated.
    q : (nq,) array
        Equilibrium there; see `fsm.solve.equations.newton.equilibrium`.
    count : number of modes; at most nu are returned
    shift : rad^2/s^2
        Selects the modes with omega^2 nearest to this value; absent: the modes with the lowest omega^2, negative values
        first.

    Raises
    ------
    ValueError
        Count is not positive.
    """
    if count < 1:
        raise ValueError(f"count of modes must be 1 or more; it is {count}")
    if system.nu == 0:
        nothing = np.zeros(0)
        return Modes(nothing, np.zeros((0, 0)), nothing, 0.0, 0.0, "dense")
    problem = _Problem(system, t, q)
    count = min(count, problem.size - problem.locked)
    found = None
    if not problem.locked and problem.size > _DENSE_SIZE and count <= _DENSE_PART * problem.size:
        with suppress(NotConverged):  # the shift equals an eigenvalue to the last digit
            found = _lanczos(problem, count, shift)
    method = "dense" if found is None else "lanczos"
    squared, shapes = _dense(problem, count, shift) if found is None else found
    springs = None if problem.locked else system.locked_springs(t, q)
    closed = None if springs is None else _with_closed_springs(problem, springs, squared, shapes)
    if closed is not None:
        squared, shapes, residuals = closed
        return Modes(squared, _signed(problem, shapes), residuals, problem.resolution, problem.asymmetry, method)
    shapes = _signed(problem, shapes)
    return Modes(squared, shapes, problem.residuals(squared, shapes), problem.resolution, problem.asymmetry, method)


class _Problem:
    """K (its symmetric part) and M on one pattern.

    Attributes
    ----------
    size : nu
    highest : rad^2/s^2
        Estimate of the largest omega^2.
    resolution, asymmetry : see `Modes`
    rows : (n, nu) array
        Gradients of the openings of locked directions, which the modes leave closed; `locked` of them are independent.
    """

    def __init__(self, system: System, t: float, q: np.ndarray) -> None:
        self.rows = system.locked_rows(t, q)
        stiffness = system.linearise(t, q, None).stiffness
        self.pattern = stiffness.pattern
        self.stiffness = stiffness.symmetric()
        self.inertia = BlockMatrix(self.pattern, system.inertia(q, self.pattern))
        self.size = stiffness.order
        self.mass_diagonal = _diagonal(self.inertia)
        self.highest = float((np.abs(_diagonal(self.stiffness)) / self.mass_diagonal).max(initial=0.0))
        self.resolution = float(np.finfo(float).eps) * self.highest
        self.asymmetry = self._asymmetry(stiffness)
        self.free = self._free()
        self.locked = self.size - self.free.shape[1] if len(self.rows) else 0
        if self.locked:  # without the penalties
            alone = np.einsum("ij,ij->j", self.free, self.stiffness.bsr() @ self.free)
            self.highest = float(np.abs(alone).max(initial=0.0))
            self.resolution = float(np.finfo(float).eps) * self.highest

    def _free(self) -> np.ndarray:
        """M-orthonormal basis (nu, n) of the motions that locked directions allow; empty without any."""
        if not len(self.rows):
            return np.zeros((self.size, 0))
        root = np.linalg.cholesky(self.inertia.bsr().toarray())
        rows = np.linalg.solve(root, self.rows.T).T
        sizes = np.linalg.norm(rows, axis=1)
        _, values, turned = np.linalg.svd(rows[sizes > 0.0] / sizes[sizes > 0.0, None])
        rank = int(np.sum(values > _REPEATED * values[:1].max(initial=0.0)))
        return np.asarray(np.linalg.solve(root.T, turned[rank:].T))

    def _asymmetry(self, stiffness: BlockMatrix) -> float:
        # lower bound for unknowns without diagonal stiffness
        size = np.sqrt(np.abs(_diagonal(self.stiffness)) + 1e-12 * self.highest * self.mass_diagonal)
        size = size.reshape(-1, self.pattern.size)
        if not self.highest > 0.0:
            return 0.0
        scale = 1.0 / (size[self.pattern.rows][:, :, None] * size[self.pattern.indices][:, None, :])
        rest = np.linalg.norm(scale * (stiffness.data - self.stiffness.data))
        return float(rest / np.linalg.norm(scale * self.stiffness.data))

    def factorise(self, shift: float) -> LinearSolver:
        """Factors of K - shift M."""
        solver = LinearSolver()
        solver.factorise(self.stiffness.with_data(self.stiffness.data - shift * self.inertia.data))
        return solver

    def below(self, shift: float) -> int:
        """Modes with omega^2 below the shift.

        If a shift is so near to a mode that block pivots lose their signs, it counts as above the mode; its factors are
        inaccurate anyway.
        """
        return self.factorise(shift).negative_pivots(recount=False)

    def residuals(self, squared: np.ndarray, shapes: np.ndarray) -> np.ndarray:
        """See `Modes`."""
        solver = LinearSolver()
        solver.factorise(self.inertia)
        rest = self.stiffness.bsr() @ shapes.T - self.inertia.bsr() @ shapes.T * squared
        if self.locked:
            return np.asarray(np.linalg.norm(self.free.T @ rest, axis=0))
        return np.sqrt(np.sum(rest * _solve_all(solver, rest), axis=0))


def _diagonal(matrix: BlockMatrix) -> np.ndarray:
    return matrix.data[matrix.pattern.diagonal].diagonal(axis1=1, axis2=2).ravel()


def _signed(problem: _Problem, shapes: np.ndarray) -> np.ndarray:
    """Shapes with the first of their largest entries positive."""
    largest = first_of_largest(np.abs(shapes) * np.sqrt(problem.mass_diagonal))
    return shapes * np.sign(shapes[np.arange(len(shapes)), largest])[:, None]


def _dense(problem: _Problem, count: int, shift: float | None) -> tuple[np.ndarray, np.ndarray]:
    stiffness, inertia = problem.stiffness.bsr().toarray(), problem.inertia.bsr().toarray()
    if problem.locked:
        squared, shapes = eigh(problem.free.T @ stiffness @ problem.free)
        chosen = np.arange(count)
        if shift is not None:
            chosen = np.sort(np.argsort(np.abs(squared - shift), kind="stable")[:count])
        return squared[chosen], np.ascontiguousarray((problem.free @ shapes[:, chosen]).T)
    if shift is None:
        squared, shapes = eigh(stiffness, inertia, subset_by_index=(0, count - 1))
        return squared, np.ascontiguousarray(shapes.T)
    squared, shapes = eigh(stiffness, inertia)
    chosen = np.sort(np.argsort(np.abs(squared - shift), kind="stable")[:count])
    return squared[chosen], np.ascontiguousarray(shapes.T[chosen])


def _lanczos(problem: _Problem, count: int, shift: float | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Modes by shift-invert Lanczos; None if some are missing."""
    start = _below_all(problem) if shift is None else shift
    if start is None:
        return None
    asked = count + 4
    while asked <= 2 * _DENSE_PART * problem.size:
        squared, shapes = _near(problem, start, asked)
        if len(squared) >= count and _complete(problem, squared, start, count):
            nearest = np.sort(np.argsort(np.abs(squared - start), kind="stable")[:count])
            return squared[nearest], shapes[nearest]
        asked *= 2
    return None


def _below_all(problem: _Problem) -> float | None:
    """Shift below all modes, as close to zero as possible; None if no such shift is found."""
    shift = -_BELOW_ZERO * problem.highest
    while shift > -1e3 * problem.highest:
        if problem.below(shift) == 0:
            return shift
        shift *= 4.0
    return None


def _near(problem: _Problem, shift: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Modes that Lanczos finds nearest to a shift, in the order of omega^2."""
    size = problem.size
    solver = problem.factorise(shift)
    inverse = LinearOperator((size, size), matvec=lambda x: solver.solve(np.ascontiguousarray(x).ravel()), dtype=float)
    first = np.random.default_rng(0).standard_normal(size)
    try:
        _, shapes = eigsh(
            problem.stiffness.bsr(), count, M=problem.inertia.bsr(), sigma=shift, OPinv=inverse, v0=first,
            ncv=min(size, max(2 * count + 1, 20)), maxiter=_RESTARTS, **_SEED,
        )  # fmt: skip
    except ArpackError:  # if Lanczos does not converge, it returns fewer modes, which are not used
        return np.zeros(0), np.zeros((0, size))
    for _ in range(_POLISHED):
        squared, shapes = _polished(problem, shift, solver, shapes)
    return squared, np.ascontiguousarray(shapes.T)


def _polished(problem: _Problem, shift: float, solver: LinearSolver, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One inverse iteration with refined solutions, and the Rayleigh-Ritz values of the result.

    Shapes are (nu, count) arrays here.
    """
    stiffness, inertia = problem.stiffness.bsr(), problem.inertia.bsr()
    right = inertia @ shapes
    better = _solve_all(solver, right)
    better += _solve_all(solver, right - (stiffness @ better - shift * (inertia @ better)))
    better /= np.linalg.norm(better * np.sqrt(problem.mass_diagonal)[:, None], axis=0)
    projected = [better.T @ (matrix @ better) for matrix in (stiffness, inertia)]
    squared, turn = eigh(*(0.5 * (matrix + matrix.T) for matrix in projected))
    return squared, better @ turn


def _with_closed_springs(
    problem: _Problem, springs: LockedSprings, squared: np.ndarray, shapes: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Modes (squared, shapes, residuals) in which locked springs do not deform, from those in which they do; None if the
    springs do not close. Fewer modes are returned if some were motions of the springs alone.
    """
    stiffness, inertia = springs.others.symmetric().bsr(), problem.inertia.bsr()
    kept = np.ascontiguousarray(shapes.T)
    elastic = np.abs(squared[np.abs(squared) > 100.0 * problem.resolution])  # without rigid motions
    shift = min(float(squared.min()), 0.0) - 0.3 * (float(elastic.min()) if len(elastic) else 1e3 * problem.resolution)
    solver = problem.factorise(shift)
    for _ in range(_POLISHED):
        better = _closed(solver, springs, inertia @ kept)
        if better is None:
            return None
        _, sizes, turn = np.linalg.svd(np.sqrt(problem.mass_diagonal)[:, None] * better, full_matrices=False)
        count = int(np.sum(sizes > _INDEPENDENT * sizes[0]))
        basis = turn[:count].T / sizes[:count]  # motions of the springs alone have vanished
        kept, better = kept @ basis, better @ basis
        projected = [better.T @ (matrix @ better) for matrix in (stiffness, inertia)]
        squared, turn = eigh(*(0.5 * (matrix + matrix.T) for matrix in projected))
        rest = kept @ turn + (better @ turn) * (shift - squared)  # M^-1 (K phi - omega^2 M phi + forces of the springs)
        kept = better @ turn
    return squared, np.ascontiguousarray(kept.T), np.sqrt(np.sum(rest * (inertia @ rest), axis=0))


def _closed(solver: LinearSolver, springs: LockedSprings, right: np.ndarray) -> np.ndarray | None:
    """Solutions (nu, count) with closed springs; None if the springs do not close."""
    rows, weights = springs.rows, springs.stiffness[:, None]
    efforts, found = np.zeros((rows.shape[0], right.shape[1])), _solve_all(solver, right)
    opening = rows @ found
    work, before = np.sum(found * right, axis=0), np.sum(weights * opening**2, axis=0)
    for _ in range(_CLOSURES):
        efforts += weights * opening
        found = _solve_all(solver, right - rows.T @ efforts)
        opening = rows @ found
        after = np.sum(weights * opening**2, axis=0)
        slow = after > _CLOSES * before
        if np.any(slow & (after > _ROUND_OFF * work)):
            return None
        if np.all(slow | (after <= _CLOSED * work)):
            return found
        before = after
    return None


def _solve_all(solver: LinearSolver, right: np.ndarray) -> np.ndarray:
    """Solutions for all columns of the right-hand side."""
    return np.column_stack([solver.solve(column) for column in np.ascontiguousarray(right.T)])


def _complete(problem: _Problem, squared: np.ndarray, shift: float, count: int) -> bool:
    """Whether no mode is missing between the shift and the last requested mode (except at equal distances)."""
    distance = np.abs(squared - shift)
    reach = np.sort(distance)[count - 1]
    reach -= _APART * reach + 100.0 * problem.resolution
    if reach <= 0.0:
        return True
    return problem.below(shift + reach) - problem.below(shift - reach) == int(np.sum(distance < reach))
