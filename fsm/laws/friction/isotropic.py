"""Isotropic friction: effort mu(|v|) N v/|v| and its derivatives from a coefficient mu(|v|)."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel(inline=True)
def length(vectors: np.ndarray, i: int) -> float:
    """Euclidean length of row i."""
    total = 0.0
    for c in range(vectors.shape[1]):
        total += vectors[i, c] ** 2
    return float(np.sqrt(total))


@kernel(inline=True)
def set_effort(
    i: int,
    slip: np.ndarray,
    speed: float,
    normal: float,
    ratio: float,
    slope: float,
    effort: np.ndarray,
    by_slip: np.ndarray,
    by_normal: np.ndarray,
) -> None:
    """Write row i of the effort f = mu N v/|v|, of df/dv = N [r 1 + (mu' - r) v v^T/|v|^2], and of df/dN.

    Parameters
    ----------
    slip : (m, c) array, m/s
    speed : |v|, m/s
    normal : N
    ratio, slope : r = mu/|v| (its limit at rest) and mu' = d mu/d|v|, s/m
    effort, by_slip, by_normal : (m, c), (m, c, c), (m, c) arrays, changed in place
    """
    components = slip.shape[1]
    for c in range(components):
        by_normal[i, c] = ratio * slip[i, c]
        effort[i, c] = normal * by_normal[i, c]
        for k in range(components):
            along = (slip[i, c] / speed) * (slip[i, k] / speed) if speed > 0.0 else 0.0
            by_slip[i, c, k] = normal * ((ratio if c == k else 0.0) + (slope - ratio) * along)
