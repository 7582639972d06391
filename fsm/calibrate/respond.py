"""Force-displacement curves of a case at given travels, with derivatives if wanted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from fsm.calibrate.sensitivity import PathSensitivity, vary
from fsm.compile_case import path_settings
from fsm.errors import CaseError, Fault
from fsm.scene.builders.scene import build_scene
from fsm.scene.case import Case
from fsm.scene.method_selection import automatic_method
from fsm.scene.scene import Scene
from fsm.segments.compile import compile_scene
from fsm.segments.hysteresis import HysteresisGroup
from fsm.segments.system import SegmentSystem
from fsm.solve.newton import equilibrium
from fsm.solve.static import follow

__all__ = ["Peak", "Response", "peak_of", "peak_response", "respond"]


_BACK = 10
"""States before the peak that derivatives begin at, where rates matter; doubled until the beginning is forgotten."""
_FORGOTTEN = 1e-10
"""Part of the first derivatives that may be left."""


@dataclass(frozen=True)
class Response:
    """Force of the first drive along its travel.

    Attributes
    ----------
    travel : (n,) array, m
    force : (n,) array, N
    jacobian : (n, p) array or None
        d(force)/d(parameter), N over the SI unit of each; not a number where the structure snaps.
    """

    travel: np.ndarray
    force: np.ndarray
    jacobian: np.ndarray | None = None


@dataclass(frozen=True)
class Peak:
    """Largest force (N), its travel (m), and its gradient (p,)."""

    force: float
    travel: float
    gradient: np.ndarray | None = None


def respond(
    case: Case,
    travel: np.ndarray,
    parameters: Sequence[str] = (),
    derivative: Literal["forward", "adjoint"] = "forward",
) -> Response:
    """Follow the equilibria of a case through given travels of its first drive.

    Parameters
    ----------
    case : Case
    travel : (n,) array, m
        Increasing, from 0 at the least to the drive's travel at most.
    parameters : dotted paths of numbers of the case
    derivative : str
        "adjoint" has the same result at the cost of one solve a state, and is for cases without dampers and friction.

    Raises
    ------
    CaseError
        No drive, another method than statics, a path without a number, travels out of range.
    NotConverged
        The path could not be followed.
    """
    scene, system = _system(case, parameters)
    travel = np.asarray(travel, dtype=float)
    path = _follow(case, system, travel)
    force = np.array([path.force[row] for row in path.rows])
    if not parameters:
        return Response(travel, force)
    sensitivity = PathSensitivity(system, vary(case, scene, system, parameters))
    if derivative == "adjoint":
        jacobian = np.array([sensitivity.adjoint(*path.at(row))[0] for row in path.rows])
    else:
        jacobian = path.derivatives(sensitivity, 0, path.rows, len(parameters))[0]
    return Response(travel, force, jacobian)


def peak_response(case: Case, travel: np.ndarray, parameters: Sequence[str]) -> Peak:
    """Largest force of a case along given travels, and its gradient; arguments as in `respond`.

    Derivatives are worked out for the states around the peak alone. Where rates matter, they begin so many states before
    that what is left of the first ones' is below 1e-10 of the result.
    """
    scene, system = _system(case, parameters)
    travel = np.asarray(travel, dtype=float)
    path = _follow(case, system, travel)
    force = np.array([path.force[row] for row in path.rows])
    peak = peak_of(Response(travel, force))
    at = int(np.argmax(force))
    rows = path.rows[max(at - 1, 0) : at + 2]
    varied = vary(case, scene, system, parameters)
    back = _BACK if system.rate_dependent else 0
    while True:
        first = max(rows[0] - back, 0)
        near, left = path.derivatives(PathSensitivity(system, varied), first, rows, len(parameters))
        if first == 0 or back == 0 or left < _FORGOTTEN:
            break
        back *= 2
    jacobian = np.full((len(travel), len(parameters)), np.nan)
    jacobian[max(at - 1, 0) : at + 2] = near
    return Peak(peak.force, peak.travel, peak_of(Response(travel, force, jacobian)).gradient)


def peak_of(response: Response) -> Peak:
    """Largest force of a response: of the parabola through the largest value and its neighbours.

    By the envelope theorem the gradient is that of the force at the travel of the peak, held fixed: the three rows with the
    weights of Lagrange's interpolation. At an end of the curve it is that of the end itself.
    """
    x, force = response.travel, response.force
    at = int(np.argmax(force))
    if at in (0, len(x) - 1):
        gradient = None if response.jacobian is None else response.jacobian[at]
        return Peak(float(force[at]), float(x[at]), gradient)
    near = slice(at - 1, at + 2)
    a, b, c = x[near]
    first, second = (force[at] - force[at - 1]) / (b - a), (force[at + 1] - force[at]) / (c - b)
    bend = (second - first) / (c - a)
    top = 0.5 * (a + b) - 0.5 * first / bend if bend < 0.0 else b
    weights = np.array([
        (top - b) * (top - c) / ((a - b) * (a - c)), (top - a) * (top - c) / ((b - a) * (b - c)),
        (top - a) * (top - b) / ((c - a) * (c - b)),
    ])  # fmt: skip
    gradient = None if response.jacobian is None else weights @ response.jacobian[near]
    return Peak(float(weights @ force[near]), float(top), gradient)


@dataclass
class _Path:
    """All states of a path: time, configuration, memory, force of the first drive; the rows that were asked for."""

    system: SegmentSystem
    times: np.ndarray
    state: list[tuple[float, np.ndarray, np.ndarray]] = field(default_factory=list)
    force: list[float] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)

    def take(self, t: float, q: np.ndarray) -> None:
        """A state was reached."""
        if len(self.rows) < len(self.times) and self.times[len(self.rows)] <= t + 1e-9 * self.times[-1]:
            self.rows.append(len(self.state))
        before = u = None
        if self.state and self.system.rate_dependent:
            before = self.state[-1][:2]
            u = self.system.difference(before[1], q) / (t - before[0])
        self.force.append(float(self.system.balance(t, q, u, before)[1][0]))
        self.state.append((t, q.copy(), self.system.memory()))

    def at(self, row: int) -> tuple[float, np.ndarray]:
        """Time and configuration of a state, whose memory the system takes."""
        t, q, memory = self.state[row]
        if len(memory):
            self.system.restore(memory)
        return t, q

    def derivatives(
        self, sensitivity: PathSensitivity, first: int, rows: Sequence[int], count: int
    ) -> tuple[np.ndarray, float]:
        """d(force)/d(parameter) (rows, count), from state `first` on; what is left of the first ones'."""
        jacobian = np.full((len(rows), count), np.nan)
        for row in range(first, rows[-1] + 1):
            found = sensitivity.advance(*self.at(row), row in rows)
            if found is not None:
                jacobian[rows.index(row)] = found[0]
        scale = float(np.abs(sensitivity.change).max(initial=0.0))
        return jacobian, float(np.abs(sensitivity.doubt).max(initial=0.0)) / scale if scale > 0.0 else 0.0


