"""Functions of time: loads, motions of drives and supports, rest angles, supplies. All of them are pieces of polynomials and
sine waves.

Objects and compiled steps evaluate them by the same function, `program_at`; `fsm.kernels.pieces` gives it to kernels. This
module needs no compiler. Functions are continuous, or continuous from the left: a function that jumps from zero at t = 0
still has the value zero there, so an initial state at rest is in equilibrium.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple, Self

import numpy as np

SHAPE = 9
"""Numbers of a piece: origin o, c0 to c4, a, w, p of its value sum_k ck x^k + a sin(w x + p) with x = t - o."""


_POWERS = 5


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
        sine, cosine = math.sin(w * x + shape[8]), math.cos(w * x + shape[8])
        value, slope, bend = value + a * sine, slope + a * w * cosine, bend - a * w * w * sine
    return value, slope, bend


class Piece(NamedTuple):
    """One piece of a program: begin (s), and the other numbers as in `Pieces`; `powers` c0 to c4, `wave` a, w, p.

    A piece is monotone, except for a wave.
    """

    begin: float
    closed: bool
    origin: float
    powers: tuple[float, ...]
    wave: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Program:
    """A function of time.

    Attributes
    ----------
    pieces : tuple of Piece
        In the order of time; the first begins at -inf.
    """

    pieces: tuple[Piece, ...]

    @cached_property
    def _table(self) -> Pieces:
        """`Pieces` of this program alone."""
        return table_of([self])

    @cached_property
    def _rows(self) -> Any:
        """`_table` as lists: Python reads their numbers faster than those of arrays."""
        return Pieces(*(array.tolist() for array in self._table))

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, slope (1/s) and curvature (1/s^2) at a time (s); at a break, the derivatives are those of the piece that is
        closed there.
        """
        return program_at(self._rows, 0, float(t))

    def over(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values and slopes (1/s) at times (n,), s; the same numbers as those of `at`."""
        pieces, count = self._table, len(self.pieces)
        low = np.searchsorted(pieces.begin, times, side="left") - 1  # the last piece that begins before the time
        after = np.minimum(low + 1, count - 1)
        low = np.where((pieces.begin[after] == times) & (pieces.closed[after] == 1), after, low)
        if np.any(pieces.shape[low, 6]):
            found = np.array([self.at(t)[:2] for t in times.tolist()]).reshape(-1, 2)
            return found[:, 0], found[:, 1]
        rows = pieces.shape[low].T
        x, value, slope = times - rows[0], np.zeros(len(times)), np.zeros(len(times))
        for k in range(_POWERS, 0, -1):
            slope = slope * x + value
            value = value * x + rows[k]
        return value, slope

    def breaks(self) -> tuple[float, ...]:
        """Times at which the function is not smooth, s."""
        return tuple(piece.begin for piece in self.pieces[1:])

    def peaks(self) -> tuple[float, ...]:
        """Times (s) among which the function has its largest magnitude; of a line without end, where it is 1."""
        found = list(self.breaks())
        for begin, _, origin, powers, (a, w, p) in self.pieces:
            if a:  # the first extreme after the begin
                x = (math.floor((w * (begin - origin) + p) / math.pi - 0.5) + 1.5) * math.pi - p
                found.append(origin + x / w)
            elif len(self.pieces) == 1 and any(powers[1:]):
                found.append(origin + (1.0 - powers[0]) / powers[1])
        return tuple(found)

    def scaled(self, by: float) -> Self:
        """The function times a factor."""
        return self._with(
            piece._replace(powers=tuple(by * c for c in piece.powers), wave=(by * piece.wave[0], *piece.wave[1:]))
            for piece in self.pieces
        )

    def integral(self) -> Self:
        """Integral from t = 0, s times the unit of the function, whose pieces have powers up to c3.

        Raises
        ------
        ValueError
            A piece has a power above c3.
        """
        found: list[Piece] = []
        for begin, closed, origin, powers, (a, w, p) in self.pieces:
            summed = (0.0, *(c / (k + 1.0) for k, c in enumerate(powers)))
            wave = (a / w, w, p - 0.5 * math.pi) if a else (0.0, 0.0, 0.0)
            piece = Piece(begin, closed, origin, summed, wave)
            if found:
                alone = Program((piece._replace(begin=-math.inf),))
                piece = _raised(piece, Program((*found,)).at(begin)[0] - alone.at(begin)[0])
            found.append(piece)
        zero = Program((*found,)).at(0.0)[0]
        return self._with(_raised(piece, -zero) for piece in found)

    def _with(self, pieces: Any) -> Self:
        return replace(self, pieces=tuple(pieces))


def table_of(programs: Sequence[Program]) -> Pieces:
    """Arrays of several programs for kernels."""
    flat = [piece for program in programs for piece in program.pieces]
    if any(len(piece.powers) > _POWERS for piece in flat):
        raise ValueError(f"a piece has more than {_POWERS} powers")
    shape = np.zeros((len(flat), SHAPE))
    for row, piece in zip(shape, flat, strict=True):
        row[0], row[1 : 1 + len(piece.powers)], row[6:] = piece.origin, piece.powers, piece.wave
    first = np.cumsum([0, *(len(program.pieces) for program in programs)], dtype=np.int64)
    closed = np.array([piece.closed for piece in flat], dtype=np.int64)
    return Pieces(first, np.array([piece.begin for piece in flat], dtype=float), closed, shape)


def _raised(piece: Piece, by: float) -> Piece:
    return piece._replace(powers=(piece.powers[0] + by, *piece.powers[1:]))


def rest(begin: float, value: float, closed: bool = True) -> Piece:
    """Constant piece."""
    return Piece(begin, closed, 0.0 if math.isinf(begin) else begin, (value,))


_ZERO = rest(-math.inf, 0.0)
CONSTANT = Program((rest(-math.inf, 1.0),))
"""Factor 1."""


def ramp(end: float = 1.0, start: float = 0.0) -> Program:
    """Linear ramp from 0 at `start` (s) to 1 at `end`; its slope is that of the piece before a break."""
    rising = Piece(start, False, start, (0.0, 1.0 / (end - start)))
    return Program((_ZERO, rising, rest(end, 1.0, closed=False)))


def half_sine(duration: float, start: float = 0.0) -> Program:
    """Half-sine pulse sin(pi (t - start)/duration) within the duration, zero elsewhere; times in s."""
    pulse = Piece(start, False, start, (0.0,), (1.0, math.pi / duration, 0.0))
    return Program((_ZERO, pulse, rest(start + duration, 0.0, closed=False)))


def rectangle(duration: float, start: float = 0.0) -> Program:
    """Rectangular pulse: 1 for the duration, 0 elsewhere; times in s."""
    return Program((_ZERO, rest(start, 1.0, closed=False), rest(start + duration, 0.0, closed=False)))


def sampled(time: Sequence[float], value: Sequence[float]) -> Program:
    """Measured pulse: linear between samples (time in s, value), 0 outside."""
    samples = pairwise(zip(time, value, strict=True))
    lines = [Piece(a, False, a, (y, (z - y) / (b - a))) for (a, y), (b, z) in samples]
    return Program((_ZERO, *lines, rest(time[-1], 0.0, closed=False)))
