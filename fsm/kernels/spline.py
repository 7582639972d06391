"""Piecewise cubic curves M(x) with exact integral and linear extrapolation."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def evaluate_curve(
    x: float, start: int, end: int, knots: np.ndarray, coefficients: np.ndarray, energies: np.ndarray
) -> tuple[float, float, float]:
    """Energy, moment and slope of one curve at x.

    Parameters
    ----------
    x : float
    start, end : int
        The knots of the curve are ``knots[start:end]``.
    knots : (n,) array, increasing within a curve
    coefficients : (n, 4) array
        Cubic of the interval that begins at each knot, highest power first; the last row is the linear extrapolation.
    energies : (n,) array
        Integral of M from the origin of the energy to each knot.

    Returns
    -------
    energy, moment, slope : float
    """
    if x < knots[start]:
        # linear extrapolation below the first knot
        step = x - knots[start]
        slope = coefficients[start, 2]
        value = coefficients[start, 3]
        return energies[start] + step * (value + 0.5 * slope * step), value + slope * step, slope
    low, high = start, end
    while high - low > 1:
        middle = (low + high) // 2
        if knots[middle] <= x:
            low = middle
        else:
            high = middle
    step = x - knots[low]
    a, b, c, d = coefficients[low]
    energy = energies[low] + step * (d + step * (c / 2 + step * (b / 3 + step * a / 4)))
    return energy, d + step * (c + step * (b + step * a)), c + step * (2 * b + step * 3 * a)
