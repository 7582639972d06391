"""Functions of time that multiply loads."""

from __future__ import annotations

import numpy as np

from fsm.scene.loads import Constant, Ramp, TimeFunction

__all__ = ["breaks", "factor", "slope"]


def factor(function: TimeFunction, t: float) -> float:
    """Value of a time function at t (s)."""
    if isinstance(function, Constant):
        return 1.0
    if isinstance(function, Ramp):
        x = min(1.0, max(0.0, (t - function.start) / (function.end - function.start)))
        return x * x * (3.0 - 2.0 * x)
    return float(np.interp(t, function.time, function.value))


def breaks(function: TimeFunction) -> tuple[float, ...]:
    """Times at which a time function is not smooth, s."""
    if isinstance(function, Constant):
        return ()
    if isinstance(function, Ramp):
        return (function.start, function.end)
    return tuple(function.time)


def slope(function: TimeFunction, t: float) -> float:
    """Derivative of a time function at t, 1/s; at a point of a table, the slope of the following interval."""
    if isinstance(function, Constant):
        return 0.0
    if isinstance(function, Ramp):
        length = function.end - function.start
        x = (t - function.start) / length
        return 6.0 * x * (1.0 - x) / length if 0.0 <= x <= 1.0 else 0.0
    time, value = np.asarray(function.time), np.asarray(function.value)
    piece = int(np.searchsorted(time, t, side="right")) - 1
    if piece < 0 or piece >= len(time) - 1:
        return 0.0
    return float((value[piece + 1] - value[piece]) / (time[piece + 1] - time[piece]))
