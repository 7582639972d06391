"""Force elements and creases as groups: measure, law, scatter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fsm.kernels.scatter import scatter_efforts
from fsm.laws.bushing import bushing, bushing_energy
from fsm.laws.crease import CurveTable, crease_energy, crease_moment
from fsm.segments.group import Past
from fsm.segments.pattern import BodyPattern

__all__ = ["BushingGroup", "CreaseGroup"]

Kernel = Callable[..., Any]


@dataclass(frozen=True)
class BushingGroup:
    """Linear springs and dampers between relative poses.

    Attributes
    ----------
    measure, tangent : kernels of `fsm.interactions.pose_planar` or `pose_spatial`
    bodies : (m, 2) int array
    geometry : arrays the two kernels take after `bodies`
    rest, stiffness, damping : (m, 3 or 6) arrays
    category : (m,) int array
        Index into `categories` of what each element's energy counts as.
    categories : names
    """

    measure: Kernel
    tangent: Kernel
    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    category: np.ndarray
    categories: tuple[str, ...]

    @property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.damping))

    def _measured(
        self, poses: np.ndarray, rates: np.ndarray, past: Past | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Deformations, their rates and gradients."""
        value, rate, gradient = self.measure(poses, rates, self.bodies, *self.geometry)
        if past is not None:
            before, _, _ = self.measure(past.poses, rates, self.bodies, *self.geometry)
            rate = (value - before) / past.duration
        return value, rate, gradient

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: Past | None = None
    ) -> None:
        """See `Group`."""
        value, rate, gradient = self._measured(poses, rates, past)
        effort = bushing(value, rate, self.rest, self.stiffness, self.damping)
        scatter_efforts(self.bodies, gradient, effort, len(self.bodies), force)

    def add_linearised(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        pattern: BodyPattern,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        past: Past | None = None,
    ) -> None:
        """See `Group`."""
        value, rate, gradient = self._measured(poses, rates, past)
        effort = bushing(value, rate, self.rest, self.stiffness, self.damping)
        scatter_efforts(self.bodies, gradient, effort, len(self.bodies), force)
        if past is not None:
            rates = np.zeros_like(rates)  # a difference has no rate that would change as the bodies turn
        self.tangent(
            poses, rates, self.bodies, *self.geometry, gradient, effort, self.stiffness, self.damping,
            *pattern.index, stiffness, damping,
        )  # fmt: skip

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`; springs do not know the time."""

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        value, rate, _ = self._measured(poses, rates, past)
        energy, power = bushing_energy(value, rate, self.rest, self.stiffness, self.damping)
        totals = np.bincount(self.category, weights=energy, minlength=len(self.categories))
        return {name: float(total) for name, total in zip(self.categories, totals, strict=True)}, power, 0.0

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.bodies, 0


@dataclass(frozen=True)
class CreaseGroup:
    """Hinges whose moment is a tabulated curve.

    Attributes
    ----------
    measure, tangent : kernels of `fsm.interactions.hinge_planar` or `hinge_spatial`
    bodies : (m, 2) int array
    geometry : arrays the two kernels take after `bodies`
    rest, side : (m,) arrays
        Opening o = rest - side psi.
    damping : (m,) array, N m s/rad
    curve : (m,) int array
        Curve of each crease in `table`.
    table : CurveTable
    """

    measure: Kernel
    tangent: Kernel
    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray
    side: np.ndarray
    damping: np.ndarray
    curve: np.ndarray
    table: CurveTable

    @property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.damping))

    def _curves(self) -> tuple[np.ndarray, ...]:
        table = self.table
        return self.curve, table.bounds, table.knots, table.coefficients, table.energies

    def _measured(
        self, poses: np.ndarray, rates: np.ndarray, past: Past | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Deformations, their rates and gradients."""
        value, rate, gradient = self.measure(poses, rates, self.bodies, *self.geometry)
        if past is not None:
            before, _, _ = self.measure(past.poses, rates, self.bodies, *self.geometry)
            rate = (value - before) / past.duration
        return value, rate, gradient

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: Past | None = None
    ) -> None:
        """See `Group`."""
        angle, rate, gradient = self._measured(poses, rates, past)
        effort, _ = crease_moment(angle, rate, self.rest, self.side, self.damping, *self._curves())
        scatter_efforts(self.bodies, gradient, effort, len(self.bodies), force)

    def add_linearised(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        pattern: BodyPattern,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        past: Past | None = None,
    ) -> None:
        """See `Group`."""
        angle, rate, gradient = self._measured(poses, rates, past)
        effort, slope = crease_moment(angle, rate, self.rest, self.side, self.damping, *self._curves())
        scatter_efforts(self.bodies, gradient, effort, len(self.bodies), force)
        if past is not None:
            rates = np.zeros_like(rates)  # a difference has no rate that would change as the bodies turn
        self.tangent(
            poses, rates, self.bodies, *self.geometry, effort, slope, self.damping,
            *pattern.index, stiffness, damping,
        )  # fmt: skip

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`; springs do not know the time."""

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        angle, rate, _ = self._measured(poses, rates, past)
        energy = crease_energy(angle, self.rest, self.side, *self._curves())
        return {"creases": float(energy.sum())}, float(self.damping @ rate**2), 0.0

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.bodies, 0
