"""Hinges whose moment is a tabulated curve: the group, its table, and its kernels for compiled steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.crease_planar import force_crease_planar, linearise_crease_planar
from fsm.interactions.crease_spatial import force_crease_spatial, linearise_crease_spatial
from fsm.interactions.hinge_planar import measure_hinge_planar
from fsm.interactions.hinge_spatial import measure_hinge_spatial
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.laws.crease import CreaseLaws, CurveTable, crease_energy, crease_moment
from fsm.segments.arrays import DAMPING, FORCE, POSES, RATES, STIFFNESS, STORED
from fsm.segments.element_cache import ElementArrays, ElementKernels, TwoBodyGroup
from fsm.segments.group import PreviousPoses
from fsm.segments.pattern import BodyPattern

__all__ = ["CreaseGroup"]

Kernel = Callable[..., Any]


class _Creases(NamedTuple):
    """Table of a group.

    Attributes
    ----------
    bodies : (m, 2) int array
    offset : (m,) array, rad
    law : CreaseLaws
    flexibility : (m,) array, rad/(N m)
    slots : (m, 4) int array
    last : (m,) array, rad
        Angles at the end of the last step.
    """

    bodies: np.ndarray
    offset: np.ndarray
    law: CreaseLaws
    flexibility: np.ndarray
    slots: np.ndarray
    last: np.ndarray


@kernel
def _creases_of(t: np.ndarray, axes: int) -> _Creases:
    """Creases of a table with a number of arrays of axes after the bodies."""
    k = 1 + axes
    law = CreaseLaws(
        floats_1d(t, k + 1), floats_1d(t, k + 2), floats_1d(t, k + 3), integers_1d(t, k + 4), integers_1d(t, k + 5),
        floats_1d(t, k + 6), floats_2d(t, k + 7), floats_1d(t, k + 8),
    )  # fmt: skip
    return _Creases(
        integers_2d(t, 0), floats_1d(t, k), law, floats_1d(t, k + 9), integers_2d(t, k + 10), floats_1d(t, k + 11)
    )


@kernel
def _planar_force(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    c = _creases_of(own, 0)
    force_crease_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), c.bodies, c.offset, c.law, c.last, per_second,
        floats_2d(table, FORCE),
    )  # fmt: skip
    return 0.0


@kernel
def _planar_tangent(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    c = _creases_of(own, 0)
    linearise_crease_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), c.bodies, c.offset, c.law, c.last, per_second, c.slots,
        floats_2d(table, FORCE), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING),
    )  # fmt: skip
    return 0.0


@kernel
def _spatial_force(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    c, inner, outer = _creases_of(own, 2), floats_2d(own, 1), floats_2d(own, 2)
    force_crease_spatial(
        floats_2d(table, POSES), floats_2d(table, RATES), c.bodies, inner, outer, c.offset, c.law, c.last, per_second,
        floats_2d(table, FORCE),
    )  # fmt: skip
    return 0.0


@kernel
def _spatial_tangent(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    c, inner, outer = _creases_of(own, 2), floats_2d(own, 1), floats_2d(own, 2)
    linearise_crease_spatial(
        floats_2d(table, POSES), floats_2d(table, RATES), c.bodies, inner, outer, c.offset, c.law, c.last, per_second,
        c.slots, floats_2d(table, FORCE), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING),
    )  # fmt: skip
    return 0.0


@kernel
def _planar_angles(table: np.ndarray, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    c = _creases_of(own, 0)
    angle, rate, _ = measure_hinge_planar(floats_2d(table, POSES), floats_2d(table, RATES), c.bodies, c.offset)
    return angle, rate


@kernel
def _spatial_angles(table: np.ndarray, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    c, inner, outer = _creases_of(own, 2), floats_2d(own, 1), floats_2d(own, 2)
    poses, rates = floats_2d(table, POSES), floats_2d(table, RATES)
    angle, rate, _ = measure_hinge_spatial(poses, rates, c.bodies, inner, outer, c.offset)
    return angle, rate


@kernel
def _add_stored(c: _Creases, angle: np.ndarray, stored: np.ndarray) -> None:
    """Add the energies in panels and in creases to `stored` (2,)."""
    energy = crease_energy(angle, c.law)
    moment, _ = crease_moment(angle, np.zeros(angle.shape[0]), c.law)
    half_cells = total = 0.0
    for i in range(angle.shape[0]):
        total += energy[i]
        half_cells += 0.5 * c.flexibility[i] * moment[i, 0] ** 2
    stored[0] += half_cells
    stored[1] += total - half_cells


@kernel
def _power(c: _Creases, angle: np.ndarray, rate: np.ndarray, per_second: float) -> float:
    power = 0.0
    for i in range(angle.shape[0]):
        speed = rate[i] if per_second == 0.0 else (angle[i] - c.last[i]) * per_second
        power += c.law.damping[i] * speed**2
    return power


@kernel
def _planar_stored(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    _add_stored(_creases_of(own, 0), _planar_angles(table, own)[0], floats_1d(table, STORED))
    return 0.0


@kernel
def _spatial_stored(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    _add_stored(_creases_of(own, 2), _spatial_angles(table, own)[0], floats_1d(table, STORED))
    return 0.0


@kernel
def _planar_lost(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    angle, rate = _planar_angles(table, own)
    return _power(_creases_of(own, 0), angle, rate, per_second)


@kernel
def _spatial_lost(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    angle, rate = _spatial_angles(table, own)
    return _power(_creases_of(own, 2), angle, rate, per_second)


@kernel
def _planar_accept(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    _creases_of(own, 0).last[:] = _planar_angles(table, own)[0]
    return 0.0


@kernel
def _spatial_accept(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    _creases_of(own, 2).last[:] = _spatial_angles(table, own)[0]
    return 0.0


_PLANAR = ElementKernels(_planar_force, _planar_tangent, _planar_stored, _planar_lost, _planar_accept)
_SPATIAL = ElementKernels(_spatial_force, _spatial_tangent, _spatial_stored, _spatial_lost, _spatial_accept)


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

    def compiled(self, pattern: BodyPattern) -> ElementArrays:
        """See `TwoBodyGroup`; planar creases have no axes."""
        last = np.zeros(len(self.bodies))
        arrays = [self.bodies, *self.geometry, *self.law, self.flexibility, self._slots(pattern), last]
        return ElementArrays(_PLANAR if len(self.geometry) == 1 else _SPATIAL, arrays, last)

    def moments(self, angle: np.ndarray) -> np.ndarray:
        """Elastic moments (m,) at hinge angles (m,), positive against the opening, N m."""
        effort, _ = crease_moment(angle, np.zeros(len(angle)), self.law)
        return np.asarray(-self.side * effort[:, 0])

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: PreviousPoses | None = None
    ) -> None:
        """See `Group`."""
        add: Kernel = force_crease_planar if force.shape[1] == 3 else force_crease_spatial
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
        add: Kernel = linearise_crease_planar if force.shape[1] == 3 else linearise_crease_spatial
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
