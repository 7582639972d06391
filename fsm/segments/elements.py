"""Force elements and creases as groups: measure, law, scatter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from fsm.interactions.bushing_planar import force_pose_planar, linearise_pose_planar, pose_constants_planar
from fsm.interactions.bushing_spatial import force_pose_spatial, linearise_pose_spatial, pose_constants_spatial
from fsm.kernels.scatter import pair_slots, scatter_efforts
from fsm.laws.bushing import bushing_energy
from fsm.laws.crease import CurveTable, crease_energy, crease_moment
from fsm.segments.group import Past
from fsm.segments.pattern import BodyPattern

__all__ = ["BushingGroup", "CreaseGroup"]

Kernel = Callable[..., Any]

_ONE_PASS: dict[int, tuple[Kernel, Kernel, Kernel]] = {
    3: (pose_constants_planar, force_pose_planar, linearise_pose_planar),
    6: (pose_constants_spatial, force_pose_spatial, linearise_pose_spatial),
}
"""By rows of a block: constants of the elements, forces, and forces with tangents."""


@dataclass
class _Kept:
    """What has been found for the last pattern and for the last past state; both are known by their identity."""

    pattern: BodyPattern | None = None
    slots: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), dtype=np.int64))
    past: np.ndarray | None = None
    before: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True)
class BushingGroup:
    """Linear springs and dampers between relative poses.

    Energies take the way of measure and law. Forces and tangents, which the solvers ask for all the time, go through the
    kernels of `fsm.interactions.bushing_planar` or `bushing_spatial`, which do all in one pass.

    Attributes
    ----------
    measure, tangent : kernels of `fsm.interactions.pose_planar` or `pose_spatial`
        The tangent is what the tests hold the one pass against.
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

    _kept: _Kept = field(default_factory=_Kept, init=False, repr=False, compare=False)

    @cached_property
    def _constants(self) -> np.ndarray:
        constants, _, _ = _ONE_PASS[self.rest.shape[1]]
        return np.asarray(constants(*self.geometry, self.rest, self.stiffness, self.damping))

    @cached_property
    def _force(self) -> Kernel:
        return _ONE_PASS[self.rest.shape[1]][1]

    @cached_property
    def _linearise(self) -> Kernel:
        return _ONE_PASS[self.rest.shape[1]][2]

    def _before(self, rates: np.ndarray, past: Past | None) -> tuple[np.ndarray, float]:
        """Deformations in the past, and one over the time since, 1/s; zero without a past."""
        if past is None:
            return self.rest, 0.0
        kept = self._kept
        if kept.past is not past.poses:
            kept.before, _, _ = self.measure(past.poses, rates, self.bodies, *self.geometry)
            kept.past = past.poses
        return kept.before, 1.0 / past.duration

    def _slots(self, pattern: BodyPattern) -> np.ndarray:
        """Where the blocks of every element are."""
        kept = self._kept
        if kept.pattern is not pattern:
            kept.slots = pair_slots(self.bodies, *pattern.index)
            kept.pattern = pattern
        return kept.slots

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: Past | None = None
    ) -> None:
        """See `Group`."""
        self._force(poses, rates, self.bodies, self._constants, *self._before(rates, past), force)

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
        self._linearise(
            poses, rates, self.bodies, self._constants, *self._before(rates, past), self._slots(pattern),
            force, stiffness, damping,
        )  # fmt: skip

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`; springs do not know the time."""

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        value, rate, _ = self.measure(poses, rates, self.bodies, *self.geometry)
        if past is not None:
            before, per_second = self._before(rates, past)
            rate = (value - before) * per_second
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
