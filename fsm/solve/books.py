"""What a solve hands over as it goes: saved states, the energy ledger, the curve, counters."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fsm.solve.simulate import Ledger, Saved, Statistics, StepEnd
from fsm.system import Observation, System

__all__ = ["Books"]


class Books:
    """Books of a quasi-static path with dynamics in between.

    Parameters
    ----------
    system : System
    statistics, ledger : changed as the solve goes on
    save_times : s
    on_save, on_step : called with saved states and after every step
    time, q, u : where the solve begins
    """

    def __init__(
        self,
        system: System,
        statistics: Statistics,
        ledger: Ledger | None,
        save_times: Sequence[float],
        on_save: Callable[[Saved], None],
        on_step: Callable[[StepEnd], None] | None,
        time: float,
        q: np.ndarray,
        u: np.ndarray,
    ) -> None:
        self.system, self.statistics = system, statistics
        self.on_save, self.on_step = on_save, on_step
        self.time, self.q, self.u = time, q, u
        self.last = system.observe(time, q, u)
        self.ledger = Ledger(start=self.last.energy.stored) if ledger is None else ledger
        self.ledger.balance(self.last.energy.stored, self.last.energy.kinetic)
        self.largest_reaction = self.last.reaction
        self.pending = [t for t in save_times if t >= time]
        self._nothing = 1e-12 * max(save_times, default=0.0)  # times that differ by less are the same
        statistics.seen.append((self.last.drive, self.last.pair_force))
        self._save()

    def next_save(self, end: float) -> float:
        """Time of the next state to be saved, or the end."""
        return self.pending[0] if self.pending else end

    def quasi_static(self, t: float, q: np.ndarray, u: np.ndarray, seen: Observation) -> None:
        """Take a step whose velocities are means over it: work by the trapezoidal rule, dissipation as it was solved."""
        duration = t - self.time
        drives = float((0.5 * (self.last.drive.force + seen.drive.force)) @ (seen.drive.travel - self.last.drive.travel))
        at_end = seen.energy.input_power * duration
        of_drives = float(seen.drive.force @ (seen.drive.travel - self.last.drive.travel))
        loads = at_end - of_drives
        if abs(loads) > 1e-9 * abs(at_end) and not len(seen.drive.force):
            # the loads as they were when the step began, along the same motion
            loads = 0.5 * (loads + self.system.energy(self.time, self.q, u).input_power * duration)
        self.ledger.work += drives + loads
        self.ledger.dissipated += seen.energy.dissipated_power * duration
        self._take(t, q, u, seen)

    def dynamic(self, t: float, q: np.ndarray, u: np.ndarray, seen: Observation) -> None:
        """Take a step of a time integrator: powers by the trapezoidal rule."""
        half = 0.5 * (t - self.time)
        self.ledger.work += half * (self.last.energy.input_power + seen.energy.input_power)
        self.ledger.dissipated += half * (self.last.energy.dissipated_power + seen.energy.dissipated_power)
        self._take(t, q, u, seen)

    def slide(self, t: float, q: np.ndarray, seen: Observation) -> None:
        """Take a jump in next to no time, whose energy is gone."""
        self.ledger.dissipated += self.last.energy.stored - seen.energy.stored
        self._take(t, q, np.zeros_like(self.u), seen)

    def _take(self, t: float, q: np.ndarray, u: np.ndarray, seen: Observation) -> None:
        self.time, self.q, self.u, self.last = t, q, u, seen
        self.largest_reaction = max(self.largest_reaction, seen.reaction)
        self.ledger.balance(seen.energy.stored, seen.energy.kinetic)
        self.statistics.seen.append((seen.drive, seen.pair_force))
        self.statistics.steps += 1
        self._save()
        if self.on_step is not None:
            self.on_step(StepEnd(t, q, u, self.statistics.steps))

    def _save(self) -> None:
        while self.pending and self.pending[0] <= self.time + self._nothing:
            self.pending.pop(0)
            ledger = self.ledger
            self.on_save(
                Saved(self.time, self.q.copy(), self.u.copy(), self.last, ledger.dissipated, ledger.work, ledger.error)
            )
