"""Stable equilibrium by energy descent: Newton's method with a mass term where it would diverge.

    (K + mu M) dx = h(t, q),   mu >= 0

is Newton's step at mu = 0. At large mu it is a short descent step: an implicit step of an overdamped motion. mu is raised
until the matrix has no negative pivot and the energy decreases by at least a tenth of the quadratic model. mu is lowered
where the energy decreases as predicted, so the last steps are Newton's (pseudo-transient continuation: Kelley, Keyes, SIAM
J. Numer. Anal. 35, 1998, 508). The mass term hardly changes stiff motions of a structure, and limits soft motions,
which may buckle.

The method requires forces with a potential at rest. An example is a film with wrinkles, whose path has many
bifurcations.

Small steps with an indefinite stiffness approach a saddle of the energy. A step along the softest mode leaves the saddle and
lowers the energy. Curvatures and gains below the round-off of their sums count as zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fsm.errors import NotConverged
from fsm.kernels.blocks import BlockMatrix
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.interface.records import Linearised
from fsm.solve.interface.system import System
from fsm.text.short_repr import ShortRepr

_SMALLEST = 1e-10
"""Smallest mu that is not zero, relative to the largest ratio of stiffness to mass."""
_RAISED, _LOWERED = 4.0, 0.25
_POOR, _GOOD = 0.1, 0.7
"""Bounds of the ratio of the decrease of the energy to the decrease of the model: below the first a step is rejected,
above the second mu decreases."""
_LITTLE = 0.01
"""Fraction of the work of a step that is done against the mass term; below this fraction the next step has mu = 0."""
_LARGEST = 0.5
"""Largest step relative to the size of an element or a radian."""
_CORRECTIONS = 3
"""Number of corrections of a step that decreases the energy too little. After these corrections the step is
rejected."""
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_ROUND_OFF = 4.0 * float(np.finfo(float).eps)
"""Round-off of a force relative to the sum of its terms."""
_CREEPING = 5e-3
"""Length of a step relative to the tolerance, below which the step may lead to a saddle."""
_MODE_ITERATIONS = 8
"""Number of inverse iterations for the softest mode, which start from the softest mode of the previous step."""
_BESIDE = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
"""Largest components of trial steps along the softest mode, relative to the tolerance, in the order of the trials."""
_PATIENT = 8
"""Largest number of successive good steps before mu decreases again; each decrease that was too large doubles the
number."""
_DENSE = 1000
"""Largest number of coordinates whose eigenvalues are computed."""
_STALLED = 0.5
"""Ratio of successive Newton steps above which the iteration does not converge further."""


@dataclass(frozen=True, repr=False)
class Relaxed(ShortRepr):
    """Stable equilibrium: configuration, iterations (with rejected steps), size of the last step."""

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
    """Stable equilibrium near a configuration, at time t and at rest.

    The iteration has converged if the last Newton step is small, or if steps no longer decrease and the residual is
    round-off. The second case occurs in parts with almost no stiffness, such as a slack corner of a thin film.

    Parameters
    ----------
    system : System
    t : s
    q : (nq,) array
        Initial guess.
    tolerance : -
        Bound of the last Newton step, over the size of an element or a radian.
    max_iterations : int
    renew : called once at a configuration whose stiffness is not positive definite
        It may change the forces there slightly, so that the stiffness becomes positive definite.
    watched : bool
        If true, steps in which a body passes through a face are rejected, and each accepted step is committed to the system.

    Raises
    ------
    NotConverged
        No equilibrium is found; the message states the negative pivots, the residual and the worst node.
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
        if linear.stiffness.pattern is not pattern:  # the set of near contacts has changed
            pattern = linear.stiffness.pattern
            inertia = system.inertia(q, pattern)
            mass = BlockMatrix(pattern, inertia)
        solver.factorise(_shifted(linear.stiffness, mu * inertia))
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
                if beside is not None and not (watched and system.rejection(t, beside, None, 1.0)):
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
            if system.rejection(t, trial, None, 1.0) is not None:
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
        f"({state}), largest at {system.worst_body(linear.force)}"
    )


