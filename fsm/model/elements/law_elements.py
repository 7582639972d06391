"""Force elements with a law of an extension: the law computes six efforts from six deformations.

Elements of extensions whose energy depends on the positions of points of bodies, in space.

A point x = r + A p of a body has the increment dx = dr - A [p] dphi = J (dr, dphi), with the rotation dphi in body axes.
With the gradient g and the Hessian H of the energy with respect to all positions,

    h = -J^T g,    K = J^T H J + sum [p] [A^T g]   (the second term on dphi)

The points of frames have p = 0, or rotate with the axes of the frame in the same way as points of bodies.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.rotation import rotation_matrix
from fsm.kernels.scatter import add_block, scatter_efforts
from fsm.model.bodies.group import BlockSums, BodyState, Group
from fsm.model.elements.elements import BUSHINGS, TwoBodyGroup

_IN_PLANE = [0, 2, 4]
"""Indices of the three planar components among the six deformations of an element in space."""
_NO_SLOPE = 1e-300
"""Stiffness of constant efforts; kernels of linear springs leave out directions without a stiffness."""


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
        return BUSHINGS[self.rest.shape[1]].measure

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
        kernels, pattern = BUSHINGS[self.rest.shape[1]], sums.pattern
        constants = kernels.constants(*self.geometry, value, np.where(slope == 0.0, _NO_SLOPE, slope), by_rate)
        kernels.in_one_pass.tangent(
            at.poses, at.rates, self.bodies, constants, *self._before(at.rates, at.past), effort, self._slots(pattern),
            np.zeros_like(at.rates), *sums[2:],
        )

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


class PointKind(NamedTuple):
    """Kind of element between points, without damping.

    Attributes
    ----------
    points : number of points
    energy : function
        ``energy(positions, parameters)``: energy, J, of the positions (points, 3), m.
    slopes : function
        ``slopes(positions, parameters) -> gradient, hessian``: energy derivatives with respect to positions, (points, 3), N,
        and (points, 3, points, 3), N/m.
    """

    points: int
    energy: Callable[[np.ndarray, Any], float]
    slopes: Callable[[np.ndarray, Any], tuple[np.ndarray, np.ndarray]]


class _Element(NamedTuple):
    """One element: kind, parameters, numbers of its bodies (n,), points in body axes (n, 3)."""

    kind: PointKind
    parameters: Any
    bodies: np.ndarray
    points: np.ndarray

    def positions(self, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions of the points (n, 3), m, and rotation matrices of their bodies (n, 3, 3)."""
        pose = poses[self.bodies]
        axes = np.array([rotation_matrix(row[3:]) for row in pose])
        return pose[:, :3] + np.einsum("nij,nj->ni", axes, self.points), axes


@dataclass(frozen=True, eq=False)
class PointGroup(Group):
    """All point elements of a scene.

    Attributes
    ----------
    elements : kind, parameters, bodies and points of each element
    names : names of the elements
    """

    elements: tuple[_Element, ...]
    names: tuple[str, ...]

    @classmethod
    def of(cls, given: list[tuple[str, PointKind, Any, list[int], list[tuple[float, float, float]]]]) -> PointGroup:
        """Group of elements: name, kind, parameters, numbers of bodies, points in body axes."""
        elements = tuple(
            _Element(kind, own, np.array(bodies, dtype=np.int64), np.array(points)) for _, kind, own, bodies, points in given
        )
        return cls(elements, tuple(name for name, *_ in given))

    @cached_property
    def _pairs(self) -> np.ndarray:
        found = {(a, b) for element in self.elements for a, b in product(element.bodies.tolist(), repeat=2) if a < b}
        return np.array(sorted(found), dtype=np.int64).reshape(-1, 2)

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self._pairs, 0

    def add_force(self, at: BodyState, force: np.ndarray) -> None:
        """See `Group`."""
        for element in self.elements:
            places, axes = element.positions(at.poses)
            gradient, _ = element.kind.slopes(places, element.parameters)
            _add_wrenches(element, axes, np.asarray(gradient, dtype=float), force)

    def add_linearised(self, at: BodyState, sums: BlockSums) -> None:
        """See `Group`."""
        for element in self.elements:
            places, axes = element.positions(at.poses)
            gradient, hessian = (np.asarray(part, dtype=float) for part in element.kind.slopes(places, element.parameters))
            _add_wrenches(element, axes, gradient, sums.force)
            count, pattern = len(places), sums.pattern
            maps = np.zeros((count, 3, 6))
            maps[:, :, :3], maps[:, :, 3:] = np.eye(3), -axes @ _cross_matrices(element.points)
            block = np.einsum("nci,ncmd,mdj->nimj", maps, hessian.reshape(count, 3, count, 3), maps)
            local = np.einsum("nji,nj->ni", axes, gradient)
            turns = _cross_matrices(element.points) @ _cross_matrices(local)
            for n in range(count):
                block[n, 3:, n, 3:] += turns[n]
            whole = np.ascontiguousarray(block.reshape(6 * count, -1))
            add_block(whole, pattern.dof, element.bodies, pattern.indptr, pattern.indices, sums.stiffness)

    def energy(self, at: BodyState) -> tuple[dict[str, float], float, float]:
        """See `Group`; the energy counts as energy of panels and joints."""
        stored = sum(float(e.kind.energy(e.positions(at.poses)[0], e.parameters)) for e in self.elements)
        return {"panels": stored}, 0.0, 0.0


def _add_wrenches(element: _Element, axes: np.ndarray, gradient: np.ndarray, force: np.ndarray) -> None:
    """Add the forces -g at the points, and their moments in body axes."""
    np.add.at(force[:, :3], element.bodies, -gradient)
    local = np.einsum("nji,nj->ni", axes, gradient)
    np.add.at(force[:, 3:], element.bodies, -np.cross(element.points, local))


def _cross_matrices(vectors: np.ndarray) -> np.ndarray:
    """Matrices [v] with [v] w = v x w, (n, 3, 3)."""
    out = np.zeros((len(vectors), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -vectors[:, 2], vectors[:, 1], -vectors[:, 0]
    return out - out.transpose(0, 2, 1)
