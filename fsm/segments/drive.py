"""Prescribed motions of bodies: along a line or about an axis, with a run-up or by a program over time."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from fsm.errors import CaseError, Fault
from fsm.scene.loads import Drive
from fsm.scene.time_program import TimeFunction, end_of
from fsm.segments.time_function import breaks, curvature, factor, slope, turning_points

__all__ = ["Axis", "Parts", "PrescribedMotion", "Program", "RunUp", "Timed", "program_of", "unit"]

_SAMPLES = 4001
"""Number of points at which the travelled distance of a program is computed, besides its turning points."""


class Program(Protocol):
    """Travel (m) or rotation (rad) as a function of time."""

    @property
    def end_time(self) -> float:
        """Time at which the motion is complete, s."""
        ...

    @property
    def speed(self) -> float:
        """Largest speed, m/s or rad/s."""
        ...

    @property
    def travel(self) -> float:
        """Distance travelled in the whole motion, m or rad."""
        ...

    @property
    def forward(self) -> bool:
        """Whether the motion does not reverse and does not stop before its end."""
        ...

    def at(self, t: float) -> tuple[float, float, float]:
        """Travel, speed and acceleration at a time (s)."""
        ...

    def time_of(self, travel: float) -> float:
        """Time at which a distance has been travelled, s."""
        ...

    def gone(self, t: float) -> float:
        """Distance travelled until a time (s), m or rad; the inverse of `time_of`."""
        ...

    def breaks(self) -> tuple[float, ...]:
        """Times at which the motion is not smooth, s."""
        ...

    def sampled(self) -> np.ndarray:
        """Times from the beginning to the end, s, with all breaks and extremes. The motion does not reverse between two of
        these times.
        """
        ...

    def reversals(self) -> list[float]:
        """Times at which the motion reverses, s; exact for the rows of a table."""
        ...


@dataclass(frozen=True)
class RunUp:
    """Smooth run-up, constant speed, then rest.

    The speed rises as x^2 (3 - 2x) over the travel `run_up`. The velocity has a continuous derivative (C1), so the
    start causes no shock.
    """

    speed: float
    travel: float
    run_up: float
    forward = True

    @cached_property
    def run_up_time(self) -> float:
        """Time after which the speed is constant, s."""
        return 2.0 * self.run_up / self.speed

    @cached_property
    def end_time(self) -> float:
        """Time at which the travel is complete, s."""
        return self.run_up_time + (self.travel - self.run_up) / self.speed

    def breaks(self) -> tuple[float, ...]:
        """See `Program`."""
        return (self.run_up_time, self.end_time)

    def sampled(self) -> np.ndarray:
        """See `Program`."""
        return np.unique([*np.linspace(0.0, self.end_time, _SAMPLES), *self.breaks()])

    def reversals(self) -> list[float]:
        """See `Program`; a pull has no reversals."""
        return []

    def gone(self, t: float) -> float:
        """See `Program`."""
        return self.at(t)[0]

    def at(self, t: float) -> tuple[float, float, float]:
        """See `Program`."""
        start = self.run_up_time
        if t < start:
            x = max(t, 0.0) / start
            return (
                self.speed * start * x**3 * (1.0 - 0.5 * x),
                self.speed * x * x * (3.0 - 2.0 * x),
                self.speed * 6.0 * x * (1.0 - x) / start,
            )
        if t <= self.end_time:
            return self.run_up + self.speed * (t - start), self.speed, 0.0
        return self.travel, 0.0, 0.0

    def time_of(self, travel: float) -> float:
        """See `Program`."""
        if travel >= self.run_up:
            return self.run_up_time + (min(travel, self.travel) - self.run_up) / self.speed
        low, high = 0.0, 1.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            if 2.0 * self.run_up * middle**3 * (1.0 - 0.5 * middle) < travel:
                low = middle
            else:
                high = middle
        return high * self.run_up_time


class _Sampled(ABC):
    """Travelled distance and largest speed of a program, from samples over its time."""

    @abstractmethod
    def at(self, t: float) -> tuple[float, float, float]:
        """See `Program`."""

    @abstractmethod
    def sampled(self) -> np.ndarray:
        """See `Program`."""

    @cached_property
    def _samples(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times, travelled distances and speeds."""
        times = self.sampled()
        found = np.array([self.at(float(t))[:2] for t in times])
        gone = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(found[:, 0])))])
        return times, gone, found[:, 1]

    @property
    def travel(self) -> float:
        """See `Program`."""
        return float(self._samples[1][-1])

    def gone(self, t: float) -> float:
        """See `Program`."""
        times, gone, _ = self._samples
        return float(np.interp(t, times, gone))

    def reversals(self) -> list[float]:
        """See `Program`."""
        times, _, _ = self._samples
        way = np.sign(np.diff([self.at(float(t))[0] for t in times]))
        return [float(t) for t in times[1:-1][way[1:] * way[:-1] < 0.0]]

    @cached_property
    def speed(self) -> float:
        """See `Program`."""
        return float(np.abs(self._samples[2]).max(initial=0.0))

    @property
    def forward(self) -> bool:
        """See `Program`; the result is false, so time is the parameter of a path."""
        return False

    def time_of(self, travel: float) -> float:
        """See `Program`."""
        times, gone, _ = self._samples
        k = int(np.searchsorted(gone, travel))
        if k == 0 or k >= len(gone):
            return float(times[min(k, len(gone) - 1)])
        part = (travel - gone[k - 1]) / (gone[k] - gone[k - 1])
        return float(times[k - 1] + part * (times[k] - times[k - 1]))


