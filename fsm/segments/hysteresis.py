"""Friction sliders parallel to the elastic curves of creases, which cause hysteresis between opening and closing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fsm.interactions.hinge_planar import measure_hinge_planar, tangent_hinge_planar
from fsm.interactions.hinge_spatial import measure_hinge_spatial, tangent_hinge_spatial
from fsm.kernels.scatter import scatter_efforts
from fsm.laws.crease import CurveTable
from fsm.laws.crease_sliders import Sliders
from fsm.segments.creases import CreaseGroup
from fsm.segments.element_cache import TwoBodyGroup
from fsm.segments.group import PreviousPoses
from fsm.segments.pattern import BodyPattern

__all__ = ["HysteresisGroup"]


@dataclass
class HysteresisGroup(TwoBodyGroup):
    """Sliders of the law `fsm.laws.crease_hysteresis`, each between two bodies. All sliders start on the loading curve.

    The moment depends on the path, not on the speed, so the group is not rate-dependent.

    Attributes
    ----------
    bodies, geometry : see `TwoBodyGroup`
    rest, side : (m,) arrays
        Rest angle (rad) and side (+1 or -1) of each crease; the opening is o = rest - side psi.
    start : (m,) array, rad
        Openings at the start.
    stiffness : (m,) array, N m/rad
    curve : (m,) int array
        Strength of each slider in `table`.
    table : CurveTable
    creases : CreaseGroup
        Creases parallel to the sliders, with their half segments.
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

    @property
    def measure(self) -> Callable[..., Any]:
        """See `TwoBodyGroup`."""
        return measure_hinge_planar if len(self.geometry) == 1 else measure_hinge_spatial

    @cached_property
    def _sliders(self) -> Sliders:
        return Sliders(self.start, self.stiffness, self.curve, self.table)

    @cached_property
    def _no_damping(self) -> np.ndarray:
        return np.zeros(len(self.bodies))

    # forces -----------------------------------------------------------------------------------------------------------

    def _measured(self, poses: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Openings (m,) rad, their rates (m,) rad/s, and gradients of the hinge angles."""
        angle, rate, gradient = self.measure(poses, rates, self.bodies, *self.geometry)
        return self.rest - self.side * angle, -self.side * rate, gradient

    def _efforts(self, opening: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Moments against the hinge angle and their slopes by it, (m, 1) arrays, N m and N m/rad."""
        moment, slope = self._sliders.moments(opening)
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
        duration = None if past is None else past.duration
        other = poses if past is None else past.poses
        stored, power = self._sliders.energy(t, opening, rate, duration, lambda: self._measured(other, rates)[0])
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
        self._sliders.commit(t, self._measured(poses, rates)[0])

    @property
    def remembered(self) -> int:
        """Length of `memory`."""
        return self._sliders.remembered

    def memory(self) -> np.ndarray:
        """Memory as one flat array."""
        return self._sliders.memory()

    def restore(self, memory: np.ndarray) -> None:
        """Restore the memory; an empty array clears it."""
        self._sliders.restore(memory)
