"""Prescribed motions of bodies: along a line or about an axis, with a run-up or by a program over time.

Functions of time of a case as programs of pieces (`fsm.kernels.programs`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.case.models.joint_motor import SlideMotor, TurnMotor
from fsm.case.models.loads import Drive
from fsm.case.models.time_program import Constant, Cycle, Ramp, Table, TimeFunction, end_of
from fsm.errors import CaseError, Fault
from fsm.kernels.interpolation import hermite_cubic, monotone_slopes
from fsm.kernels.programs import CONSTANT, Piece, Program, rest


def time_function(function: TimeFunction | None) -> Program:
    """Program of a function of time; None is the constant 1. Its pieces have the same value on both sides of a break."""
    if function is None or isinstance(function, Constant):
        return CONSTANT
    if isinstance(function, Ramp):
        return _ramp(function)
    return _cycle(function) if isinstance(function, Cycle) else _table(function)


def motor_program(motor: TurnMotor | SlideMotor) -> Program:
    """Coordinate from the start on, of a motor that prescribes it."""
    if motor.way is not None:
        return time_function(motor.time).scaled(motor.way)
    assert motor.speed is not None
    return time_function(motor.time).scaled(motor.speed).integral()


def _ramp(function: Ramp) -> Program:
    start, length = function.start, function.end - function.start
    if function.shape == "unbounded":
        return Program((Piece(-math.inf, True, start, (0.0, 1.0 / length)),))
    linear = function.shape == "linear"
    powers = (0.0, 1.0 / length) if linear else (0.0, 0.0, 3.0 / length**2, -2.0 / length**3)
    return Program((rest(-math.inf, 0.0), Piece(start, linear, start, powers), rest(function.end, 1.0)))


def _cycle(function: Cycle) -> Program:
    start, speed = function.start, 2.0 * math.pi / function.period
    middle, wave = 0.0, (1.0, speed, 0.0)
    if function.form == "pulsating":
        middle, wave = 0.5, (0.5, speed, -0.5 * math.pi)
    moving = Program((rest(-math.inf, 0.0), Piece(start, True, start, (middle,), wave)))
    end = end_of(function)
    return moving if end is None else Program((*moving.pieces, rest(end, moving.at(end)[0], closed=False)))


def _table(function: Table) -> Program:
    time, value = np.asarray(function.time, dtype=float), np.asarray(function.value, dtype=float)
    if function.interpolation == "smooth":  # without overshoot (Fritsch and Carlson, 1980), at rest at both ends
        rates = np.zeros(len(time))
        if len(time) > 2:
            rates[1:-1] = monotone_slopes(time, value)[1:-1]
        powers = hermite_cubic(time, value, rates).coefficients[::-1]
    else:
        powers = np.array([value[:-1], np.diff(value) / np.diff(time)])
    pieces = [Piece(begin, True, begin, tuple(row)) for begin, row in zip(time.tolist(), powers.T.tolist(), strict=False)]
    return Program((rest(-math.inf, float(value[0])), *pieces, rest(float(time[-1]), float(value[-1]))))


_SAME = 1e-12
"""Difference of travels that is round-off, relative to the whole travel."""
_NO_RUN_UP = 1e-15
_ITERATIONS = 100


@dataclass(frozen=True)
class Travel(Program):
    """Travel (m) or turn (rad) as a function of time.

    Attributes
    ----------
    forward : bool
        Whether it is a pull with run-up: it does not reverse and does not stop before its end, so that the travel can be the
        parameter of a path.
    """

    forward: bool = False

    @property
    def end_time(self) -> float:
        """Time at which the motion is complete, s."""
        return max(self.breaks(), default=0.0)

    @property
    def speed(self) -> float:
        """Largest speed, m/s or rad/s."""
        return max(abs(self.at(t)[1]) for t in self._turning[0])

    @property
    def travel(self) -> float:
        """Distance travelled in the whole motion, m or rad."""
        return float(self._turning[2][-1])

    def gone(self, t: float) -> float:
        """Distance travelled until a time (s), m or rad."""
        times, values, gone = self._turning
        k = int(np.searchsorted(times, t, side="right")) - 1
        return 0.0 if k < 0 else float(gone[k] + abs(self.at(t)[0] - values[k]))

    def time_of(self, travel: float) -> float:
        """Time at which a distance has been travelled, s; the inverse of `gone`."""
        times, values, gone = self._turning
        k = int(np.searchsorted(gone, travel - _SAME * self.travel))
        if k == 0 or k == len(gone) or gone[k] - travel <= _SAME * self.travel:
            return float(times[min(k, len(times) - 1)])
        low, high = float(times[k - 1]), float(times[k])
        sense = 1.0 if values[k] > values[k - 1] else -1.0
        wanted = travel + (sense * float(values[k - 1]) - float(gone[k - 1]))
        t = low + (wanted - sense * float(values[k - 1])) / (float(gone[k] - gone[k - 1])) * (high - low)
        for _ in range(_ITERATIONS):  # Newton's method within bounds
            value, slope, _ = self.at(t)
            off = sense * value - wanted
            low, high = (t, high) if off < 0.0 else (low, t)
            step = off / (sense * slope) if slope else math.inf
            last, t = t, t - step if low <= t - step <= high else 0.5 * (low + high)
            if abs(t - last) <= 1e-15 * abs(t):
                break
        return t

    def reversals(self) -> list[float]:
        """Times at which the motion reverses, s."""
        times, values, _ = self._turning
        change = np.diff(values)
        way = np.where(np.abs(change) > _SAME * self.travel, np.sign(change), 0.0)
        return [float(t) for t in times[1:-1][way[1:] * way[:-1] < 0.0]]

    @cached_property
    def _turning(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times of all breaks, extremes and largest slopes, values there, and distances travelled until then."""
        found = [np.array(self.breaks() or (0.0,))]
        ends = [*self.breaks(), math.inf]
        for (begin, _, origin, powers, (a, w, p)), end in zip(self.pieces, ends, strict=True):
            if math.isinf(begin) or math.isinf(end):
                continue
            places = np.zeros(0)
            if a:
                first, last = ((w * (t - origin) + p) / (0.5 * math.pi) for t in (begin, end))
                places = origin + (np.arange(math.ceil(first), last + 1.0) * 0.5 * math.pi - p) / w
            elif len(powers) == 4 and powers[3]:
                places = np.array([origin - powers[2] / (3.0 * powers[3])])
            near = _SAME * (end - begin)
            found.append(places[(places > begin + near) & (places < end - near)])
        times = np.unique(np.concatenate(found))
        values = np.array([self.at(t)[0] for t in times.tolist()])
        return times, values, np.cumsum(np.abs(np.diff(values, prepend=values[:1])))


