"""Static equilibrium h(t, q, 0) = 0 by Newton's method with the exact tangent and load stepping."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import splu

from fsm.errors import NotConverged
from fsm.system import System

__all__ = ["equilibrium", "negative_pivots"]


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
        The loads' and drives' own time; small steps keep Newton on the branch it started on.
    tolerance : -
        Largest residual over the largest force in the system at that time.
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
    rest = np.zeros(system.nu)
    scales = system.scales()
    for t in times:
        reference = 0.0
        for _ in range(max_iterations):
            residual = system.force(t, q, rest)
            stiffness = system.tangent(t, q, rest)[0].tocsc()
            step = splu(stiffness).solve(residual)
            # a step of more than a segment or a radian leaves the region where the tangent means anything
            step *= min(1.0, 0.5 * min(scales.length, 1.0) / max(np.abs(step).max(), 1e-300))
            q = system.retract(q, step)
            reference = max(reference, float(np.abs(residual).max()), float(np.abs(stiffness @ step).max()))
            if np.abs(step).max() <= tolerance * scales.length:
                break
        else:
            raise NotConverged(
                f"no equilibrium found at t = {t:.6g} s in {max_iterations} iterations; the largest residual, "
                f"{np.abs(residual).max():.3g}, is at {system.blame(residual)}; take smaller steps"
            )
        if on_state is not None:
            on_state(float(t), q)
    return q


def negative_pivots(system: System, t: float, q: np.ndarray) -> int:
    """Number of negative eigenvalues of the symmetric part of the tangent stiffness at rest; 0 where stable.

    By Sylvester's law, from the signs of an LDL^T-like factorisation without row exchanges.
    """
    if system.nu == 0:
        return 0
    stiffness = system.tangent(t, q, np.zeros(system.nu))[0].tocsc()
    symmetric = (0.5 * (stiffness + stiffness.T)).tocsc()
    factors = splu(
        symmetric, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    if not np.array_equal(factors.perm_r, factors.perm_c):
        return int(np.sum(np.linalg.eigvalsh(symmetric.toarray()) < 0.0))
    return int(np.sum(factors.U.diagonal() < 0.0))
