"""Extrapolation of the next state from the last ones, by a parabola over the progress of the drive."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.solve.interface.system import System
from fsm.solve.outcome.restart_points import State

_KEPT = 3
"""Number of stored states: three for a parabola."""


class Prediction(NamedTuple):
    """Increment (nu,) from the last state, and the efforts of the springs after this increment, or None."""

    increment: np.ndarray
    efforts: np.ndarray | None


class _State(NamedTuple):
    progress: float
    q: np.ndarray
    efforts: np.ndarray | None


class History:
    """Last states, and the polynomial through these states.

    Parameters
    ----------
    system : System
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self._states: list[_State] = []

    def __len__(self) -> int:
        return len(self._states)

    def add(self, t: float, q: np.ndarray, efforts: np.ndarray | None = None) -> None:
        """Add a state, with the efforts of its springs if these are predicted too; either all states have efforts or none
        has.
        """
        self._states = [*self._states[-(_KEPT - 1) :], _State(self.system.progress(t), q, efforts)]

    def state(self) -> State:
        """All states, for a restart."""
        states = self._states
        return {
            "history_progress": np.array([state.progress for state in states]),
            "history_q": np.array([state.q for state in states]),
            "history_efforts": np.array([state.efforts for state in states if state.efforts is not None]),
        }

    def resume(self, state: State) -> None:
        """Set the states of a restart point (see `state`)."""
        progress, efforts = state["history_progress"].tolist(), state["history_efforts"]
        kept: list[np.ndarray | None] = list(efforts) if len(efforts) else [None] * len(progress)
        self._states = [_State(*values) for values in zip(progress, state["history_q"], kept, strict=True)]

    @property
    def efforts(self) -> np.ndarray | None:
        """Efforts at the last state."""
        return self._states[-1].efforts

    def predict(self, t: float) -> Prediction | None:
        """Prediction of the state at time t; None with fewer than two states."""
        if len(self._states) < 2:
            return None
        *earlier, last = self._states
        aim = self.system.progress(t)
        increment = np.zeros(self.system.nu)
        efforts = last.efforts
        for state in earlier:
            weight = 1.0
            for other in self._states:
                if other is not state:
                    weight *= (aim - other.progress) / (state.progress - other.progress)
            increment += weight * self.system.difference(last.q, state.q)
            if last.efforts is not None and state.efforts is not None:
                efforts = efforts + weight * (state.efforts - last.efforts)
        return Prediction(increment, efforts)
