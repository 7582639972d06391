"""Quasi-static path following: a sequence of stable equilibria, with dynamics at snap-throughs.

A step predicts the next configuration by extrapolation and corrects it by Newton's method. It is accepted only if

* the equilibrium is stable: K + D/dt has no negative pivots, or no real ones if friction makes it unsymmetric;
* it is near its prediction: a much larger correction indicates another branch;
* inertia is negligible: the kinetic energy is small against the reference energy;
* its energy balance closes; otherwise the force has a kink in the step, for example at a first touch.

Otherwise the step is cut. If the smallest step fails there is a critical point, and `fsm.solve.critical` finds its type. At
a bifurcation the stable branch is followed. At a limit point the structure snaps, and its motion is integrated until it
comes to rest (`fsm.solve.snap_through`). Both are recorded as events.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from fsm.errors import EnergyAbort, NotConverged
from fsm.kernels.vector import largest_ratio
from fsm.solve.critical import Critical, critical_point, softest_mode, stable_branch
from fsm.solve.energy_balance import JUDGED_FROM, EnergyBalance
from fsm.solve.equilibrium_step import Ending, EquilibriumStep
from fsm.solve.extrapolation import History, Prediction
from fsm.solve.newton import equilibrium, negative_pivots, tangent_prediction
from fsm.solve.path_recorder import PathRecorder
from fsm.solve.restart_points import State, steps_between
from fsm.solve.run_io import AcceptedStep, CurvePoint, InitialState, OutputRequest, SavedState, Statistics
from fsm.solve.snap_through import RestCriterion, move_until_rest, slide
from fsm.solve.status import TORN, Event, Outcome, StepFailed
from fsm.system import Observation, System

__all__ = ["PathSettings", "follow"]

_FORCES = 1e-3
"""Residual at an equilibrium, relative to the largest reaction and rtol."""
_FAR = 8.0
"""Largest correction relative to the desired one; a larger one rejects the step."""
_FURTHEST = 0.25
"""Largest correction relative to the structure's span, or in rad, at any tolerance."""
_GROWTH, _SHRINK, _CUT = 2.0, 0.4, 0.35
_ITERATIONS = 6
"""Newton iterations above which steps do not grow."""
_SMALLEST = 1e-6
"""Smallest step relative to the duration; if it fails, the point is critical."""
_RESOLVED = 1e-12
"""Smallest step relative to the time itself: the resolution of times."""
_MOVING = 1e-3
"""Kinetic energy relative to the reference energy, above which inertia is not negligible."""
_DRIVEN = 1e-2
"""Ratio of the kinetic energy of all bodies at the speed of the drives to the largest one that the drives may cause."""
_COARSE = 3.0
"""Energy error of one step, relative to the reference energy and rtol: above it the step has missed a kink of the
force."""
_DEEP = 1e4
"""Contact forces of a prediction relative to reactions and previous contact forces, above which it penetrates too far."""
_SAME = 1e-9
"""Distance relative to the span, or in rad, below which two configurations are the same."""
_RESTING = 1e-3
"""Residual without damper forces, relative to the largest reaction, below which a state is an equilibrium."""
_AGAIN = 0.1
"""Ratio of a step without history for a prediction to the first step."""
_KINK = 1e-2
"""Smallest step relative to the first step, for cuts because of the energy balance or a contact that closes."""
_WAIT = 1e-2
"""Shortest duration of a motion at the speed of the drive, relative to the first step; four times as long each time
again."""
_IN_MOTION = 10.0
"""Tolerance of the dynamics at a snap, relative to the tolerance of the path."""
_EVENTS = 30
"""Largest number of critical points; with more the solver has lost the path."""
_NONE_COARSE = (-math.inf, 0.0, 0.0)
"""Initial value of the time, duration and energy error of the last step whose energy balance was checked."""
_CALMER = 6
"""Number of times that the energy at which a snap has ended is reduced to a tenth, before the run stops."""


