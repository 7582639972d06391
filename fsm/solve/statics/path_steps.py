"""Steps of a quasi-static path, its critical points apart; `fsm.solve.stepping.path` has the conditions for acceptance."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from fsm.errors import EnergyAbort, NotConverged
from fsm.kernels.pointers import enter
from fsm.kernels.vector import largest_ratio
from fsm.solve.equations.equilibrium_step import Ending, EquilibriumStep
from fsm.solve.equations.newton import held_still
from fsm.solve.interface.records import Observation, as_rows
from fsm.solve.interface.system import StaticArrays, System
from fsm.solve.outcome.restart_points import MOST_OF_PATHS, State, steps_between
from fsm.solve.outcome.run_io import AcceptedStep, InitialState, OutputRequest, Statistics, time_and_travel
from fsm.solve.outcome.status import TORN, Event, Outcome
from fsm.solve.settings import PathSettings
from fsm.solve.statics.path_model import SHORT, SystemPath, write_record
from fsm.solve.statics.path_recorder import PathRecorder
from fsm.solve.stepping import path_state as stepping
from fsm.solve.stepping.accuracy import trial_vector
from fsm.solve.stepping.path import CUT, MOVING, SAME, extrapolate, follow, remember
from fsm.solve.stepping.path_arrays import follow_arrays
from fsm.solve.stepping.path_state import Path, PathRules

_FORCES = 1e-3
"""Residual at an equilibrium, relative to the largest reaction and rtol."""
_FAR = 8.0
"""Largest correction relative to the desired one; a larger one rejects the step."""
LARGEST_CORRECTION = 0.25
"""Largest correction relative to the structure's span, or in rad, at any tolerance."""
_SMALLEST = 1e-6
"""Smallest step relative to the duration; if it fails, the point is critical."""
_RESOLVED = 1e-12
"""Smallest step relative to the present time: resolution of times."""
_FEW = 8
"""Largest number of steps in one kernel if all are reported, so that a state is soon found again from the last memory."""
_PATTERNS = 20
"""Largest number of repetitions of a step because bodies came near each other whose block the pattern lacks."""

_RESTART = (
    "numbers", "counts", "progress", "states", "efforts", "earlier", "resting", "resting_drives",
)  # fmt: skip
"""Fields of `Path` that a restart needs, besides those of the recorder."""


