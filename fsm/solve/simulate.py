"""Step a system through time, keep the energy ledger, and hand states over as they are wanted.

The ledger is stored energy + dissipated - work done = const. Dissipated and input power are integrated over every step: by
Gauss's three points on the dense output of SciPy's methods, by the trapezoidal rule and mean rates for generalized-alpha.
The reaction of the drives is looked at there too, so a peak between steps is not missed.
"""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from fsm.errors import EnergyAbort, NotConverged
from fsm.solve.dissipation import mean_dissipation
from fsm.solve.generalized_alpha import RHO_INF, GeneralizedAlpha
from fsm.solve.renewal import State, steps_between
from fsm.solve.scipy_ivp import FirstOrder, go_on, make_solver, solver_state
from fsm.solve.status import Event, Outcome, StepFailed
from fsm.system import DriveState, Energy, Observation, System

__all__ = ["JUDGED_FROM", "Ledger", "Saved", "Settings", "Statistics", "StepEnd", "simulate"]

_NODES = 0.5 + 0.5 * np.array([-math.sqrt(0.6), 0.0, math.sqrt(0.6)])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
GENERALIZED_ALPHA, NEWMARK = "generalized-alpha", "newmark"
_ENDS_AT_SAVES = ("Radau", "Radau-blocks")
"""SciPy's methods whose steps end at every saved time."""
_RARELY = {"LSODA": 8}
"""Methods that begin anew at a renewal point with short steps of low order: so many times as many steps lie between."""
_STAGES = {"Radau": 3, "Radau-blocks": 3, "BDF": 1, "LSODA": 1}
"""Right-hand sides that one Newton iteration evaluates."""
_NEXT_TO = 1e-9
"""Times that differ by less, relative to a step, are the same."""
_ROUNDING = 1e-13
"""Times that differ by less, relative to themselves, were meant to be the same."""
JUDGED_FROM = 0.1
"""Part of the run before which an energy error stops nothing: so little is turned over that tolerances look large."""


@dataclass(frozen=True)
class Settings:
    """How to integrate; see `fsm.scene.case.Solve`.

    Attributes
    ----------
    method : "Radau", "Radau-blocks", "BDF", "LSODA", "generalized-alpha" or "newmark"
    rtol : -
    end_time, max_step : s
    max_steps : int
    energy_abort : -
    rho_inf, step : -, s
        Of generalized-alpha only: spectral radius at infinity. Of both stepwise methods: fixed step, None for error control.
    """

    method: str
    rtol: float
    end_time: float
    max_step: float = math.inf
    max_steps: int = 200_000
    energy_abort: float = math.inf
    rho_inf: float = RHO_INF
    step: float | None = None


@dataclass
class Ledger:
    """Energy bookkeeping, J.

    `error` is the present imbalance, `worst` the largest so far, `turnover` the largest energy stored, dissipated or put
    in so far, which errors are measured against. `pair_energy` (2, n_pairs) is what friction and damping of every contact
    pair have dissipated.
    """

    start: float = 0.0
    dissipated: float = 0.0
    work: float = 0.0
    error: float = 0.0
    worst: float = 0.0
    turnover: float = 0.0
    kinetic_worst: float = 0.0
    pair_energy: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))

    @classmethod
    def opened(cls, energy: Energy) -> Ledger:
        """The ledger of a solve that begins in a state of that energy."""
        return cls(start=energy.stored, pair_energy=np.zeros_like(energy.pair_power))

    def add(self, work: float, dissipated: float, of_pairs: np.ndarray) -> None:
        """Add the work, what was dissipated, and what of that contact pairs took."""
        self.work += work
        self.dissipated += dissipated
        self.pair_energy = self.pair_energy + of_pairs

    def balance(self, stored: float, kinetic: float) -> None:
        """Compare with the energy stored now."""
        self.error = stored - self.start + self.dissipated - self.work
        self.worst = max(self.worst, abs(self.error))
        self.kinetic_worst = max(self.kinetic_worst, kinetic)
        self.turnover = max(
            self.turnover, abs(stored - self.start), abs(self.dissipated), abs(self.work), self.kinetic_worst
        )

    @property
    def relative_error(self) -> float:
        """Worst imbalance over the energy turned over; 0 when nothing happened."""
        return self.worst / self.turnover if self.turnover > 0.0 else 0.0


@dataclass(frozen=True)
class Saved:
    """A state that was asked for: time (s), q, u, what was observed, and the ledger's numbers (J)."""

    time: float
    q: np.ndarray
    u: np.ndarray
    observation: Observation
    dissipated: float
    work: float
    error: float
    pair_energy: np.ndarray


