"""Steps of a quasi-static path: prediction, correction, and the conditions for acceptance; see
`fsm.solve.statics.static`.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

import numpy as np

from fsm.errors import EnergyAbort, NotConverged
from fsm.kernels.vector import largest_ratio
from fsm.solve.equations.equilibrium_step import Ending, EquilibriumStep
from fsm.solve.equations.newton import negative_pivots, tangent_prediction
from fsm.solve.interface.records import Observation
from fsm.solve.interface.system import System
from fsm.solve.outcome.restart_points import State, steps_between
from fsm.solve.outcome.run_io import AcceptedStep, InitialState, OutputRequest, Statistics, time_and_travel
from fsm.solve.outcome.status import TORN, Event, Outcome
from fsm.solve.settings import PathSettings
from fsm.solve.statics.extrapolation import History, Prediction
from fsm.solve.statics.path_recorder import PathRecorder

_FORCES = 1e-3
"""Residual at an equilibrium, relative to the largest reaction and rtol."""
_FAR = 8.0
"""Largest correction relative to the desired one; a larger one rejects the step."""
LARGEST_CORRECTION = 0.25
"""Largest correction relative to the structure's span, or in rad, at any tolerance."""
_GROWTH, _SHRINK, CUT = 2.0, 0.4, 0.35
"""Factors on the step: largest and smallest after an accepted step, and after a rejected one."""
_ITERATIONS = 6
"""Newton iterations above which steps do not grow."""
_SMALLEST = 1e-6
"""Smallest step relative to the duration; if it fails, the point is critical."""
_RESOLVED = 1e-12
"""Smallest step relative to the present time: resolution of times."""
MOVING = 1e-3
"""Kinetic energy relative to the reference energy, above which inertia is not negligible."""
_COARSE = 3.0
"""Energy error of one step, relative to the reference energy and rtol, above which the step has missed a kink of the
force."""
_DEEP = 1e4
"""Contact forces of a prediction relative to reactions and previous contact forces, above which the prediction
penetrates too far."""
_RESTING = 1e-3
"""Residual without damper forces, relative to the largest reaction, below which a state is an equilibrium."""
SHORT = 0.1
"""Ratio of a step without history for a prediction to the first step."""
_KINK = 1e-2
"""Smallest step relative to the first step, for cuts because of the energy balance or a contact that closes."""
EXACT = 1e-3
"""Relative error of the force at which the path ends because of `force_limit`."""
_NONE_COARSE = (-math.inf, 0.0, 0.0)
"""Initial value of the time, duration and energy error of the last step whose energy balance was checked."""


class Reason(Enum):
    """Reason for the rejection of a step."""

    NEWTON = "Newton's method did not converge"
    FAR = "the equilibrium found is far from its prediction"
    UNSTABLE = "the equilibrium is unstable"
    SINGULAR = "the stiffness is singular"
    INERTIA = "inertia is not negligible"
    CROSSED = "a body passed through a face"
    HEAD_ON = "the prediction penetrates closing contacts"
    COARSE = "the energy balance residual of the step is too large"
    LIMIT = "the force of the drive exceeds its limit"


class Mark(NamedTuple):
    """Time (s), travel (m) and force (N) of the first drive at an end of an event."""

    time: float
    travel: float
    force: float


