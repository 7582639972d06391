"""Ligaments, hinges of finite length in lattices: the group, its table, and its kernels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fsm.interactions.ligament_planar import (
    force_ligament_planar,
    ligament_constants_planar,
    linearise_ligament_planar,
    measure_ligament_planar,
    stored_ligament_planar,
)
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d
from fsm.kernels.jit import kernel
from fsm.model.bodies.arrays import DAMPING, FORCE, POSES, RATES, STIFFNESS, STORED, index_of
from fsm.model.elements.element_group import LAST, OWN, ElementGroup, ElementKernels, bodies_of

_CONSTANTS = OWN


@kernel
def _force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    force_ligament_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_2d(own, _CONSTANTS), floats_2d(own, LAST),
        per_second, floats_2d(table, FORCE),
    )  # fmt: skip
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    linearise_ligament_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_2d(own, _CONSTANTS), floats_2d(own, LAST),
        per_second, index_of(table), floats_2d(table, FORCE), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING),
    )  # fmt: skip
    return 0.0


@kernel
def _energy(table: np.ndarray, own: np.ndarray, per_second: float) -> tuple[float, float]:
    """Stored energy (J) and dissipated power (W)."""
    return stored_ligament_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_2d(own, _CONSTANTS), floats_2d(own, LAST),
        per_second,
    )  # fmt: skip


@kernel
def _stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Add the energy of hinges, which counts as energy of creases."""
    floats_1d(table, STORED)[1] += _energy(table, own, per_second)[0]
    return 0.0


@kernel
def _lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    return _energy(table, own, per_second)[1]


@kernel
def _keep(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    floats_2d(own, LAST)[:] = measure_ligament_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_2d(own, _CONSTANTS)
    )[0]
    return 0.0


_KERNELS = ElementKernels(_force, _tangent, _keep, _stored, _lost)


@dataclass(frozen=True)
class LigamentGroup(ElementGroup):
    """Ligaments in the plane: linear springs, or beams whose chord shortens when they bend.

    Attributes
    ----------
    bodies : (m, 2) int array
    geometry : tuple
        One array, the (m, 14) constants of `ligament_constants_planar`.
    rest : (m, 3) array, m and rad
    names : names of the elements
    """

    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray
    names: tuple[str, ...] = ()
    categories = ("creases",)

    @classmethod
    def at_rest(
        cls,
        poses: np.ndarray,
        bodies: np.ndarray,
        point_inner: np.ndarray,
        point_outer: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        bends: np.ndarray,
        names: tuple[str, ...] = (),
    ) -> LigamentGroup:
        """Create ligaments that are stress-free at the given poses."""
        constants = ligament_constants_planar(poses, bodies, point_inner, point_outer, stiffness, damping, bends)
        return cls(bodies, (constants,), np.ascontiguousarray(constants[:, 7:10]), names)

    @property
    def constants(self) -> np.ndarray:
        """Constants (m, 14) of the kernels."""
        return self.geometry[0]

    kernels = _KERNELS

    @property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return [self.constants]

    @property
    def last_shape(self) -> tuple[int, ...]:
        """See `ElementGroup`."""
        return self.rest.shape

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.constants[:, 10:13]))

    @property
    def measure(self) -> Callable[..., Any]:
        """Kernel (poses, rates, bodies, *geometry) -> (deformations, rates, gradients)."""
        return measure_ligament_planar
