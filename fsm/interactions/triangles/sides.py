"""Products of the sides of triangles, without allocation."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def cross_from(a: np.ndarray, b: np.ndarray, c: np.ndarray, out: np.ndarray) -> None:
    """Write the vector product of the sides from a to b and from a to c into `out` (3,)."""
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    u, v, w = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    out[0] = y * w - z * v
    out[1] = z * u - x * w
    out[2] = x * v - y * u
