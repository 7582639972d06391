"""Pieces of programs of loads and drives, for kernels; see `fsm.kernels.pieces`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fsm.kernels.pieces import SHAPE, Pieces
from fsm.scene.time_program import Constant, Cycle, Ramp, TimeFunction, end_of
from fsm.segments.drive import Parts, Program, RunUp, Timed
from fsm.segments.time_function import cubic_pieces, factor, rows_of

__all__ = ["of_function", "of_program", "pieces_of"]


@dataclass(frozen=True)
class _Piece:
    """One piece; see `Pieces`."""

    begin: float
    closed: bool
    origin: float
    powers: tuple[float, ...]
    wave: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def scaled(self, by: float) -> _Piece:
        """The piece times a factor."""
        return replace(self, powers=tuple(by * c for c in self.powers), wave=(by * self.wave[0], *self.wave[1:]))

    def raised(self, by: float) -> _Piece:
        """The piece plus a constant."""
        return replace(self, powers=(self.powers[0] + by, *self.powers[1:]))


def pieces_of(programs: Sequence[list[_Piece]]) -> Pieces:
    """Arrays of several programs."""
    flat = [piece for program in programs for piece in program]
    shape = np.zeros((len(flat), SHAPE))
    for row, piece in zip(shape, flat, strict=True):
        row[0], row[1 : 1 + len(piece.powers)], row[6:] = piece.origin, piece.powers, piece.wave
    first = np.cumsum([0, *(len(program) for program in programs)], dtype=np.int64)
    closed = np.array([piece.closed for piece in flat], dtype=np.int64)
    return Pieces(first, np.array([piece.begin for piece in flat], dtype=float), closed, shape)


def _rest(begin: float, value: float, closed: bool = True) -> _Piece:
    return _Piece(begin, closed, 0.0 if math.isinf(begin) else begin, (value,))


def of_function(function: TimeFunction) -> list[_Piece]:
    """Pieces of `fsm.segments.time_function.factor` with its derivatives; the pieces have the same value on both sides of a
    break.
    """
    if isinstance(function, Constant):
        return [_rest(-math.inf, 1.0)]
    if isinstance(function, Ramp):
        length = function.end - function.start
        if function.shape == "unbounded":
            return [_Piece(-math.inf, True, function.start, (0.0, 1.0 / length))]
        linear = function.shape == "linear"
        powers = (0.0, 1.0 / length) if linear else (0.0, 0.0, 3.0 / length**2, -2.0 / length**3)
        rising = _Piece(function.start, linear, function.start, powers)
        return [_rest(-math.inf, 0.0), rising, _rest(function.end, 1.0)]
    if isinstance(function, Cycle):
        speed, pulsating = 2.0 * math.pi / function.period, function.form == "pulsating"
        wave = (0.5, speed, -0.5 * math.pi) if pulsating else (1.0, speed, 0.0)
        moving = _Piece(function.start, True, function.start, (0.5 if pulsating else 0.0,), wave)
        end = end_of(function)
        after = [] if end is None else [_rest(end, factor(function, end), closed=False)]
        return [_rest(-math.inf, 0.0), moving, *after]
    time, value = rows_of(function)
    if function.interpolation == "smooth":
        cubics = cubic_pieces(function)
    else:
        cubics = np.array([value[:-1], np.diff(value) / np.diff(time)])
    moving_pieces = [
        _Piece(begin, True, begin, tuple(powers)) for begin, powers in zip(time.tolist(), cubics.T.tolist(), strict=False)
    ]
    return [_rest(-math.inf, float(value[0])), *moving_pieces, _rest(float(time[-1]), float(value[-1]))]


def of_program(program: Program) -> list[_Piece] | None:
    """Pieces of a program of a drive; None for a program of another kind."""
    if isinstance(program, RunUp):
        start, speed = program.run_up_time, program.speed
        rising = _Piece(0.0, True, 0.0, (0.0, 0.0, 0.0, speed / start**2, -0.5 * speed / start**3)) if start else None
        steady = _Piece(start, True, start, (program.run_up, speed))
        found = [_rest(-math.inf, 0.0), rising, steady, _rest(program.end_time, program.travel, closed=False)]
        return [piece for piece in found if piece is not None]
    if isinstance(program, Timed):
        return [piece.scaled(program.amount) for piece in of_function(program.function)]
    if not isinstance(program, Parts):
        return None
    pieces = [_rest(-math.inf, 0.0)]
    reached = 0.0
    for k, (begin, sign, part) in enumerate(program.parts):
        own = of_program(part)
        if own is None:
            return None
        end = program.parts[k + 1][0] if k + 1 < len(program.parts) else math.inf
        start = part.at(0.0)[0]
        for piece in own:
            moved = replace(
                piece.scaled(sign).raised(reached - sign * start),
                begin=begin + max(piece.begin, 0.0), closed=piece.closed or piece.begin < 0.0, origin=begin + piece.origin,
            )  # fmt: skip
            if moved.begin < end:
                pieces.append(moved)
        reached += sign * (part.at(end - begin)[0] - start) if end < math.inf else 0.0
    return pieces
