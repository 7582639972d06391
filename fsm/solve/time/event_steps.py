"""Steps of a run with events: each step is repeated with other ends until it ends where a condition becomes true."""

from __future__ import annotations

import math

import numpy as np

from fsm.solve.interface.system import System
from fsm.solve.outcome.run_io import SavedState, Watch
from fsm.solve.time.array_steps import StepMethod

_MOST = 100
"""Largest number of repetitions of a step; halving needs about 50."""
_ROUND_OFF = 4.0 * float(np.finfo(float).eps)


class Events:
    """Events of a step of a run.

    Parameters
    ----------
    watch : Watch
    system : System
    rtol : -
        Resolution of the times of events, relative to the step in which they happen.
    """

    def __init__(self, watch: Watch, system: System, rtol: float) -> None:
        self.watch, self.system, self.rtol = watch, system, rtol
        self._values: np.ndarray | None = None

    def due(self, state: SavedState) -> bool:
        """Whether a condition is true at the present state."""
        if self._values is None:
            self._values = self.watch.values(self.system, state)
        return bool(np.any(self._values > 0.0))

    def happen(self, state: SavedState) -> bool:
        """Let the events happen that are due; returns whether the step ends."""
        assert self._values is not None
        numbers, self._values = np.flatnonzero(self._values > 0.0), None
        return self.watch.happen(self.system, numbers, state)

    def march(self, solver: StepMethod, balance: np.ndarray, until: float, every: bool) -> tuple[np.ndarray, np.ndarray]:
        """Take one step, shortened to end just after the first condition that becomes true; returns balance and records."""
        begin = solver.t, solver.q.copy(), solver.u.copy(), solver.state()
        memory, first, before = self.system.memory(), balance.copy(), self._values
        assert before is not None
        until = min(until, self.watch.next_time(self.system, begin[0]))
        records = solver.march(balance, until, 1, every)
        after = self._at(solver)
        crossed = (before <= 0.0) & (after > 0.0)

        def again(t: float) -> tuple[np.ndarray, np.ndarray]:
            """Repeat the step up to another end, in several steps if its error demands them."""
            self.system.restore(memory)
            solver.back_to(*begin)
            own, found = first.copy(), []
            while solver.t < t:
                found.append(solver.march(own, t, 1, every))
            return own, np.concatenate(found) if every else found[-1]

        if np.any(crossed):
            low, high = (begin[0], float(before[crossed].max())), (solver.t, float(after[crossed].max()))
            best, at = (balance, records), high[0]
            resolution = max(self.rtol * (high[0] - low[0]), _ROUND_OFF * abs(high[0]))
            for number in range(_MOST):
                if high[0] - low[0] <= resolution:
                    break
                t = _between(low, high, resolution, number)
                if not low[0] < t < high[0]:
                    break
                tried = again(t)
                values = self._at(solver)
                value, at = float(values[crossed].max()), t
                if value > 0.0:
                    best, high, after = tried, (t, value), values
                else:
                    low = (t, value)
            if at != high[0]:
                best = again(high[0])
                after = self._at(solver)
            balance, records = best
        self._values = after
        return balance, records

    def _at(self, solver: StepMethod) -> np.ndarray:
        nothing = 0.0, 0.0, 0.0, np.zeros(0)
        return self.watch.values(self.system, SavedState(solver.t, solver.q, solver.u, solver.observe(), *nothing))


def _between(low: tuple[float, float], high: tuple[float, float], resolution: float, number: int) -> float:
    """Time between two times with values of opposite sign: secant, every third time the middle.

    The secant is moved by half the resolution towards the farther end, so that the event is soon between two near times.
    """
    middle = 0.5 * (low[0] + high[0])
    if number % 3 == 2 or not math.isfinite(low[1]) or not math.isfinite(high[1]):
        return middle
    t = low[0] - low[1] * (high[0] - low[0]) / (high[1] - low[1])
    t += 0.5 * resolution if t - low[0] > high[0] - t else -0.5 * resolution
    return min(max(t, low[0] + 0.5 * resolution), high[0] - 0.5 * resolution)
