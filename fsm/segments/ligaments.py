"""Group of ligaments: hinges of finite length in lattices."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fsm.interactions.ligament_planar import (
    force_ligament_planar,
    ligament_constants_planar,
    linearise_ligament_planar,
    measure_ligament_planar,
    stored_ligament_planar,
)
from fsm.segments.element_cache import ElementCache
from fsm.segments.group import PreviousPoses
from fsm.segments.pattern import BodyPattern

__all__ = ["LigamentGroup"]


@dataclass(frozen=True)
class LigamentGroup:
    """Linear ligaments in the plane.

    Attributes
    ----------
    bodies : (m, 2) int array
    constants : (m, 13) array of `ligament_constants_planar`
    names : names of the elements
    """

    bodies: np.ndarray
    constants: np.ndarray
    names: tuple[str, ...] = ()
    measure: ClassVar[Any] = staticmethod(measure_ligament_planar)
    _cache: ElementCache = field(default_factory=ElementCache, init=False, repr=False, compare=False)

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
        return cls(bodies, ligament_constants_planar(poses, bodies, point_inner, point_outer, stiffness, damping), names)

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.constants[:, 10:]))

    @property
    def geometry(self) -> tuple[np.ndarray, ...]:
        """Arguments of the kernels after `bodies`."""
        return (self.constants,)

    @cached_property
    def rest(self) -> np.ndarray:
        """Zero deformations (m, 3), for use without a past state."""
        return np.ascontiguousarray(self.constants[:, 7:10])

    def _before(self, rates: np.ndarray, past: PreviousPoses | None) -> tuple[np.ndarray, float]:
        """Past deformations and the inverse of the elapsed time; used only with dampers."""
        return self._cache.before(self, rates, past if self.rate_dependent else None)

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

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`; springs do not depend explicitly on time."""

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`; the energy of hinges counts as that of creases."""
        before = self._before(rates, past)
        energy, power = stored_ligament_planar(poses, rates, self.bodies, self.constants, *before)
        return {"creases": energy}, power, 0.0

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.bodies, 0
