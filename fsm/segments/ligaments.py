"""Ligaments, hinges of finite length in lattices: the group, its table, and its kernels for compiled steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.ligament_planar import (
    force_ligament_planar,
    ligament_constants_planar,
    linearise_ligament_planar,
    measure_ligament_planar,
    stored_ligament_planar,
)
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.segments.arrays import DAMPING, DOF, FORCE, POSES, RATES, STIFFNESS, STORED, pattern_of
from fsm.segments.element_cache import ElementArrays, ElementKernels, TwoBodyGroup
from fsm.segments.group import PreviousPoses
from fsm.segments.pattern import BodyPattern

__all__ = ["LigamentGroup"]


class _Ligaments(NamedTuple):
    """Table of a group.

    Attributes
    ----------
    bodies : (m, 2) int array
    constants : (m, 13) array of `ligament_constants_planar`
    last : (m, 3) array, m and rad
        Deformations at the end of the last step.
    """

    bodies: np.ndarray
    constants: np.ndarray
    last: np.ndarray


@kernel
def _ligaments_of(t: np.ndarray) -> _Ligaments:
    return _Ligaments(integers_2d(t, 0), floats_2d(t, 1), floats_2d(t, 2))


@kernel
def _force(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    g, poses, rates = _ligaments_of(own), floats_2d(table, POSES), floats_2d(table, RATES)
    force_ligament_planar(poses, rates, g.bodies, g.constants, g.last, per_second, floats_2d(table, FORCE))
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    g, pattern = _ligaments_of(own), pattern_of(table)
    linearise_ligament_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), g.bodies, g.constants, g.last, per_second,
        integers_1d(table, DOF), pattern.rows, pattern.columns, floats_2d(table, FORCE), floats_3d(table, STIFFNESS),
        floats_3d(table, DAMPING),
    )  # fmt: skip
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    g, poses, rates = _ligaments_of(own), floats_2d(table, POSES), floats_2d(table, RATES)
    floats_1d(table, STORED)[1] += stored_ligament_planar(poses, rates, g.bodies, g.constants, g.last, per_second)[0]
    return 0.0


@kernel
def _lost(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    g, poses, rates = _ligaments_of(own), floats_2d(table, POSES), floats_2d(table, RATES)
    return stored_ligament_planar(poses, rates, g.bodies, g.constants, g.last, per_second)[1]


@kernel
def _accept(table: np.ndarray, own: np.ndarray, per_second: float) -> float:
    g, poses, rates = _ligaments_of(own), floats_2d(table, POSES), floats_2d(table, RATES)
    g.last[:] = measure_ligament_planar(poses, rates, g.bodies, g.constants)[0]
    return 0.0


_KERNELS = ElementKernels(_force, _tangent, _stored, _lost, _accept)


@dataclass(frozen=True)
class LigamentGroup(TwoBodyGroup):
    """Linear ligaments in the plane.

    Attributes
    ----------
    bodies, geometry, rest : see `TwoBodyGroup`
        `geometry` holds one array, the (m, 13) constants of `ligament_constants_planar`.
    names : names of the elements
    """

    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray
    names: tuple[str, ...] = ()

    @classmethod
    def at_rest(
        cls,
        poses: np.ndarray,
        bodies: np.ndarray,
        point_inner: np.ndarray,
        point_outer: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        names: tuple[str, ...] = (),
    ) -> LigamentGroup:
        """Create ligaments that are stress-free at the given poses."""
        constants = ligament_constants_planar(poses, bodies, point_inner, point_outer, stiffness, damping)
        return cls(bodies, (constants,), np.ascontiguousarray(constants[:, 7:10]), names)

    @property
    def constants(self) -> np.ndarray:
        """Constants (m, 13) of the kernels."""
        return self.geometry[0]

    def compiled(self, pattern: BodyPattern) -> ElementArrays:
        """See `TwoBodyGroup`."""
        last = np.zeros(self.rest.shape)
        return ElementArrays(_KERNELS, [self.bodies, self.constants, last], last)

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.constants[:, 10:]))

    @property
    def measure(self) -> Callable[..., Any]:
        """See `TwoBodyGroup`."""
        return measure_ligament_planar

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: PreviousPoses | None = None
    ) -> None:
        """See `Group`."""
        force_ligament_planar(poses, rates, self.bodies, self.constants, *self._before(rates, past), force)

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
        linearise_ligament_planar(
            poses, rates, self.bodies, self.constants, *self._before(rates, past), *pattern.index, force, stiffness, damping
        )

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`; the energy of hinges counts as energy of creases."""
        before = self._before(rates, past)
        energy, power = stored_ligament_planar(poses, rates, self.bodies, self.constants, *before)
        return {"creases": energy}, power, 0.0