def _follow(case: Case, system: SegmentSystem, travel: np.ndarray) -> _Path:
    motion = system.motions[0]
    room = 1e-9 * motion.travel
    if not len(travel) or np.any(np.diff(travel) <= 0.0) or travel[0] < -room or travel[-1] > motion.travel + room:
        text = f"travels must increase from 0 to at most {1e3 * motion.travel:.6g} mm, where the drive ends; raise it"
        raise CaseError(Fault("drive.0.travel", text))
    times = np.array([motion.time_of(float(s)) if s > room else 0.0 for s in travel])
    start = _start(case, system)
    path = _Path(system, times)
    path.take(0.0, start[1])
    if times[-1] > 0.0:
        settings = path_settings(case, system, float(times[-1]))
        follow(system, settings, times.tolist(), lambda saved: None, lambda end: path.take(end.time, end.q), start)
    return path


def _start(case: Case, system: SegmentSystem) -> tuple[float, np.ndarray, np.ndarray]:
    """The state as given, or of a strip the equilibrium near it."""
    q, u = system.initial()
    if case.strip is not None and np.abs(system.force(0.0, q, u)).max(initial=0.0) >= 1e-9:
        q = equilibrium(system, q, np.array([0.0]))
    return 0.0, q, u


def _system(case: Case, parameters: Sequence[str]) -> tuple[Scene, SegmentSystem]:
    scene = build_scene(case)
    system = compile_scene(scene, case.solve.spatial)
    if not system.motions:
        raise CaseError(Fault("drive", "there is none, and so no force to compare; give a [[drive]]"))
    if parameters and scene.friction is not None and scene.friction.law == "lugre":
        raise CaseError(Fault("friction.law", 'derivatives do not go through bristles ("lugre"); take "step" or "tanh"'))
    if parameters and any(isinstance(group, HysteresisGroup) for group in system.groups):
        text = "derivatives do not go through creases with hysteresis, which remember their way; take elastic ones"
        raise CaseError(Fault("crease", text))
    method = automatic_method(scene)[0] if case.solve.method == "auto" else case.solve.method
    if method != "static":
        raise CaseError(Fault("solve.method", f'is "{method}"; forces at given travels are those of statics, take "static"'))
    return scene, system
