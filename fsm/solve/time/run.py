"""Time integration of a system: common part of all methods.

Dissipated and input power are integrated over every step. SciPy's methods use three Gauss points on their dense output;
generalized-alpha uses the trapezoidal rule and mean rates. The reactions of the drives are evaluated at the same times, so a
peak between steps is not missed.
"""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from fsm.errors import EnergyAbort, NotConverged
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.equations.newton import negative_pivots
from fsm.solve.interface.records import Observation
from fsm.solve.interface.system import System
from fsm.solve.outcome.energy_balance import JUDGED_FROM, EnergyBalance
from fsm.solve.outcome.restart_points import State, steps_between
from fsm.solve.outcome.run_io import (
    AcceptedStep,
    CurvePoint,
    InitialState,
    OutputRequest,
    SavedState,
    Statistics,
    inertia_counts,
    time_and_travel,
)
from fsm.solve.outcome.status import TORN, Outcome
from fsm.solve.settings import Settings

_FAST = 1e-2
"""Kinetic energy relative to the reference energy, above which a force of the drives is dynamic."""
_HOPELESS = 0.5
"""Energy error, relative to the reference energy, above which a solve stops at once."""
_AS_LONG_AGAIN = 2.0
"""A smaller error stops the solve when the time exceeds this multiple of the last time without the error; the reference
energy may grow until then."""
_ROUNDING = 1e-13
"""Relative difference of times below which they are equal."""


