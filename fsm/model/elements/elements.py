"""Groups of springs that each join two bodies: their common part, and linear springs."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions import bushing_planar as planar
from fsm.interactions import bushing_spatial as spatial
from fsm.interactions.pose_planar import measure_pose_planar
from fsm.interactions.pose_spatial import measure_pose_spatial
from fsm.kernels.scatter import pair_slots
from fsm.model.bodies.arrays import SpringKernels
from fsm.model.bodies.group import BlockSums, BodyPattern, BodyState, Group, PreviousPoses
from fsm.model.elements.spring_locks import SpringLocks

Kernel = Callable[..., Any]


class _Cache:
    """Results for the last pattern and the last previous state; both are compared by identity."""

    def __init__(self) -> None:
        self.pattern: BodyPattern | None = None
        self.slots = np.zeros((0, 4), dtype=np.int64)
        self.past: np.ndarray | None = None
        self.before = np.zeros(0)


class TwoBodyGroup(Group):
    """Elements that each join two bodies.

    Attributes
    ----------
    bodies : (m, 2) int array
    geometry : arguments of the kernels after `bodies`
    rest : (m,) or (m, 3 or 6) array
        Deformations for use without a past state.
    """

    bodies: np.ndarray
    geometry: tuple[np.ndarray, ...]
    rest: np.ndarray

    @property
    @abstractmethod
    def measure(self) -> Callable[..., Any]:
        """Kernel (poses, rates, bodies, *geometry) -> (deformations, ...)."""

    @cached_property
    def _cache(self) -> _Cache:
        return _Cache()

    def _slots(self, pattern: BodyPattern) -> np.ndarray:
        """Positions of the matrix blocks of every element."""
        cache = self._cache
        if cache.pattern is not pattern:
            cache.slots, cache.pattern = np.asarray(pair_slots(self.bodies, *pattern.index)), pattern
        return cache.slots

    def _before(self, rates: np.ndarray, past: PreviousPoses | None) -> tuple[np.ndarray, float]:
        """Previous deformations and the inverse of the elapsed time, 1/s; zero without a past state or dampers."""
        if past is None or not self.rate_dependent:
            return self.rest, 0.0
        cache = self._cache
        if cache.past is not past.poses:
            cache.before = np.asarray(self.measure(past.poses, rates, self.bodies, *self.geometry)[0])
            cache.past = past.poses
        return cache.before, 1.0 / past.duration

    def deformations_before(self, rates: np.ndarray, past: PreviousPoses | None) -> np.ndarray:
        """Deformations at a past state; without a past state, deformations at rest."""
        return self._before(rates, past)[0]

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.bodies, 0


class BushingKernels(NamedTuple):
    """Kernels of the deformations and of the constants, columns of `SpringLocks`, and kernels that compute and assemble in
    one loop over the elements.
    """

    measure: Kernel
    constants: Kernel
    columns: tuple[int, int]
    in_one_pass: SpringKernels


BUSHINGS = {
    3: BushingKernels(measure_pose_planar, planar.pose_constants_planar, planar.COLUMNS_PLANAR, SpringKernels(
        planar.force_pose_planar, planar.linearise_pose_planar, planar.stored_pose_planar, planar.deformations_pose_planar,
        planar.advance_efforts_planar, planar.widest_pose_planar,
    )),
    6: BushingKernels(measure_pose_spatial, spatial.pose_constants_spatial, spatial.COLUMNS_SPATIAL, SpringKernels(
        spatial.force_pose_spatial, spatial.linearise_pose_spatial, spatial.stored_pose_spatial,
        spatial.deformations_pose_spatial, spatial.advance_efforts_spatial, spatial.widest_pose_spatial,
    )),
}  # fmt: skip
"""Kernels by the number of rows of a block."""


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
    locked : (m, 3 or 6) bool array
        Directions without a deformation in statics (`fsm.model.elements.spring_locks`); translations have the rest
        position 0.
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
    locked: np.ndarray

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.damping))

    @cached_property
    def _kernels(self) -> BushingKernels:
        return BUSHINGS[self.rest.shape[1]]

    @property
    def _in_one_pass(self) -> SpringKernels:
        return self._kernels.in_one_pass

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

    def add_force(self, at: BodyState, force: np.ndarray) -> None:
        """See `Group`."""
        self._in_one_pass.force(at.poses, at.rates, self.bodies, self._constants, *self._before(at.rates, at.past), force)

    def add_linearised(self, at: BodyState, sums: BlockSums, efforts: np.ndarray | None = None) -> None:
        """See `Group`. If `efforts` (m, 3 or 6) is given, the geometric stiffness uses it."""
        pattern, *of_blocks = sums
        self._in_one_pass.tangent(
            at.poses, at.rates, self.bodies, self._constants, *self._before(at.rates, at.past),
            self._no_efforts if efforts is None else efforts, self._slots(pattern), *of_blocks,
        )

    def arrays(self, pattern: BodyPattern) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Bodies, constants and block positions, for `fsm.model.bodies.arrays`."""
        return self.bodies, self._constants, self._slots(pattern)

    def efforts(self, poses: np.ndarray, change: np.ndarray, past: PreviousPoses | None = None) -> np.ndarray:
        """Efforts (m, 3 or 6) after a change (n_bodies, 3 or 6) of the poses, to first order."""
        before = self._before(change, past)
        return np.asarray(self._in_one_pass.advance(poses, change, self.bodies, self._constants, *before))

    def gap(self, poses: np.ndarray) -> tuple[float, str]:
        """Largest separation (m) of the two sides of a structural joint, and the name of the joint."""
        worst, apart = self._in_one_pass.widest(poses, self.bodies, self._constants, self.in_structure)
        return apart, self.names[worst]

    @cached_property
    def in_structure(self) -> np.ndarray:
        """`structural` as integers, for kernels; `LOCKED` if the translations are locked."""
        held = np.any(self.locked[:, : 3 if self.rest.shape[1] == 6 else 2], axis=1)
        return np.where(held, planar.LOCKED, 1) * self.structural.astype(np.int64)

    @cached_property
    def locks(self) -> SpringLocks | None:
        """Multipliers of the locked directions; None without any."""
        element, direction = np.nonzero(self.locked)
        if not len(element):
            return None
        rest, stiffness = self._kernels.columns
        places = np.stack([element, direction, rest + direction, stiffness + direction], axis=1)
        shares = self.in_panels[np.asarray(self.category)[element]]
        fixed = np.stack([self.rest[element, direction], shares], axis=1)
        return SpringLocks(np.ascontiguousarray(places), self._constants, self.rest, fixed)

    def energy(self, at: BodyState) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        totals, power = self._in_one_pass.stored(
            at.poses, at.rates, self.bodies, self._constants, *self._before(at.rates, at.past), self.category,
            len(self.in_panels),
        )
        in_creases = float((1.0 - self.in_panels) @ totals)
        return {"panels": float(self.in_panels @ totals), "creases": in_creases}, power, 0.0