@dataclass(frozen=True)
class Timed(_Sampled):
    """Product of a function of time with an end, and a travel or turn."""

    function: TimeFunction
    amount: float

    @property
    def end_time(self) -> float:
        """See `Program`."""
        end = end_of(self.function)
        assert end is not None
        return end

    def breaks(self) -> tuple[float, ...]:
        """See `Program`."""
        return breaks(self.function)

    def sampled(self) -> np.ndarray:
        """See `Program`."""
        points = turning_points(self.function)
        return np.unique([*np.linspace(min(0.0, *points), self.end_time, _SAMPLES), *points])

    def at(self, t: float) -> tuple[float, float, float]:
        """See `Program`."""
        of = self.function
        return self.amount * factor(of, t), self.amount * slope(of, t), self.amount * curvature(of, t)


@dataclass(frozen=True)
class Parts(_Sampled):
    """Sequence of programs with their start times; the drive rests before, between and after them.

    Attributes
    ----------
    parts : (time of the begin in s, sign, program) in the order of time
        A program begins with the final travel of the previous program, and ends when the next program begins.
    """

    parts: tuple[tuple[float, float, Program], ...]

    @cached_property
    def end_time(self) -> float:
        """See `Program`."""
        return max((begin + program.end_time for begin, _, program in self.parts[-1:]), default=0.0)

    @cached_property
    def _offsets(self) -> list[float]:
        """Travel at which each program begins."""
        found = [0.0]
        for (begin, sign, program), (end, _, _) in zip(self.parts, self.parts[1:], strict=False):
            found.append(found[-1] + sign * (program.at(end - begin)[0] - program.at(0.0)[0]))
        return found

    def breaks(self) -> tuple[float, ...]:
        """See `Program`."""
        return tuple(begin + t for begin, _, program in self.parts for t in (0.0, *program.breaks()))

    def sampled(self) -> np.ndarray:
        """See `Program`; each program is sampled until the next program begins."""
        found = [np.zeros(0 if self.parts else 1)]
        ends = [*(begin for begin, _, _ in self.parts[1:]), math.inf]
        for (begin, _, program), end in zip(self.parts, ends, strict=True):
            times = begin + program.sampled()
            found += [times[(times >= begin) & (times < end)], np.array([min(end, times[-1])])]
        return np.unique(np.concatenate(found))

    def at(self, t: float) -> tuple[float, float, float]:
        """See `Program`."""
        k = sum(t >= begin for begin, _, _ in self.parts) - 1
        if k < 0:
            return 0.0, 0.0, 0.0
        begin, sign, program = self.parts[k]
        travel, speed, acceleration = program.at(t - begin)
        return self._offsets[k] + sign * (travel - program.at(0.0)[0]), sign * speed, sign * acceleration


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
    program : Program
    axis : Axis, or None for a translation
    """

    bodies: np.ndarray
    direction: np.ndarray
    program: Program
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


def program_of(drive: Drive, path: str = "drive") -> Program:
    """Program of a drive.

    Raises
    ------
    CaseError
        The program has no end.
    """
    if drive.time is not None:
        if end_of(drive.time) is None:
            raise CaseError(Fault(f"{path}.time.cycles", "is missing; a drive needs an end, so give the number of cycles"))
        return Timed(drive.time, drive.size)
    if drive.turn is not None:
        assert drive.rate is not None
        return RunUp(drive.rate, drive.turn, 0.01 * drive.turn)
    assert drive.speed is not None
    run_up = 0.01 * drive.size if drive.run_up is None else drive.run_up
    return RunUp(drive.speed, drive.size, run_up)


def unit(vector: tuple[float, ...]) -> np.ndarray:
    """Unit vector along a vector."""
    return np.array(vector, dtype=float) / math.hypot(*vector)
