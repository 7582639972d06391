"""Programs of time in pieces, for kernels: polynomials and sine waves, one after the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["SHAPE", "Pieces", "program_at"]

SHAPE = 9
"""Numbers of a piece: origin o, c0 to c4, a, w, p of its value sum_k ck x^k + a sin(w x + p) with x = t - o."""


class Pieces(NamedTuple):
    """Pieces of several programs.

    Attributes
    ----------
    first : (n_programs + 1,) int array
        First piece of each program.
    begin : (m,) array, s
        Increasing within a program; the first is -inf.
    closed : (m,) int array
        1: the piece acts at its begin too; 0: the piece before it does.
    shape : (m, SHAPE) array
    """

    first: np.ndarray
    begin: np.ndarray
    closed: np.ndarray
    shape: np.ndarray


@kernel
def program_at(pieces: Pieces, number: int, t: float) -> tuple[float, float, float]:
    """Value of a program at a time (s), and two derivatives."""
    low, high = pieces.first[number], pieces.first[number + 1] - 1
    while low < high:
        middle = (low + high + 1) // 2
        begin = pieces.begin[middle]
        if begin < t or (begin == t and pieces.closed[middle] == 1):
            low = middle
        else:
            high = middle - 1
    shape = pieces.shape[low]
    x = t - shape[0]
    value = slope = bend = 0.0
    for k in range(5, 0, -1):
        bend = bend * x + 2.0 * slope
        slope = slope * x + value
        value = value * x + shape[k]
    if shape[6] != 0.0:
        a, w = shape[6], shape[7]
        sine, cosine = np.sin(w * x + shape[8]), np.cos(w * x + shape[8])
        value, slope, bend = value + a * sine, slope + a * w * cosine, bend - a * w * w * sine
    return value, slope, bend