class PathSteps:
    """Path with its solver, recorder and step size.

    Parameters
    ----------
    request, initial_state : see `fsm.solve.outcome.run_io`
    """

    def __init__(self, system: System, settings: PathSettings, request: OutputRequest, initial_state: InitialState) -> None:
        self.system, self.settings = system, settings
        self.statistics = Statistics("static", points=initial_state.points)
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
        # a single state gives only a tangent; if the solve does not start at rest, the drive has its full speed at the start
        self.step_size = self.first_step if start is None else SHORT * self.first_step
        self.aim = math.sqrt(settings.rtol)
        self.far = min(_FAR * self.aim, LARGEST_CORRECTION)
        self.failed = np.zeros(system.nu)
        self.rejection = ""
        self.pivots: int | None = None  # negative pivots of the stiffness at rest in the last step
        self.reason: Reason | None = None
        self.coarse = _NONE_COARSE
        self.lost: Mark | None = None
        # kinetic energy of all bodies at the speed that the drives may cause; without drives, a part of the work of loads
        scales = self.newton.scales
        speed = scales.driven_velocity
        slow = 0.5 * float(speed @ system.momentum(q, speed)) if scales.drive_speed else MOVING * scales.work
        self.slow = slow if system.rate_dependent else 0.0
        self.joint = system.max_joint_opening(t, q)[1]
        self.anchor = self._here()
        if after is not None:
            self._renew(after)

    def _here(self) -> tuple[float, np.ndarray, np.ndarray]:
        """Time, configuration and memory of the present state."""
        return self.recorder.time, self.recorder.q, self.system.memory()

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

    def _attempt(self, t: float, may_renew: bool = False) -> Reason | None:
        """Try a step to time t; return None if the step is accepted, else the reason for its rejection."""
        recorder = self.recorder
        before = (recorder.time, recorder.q)
        prediction = self.history.predict(t)
        extrapolated = prediction is not None
        if prediction is None:
            try:
                increment = tangent_prediction(self.system, recorder.time, t, recorder.q, self.newton.solver)
            except NotConverged:
                return Reason.SINGULAR
            prediction = Prediction(increment, self.newton.efforts(t, recorder.q, before, increment))
        guess = self.system.retract(recorder.q, prediction.increment)
        if extrapolated and self._head_on(t, guess):
            return Reason.HEAD_ON
        self.newton.largest_reaction = recorder.largest_reaction
        found = self.newton.solve(t, guess, before, prediction.efforts)
        if found.ending is Ending.UNSTABLE:
            self.failed = found.residual
            return Reason.UNSTABLE
        if found.ending is not Ending.CONVERGED:
            self.failed = found.residual
            return Reason.SINGULAR if found.ending is Ending.SINGULAR else Reason.NEWTON
        correction = self._size(self.system.difference(guess, found.q))
        if extrapolated and correction > self.far:
            return Reason.FAR
        rejection = self.system.rejection(t, found.q, None, t - recorder.time)
        if rejection is not None:
            self.rejection = rejection.reason
            return Reason.CROSSED
        balance, round_off = recorder.energy_balance, self.newton.round_off * self.newton.scales.length
        balance.round_off_floor = max(balance.round_off_floor, round_off)
        observed = self.system.observe(t, found.q, found.u, before)
        if self._inertia_counts(observed):
            return Reason.INERTIA
        duration = t - recorder.time
        if self.settings.force_ratio(observed.drive) > 1.0 + EXACT and duration > 10.0 * self.smallest:
            return Reason.LIMIT
        step_energy = recorder.step_energy(t, found.q, found.u, observed)
        judged = duration > _KINK * self.first_step
        if judged and self._coarse(duration, recorder.imbalance(observed, step_energy), found.iterations):
            return Reason.COARSE
        unstable = self._is_unstable(t, found.q)
        if unstable and self._rests(t, found.q):
            return Reason.UNSTABLE
        apart, self.joint = self.system.max_joint_opening(t, found.q)
        if apart > TORN * self.newton.scales.length:
            self._fail(Outcome.TORN)
        self._adapt(duration, correction if extrapolated else None, found.iterations)
        lost = self.lost or mark(recorder)
        recorder.quasi_static(t, found.q, found.u, observed, step_energy, unstable, self.pivots)
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
            "anchor_time": np.array([self.anchor[0]]),
            "anchor": self.anchor[1],
            "anchor_memory": self.anchor[2],
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
        self.anchor = float(state["anchor_time"][0]), state["anchor"], state["anchor_memory"]
        self.failed, self.coarse = np.zeros(self.system.nu), _NONE_COARSE

    def _coarse(self, duration: float, imbalance: float, iterations: int) -> bool:
        """Whether the energy balance of a step requires a shorter step.

        If the residual does not decrease with the step size, the initial state was not an equilibrium, and the step is
        accepted. A step with many iterations is not accepted, since it may have reached another branch. Contacts cause
        kinks that a step may miss. Without contacts and dampers, the bound is the round-off of the forces if this is
        larger than rtol.
        """
        at, longer, worse = self.coarse
        self.coarse = self.recorder.time, duration, imbalance
        jump = at == self.recorder.time and duration < longer and imbalance > math.sqrt(duration / longer) * worse
        resolved = self.settings.rtol
        if self.system.fixed_pattern and not self.system.rate_dependent:
            resolved = max(resolved, self.newton.round_off / max(self.newton.largest_reaction, 1e-300))
        return imbalance > _COARSE * resolved and not (jump and iterations <= _ITERATIONS)

    def _inertia_counts(self, observed: Observation) -> bool:
        """Whether the motion is too fast for statics; false without damping, since a motion would then not decay."""
        energy_balance = self.recorder.energy_balance
        turnover = max(energy_balance.turnover, abs(observed.energy.stored_at_rest - energy_balance.start))
        return self.system.rate_dependent and observed.energy.kinetic > max(MOVING * turnover, self.slow)

    def _is_unstable(self, t: float, q: np.ndarray) -> bool:
        """Whether an equilibrium with dampers is unstable at rest, and friction does not hold it.

        Coulomb friction would hold contacts that stick. Regularised friction lets them creep, which is slow on the path.
        """
        system, solver = self.system, self.newton.solver
        self.pivots = negative_pivots(system, t, q, solver) if system.rate_dependent else None
        if not self.pivots:
            return False
        held = system.sticking_damping(t, q) is not None
        return not held or bool(negative_pivots(system, t, q, solver, SHORT * self.first_step))

    def _rests(self, t: float, q: np.ndarray) -> bool:
        """Whether a state is an equilibrium without damper forces; these forces may hold an unstable state for a long
        time.

        If the state is no equilibrium, dampers slow a snap, and the stiffness may be indefinite. This is recorded as an
        event ("damped snap"); its forces do not belong to a quasi-static path.
        """
        left_over = np.abs(self.system.force(t, q, None) / self.newton.scales.force_scale)
        return bool(left_over.max() < _RESTING * self.recorder.largest_reaction)

    def _size(self, increment: np.ndarray) -> float:
        return float(largest_ratio(increment, self.newton.scales.span))

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
        # a step that is shortened to end at a given time gives no estimate for longer steps
        self.step_size = wanted if duration >= 0.5 * self.step_size else max(wanted, self.step_size)

    def _judge_energy(self) -> None:
        judged = self.recorder.time >= self.settings.judged_from
        if judged and self.recorder.is_off(self.settings.energy_abort):
            self._fail(Outcome.ENERGY_OF_STATICS)

    def _note(self, kind: str, begin: Mark) -> None:
        """Record an event that ends at the present state."""
        end = mark(self.recorder)
        self.statistics.events.append(Event(kind, begin.time, end.time, begin.travel, end.travel, begin.force, end.force))

    def _fail(self, outcome: Outcome) -> None:
        if outcome is Outcome.NO_EQUILIBRIUM and not self.system.rate_dependent:
            outcome = Outcome.NO_EQUILIBRIUM_UNDAMPED
        self.statistics.outcome = outcome
        recorder = self.recorder
        recorder.save_last()
        where = time_and_travel(self.system, recorder.time, recorder.last.drive)
        if outcome is Outcome.ENERGY_OF_STATICS:
            raise EnergyAbort(f"{where}: {outcome.value}. {recorder.energy_balance.text}")
        text = f"{where}, step {self.statistics.steps}, method static: {outcome.value}"
        if np.any(self.failed):
            what = "Not held" if outcome is Outcome.MECHANISM else "Largest residual at"
            text += f". {what}: {self.system.worst_body(self.failed)}"
        if self.rejection:
            text += f". {self.rejection}"
        elif self.reason is not None and outcome is not Outcome.MECHANISM:
            text += f". Last rejected static step: {self.reason.value}"
        raise NotConverged(f"{text}. Joint strained most: {self.joint}")


def mark(recorder: PathRecorder) -> Mark:
    """Present state as the end of an event."""
    drive = recorder.last.drive
    first = (float(drive.travel[0]), float(drive.force[0])) if len(drive.travel) else (0.0, 0.0)
    return Mark(recorder.time, *first)
