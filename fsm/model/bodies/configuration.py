"""Configuration of rigid bodies: poses from q, rates from u, and the inverse (the kinematic part of `System`).

Held and driven bodies have no degrees of freedom. The poses are constant, or given by the drive as a function of time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fsm.case.models.scene import Plate
from fsm.kernels.body_poses import increment_blocks, place_bodies, place_corners, pose_difference, retract_poses
from fsm.kernels.newton_euler import quaternion_jacobian, quaternion_rates, tangent_from_quaternion
from fsm.kernels.vector import equal_vectors
from fsm.model.bodies.drive import PrescribedMotion
from fsm.model.bodies.turns import Turns
from fsm.solve.interface.records import PreviousState
from fsm.solve.interface.system import System

if TYPE_CHECKING:
    from scipy import sparse

_TIMES = 8
"""Number of times whose travels are cached."""


class BodyLine(NamedTuple):
    """Line fixed to a body: number of the body, name, ends in body axes (3,), m, and the number of its kind."""

    body: int
    name: str
    start: np.ndarray
    end: np.ndarray
    kind: int


@dataclass(frozen=True)
class Bodies:
    """Table of all bodies; the ground is the first.

    Attributes
    ----------
    names : names
    pose : (n, 3) or (n, 7) array
        (x, z, phi), or position and unit quaternion, at time zero.
    rate : (n, 3) or (n, 6) array
        Rates at time zero.
    inertia : (n, 3) or (n, 6) array
        Mass or moment of inertia of every degree of freedom.
    free : int array
        Bodies with degrees of freedom.
    plates : (body, plate, panel) of every drawn plate; a polygon of more than four corners has several
    solids : (body, largest size in m) of boxes, cylinders and spheres
    lines : lines that figures show, fixed to bodies in space
    """

    names: tuple[str, ...]
    pose: np.ndarray
    rate: np.ndarray
    inertia: np.ndarray
    free: np.ndarray
    plates: tuple[tuple[int, Plate, int], ...]
    solids: tuple[tuple[int, float], ...] = ()
    lines: tuple[BodyLine, ...] = ()


class Configuration(System):
    """Configuration of bodies with prescribed motions; `System` describes the methods.

    Attributes
    ----------
    size : degrees of freedom of a body
    spatial : bool
    at_rest : (n, 3) or (n, 6) array
        Zero rates of all bodies; the array is shared and read-only.
    driven : (m,) int array
        Bodies of all motions, in one array.
    drives : driven bodies, the number of the motion of each body, and the directions of all motions
    turns : Turns or None
        Bodies that turn.
    """

    def __init__(self, bodies: Bodies, motions: tuple[PrescribedMotion, ...]) -> None:
        self.bodies = bodies
        self.motions = motions
        self.size = bodies.rate.shape[1]
        self.spatial = self.size == 6
        self.n_free = len(bodies.free)
        self.nq = self.n_free * bodies.pose.shape[1]
        self.nu = self.n_free * self.size
        self.at_rest = np.zeros(bodies.rate.shape)
        self.driven = np.array([body for motion in motions for body in motion.bodies], dtype=np.int64)
        self._motion = np.array([k for k, motion in enumerate(motions) for _ in motion.bodies], dtype=np.int64)
        self._directions = np.array([motion.direction for motion in motions]).reshape(len(motions), 3 if self.spatial else 2)
        self.turns = Turns.of(motions, bodies.pose)
        self.drives = self.driven, self._motion, self._directions
        self._standing = np.zeros(len(motions))
        self._travelled: dict[float, np.ndarray] = {}
        nowhere = (np.nan, np.zeros(0), bodies.pose)
        self._placed = self._placed_before = nowhere
        self._moving: tuple[float, np.ndarray, float | None, np.ndarray] = (np.nan, np.zeros(0), None, self.at_rest)
        self._plate_bodies = np.array([*(body for body, _, _ in bodies.plates), *(line.body for line in bodies.lines)], int)
        lines = np.array([(line.start, line.end, line.end, line.start) for line in bodies.lines]).reshape(-1, 4, 3)
        self._plate_corners = np.concatenate([_corners([plate for _, plate, _ in bodies.plates]), lines])

    def initial(self) -> tuple[np.ndarray, np.ndarray]:
        """See `System`."""
        return self.bodies.pose[self.bodies.free].ravel(), self.bodies.rate[self.bodies.free].ravel()

    def body_poses(self, q: np.ndarray) -> np.ndarray:
        """Poses (n_free, 3 or 7) of the free bodies."""
        width = self.bodies.pose.shape[1]
        return np.asarray(q[: self.n_free * width].reshape(-1, width))

    def kinematic_map(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """See `System`."""
        return quaternion_rates(q.reshape(-1, 7), u.reshape(-1, 6), self._norm_rate).ravel() if self.spatial else u

    def kinematic_jacobian(self, q: np.ndarray, u: np.ndarray) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        """See `System`."""
        if not self.spatial:
            return super().kinematic_jacobian(q, u)
        by_q, by_u = quaternion_jacobian(q.reshape(-1, 7), u.reshape(-1, 6), self._norm_rate)
        return _block_diagonal(by_q), _block_diagonal(by_u)

    @cached_property
    def _norm_rate(self) -> float:
        """Rate at which SciPy's methods return the norms of quaternions to one: the scale of angular velocities, 1/s."""
        return float(self.scales().velocity[self.size - 1]) if self.n_free else 0.0

    def tangent_map(self, q: np.ndarray) -> sparse.csr_matrix:
        """See `System`."""
        if not self.spatial:
            return super().tangent_map(q)
        return _block_diagonal(tangent_from_quaternion(q.reshape(-1, 7)))

    def retract(self, q: np.ndarray, dx: np.ndarray) -> np.ndarray:
        """See `System`."""
        if not self.spatial:
            return q + dx
        return np.asarray(retract_poses(q, dx))

    def difference(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """See `System`."""
        if not self.spatial:
            return end - start
        return np.asarray(pose_difference(start, end))

    def increment_map(self, dx: np.ndarray) -> np.ndarray | None:
        """See `System`."""
        if not self.spatial:
            return None
        return np.asarray(increment_blocks(dx))

    def place(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Poses and rates of all bodies; driven bodies are at their poses of time t; quaternions are normalised. Without u
        the rates are zero.

        With `before`, driven bodies have their mean speed since that time. Arrays of poses and rates are shared and
        read-only.
        """
        poses = self._poses(t, q)
        if u is None:
            return poses, self.at_rest
        since = None if before is None else before[0]
        at, known, known_since, rates = self._moving
        if t == at and since == known_since and equal_vectors(u, known):
            return poses, rates
        rates = self._body_rates(u, t, before)
        self._moving = t, u.copy(), since, rates
        return poses, rates

    def _speeds(self, t: float, before: PreviousState | None) -> np.ndarray:
        """Velocity of every motion, m/s; with `before`, the mean velocity since that time."""
        if before is None:
            return np.array([motion.at(t)[1] for motion in self.motions])
        return np.asarray((self._travels(t) - self._travels(before[0])) / (t - before[0]))

    def _body_rates(self, u: np.ndarray, t: float, before: PreviousState | None = None) -> np.ndarray:
        """Rates of all bodies from the rates of the free bodies and of the motions at t, or mean rates since `before`."""
        speeds = self._speeds(t, before)
        rates = np.asarray(place_bodies(self.at_rest, self.bodies.free, u, False, *self.drives, speeds))
        if self.turns is not None:
            earlier = None if before is None else (self._travels(before[0]), t - before[0])
            self.turns.set_rates(rates, self._travels(t), speeds, earlier)
        return rates

    def _poses(self, t: float, q: np.ndarray) -> np.ndarray:
        """Poses of all bodies; the last two states are cached."""
        at, known, poses = self._placed
        if t == at and equal_vectors(q, known):
            return poses
        self._placed, self._placed_before = self._placed_before, self._placed
        at, known, poses = self._placed
        if t == at and equal_vectors(q, known):
            return poses
        poses = place_bodies(self.bodies.pose, self.bodies.free, q, self.spatial, *self.drives, self._travels(t))
        if self.turns is not None:
            self.turns.set_poses(poses, self._travels(t))
        self._placed = t, q.copy(), poses
        return poses

    def poses_over_time(self, times: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Poses (n, n_bodies, 3 or 7) of all bodies at several times (n,), s, with configurations (n, nq); see `place`."""
        bodies, width = self.bodies, self.bodies.pose.shape[1]
        poses = np.repeat(bodies.pose[None], len(times), axis=0)
        free = q[:, : self.n_free * width].reshape(len(times), self.n_free, width).copy()
        if self.spatial:
            free[..., 3:] /= np.sqrt(np.sum(free[..., 3:] ** 2, axis=-1, keepdims=True))
        poses[:, bodies.free] = free
        travels = np.zeros((len(times), len(self.motions)))
        for k, motion in enumerate(self.motions):
            travels[:, k] = motion.program.over(times)[0]
        directions = self._directions[self._motion]
        poses[:, self.driven, : directions.shape[1]] += travels[:, self._motion, None] * directions
        if self.turns is not None:
            for placed, gone in zip(poses, travels, strict=True):
                self.turns.set_poses(placed, gone)
        return poses

    def _travels(self, t: float) -> np.ndarray:
        """Travel of every motion at a time, m; the array is shared and read-only. The last few times are cached."""
        travels = self._travelled.get(t)
        if travels is None:
            if len(self._travelled) >= _TIMES:
                self._travelled.clear()
            travels = self._travelled[t] = np.array([motion.at(t)[0] for motion in self.motions])
        return travels

    def change(self, dx: np.ndarray) -> np.ndarray:
        """Increments (n_bodies, 3 or 6) of all bodies; zero for held and driven bodies."""
        return np.asarray(place_bodies(self.at_rest, self.bodies.free, dx, False, *self.drives, self._standing))

    @property
    def panels(self) -> np.ndarray:
        """Number of the panel of every outline of `shape`, (n_quads,); 0 for none, negative for a line."""
        return np.array([*(panel for _, _, panel in self.bodies.plates), *(line.kind for line in self.bodies.lines)], int)

    @property
    def quad_names(self) -> tuple[str, ...]:
        """Name of the body of every outline of `shape`, or of the joint of a line along an axis."""
        plates = (self.bodies.names[body] for body, _, _ in self.bodies.plates)
        return (*plates, *(line.name for line in self.bodies.lines))

    def shape(self, t: float, q: np.ndarray) -> np.ndarray:
        """See `System`: the outline of every plate, and lines as outlines without width."""
        poses, _ = self.place(t, q, None)
        return np.asarray(place_corners(poses, self._plate_bodies, self._plate_corners))

    def shapes(self, times: np.ndarray, q: np.ndarray) -> np.ndarray:
        """See `System`."""
        poses, bodies, corners = self.poses_over_time(times, q), self._plate_bodies, self._plate_corners
        # all states in one call: the bodies of each state follow those of the state before
        rows = (bodies + poses.shape[1] * np.arange(len(poses))[:, None]).ravel()
        found = place_corners(poses.reshape(-1, poses.shape[2]), rows, np.concatenate([corners] * len(poses)))
        return np.asarray(found).reshape(len(poses), *corners.shape)

    def worst_body(self, vector: np.ndarray) -> str:
        """See `System`."""
        worst = int(np.argmax(np.abs(np.nan_to_num(vector, nan=np.inf)))) // self.size
        return self.bodies.names[self.bodies.free[worst]]


def _corners(plates: list[Plate]) -> np.ndarray:
    """Corners (n, 4, 3) of plates in body axes, in cyclic order, m; a triangle has its first corner again as the
    fourth.
    """
    corners = np.zeros((len(plates), 4, 3))
    for quad, plate in zip(corners, plates, strict=True):
        outline = plate.outline
        if outline is None:
            x, y = 0.5 * plate.length, 0.5 * plate.width
            outline = ((-x, -y), (x, -y), (x, y), (-x, y))
        quad[:, :2] = outline if len(outline) == 4 else (*outline, outline[0])
    return corners


def _block_diagonal(blocks: np.ndarray) -> sparse.csr_matrix:
    from scipy import sparse

    count = len(blocks)
    shape = (count * blocks.shape[1], count * blocks.shape[2])
    return sparse.bsr_matrix((blocks, np.arange(count), np.arange(count + 1)), shape=shape).tocsr()
