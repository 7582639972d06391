"""Nodes and weights of quadrature over a length."""

from __future__ import annotations

from functools import cache

import numpy as np


@cache
def gauss_lobatto(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Lobatto nodes and weights (count,) on [-1, 1], count >= 2; both ends are nodes. Read-only arrays."""
    legendre = np.polynomial.legendre.Legendre.basis(count - 1)
    nodes = np.concatenate([[-1.0], np.sort(legendre.deriv().roots().real), [1.0]])
    weights = 2.0 / (count * (count - 1) * legendre(nodes) ** 2)
    nodes.flags.writeable = weights.flags.writeable = False
    return nodes, weights