def _corrected(
    system: System, t: float, start: np.ndarray, trial: np.ndarray, mu: float, inertia: np.ndarray
) -> np.ndarray | None:
    """Trial state after more iterations at the same mu, if its energy is below the initial energy; else None.

    A first step that rotates a long part also stretches this part by the square of the rotation, which raises the
    energy. The next iterations remove the stretch (watchdog technique: Chamberlain et al., Math. Program. Study 16,
    1982, 1). The decrease is the work of the forces along the straight path, by Gauss quadrature.
    """
    solver, size = LinearSolver(), system.scales().increment
    for _ in range(_CORRECTIONS):
        linear = system.linearise(t, trial, None)
        pattern = linear.stiffness.pattern
        if len(pattern.indices) != len(inertia):  # more bodies have come near each other
            return None
        mass = BlockMatrix(pattern, inertia)
        solver.factorise(_shifted(linear.stiffness, mu * inertia))
        step = solver.solve(linear.force - mu * mass.times(system.difference(start, trial)))
        if solver.negative_pivots() or float(np.abs(step / size).max(initial=0.0)) > _LARGEST:
            return None
        trial = system.retract(trial, step)
    return trial if _work(system, t, start, system.difference(start, trial)) > 0.0 else None


def _shifted(stiffness: BlockMatrix, shift: np.ndarray) -> BlockMatrix:
    """Symmetric part of a stiffness, plus block data."""
    symmetric = stiffness.symmetric()
    return symmetric.with_data(symmetric.data + shift)


def _work(system: System, t: float, start: np.ndarray, way: np.ndarray) -> float:
    """Work of the forces along a straight path, by Gauss quadrature."""
    return sum(
        float(weight * (way @ system.force(t, system.retract(start, part * way), None)))
        for part, weight in zip(0.5 + 0.5 * _PLACES, 0.5 * _WEIGHTS, strict=True)
    )


def _softest(solver: LinearSolver, mass: BlockMatrix, mode: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Softest mode of K + mu M by inverse iterations from an estimate; its largest component relative to `size` is 1."""
    for _ in range(_MODE_ITERATIONS):
        mode = solver.solve(mass.times(mode))
        mode = mode / np.abs(mode / size).max()
    return mode


def _is_stable(stiffness: BlockMatrix, size: np.ndarray) -> bool:
    """Whether a stiffness has no negative eigenvalue beyond round-off, n eps of the largest one.

    For large matrices the pivots decide; with soft creases between stiff panels these may be round-off.
    """
    if len(size) > _DENSE:
        solver = LinearSolver()
        solver.factorise(stiffness.symmetric())
        return solver.negative_pivots() == 0
    values = np.linalg.eigvalsh(stiffness.symmetric().bsr().toarray() * size * size[:, None])
    return bool(values[0] >= -len(size) * np.finfo(float).eps * values[-1])


def _beside(system: System, t: float, q: np.ndarray, force: np.ndarray, mode: np.ndarray) -> np.ndarray | None:
    """Configuration of lower energy beside an unstable configuration, along a mode; None if there is none."""
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
    """Round-off of the forces, which are sums of stiffnesses times coordinates.

    For bodies in space, the span of the structure and one radian replace the coordinates.
    """
    stiffness = linear.stiffness
    coordinates = np.abs(q) if len(q) == system.nu else system.scales().span
    return _ROUND_OFF * BlockMatrix(stiffness.pattern, np.abs(stiffness.data)).times(coordinates)


def _fastest(stiffness: BlockMatrix, inertia: np.ndarray) -> float:
    """Largest ratio of stiffness to mass on the diagonal, 1/s^2."""
    diagonal = stiffness.pattern.diagonal
    stiff, heavy = (data[diagonal].diagonal(axis1=1, axis2=2) for data in (stiffness.data, inertia))
    return float((np.abs(stiff) / heavy).max(initial=0.0))