@dataclass(frozen=True)
class PathSettings:
    """Settings of quasi-static path following.

    Attributes
    ----------
    end_time : s
    first_step, max_step : s
    rtol : -
        Predictor tolerance: sqrt(rtol) times the structure's span (rotations: rad); it sets the step size.
    max_steps : int
    imperfection : -
        Sign of the critical mode (largest component positive) along which the path continues after a bifurcation.
        Zero: the side of lower energy.
    energy_abort : -
        Energy error over the reference energy at which the solve stops, after a tenth of the time.
    start_time : s
        Start of the step of the run, which may be before that of a resumed solve.
    """

    end_time: float
    first_step: float
    max_step: float = math.inf
    rtol: float = 1e-4
    max_steps: int = 200_000
    imperfection: float = 0.0
    energy_abort: float = math.inf
    start_time: float = 0.0

    @property
    def judged_from(self) -> float:
        """Time from which an energy error stops the solve, s."""
        return self.start_time + JUDGED_FROM * (self.end_time - self.start_time)


def follow(
    system: System,
    settings: PathSettings,
    save_times: Sequence[float],
    on_save: Callable[[SavedState], None],
    on_step: Callable[[AcceptedStep], None] | None = None,
    start: tuple[float, np.ndarray, np.ndarray] | None = None,
    energy_balance: EnergyBalance | None = None,
    seen: list[CurvePoint] | None = None,
    after: AcceptedStep | None = None,
) -> tuple[Statistics, EnergyBalance]:
    """Follow the stable equilibrium path and report states at the requested times; arguments as in `simulate`.

    Raises
    ------
    NotConverged
        The message states the time, the worst body and a remedy. Earlier states are already saved.
    """
    initial_state = InitialState(start, energy_balance, [] if seen is None else seen, after)
    run = _Follower(system, settings, OutputRequest(list(save_times), on_save, on_step), initial_state)
    run.go()
    return run.statistics, run.recorder.energy_balance


class _Reason(Enum):
    """Reason for the rejection of a step."""

    NEWTON = "Newton's method did not converge"
    FAR = "the equilibrium found is far from its prediction"
    UNSTABLE = "the equilibrium is unstable"
    SINGULAR = "the stiffness is singular"
    INERTIA = "inertia is not negligible"
    CROSSED = "something passed through a face"
    HEAD_ON = "the prediction penetrates closing contacts"
    COARSE = "the energy balance of the step does not close"


class _Mark(NamedTuple):
    """Time (s), travel (m) and force (N) of the first drive at an end of an event."""

    time: float
    travel: float
    force: float


