"""Stable equilibrium by going down the energy: Newton's method made heavy where it would go astray.

    (K + mu M) dx = h(t, q),   mu >= 0

is Newton's step at mu = 0 and a short way down the slope at large mu: an implicit step of an overdamped motion. mu is
raised until the matrix has no negative pivot and until the step gains what its quadratic model promises (to a tenth),
and falls where it gains that much, so that the end is Newton's method (pseudo-transient continuation: Kelley, Keyes,
SIAM J. Numer. Anal. 35, 1998, 508). The mass as weight leaves the stiff motions of a structure almost as they are and
holds back the soft ones, which buckle.

For systems whose forces have a potential at rest. Wrinkles of a film, say, where a path with small steps would meet
bifurcation after bifurcation.

Where the steps become small but the stiffness is not positive definite, they creep to a saddle of the energy. The softest
mode leads away from it, downhill. Curvatures and gains below the round-off of their sums count as zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fsm.blocks import BlockMatrix
from fsm.errors import NotConverged
from fsm.solve.linear import LinearSolver
from fsm.system import Linearised, System

__all__ = ["Relaxed", "relaxed"]

_SMALLEST = 1e-10
"""Smallest mu that is not zero, over the largest ratio of stiffness to mass."""
_RAISED, _LOWERED = 4.0, 0.25
_POOR, _GOOD = 0.1, 0.7
"""Gain over that of the model, below which a step is not taken, and above which mu falls."""
_LITTLE = 0.01
"""Part of the work of a step that its weight takes, below which the next one goes without."""
_LARGEST = 0.5
"""Largest step over the size of an element or a radian."""
_CORRECTIONS = 3
"""Iterations that a step which gains too little is given before it is taken back."""
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_ROUND_OFF = 4.0 * float(np.finfo(float).eps)
"""Of a force over the sum of what it is made of."""
_CREEPING = 5e-3
"""Length of a step, as tolerances, below which it may lead to a saddle."""
_MODE_ITERATIONS = 8
"""Of inverse iteration for the softest mode, which goes on from that of the step before."""
_BESIDE = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
"""Largest components of the way along that mode, as tolerances; they are tried in this order."""
_PATIENT = 8
"""Most good steps in a row before mu falls again; each fall that was too much doubles them."""
_DENSE = 1000
"""Largest number of coordinates whose eigenvalues are computed."""
_STALLED = 0.5
"""A step of Newton's method over the one before, above which it comes no nearer."""


@dataclass(frozen=True)
class Relaxed:
    """A stable equilibrium: configuration, iterations (steps not taken included), size of the last step."""

    q: np.ndarray
    iterations: int
    last_step: float


