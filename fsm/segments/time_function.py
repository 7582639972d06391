"""Functions of time that multiply loads and prescribed motions: values, derivatives, and times without smoothness."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from fsm.interpolation import PiecewiseCubic, hermite_cubic, monotone_slopes
from fsm.scene.time_program import Constant, Cycle, Ramp, Table, TimeFunction, end_of

__all__ = ["breaks", "cubic_pieces", "curvature", "factor", "integral", "peaks", "rows_of", "slope", "turning_points"]

_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(2)


def factor(function: TimeFunction, t: float) -> float:
    """Value of a time function at t (s)."""
    if isinstance(function, Constant):
        return 1.0
    if isinstance(function, Ramp):
        x = (t - function.start) / (function.end - function.start)
        if function.shape == "unbounded":
            return x
        x = min(1.0, max(0.0, x))
        return x if function.shape == "linear" else x * x * (3.0 - 2.0 * x)
    if isinstance(function, Cycle):
        return _wave(function, t)[0]
    if function.interpolation == "smooth":
        time, _ = rows_of(function)
        return float(_curve(function)(min(max(t, time[0]), time[-1])))
    return float(np.interp(t, *rows_of(function)))


def slope(function: TimeFunction, t: float) -> float:
    """Derivative of a time function at t, 1/s; at a point of a linear table, the slope of the following interval."""
    if isinstance(function, Constant):
        return 0.0
    if isinstance(function, Ramp):
        length = function.end - function.start
        x = (t - function.start) / length
        if function.shape == "unbounded":
            return 1.0 / length
        if function.shape == "linear":
            return 1.0 / length if 0.0 <= x < 1.0 else 0.0
        return 6.0 * x * (1.0 - x) / length if 0.0 <= x <= 1.0 else 0.0
    if isinstance(function, Cycle):
        return _wave(function, t)[1]
    time, value = rows_of(function)
    if function.interpolation == "smooth":
        return float(_curve(function)(t, 1)) if time[0] <= t <= time[-1] else 0.0
    piece = int(np.searchsorted(time, t, side="right")) - 1
    if piece < 0 or piece >= len(time) - 1:
        return 0.0
    return float((value[piece + 1] - value[piece]) / (time[piece + 1] - time[piece]))


def curvature(function: TimeFunction, t: float) -> float:
    """Second derivative of a time function at t, 1/s^2; jumps count as zero."""
    if isinstance(function, Ramp) and function.shape == "smooth" and function.start < t < function.end:
        length = function.end - function.start
        return 6.0 * (1.0 - 2.0 * (t - function.start) / length) / length**2
    if isinstance(function, Cycle):
        return _wave(function, t)[2]
    if isinstance(function, Table) and function.interpolation == "smooth":
        time, _ = rows_of(function)
        return float(_curve(function)(t, 2)) if time[0] <= t < time[-1] else 0.0
    return 0.0


def integral(function: TimeFunction, t: float) -> float:
    """Integral of a time function from 0 to t, s; exact, since its pieces are cubics or waves."""
    return float(_antiderivative(function, t) - _antiderivative(function, 0.0))


def _antiderivative(function: TimeFunction, t: float) -> float:
    """Function whose slope is a time function, s."""
    if isinstance(function, Constant):
        return t
    if isinstance(function, Cycle):
        return _wave_integral(function, t)
    if isinstance(function, Ramp):
        length = function.end - function.start
        x = (t - function.start) / length
        if function.shape == "unbounded":
            return 0.5 * length * x * x
        inside = min(1.0, max(0.0, x))
        to_end = 0.5 * inside**2 if function.shape == "linear" else inside**3 * (1.0 - 0.5 * inside)
        return length * (to_end + max(0.0, x - 1.0))
    time, value = rows_of(function)
    sums = _row_integrals(function)
    piece = int(np.searchsorted(time, t, side="right")) - 1
    if piece < 0:
        return float(value[0] * (t - time[0]))
    if piece == len(time) - 1:
        return float(sums[-1] + value[-1] * (t - time[-1]))
    half, middle = 0.5 * (t - time[piece]), 0.5 * (t + time[piece])
    part = half * sum(w * factor(function, middle + half * x) for x, w in zip(_PLACES, _WEIGHTS, strict=True))
    return float(sums[piece] + part)


def breaks(function: TimeFunction) -> tuple[float, ...]:
    """Times at which a time function is not smooth, s."""
    if isinstance(function, Constant):
        return ()
    if isinstance(function, Ramp):
        return () if function.shape == "unbounded" else (function.start, function.end)
    if isinstance(function, Cycle):
        end = end_of(function)
        return (function.start,) if end is None else (function.start, end)
    return tuple(rows_of(function)[0].tolist())


def peaks(function: TimeFunction) -> tuple[float, ...]:
    """Times (s) among which a time function has its largest magnitude; of an unbounded ramp, where it is 1."""
    if isinstance(function, Cycle):
        return (function.start + (0.5 if function.form == "pulsating" else 0.25) * function.period,)
    return (function.end,) if isinstance(function, Ramp) else breaks(function)


def turning_points(function: TimeFunction) -> tuple[float, ...]:
    """Times (s) of a time function with an end: breaks, and all extremes and steepest points of a cycle."""
    end = end_of(function)
    if not isinstance(function, Cycle) or end is None:
        return breaks(function)
    quarters = np.arange(function.start, end, 0.25 * function.period)
    return (*quarters.tolist(), end)


def _wave(function: Cycle, t: float) -> tuple[float, float, float]:
    """Value and two derivatives of a cycle."""
    end = end_of(function)
    moving = t >= function.start and (end is None or t <= end)
    at = max(function.start, t if end is None else min(t, end))
    speed = 2.0 * math.pi / function.period
    x = speed * (at - function.start)
    if function.form == "pulsating":
        found = 0.5 * (1.0 - math.cos(x)), 0.5 * speed * math.sin(x), 0.5 * speed**2 * math.cos(x)
    else:
        found = math.sin(x), speed * math.cos(x), -(speed**2) * math.sin(x)
    return found if moving else (found[0], 0.0, 0.0)


def _wave_integral(function: Cycle, t: float) -> float:
    """Integral of a cycle from its start to t, s."""
    end = end_of(function)
    at = max(function.start, t if end is None else min(t, end))
    speed = 2.0 * math.pi / function.period
    x = speed * (at - function.start)
    whole = 0.5 * (x - math.sin(x)) if function.form == "pulsating" else 1.0 - math.cos(x)
    return whole / speed + (t - at) * _wave(function, t)[0]


@lru_cache(maxsize=256)
def rows_of(function: Table) -> tuple[np.ndarray, np.ndarray]:
    """Times (s) and values of a table."""
    return np.asarray(function.time, dtype=float), np.asarray(function.value, dtype=float)


@lru_cache(maxsize=256)
def _curve(function: Table) -> PiecewiseCubic:
    """Cubic pieces without overshoot (Fritsch and Carlson, 1980); the slope is zero at both ends."""
    time, value = rows_of(function)
    rates = np.zeros(len(time))
    if len(time) > 2:
        rates[1:-1] = monotone_slopes(time, value)[1:-1]
    return hermite_cubic(time, value, rates)


@lru_cache(maxsize=256)
def _row_integrals(function: Table) -> np.ndarray:
    """Integral of a table from its first row to each row, s."""
    time, value = rows_of(function)
    smooth = function.interpolation == "smooth"
    pieces = _curve(function).integrals() if smooth else 0.5 * np.diff(time) * (value[1:] + value[:-1])
    return np.concatenate([[0.0], np.cumsum(pieces)])


def cubic_pieces(function: Table) -> np.ndarray:
    """Coefficients (4, n - 1) of the pieces of a smooth table, by powers of the time since their begin."""
    return np.asarray(_curve(function).coefficients[::-1])