class _Follower:
    def __init__(self, system: System, settings: PathSettings, request: OutputRequest, initial_state: InitialState) -> None:
        self.system, self.settings = system, settings
        self.statistics = Statistics("static", seen=initial_state.seen)
        self.newton = EquilibriumStep(system, tolerance=_FORCES * settings.rtol)
        self.history = History(system)
        self.every, self.renewed = steps_between(system.nu), 0
        self.first_step = min(settings.first_step, settings.max_step)
        whole = settings.end_time - settings.start_time
        self.smallest = max(_SMALLEST * whole, _RESOLVED * settings.end_time)
        start, after = initial_state.start, initial_state.after
        if after is not None:
            t, q, u = after.time, after.q, after.u
        else:
            t, q, u = (0.0, *system.initial()) if start is None else start
            system.clear_caches(np.zeros(0))
            if start is None:
                system.restore(np.zeros(0))
            self.history.add(t, q, self.newton.efforts(t, q))
        self.recorder = PathRecorder(system, self.statistics, request, initial_state, t, q, u)
        self.breaks = [at for at in system.break_times() if t < at < settings.end_time]
        # one state gives only a tangent, and in a solve that does not start at rest the drive starts at full speed
        self.step_size = self.first_step if start is None else _AGAIN * self.first_step
        self.aim = math.sqrt(settings.rtol)
        self.far = min(_FAR * self.aim, _FURTHEST)
        self.failed = np.zeros(system.nu)
        self.rejection = ""
        self.coarse = _NONE_COARSE
        self.lost: _Mark | None = None
        # kinetic energy of all bodies at the speed that the drive may cause
        speed = self.newton.scales.velocity
        self.slow = 0.5 * float(speed @ (system.mass(q) @ speed)) if system.rate_dependent else 0.0
        self.joint = system.max_joint_opening(t, q)[1]
        if after is not None:
            self._renew(after)

    def go(self) -> None:
        """To the end."""
        begun = time.perf_counter()
        settings, recorder = self.settings, self.recorder
        try:
            if self.statistics.steps == 0 and self._is_far_from_equilibrium():
                before = _mark(recorder)
                self._move(moving=False, released=True)
                self._note("release", before)
                self._go_on_slowly()
            elif self.statistics.steps == 0:
                self._settle()
            while recorder.time < settings.end_time:
                if self.statistics.steps >= settings.max_steps:
                    self._fail(Outcome.TOO_MANY_STEPS)
                duration = self._duration()
                reason = self._attempt(recorder.time + duration, may_renew=True)
                if reason is None:
                    self._judge_energy()
                    continue
                self.statistics.rejected += 1
                self.step_size = _CUT * duration
                if reason is _Reason.INERTIA or self.step_size < self.smallest:
                    self._pass_critical(reason)
            if self.lost is not None:
                self._note("damped snap", self.lost)
        finally:
            self._count(begun)

    def _duration(self) -> float:
        """Duration of the next step: to the next given time, or a part of it."""
        recorder = self.recorder
        while self.breaks and self.breaks[0] <= recorder.time * (1.0 + 1e-12):
            self.breaks.pop(0)
        target = min(recorder.next_save(self.settings.end_time), *self.breaks[:1], self.settings.end_time)
        left = target - recorder.time
        size = min(self.step_size, self.settings.max_step)
        if size >= 0.999 * left:
            return left
        return min(size, 0.5 * left)

    def _attempt(self, t: float, may_renew: bool = False) -> _Reason | None:
        """Try a step to time t; return None if it is accepted, else the reason."""
        recorder = self.recorder
        before = (recorder.time, recorder.q)
        prediction = self.history.predict(t)
        extrapolated = prediction is not None
        if prediction is None:
            try:
                increment = tangent_prediction(self.system, recorder.time, t, recorder.q, self.newton.solver)
            except NotConverged:
                return _Reason.SINGULAR
            prediction = Prediction(increment, self.newton.efforts(t, recorder.q, before, increment))
        guess = self.system.retract(recorder.q, prediction.increment)
        if extrapolated and self._head_on(t, guess):
            return _Reason.HEAD_ON
        self.newton.largest_reaction = recorder.largest_reaction
        found = self.newton.solve(t, guess, before, prediction.efforts)
        if found.ending is Ending.UNSTABLE:
            self.failed = found.residual
            return _Reason.UNSTABLE
        if found.ending is not Ending.CONVERGED:
            self.failed = found.residual
            return _Reason.SINGULAR if found.ending is Ending.SINGULAR else _Reason.NEWTON
        correction = self._size(self.system.difference(guess, found.q))
        if extrapolated and correction > self.far:
            return _Reason.FAR
        rejection = self.system.rejection(t, found.q, None, t - recorder.time)
        if rejection is not None:
            self.rejection = rejection.reason
            return _Reason.CROSSED
        balance, round_off = recorder.energy_balance, self.newton.round_off * self.newton.scales.length
        balance.round_off_floor = max(balance.round_off_floor, round_off)
        seen = self.system.observe(t, found.q, found.u, before)
        if self._inertia_counts(seen):
            return _Reason.INERTIA
        duration = t - recorder.time
        turned_over = recorder.turned_over(t, found.q, found.u, seen)
        judged = duration > _KINK * self.first_step
        if judged and self._coarse(duration, recorder.imbalance(seen, turned_over), found.iterations):
            return _Reason.COARSE
        unstable = self.system.rate_dependent and bool(negative_pivots(self.system, t, found.q, self.newton.solver))
        if unstable and self._rests(t, found.q):
            return _Reason.UNSTABLE
        apart, self.joint = self.system.max_joint_opening(t, found.q)
        if apart > TORN * self.newton.scales.length:
            self._fail(Outcome.TORN)
        self._adapt(duration, correction if extrapolated else None, found.iterations)
        lost = self.lost or _mark(recorder)
        recorder.quasi_static(t, found.q, found.u, seen, turned_over, unstable)
        if self.lost is not None and not unstable:
            self._note("damped snap", self.lost)
        self.lost = lost if unstable else None
        self.rejection = ""
        self.history.add(t, found.q, found.efforts)
        due = self.statistics.steps - self.renewed >= self.every and not unstable
        renews = may_renew and due and t < self.settings.end_time
        end = recorder.finish_step(self._state() if renews else None)
        if renews:
            self._renew(end)
        return None

    def _head_on(self, t: float, guess: np.ndarray) -> bool:
        """Whether a prediction penetrates a closing contact too far for Newton's method."""
        system, recorder = self.system, self.recorder
        if system.fixed_pattern or t - recorder.time < _KINK * self.first_step:
            return False
        force = system.contact_force(t, guess) / _DEEP
        return force > recorder.largest_reaction and force > system.contact_force(recorder.time, recorder.q)

    def _state(self) -> State:
        """State of the solve for a restart."""
        counts = self._counts()
        return {
            **self.history.state(),
            **self.recorder.state(),
            "memory": self.system.memory(),
            "counted": self.system.counters(),
            "step_size": np.array([self.step_size]),
            "counts": np.array([*counts, self.statistics.newton_iterations, self.statistics.rejected]),
        }

    def _counts(self) -> tuple[int, int, int]:
        return self.newton.iterations, self.newton.evaluations, self.newton.solver.factorisations

    def _renew(self, end: AcceptedStep) -> None:
        """Reset the solve to the data of a restart point."""
        state, statistics = end.state, self.statistics
        assert state is not None
        self.system.clear_caches(state["counted"])
        self.system.restore(state["memory"])
        self.newton = newton = EquilibriumStep(self.system, tolerance=self.newton.tolerance)
        counts = [int(count) for count in state["counts"]]
        newton.iterations, newton.evaluations, newton.solver.factorisations = counts[:3]
        statistics.newton_iterations, statistics.rejected = counts[3:]
        statistics.steps, self.renewed = end.steps, end.steps
        self.history.resume(state)
        self.recorder.resume(end)
        self.step_size = float(state["step_size"][0])
        self.failed, self.coarse = np.zeros(self.system.nu), _NONE_COARSE

    def _coarse(self, duration: float, imbalance: float, iterations: int) -> bool:
        """Whether the energy balance of a step requires a shorter step.

        If a residual does not decrease with the step, the initial state was no equilibrium, and the step is accepted. After
        many iterations it is not accepted, since it may be on another branch.
        """
        at, longer, worse = self.coarse
        self.coarse = self.recorder.time, duration, imbalance
        jump = at == self.recorder.time and duration < longer and imbalance > math.sqrt(duration / longer) * worse
        return imbalance > _COARSE * self.settings.rtol and not (jump and iterations <= _ITERATIONS)

    def _inertia_counts(self, seen: Observation) -> bool:
        """Whether the motion is too fast for statics; false without damping, since the motion would not decay."""
        energy_balance = self.recorder.energy_balance
        turnover = max(energy_balance.turnover, abs(seen.energy.stored_at_rest - energy_balance.start))
        return self.system.rate_dependent and seen.energy.kinetic > max(_MOVING * turnover, self.slow)

    def _rests(self, t: float, q: np.ndarray) -> bool:
        """Whether a state is an equilibrium without damper forces, which may hold an unstable one for long.

        Between two equilibria the stiffness of a state may be indefinite: dampers slow a snap. This is an event ("damped
        snap"), and its forces do not belong to a quasi-static path.
        """
        left_over = np.abs(self.system.force(t, q, None) * self.newton.scales.length / self.newton.scales.increment)
        return bool(left_over.max() < _RESTING * self.recorder.largest_reaction)

    def _is_far_from_equilibrium(self) -> bool:
        """Whether the first Newton step from the start exceeds the largest admissible correction."""
        recorder, solver = self.recorder, self.newton.solver
        linear = self.system.linearise(recorder.time, recorder.q, None)
        try:
            solver.factorise(linear.stiffness)
            step = solver.solve(linear.force)
        except NotConverged:
            return False
        return not self._size(step) <= _FURTHEST

    def _size(self, increment: np.ndarray) -> float:
        return float(largest_ratio(increment, self.newton.scales.span))

    def _settle(self) -> None:
        """Move to the equilibrium near a start that is none; the difference of the energies is dissipated."""
        recorder, t = self.recorder, self.recorder.time
        if not self.system.nu or self._rests(t, recorder.q):
            return
        try:
            q = equilibrium(self.system, recorder.q, np.array([t]))
        except NotConverged:
            return
        moved = self._size(self.system.difference(recorder.q, q))
        if moved <= _SAME or moved > _FURTHEST or negative_pivots(self.system, t, q, self.newton.solver):
            return
        seen = self.system.observe(t, q, None)
        if recorder.jump_admissible(t, q, seen):
            recorder.slide(t, q, seen)
            self._forget()

    def _forget(self) -> None:
        """Restart the history at the present state."""
        self.history = History(self.system)
        self.history.add(self.recorder.time, self.recorder.q, self.newton.efforts(self.recorder.time, self.recorder.q))

    def _adapt(self, duration: float, correction: float | None, iterations: int) -> None:
        """Set the size of the next step from the error of the prediction, which is proportional to the cube of the step.

        The step does not grow after many Newton iterations.
        """
        if correction is None:
            return
        factor = 0.9 * (self.aim / max(correction, 1e-12)) ** (1.0 / 3.0)
        factor = min(factor, _GROWTH, _ITERATIONS / max(iterations, 1))
        wanted = duration * max(_SHRINK, factor)
        # a step shortened to end at a given time gives no estimate for a long one
        self.step_size = wanted if duration >= 0.5 * self.step_size else max(wanted, self.step_size)

    def _judge_energy(self) -> None:
        judged = self.recorder.time >= self.settings.judged_from
        if judged and self.recorder.is_off(self.settings.energy_abort):
            self._fail(Outcome.ENERGY_OF_STATICS)

    # critical points ------------------------------------------------------------------------------------------------

    def _pass_critical(self, reason: _Reason) -> None:
        """Continue past a critical point."""
        recorder = self.recorder
        if sum(event.kind != "damped snap" for event in self.statistics.events) >= _EVENTS:
            self._fail(Outcome.NO_EQUILIBRIUM)
        before = self.lost or _mark(recorder)
        self.lost = None
        later = recorder.time + 1e-3 * self.first_step
        kind = "motion"
        if reason is _Reason.SINGULAR:
            self.failed = softest_mode(self.system, recorder.time, recorder.q)
            self._fail(Outcome.MECHANISM)
        if reason is not _Reason.INERTIA:
            critical = critical_point(self.system, recorder.time, recorder.q, later)
            kind = "snap"
            # branches are searched at rest, without friction
            if critical.bifurcation and self._rests(recorder.time, recorder.q) and self._branch(critical):
                kind = "bifurcation"
        if kind != "bifurcation":
            self._move(reason is _Reason.INERTIA)
        self._note(kind, before)
        self._go_on_slowly()

    def _note(self, kind: str, begin: _Mark) -> None:
        """Record an event that ends at the present state."""
        end = _mark(self.recorder)
        self.statistics.events.append(Event(kind, begin.time, end.time, begin.travel, end.travel, begin.force, end.force))

    def _go_on_slowly(self) -> None:
        """Restart the history with a short step."""
        self._forget()
        self.step_size = min(self.step_size, _AGAIN * self.first_step)
        self.step_size = max(self.step_size, 10.0 * self.smallest)

    def _branch(self, critical: Critical) -> bool:
        """Follow the stable branch of a bifurcation, from the smallest step at which it exists."""
        recorder = self.recorder
        step = 10.0 * self.smallest
        while step < self.first_step:
            t = min(recorder.time + step, recorder.next_save(self.settings.end_time))
            prediction = self.history.predict(t)
            guess, efforts = recorder.q, self.history.efforts
            if prediction is not None:
                guess, efforts = self.system.retract(recorder.q, prediction.increment), prediction.efforts
            found = stable_branch(self.newton, t, guess, efforts, critical, self.settings.imperfection)
            seen = None if found is None else self.system.observe(t, found.q, None)
            if found is not None and seen is not None and recorder.jump_admissible(t, found.q, seen):
                recorder.slide(t, found.q, seen)
                return True
            step *= 4.0
        return False

    def _move(self, moving: bool, released: bool = False) -> None:
        """Integrate the motion (a slide without damping) until equilibria can be followed again.

        `moving`: the motion starts with the present velocities, which have grown; otherwise it starts at rest.
        `released`: the reference energy is still zero, and the stored energy is the scale.
        """
        recorder, settings = self.recorder, self.settings
        if not self.system.rate_dependent:
            self._slide()
            return
        scale = sum(map(abs, recorder.last.energy.potential.values())) if released else recorder.energy_balance.turnover
        worst = math.inf if released else settings.energy_abort
        rest = RestCriterion(_MOVING, scale, _DRIVEN * self.slow, math.inf if released else _WAIT * self.first_step)
        u = recorder.u if moving else np.zeros_like(recorder.u)
        if moving:
            recorder.begin_motion()
        for again in range(_CALMER):
            rest = rest._replace(part=0.1 * rest.part, wait=4.0 * rest.wait)
            try:
                self.statistics.newton_iterations += move_until_rest(
                    self.system, recorder, u, settings.end_time, settings.judged_from, rest, worst,
                    _IN_MOTION * settings.rtol, begins=not again,
                )
            except StepFailed as error:
                self.rejection = error.reason
                self._fail(error.outcome)
            self._judge_energy()
            if recorder.time >= settings.end_time:
                return
            u = recorder.u
            self._forget()
            self.step_size = 1e-2 * self.first_step
            if self._attempt(recorder.time + self._duration()) is None:
                return
        self._fail(Outcome.NO_EQUILIBRIUM)

    def _slide(self) -> None:
        """Slide from a time just after the equilibrium is lost; the time is found by trial."""
        recorder, start = self.recorder, self.recorder.q
        later = self.smallest
        while recorder.time < self.settings.end_time:
            if not slide(self.system, recorder, min(recorder.time + later, self.settings.end_time)):
                self._fail(Outcome.NO_EQUILIBRIUM)
            if self._size(self.system.difference(start, recorder.q)) > self.far:
                return
            later *= 2.0
            if later > self.first_step:
                return

    # the end --------------------------------------------------------------------------------------------------------

    def _count(self, begun: float) -> None:
        statistics = self.statistics
        statistics.jacobian_evaluations, statistics.force_evaluations, statistics.factorisations = self._counts()
        statistics.newton_iterations += statistics.jacobian_evaluations
        statistics.wall_time = time.perf_counter() - begun

    def _fail(self, outcome: Outcome) -> None:
        if outcome is Outcome.NO_EQUILIBRIUM and not self.system.rate_dependent:
            outcome = Outcome.NO_EQUILIBRIUM_UNDAMPED
        self.statistics.outcome = outcome
        recorder = self.recorder
        recorder.save_last()
        travel = ", ".join(f"{1e3 * x:.4g} mm" for x in recorder.last.drive.travel)
        where = f"at t = {recorder.time:.6g} s" + (f" (travel {travel})" if travel else "")
        if outcome is Outcome.ENERGY_OF_STATICS:
            raise EnergyAbort(f"{where}: {outcome.value}. {recorder.energy_balance.text}")
        text = f"{where}, step {self.statistics.steps}, method static: {outcome.value}"
        if np.any(self.failed):
            what = "Not held" if outcome is Outcome.MECHANISM else "Largest residual at"
            text += f". {what}: {self.system.worst_body(self.failed)}"
        if self.rejection:
            text += f". {self.rejection}"
        raise NotConverged(f"{text}. Joint strained most: {self.joint}")


def _mark(recorder: PathRecorder) -> _Mark:
    """Present state as the end of an event."""
    drive = recorder.last.drive
    first = (float(drive.travel[0]), float(drive.force[0])) if len(drive.travel) else (0.0, 0.0)
    return _Mark(recorder.time, *first)