def run_up(speed: float, travel: float, over: float) -> Travel:
    """Smooth run-up, constant speed, then rest.

    The speed (m/s or rad/s) rises as x^2 (3 - 2x) over the travel `over`, so it has a continuous derivative, and the start
    causes no shock. `travel` is the whole way, m or rad; a run-up within its round-off is none.
    """
    over = over if over > _NO_RUN_UP * travel else 0.0
    start = 2.0 * over / speed
    rising = [Piece(0.0, True, 0.0, (0.0, 0.0, 0.0, speed / start**2, -0.5 * speed / start**3))] if start else []
    steady = Piece(start, True, start, (over, speed))
    end = rest(start + (travel - over) / speed, travel, closed=False)
    return Travel((rest(-math.inf, 0.0), *rising, steady, end), forward=True)


def parts(programs: Sequence[tuple[float, float, Travel]]) -> Travel:
    """Sequence of programs with their start times; the drive rests before, between and after them.

    Parameters
    ----------
    programs : (time of the begin in s, sign, program) in the order of time
        A program begins with the final travel of the previous program, and ends when the next program begins.
    """
    pieces, reached = [rest(-math.inf, 0.0)], 0.0
    for number, (begin, sign, program) in enumerate(programs):
        end = programs[number + 1][0] if number + 1 < len(programs) else math.inf
        offset = reached - sign * program.at(0.0)[0]
        for piece, after in zip(program.scaled(sign).pieces, [*program.breaks(), math.inf], strict=True):
            if after <= 0.0 or begin + piece.begin >= end:
                continue
            at, closed = begin + max(piece.begin, 0.0), piece.closed or piece.begin < 0.0
            powers = (piece.powers[0] + offset, *piece.powers[1:])
            pieces.append(Piece(at, closed, begin + piece.origin, powers, piece.wave))
        reached = offset + sign * program.at(end - begin)[0]
    return Travel(tuple(pieces))


@dataclass(frozen=True)
class Axis:
    """Fixed axis: unit direction (3,), and a point on it (3,), m."""

    direction: np.ndarray
    point: np.ndarray


@dataclass(frozen=True)
class PrescribedMotion:
    """Motion of one body, or of several bodies together: a translation without rotation, or a turn about a fixed axis.

    Attributes
    ----------
    bodies : (n,) int array
        Indices of the bodies; empty while the drive does not act.
    direction : (2 or 3,) unit vector; zero for a turn
    program : Travel
    axis : Axis, or None for a translation
    """

    bodies: np.ndarray
    direction: np.ndarray
    program: Travel
    axis: Axis | None = None

    @property
    def end_time(self) -> float:
        """Time at which the motion is complete, s."""
        return self.program.end_time

    @property
    def travel(self) -> float:
        """Distance travelled in the whole motion, m or rad."""
        return self.program.travel

    def at(self, t: float) -> tuple[float, float, float]:
        """Travel (m or rad), speed and acceleration at a time (s)."""
        return self.program.at(t)

    def time_of(self, travel: float) -> float:
        """Time at which a distance (m or rad) has been travelled, s."""
        return self.program.time_of(travel)

    def pace(self, reach: float) -> float:
        """Largest speed of a point of the bodies, m/s; `reach` is the size of the structure, m."""
        return self.program.speed * (1.0 if self.axis is None else reach)


def run_up_of(drive: Drive) -> float:
    """Travel or turn over which the speed of a drive rises, m or rad."""
    return 0.01 * drive.size if drive.run_up is None or drive.turn is not None else drive.run_up


def program_of(drive: Drive, path: str = "drive") -> Travel:
    """Program of a drive.

    Raises
    ------
    CaseError
        The program has no end.
    """
    if drive.time is not None:
        if end_of(drive.time) is None:
            raise CaseError(Fault(f"{path}.time.cycles", "is missing; a drive needs an end, so give the number of cycles"))
        return Travel(time_function(drive.time).scaled(drive.size).pieces)
    speed = drive.speed if drive.turn is None else drive.rate
    assert speed is not None
    return run_up(speed, drive.size, run_up_of(drive))


def unit(vector: tuple[float, ...]) -> np.ndarray:
    """Unit vector along a vector."""
    return np.array(vector, dtype=float) / math.hypot(*vector)
