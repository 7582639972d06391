"""Cubic step function STEP of ADAMS, from 0 to 1."""

from __future__ import annotations

from fsm.kernels.jit import kernel


@kernel(inline=True)
def step(x: float) -> tuple[float, float]:
    """Value of STEP(x, 0, 0, 1, 1) = x^2 (3 - 2 x) on [0, 1], 0 below and 1 above, and its slope; C1 (docs/theory.md)."""
    if x <= 0.0:
        return 0.0, 0.0
    if x >= 1.0:
        return 1.0, 0.0
    return x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x)
