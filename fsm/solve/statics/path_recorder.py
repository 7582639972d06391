"""Recorder of a quasi-static path: saved states, energy balance, force curve, counters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fsm.solve.interface.records import DriveState, Observation, PreviousState, as_rows, mapped, row_of
from fsm.solve.interface.system import System
from fsm.solve.outcome.energy_balance import EnergyBalance, load_work
from fsm.solve.outcome.restart_points import State, observation_from, observation_state
from fsm.solve.outcome.run_io import (
    AcceptedStep,
    CurvePoint,
    InitialState,
    OutputRequest,
    SavedState,
    Statistics,
    inertia_counts,
)
from fsm.solve.stepping.march import (
    ALLOWED,
    BALANCE,
    DISSIPATED,
    DRIVEN,
    ERROR,
    LOSSES,
    LOST,
    POWER,
    ROUND_OFF,
    SHORTEST,
    START,
    TURNOVER,
    WORK,
)
from fsm.solve.stepping.model import CREASES as OF_CREASES
from fsm.solve.stepping.model import DRIVES as OF_DRIVES
from fsm.solve.stepping.model import PANELS as OF_PANELS
from fsm.solve.stepping.model import TIME as OF_TIME
from fsm.solve.stepping.path import is_off
from fsm.solve.stepping.path_state import (
    AT,
    CREASES,
    DRIVES,
    MOVING_ON,
    NEGATIVE_AT_REST,
    PAIR_FORCE,
    PANELS,
    REACTION,
    Path,
)
from fsm.solve.time.array_steps import StepMethod


class StepEnergy(NamedTuple):
    """Work and dissipated energy of a step, J; `of_pairs` (2, n_pairs): part of friction and damping of contact pairs."""

    work: float
    dissipated: float
    of_pairs: np.ndarray


class PathRecorder:
    """Recorder of a quasi-static path with dynamic phases.

    Parameters
    ----------
    system : System
    statistics : updated during the solve
    request, initial_state : OutputRequest and InitialState
        Requested output, and state at the start. If the solve continues from a restart point, the caller must call `resume`
        next.
    time, q, u : initial state
    """

    def __init__(
        self,
        system: System,
        statistics: Statistics,
        request: OutputRequest,
        initial_state: InitialState,
        time: float,
        q: np.ndarray,
        u: np.ndarray,
    ) -> None:
        self.system, self.statistics, self.request = system, statistics, request
        save_times, energy_balance, after = request.save_times, initial_state.energy_balance, initial_state.after
        self.time, self.q, self.u = time, q, u
        self._extent = system.scales().extent
        self._saved = -np.inf
        self._before: PreviousState | None = None
        self._pivots: int | None = None
        self._passed: tuple[tuple[float, np.ndarray], ...] = ()
        # the recorder treats times that differ by less than this as equal
        self._nothing = 1e-12 * max(save_times, default=0.0)
        if after is not None:
            assert energy_balance is not None
            self.energy_balance = energy_balance
            statistics.events = list(after.events)
            self.pending = [t for t in save_times if t > time + self._nothing]
            return
        system.commit(time, q, u)
        # the state is evaluated at rest, because drives that start without a run-up would cause damper forces
        self.last = system.observe(time, q, u if u.any() else None)
        self.energy_balance = EnergyBalance.opened(self.last.energy) if energy_balance is None else energy_balance
        self.largest_reaction = self.last.reaction
        self.pending = [t for t in save_times if t >= time]
        statistics.points.append(CurvePoint.after(statistics.points, time, self.last, dynamic=False))
        self._save()

    def state(self) -> State:
        """State of the recorder for a restart, besides time, q, u, energy balance and curve."""
        return {
            **observation_state(self.last),
            "bounds": np.array([self.largest_reaction, self._saved]),
        }

    def resume(self, end: AcceptedStep) -> None:
        """Continue from a restart point (see `state`)."""
        state = end.state
        assert state is not None
        self.time, self.q, self.u = end.time, end.q, end.u
        stored_by = list(self.system.energy(end.time, end.q, None).potential)
        self.last = observation_from(state, stored_by)
        self.largest_reaction, self._saved = state["bounds"].tolist()

    def next_save(self, end: float) -> float:
        """Time of the next state to be saved, or `end`."""
        return self.pending[0] if self.pending else end

    def follow(
        self, path: Path, rows: np.ndarray, observation: Callable[[np.ndarray], Observation], last: np.ndarray,
        memory: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        """Record the steps of a path (`fsm.solve.stepping.path`); the caller must call `finish_step` next.

        `observation` is the function of several records, `last` the last configuration. `memory`: `element_memory` before
        the first step, if a kernel has taken them.
        """
        curve, drives = self.statistics.points, len(self.last.drive.travel)
        forces, pairs = DRIVES + drives, DRIVES + 2 * drives
        dissipated, count, saved = self.energy_balance.pair_energy, len(rows), []
        balances, records, pair_energies, states = path.parts(rows)
        pair_forces = records[:, pairs:].reshape(count, 7, -1)[:, PAIR_FORCE]
        numbers = rows[:, [AT, MOVING_ON]].tolist(), records[:, [PANELS, CREASES]].tolist()
        for number, ((time, moving_on), energies) in enumerate(zip(*numbers, strict=True)):
            drive = DriveState(records[number, DRIVES:forces], records[number, forces:pairs])
            path_number = CurvePoint.path_after(curve, bool(moving_on))
            curve.append(CurvePoint(drive, pair_forces[number], time, path_number, *energies))
            if self._is_due(time):
                saved.append(number)
        begins, starts = np.append(self.time, rows[:-1, AT]), [self.q, *states[:-1]]
        chosen = saved if count - 1 in saved else [*saved, count - 1]
        times, q = rows[chosen, AT], states[chosen]
        before = begins[chosen], np.array([starts[number] for number in chosen])
        moved = np.array([self.system.difference(start, end) for start, end in zip(before[1], q, strict=True)])
        own = times, q, moved / (times - before[0])[:, None], observation(records[chosen])
        balance = balances[chosen].T
        energies_of_pairs = dissipated + pair_energies[chosen]
        counted = drives > 0 and self.system.rate_dependent  # records of a path without drives have no count
        pivots = records[chosen, NEGATIVE_AT_REST].astype(np.int64) if counted else None
        sums = balance[DISSIPATED], balance[WORK], balance[ERROR], energies_of_pairs
        found = SavedState(*own, *sums, before, negative_pivots=pivots, numerical=balance[LOST])
        if saved and memory is not None and self.system.replays:
            found = replace(found, element_memory=self.system.replayed(memory, rows[:, AT], states)[chosen])
        self._keep(found, len(saved))
        self.energy_balance.set_numbers(balances[-1])
        self.energy_balance.pair_energy = energies_of_pairs[-1]
        self.time, self.q, self.u, self.last = float(times[-1]), last, own[2][-1], row_of(own[3], -1)
        self._pivots = None if pivots is None else int(pivots[-1])
        self._before = float(before[0][-1]), before[1][-1]
        if self.request.each_step:
            self._passed = tuple(zip(rows[:-1, AT].tolist(), states[:-1].copy(), strict=True))
        self.largest_reaction = float(path.numbers[REACTION])
        path.pair_energy[:] = 0.0

    def _keep(self, found: SavedState, count: int) -> None:
        """Save the first of several states."""
        if not count:
            return
        self._saved = float(found.time[count - 1])
        if not self.request.several:
            memories = found.element_memory
            for number in range(count) if memories is None else self.system.in_turn(memories[:count]):
                self.request.on_save(row_of(found, number))
        else:
            self.request.on_save(mapped(found, lambda value: value[:count]))

    def is_off(self, bound: float) -> bool:
        """See `fsm.solve.stepping.path.is_off`."""
        return is_off(self.energy_balance.numbers(), self.largest_reaction, self._extent, bound)

    def march(self, solver: StepMethod, until: float, most: int, allowed: float) -> tuple[np.ndarray, StepEnergy]:
        """Take at most `most` steps of a time integrator in a kernel; returns records of all steps, and their energies.

        The steps end early when their energy balance residual exceeds `allowed` times the reference energy.
        """
        drives, balance = len(self.last.drive.travel), np.zeros(BALANCE)
        solver.recorded = OF_DRIVES + 2 * drives + len(self.last.pairs.force)
        balance[START], balance[POWER] = self.last.energy.stored_except_driven, self.last.energy.input_power
        balance[TURNOVER], balance[ROUND_OFF] = self.energy_balance.turnover, self.energy_balance.round_off_floor
        balance[SHORTEST], balance[ALLOWED], balance[LOSSES] = np.inf, allowed, 1.0
        records = solver.march(balance, until, most, every=True)
        work = balance[WORK] - balance[DRIVEN]
        return records, StepEnergy(float(work), float(balance[DISSIPATED]), solver.pair_energy)

    def loss(self, observed: Observation, step_energy: StepEnergy) -> float:
        """Energy balance residual of steps of a time integrator, over the reference energy."""
        work, dissipated, _ = step_energy
        off = abs(observed.energy.stored_except_driven - self.last.energy.stored_except_driven + dissipated - work)
        return off / self.energy_balance.turnover if self.energy_balance.turnover > 0.0 else 0.0

    def dynamic(
        self, t: float, q: np.ndarray, u: np.ndarray, observed: Observation, step_energy: StepEnergy, near_equilibrium: bool,
        records: np.ndarray, near_all_along: bool,
    ) -> None:  # fmt: skip
        """Record steps of a time integrator.

        `near_equilibrium`: they end near a stable equilibrium. `records` are those of the steps before the last one, and
        `near_all_along` whether these steps were near stable equilibria too.
        """
        moving = not near_equilibrium or inertia_counts(self.system, t, q, u, observed)
        points, pairs, passed = self.statistics.points, len(observed.pairs.force), []
        forces = OF_DRIVES + len(observed.drive.travel)
        of_pairs = 2 * forces - OF_DRIVES
        for record in records.copy():
            drive = DriveState(record[OF_DRIVES:forces], record[forces:of_pairs])
            path = CurvePoint.path_after(points, moving or not near_all_along)
            contacts, state = record[of_pairs : of_pairs + pairs], record[of_pairs + pairs :]
            time, panels, creases = record[[OF_TIME, OF_PANELS, OF_CREASES]].tolist()
            points.append(CurvePoint(drive, contacts, time, path, panels, creases))
            passed.append((time, state[: len(q)]))
        if self.request.each_step:
            self._passed = tuple(passed)
        self.statistics.steps += len(records)
        self.energy_balance.add(*step_energy)
        self._take(t, q, u, observed, observed.energy.stored_except_driven, moving)
        self.finish_step()

    def begin_motion(self) -> None:
        """Change from statics to dynamics: add the kinetic energy, which statics neglects, to the work."""
        self.energy_balance.work += self.last.energy.kinetic

    def jump_admissible(self, t: float, q: np.ndarray, observed: Observation) -> bool:
        """Whether a jump to a state is admissible: nothing passes through a face, and the energy does not increase by
        more than the work.
        """
        if self.system.rejection(t, q, None, t - self.time) is not None:
            return False
        travel = np.abs(observed.drive.travel - self.last.drive.travel)
        given = float((np.abs(self.last.drive.force) + np.abs(observed.drive.force)) @ travel)
        given += 2.0 * abs(load_work(self.system, (self.time, self.q), (t, q)))
        gained = observed.energy.stored_at_rest - self.last.energy.stored_at_rest
        return bool(gained <= given + 1e-6 * self.energy_balance.turnover)

    def slide(self, t: float, q: np.ndarray, observed: Observation) -> None:
        """Record an instantaneous jump: the loss of stored energy and the work of drives and loads are dissipated."""
        forces = 0.5 * (self.last.drive.force + observed.drive.force)
        work = float(forces @ (observed.drive.travel - self.last.drive.travel))
        work += load_work(self.system, (self.time, self.q), (t, q))
        self.energy_balance.work += work
        self.energy_balance.dissipated += work + self.last.energy.stored_at_rest - observed.energy.stored_at_rest
        rest = np.zeros_like(self.u)
        self.system.commit(t, q, rest)
        self._take(t, q, rest, observed, jumped=True)
        self.finish_step()

    def _take(
        self,
        t: float,
        q: np.ndarray,
        u: np.ndarray,
        observed: Observation,
        stored: float | None = None,
        dynamic: bool = False,
        jumped: bool = False,
    ) -> None:
        """Set the present state; `stored` is its energy if inertia is included, None in statics."""
        self.time, self.q, self.u, self.last, self._before, self._pivots = t, q, u, observed, None, None
        if stored is None:
            self.largest_reaction = max(self.largest_reaction, observed.reaction)  # in statics only
            self.energy_balance.balance(observed.energy.stored_at_rest, 0.0)
        else:
            self.energy_balance.balance(stored, observed.energy.kinetic)
        points = self.statistics.points
        points.append(CurvePoint.after(points, t, observed, dynamic, jumped))
        self.statistics.steps += 1
        self._save()

    def finish_step(self, state: State | None = None) -> AcceptedStep:
        """Report the end of a step; `state` is the restart data at a restart point."""
        events, passed, self._passed = tuple(self.statistics.events), self._passed, ()
        end = AcceptedStep(self.time, self.q, self.u, self.statistics.steps, events, state, passed)
        if self.request.on_step is not None:
            self.request.on_step(end)
        return end

    def save_last(self, final: bool = False) -> None:
        """Save the last state, if it is not saved yet; `final` as in `SavedState`."""
        if self._saved < self.time:
            self.pending = [self.time]
            self._save(final)

    def _is_due(self, time: float) -> bool:
        """Whether a state at this time is to be saved; its times to save are no longer pending."""
        due = False
        while self.pending and self.pending[0] <= time + self._nothing:
            self.pending.pop(0)
            due = True
        return due

    def _save(self, final: bool = False) -> None:
        if self._is_due(self.time):
            energy_balance = self.energy_balance
            numbers = energy_balance.dissipated, energy_balance.work, energy_balance.error, energy_balance.pair_energy
            own = self.time, self.q.copy(), self.u.copy(), self.last, *numbers, self._before
            numerical = energy_balance.numerical
            self._keep(as_rows(SavedState(*own, negative_pivots=self._pivots, final=final, numerical=numerical)), 1)