class Run(ABC):
    """Common part of all methods: state, energy balance, saved states, checks, failures."""

    def __init__(self, system: System, settings: Settings, request: OutputRequest, initial_state: InitialState) -> None:
        self.system, self.settings, self.request = system, settings, request
        start, energy_balance, after = initial_state.start, initial_state.energy_balance, initial_state.after
        self.begun = time.perf_counter()
        self.statistics = Statistics(settings.method, points=initial_state.points)
        self.every = steps_between(system.nu)
        self.saved = -math.inf
        self._pivots = LinearSolver()
        breaks = [settings.end_time, *system.break_times()]
        times = _at_breaks([t for t in request.save_times if t <= settings.end_time], breaks)
        if after is not None:
            assert energy_balance is not None
            self.energy_balance = energy_balance
            self.pending = [t for t in times if t > after.time]
            system.hold_still(False)
            self._renew(after)
            return
        self.renewed = 0
        self.state: State | None = None
        self.time, self.q, self.u = (0.0, *system.initial()) if start is None else start
        system.clear_caches(np.zeros(0))
        if start is None:
            system.restore(np.zeros(0))
        self.q, self.u = self.q.copy(), self.u.copy()
        system.hold_still(False)
        system.consistent(just_after(system, self.time), self.q, self.u, np.zeros(len(self.u)))
        system.commit(self.time, self.q, self.u)
        self.pending = [t for t in times if t >= self.time]
        self.last = system.observe(just_after(system, self.time), self.q, self.u)
        if energy_balance is None:
            energy_balance = EnergyBalance.opened(self.last.energy, system.scales().work)
        self.energy_balance = energy_balance
        self.balanced = self.time
        self._look(self.time, self.q, self.u, self.last)
        self._balance(self.last)
        if self.pending and self.pending[0] <= self.time:
            self.pending.pop(0)
            self._save(self.time, self.q, self.u, self.last, self.energy_balance)

    @abstractmethod
    def go(self) -> None:
        """Step to the end."""

    def _renew(self, end: AcceptedStep) -> None:
        """Reset the run to the data of a restart point."""
        assert end.state is not None
        self.time, self.q, self.u, self.renewed, self.state = end.time, end.q, end.u, end.steps, end.state
        self.statistics.steps = end.steps
        self.statistics.smallest_step = float(end.state["smallest_step"][0])
        self.balanced = float(end.state["balanced"][0])
        self.system.clear_caches(end.state["counted"])
        self.system.restore(end.state["memory"])
        self.last = self.system.observe(self.time, self.q, self.u)

    def _arrive(self, t: float, q: np.ndarray, u: np.ndarray, state: Callable[[], State]) -> bool:
        """Complete a step whose energies are accounted for and whose states are saved; return whether it is a restart point.

        `state` returns the restart data of the method's solver.
        """
        self.time, self.q, self.u = t, q, u
        judged = self.settings.judge_losses or t >= self.settings.end_time
        off = self.energy_balance.relative_drift if judged else self.energy_balance.relative_gain
        if off <= self.settings.energy_abort:
            self.balanced = t
        elif self._off_for_long(t, off):
            self._fail(Outcome.ENERGY if self.settings.step is None else Outcome.ENERGY_OF_FIXED_STEPS)
        if len(self.last.drive.travel):  # only drives can pull a structure beyond its full length
            apart, joint = self.system.max_joint_opening(t, q)
            if apart > TORN * self.system.scales().length:
                self._fail(Outcome.TORN, f"Joint strained most: {joint}")
        if self.statistics.steps >= self.settings.max_steps and t < self.settings.end_time:
            self._fail(Outcome.TOO_MANY_STEPS)
        end = AcceptedStep(t, q, u, self.statistics.steps)
        renews = end.steps - self.renewed >= self.every and t < self.settings.end_time
        if renews:
            own = {
                "memory": self.system.memory(),
                "counted": self.system.counters(),
                "smallest_step": np.array([self.statistics.smallest_step]),
                "balanced": np.array([self.balanced]),
            }
            end = replace(end, state=own | state())
        if self.request.on_step is not None:
            self.request.on_step(end)
        if renews:
            self._renew(end)
        return renews

    def _off_for_long(self, t: float, off: float) -> bool:
        """Whether the energy error `off` at time t is too large, or has exceeded its bound for too long."""
        start, end = self.settings.start_time, self.settings.end_time
        patience = JUDGED_FROM * (end - start)
        if off <= _HOPELESS:
            patience = _AS_LONG_AGAIN * max(self.balanced - start, patience)
        return t >= min(end, start + patience)

    def _look(self, t: float, q: np.ndarray, u: np.ndarray, observed: Observation, steady: bool = False) -> None:
        points = self.statistics.points
        points.append(CurvePoint.after(points, t, observed, self._moves(t, q, u, observed, steady)))

    def _moves(self, t: float, q: np.ndarray, u: np.ndarray, observed: Observation, steady: bool) -> bool:
        """Whether forces of the drives are dynamic: in a fast motion, or while the state leaves an unstable
        equilibrium.

        `steady`: the state is near a stable equilibrium.
        """
        if not len(observed.drive.force):
            return False
        if observed.energy.kinetic > _FAST * self.energy_balance.turnover:
            return True
        if steady:
            return False
        return inertia_counts(self.system, t, q, u, observed) or negative_pivots(self.system, t, q, self._pivots) > 0

    def _balance(self, observed: Observation) -> None:
        self.energy_balance.balance(observed.energy.stored, observed.energy.kinetic)

    def _save(self, at: float, q: np.ndarray, u: np.ndarray, observed: Observation, balance: EnergyBalance) -> None:
        q = self.system.retract(q, np.zeros(self.system.nu))  # SciPy's methods change the norm of quaternions
        balances = balance.dissipated, balance.work, balance.residual(observed.energy.stored), balance.pair_energy
        self.request.on_save(SavedState(at, q, u.copy(), observed, *balances, numerical=balance.numerical))
        self.saved = at

    def _fail(self, outcome: Outcome, detail: str = "") -> None:
        self.statistics.outcome = outcome
        worst = self.system.worst_body(self.system.acceleration(self.time, self.q, self.u))
        where = time_and_travel(self.system, self.time, self.statistics.points[-1].drive)
        text = f"{where}, step {self.statistics.steps}, method {self.settings.method}: {outcome.value}"
        text += f". Fastest changing body: {worst}" + (f". {detail}" if detail else "")
        if outcome in (Outcome.ENERGY, Outcome.ENERGY_OF_FIXED_STEPS):
            raise EnergyAbort(f"{text}. {self.energy_balance.text}")
        raise NotConverged(text)


def just_after(system: System, t: float) -> float:
    """Time at which a step of a run starts. Unless it is zero, this time is slightly after t, so that drives that stop at t
    are at rest.
    """
    return math.nextafter(t, math.inf) if t > 0.0 and t in system.break_times() else t


def _at_breaks(times: Sequence[float], breaks: Sequence[float]) -> list[float]:
    """Times; a time that equals a break except for round-off is replaced by the break, which avoids tiny steps."""
    found = []
    for t in times:
        near = [b for b in breaks if abs(b - t) <= _ROUNDING * abs(b)]
        found.append(near[0] if near else t)
    return found
