"""Arc-length continuation: the whole equilibrium path, through limit points and back, stable or not.

Configuration and time are unknowns together; time is only the parameter of drives and loads. Steps have a given length
along the path, so drives and loads may decrease along the path. A step from (q_n, t_n) along the unit tangent (x', t')
ends where

    h(t, q) = 0,     x'.x + t' (t - t_n)/T = s

Here x is the increment from q_n divided by span sqrt(n): span is the size of the structure, and n is the number of
degrees of freedom. T is the duration of the step (pseudo-arclength: Keller 1977; Riks 1979). The path is independent of
rates: damping and friction are neglected.

Without contacts, forces of stiff springs and thin facets are unknowns, as in `System.mixed`. A
step begins with first-order predictions of these forces. Steps of thin plates are then longer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fsm.errors import NotConverged
from fsm.solve.equations.equilibrium_step import with_closed_locks
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.equations.newton import equilibrium
from fsm.solve.interface.system import System
from fsm.solve.statics.critical import critical_point

_ITERATIONS = 10
_TOLERANCE = 1e-9
"""Bound of the last Newton step, relative to the span."""
_WANTED = 6
"""Desired number of Newton iterations of a step."""
_AMPLITUDES = (3e-3, 1e-2, 3e-2)
"""Trial amplitudes of the critical mode, relative to the span, for the first point of a branch."""
_TURN = 0.9
"""Smallest cosine between the tangents at the ends of a step; with a sharper turn the step may have jumped to another
branch."""

_FIRST_TO_LIMIT, _LONGEST_TO_LIMIT, _MOST_TO_LIMIT = 1e-2, 0.1, 200
"""First and longest step, and largest number of steps, of the search for a limit point."""


@dataclass(frozen=True)
class PathPoint:
    """An equilibrium on the path.

    Attributes
    ----------
    length : -
        Arc length of the path from the start to this equilibrium.
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
    side : sign of the branch after the first bifurcation; 0: the primary path
    """

    end_time: float
    first: float = 2e-3
    longest: float = 0.02
    max_steps: int = 10_000
    side: float = 0.0


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
    lowest: float | None = None,
    side: float = 0.0,
) -> Iterator[PathPoint]:
    """Equilibria along the path from a given equilibrium, until the time reaches `end` or falls below `lowest`.

    Parameters
    ----------
    system : System
    q : (nq,) array
        Equilibrium at `start`.
    start, end : s
    first, longest : -
        First and longest step along the path. A step of length 1 moves all parts by the span, or covers the whole time.
    max_steps : int
    lowest : s
        Absent: `start`.
    side : -
        Sign of the critical mode along which the path leaves the first bifurcation; 0: the path stays on the primary
        branch.

    Raises
    ------
    NotConverged
        The step is too small, or the number of steps too large.
    """
    tracer = _Tracer(system, start, end)
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
                    f"{point.negative_pivots}); the path may branch there. Add a small disturbing load, or use method = "
                    '"static", which solves a snap with inertia'
                )
            continue
        if side and found[0].negative_pivots > point.negative_pivots:
            turned = tracer.branch(point, found[0].time, side)
            if turned is not None:
                found, side, step = turned, 0.0, first
        point, tangent, iterations = found
        yield point
        if point.time >= end or point.time < (start if lowest is None else lowest):
            return
        step = min(longest, step * float(np.clip(np.sqrt(_WANTED / max(iterations, 1)), 0.5, 2.0)))
    raise NotConverged(
        f"arc-length: more than {max_steps} steps; the path ends at t = {point.time:.6g} s. Raise solve.max_steps"
    )


def limit_point_before(system: System, q: np.ndarray, start: float, end: float) -> bool:
    """Whether the path of equilibria from an equilibrium near a state at `start` (s) has a limit point before `end` (s).

    At a limit point the time has a maximum along the path, so no equilibrium follows for growing loads. Friction and
    dampers are neglected. The result is false if the path cannot be followed.
    """
    latest = start
    try:
        q = equilibrium(system, q, np.array([start]))
        for point in trace(system, q, start, end, _FIRST_TO_LIMIT, _LONGEST_TO_LIMIT, _MOST_TO_LIMIT):
            if point.time < latest:
                return True
            latest = point.time
    except NotConverged:
        pass
    return False


class _Tracer:
    def __init__(self, system: System, start: float, end: float) -> None:
        self.system, self.end = system, end
        self.scale = system.scales().span * np.sqrt(system.nu)
        self.duration = end - start
        self.solver = LinearSolver()
        self.breaks = sorted({*system.break_times(), end})
        self.locks = bool(len(system.locked_rows(start, system.initial()[0])))
        self.mixed, self._depths = system.mixed and system.fixed_pattern, system.depths(0.0)

    def first(self, q: np.ndarray, t: float) -> tuple[PathPoint, _Tangent]:
        """Set the start of the path, and its tangent towards later times."""
        tangent, negative = self._tangent(t, q, None)
        return PathPoint(0.0, t, q, negative), tangent

    def step(
        self, point: PathPoint, tangent: _Tangent, length: float
    ) -> tuple[PathPoint, _Tangent, int] | None:
        """Next point of the path; None if it is not found, or if the tangent rotates too far."""
        found = self._step(point, tangent, length)
        if found is None:
            self.system.lock(0.0)  # back to the multipliers of the last accepted state
        return found

    def _step(
        self, point: PathPoint, tangent: _Tangent, length: float
    ) -> tuple[PathPoint, _Tangent, int] | None:
        """See `step`."""
        # a step towards a time at which loads or drives are not smooth prescribes this time instead of the length
        t = point.time + length * tangent.t * self.duration
        stop = self._break_between(point.time, t)
        hold = stop is not None
        if stop is not None:
            length, t = (stop - point.time) / (tangent.t * self.duration), stop
        dx = length * tangent.x * self.scale
        efforts = self.system.efforts(point.time, point.q, None, dx)
        q = self.system.retract(point.q, dx)
        taken = 0
        for _ in range(_ITERATIONS):
            taken += 1
            residual = self._factorise(t, q, efforts)
            if residual is None:
                return None
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
            self.system.advance_in_time(t, dx, dt)
            efforts = self.system.efforts(t, q, None, dx)
            q, t = self.system.retract(q, dx), t + dt
            if size <= _TOLERANCE and (taken > 1 or not self.locks):
                break
        else:
            return None
        if self.mixed and not self.locks:
            q = with_closed_locks(self.system, self.solver, t, q, efforts, self._depths)
        after, negative = self._tangent(math.nextafter(t, point.time) if hold else t, q, tangent)
        if after.dot(tangent) < _TURN:
            return None
        if hold and t < self.end:
            after = self._beyond(t, q, after)
        return PathPoint(point.length + length, t, q, negative, taken), after, taken

    def branch(self, point: PathPoint, later: float, side: float) -> tuple[PathPoint, _Tangent, int] | None:
        """First point on the branch beyond an equilibrium before a bifurcation; None at a limit point.

        The step has its length along the critical mode (Riks, 1979).
        """
        critical = critical_point(self.system, point.time, point.q, later)
        if not critical.bifurcation:
            return None
        mode = critical.mode / self.scale
        along = _Tangent(math.copysign(1.0, side) / float(np.linalg.norm(mode)) * mode, 0.0)
        for amplitude in _AMPLITUDES:
            found = self.step(point, along, amplitude * float(np.linalg.norm(mode)))
            if found is not None:
                return found
        return None

    def _break_between(self, begin: float, end: float) -> float | None:
        """First of the times between two given times at which loads or drives are not smooth."""
        near = 1e-12 * self.duration
        if end >= begin:
            return next((t for t in self.breaks if begin + near < t <= end), None)
        return next((t for t in reversed(self.breaks) if end <= t < begin - near), None)

    def _beyond(self, t: float, q: np.ndarray, tangent: _Tangent) -> _Tangent:
        """Tangent with the rates of loads and drives beyond a time, in the direction of time in which the path
        arrives.
        """
        found, _ = self._tangent(math.nextafter(t, math.copysign(math.inf, tangent.t)), q, None)
        return found if tangent.t >= 0.0 else _Tangent(-found.x, -found.t)

    def _factorise(self, t: float, q: np.ndarray, efforts: np.ndarray) -> np.ndarray | None:
        """Factorise the stiffness, with given efforts if these are unknowns, and return the force; None if it is not
        finite, as where facets would pass through each other.
        """
        linear = self.system.linearise(t, q, None, None, *((efforts, self._depths) if self.mixed else ()))
        if not np.isfinite(linear.force).all():
            return None
        self.solver.factorise(linear.stiffness)
        return linear.force

    def _tangent(self, t: float, q: np.ndarray, before: _Tangent | None) -> tuple[_Tangent, int]:
        """Unit tangent in the direction of the previous tangent, and the number of negative pivots of K."""
        linear = self.system.linearise(t, q, None)
        self.solver.factorise(linear.stiffness)
        x = self.solver.solve(self.system.force_rate(t, q)) / self.scale * self.duration
        size = float(np.sqrt(x @ x + 1.0))
        tangent = _Tangent(x / size, 1.0 / size)
        if before is not None and tangent.dot(before) < 0.0:
            tangent = _Tangent(-tangent.x, -tangent.t)
        if not self.solver.symmetric:
            self.solver.factorise(linear.stiffness.symmetric())
        return tangent, self.solver.negative_pivots()
