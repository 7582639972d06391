"""Groups of force elements and creases: deformations, laws, and assembly of forces and tangents."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.bushing_planar import (
    advance_efforts_planar,
    force_pose_planar,
    linearise_pose_planar,
    pose_constants_planar,
    stored_pose_planar,
    widest_pose_planar,
)
from fsm.interactions.bushing_spatial import (
    advance_efforts_spatial,
    force_pose_spatial,
    linearise_pose_spatial,
    pose_constants_spatial,
    stored_pose_spatial,
    widest_pose_spatial,
)
from fsm.interactions.crease_planar import force_crease_planar, linearise_crease_planar
from fsm.interactions.crease_spatial import force_crease_spatial, linearise_crease_spatial
from fsm.interactions.hinge_planar import measure_hinge_planar
from fsm.interactions.hinge_spatial import measure_hinge_spatial
from fsm.interactions.pose_planar import measure_pose_planar
from fsm.interactions.pose_spatial import measure_pose_spatial
from fsm.laws.crease import CreaseLaws, CurveTable, crease_energy, crease_moment
from fsm.segments.element_cache import TwoBodyGroup
from fsm.segments.group import PreviousPoses
from fsm.segments.pattern import BodyPattern

__all__ = ["BushingGroup", "CreaseGroup"]

Kernel = Callable[..., Any]


class _Kernels(NamedTuple):
    """Kernel of the deformations, and kernels that compute and assemble in one loop over the elements."""

    measure: Kernel
    constants: Kernel
    force: Kernel
    linearise: Kernel
    advance: Kernel
    stored: Kernel
    widest: Kernel


_ONE_PASS = {
    3: _Kernels(
        measure_pose_planar, pose_constants_planar, force_pose_planar, linearise_pose_planar, advance_efforts_planar,
        stored_pose_planar, widest_pose_planar,
    ),
    6: _Kernels(
        measure_pose_spatial, pose_constants_spatial, force_pose_spatial, linearise_pose_spatial, advance_efforts_spatial,
        stored_pose_spatial, widest_pose_spatial,
    ),
}  # fmt: skip
"""Kernels by the number of rows of a block."""

_ONE_PASS_CREASE: dict[int, tuple[Kernel, Kernel]] = {
    3: (force_crease_planar, linearise_crease_planar),
    6: (force_crease_spatial, linearise_crease_spatial),
}
"""Kernels by the number of rows of a block: moments, and moments with tangents."""


@dataclass(frozen=True)
class BushingGroup(TwoBodyGroup):
    """Linear springs and dampers between relative poses.

    The kernels of `fsm.interactions.bushing_planar` or `bushing_spatial` compute forces and tangents.

    Attributes
    ----------
    bodies, geometry : see `TwoBodyGroup`
    rest, stiffness, damping : (m, 3 or 6) arrays
    category : (m,) int array
        Index into `in_panels` for the energy of each element.
    in_panels : (n,) array
        Fraction (0 to 1) of the energy of each category that counts as energy of panels; the rest counts as energy of
        creases.
    names : names of the elements
    structural : (m,) bool array
        Joints of the structure, whose ends must stay together; other springs may have any length.
    """

    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    category: np.ndarray
    in_panels: np.ndarray
    names: tuple[str, ...]
    structural: np.ndarray

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.damping))

    @cached_property
    def _kernels(self) -> _Kernels:
        return _ONE_PASS[self.rest.shape[1]]

    @property
    def measure(self) -> Kernel:
        """See `TwoBodyGroup`."""
        return self._kernels.measure

    @cached_property
    def _constants(self) -> np.ndarray:
        return np.asarray(self._kernels.constants(*self.geometry, self.rest, self.stiffness, self.damping))

    @cached_property
    def _no_efforts(self) -> np.ndarray:
        """The array of efforts is empty, so the geometric stiffness uses the efforts at the present poses."""
        return np.zeros((0, self.rest.shape[1]))

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: PreviousPoses | None = None
    ) -> None:
        """See `Group`."""
        self._kernels.force(poses, rates, self.bodies, self._constants, *self._before(rates, past), force)

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
        efforts: np.ndarray | None = None,
    ) -> None:
        """See `Group`. If `efforts` (m, 3 or 6) is given, the geometric stiffness uses it."""
        self._kernels.linearise(
            poses, rates, self.bodies, self._constants, *self._before(rates, past),
            self._no_efforts if efforts is None else efforts, self._slots(pattern), force, stiffness, damping,
        )  # fmt: skip

    def arrays(self, pattern: BodyPattern) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Bodies, constants and block positions, for `fsm.segments.arrays`."""
        return self.bodies, self._constants, self._slots(pattern)

    def efforts(self, poses: np.ndarray, change: np.ndarray, past: PreviousPoses | None = None) -> np.ndarray:
        """Efforts (m, 3 or 6) after a change (n_bodies, 3 or 6) of the poses, to first order."""
        before = self._before(change, past)
        return np.asarray(self._kernels.advance(poses, change, self.bodies, self._constants, *before))

    def gap(self, poses: np.ndarray) -> tuple[float, str]:
        """Largest separation (m) of the two sides of a structural joint, and the name of the joint."""
        worst, apart = self._kernels.widest(poses, self.bodies, self._constants, self.structural)
        return apart, self.names[worst]

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        totals, power = self._kernels.stored(
            poses, rates, self.bodies, self._constants, *self._before(rates, past), self.category, len(self.in_panels)
        )
        in_creases = float((1.0 - self.in_panels) @ totals)
        return {"panels": float(self.in_panels @ totals), "creases": in_creases}, power, 0.0


