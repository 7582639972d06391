"""Functions of time that loads are multiplied by."""

from __future__ import annotations

import numpy as np

from fsm.scene.loads import Constant, Ramp, TimeFunction

__all__ = ["breaks", "factor"]


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