@dataclass(frozen=True)
class StepEnd:
    """End of a step.

    Attributes
    ----------
    time, q, u : s, (nq,) and (nu,) arrays
    steps : int
        So far.
    events : so far
    state : dict of arrays, or None
        At a renewal point (`fsm.solve.renewal`) what another solve goes on with from here.
    """

    time: float
    q: np.ndarray
    u: np.ndarray
    steps: int
    events: tuple[Event, ...] = ()
    state: State | None = None


@dataclass
class Statistics:
    """What a solve took, and the curve at every point looked at.

    `seen` holds the drives and contact forces at the ends of all steps (and Gauss points in them), in order of time;
    `newton_iterations` of SciPy's methods are evaluations of the right-hand side over the stages of one iteration.
    """

    method: str
    outcome: Outcome = Outcome.FINISHED
    steps: int = 0
    force_evaluations: int = 0
    jacobian_evaluations: int = 0
    factorisations: int = 0
    newton_iterations: int = 0
    wall_time: float = 0.0
    smallest_step: float = math.inf
    rejected: int = 0
    seen: list[tuple[DriveState, np.ndarray]] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)


def simulate(
    system: System,
    settings: Settings,
    save_times: Sequence[float],
    on_save: Callable[[Saved], None],
    on_step: Callable[[StepEnd], None] | None = None,
    start: tuple[float, np.ndarray, np.ndarray] | None = None,
    ledger: Ledger | None = None,
    seen: list[tuple[DriveState, np.ndarray]] | None = None,
    after: StepEnd | None = None,
) -> tuple[Statistics, Ledger]:
    """Integrate a system and report states at the times asked for.

    Parameters
    ----------
    system : System
    settings : Settings
    save_times : increasing times, s
    on_save : called with each saved state, in order
    on_step : called after every step
    start : time, q, u to begin with; the system's initial state if absent
    ledger, seen : to begin or go on with; changed in place
    after : StepEnd
        A renewal point of another solve of the same system to go on from, with its ledger and what it had seen there, as
        that one did: to the bit. Saved times are those of the whole.

    Raises
    ------
    NotConverged
        With the time, the worst body and what to try. What was saved until then has been handed over.
    EnergyAbort
    """
    kind = _StepwiseRun if settings.method in (GENERALIZED_ALPHA, NEWMARK) else _DenseRun
    run = kind(system, settings, save_times, on_save, on_step, start, ledger, [] if seen is None else seen, after)
    run.go()
    return run.statistics, run.ledger


