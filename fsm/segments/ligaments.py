"""Group of ligaments: hinges of finite length in lattices."""

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
from fsm.segments.element_cache import TwoBodyGroup
from fsm.segments.group import PreviousPoses
from fsm.segments.pattern import BodyPattern

__all__ = ["LigamentGroup"]


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
