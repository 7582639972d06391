"""Elements on the hinge angle between two bodies: the common rows of their tables, and kernels that measure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fsm.interactions.hinge_planar import measure_hinge_planar
from fsm.interactions.hinge_spatial import measure_hinge_spatial
from fsm.kernels.addresses import floats_1d, floats_2d
from fsm.kernels.jit import kernel
from fsm.model.bodies.arrays import POSES, RATES
from fsm.model.elements.element_group import LAST, OWN, ElementGroup, bodies_of

AXES_INNER, AXES_OUTER, OFFSET, AFTER_HINGE = range(OWN, OWN + 4)
"""Rows of the table of a group: axes of the hinge in both bodies (empty in the plane), offset of the angle."""


@kernel
def planar_angles(table: np.ndarray, own: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles, rates and gradients; see `measure_hinge_planar`."""
    return measure_hinge_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_1d(own, OFFSET)
    )


@kernel
def spatial_angles(table: np.ndarray, own: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles, rates and gradients; see `measure_hinge_spatial`."""
    return measure_hinge_spatial(
        floats_2d(table, POSES), floats_2d(table, RATES), bodies_of(own), floats_2d(own, AXES_INNER),
        floats_2d(own, AXES_OUTER), floats_1d(own, OFFSET),
    )  # fmt: skip


@kernel
def keep_planar(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """See `fsm.model.elements.element_group.ElementKernels`."""
    floats_1d(own, LAST)[:] = planar_angles(table, own)[0]
    return 0.0


@kernel
def keep_spatial(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """See `fsm.model.elements.element_group.ElementKernels`."""
    floats_1d(own, LAST)[:] = spatial_angles(table, own)[0]
    return 0.0


class HingeGroup(ElementGroup):
    """Elements on hinge angles.

    Attributes
    ----------
    bodies : (m, 2) int array
    geometry : tuple of arrays
        Offset (m,) of the angle, rad; in space after the axes of the hinge in both bodies, (m, 4) quaternions.
    """

    geometry: tuple[np.ndarray, ...]

    @property
    def spatial(self) -> bool:
        """Whether bodies move in space."""
        return len(self.geometry) == 3

    @property
    def measure(self) -> Callable[..., Any]:
        """Kernel (poses, rates, bodies, *geometry) -> (angles, rates, gradients)."""
        return measure_hinge_spatial if self.spatial else measure_hinge_planar

    @property
    def hinge_arrays(self) -> list[np.ndarray]:
        """Arrays of the rows before `AFTER_HINGE`."""
        none = np.zeros((0, 4))
        return [*self.geometry] if self.spatial else [none, none, *self.geometry]
