"""Friction sliders of creases with their memory: the law of `fsm.laws.crease_hysteresis` along a path of accepted states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fsm.laws.crease import CurveTable
from fsm.laws.crease_hysteresis import slip_energy, slip_moment, slip_power

__all__ = ["Sliders"]

_SAME = 1e-9
"""Tolerance of equal times, relative to a step."""


@dataclass
class _State:
    """Memory of the sliders from the last accepted state.

    `time` (s), openings and sliders there (rad), and the energy dissipated in the last step (J), which may be requested
    after the step. `time` is NaN before the first accepted state.
    """

    time: float
    opening: np.ndarray
    slider: np.ndarray
    lost: np.ndarray


class Sliders:
    """Sliders of (m,) creases. All sliders start on the loading curve.

    Parameters
    ----------
    start : (m,) array, rad
        Openings at the start.
    stiffness : (m,) array, N m/rad
    curve : (m,) int array
        Strength of each slider in `table`.
    table : CurveTable
    """

    def __init__(self, start: np.ndarray, stiffness: np.ndarray, curve: np.ndarray, table: CurveTable) -> None:
        self._start = start
        self._law = stiffness, curve, table.bounds, table.knots, table.coefficients, table.energies
        self._accepted: _State | None = None

    @property
    def _state(self) -> _State:
        """Last accepted state; initially the start of the loading curve."""
        if self._accepted is None:
            # this slider is stretched beyond its strength, so it lies on the loading curve
            far = np.full(len(self._start), -np.inf)
            _, _, slider = slip_moment(self._start, far, *self._law)
            self._accepted = _State(np.nan, self._start.copy(), slider, np.zeros(len(slider)))
        return self._accepted

    def moments(self, opening: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Moments (m,) against the opening, N m, and their slopes, N m/rad."""
        moment, slope, _ = slip_moment(opening, self._state.slider, *self._law)
        return moment, slope

    def energy(
        self, t: float, opening: np.ndarray, rate: np.ndarray, duration: float | None, other: Callable[[], np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Stored energy (J) and dissipated power (W), (m,) arrays.

        Parameters
        ----------
        t : s
        opening, rate : (m,) arrays, rad and rad/s
        duration : s
            Time since the other end of a step, negative at its begin: the power is the exact mean of the step. None: the
            power of these rates.
        other : openings at the other end of the step
        """
        state = self._state
        stored, lost = slip_energy(state.opening, opening, state.slider, *self._law)
        if duration is None:
            return stored, slip_power(opening, rate, state.slider, *self._law)
        # a step may be evaluated before or after its acceptance
        end = t if duration > 0.0 else t - duration
        if abs(state.time - end) <= _SAME * abs(duration):
            lost = state.lost
        elif duration < 0.0:
            _, lost = slip_energy(state.opening, other(), state.slider, *self._law)
        return stored, lost / abs(duration)

    def commit(self, t: float, opening: np.ndarray) -> None:
        """Store the positions of the sliders after an accepted step."""
        state = self._state
        _, lost = slip_energy(state.opening, opening, state.slider, *self._law)
        _, _, slider = slip_moment(opening, state.slider, *self._law)
        self._accepted = _State(t, opening, slider, lost)

    @property
    def remembered(self) -> int:
        """Length of `memory`."""
        return 1 + 3 * len(self._start)

    def memory(self) -> np.ndarray:
        """Memory as one flat array."""
        state = self._state
        return np.concatenate([[state.time], state.opening, state.slider, state.lost])

    def restore(self, memory: np.ndarray) -> None:
        """Restore the memory; an empty array clears it."""
        self._accepted = None
        if len(memory):
            count = len(self._start)
            time, opening, slider, lost = np.split(memory.copy(), np.cumsum([1, count, count]))
            self._accepted = _State(float(time[0]), opening, slider, lost)