class _Run(ABC):
    """What all methods share: the state, the ledger, saving, judging, failing."""

    def __init__(
        self,
        system: System,
        settings: Settings,
        save_times: Sequence[float],
        on_save: Callable[[Saved], None],
        on_step: Callable[[StepEnd], None] | None,
        start: tuple[float, np.ndarray, np.ndarray] | None,
        ledger: Ledger | None,
        seen: list[tuple[DriveState, np.ndarray]],
        after: StepEnd | None,
    ) -> None:
        self.system, self.settings = system, settings
        self.on_save, self.on_step = on_save, on_step
        self.begun = time.perf_counter()
        self.statistics = Statistics(settings.method, seen=seen)
        self.every = steps_between(system.nu)
        breaks = [*system.break_times(), settings.end_time]
        if after is not None:
            assert ledger is not None
            self.ledger = ledger
            self.pending = [t for t in _at_breaks(save_times, breaks) if after.time < t <= settings.end_time]
            self._renew(after)
            return
        self.renewed = 0
        self.state: State | None = None
        self.time, self.q, self.u = (0.0, *system.initial()) if start is None else start
        system.forget(np.zeros(0))
        if start is None:
            system.restore(np.zeros(0))
        system.commit(self.time, self.q, self.u)
        wanted = [t for t in save_times if self.time <= t <= settings.end_time]
        self.pending = _at_breaks(wanted, breaks)
        self.last = system.observe(self.time, self.q, self.u)
        self.ledger = Ledger.opened(self.last.energy) if ledger is None else ledger
        self._look(self.last)
        self._balance(self.last)
        if self.pending and self.pending[0] <= self.time:
            self.pending.pop(0)
            self._save(self.time, self.q, self.u, self.last, self.ledger)

    @abstractmethod
    def go(self) -> None:
        """Step to the end."""

    def _renew(self, end: StepEnd) -> None:
        """Have nothing but what the end of a step holds."""
        assert end.state is not None
        self.time, self.q, self.u, self.renewed, self.state = end.time, end.q, end.u, end.steps, end.state
        self.statistics.steps = end.steps
        self.statistics.smallest_step = float(end.state["smallest_step"][0])
        self.system.forget(end.state["counted"])
        self.system.restore(end.state["memory"])
        self.last = self.system.observe(self.time, self.q, self.u)

    def _arrive(self, t: float, q: np.ndarray, u: np.ndarray, state: Callable[[], State]) -> bool:
        """The end of a step, when all that belongs to it has been accounted for and saved; whether it was a renewal point.

        `state` gives what the method's solver goes on with from there.
        """
        self.time, self.q, self.u = t, q, u
        judged = t >= JUDGED_FROM * self.settings.end_time
        if judged and self.ledger.relative_error > self.settings.energy_abort:
            self._fail(Outcome.ENERGY)
        if self.statistics.steps >= self.settings.max_steps and t < self.settings.end_time:
            self._fail(Outcome.TOO_MANY_STEPS)
        end = StepEnd(t, q, u, self.statistics.steps)
        renews = end.steps - self.renewed >= self.every and t < self.settings.end_time
        if renews:
            own = {
                "memory": self.system.memory(),
                "counted": self.system.counted(),
                "smallest_step": np.array([self.statistics.smallest_step]),
            }
            end = replace(end, state=own | state())
        if self.on_step is not None:
            self.on_step(end)
        if renews:
            self._renew(end)
        return renews

    def _look(self, seen: Observation) -> None:
        self.statistics.seen.append((seen.drive, seen.pairs.force))

    def _balance(self, seen: Observation) -> None:
        self.ledger.balance(seen.energy.stored, seen.energy.kinetic)

    def _save(self, at: float, q: np.ndarray, u: np.ndarray, seen: Observation, ledger: Ledger) -> None:
        error = seen.energy.stored - ledger.start + ledger.dissipated - ledger.work
        q = self.system.retract(q, np.zeros(self.system.nu))  # SciPy's methods leave quaternions off their length
        self.on_save(Saved(at, q, u.copy(), seen, ledger.dissipated, ledger.work, error, ledger.pair_energy))

    def _fail(self, outcome: Outcome, detail: str = "") -> None:
        self.statistics.outcome = outcome
        worst = self.system.blame(self.system.acceleration(self.time, self.q, self.u))
        travel = ", ".join(f"{1e3 * x:.4g} mm" for x in self.statistics.seen[-1][0].travel)
        where = f"at t = {self.time:.6g} s" + (f" (travel {travel})" if travel else "")
        text = f"{where}, step {self.statistics.steps}, method {self.settings.method}: {outcome.value}"
        text += f". Fastest changing body: {worst}" + (f". {detail}" if detail else "")
        if outcome is Outcome.ENERGY:
            raise EnergyAbort(f"{text}. Energy error {self.ledger.worst:.3g} J of {self.ledger.turnover:.3g} J turned over")
        raise NotConverged(text)


def _at_breaks(times: Sequence[float], breaks: Sequence[float]) -> list[float]:
    """Times, those that differ from a break by rounding put on it: between the two there is no step worth the name."""
    found = []
    for t in times:
        near = [b for b in breaks if abs(b - t) <= _ROUNDING * abs(b)]
        found.append(near[0] if near else t)
    return found


class _StepwiseRun(_Run):
    """A method that ends its steps where states are wanted; powers are integrated to second order, as the method is.

    Input power by the trapezoidal rule. Where it jumps (a drive stops), the step after begins with what it is then.
    """

    def go(self) -> None:
        """See `_Run`."""
        settings = self.settings
        solver = self._solver()
        breaks = set(self.system.break_times())
        try:
            while solver.t < settings.end_time:
                begin = self.last.energy
                if solver.t in breaks:
                    begin = self.system.energy(math.nextafter(solver.t, math.inf), solver.q, solver.u)
                try:
                    solver.step(self.pending[0] if self.pending else settings.end_time)
                except StepFailed as error:
                    self._count(solver)
                    self._fail(error.outcome, error.reason)
                self._count(solver)
                self._account(begin, solver)
                if self._arrive(solver.t, solver.q, solver.u, solver.state):
                    solver = self._solver()
        finally:
            self._count(solver)

    def _solver(self) -> GeneralizedAlpha:
        """A new solver at the present state, that goes on from the last renewal point if there was one."""
        settings = self.settings
        rho_inf = None if settings.method == NEWMARK else settings.rho_inf
        solver = GeneralizedAlpha(
            self.system, self.time, self.q, self.u, settings.rtol, rho_inf, settings.step, settings.max_step
        )
        if self.state is not None:
            solver.go_on(self.state)
        return solver

    def _count(self, solver: GeneralizedAlpha) -> None:
        statistics = self.statistics
        statistics.steps = solver.steps
        statistics.rejected = solver.rejected + solver.failed
        statistics.force_evaluations = solver.force_evaluations + solver.linearisations
        statistics.jacobian_evaluations = solver.linearisations
        statistics.factorisations = solver.linear.factorisations
        statistics.newton_iterations = solver.iterations
        statistics.wall_time = time.perf_counter() - self.begun

    def _account(self, begin: Energy, solver: GeneralizedAlpha) -> None:
        """Integrate the powers over the step, check the balance at its end, and save if that is wanted there."""
        step = solver.t - self.time
        self.statistics.smallest_step = min(self.statistics.smallest_step, step)
        driven = self.last.energy.driven
        self.last = seen = self.system.observe(solver.t, solver.q, solver.u)
        dissipated, of_pairs = mean_dissipation(self.system, (self.time, self.q), (solver.t, solver.q))
        work = 0.5 * step * (begin.input_power + seen.energy.input_power) + seen.energy.driven - driven
        self.ledger.add(work, step * dissipated, step * of_pairs)
        self._look(seen)
        self._balance(seen)
        if self.pending and self.pending[0] <= solver.t:
            self.pending.pop(0)
            self._save(solver.t, solver.q, solver.u, seen, self.ledger)


