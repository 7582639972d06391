"""Functions of time that multiply forces and motions, as pieces that kernels evaluate (`fsm.kernels.pieces`).

Functions are continuous from the left. A function that jumps from zero at t = 0 still has the value zero there. An initial
state at rest is therefore in equilibrium.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np

from fsm.kernels.pieces import SHAPE, Pieces, program_at

__all__ = ["Constant", "HalfSine", "Piecewise", "Ramp", "Rectangle", "SampledPulse", "TimeFunction", "programs_of"]

_Piece = tuple[float, float, tuple[float, ...]]
"""Start of a piece (s), and the numbers of its shape: the origin (s), then the others; see `fsm.kernels.pieces.SHAPE`."""
_ZERO: _Piece = (-math.inf, 0.0, (0.0,))


class TimeFunction(Protocol):
    """Protocol of a dimensionless factor as a function of time."""

    def at(self, t: float) -> tuple[float, float, float]:
        """Value (-), slope (1/s) and curvature (1/s^2) at t."""
        ...

    def breaks(self) -> tuple[float, ...]:
        """Times at which the function is not smooth, s."""
        ...


class Piecewise(ABC):
    """Function of time in pieces, as a base class."""

    @abstractmethod
    def pieces(self) -> list[_Piece]:
        """Pieces in the order of time; the first begins at -inf."""

    def at(self, t: float) -> tuple[float, float, float]:
        """See `TimeFunction`."""
        value, slope, curvature = program_at(self.program, 0, float(t))
        return value, slope, curvature

    def breaks(self) -> tuple[float, ...]:
        """See `TimeFunction`."""
        return tuple(begin for begin, _, _ in self.pieces()[1:])

    @cached_property
    def program(self) -> Pieces:
        """Program of one function."""
        pieces = self.pieces()
        shape = np.zeros((len(pieces), SHAPE))
        for row, (_, origin, numbers) in zip(shape, pieces, strict=True):
            row[0], row[1 : 1 + len(numbers)] = origin, numbers
        begin = np.array([piece[0] for piece in pieces], dtype=float)
        return Pieces(np.array([0, len(pieces)]), begin, np.zeros(len(pieces), dtype=np.int64), shape)


@dataclass(frozen=True)
class Constant(Piecewise):
    """Constant value."""

    value: float = 1.0

    def pieces(self) -> list[_Piece]:
        """See `Piecewise`."""
        return [(-math.inf, 0.0, (self.value,))]


@dataclass(frozen=True)
class Ramp(Piecewise):
    """Linear ramp from 0 at `start` (s) to 1 at `end`, for the increments of a static solution."""

    end: float = 1.0
    start: float = 0.0

    def pieces(self) -> list[_Piece]:
        """See `Piecewise`."""
        return [_ZERO, (self.start, self.start, (0.0, 1.0 / (self.end - self.start))), (self.end, self.end, (1.0,))]


@dataclass(frozen=True)
class HalfSine(Piecewise):
    """Half-sine pulse sin(pi (t - start)/duration) within the duration, zero elsewhere; times in s."""

    duration: float
    start: float = 0.0

    def pieces(self) -> list[_Piece]:
        """See `Piecewise`."""
        wave = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0, math.pi / self.duration, 0.0)
        return [_ZERO, (self.start, self.start, wave), (self.start + self.duration, 0.0, (0.0,))]


@dataclass(frozen=True)
class Rectangle(Piecewise):
    """Rectangular pulse: 1 for the duration, 0 elsewhere; times in s."""

    duration: float
    start: float = 0.0

    def pieces(self) -> list[_Piece]:
        """See `Piecewise`."""
        return [_ZERO, (self.start, 0.0, (1.0,)), (self.start + self.duration, 0.0, (0.0,))]


@dataclass(frozen=True)
class SampledPulse(Piecewise):
    """Measured pulse: linear between samples (time in s, value), 0 outside."""

    time: tuple[float, ...]
    value: tuple[float, ...]

    def pieces(self) -> list[_Piece]:
        """See `Piecewise`."""
        samples = pairwise(zip(self.time, self.value, strict=True))
        lines = [(a, a, (y, (z - y) / (b - a))) for (a, y), (b, z) in samples]
        return [_ZERO, *lines, (self.time[-1], 0.0, (0.0,))]


def programs_of(functions: Sequence[TimeFunction]) -> Pieces | None:
    """Programs of several functions; None if one of the functions has no program (`Piecewise.program`)."""
    found = [program for function in functions if (program := getattr(function, "program", None)) is not None]
    if len(found) < len(functions):
        return None
    first = np.cumsum([0, *(len(program.begin) for program in found)], dtype=np.int64)
    none = Pieces(first, np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, SHAPE)))
    return Pieces(first, *(np.concatenate(parts) for parts in list(zip(none, *found, strict=True))[1:]))
