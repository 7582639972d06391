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
        Times of loads and drives; small steps keep the iteration on its branch. If `q` is an equilibrium, start with
        its time: the tangent there predicts the next equilibrium.
    tolerance : -
        Bound of the last Newton step, over the size of a segment or a radian.
    max_iterations : int
    on_state : called with (time, q) at each equilibrium

    Returns
    -------
    (nq,) array
        Equilibrium at the last time. Its stability is not checked; see `negative_pivots`.

    Raises
    ------
    NotConverged
        The message states the time and the worst body.
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
                f"{np.abs(residual).max():.3g}, is at {system.worst_body(residual)}; take smaller steps"
            )
        before = t
        if on_state is not None:
            on_state(float(t), q)
    return q


def tangent_prediction(
    system: System, before: float, t: float, q: np.ndarray, solver: LinearSolver | None = None
) -> np.ndarray:
    """Increment of the equilibrium from `before` to t, to first order; the function overwrites the factorisation of
    `solver`.

    A large motion of the drive alone would stretch its springs beyond the range of the linearisation. So the change of the
    forces is computed for the beginning of the step, and scaled to the whole step.
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
    """Step limited to half a segment or half a radian, the range of the linearisation."""
    return step * min(1.0, 0.5 / max(float(np.abs(step / size).max(initial=0.0)), 1e-300))


def negative_pivots(system: System, t: float, q: np.ndarray, solver: LinearSolver | None = None) -> int:
    """Number of negative pivots of the tangent stiffness at rest; 0 where stable.

    They are counted by Sylvester's law for the symmetric part, by a factorisation without row exchanges between blocks. If
    there are some and friction bristles make the stiffness unsymmetric, the negative real pivots of the stiffness itself
    count: see `fsm.solve.equilibrium_step`. A given `solver` saves the analysis of the pattern; its factorisation is lost.
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
    except NotConverged:  # exactly singular: a mechanism, or a free body
        values = np.linalg.eigvalsh(matrix.bsr().toarray())
        return int(np.sum(values < -1e-12 * np.abs(values).max(initial=0.0)))
    return solver.negative_real_pivots()