class _DenseRun(_Run):
    """SciPy's methods; powers are integrated by Gauss's three points on their dense output."""

    def go(self) -> None:
        """See `_Run`."""
        settings = self.settings
        self.equations = FirstOrder(self.system)
        # a one-step method loses nothing by stopping at every save; between steps stiff springs are interpolated, and
        # their forces are wrong by far more than the positions (rigid panels at rtol 1e-5: 5e-3 against 4e-4)
        exact = settings.method in _ENDS_AT_SAVES
        self.factorisations = 0
        self.every *= _RARELY.get(settings.method, 1)
        solver = self._solver()
        try:
            while solver.status == "running" or (exact and solver.t < settings.end_time):
                if exact:
                    solver.t_bound = self.pending[0] if self.pending else settings.end_time
                    solver.status = "running"
                    _stretch(solver)
                message = solver.step()
                self._count(solver)
                if message is not None:
                    self._fail(Outcome.STEP_TOO_SMALL, f"Solver: {message}")
                state = solver.state() if hasattr(solver, "state") else solver.y
                if not np.all(np.isfinite(state)):
                    self._fail(Outcome.NOT_FINITE)
                dense = solver.interpolant() if hasattr(solver, "interpolant") else solver.dense_output()
                before = replace(self.ledger)
                self._account(solver.t, state, dense)
                while self.pending and self.pending[0] <= solver.t:
                    self._save_between(self.pending.pop(0), solver.t, dense, before)
                q, u = self.equations.split(state.copy())
                objection = self.system.objection(solver.t, q, u, solver.t - self.time)
                if objection is not None and objection.reason:  # these methods cannot take a step back
                    self._fail(Outcome.CROSSED, objection.reason)
                self.system.commit(solver.t, q, u)
                if self._arrive(solver.t, q, u, partial(self._state, solver)):
                    solver = self._solver()
        finally:
            self._count(solver, step=False)

    def _solver(self) -> Any:
        """A new solver at the present state, that goes on from the last renewal point if there was one."""
        settings, state = self.settings, np.concatenate([self.q, self.u])
        if self.state is not None:
            counts = [int(count) for count in self.state["counts"]]
            self.equations.force_calls, self.equations.jacobian_calls, self.factorisations = counts
        solver = make_solver(
            settings.method, self.equations, self.time, state, settings.end_time, settings.rtol, settings.max_step
        )
        if self.state is not None:
            go_on(solver, self.state)
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
            seen = self.system.observe(at, *self.equations.split(dense(at)))
            self._add(self.ledger, weight * step, seen.energy)
            self._look(seen)
        self.last = self.system.observe(end, *self.equations.split(state))
        self.ledger.work += self.last.energy.driven - self._driven
        self._look(self.last)
        self._balance(self.last)

    @staticmethod
    def _add(ledger: Ledger, duration: float, energy: Energy) -> None:
        """Add the powers of a state over a time."""
        ledger.add(duration * energy.input_power, duration * energy.dissipated_power, duration * energy.pair_power)

    def _save_between(self, at: float, end: float, dense: Callable[[float], np.ndarray], before: Ledger) -> None:
        """Save inside or at the end of a step; the integrals there are taken up to the very time."""
        q, u = self.equations.split(dense(at))
        if at >= end:
            self._save(end, q, u, self.last, self.ledger)
            return
        step = at - self.time
        until = replace(before)
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            t = self.time + node * step
            self._add(until, weight * step, self.system.energy(t, *self.equations.split(dense(t))))
        seen = self.system.observe(at, q, u)
        until.work += seen.energy.driven - self._driven
        self._save(at, q, u, seen, until)


def _stretch(solver: Any) -> None:
    """Stretch a step that would end a rounding error short of its bound: what is left would be a step of its own."""
    left = solver.t_bound - solver.t
    if abs(solver.h_abs - left) < _NEXT_TO * left:
        solver.h_abs = (1.0 + _NEXT_TO) * left  # the solver stops at its bound
