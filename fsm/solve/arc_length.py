"""Arc-length continuation: the whole equilibrium path, through limit points and back, stable or not.

Configuration and time are unknowns together; time is only the parameter of drives and loads. Steps have a given length along
the path, so both may decrease along it. A step from (q_n, t_n) along the unit tangent (x', t') ends where

    h(t, q) = 0,     x'.x + t' (t - t_n)/T = s

Here x is the increment from q_n divided by span sqrt(n): span is the size of the structure, and n is the number of
degrees of freedom. T is the duration of the step (pseudo-arclength: Keller 1977; Riks 1979). The path is independent of
rates: damping and friction are neglected.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fsm.errors import NotConverged
from fsm.solve.linear import LinearSolver
from fsm.system import System

__all__ = ["ArcSettings", "PathPoint", "trace"]

_ITERATIONS = 10
_WANTED = 4
"""Desired number of Newton iterations of a step."""
_TURN = 0.9
"""Least cosine between the tangents at the ends of a step: a sharper turn may be a jump to another branch."""


@dataclass(frozen=True)
class PathPoint:
    """An equilibrium on the path.

    Attributes
    ----------
    length : -
        Arc length from the start.
    time : s
    q : configuration
    negative_pivots : int
        Negative pivots of K; unstable if there are any.
    iterations : int
        Newton iterations for this point.
    """

    length: float
    time: float
    q: np.ndarray
    negative_pivots: int
    iterations: int = 0


@dataclass(frozen=True)
class ArcSettings:
    """Settings of path following by arc length; arguments of `trace`.

    Attributes
    ----------
    end_time : s
    first, longest : -
    max_steps : int
    """

    end_time: float
    first: float = 2e-3
    longest: float = 0.02
    max_steps: int = 10_000


@dataclass
class _Tangent:
    """Unit tangent: scaled increment and time."""

    x: np.ndarray
    t: float

    def dot(self, other: _Tangent) -> float:
        return float(self.x @ other.x) + self.t * other.t


def trace(
    system: System,
    q: np.ndarray,
    start: float,
    end: float,
    first: float,
    longest: float = 0.1,
    max_steps: int = 10_000,
    tolerance: float = 1e-9,
    lowest: float | None = None,
) -> Iterator[PathPoint]:
    """Equilibria along the path from a given one, until the time reaches `end` or falls below `lowest`.

    Parameters
    ----------
    system : System
    q : (nq,) array
        Equilibrium at `start`.
    start, end : s
    first, longest : -
        First and longest step along the path. Length 1: all parts move by the span, or the whole time passes.
    max_steps : int
    tolerance : -
        Bound of the last Newton step, relative to the span.
    lowest : s
        Absent: `start`.

    Raises
    ------
    NotConverged
        The step is too small, or the number of steps too large.
    """
    tracer = _Tracer(system, start, end, tolerance)
    point, tangent = tracer.first(q, start)
    yield point
    step = first
    for _ in range(max_steps):
        found = tracer.step(point, tangent, step)
        if found is None:
            step *= 0.5
            if step < 1e-9:
                raise NotConverged(
                    f"arc-length: no equilibrium found beyond t = {point.time:.6g} s (step {step:.1g}, negative pivots "
                    f"{point.negative_pivots}); the path may branch there. Try a small load across the path, or method = "
                    '"static", which passes a snap with inertia'
                )
            continue
        point, tangent, iterations = found
        yield point
        if point.time >= end or point.time < (start if lowest is None else lowest):
            return
        step = min(longest, step * float(np.clip(np.sqrt(_WANTED / max(iterations, 1)), 0.5, 2.0)))
    raise NotConverged(
        f"arc-length: more than {max_steps} steps; the path ends at t = {point.time:.6g} s. Raise solve.max_steps"
    )


class _Tracer:
    def __init__(self, system: System, start: float, end: float, tolerance: float) -> None:
        self.system, self.end, self.tolerance = system, end, tolerance
        self.scale = system.scales().span * np.sqrt(system.nu)
        self.duration = end - start
        self.solver = LinearSolver()
        self.breaks = sorted({*system.break_times(), end})

    def first(self, q: np.ndarray, t: float) -> tuple[PathPoint, _Tangent]:
        """Start of the path, and its tangent towards later times."""
        tangent, negative = self._tangent(t, q, None)
        return PathPoint(0.0, t, q, negative), tangent

    def step(
        self, point: PathPoint, tangent: _Tangent, length: float
    ) -> tuple[PathPoint, _Tangent, int] | None:
        """Next point; None if it is not found, or if the tangent turns too far."""
        # a step to a time at which loads or drives are not smooth prescribes this time instead of the length
        t = point.time + length * tangent.t * self.duration
        stop = self._break_between(point.time, t)
        hold = stop is not None
        if stop is not None:
            length, t = (stop - point.time) / (tangent.t * self.duration), stop
        q = self.system.retract(point.q, length * tangent.x * self.scale)
        taken = 0
        for _ in range(_ITERATIONS):
            taken += 1
            residual = self._factorise(t, q)
            dx = self.solver.solve(residual)
            dt = 0.0
            if not hold:
                along = self.solver.solve(self.system.force_rate(t, q))
                moved = self.system.difference(point.q, q) / self.scale
                gap = length - float(tangent.x @ moved) - tangent.t * (t - point.time) / self.duration
                slope = float(tangent.x @ (along / self.scale)) + tangent.t / self.duration
                dt = (gap - float(tangent.x @ (dx / self.scale))) / slope
                dx = dx + dt * along
            size = float(np.abs(dx / self.system.scales().span).max(initial=0.0))
            if not np.isfinite(size) or size > 1.0:
                return None
            q, t = self.system.retract(q, dx), t + dt
            if size <= self.tolerance:
                break
        else:
            return None
        after, negative = self._tangent(math.nextafter(t, point.time) if hold else t, q, tangent)
        if after.dot(tangent) < _TURN:
            return None
        if hold and t < self.end:
            after = self._beyond(t, q, after)
        return PathPoint(point.length + length, t, q, negative, taken), after, taken

    def _break_between(self, begin: float, end: float) -> float | None:
        """First of the times at which loads or drives are not smooth, on the way between two times."""
        near = 1e-12 * self.duration
        if end >= begin:
            return next((t for t in self.breaks if begin + near < t <= end), None)
        return next((t for t in reversed(self.breaks) if end <= t < begin - near), None)

    def _beyond(self, t: float, q: np.ndarray, tangent: _Tangent) -> _Tangent:
        """Tangent with the rates of loads and drives beyond a time, in the sense of time in which the path comes there."""
        found, _ = self._tangent(math.nextafter(t, math.copysign(math.inf, tangent.t)), q, None)
        return found if tangent.t >= 0.0 else _Tangent(-found.x, -found.t)

    def _factorise(self, t: float, q: np.ndarray) -> np.ndarray:
        linear = self.system.linearise(t, q, None)
        self.solver.factorise(linear.stiffness)
        return linear.force

    def _tangent(self, t: float, q: np.ndarray, before: _Tangent | None) -> tuple[_Tangent, int]:
        """Unit tangent in the sense of the previous one, and the number of negative pivots of K."""
        linear = self.system.linearise(t, q, None)
        self.solver.factorise(linear.stiffness)
        x = self.solver.solve(self.system.force_rate(t, q)) / self.scale * self.duration
        size = float(np.sqrt(x @ x + 1.0))
        tangent = _Tangent(x / size, 1.0 / size)
        if before is not None and tangent.dot(before) < 0.0:
            tangent = _Tangent(-tangent.x, -tangent.t)
        self.solver.factorise(linear.stiffness.symmetric())
        return tangent, self.solver.negative_pivots()
