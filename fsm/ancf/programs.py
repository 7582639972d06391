"""Functions of time as pieces for kernels; see `fsm.kernels.pieces`."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fsm.ancf.time_functions import Constant, HalfSine, Ramp, Rectangle, SampledPulse, TimeFunction
from fsm.kernels.pieces import SHAPE, Pieces

__all__ = ["programs_of"]

_Piece = tuple[float, float, tuple[float, ...]]
"""Begin and origin (s), and the powers, then amplitude, frequency and phase, as in `Pieces.shape`."""
_ZERO: _Piece = (-math.inf, 0.0, (0.0,))


def _pieces(function: TimeFunction) -> list[_Piece] | None:
    if isinstance(function, Constant):
        return [(-math.inf, 0.0, (function.value,))]
    if isinstance(function, Ramp):
        start, end = function.start, function.end
        return [_ZERO, (start, start, (0.0, 1.0 / (end - start))), (end, end, (1.0,))]
    if isinstance(function, HalfSine):
        start, end = function.start, function.start + function.duration
        wave = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0, math.pi / function.duration, 0.0)
        return [_ZERO, (start, start, wave), (end, end, (0.0,))]
    if isinstance(function, Rectangle):
        end = function.start + function.duration
        return [_ZERO, (function.start, 0.0, (1.0,)), (end, 0.0, (0.0,))]
    if isinstance(function, SampledPulse):
        time, value = function.time, function.value
        lines = [
            (time[k], time[k], (value[k], (value[k + 1] - value[k]) / (time[k + 1] - time[k]))) for k in range(len(time) - 1)
        ]
        return [_ZERO, *lines, (time[-1], 0.0, (0.0,))]
    return None


def programs_of(functions: Sequence[TimeFunction]) -> Pieces | None:
    """Pieces of several functions, all continuous from the left; None if one of them is of another kind."""
    found = [_pieces(function) for function in functions]
    if any(pieces is None for pieces in found):
        return None
    flat = [piece for pieces in found for piece in pieces or []]
    shape = np.zeros((len(flat), SHAPE))
    for row, (_, origin, numbers) in zip(shape, flat, strict=True):
        row[0], row[1 : 1 + len(numbers)] = origin, numbers
    first = np.cumsum([0, *(len(pieces or []) for pieces in found)], dtype=np.int64)
    begin = np.array([piece[0] for piece in flat], dtype=float)
    return Pieces(first, begin, np.zeros(len(flat), dtype=np.int64), shape)
