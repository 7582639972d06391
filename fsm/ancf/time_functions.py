"""Functions of time that multiply forces and motions: value, slope and curvature.

Functions are continuous from the left. A function that jumps from zero at t = 0 still has the value zero there. An initial
state at rest is therefore in equilibrium.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

__all__ = ["Constant", "HalfSine", "Ramp", "Rectangle", "SampledPulse", "TimeFunction"]


class TimeFunction(Protocol):
    """Protocol of a dimensionless factor as a function of time."""

    def at(self, t: float) -> tuple[float, float, float]:
        """Value (-), slope (1/s) and curvature (1/s^2) at t."""
        ...

    def breaks(self) -> tuple[float, ...]:
        """Times at which the function is not smooth, s."""
        ...


@dataclass(frozen=True)
class Constant:
    """Constant value."""

    value: float = 1.0

    def at(self, t: float) -> tuple[float, float, float]:
        """See `TimeFunction`."""
        return self.value, 0.0, 0.0

    def breaks(self) -> tuple[float, ...]:
        """See `TimeFunction`."""
        return ()


@dataclass(frozen=True)
class Ramp:
    """Linear ramp from 0 at `start` (s) to 1 at `end`, for the increments of a static solution."""

    end: float = 1.0
    start: float = 0.0

    def at(self, t: float) -> tuple[float, float, float]:
        """See `TimeFunction`."""
        part = (t - self.start) / (self.end - self.start)
        if part <= 0.0:
            return 0.0, 0.0, 0.0
        return (part, 1.0 / (self.end - self.start), 0.0) if part <= 1.0 else (1.0, 0.0, 0.0)

    def breaks(self) -> tuple[float, ...]:
        """See `TimeFunction`."""
        return self.start, self.end


@dataclass(frozen=True)
class HalfSine:
    """Half-sine pulse sin(pi (t - start)/duration) within the duration, zero elsewhere; times in s."""

    duration: float
    start: float = 0.0

    def at(self, t: float) -> tuple[float, float, float]:
        """See `TimeFunction`."""
        if not self.start < t <= self.start + self.duration:
            return 0.0, 0.0, 0.0
        rate = math.pi / self.duration
        angle = rate * (t - self.start)
        return math.sin(angle), rate * math.cos(angle), -rate * rate * math.sin(angle)

    def breaks(self) -> tuple[float, ...]:
        """See `TimeFunction`."""
        return self.start, self.start + self.duration


@dataclass(frozen=True)
class Rectangle:
    """Rectangular pulse: 1 for the duration, 0 elsewhere; times in s."""

    duration: float
    start: float = 0.0

    def at(self, t: float) -> tuple[float, float, float]:
        """See `TimeFunction`."""
        return (1.0 if self.start < t <= self.start + self.duration else 0.0), 0.0, 0.0

    def breaks(self) -> tuple[float, ...]:
        """See `TimeFunction`."""
        return self.start, self.start + self.duration


@dataclass(frozen=True)
class SampledPulse:
    """Measured pulse: linear between samples (time in s, value), 0 outside."""

    time: tuple[float, ...]
    value: tuple[float, ...]

    def at(self, t: float) -> tuple[float, float, float]:
        """See `TimeFunction`."""
        piece = int(np.searchsorted(self.time, t)) - 1
        if piece < 0 or piece >= len(self.time) - 1:
            return 0.0, 0.0, 0.0
        slope = (self.value[piece + 1] - self.value[piece]) / (self.time[piece + 1] - self.time[piece])
        return self.value[piece] + slope * (t - self.time[piece]), slope, 0.0

    def breaks(self) -> tuple[float, ...]:
        """See `TimeFunction`."""
        return self.time