@dataclass(frozen=True)
class CreaseGroup(TwoBodyGroup):
    """Hinges whose moment is a tabulated curve.

    Attributes
    ----------
    bodies, geometry : see `TwoBodyGroup`
    rest, side : (m,) arrays
        Rest angle (rad) and side (+1 or -1) of each crease; the opening is o = rest - side psi.
    damping : (m,) array, N m s/rad
    curve : (m,) int array
        Curve of each crease in `table`.
    table : CurveTable
    flexibility : (m,) array, rad/(N m)
        Flexibility of the half segments in series with each crease; the curves include it.
    names : names of the elements
    """

    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray
    side: np.ndarray
    damping: np.ndarray
    curve: np.ndarray
    table: CurveTable
    flexibility: np.ndarray
    names: tuple[str, ...] = ()

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.damping))

    @property
    def measure(self) -> Kernel:
        """See `TwoBodyGroup`."""
        return measure_hinge_planar if len(self.geometry) == 1 else measure_hinge_spatial

    @cached_property
    def law(self) -> CreaseLaws:
        """Laws of all creases, for the kernels."""
        table = self.table
        own = self.rest, self.side, self.damping, self.curve
        return CreaseLaws(*own, table.bounds, table.knots, table.coefficients, table.energies)

    @cached_property
    def _arguments(self) -> tuple[Any, ...]:
        """Arguments of both kernels after poses and rates."""
        return self.bodies, *self.geometry, self.law

    def arrays(self, pattern: BodyPattern) -> tuple[Any, ...]:
        """Arguments of the kernels and block positions, for `fsm.segments.arrays`; planar creases have no axes."""
        no_axes = np.zeros((len(self.bodies), 4))
        axes = self.geometry[:-1] or (no_axes, no_axes)
        return self.bodies, *axes, self.geometry[-1], self.law, self.flexibility, self._slots(pattern)

    def moments(self, angle: np.ndarray) -> np.ndarray:
        """Elastic moments (m,) at hinge angles (m,), positive against the opening, N m."""
        effort, _ = crease_moment(angle, np.zeros(len(angle)), self.law)
        return np.asarray(-self.side * effort[:, 0])

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: PreviousPoses | None = None
    ) -> None:
        """See `Group`."""
        add, _ = _ONE_PASS_CREASE[force.shape[1]]
        add(poses, rates, *self._arguments, *self._before(rates, past), force)

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
        _, add = _ONE_PASS_CREASE[force.shape[1]]
        add(
            poses, rates, *self._arguments, *self._before(rates, past), self._slots(pattern),
            force, stiffness, damping,
        )  # fmt: skip

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        angle, rate, _ = self.measure(poses, rates, self.bodies, *self.geometry)
        before, per_second = self._before(rates, past)
        if per_second:
            rate = (angle - before) * per_second
        energy = crease_energy(angle, self.law)
        panels = 0.5 * float(self.flexibility @ self.moments(angle) ** 2)
        return {"panels": panels, "creases": float(energy.sum()) - panels}, float(self.damping @ rate**2), 0.0
