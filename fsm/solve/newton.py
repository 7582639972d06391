"""Static equilibrium h(t, q, 0) = 0 by Newton's method with the exact tangent and load stepping."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fsm.blocks import BlockMatrix
from fsm.errors import NotConverged
from fsm.solve.linear import LinearSolver
from fsm.system import System

__all__ = ["equilibrium", "negative_pivots", "tangent_prediction"]


def equilibrium(
    system: System,
    q: np.ndarray,
    times: np.ndarray,
    tolerance: float = 1e-10,
    max_iterations: int = 50,
    on_state: Callable[[float, np.ndarray], None] | None = None,
) -> np.ndarray:
    """Follow static equilibria through the given times, at which loads and drives have their values.

    Parameters
    ----------
    system : System
    q : (nq,) array
        Configuration to start from.
    times : increasing times, s
        The loads' and drives' own time; small steps keep Newton on the branch it started on. Begin with the time at
        which `q` is an equilibrium, if it is one: the tangent there is what predicts the next.
    tolerance : -
        Largest last step of Newton, over the size of a segment or a radian.
    max_iterations : int
    on_state : called with (time, q) at each equilibrium

    Returns
    -------
    (nq,) array
        The equilibrium at the last time. Its stability is not judged here: see `negative_pivots`.

    Raises
    ------
    NotConverged
        With the time and the worst body.
    """
    before = times[0] if len(times) else 0.0
    for t in times:
        size = system.scales().increment
        if t != before:
            q = system.retract(q, _limited(tangent_prediction(system, before, t, q), size))
        for _ in range(max_iterations):
            linear = system.linearise(t, q, None)
            residual = linear.force
            step = _solved(linear.stiffness, residual)
            q = system.retract(q, _limited(step, size))
            if np.abs(step / size).max(initial=0.0) <= tolerance:
                break
        else:
            raise NotConverged(
                f"no equilibrium found at t = {t:.6g} s in {max_iterations} iterations; the largest residual, "
                f"{np.abs(residual).max():.3g}, is at {system.blame(residual)}; take smaller steps"
            )
        before = t
        if on_state is not None:
            on_state(float(t), q)
    return q


def tangent_prediction(
    system: System, before: float, t: float, q: np.ndarray, solver: LinearSolver | None = None
) -> np.ndarray:
    """Increment of the equilibrium from `before` to t, to first order; what `solver` has factorised is lost.

    A drive that moves alone by much stretches its springs so far that neither the forces nor the tangent mean anything.
    So the change of the forces is taken over the beginning of the step, and its size by comparison with all of it.
    """
    start = system.force(before, q, None)
    whole = system.force(t, q, None) - start
    change = system.force(before + 0.01 * (t - before), q, None) - start
    scale = float(whole @ change) / max(float(change @ change), 1e-300)
    return _solved(system.linearise(before, q, None).stiffness, start + scale * change, solver)


def _solved(matrix: BlockMatrix, right: np.ndarray, solver: LinearSolver | None = None) -> np.ndarray:
    solver = solver or LinearSolver()
    solver.factorise(matrix)
    return solver.solve(right)


def _limited(step: np.ndarray, size: np.ndarray) -> np.ndarray:
    """A step of more than half a segment or half a radian leaves the region where the tangent means anything."""
    return step * min(1.0, 0.5 / max(float(np.abs(step / size).max(initial=0.0)), 1e-300))


def negative_pivots(system: System, t: float, q: np.ndarray, solver: LinearSolver | None = None) -> int:
    """Number of negative pivots of the tangent stiffness at rest; 0 where stable.

    By Sylvester's law those of its symmetric part, from a factorisation without row exchanges between blocks. Where it has
    some and bristles of friction make the stiffness unsymmetric, the real ones of the stiffness itself: see
    `fsm.solve.equilibrium_step`. A solver that knows the pattern already saves its analysis; what it has factorised is lost.
    """
    if system.nu == 0:
        return 0
    solver = solver or LinearSolver()
    stiffness = system.linearise(t, q, None).stiffness
    matrix = stiffness.symmetric()
    try:
        solver.factorise(matrix)
        if solver.negative_pivots() == 0:
            return 0
        solver.factorise(stiffness)
    except NotConverged:  # exactly singular: a mechanism, or a body that nothing holds
        values = np.linalg.eigvalsh(matrix.bsr().toarray())
        return int(np.sum(values < -1e-12 * np.abs(values).max(initial=0.0)))
    return solver.negative_real_pivots()
