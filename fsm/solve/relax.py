"""Stable equilibrium by going down the energy: Newton's method made heavy where it would go astray.

    (K + mu M) dx = h(t, q),   mu >= 0

is Newton's step at mu = 0 and a short way down the slope at large mu: an implicit step of an overdamped motion. mu is
raised until the matrix has no negative pivot and until the step gains what its quadratic model promises (to a tenth),
and falls where it gains that much, so that the end is Newton's method (pseudo-transient continuation: Kelley, Keyes,
SIAM J. Numer. Anal. 35, 1998, 508). The mass as weight leaves the stiff motions of a structure almost as they are and
holds back the soft ones, which buckle.

For systems whose forces have a potential at rest. Wrinkles of a film, say, where a path with small steps would meet
bifurcation after bifurcation: a shape a little beside the unstable one is enough of a start.
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
        To start from; on a symmetric, unstable equilibrium nothing would push it off.
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
            mu = max(_RAISED * mu, smallest)
            continue
        step = solver.solve(linear.force)
        length = float(np.abs(step / size).max(initial=0.0))
        if mu == 0.0 and length <= tolerance:
            return Relaxed(system.retract(q, step), iteration, length)
        if mu == 0.0:
            if length > _STALLED * last and _is_round_off(system, linear, q):
                return Relaxed(q, iteration, length)
            last = length
        part = min(1.0, _LARGEST / length) if length else 1.0
        work = float(step @ linear.force)
        held_back = mu * float(step @ mass.times(step))
        promised = part * work - 0.5 * part * part * (work - held_back)
        step *= part
        trial = system.retract(q, step)
        gained = 0.5 * float(step @ (linear.force + system.force(t, trial, None)))
        if gained < _POOR * promised and length > tolerance:
            corrected = _corrected(system, t, q, trial, mu, inertia)
            if corrected is None:
                mu = max(_RAISED * mu, smallest)
                continue
            trial = corrected
            gained = promised
        if watched:
            if system.objection(t, trial, None, 1.0) is not None:
                mu = max(_RAISED * mu, smallest)
                continue
            system.commit(t, trial, rest)
        if gained > _GOOD * promised:
            smallest = min(smallest, mu or smallest)
            mu = _LOWERED * mu if held_back > _LITTLE * work else 0.0
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
    way = system.difference(start, trial)
    gained = sum(
        float(weight * (way @ system.force(t, system.retract(start, part * way), None)))
        for part, weight in zip(0.5 + 0.5 * _PLACES, 0.5 * _WEIGHTS, strict=True)
    )
    return trial if gained > 0.0 else None


def _is_round_off(system: System, linear: Linearised, q: np.ndarray) -> bool:
    """Whether what is left of the forces is round-off of the stiffnesses times coordinates that it is the sum of.

    Of bodies in space, whose quaternions are one number more, the span of the structure and a radian stand for coordinates.
    """
    stiffness = linear.stiffness
    coordinates = np.abs(q) if len(q) == system.nu else system.scales().span
    at_work = BlockMatrix(stiffness.pattern, np.abs(stiffness.data)).times(coordinates)
    return bool(np.all(np.abs(linear.force) <= _ROUND_OFF * at_work))


def _fastest(stiffness: BlockMatrix, inertia: np.ndarray) -> float:
    """Largest ratio of stiffness to mass on the diagonal, 1/s^2."""
    diagonal = stiffness.pattern.diagonal
    stiff, heavy = (data[diagonal].diagonal(axis1=1, axis2=2) for data in (stiffness.data, inertia))
    return float((np.abs(stiff) / heavy).max(initial=0.0))
