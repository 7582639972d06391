"""Prescribed motion along a line: smooth run-up, constant speed, then rest."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

__all__ = ["PrescribedMotion"]


@dataclass(frozen=True)
class PrescribedMotion:
    """Translation of one body, or of several bodies together, without rotation.

    The speed rises as x^2 (3 - 2x) over the travel `run_up`. The velocity is C1, so the start causes no shock.

    Attributes
    ----------
    bodies : (n,) int array
        Indices of the bodies.
    direction : (3,) unit vector
    speed, travel, run_up : m/s, m, m
    """

    bodies: np.ndarray
    direction: np.ndarray
    speed: float
    travel: float
    run_up: float

    @cached_property
    def run_up_time(self) -> float:
        """Time after which the speed is constant, s."""
        return 2.0 * self.run_up / self.speed

    @cached_property
    def end_time(self) -> float:
        """Time at which the travel is complete, s."""
        return self.run_up_time + (self.travel - self.run_up) / self.speed

    def at(self, t: float) -> tuple[float, float, float]:
        """Travel (m), speed (m/s) and acceleration (m/s^2) at a time (s)."""
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
        """Time at which a travel (m) is reached, s."""
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