class Reason(Enum):
    """Reason for the rejection of a step, by its number in `fsm.solve.stepping.path`."""

    NEWTON = stepping.NEWTON, "Newton's method did not converge"
    FAR = stepping.FAR, "the equilibrium found is far from its prediction"
    UNSTABLE = stepping.UNSTABLE, "the equilibrium is unstable"
    SINGULAR = stepping.SINGULAR, "the stiffness is singular"
    INERTIA = stepping.INERTIA, "inertia is not negligible"
    CROSSED = stepping.CROSSED, "a body passed through a face"
    HEAD_ON = stepping.HEAD_ON, "the prediction penetrates closing contacts"
    COARSE = stepping.COARSE, "the energy balance residual of the step is too large"
    LIMIT = stepping.LIMIT, "the force of the drive exceeds its limit"

    @classmethod
    def of(cls, outcome: int) -> Reason | None:
        """Reason of an outcome; None if the step was accepted."""
        return next((reason for reason in cls if reason.value[0] == outcome), None)


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
        self.every, self.renewed = steps_between(system.nu, MOST_OF_PATHS), 0
        self.first_step = min(settings.first_step, settings.max_step)
        whole = settings.end_time - settings.start_time
        self.smallest = max(_SMALLEST * whole, _RESOLVED * settings.end_time)
        start, after = initial_state.start, initial_state.after
        if after is not None:
            t, q, u = after.time, after.q, after.u
            system.hold_still(True)
        else:
            t, q, u = (0.0, *system.initial()) if start is None else start
            system.clear_caches(np.zeros(0))
            if start is None:
                system.restore(np.zeros(0))
            q = held_still(system, t, q)
        self.recorder = PathRecorder(system, self.statistics, request, initial_state, t, q, u)
        efforts = self.newton.efforts(t, q)
        observed = system.observe(t, q, None) if after is not None else self.recorder.last
        sizes = len(efforts), len(observed.drive.travel), len(observed.pairs.force)
        self.path = Path.of(system.nq, system.nu, *sizes)
        self.model = SystemPath(system, self.newton, self.recorder)
        self.breaks = [at for at in system.break_times() if t < at < settings.end_time]
        # a single state gives only a tangent; if the solve does not start at rest, the drive has its full speed at the start
        self.step_size = self.first_step if start is None else SHORT * self.first_step
        self._recorded: Observation | None = None  # state of `path.record`
        self._doubtful = False  # the kernel has found a state whose stability Python has to judge
        self.far = min(_FAR * math.sqrt(settings.rtol), LARGEST_CORRECTION)
        self.reason: Reason | None = None
        self.lost: Mark | None = None
        self.at_event = False  # the last step ends where an element changes, such as a latch that opens
        # kinetic energy of all bodies at the speed that the drives may cause; without drives, a part of the work of loads
        scales = self.newton.scales
        speed = scales.driven_velocity
        slow = 0.5 * float(speed @ system.momentum(q, speed)) if scales.drive_speed else MOVING * scales.work
        self.slow = slow if system.rate_dependent else 0.0
        self.rules = PathRules(
            self.newton.tolerance, self.newton.reach, self.newton.max_iterations, system.mixed, scales.span,
            scales.force_scale, settings.rtol, math.sqrt(settings.rtol), self.far, self.first_step, settings.max_step,
            self.smallest, self.slow, scales.length, scales.extent, TORN * scales.length, settings.force_limit,
            settings.energy_abort, settings.judged_from, system.rate_dependent, system.fixed_pattern,
            SHORT * self.first_step, trial_vector(system.nu),
        )  # fmt: skip
        self.anchor = self._here()
        if after is not None:
            self._renew(after)
        else:
            self._forget()

    def _here(self) -> tuple[float, np.ndarray, np.ndarray]:
        """Time, configuration and memory of the present state."""
        return self.recorder.time, self.recorder.q, self.system.memory()

    @property
    def step_size(self) -> float:
        """Size of the next step, s."""
        return float(self.path.numbers[stepping.SIZE])

    @step_size.setter
    def step_size(self, size: float) -> None:
        self.path.numbers[stepping.SIZE] = size

    def _stops(self) -> np.ndarray:
        """Times at which a state is saved, or at which loads or drives are not smooth, up to the end, s."""
        end = self.settings.end_time
        return np.unique([*(at for at in self.recorder.pending + self.breaks if at < end), end])

    def _march(self) -> Reason | None:
        """Take many steps in one kernel, or one step in Python; return None, or the reason why none is possible.

        After a rejection in the kernel that a shorter step does not help, Python repeats the step, to find its reason.
        """
        left = min(self.every - (self.statistics.steps - self.renewed), self.settings.max_steps - self.statistics.steps)
        arrays = None
        if self.path.counts[stepping.KNOWN] > 1:
            arrays = self.system.static_arrays(self.newton.solver.ready)
        most = min(left, _FEW) if self.recorder.request.each_step else left
        if arrays is not None and self._march_arrays(arrays, max(1, most)):
            return None
        return self._in_python(follow, self._stops())

    def _march_arrays(self, arrays: StaticArrays, most: int) -> bool:
        """Take at most `most` steps in one kernel; return whether it took any."""
        path, recorder = self.path, self.recorder
        rows, outcome, memory = path.rows(most), stepping.LACKS, self.system.element_memory()
        self._begin()
        for _ in range(_PATTERNS):
            if self._doubtful:
                self._doubtful = False
                path.counts[stepping.JUDGED] = 1 + self._judge(arrays)
            arrays.prepare((recorder.time, recorder.q))
            stops = self._stops()
            if self.system.remembers:  # channels of a saved state read the memory
                stops = stops[stops > recorder.time * (1.0 + SAME)][:1]
            arguments = arrays.model, path, self.rules, stops, rows
            outcome = enter(arrays.model.calls.force, follow_arrays, *arguments)
            self._doubtful = outcome == stepping.DOUBTFUL
            if outcome not in (stepping.LACKS, stepping.DOUBTFUL) or path.counts[stepping.STEPS]:
                break
        if outcome == stepping.APART or Reason.of(outcome) is not None:
            path.numbers[stepping.SIZE] /= CUT
            path.counts[stepping.REJECTED] -= 1
        taken = int(path.counts[stepping.STEPS])
        if taken:
            q = path.q.copy()
            arrays.followed(q)
            self._take(rows[:taken], arrays.observation, q, memory)
        self._end()
        if taken:
            self._finish(may_renew=True)
        return taken > 0

    def _judge(self, arrays: StaticArrays) -> int:
        """Stability of the state that the kernel has found, but could not judge: ACCEPTED, UNSTABLE, SLOWED or RELEASED."""
        path, before = self.path, (self.recorder.time, self.recorder.q)
        t, q = float(path.numbers[stepping.FOUND_AT]), path.found.copy()
        unknown = path.next_record[stepping.NEGATIVE] == stepping.UNKNOWN
        if unknown and self.newton.judged(t, q, before, arrays).ending is not Ending.CONVERGED:
            return stepping.UNSTABLE
        judgement = self.model.judged_at_rest(path, self.rules, t, q)
        return stepping.RELEASED if judgement == stepping.UNSTABLE else judgement

    def _in_python(self, steps: Callable[..., int], to: Any, single: bool = False) -> Reason | None:
        """Take one step by `follow` to the first of several times, or by `attempt` to one time (`single`)."""
        rows = self.path.rows(1)
        self._begin()
        with np.errstate(all="ignore"):
            outcome = steps(self.model, self.path, self.rules, to, rows[0] if single else rows)
        taken = bool(self.path.counts[stepping.STEPS])
        if taken:
            self._take(rows, lambda records: as_rows(self.model.observed), self.model.state)
        self._end()
        if outcome == stepping.APART:
            self._fail(Outcome.TORN)
        if taken:
            self._finish(may_renew=not single)
        return Reason.of(outcome)

    def _begin(self) -> None:
        """Write the present state to the path."""
        path, recorder = self.path, self.recorder
        path.numbers[stepping.TIME], path.numbers[stepping.REACTION] = recorder.time, recorder.largest_reaction
        path.balance[:] = recorder.energy_balance.numbers()
        path.q[:] = recorder.q
        if self._recorded is not recorder.last:
            write_record(recorder.last, path.record)

    def _end(self) -> None:
        """Add the counts of the path to those of the solve."""
        path, counts, newton = self.path, self.path.counts, self.newton
        self.recorder.energy_balance.set_numbers(path.balance)
        self._recorded = self.recorder.last
        self.statistics.steps += int(counts[stepping.STEPS])
        self.statistics.rejected += int(counts[stepping.REJECTED])
        newton.iterations += int(counts[stepping.ITERATIONS])
        newton.evaluations += int(counts[stepping.EVALUATIONS])
        newton.solver.factorisations += int(counts[stepping.FACTORISATIONS])
        self.at_event = bool(counts[stepping.AT_EVENT])
        counts[stepping.STEPS : stepping.LAST_ITERATIONS] = 0

    def _take(
        self, rows: np.ndarray, observation: Callable[[np.ndarray], Observation], q: np.ndarray,
        memory: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        """Record the steps of the path, and their damped snaps; arguments as in `PathRecorder.follow`."""
        before, unstable = mark(self.recorder), rows[:, stepping.MOVING_ON] > 0.0
        self.recorder.follow(self.path, rows, observation, q, memory)
        for number in np.flatnonzero(np.diff(unstable, prepend=self.lost is not None)):
            if unstable[number]:
                self.lost = self._mark_of(rows[number - 1]) if number else before
            else:
                assert self.lost is not None
                self._note("damped snap", self.lost, self._mark_of(rows[number]))
                self.lost = None
        self.model.rejection = ""

    def _mark_of(self, row: np.ndarray) -> Mark:
        """State of a row of the path, as the end of an event."""
        (record,), drives = self.path.parts(row[None])[1], len(self.recorder.last.drive.travel)
        first = record[[stepping.DRIVES, stepping.DRIVES + drives]].tolist() if drives else (0.0, 0.0)
        return Mark(float(row[stepping.AT]), *first)

    def _finish(self, may_renew: bool) -> None:
        """End a step: it may be a restart point."""
        recorder = self.recorder
        due = self.statistics.steps - self.renewed >= self.every and self.lost is None
        renews = may_renew and due and recorder.time < self.settings.end_time
        end = recorder.finish_step(self._state() if renews else None)
        if renews:
            self._renew(end)

    def _state(self) -> State:
        """State of the solve for a restart."""
        path = self.path
        counts = *self._counts(), self.statistics.newton_iterations, self.statistics.rejected
        return {
            **self.recorder.state(),
            **{f"path_{name}": getattr(path, name).copy() for name in _RESTART},
            "memory": self.system.memory(),
            "counted": self.system.counters(),
            "anchor_time": np.array([self.anchor[0]]),
            "anchor": self.anchor[1],
            "anchor_memory": self.anchor[2],
            "counts": np.array(counts),
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
        self.recorder.resume(end)
        self.anchor = float(state["anchor_time"][0]), state["anchor"], state["anchor_memory"]
        for name in _RESTART:
            getattr(self.path, name)[:] = state[f"path_{name}"]
        self.path.numbers[stepping.COARSE_AT] = -math.inf
        self._recorded, self._doubtful = None, False
        self.path.counts[stepping.JUDGED] = 0
        self.model = SystemPath(self.system, newton, self.recorder)

    def _size(self, increment: np.ndarray) -> float:
        return float(largest_ratio(increment, self.newton.scales.span))

    def _forget(self) -> None:
        """Restart the extrapolation at the present state."""
        path, recorder = self.path, self.recorder
        path.counts[[stepping.KNOWN, stepping.EARLIER, stepping.RESTING]] = 0
        path.found_efforts[:] = self.newton.efforts(recorder.time, recorder.q)
        self._doubtful = False
        remember(path, self.system.progress(recorder.time), recorder.q, path.found_efforts)

    def _predicted(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Configuration and efforts at time t by extrapolation; those of the present state if it is the only one."""
        path, q = self.path, self.recorder.q
        if path.counts[stepping.KNOWN] > 1:
            extrapolate(self.model, path, self.system.progress(t))
            q = self.system.retract(q, path.increment)
        else:
            path.next_efforts[:] = path.efforts[0]
        return q, path.next_efforts.copy()

    def _judge_energy(self) -> None:
        judged = self.recorder.time >= self.settings.judged_from
        if judged and self.recorder.is_off(self.settings.energy_abort):
            self._fail(Outcome.ENERGY_OF_STATICS)

    def _note(self, kind: str, begin: Mark, end: Mark | None = None) -> None:
        """Record an event that ends at the present state, or at an earlier one."""
        end = end or mark(self.recorder)
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
        if np.any(self.model.failed):
            what = "Not held" if outcome is Outcome.MECHANISM else "Largest residual at"
            text += f". {what}: {self.system.worst_body(self.model.failed)}"
        if self.model.rejection:
            text += f". {self.model.rejection}"
        elif self.reason is not None and outcome is not Outcome.MECHANISM:
            text += f". Last rejected static step: {self.reason.value[1]}"
        joint = self.model.joint
        if outcome is not Outcome.TORN:
            _, joint = self.system.max_joint_opening(recorder.time, recorder.q)
        raise NotConverged(f"{text}. Joint strained most: {joint}")


def mark(recorder: PathRecorder) -> Mark:
    """Present state as the end of an event."""
    drive = recorder.last.drive
    first = (float(drive.travel[0]), float(drive.force[0])) if len(drive.travel) else (0.0, 0.0)
    return Mark(recorder.time, *first)
