"""Friction sliders parallel to the elastic curves of creases, which cause hysteresis between opening and closing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from fsm.interactions.hinge_planar import measure_hinge_planar, tangent_hinge_planar
from fsm.interactions.hinge_spatial import measure_hinge_spatial, tangent_hinge_spatial
from fsm.kernels.scatter import scatter_efforts
from fsm.laws.crease import CurveTable
from fsm.laws.crease_hysteresis import slip_energy, slip_moment, slip_power
from fsm.segments.element_cache import TwoBodyGroup
from fsm.segments.elements import CreaseGroup
from fsm.segments.group import PreviousPoses
from fsm.segments.pattern import BodyPattern

__all__ = ["HysteresisGroup"]

_SAME = 1e-9
"""Tolerance of equal times, relative to a step."""


@dataclass
class _State:
    """Memory of the sliders from the last accepted state.

    `time` (s), openings and sliders there (rad), and the energy dissipated in the last step (J), which may be requested
    after the step. `time` is None before the first accepted state.
    """

    time: float
    opening: np.ndarray
    slider: np.ndarray
    lost: np.ndarray


@dataclass
class HysteresisGroup(TwoBodyGroup):
    """Sliders of the law `fsm.laws.crease_hysteresis`, each between two bodies. They start on the loading curve.

    The moment depends on the path, not on the speed, so the group is not rate-dependent.

    Attributes
    ----------
    bodies, geometry : see `TwoBodyGroup`
    rest, side : (m,) arrays
        Opening o = rest - side psi.
    start : (m,) array, rad
        Openings at the start.
    stiffness : (m,) array, N m/rad
    curve : (m,) int array
        Strength of each slider in `table`.
    table : CurveTable
    creases : CreaseGroup
        Creases that act beside the sliders, with their half segments.
    chosen : (m,) int array
        Index of the crease of each slider.
    names : names of the elements
    """

    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray
    side: np.ndarray
    start: np.ndarray
    stiffness: np.ndarray
    curve: np.ndarray
    table: CurveTable
    creases: CreaseGroup
    chosen: np.ndarray
    names: tuple[str, ...] = ()
    _accepted: _State | None = field(default=None, init=False, repr=False, compare=False)

    @property
    def measure(self) -> Callable[..., Any]:
        """See `TwoBodyGroup`."""
        return measure_hinge_planar if len(self.geometry) == 1 else measure_hinge_spatial

    @cached_property
    def _law(self) -> tuple[np.ndarray, ...]:
        table = self.table
        return self.stiffness, self.curve, table.bounds, table.knots, table.coefficients, table.energies

    @cached_property
    def _no_damping(self) -> np.ndarray:
        return np.zeros(len(self.bodies))

    @property
    def _state(self) -> _State:
        """Last accepted state; initially the start of the loading curve."""
        if self._accepted is None:
            far = np.full(len(self.start), -np.inf)  # a slider stretched beyond its strength lies on the loading curve
            _, _, slider = slip_moment(self.start, far, *self._law)
            self._accepted = _State(np.nan, self.start.copy(), slider, np.zeros(len(slider)))
        return self._accepted

    # forces -----------------------------------------------------------------------------------------------------------

    def _measured(self, poses: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Openings (m,) rad, their rates (m,) rad/s, and gradients of the hinge angles."""
        angle, rate, gradient = self.measure(poses, rates, self.bodies, *self.geometry)
        return self.rest - self.side * angle, -self.side * rate, gradient

    def _efforts(self, opening: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Moments against the hinge angle and their slopes by it, (m, 1) arrays, N m and N m/rad."""
        moment, slope, _ = slip_moment(opening, self._state.slider, *self._law)
        return (-self.side * moment)[:, None], slope[:, None]

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: PreviousPoses | None = None
    ) -> None:
        """See `Group`."""
        opening, _, gradient = self._measured(poses, rates)
        effort, _ = self._efforts(opening)
        scatter_efforts(self.bodies, gradient, effort, len(effort), force)

    def add_linearised(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        pattern: BodyPattern,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        past: PreviousPoses | None = None,
    ) -> None:
        """See `Group`."""
        opening, _, gradient = self._measured(poses, rates)
        effort, slope = self._efforts(opening)
        scatter_efforts(self.bodies, gradient, effort, len(effort), force)
        tangent: Callable[..., Any] = tangent_hinge_planar if len(self.geometry) == 1 else tangent_hinge_spatial
        tangent(
            poses, rates, self.bodies, *self.geometry, effort, slope, self._no_damping, *pattern.index, stiffness, damping
        )

    def moments(self, poses: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Moments (m,) against the hinge angle, N m."""
        return self._efforts(self._measured(poses, rates)[0])[0][:, 0]

    # energy -----------------------------------------------------------------------------------------------------------

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`. With a past state, the dissipated power is the exact mean of the step."""
        opening, rate, _ = self._measured(poses, rates)
        state = self._state
        stored, lost = slip_energy(state.opening, opening, state.slider, *self._law)
        if past is None:
            power = slip_power(opening, rate, state.slider, *self._law)
        else:
            # a step may be evaluated before or after it is accepted
            end = t if past.duration > 0.0 else t - past.duration
            if abs(state.time - end) <= _SAME * abs(past.duration):
                lost = state.lost
            elif past.duration < 0.0:
                _, lost = slip_energy(state.opening, self._measured(past.poses, rates)[0], state.slider, *self._law)
            power = lost / abs(past.duration)
        panels = self._in_half_cells(opening)
        return {"panels": panels, "creases": float(stored.sum()) - panels}, float(power.sum()), 0.0

    def _in_half_cells(self, opening: np.ndarray) -> float:
        """Energy that the moments of the sliders add to the half segments, J.

        The half segments carry the sum of both moments; the `CreaseGroup` counts its own moment alone.
        """
        slider = -self.side * self._efforts(opening)[0][:, 0]
        angle = np.zeros(len(self.creases.bodies))
        angle[self.chosen] = self.side * (self.rest - opening)
        beside = self.creases.moments(angle)[self.chosen]
        return float(self.creases.flexibility[self.chosen] @ (beside * slider + 0.5 * slider**2))

    # memory -----------------------------------------------------------------------------------------------------------

    def commit(self, t: float, poses: np.ndarray, rates: np.ndarray) -> None:
        """Store the positions of the sliders after an accepted step."""
        opening, _, _ = self._measured(poses, rates)
        state = self._state
        _, lost = slip_energy(state.opening, opening, state.slider, *self._law)
        _, _, slider = slip_moment(opening, state.slider, *self._law)
        self._accepted = _State(t, opening, slider, lost)

    @property
    def remembered(self) -> int:
        """Length of `memory`."""
        return 1 + 3 * len(self.bodies)

    def memory(self) -> np.ndarray:
        """Memory as one flat array."""
        state = self._state
        return np.concatenate([[state.time], state.opening, state.slider, state.lost])

    def restore(self, memory: np.ndarray) -> None:
        """Restore the memory; an empty array clears it."""
        self._accepted = None
        if len(memory):
            time, opening, slider, lost = np.split(memory.copy(), np.cumsum([1, len(self.bodies), len(self.bodies)]))
            self._accepted = _State(float(time[0]), opening, slider, lost)
