"""Force elements with a law of an extension: the law computes six efforts from six deformations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.pose_planar import MeasureTangents, measure_pose_planar, tangent_pose_planar
from fsm.interactions.pose_spatial import measure_pose_spatial, tangent_pose_spatial
from fsm.kernels.scatter import scatter_efforts
from fsm.model.bodies.group import BlockSums, BodyState
from fsm.model.elements.elements import TwoBodyGroup

_IN_PLANE = [0, 2, 4]
"""Indices of the three planar components among the six deformations of an element in space."""


class ElementLaw(NamedTuple):
    """Law of a force element between two bodies.

    Attributes
    ----------
    effort : function
        ``effort(deformation, rate, parameters) -> effort, stiffness, damping``, (6,) arrays. `deformation` is the
        translation (e1, e2, e3), m, and the rotation (swing, twist, swing), rad, of the inner body relative to the outer
        body, see `ForceElement`. `effort` (N, N m) resists an increase of the deformation. `stiffness` and `damping` are
        the derivatives of an effort with respect to the deformation and the rate of the same direction; a direction
        does not affect the others.
    energy : function
        ``energy(deformation, parameters)``: energy of the effort at rest, J.
    rate_dependent : whether the effort depends on rates
    """

    effort: Callable[[np.ndarray, np.ndarray, Any], tuple[np.ndarray, np.ndarray, np.ndarray]]
    energy: Callable[[np.ndarray, Any], float]
    rate_dependent: bool = False


@dataclass(frozen=True)
class LawGroup(TwoBodyGroup):
    """Force elements with laws of extensions.

    Attributes
    ----------
    bodies, geometry, rest : see `TwoBodyGroup`
    laws : law and parameters of each element
    names : names of the elements
    """

    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray
    laws: tuple[tuple[ElementLaw, Any], ...]
    names: tuple[str, ...]

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return any(law.rate_dependent for law, _ in self.laws)

    @property
    def measure(self) -> Callable[..., Any]:
        """See `TwoBodyGroup`."""
        return measure_pose_spatial if self._spatial else measure_pose_planar

    @property
    def _spatial(self) -> bool:
        return len(self.geometry) == 6

    def _measured(self, at: BodyState) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Deformations, their rates, and gradients."""
        value, rate, gradient = self.measure(at.poses, at.rates, self.bodies, *self.geometry)
        before, per_second = self._before(at.rates, at.past)
        return value, (value - before) * per_second if per_second else rate, gradient

    def efforts(self, value: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Efforts, stiffnesses and dampings, (m, 3 or 6) arrays."""
        out = np.zeros((3, *value.shape))
        for i, (law, parameters) in enumerate(self.laws):
            found = law.effort(_six(value[i]), _six(rate[i]), parameters)
            for k, part in enumerate(found):
                out[k, i] = _of_six(np.broadcast_to(np.asarray(part, dtype=float), 6), value.shape[1])
        return out[0], out[1], out[2]

    def add_force(self, at: BodyState, force: np.ndarray) -> None:
        """See `Group`."""
        value, rate, gradient = self._measured(at)
        effort, _, _ = self.efforts(value, rate)
        scatter_efforts(self.bodies, gradient, effort, len(effort), force)

    def add_linearised(self, at: BodyState, sums: BlockSums) -> None:
        """See `Group`."""
        value, rate, gradient = self._measured(at)
        effort, slope, by_rate = self.efforts(value, rate)
        scatter_efforts(self.bodies, gradient, effort, len(effort), sums.force)
        # a difference of deformations does not depend on body rates
        moving = at.rates if at.past is None else np.zeros_like(at.rates)
        tangent: Callable[..., Any] = tangent_pose_spatial if self._spatial else tangent_pose_planar
        measured = MeasureTangents(gradient, effort, slope, by_rate)
        tangent(at.poses, moving, self.bodies, *self.geometry, measured, sums.pattern.index, *sums[2:])

    def energy(self, at: BodyState) -> tuple[dict[str, float], float, float]:
        """See `Group`; the energy counts as energy of panels and joints."""
        value, rate, _ = self._measured(at)
        stored = sum(float(law.energy(_six(row), own)) for row, (law, own) in zip(value, self.laws, strict=True))
        moving, _, _ = self.efforts(value, rate)
        still, _, _ = self.efforts(value, np.zeros_like(rate))
        return {"panels": stored}, float(np.sum((moving - still) * rate)), 0.0


def _six(row: np.ndarray) -> np.ndarray:
    if len(row) == 6:
        return row
    out = np.zeros(6)
    out[_IN_PLANE] = row
    return out


def _of_six(row: np.ndarray, size: int) -> np.ndarray:
    return row if size == 6 else row[_IN_PLANE]
