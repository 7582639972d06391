"""Force-displacement curves of a case at given travels, with derivatives with respect to parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from fsm.builders.scene import build_scene
from fsm.calibrate.sensitivity import PathSensitivity, VariedParameter, vary_parameters
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.case.plan.method_selection import automatic_method
from fsm.errors import CaseError, Fault
from fsm.model.compile.compile import compile_scene
from fsm.model.compile.compile_case import path_settings
from fsm.model.elements.hysteresis import HysteresisGroup
from fsm.model.system.system import SegmentSystem
from fsm.results.quantities import peak_rows
from fsm.solve.equations.newton import equilibrium
from fsm.solve.outcome.run_io import AcceptedStep, CurvePoint
from fsm.solve.statics.static import follow
from fsm.text.short_repr import ShortRepr

_FIRST_LOOK_BACK = 5
"""Number of states before the peak at which rate-dependent derivatives begin; doubled until the start error is small."""
_UNEVEN = 1.1
"""Ratio of successive steps at a peak above which its derivatives may be inaccurate."""
_START_ERROR = 1e-7
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
    """Largest force (N), its travel (m), its gradient (p,), faults of parameters without derivatives (NaN), and warnings."""

    force: float
    travel: float
    gradient: np.ndarray | None = None
    without: tuple[Fault, ...] = ()
    warnings: tuple[str, ...] = ()


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
    path, rows = _follow(case, system, travel)
    force = np.array([path.force[row] for row in rows])
    if not parameters:
        return Response(travel, force)
    sensitivity = PathSensitivity(system, vary_parameters(case, scene, system, parameters, central=derivative == "adjoint"))
    if derivative == "adjoint":
        jacobian = np.array([sensitivity.adjoint(*path.restore(row))[0] for row in rows])
    else:
        jacobian = path.derivatives(sensitivity, 0, rows, len(parameters))[0]
    return Response(travel, force, jacobian)


def peak_response(case: Case, travel: np.ndarray, parameters: Sequence[str]) -> PeakResponse:
    """Largest force of a case along given travels and its gradient; arguments and errors as in `force_response`.

    Derivatives are computed only for the states around the peak.
    """
    scene, system = _system(case, parameters)
    travel = np.asarray(travel, dtype=float)
    path, all_rows = _follow(case, system, travel)
    force = np.array([path.force[row] for row in all_rows])
    peak = peak_of(Response(travel, force))
    at = int(np.argmax(force))
    rows = all_rows[max(at - 1, 0) : at + 2]
    jacobian = np.full((len(travel), len(parameters)), np.nan)
    jacobian[max(at - 1, 0) : at + 2] = path.derivatives_near(vary_parameters(case, scene, system, parameters), rows)
    return PeakResponse(peak.force, peak.travel, peak_of(Response(travel, force, jacobian)).gradient)


def peak_of_run(case: Case, path: PathStates, parameters: Sequence[str]) -> PeakResponse:
    """Peak of a run whose states were kept, as its summary gives it, and its gradient.

    Parameters
    ----------
    case : case of the run
    path : states of the run
    parameters : dotted paths of numbers of the case

    Raises
    ------
    CaseError
        The run has no exact derivatives.
    """
    if not path.state or path.systems > 1:
        raise CaseError(Fault("solve.method", "exact derivatives need one equilibrium path: no motion, no [[step]]"))
    if case.contact is not None and case.contact.resolve_overlap:
        raise CaseError(Fault("contact.resolve_overlap", "the start is not differentiable; derivatives are not available"))
    scene = build_scene(case)
    _check_derivatives(scene, path.system)
    s, f = np.array(path.travel), np.array(path.force)
    if not np.isfinite(f).all():
        raise CaseError(Fault("drive", "the peak has exact derivatives for a [[drive]] only"))
    rows = sorted(set(peak_rows(s, f)))
    varied, without = list[VariedParameter](), list[Fault]()
    for name in parameters:
        try:
            varied += vary_parameters(case, scene, path.system, [name])
        except CaseError as error:
            without += error.faults
    near = np.full((len(rows), len(parameters)), np.nan)
    near[:, [parameters.index(one.path) for one in varied]] = path.derivatives_near(varied, rows, path.state[-1][0])
    return replace(peak_of(Response(s[rows], f[rows], near)), without=tuple(without), warnings=_uneven(path, rows))


def _uneven(path: PathStates, rows: Sequence[int]) -> tuple[str, ...]:
    """Warning of a peak with dampers or friction between states at the ends of unequal steps.

    Their forces are means over a step and depend on its length, by 1e-5 of the peak; between near states this moves the top
    of the parabola.
    """
    if not path.system.rate_dependent or len(rows) < 3 or rows[0] == 0:
        return ()
    steps = np.diff([path.state[k][0] for k in (rows[0] - 1, *rows)])
    if steps.max() <= _UNEVEN * steps.min():
        return ()
    text = f"the last steps to the states at the peak last {steps.min():.3g} to {steps.max():.3g} s"
    return (f"{text}; its derivatives may be off by 2e-3; a larger solve.rtol gives equal steps, those of save.every",)


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
class PathStates:
    """States of an equilibrium path.

    Attributes
    ----------
    system : system of the path; that of the last state, if there were several
    systems : number of systems
    state : list of (time, configuration, memory of friction and hysteresis); without the memory where it is computed later
    travel, force : lists of float, m and N
        Travel and force of the first drive in every state; NaN without a drive.
    """

    system: Any = None
    systems: int = 0
    state: list[tuple[float, np.ndarray, np.ndarray | None]] = field(default_factory=list)
    travel: list[float] = field(default_factory=list)
    force: list[float] = field(default_factory=list)

    def add(self, system: Any, t: float, q: np.ndarray, point: CurvePoint | None, present: bool = True) -> None:
        """Add a state at time t (s); `point` is that of the force curve, if there is one at this time. `present`: the system
        has the memory of this state.
        """
        if system is not self.system:
            self.system, self.systems = system, self.systems + 1
        drive = system.observe(t, q, None).drive if point is None else point.drive
        self.travel.append(float(drive.travel[0]) if len(drive.travel) else math.nan)
        self.force.append(float(drive.force[0]) if len(drive.force) else math.nan)
        self.state.append((t, q.copy(), system.memory() if present else None))

    def rows_at(self, times: np.ndarray) -> list[int]:
        """Number of the state at each time (n,), s."""
        reached = np.array([t for t, _, _ in self.state]) + 1e-9 * times[-1]
        return [int(row) for row in np.searchsorted(reached, times)]

    def restore(self, row: int) -> tuple[float, np.ndarray]:
        """Time and configuration of a state; restores its memory in the system, from that of an earlier state if need be."""
        system, known = self.system, next(k for k in range(row, -1, -1) if self.state[k][2] is not None)
        t, q, memory = self.state[known]
        if memory is not None and len(memory):
            system.restore(memory)
        for k in range(known + 1, row + 1):
            before, (t, q, _) = (t, q), self.state[k]
            system.commit(t, q, system.difference(before[1], q) / (t - before[0]), before)
            self.state[k] = t, q, system.memory()
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

    def derivatives_near(
        self, varied: Sequence[VariedParameter], rows: Sequence[int], end: float = math.inf
    ) -> np.ndarray:
        """Derivatives (rows, count) of neighbouring states alone; `end` as in `PathSensitivity`.

        In a rate-dependent system they are computed from some states earlier on, so that the first state changes the result
        by less than `_START_ERROR`.
        """
        look_back = _FIRST_LOOK_BACK if self.system.rate_dependent else 0
        while True:
            first = max(rows[0] - look_back, 0)
            near, start_error = self.derivatives(PathSensitivity(self.system, varied, end), first, rows, len(varied))
            if first == 0 or look_back == 0 or start_error < _START_ERROR:
                return near
            look_back *= 2


def _follow(case: Case, system: SegmentSystem, travel: np.ndarray) -> tuple[PathStates, list[int]]:
    """Path along given travels, and the number of the state at each."""
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
    path, points = PathStates(), list[CurvePoint]()
    path.add(system, 0.0, start[1], None)
    if times[-1] > 0.0:
        settings = path_settings(case, system, float(times[-1]))

        def add(end: AcceptedStep) -> None:
            of_times = {point.time: point for point in points[-1 - len(end.passed) :]}
            for t, q in end.passed:
                path.add(system, t, q, of_times.get(t), False)
            path.add(system, end.time, end.q, of_times.get(end.time))

        follow(system, settings, times.tolist(), lambda saved: None, add, start, points=points, each_step=True)
    return path, path.rows_at(times)


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
    if parameters:
        _check_derivatives(scene, system)
    method = automatic_method(scene)[0] if case.solve.method == "auto" else case.solve.method
    if method != "static":
        raise CaseError(Fault("solve.method", f'is "{method}"; a calibration needs the quasi-static method, use "static"'))
    return scene, system


def _check_derivatives(scene: Scene, system: Any) -> None:
    """Refuse a case whose memory or gas has no derivatives."""
    if scene.friction is not None and scene.friction.law == "lugre":
        raise CaseError(Fault("friction.law", 'derivatives are not available with "lugre"; use "step" or "tanh"'))
    if any(isinstance(group, HysteresisGroup) for group in system.groups):
        text = "derivatives are not available for creases with hysteresis, because of their memory; use elastic creases"
        raise CaseError(Fault("crease", text))
    if scene.built.chambers:
        raise CaseError(Fault("gas", "derivatives are not available for the gas of chambers"))
