"""Force elements and creases as groups: measure, law, scatter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from fsm.interactions.bushing_planar import force_pose_planar, linearise_pose_planar, pose_constants_planar
from fsm.interactions.bushing_spatial import force_pose_spatial, linearise_pose_spatial, pose_constants_spatial
from fsm.interactions.crease_planar import force_crease_planar, linearise_crease_planar
from fsm.interactions.crease_spatial import force_crease_spatial, linearise_crease_spatial
from fsm.kernels.scatter import pair_slots
from fsm.laws.bushing import bushing_energy
from fsm.laws.crease import CurveTable, crease_energy
from fsm.segments.group import Past
from fsm.segments.pattern import BodyPattern

__all__ = ["BushingGroup", "CreaseGroup"]

Kernel = Callable[..., Any]

_ONE_PASS: dict[int, tuple[Kernel, Kernel, Kernel]] = {
    3: (pose_constants_planar, force_pose_planar, linearise_pose_planar),
    6: (pose_constants_spatial, force_pose_spatial, linearise_pose_spatial),
}
"""By rows of a block: constants of the elements, forces, and forces with tangents."""

_ONE_PASS_CREASE: dict[int, tuple[Kernel, Kernel]] = {
    3: (force_crease_planar, linearise_crease_planar),
    6: (force_crease_spatial, linearise_crease_spatial),
}
"""By rows of a block: moments, and moments with tangents."""


class _Kept:
    """What has been found for the last pattern and for the last past state; both are known by their identity."""

    def __init__(self) -> None:
        self._pattern: BodyPattern | None = None
        self._slots: np.ndarray | None = None
        self._past: np.ndarray | None = None
        self._before: np.ndarray | None = None

    def slots(self, group: BushingGroup | CreaseGroup, pattern: BodyPattern) -> np.ndarray:
        """Where the blocks of every element are."""
        if self._slots is None or self._pattern is not pattern:
            self._slots = np.asarray(pair_slots(group.bodies, *pattern.index))
            self._pattern = pattern
        return self._slots

    def before(
        self, group: BushingGroup | CreaseGroup, rates: np.ndarray, past: Past | None
    ) -> tuple[np.ndarray, float]:
        """Deformations in the past, and one over the time since, 1/s; zero without a past."""
        if past is None:
            return group.rest, 0.0
        if self._before is None or self._past is not past.poses:
            self._before = np.asarray(group.measure(past.poses, rates, group.bodies, *group.geometry)[0])
            self._past = past.poses
        return self._before, 1.0 / past.duration


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
    names : names of the elements
    structural : (m,) bool array
        Joints of the structure itself, which cannot come apart; others may be springs of any length.
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
    names: tuple[str, ...]
    structural: np.ndarray
    _kept: _Kept = field(default_factory=_Kept, init=False, repr=False, compare=False)

    @property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.damping))

    @cached_property
    def _constants(self) -> np.ndarray:
        constants, _, _ = _ONE_PASS[self.rest.shape[1]]
        return np.asarray(constants(*self.geometry, self.rest, self.stiffness, self.damping))

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: Past | None = None
    ) -> None:
        """See `Group`."""
        _, add, _ = _ONE_PASS[force.shape[1]]
        add(poses, rates, self.bodies, self._constants, *self._kept.before(self, rates, past), force)

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
        _, _, add = _ONE_PASS[force.shape[1]]
        add(
            poses, rates, self.bodies, self._constants, *self._kept.before(self, rates, past),
            self._kept.slots(self, pattern), force, stiffness, damping,
        )  # fmt: skip

    def gap(self, poses: np.ndarray) -> tuple[float, str]:
        """Largest distance (m) by which the ends of a structural joint have come apart, and its name."""
        value, _, _ = self.measure(poses, np.zeros((len(poses), self.rest.shape[1])), self.bodies, *self.geometry)
        n = 3 if self.rest.shape[1] == 6 else 2
        held = self.structural[:, None] & (self.stiffness[:, :n] > 0.0)
        apart = np.sqrt((np.where(held, value[:, :n] - self.rest[:, :n], 0.0) ** 2).sum(axis=1))
        worst = int(np.argmax(apart))
        return float(apart[worst]), self.names[worst]

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`; springs do not know the time."""

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        value, rate, _ = self.measure(poses, rates, self.bodies, *self.geometry)
        if past is not None:
            before, per_second = self._kept.before(self, rates, past)
            rate = (value - before) * per_second
        energy, power = bushing_energy(value, rate, self.rest, self.stiffness, self.damping)
        totals = np.bincount(self.category, weights=energy, minlength=len(self.categories))
        return {name: float(total) for name, total in zip(self.categories, totals, strict=True)}, power, 0.0

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.bodies, 0


@dataclass(frozen=True)
class CreaseGroup:
    """Hinges whose moment is a tabulated curve. Energies and forces take different ways as in `BushingGroup`.

    Attributes
    ----------
    measure, tangent : kernels of `fsm.interactions.hinge_planar` or `hinge_spatial`
        The tangent is what the tests hold the one pass against.
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
    _kept: _Kept = field(default_factory=_Kept, init=False, repr=False, compare=False)

    @property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.damping))

    @cached_property
    def _curves(self) -> tuple[np.ndarray, ...]:
        table = self.table
        return self.curve, table.bounds, table.knots, table.coefficients, table.energies

    @cached_property
    def _arguments(self) -> tuple[np.ndarray, ...]:
        """What both kernels take after poses and rates."""
        return self.bodies, *self.geometry, self.rest, self.side, self.damping, *self._curves

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: Past | None = None
    ) -> None:
        """See `Group`."""
        add, _ = _ONE_PASS_CREASE[force.shape[1]]
        add(poses, rates, *self._arguments, *self._kept.before(self, rates, past), force)

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
        _, add = _ONE_PASS_CREASE[force.shape[1]]
        add(
            poses, rates, *self._arguments, *self._kept.before(self, rates, past), self._kept.slots(self, pattern),
            force, stiffness, damping,
        )  # fmt: skip

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`; springs do not know the time."""

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        angle, rate, _ = self.measure(poses, rates, self.bodies, *self.geometry)
        if past is not None:
            before, per_second = self._kept.before(self, rates, past)
            rate = (angle - before) * per_second
        energy = crease_energy(angle, self.rest, self.side, *self._curves)
        return {"creases": float(energy.sum())}, float(self.damping @ rate**2), 0.0

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.bodies, 0
