"""Force-displacement curves of a case at given travels, with derivatives with respect to parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from fsm.builders.scene import build_scene
from fsm.calibrate.sensitivity import PathSensitivity, vary_parameters
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.case.plan.method_selection import automatic_method
from fsm.errors import CaseError, Fault
from fsm.model.compile.compile import compile_scene
from fsm.model.compile.compile_case import path_settings
from fsm.model.elements.hysteresis import HysteresisGroup
from fsm.model.system.system import SegmentSystem
from fsm.solve.equations.newton import equilibrium
from fsm.solve.outcome.run_io import CurvePoint
from fsm.solve.statics.static import follow
from fsm.text.short_repr import ShortRepr

_FIRST_LOOK_BACK = 10
"""Number of states before the peak at which rate-dependent derivatives begin; doubled until the start error is small."""
_START_ERROR = 1e-10
"""Bound of the relative error at the peak that is due to the derivatives of the first state."""


@dataclass(frozen=True, repr=False)
class Response(ShortRepr):
    """Force of the first drive along its travel.

    Attributes
    ----------
    travel : (n,) array, m
    force : (n,) array, N
    jacobian : (n, p) array or None
        d(force)/d(parameter), N per SI unit of the parameter; NaN in a snap-through.
    """

    travel: np.ndarray
    force: np.ndarray
    jacobian: np.ndarray | None = None


@dataclass(frozen=True, repr=False)
class PeakResponse(ShortRepr):
    """Largest force (N), its travel (m), and its gradient (p,)."""

    force: float
    travel: float
    gradient: np.ndarray | None = None


def force_response(
    case: Case,
    travel: np.ndarray,
    parameters: Sequence[str] = (),
    derivative: Literal["forward", "adjoint"] = "forward",
) -> Response:
    """Force of the first drive at given travels along the equilibrium path of a case.

    Parameters
    ----------
    case : Case
    travel : (n,) array, m
        Increasing travels between 0 and the travel of the drive.
    parameters : dotted paths of numbers of the case
    derivative : str
        "adjoint" gives the same result with one linear solve per state, for cases without dampers and friction.

    Raises
    ------
    CaseError
        The case has no drive or is not static, a path has no number, or a travel is out of range.
    NotConverged
        The equilibrium path could not be followed.
    """
    scene, system = _system(case, parameters)
    travel = np.asarray(travel, dtype=float)
    path = _follow(case, system, travel)
    force = np.array([path.force[row] for row in path.rows])
    if not parameters:
        return Response(travel, force)
    sensitivity = PathSensitivity(system, vary_parameters(case, scene, system, parameters))
    if derivative == "adjoint":
        jacobian = np.array([sensitivity.adjoint(*path.restore(row))[0] for row in path.rows])
    else:
        jacobian = path.derivatives(sensitivity, 0, path.rows, len(parameters))[0]
    return Response(travel, force, jacobian)


def peak_response(case: Case, travel: np.ndarray, parameters: Sequence[str]) -> PeakResponse:
    """Largest force of a case along given travels and its gradient; arguments and errors as in `force_response`.

    Derivatives are computed only for the states around the peak. In a rate-dependent case, derivatives are computed from
    some states earlier, so that the first state changes the result by less than 1e-10.
    """
    scene, system = _system(case, parameters)
    travel = np.asarray(travel, dtype=float)
    path = _follow(case, system, travel)
    force = np.array([path.force[row] for row in path.rows])
    peak = peak_of(Response(travel, force))
    at = int(np.argmax(force))
    rows = path.rows[max(at - 1, 0) : at + 2]
    varied = vary_parameters(case, scene, system, parameters)
    look_back = _FIRST_LOOK_BACK if system.rate_dependent else 0
    while True:
        first = max(rows[0] - look_back, 0)
        near, start_error = path.derivatives(PathSensitivity(system, varied), first, rows, len(parameters))
        if first == 0 or look_back == 0 or start_error < _START_ERROR:
            break
        look_back *= 2
    jacobian = np.full((len(travel), len(parameters)), np.nan)
    jacobian[max(at - 1, 0) : at + 2] = near
    return PeakResponse(peak.force, peak.travel, peak_of(Response(travel, force, jacobian)).gradient)


def peak_of(response: Response) -> PeakResponse:
    """Largest force of a response, from the parabola through the largest value and its neighbours.

    By the envelope theorem its gradient equals the gradient of the force at the fixed travel of the peak. The gradient is
    interpolated from the three rows with Lagrange weights. At an end of the curve the gradient of that end is used.
    """
    x, force = response.travel, response.force
    at = int(np.argmax(force))
    if at in (0, len(x) - 1):
        gradient = None if response.jacobian is None else response.jacobian[at]
        return PeakResponse(float(force[at]), float(x[at]), gradient)
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
    return PeakResponse(float(weights @ force[near]), float(top), gradient)


@dataclass
class _Path:
    """States of an equilibrium path.

    Attributes
    ----------
    system : SegmentSystem
    times : (n,) array, s
        Requested times.
    state : list of (time, configuration, memory of friction and hysteresis)
    force : list of float, N
        Force of the first drive in every state.
    rows : list of int
        Index of the state at every requested time.
    points : list of CurvePoint
        Points that the solver adds before it reports a state.
    """

    system: SegmentSystem
    times: np.ndarray
    state: list[tuple[float, np.ndarray, np.ndarray]] = field(default_factory=list)
    force: list[float] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)
    points: list[CurvePoint] = field(default_factory=list)

    def add_state(self, t: float, q: np.ndarray) -> None:
        """Add the state that the solver reached at time t."""
        if len(self.rows) < len(self.times) and self.times[len(self.rows)] <= t + 1e-9 * self.times[-1]:
            self.rows.append(len(self.state))
        observed = self.points and self.points[-1].time == t  # but not the start
        self.force.append(float(self.points[-1].drive.force[0] if observed else self.system.balance(t, q, None)[1][0]))
        self.state.append((t, q.copy(), self.system.memory()))

    def restore(self, row: int) -> tuple[float, np.ndarray]:
        """Time and configuration of a state; restores its memory in the system."""
        t, q, memory = self.state[row]
        if len(memory):
            self.system.restore(memory)
        return t, q

    def derivatives(
        self, sensitivity: PathSensitivity, first: int, rows: Sequence[int], count: int
    ) -> tuple[np.ndarray, float]:
        """Derivatives d(force)/d(parameter) (rows, count), computed from state `first`, and their relative start error."""
        jacobian = np.full((len(rows), count), np.nan)
        for row in range(first, rows[-1] + 1):
            found = sensitivity.advance(*self.restore(row), row in rows)
            if found is not None:
                jacobian[rows.index(row)] = found[0]
        scale = float(np.abs(sensitivity.derivative).max(initial=0.0))
        return jacobian, float(np.abs(sensitivity.start_error).max(initial=0.0)) / scale if scale > 0.0 else 0.0


def _follow(case: Case, system: SegmentSystem, travel: np.ndarray) -> _Path:
    motion = system.motions[0]
    tolerance = 1e-9 * motion.travel
    if (
        not len(travel)
        or np.any(np.diff(travel) <= 0.0)
        or travel[0] < -tolerance
        or travel[-1] > motion.travel + tolerance
    ):
        text = f"the drive ends at {1e3 * motion.travel:.6g} mm; travels of a test must increase from 0 up to this value"
        raise CaseError(Fault("drive.0.travel", f"{text}; increase the travel if the test has larger displacements"))
    times = np.array([motion.time_of(float(s)) if s > tolerance else 0.0 for s in travel])
    start = _start(case, system)
    path = _Path(system, times)
    path.add_state(0.0, start[1])
    if times[-1] > 0.0:
        settings = path_settings(case, system, float(times[-1]))
        add = lambda end: path.add_state(end.time, end.q)  # noqa: E731
        follow(system, settings, times.tolist(), lambda saved: None, add, start, points=path.points, each_step=True)
    return path


def _start(case: Case, system: SegmentSystem) -> tuple[float, np.ndarray, np.ndarray]:
    """Initial state; for a strip that is not in equilibrium initially, the equilibrium near it."""
    q, u = system.initial()
    if case.strip is not None and np.abs(system.force(0.0, q, u)).max(initial=0.0) >= 1e-9:
        q = equilibrium(system, q, np.array([0.0]))
    return 0.0, q, u


def _system(case: Case, parameters: Sequence[str]) -> tuple[Scene, SegmentSystem]:
    scene = build_scene(case)
    if scene.flexible:
        text = "has films, cables, beams or bars; a calibration follows rigid bodies and their springs only"
        raise CaseError(Fault("scene" if case.sheet is None else "sheet.facets", text))
    system = compile_scene(scene, case.solve.spatial)
    if not system.motions:
        raise CaseError(Fault("drive", "the case has no drive, so there is no force to compare; give a [[drive]]"))
    if parameters and scene.friction is not None and scene.friction.law == "lugre":
        raise CaseError(Fault("friction.law", 'derivatives are not available with "lugre"; use "step" or "tanh"'))
    if parameters and any(isinstance(group, HysteresisGroup) for group in system.groups):
        text = "derivatives are not available for creases with hysteresis, because of their memory; use elastic creases"
        raise CaseError(Fault("crease", text))
    method = automatic_method(scene)[0] if case.solve.method == "auto" else case.solve.method
    if method != "static":
        raise CaseError(Fault("solve.method", f'is "{method}"; a calibration needs the quasi-static method, use "static"'))
    return scene, system
