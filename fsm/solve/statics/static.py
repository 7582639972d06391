"""Quasi-static path following: a sequence of stable equilibria, with dynamics at snap-throughs.

A step predicts the next configuration by extrapolation and corrects it by Newton's method. The step is accepted only if

* the equilibrium is stable: K + D/dt has no negative pivots, or no real ones if friction makes it unsymmetric;
* it is near its prediction: a much larger correction indicates another branch;
* inertia is negligible: the kinetic energy is small against the reference energy;
* its energy balance closes; otherwise the force has a kink in the step, for example at a first touch.

Otherwise the step is cut. If the smallest step fails, the state is near a critical point, and `fsm.solve.statics.critical`
determines its type. At a bifurcation the stable branch is followed. At a limit point the structure snaps, and its
motion is integrated until it comes to rest (`fsm.solve.statics.snap_through`). Both are recorded as events.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence

import numpy as np

from fsm.errors import NotConverged
from fsm.solve.equations.equilibrium_step import Ending
from fsm.solve.equations.newton import at_rest, equilibrium, negative_pivots, tangent_prediction
from fsm.solve.interface.system import System
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import AcceptedStep, CurvePoint, InitialState, OutputRequest, SavedState, Statistics
from fsm.solve.outcome.status import Outcome, StepFailed
from fsm.solve.settings import PathSettings
from fsm.solve.statics.arc_length import limit_point_before
from fsm.solve.statics.critical import Critical, critical_point, softest_mode, stable_branch
from fsm.solve.statics.path_model import SHORT
from fsm.solve.statics.path_steps import LARGEST_CORRECTION, PathSteps, Reason, mark
from fsm.solve.statics.snap_through import RestCriterion, move_until_rest, slide
from fsm.solve.stepping.path import EXACT, MOVING, attempt, next_time

_DRIVEN = 1e-2
"""Kinetic energy of all bodies at the speed of the drives, relative to the largest kinetic energy that the drives may
cause."""
_SAME = 1e-9
"""Distance relative to the span, or in rad, below which two configurations are the same."""
_WAIT = 1e-2
"""Shortest duration of a motion at the speed of the drive, relative to the first step; each repetition is four times as
long."""
_EVENTS = 30
"""Largest number of critical points; if there are more, the solver has lost the path."""
_LATER = 10.0
"""Factor on the time after the equilibrium is lost, after a slide that found no equilibrium."""
_CALMER = 6
"""Number of times that the energy bound for the end of a snap is divided by ten before the run stops."""


def follow(
    system: System,
    settings: PathSettings,
    save_times: Sequence[float],
    on_save: Callable[[SavedState], None],
    on_step: Callable[[AcceptedStep], None] | None = None,
    start: tuple[float, np.ndarray, np.ndarray] | None = None,
    energy_balance: EnergyBalance | None = None,
    points: list[CurvePoint] | None = None,
    after: AcceptedStep | None = None,
    each_step: bool = False,
    several: bool = False,
) -> tuple[Statistics, EnergyBalance]:
    """Follow the stable equilibrium path and report states at the requested times; arguments as in `simulate` and in
    `OutputRequest`.

    Raises
    ------
    NotConverged
        The message states the time, the worst body and a remedy. Earlier states are already saved.
    """
    initial_state = InitialState(start, energy_balance, [] if points is None else points, after)
    request = OutputRequest(list(save_times), on_save, on_step, each_step, several=several)
    run = _Follower(system, settings, request, initial_state)
    run.go()
    return run.statistics, run.recorder.energy_balance


class _Follower(PathSteps):
    """Path with its critical points."""

    def go(self) -> None:
        """Follow the path to the end."""
        begun = time.perf_counter()
        settings, recorder = self.settings, self.recorder
        try:
            if self.statistics.steps == 0 and self._is_far_from_equilibrium():
                before = mark(recorder)
                self._move(moving=False, released=True)
                self._note("release", before)
                self._go_on_slowly()
            elif self.statistics.steps == 0:
                self._settle()
                self.anchor = self._here()
            while recorder.time < settings.end_time and not self._force_limit_reached():
                if self.statistics.steps >= settings.max_steps:
                    self._fail(Outcome.TOO_MANY_STEPS)
                reason = self.reason = self._march()
                if reason is None:
                    self._judge_energy()
                    if self.at_event:
                        self._settle()
                else:
                    self._pass_critical(reason)
            if self.lost is not None:
                self._note("damped snap", self.lost)
            if recorder.time < settings.end_time:
                self._note("force limit", mark(recorder))
                recorder.save_last(final=True)
        finally:
            self._count(begun)

    def _force_limit_reached(self) -> bool:
        """Whether the force of the first drive has reached its limit, up to `EXACT`."""
        return self.settings.force_ratio(self.recorder.last.drive) >= 1.0 - EXACT

    def _is_far_from_equilibrium(self) -> bool:
        """Whether the first Newton step from the initial state exceeds the largest admissible correction."""
        recorder, solver = self.recorder, self.newton.solver
        linear = self.system.linearise(recorder.time, recorder.q, None)
        try:
            solver.factorise(linear.stiffness)
            step = solver.solve(linear.force)
        except NotConverged:
            return False
        return not self._size(step) <= LARGEST_CORRECTION

    def _settle(self) -> None:
        """Move from a start or from an event, where the state is no equilibrium any more, to a near equilibrium; the
        difference of the energies is dissipated.
        """
        recorder, t = self.recorder, self.recorder.time
        if not self.system.nu or self.model.rests(t, recorder.q):
            return
        try:
            q = self._equilibrium_at(t, recorder.q)
        except NotConverged:
            return
        moved = self._size(self.system.difference(recorder.q, q))
        same = moved <= _SAME and not self.at_event  # a motor or a support may have taken over
        if same or moved > LARGEST_CORRECTION or negative_pivots(self.system, t, q, self.newton.solver):
            return
        observed = self.system.observe(t, q, None)
        if recorder.jump_admissible(t, q, observed):
            recorder.slide(t, q, observed)
            self._forget()

    def _equilibrium_at(self, t: float, q: np.ndarray) -> np.ndarray:
        """Equilibrium near a configuration at rest: by the plain iteration, else by the mixed one, for stiff membranes.

        Raises
        ------
        NotConverged
            Neither iteration converges.
        """
        try:
            return equilibrium(self.system, q, np.array([t]))
        except NotConverged as error:
            newton, before = self.newton, (t, q)
            residual = np.abs(self.system.force(t, q, None) / newton.scales.force_scale)
            newton.largest_reaction = max(self.recorder.largest_reaction, float(residual.max()))
            self.system.lock(0.0)
            increment = tangent_prediction(self.system, t, t, q, newton.solver)
            efforts = newton.efforts(t, q, before, increment)
            found = newton.solve(t, self.system.retract(q, increment), before, efforts)
            if found.ending is not Ending.CONVERGED:
                raise error
            return found.q

    def _pass_critical(self, reason: Reason) -> None:
        """Continue past a critical point."""
        recorder = self.recorder
        self.system.lock(0.0)
        if sum(event.kind != "damped snap" for event in self.statistics.events) >= _EVENTS:
            self._fail(Outcome.NO_EQUILIBRIUM)
        before = self.lost or mark(recorder)
        self.lost = None
        later = recorder.time + 1e-3 * self.first_step
        kind = "motion"
        if reason is Reason.SINGULAR:
            self.model.failed = softest_mode(self.system, recorder.time, recorder.q)
            self._fail(Outcome.MECHANISM)
        if reason is not Reason.INERTIA:
            critical = critical_point(self.system, recorder.time, recorder.q, later)
            kind = "snap"
            # branches are searched at rest and without friction
            if critical.bifurcation and self.model.rests(recorder.time, recorder.q) and self._branch(critical):
                kind = "bifurcation"
        if kind != "bifurcation":
            self._move(reason is Reason.INERTIA)
        if kind == "motion" and self._passed_limit():
            kind = "snap"
        self._note(kind, before)
        self._go_on_slowly()

    def _passed_limit(self) -> bool:
        """Whether loads or drives passed a limit point before the end of a motion: then no slower ones follow equilibria.

        The path of equilibria begins at the last `anchor`, because dampers let the states lag behind it. With friction,
        which such a path does not include, the result is false.
        """
        system, recorder, (t, q, memory) = self.system, self.recorder, self.anchor
        if system.sticking_damping(t, q) is not None:
            return False
        present = system.memory()
        system.restore(memory)
        try:
            return limit_point_before(system, q, t, recorder.time)
        finally:
            system.restore(present)

    def _go_on_slowly(self) -> None:
        """Restart the history with a short step."""
        self._forget()
        self.anchor = self._here()
        self.step_size = min(self.step_size, SHORT * self.first_step)
        self.step_size = max(self.step_size, 10.0 * self.smallest)

    def _branch(self, critical: Critical) -> bool:
        """Follow the stable branch of a bifurcation, from the smallest step at which it exists."""
        recorder = self.recorder
        step = 10.0 * self.smallest
        while step < self.first_step:
            t = min(recorder.time + step, recorder.next_save(self.settings.end_time))
            guess, efforts = self._predicted(t)
            found = stable_branch(self.newton, t, guess, efforts, critical, self.settings.imperfection)
            observed = None if found is None else self.system.observe(t, found.q, None)
            if found is not None and observed is not None and recorder.jump_admissible(t, found.q, observed):
                recorder.slide(t, found.q, observed)
                return True
            step *= 4.0
        return False

    def _move(self, moving: bool, released: bool = False) -> None:
        """Integrate the motion, or slide without damping, until equilibria can be followed again.

        `moving`: the motion starts with the present velocities; otherwise it starts at rest.
        `released`: the reference energy is still zero, and the stored energy is the scale.
        """
        recorder, settings = self.recorder, self.settings
        if not self.system.rate_dependent:
            self._slide()
            return
        scale = sum(map(abs, recorder.last.energy.potential.values())) if released else recorder.energy_balance.turnover
        worst = math.inf if released else settings.energy_abort
        rest = RestCriterion(MOVING, scale, _DRIVEN * self.slow, math.inf if released else _WAIT * self.first_step)
        u = recorder.u if moving else np.zeros_like(recorder.u)
        if moving:
            recorder.begin_motion()
        for again in range(_CALMER):
            rest = rest._replace(part=0.1 * rest.part, wait=4.0 * rest.wait)
            try:
                with at_rest(self.system, still=False):
                    self.statistics.newton_iterations += move_until_rest(
                        self.system, recorder, u, settings, rest, worst, begins=not again
                    )
            except StepFailed as error:
                self.model.rejection = error.reason
                self._fail(error.outcome)
            self._judge_energy()
            if recorder.time >= settings.end_time or self._force_limit_reached():
                return
            u = recorder.u
            self._forget()
            self.step_size = 1e-2 * self.first_step
            stop = next(at for at in self._stops() if at > recorder.time)
            t, _ = next_time(stop, recorder.time, self.step_size, settings.max_step)
            self.reason = self._in_python(attempt, t, single=True)
            if self.reason is None:
                return
        self._fail(Outcome.NO_EQUILIBRIUM)

    def _slide(self) -> None:
        """Slide from a time just after the loss of the equilibrium; the time is found by trials.

        A mechanism that locks has hardly any stiffness at this time; later the force of the drive makes it stable.
        """
        recorder, start = self.recorder, self.recorder.q
        later = self.smallest
        while recorder.time < self.settings.end_time:
            if not slide(self.system, recorder, min(recorder.time + later, self.settings.end_time)):
                if later > self.first_step:
                    self._fail(Outcome.NO_EQUILIBRIUM)
                later *= _LATER
                continue
            if self._size(self.system.difference(start, recorder.q)) > self.far:
                return
            later *= 2.0
            if later > self.first_step:
                return

    def _count(self, begun: float) -> None:
        statistics = self.statistics
        statistics.jacobian_evaluations, statistics.force_evaluations, statistics.factorisations = self._counts()
        statistics.newton_iterations += statistics.jacobian_evaluations
        statistics.wall_time = time.perf_counter() - begun
