"""Runs of methods whose steps end at saved times: generalized-alpha, Newmark, mean-force, explicit."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from itertools import repeat

import numpy as np

from fsm.solve.interface.records import DriveState, Energy
from fsm.solve.outcome.run_io import CurvePoint, SavedState, observed_at
from fsm.solve.outcome.status import StepFailed
from fsm.solve.stepping.march import DISSIPATED, ERROR, LOST, POWER, SHORTEST, WORK
from fsm.solve.stepping.model import CREASES, DRIVES, KINETIC, PANELS, STEADY, TIME, TURNOVER
from fsm.solve.time.array_steps import COUNTED, StepMethod
from fsm.solve.time.event_steps import Events
from fsm.solve.time.explicit import Explicit
from fsm.solve.time.generalized_alpha import GeneralizedAlpha
from fsm.solve.time.mean_force import MeanForce
from fsm.solve.time.run import Run, just_after

GENERALIZED_ALPHA, NEWMARK, MEAN_FORCE, EXPLICIT = "generalized-alpha", "newmark", "mean-force", "explicit"
STEPWISE = GENERALIZED_ALPHA, NEWMARK, MEAN_FORCE, EXPLICIT

_MARCH, _MARCH_WORK = 1024, 500_000
"""Bounds if one kernel takes many steps: steps between restart points, and these steps times the number of velocities.
A kernel then returns within two seconds."""
_SAME = 1e-12
"""Relative difference of the time of an event and of the next saved state or the end, below which they are the same."""
_COST = {MEAN_FORCE: 4, EXPLICIT: 10}
"""Cost of a step relative to one of generalized-alpha."""


class StepwiseRun(Run):
    """Run of a method whose steps end at saved times; powers are integrated to the order of the method.

    Generalized-alpha integrates the input power by the trapezoidal rule. After a jump, for example where a drive stops, the
    next step starts with the new power. The other methods compute work and dissipated energy of their steps themselves.
    """

    def go(self) -> None:
        """See `Run`."""
        settings = self.settings
        solver = self._solver()
        events = None if self.request.watch is None else Events(self.request.watch, self.system, settings.rtol)
        try:
            while settings.end_time - solver.t > (0.0 if events is None else _SAME * settings.end_time):
                if events is not None and events.due(self._state()):
                    if self._happen(events):
                        break
                    solver = self._after_event(solver)
                    continue
                self._march(solver, events)
                if self._arrive(solver.t, solver.q, solver.u, solver.state):
                    solver = self._solver()
            else:
                if events is not None and events.due(self._state()):
                    self._happen(events)
        finally:
            self._count(solver)

    def _state(self) -> SavedState:
        """Present state, for conditions of events."""
        return SavedState(self.time, self.q, self.u, self.last, 0.0, 0.0, 0.0, np.zeros(0))

    def _happen(self, events: Events) -> bool:
        """Let events happen whose conditions are true; returns whether the step ends.

        A loss of energy, as in a joint that locks suddenly, is dissipated, and a gain is external work.
        """
        system, balance = self.system, self.energy_balance
        ends = events.happen(self._state())
        if ends:
            balances = balance.dissipated, balance.work, balance.error, balance.pair_energy
            if self.time > self.saved:
                own = self.time, self.q, self.u.copy(), self.last, *balances
                self.request.on_save(SavedState(*own, numerical=balance.numerical, final=True))
        self.q, self.u, self.state, before = self.q.copy(), self.u.copy(), None, self.last.energy.stored
        t = just_after(system, self.time)
        system.consistent(t, self.q, self.u, np.zeros(len(self.u)))
        system.commit(self.time, self.q, self.u)
        self.last = system.observe(t, self.q, self.u)
        change = self.last.energy.stored - before
        balance.work += max(change, 0.0)
        balance.dissipated += max(-change, 0.0)
        self._balance(self.last)
        while self.pending and self.pending[0] - self.time <= _SAME * abs(self.time):
            self.pending.pop(0)
            self._save(self.time, self.q, self.u, self.last, balance)
        return ends

    def _after_event(self, before: StepMethod) -> StepMethod:
        """Solver that starts at the present state and continues to count."""
        solver = self._solver()
        for number in COUNTED:
            solver.motion.counts[number] = before.motion.counts[number]
        return solver

    def _march(self, solver: StepMethod, events: Events | None) -> None:
        """Take many steps in one kernel, up to a saved time or a restart point; in Python and with events, take one step."""
        settings, energy_balance, statistics = self.settings, self.energy_balance, self.statistics
        last, smallest, losses = self.last.energy, statistics.smallest_step, float(settings.judge_losses)
        powers = last.input_power, smallest, settings.energy_abort, losses, last.driven
        balance = np.array([*energy_balance.numbers(), *powers])
        most = max(1, min(self.renewed + self.every, settings.max_steps) - solver.steps)
        drives, pairs = len(self.last.drive.travel), len(self.last.pairs.force)
        solver.recorded, every = DRIVES + 2 * drives + pairs, drives + pairs > 0
        memory = self.system.memory_in_place() if solver.marches and not every else None
        try:
            until = self.pending[0] if self.pending else settings.end_time
            if events is None and memory is not None and isinstance(solver, Explicit):
                solver.march_through(balance, np.array(self.pending or [until]), most, memory)
            elif events is None:
                records = solver.march(balance, until, most, every)
            else:
                balance, records = events.march(solver, balance, until, every)
        except StepFailed as error:
            self._save_passed(solver)
            self._count(solver)
            self._fail(error.outcome, error.reason)
        self._save_passed(solver)
        if every:
            self._look_at(records, drives, pairs)
        energy_balance.set_numbers(balance[:POWER])
        energy_balance.pair_energy = energy_balance.pair_energy + solver.pair_energy
        statistics.smallest_step = float(balance[SHORTEST])
        self._count(solver)
        if self.saved == solver.t and not every:
            return
        self.last = observed = solver.observe()
        if not every and solver.t > self.statistics.points[-1].time:
            self._look(solver.t, solver.q, solver.u, observed)
        if self.pending and self.pending[0] <= solver.t:
            self.pending.pop(0)
            self._save(solver.t, solver.q, solver.u, observed, energy_balance)

    def _save_passed(self, solver: StepMethod) -> None:
        """Save the states that a kernel has passed; the receiver may set the memory of the system to that of each."""
        passed = solver.passed() if isinstance(solver, Explicit) else []
        if not passed:
            return
        system, points, pairs = self.system, self.statistics.points, self.energy_balance.pair_energy
        latest, first, path = system.memory(), self.last, points[-1].path if points else 0
        del self.pending[: len(passed)]
        for state in passed:
            points.append(CurvePoint(first.drive, first.pairs.force, state.time, path, state.panels, state.creases))
            lost, work, error, numerical = state.balance[[DISSIPATED, WORK, ERROR, LOST]].tolist()
            own = state.time, state.q, state.u
            observed = partial(observed_at, system, state.time, state.q, state.u, state.memory)
            self.request.on_save(
                SavedState(*own, observed, lost, work, error, pairs, memory=state.memory, numerical=numerical)
            )
        self.saved = passed[-1].time
        system.restore(latest)

    def _look_at(self, records: np.ndarray, drives: int, pairs: int) -> None:
        """Add the points of the curve at the ends of recorded steps."""
        nq, forces = len(self.q), DRIVES + drives
        of_pairs = forces + drives
        state = of_pairs + pairs
        if not drives:
            self._add_pairs(records[:, of_pairs:state].copy(), records)
            return
        for record in records:
            stored = {"panels": float(record[PANELS]), "creases": float(record[CREASES])}
            observed = replace(
                self.last,
                drive=DriveState(record[DRIVES:forces].copy(), record[forces:of_pairs].copy()),
                pairs=replace(self.last.pairs, force=record[of_pairs:state].copy()),
                energy=Energy(float(record[KINETIC]), stored, 0.0, 0.0),
            )
            self.energy_balance.turnover = float(record[TURNOVER])
            q, u = record[state : state + nq].copy(), record[state + nq :].copy()
            self._look(float(record[TIME]), q, u, observed, steady=record[STEADY] == 1.0)

    def _add_pairs(self, forces: np.ndarray, records: np.ndarray) -> None:
        """Add the points of a curve without drives; they have the forces (m, n_pairs) of contact pairs."""
        first, points = self.last.drive, self.statistics.points
        path = points[-1].path if points else 0
        path += path % 2  # without drives, no drive force can be dynamic
        times, panels, creases = records[:, [TIME, PANELS, CREASES]].T.tolist()
        points.extend(map(CurvePoint, repeat(first), forces, times, repeat(path), panels, creases))

    def _solver(self) -> StepMethod:
        """New solver at the present state; it continues from the last restart point, if any."""
        settings = self.settings
        solver: StepMethod
        if settings.method == MEAN_FORCE:
            solver = MeanForce(
                self.system, self.time, self.q, self.u, settings.rtol, settings.step, settings.max_step
            )
        elif settings.method == EXPLICIT:
            solver = Explicit(self.system, self.time, self.q, self.u, settings.rtol, settings.max_step, self.last)
        else:
            rho_inf = None if settings.method == NEWMARK else settings.rho_inf
            solver = GeneralizedAlpha(
                self.system, self.time, self.q, self.u, settings.rtol, rho_inf, settings.step, settings.max_step, self.last
            )
        if solver.marches:
            work = _MARCH_WORK // _COST.get(settings.method, 1)
            self.every = max(self.every, min(_MARCH, work // max(self.system.nu, 1)))
        if self.state is not None:
            solver.resume(self.state)
        return solver

    def _count(self, solver: StepMethod) -> None:
        statistics = self.statistics
        statistics.steps = solver.steps
        statistics.rejected = solver.rejected + solver.failed
        statistics.force_evaluations = solver.force_evaluations + solver.linearisations
        statistics.jacobian_evaluations = solver.linearisations
        statistics.factorisations = solver.factorisations
        statistics.newton_iterations = solver.iterations
        statistics.wall_time = time.perf_counter() - self.begun
