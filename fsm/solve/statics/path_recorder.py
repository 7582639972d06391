"""Recorder of a quasi-static path: saved states, energy balance, force curve, counters."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fsm.solve.interface.records import DriveState, Observation, PreviousState
from fsm.solve.interface.system import System
from fsm.solve.outcome.dissipation import mean_dissipation
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.load_work import load_work
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

_AT_FIRST = 5e-3
"""Displacement relative to the extent of the structure; the largest reaction times this displacement is the first scale
of energy."""


_SMALL_LOSS = 1e-6
"""Dissipation relative to the reference energy, below which the forces at the end of a step are accurate enough."""


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
        self._earlier: DriveState | None = None
        self._resting: list[tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]] = []
        self._extent = system.scales().extent
        self._saved = -np.inf
        self._before: PreviousState | None = None
        self._pivots: int | None = None
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
        earlier = [] if self._earlier is None else [self._earlier.travel, self._earlier.force]
        resting = [found for known, found in self._resting if known is self.q]
        return {
            **observation_state(self.last),
            "earlier": np.array(earlier),
            **({"resting": resting[0][0], "resting_drive": resting[0][1]} if resting else {}),
            "bounds": np.array([self.largest_reaction, self._saved]),
        }

    def resume(self, end: AcceptedStep) -> None:
        """Continue from a restart point (see `state`)."""
        state = end.state
        assert state is not None
        self.time, self.q, self.u = end.time, end.q, end.u
        stored_by = list(self.system.energy(end.time, end.q, None).potential)
        self.last = observation_from(state, stored_by)
        self._earlier = DriveState(*state["earlier"]) if len(state["earlier"]) else None
        self._resting = [(self.q, (state["resting"], state["resting_drive"]))] if "resting" in state else []
        self.largest_reaction, self._saved = state["bounds"].tolist()

    def next_save(self, end: float) -> float:
        """Time of the next state to be saved, or `end`."""
        return self.pending[0] if self.pending else end

    def step_energy(self, t: float, q: np.ndarray, u: np.ndarray, observed: Observation) -> StepEnergy:
        """Work and dissipated energy of a quasi-static step, whose velocities are means over the step.

        The work of drives is the integral of the parabola through the forces of the last three states.
        """
        duration = t - self.time
        drives = driven = 0.0
        for k, force in enumerate(observed.drive.force.tolist()):
            travel = float(observed.drive.travel[k] - self.last.drive.travel[k])
            drives += (0.5 * (float(self.last.drive.force[k]) + force) - self._bow(k, observed)) * travel
            driven += force * travel
        power = observed.energy.load_power
        loads = observed.energy.input_power * duration - driven if power is None else power * duration
        if loads:  # mean of the loads at both ends of the step, along the same motion
            begin = self.system.energy(self.time, self.q, u, (t, q))
            power = begin.input_power if begin.load_power is None else begin.load_power
            loads = 0.5 * (loads + power * duration)
        return StepEnergy(drives + loads, self._dissipated(t, q, observed), observed.energy.pair_power * duration)

    def _dissipated(self, t: float, q: np.ndarray, observed: Observation) -> float:
        """Energy that dampers and friction dissipate in a quasi-static step, J: mean force at both ends times the motion.

        At an equilibrium these forces are the residual without them. Small losses, and the first step, use the forces at the
        end only. The loss of rate-independent sliding is computed exactly.
        """
        alone = observed.energy.dissipated_power * (t - self.time)
        if self._earlier is None or alone < _SMALL_LOSS * self.energy_balance.turnover:
            return alone
        (force, drive), (next_force, next_drive) = self._at_rest(self.time, self.q), self._at_rest(t, q)
        driven = self.last.drive.force - drive + observed.drive.force - next_drive
        taken = (force + next_force) @ self.system.difference(self.q, q)
        damped = max(0.0, 0.5 * float(taken + driven @ (observed.drive.travel - self.last.drive.travel)))
        return damped + observed.energy.sliding_power * (t - self.time)

    def _at_rest(self, t: float, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual at rest and drive forces, N; stored for the next step."""
        for known, found in self._resting:
            if known is q:
                return found
        found = self.system.balance(t, q, None)
        self._resting = [*self._resting[-1:], (q, found)]
        return found

    def _bow(self, k: int, observed: Observation) -> float:
        """Mean force of drive k at both ends minus its mean over the step, from the curvature of the force curve, N."""
        if self._earlier is None:
            return 0.0
        points = [
            (float(drive.travel[k]), float(drive.force[k]))
            for drive in (self._earlier, self.last.drive, observed.drive)
        ]
        (x0, f0), (x1, f1), (x2, f2) = points
        first, second = x1 - x0, x2 - x1
        if first * second <= 0.0:  # the drive has stopped or reversed
            return 0.0
        bend = (f2 - f1) / second - (f1 - f0) / first
        return second**2 / (6.0 * (first + second)) * bend

    def quasi_static(
        self, t: float, q: np.ndarray, u: np.ndarray, observed: Observation, step_energy: StepEnergy, unstable: bool = False,
        pivots: int | None = None,
    ) -> None:  # fmt: skip
        """Record a quasi-static step; the caller must call `finish_step` next.

        `unstable`: only dampers hold the state. `pivots`: number of negative pivots of the stiffness at rest, if known.
        """
        self.energy_balance.add(*step_energy)
        earlier = self.last.drive
        self.system.commit(t, q, u, (self.time, self.q))
        self._take(t, q, u, observed, dynamic=unstable, before=(self.time, self.q), pivots=pivots)
        self._earlier = earlier

    def imbalance(self, observed: Observation, step_energy: StepEnergy) -> float:
        """Energy balance residual of a quasi-static step relative to the reference energy so far; 0 below round-off.

        At the start the residual is relative to the work of the largest reaction along a small part of the span.
        """
        work, dissipated, _ = step_energy
        stored = observed.energy.stored_at_rest - self.last.energy.stored_at_rest
        change = abs(observed.energy.stored_at_rest - self.energy_balance.start)
        turnover = max(self.energy_balance.turnover, change, abs(work))
        turnover = max(turnover, self._little(max(self.largest_reaction, observed.reaction)))
        return abs(stored + dissipated - work) / turnover if turnover > self.energy_balance.round_off_floor else 0.0

    def is_off(self, bound: float) -> bool:
        """Whether the energy error exceeds a bound relative to the reference energy, or relative to a small work if
        that is larger.

        The small work is needed where a body moves freely to its first contact, because the reference energy is then
        almost zero.
        """
        balance = self.energy_balance
        turnover = max(balance.turnover, self._little(self.largest_reaction))
        return balance.relative_error > bound and balance.worst > bound * turnover

    def _little(self, reaction: float) -> float:
        """Work of a force along a small part of the extent of the structure, J."""
        return _AT_FIRST * reaction * self._extent

    def step_energy_in_motion(self, t: float, q: np.ndarray, observed: Observation) -> StepEnergy:
        """Work and dissipated energy of a step of a time integrator."""
        step = t - self.time
        dissipated, of_pairs = mean_dissipation(self.system, (self.time, self.q), (t, q), len(observed.pairs.force))
        work = 0.5 * step * (self.last.energy.input_power + observed.energy.input_power)
        return StepEnergy(work, step * dissipated, step * of_pairs)

    def loss(self, observed: Observation, step_energy: StepEnergy) -> float:
        """Energy balance residual of a step of a time integrator, over the reference energy."""
        work, dissipated, _ = step_energy
        off = abs(observed.energy.stored_except_driven - self.last.energy.stored_except_driven + dissipated - work)
        return off / self.energy_balance.turnover if self.energy_balance.turnover > 0.0 else 0.0

    def dynamic(
        self, t: float, q: np.ndarray, u: np.ndarray, observed: Observation, step_energy: StepEnergy, near_equilibrium: bool
    ) -> None:
        """Record a step of a time integrator; `near_equilibrium`: it ends near a stable equilibrium."""
        self.energy_balance.add(*step_energy)
        moving = not near_equilibrium or inertia_counts(self.system, t, q, u, observed)
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
        before: PreviousState | None = None,
        pivots: int | None = None,
    ) -> None:
        """Set the present state; `stored` is its energy if inertia is included, None in statics."""
        self.time, self.q, self.u, self.last, self._earlier, self._before = t, q, u, observed, None, before
        self._pivots = pivots if len(observed.drive.travel) else None  # records of a path without drives have no count
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
        end = AcceptedStep(self.time, self.q, self.u, self.statistics.steps, tuple(self.statistics.events), state)
        if self.request.on_step is not None:
            self.request.on_step(end)
        return end

    def save_last(self, final: bool = False) -> None:
        """Save the last state, if it is not saved yet; `final` as in `SavedState`."""
        if self._saved < self.time:
            self.pending = [self.time]
            self._save(final)

    def _save(self, final: bool = False) -> None:
        while self.pending and self.pending[0] <= self.time + self._nothing:
            self.pending.pop(0)
            self._saved = self.time
            energy_balance = self.energy_balance
            numbers = energy_balance.dissipated, energy_balance.work, energy_balance.error, energy_balance.pair_energy
            saved = SavedState(self.time, self.q.copy(), self.u.copy(), self.last, *numbers, self._before, final=final)
            self.request.on_save(replace(saved, negative_pivots=self._pivots))