def relaxed(
    system: System,
    t: float,
    q: np.ndarray,
    tolerance: float = 1e-9,
    max_iterations: int = 300,
    renew: Callable[[np.ndarray], None] | None = None,
    watched: bool = False,
) -> Relaxed:
    """A stable equilibrium near a configuration, at time t and at rest.

    It is reached where the last step of Newton's method is small, or where steps no longer become smaller and the forces are
    the round-off of those at work: what hardly anything holds (a slack corner of a thin film) has steps without meaning.

    Parameters
    ----------
    system : System
    t : s
    q : (nq,) array
        To start from.
    tolerance : -
        Largest last step of Newton's method, over the size of an element or a radian.
    max_iterations : int
    renew : called with a configuration whose stiffness is not positive definite, before anything else is tried
        May change the forces there a little, so that it is; called once at a configuration.
    watched : bool
        Steps in which something passes through a face are not taken, and the system is told of every one that is.

    Raises
    ------
    NotConverged
        None is found: with the negative pivots, the force left over and the worst node.
    """
    size = system.scales().increment
    solver = LinearSolver()
    linear = system.linearise(t, q, None)
    pattern = linear.stiffness.pattern
    inertia = system.inertia(q, pattern)
    smallest = _SMALLEST * _fastest(linear.stiffness, inertia)
    mass = BlockMatrix(pattern, inertia)
    mu, negative, last, renewed = 0.0, 0, math.inf, False
    patience, good = 1, 0
    mode = np.random.default_rng(0).standard_normal(system.nu) * size
    rest = np.zeros(system.nu)
    for iteration in range(1, max_iterations + 1):
        if linear.stiffness.pattern is not pattern:  # contacts came near or went
            pattern = linear.stiffness.pattern
            inertia = system.inertia(q, pattern)
            mass = BlockMatrix(pattern, inertia)
        solver.factorise(BlockMatrix(pattern, linear.stiffness.symmetric().data + mu * inertia))
        count = solver.negative_pivots()
        if mu == 0.0:
            negative = count
        if count and renew is not None and not renewed:
            renew(q)
            linear, renewed = system.linearise(t, q, None), True
            continue
        if count:
            mu, patience, good = max(_RAISED * mu, smallest), min(2 * patience, _PATIENT), 0
            continue
        step = solver.solve(linear.force)
        length = float(np.abs(step / size).max(initial=0.0))
        if mu == 0.0 and length <= tolerance:
            return Relaxed(system.retract(q, step), iteration, length)
        if mu == 0.0:
            if length > _STALLED * last and _is_round_off(system, linear, q):
                return Relaxed(q, iteration, length)
            last = length
        elif length <= _CREEPING:
            mode = _softest(solver, mass, mode, size)
            if _is_round_off(system, linear, q) and _is_stable(linear.stiffness, size):
                return Relaxed(q, iteration, length)
            if float(mode @ linear.stiffness.symmetric().times(mode)) < 0.0:
                beside = _beside(system, t, q, linear.force, mode)
                if beside is not None and not (watched and system.objection(t, beside, None, 1.0)):
                    if watched:
                        system.commit(t, beside, rest)
                    q = beside
                    linear, renewed = system.linearise(t, q, None), False
                    continue
        part = min(1.0, _LARGEST / length) if length else 1.0
        work = float(step @ linear.force)
        held_back = mu * float(step @ mass.times(step))
        promised = part * work - 0.5 * part * part * (work - held_back)
        step *= part
        trial = system.retract(q, step)
        gained = 0.5 * float(step @ (linear.force + system.force(t, trial, None)))
        doubt = float(_round_off(system, linear, q) @ np.abs(step))
        if gained < _POOR * promised - doubt and length > tolerance:
            corrected = _corrected(system, t, q, trial, mu, inertia)
            if corrected is None:
                mu, patience, good = max(_RAISED * mu, smallest), min(2 * patience, _PATIENT), 0
                continue
            trial = corrected
            gained = promised
        if watched:
            if system.objection(t, trial, None, 1.0) is not None:
                mu = max(_RAISED * mu, smallest)
                continue
            system.commit(t, trial, rest)
        if gained > _GOOD * promised - doubt:
            smallest, good = min(smallest, mu or smallest), good + 1
            if good >= patience:
                mu = _LOWERED * mu if held_back > _LITTLE * work else 0.0
                patience, good = max(1, patience // 2), 0
        q = trial
        linear, renewed = system.linearise(t, q, None), False
    left = float(np.abs(linear.force).max())
    state = "converged" if _is_round_off(system, linear, q) else "not converged"
    pivots = f"the stiffness has {negative} negative pivot{'' if negative == 1 else 's'}"
    raise NotConverged(
        f"no stable equilibrium at t = {t:.6g} s after {max_iterations} iterations: {pivots}; residual {left:.3g} N "
        f"({state}), largest at {system.blame(linear.force)}"
    )


def _corrected(
    system: System, t: float, start: np.ndarray, trial: np.ndarray, mu: float, inertia: np.ndarray
) -> np.ndarray | None:
    """A trial after more iterations for the same mu, if these bring it below the start; else None.

    A first step that turns a long part stretches it by the square of the turn, far up in energy; the next ones take that
    back (watchdog technique: Chamberlain et al., Math. Program. Study 16, 1982, 1). The gain is the work of the forces on
    the straight way, whose stretch Gauss' points see.
    """
    solver, size = LinearSolver(), system.scales().increment
    for _ in range(_CORRECTIONS):
        linear = system.linearise(t, trial, None)
        pattern = linear.stiffness.pattern
        if len(pattern.indices) != len(inertia):  # bodies have come near that were not
            return None
        mass = BlockMatrix(pattern, inertia)
        solver.factorise(BlockMatrix(pattern, linear.stiffness.symmetric().data + mu * inertia))
        step = solver.solve(linear.force - mu * mass.times(system.difference(start, trial)))
        if solver.negative_pivots() or float(np.abs(step / size).max(initial=0.0)) > _LARGEST:
            return None
        trial = system.retract(trial, step)
    return trial if _work(system, t, start, system.difference(start, trial)) > 0.0 else None


def _work(system: System, t: float, start: np.ndarray, way: np.ndarray) -> float:
    """Work of the forces on a straight way, by Gauss' points."""
    return sum(
        float(weight * (way @ system.force(t, system.retract(start, part * way), None)))
        for part, weight in zip(0.5 + 0.5 * _PLACES, 0.5 * _WEIGHTS, strict=True)
    )


def _softest(solver: LinearSolver, mass: BlockMatrix, mode: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Softest mode of a factorised K + mu M, largest component 1 over the size, from an estimate."""
    for _ in range(_MODE_ITERATIONS):
        mode = solver.solve(mass.times(mode))
        mode = mode / np.abs(mode / size).max()
    return mode


def _is_stable(stiffness: BlockMatrix, size: np.ndarray) -> bool:
    """Whether a stiffness has no negative eigenvalue but for round-off, n eps of the largest one.

    Pivots of a large one decide; of soft creases between stiff panels they may be round-off alone.
    """
    if len(size) > _DENSE:
        solver = LinearSolver()
        solver.factorise(stiffness.symmetric())
        return solver.negative_pivots() == 0
    values = np.linalg.eigvalsh(stiffness.symmetric().bsr().toarray() * size * size[:, None])
    return bool(values[0] >= -len(size) * np.finfo(float).eps * values[-1])


def _beside(system: System, t: float, q: np.ndarray, force: np.ndarray, mode: np.ndarray) -> np.ndarray | None:
    """Configuration of lower energy beside an unstable one, along a mode; None if there is none."""
    downhill = np.copysign(1.0, float(mode @ force)) * mode
    for part in _BESIDE:
        for way in (part * downhill, -part * downhill):
            if _work(system, t, q, way) > 0.0:
                return system.retract(q, way)
    return None


def _is_round_off(system: System, linear: Linearised, q: np.ndarray) -> bool:
    """Whether the residual is round-off."""
    return bool(np.all(np.abs(linear.force) <= _round_off(system, linear, q)))


def _round_off(system: System, linear: Linearised, q: np.ndarray) -> np.ndarray:
    """Round-off of the forces: that of the stiffnesses times coordinates, whose sum they are.

    Of bodies in space, whose quaternions are one number more, the span of the structure and a radian stand for coordinates.
    """
    stiffness = linear.stiffness
    coordinates = np.abs(q) if len(q) == system.nu else system.scales().span
    return _ROUND_OFF * BlockMatrix(stiffness.pattern, np.abs(stiffness.data)).times(coordinates)


def _fastest(stiffness: BlockMatrix, inertia: np.ndarray) -> float:
    """Largest ratio of stiffness to mass on the diagonal, 1/s^2."""
    diagonal = stiffness.pattern.diagonal
    stiff, heavy = (data[diagonal].diagonal(axis1=1, axis2=2) for data in (stiffness.data, inertia))
    return float((np.abs(stiff) / heavy).max(initial=0.0))
