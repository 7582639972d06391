"""Runs of SciPy's methods, with dense output between the ends of steps."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from fsm.solve.interface.records import Energy
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.restart_points import State
from fsm.solve.outcome.status import Outcome
from fsm.solve.time.jointed_equations import equations_of
from fsm.solve.time.run import Run
from fsm.solve.time.scipy_ivp import make_solver, resume, solver_state

_NODES = 0.5 + 0.5 * np.array([-math.sqrt(0.6), 0.0, math.sqrt(0.6)])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
_ENDS_AT_SAVES = ("Radau", "Radau-blocks")
"""SciPy's methods whose steps end at every saved time."""
_RARELY = {"LSODA": 8}
"""Factor on the steps between restart points, for methods that restart with short steps of low order."""
_STAGES = {"Radau": 3, "Radau-blocks": 3, "BDF": 1, "LSODA": 1}
"""Number of evaluations of the right-hand side in one Newton iteration."""
_NEXT_TO = 1e-9
"""Difference of times, relative to the step, below which they count as equal."""


class DenseRun(Run):
    """SciPy's methods; powers are integrated by Gauss's three points on their dense output."""

    def go(self) -> None:
        """See `Run`."""
        settings = self.settings
        self.equations = equations_of(self.system)
        # a one-step method may stop at every save; with interpolation between steps, the forces of stiff springs have
        # far larger errors than the positions (rigid panels at rtol 1e-5: 5e-3 in forces, 4e-4 in positions)
        exact = settings.method in _ENDS_AT_SAVES
        self.factorisations = 0
        self.every *= _RARELY.get(settings.method, 1)
        solver = self._solver()
        try:
            while solver.status == "running" or (exact and solver.t < settings.end_time):
                if exact:
                    solver.t_bound = self.pending[0] if self.pending else settings.end_time
                    solver.status = "running"
                    stretch(solver)
                message = solver.step()
                self._count(solver)
                if message is not None:
                    self._fail(Outcome.STEP_TOO_SMALL, f"Solver: {message}")
                state = solver.state() if hasattr(solver, "state") else solver.y
                if not np.all(np.isfinite(state)):
                    self._fail(Outcome.NOT_FINITE)
                dense = solver.interpolant() if hasattr(solver, "interpolant") else solver.dense_output()
                before = replace(self.energy_balance)
                self._account(solver.t, state, dense)
                while self.pending and self.pending[0] <= solver.t:
                    self._save_between(self.pending.pop(0), solver.t, dense, before)
                q, u = self.equations.at(solver.t, state.copy())
                rejection = self.system.rejection(solver.t, q, u, solver.t - self.time)
                if rejection is not None and rejection.reason:  # these methods cannot repeat a step with another size
                    self._fail(Outcome.CROSSED, rejection.reason)
                self.system.commit(solver.t, q, u)
                if self._arrive(solver.t, q, u, partial(self._state, solver)):
                    solver = self._solver()
        finally:
            self._count(solver, step=False)

    def _solver(self) -> Any:
        """New solver at the present state; it continues from the last restart point, if any."""
        settings, state = self.settings, np.concatenate([self.q, self.u])
        if self.state is not None:
            counts = [int(count) for count in self.state["counts"]]
            self.equations.force_calls, self.equations.jacobian_calls, self.factorisations = counts
        solver = make_solver(
            settings.method, self.equations, self.time, state, settings.end_time, settings.rtol, settings.max_step
        )
        if self.state is not None:
            resume(solver, self.state)
        return solver

    def _state(self, solver: Any) -> State:
        counts = self.equations.force_calls, self.equations.jacobian_calls, self.statistics.factorisations
        return {**solver_state(solver), "counts": np.array(counts)}

    def _count(self, solver: object, step: bool = True) -> None:
        statistics = self.statistics
        statistics.steps += int(step)
        statistics.force_evaluations = self.equations.force_calls
        statistics.jacobian_evaluations = self.equations.jacobian_calls
        statistics.factorisations = self.factorisations + int(getattr(solver, "nlu", 0))
        statistics.newton_iterations = self.equations.force_calls // _STAGES[statistics.method]
        statistics.wall_time = time.perf_counter() - self.begun
        size = getattr(solver, "step_size", None)
        if step and size:
            statistics.smallest_step = min(statistics.smallest_step, float(size))

    def _account(self, end: float, state: np.ndarray, dense: Callable[[float], np.ndarray]) -> None:
        """Integrate the powers over the step and check the balance at its end."""
        step = end - self.time
        self._driven = self.last.energy.driven
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            at = self.time + node * step
            q, u = self.equations.at(at, dense(at))
            observed = self.system.observe(at, q, u)
            self._add(self.energy_balance, weight * step, observed.energy)
            self._look(at, q, u, observed)
        q, u = self.equations.at(end, state)
        self.last = self.system.observe(end, q, u)
        self.energy_balance.work += self.last.energy.driven - self._driven
        self._look(end, q, u, self.last)
        self._balance(self.last)

    @staticmethod
    def _add(energy_balance: EnergyBalance, duration: float, energy: Energy) -> None:
        """Add the powers of a state over a time."""
        energy_balance.add(duration * energy.input_power, duration * energy.dissipated_power, duration * energy.pair_power)

    def _save_between(self, at: float, end: float, dense: Callable[[float], np.ndarray], before: EnergyBalance) -> None:
        """Save states inside or at the end of a step, with the integrals up to their times."""
        if at >= end:
            self._save(end, *self.equations.at(at, dense(at)), self.last, self.energy_balance)
            return
        step = at - self.time
        until = replace(before)
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            t = self.time + node * step
            self._add(until, weight * step, self.system.energy(t, *self.equations.at(t, dense(t))))
        q, u = self.equations.at(at, dense(at))
        observed = self.system.observe(at, q, u)
        until.work += observed.energy.driven - self._driven
        self._save(at, q, u, observed, until)


def stretch(solver: Any) -> None:
    """Extend a step that ends within round-off before its bound, to avoid a tiny step after it."""
    left = solver.t_bound - solver.t
    if abs(solver.h_abs - left) < _NEXT_TO * left:
        solver.h_abs = (1.0 + _NEXT_TO) * left  # the solver stops exactly at its bound
