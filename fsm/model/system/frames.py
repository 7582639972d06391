"""Frames on ANCF elements: position and axes of a material point as functions of nodal vectors.

A frame has the position r and the directions a and b, which are sums of nodal vectors x_j:

    r = sum w_j x_j,   a = sum alpha_j x_j,   b = b_0 + sum beta_j x_j.

Its axes are e1 = a/|a|, e3 = a x b/|a x b| and e2 = e3 x e1. An increment of a and b rotates them by the vector theta. With
b_1 = b.e1 and b_2 = b.e2, its components along (e1, e2, e3) are

    theta_1 = e3.db/b_2 - b_1/(|a| b_2) e3.da,   theta_2 = -e3.da/|a|,   theta_3 = e2.da/|a|.

The increment (dr, theta) of the frame is therefore T dx. A force and a moment (f, m) on the frame, with m in its axes,
are the generalised forces T^T (f, m). The derivative dT/dx gives the geometric stiffness of m, and the change of
the angular velocity with x at constant rates.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.vector import cross


@dataclass(frozen=True)
class FramePoint:
    """One frame.

    Attributes
    ----------
    vectors : (m,) int array
        First coordinate of each nodal vector.
    weights, along, across : (m,) arrays
        Factors w, alpha and beta of the vectors. If all alpha are zero, the frame has a position but no axes, and it carries
        no moment.
    fixed : (3,) array
        Constant part b_0 of the second direction.
    """

    vectors: np.ndarray
    weights: np.ndarray
    along: np.ndarray
    across: np.ndarray
    fixed: np.ndarray


class Frames(NamedTuple):
    """All frames of a system.

    Attributes
    ----------
    bodies : (n,) int array
        Row of each frame among the bodies.
    first : (n + 1,) int array
        The vectors of frame i are those from first[i] to first[i + 1].
    vectors : (m,) int array
        First coordinate of each vector.
    weights, along, across : (m,) arrays
    fixed : (n, 3) array
    oriented : (n,) int array
        1 if the frame has axes.
    """

    bodies: np.ndarray
    first: np.ndarray
    vectors: np.ndarray
    weights: np.ndarray
    along: np.ndarray
    across: np.ndarray
    fixed: np.ndarray
    oriented: np.ndarray

    @classmethod
    def of(cls, bodies: np.ndarray, points: tuple[FramePoint, ...]) -> Frames:
        """Arrays of several frames; `bodies` (n,) are their rows among the bodies."""
        first = np.concatenate([[0], np.cumsum([len(point.vectors) for point in points], dtype=np.int64)])
        columns = ([point.weights for point in points], [point.along for point in points], [p.across for p in points])
        weights, along, across = (np.concatenate([np.zeros(0), *parts]) for parts in columns)
        return cls(
            np.asarray(bodies, dtype=np.int64),
            first.astype(np.int64),
            np.concatenate([np.zeros(0, dtype=np.int64), *(point.vectors for point in points)]),
            weights,
            along,
            across,
            np.array([point.fixed for point in points], dtype=float).reshape(-1, 3),
            np.array([np.any(point.along) for point in points], dtype=np.int64),
        )


@kernel
def _sum(first: int, last: int, vectors: np.ndarray, factors: np.ndarray, q: np.ndarray, out: np.ndarray) -> None:
    """Add sum_j factor_j x_j to `out` (3,)."""
    for j in range(first, last):
        for k in range(3):
            out[k] += factors[j] * q[vectors[j] + k]


@kernel
def _axes(a: np.ndarray, b: np.ndarray, axes: np.ndarray) -> None:
    """Rows e1, e2, e3 of `axes` (3, 3) from the directions a and b."""
    length = np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    for k in range(3):
        axes[0, k] = a[k] / length
    cross(axes[0], b, axes[2])
    length = np.sqrt(axes[2, 0] ** 2 + axes[2, 1] ** 2 + axes[2, 2] ** 2)
    for k in range(3):
        axes[2, k] /= length
    cross(axes[2], axes[0], axes[1])


@kernel
def _quaternion(axes: np.ndarray, near: np.ndarray, out: np.ndarray) -> None:
    """Unit quaternion of axes given as rows, with the sign that is nearer to the quaternion `near`."""
    # the largest of the four components follows from the diagonal, the other three from this component (Shepperd, 1978)
    xx, yy, zz = axes[0, 0], axes[1, 1], axes[2, 2]
    trace = xx + yy + zz
    if trace >= xx and trace >= yy and trace >= zz:
        out[0] = 1.0 + trace
        out[1], out[2], out[3] = axes[1, 2] - axes[2, 1], axes[2, 0] - axes[0, 2], axes[0, 1] - axes[1, 0]
    elif xx >= yy and xx >= zz:
        out[0], out[1] = axes[1, 2] - axes[2, 1], 1.0 + xx - yy - zz
        out[2], out[3] = axes[0, 1] + axes[1, 0], axes[0, 2] + axes[2, 0]
    elif yy >= zz:
        out[0], out[2] = axes[2, 0] - axes[0, 2], 1.0 - xx + yy - zz
        out[1], out[3] = axes[0, 1] + axes[1, 0], axes[1, 2] + axes[2, 1]
    else:
        out[0], out[3] = axes[0, 1] - axes[1, 0], 1.0 - xx - yy + zz
        out[1], out[2] = axes[0, 2] + axes[2, 0], axes[1, 2] + axes[2, 1]
    norm = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2 + out[3] ** 2)
    if out[0] * near[0] + out[1] * near[1] + out[2] * near[2] + out[3] * near[3] < 0.0:
        norm = -norm
    for k in range(4):
        out[k] /= norm


@kernel
def place_frames(frames: Frames, q: np.ndarray, near: np.ndarray, poses: np.ndarray) -> None:
    """Write the poses of all frames.

    Parameters
    ----------
    frames : Frames
    q : (n_q,) array
        Coordinates of the ANCF nodes.
    near : (n, 4) array
        Quaternion near that of each frame; it determines the sign.
    poses : (n_bodies, 7) array, changed in place
        Frames without axes keep their quaternion.
    """
    bodies, first, vectors, weights, along, across, fixed, oriented = frames
    a, b, axes = np.empty(3), np.empty(3), np.empty((3, 3))
    for i in range(bodies.shape[0]):
        pose = poses[bodies[i]]
        pose[:3] = 0.0
        _sum(first[i], first[i + 1], vectors, weights, q, pose)
        if oriented[i]:
            a[:] = 0.0
            b[:] = fixed[i]
            _sum(first[i], first[i + 1], vectors, along, q, a)
            _sum(first[i], first[i + 1], vectors, across, q, b)
            _axes(a, b, axes)
            _quaternion(axes, near[i], pose[3:])


@kernel
def _gradients(a: np.ndarray, b: np.ndarray, axes: np.ndarray, out: np.ndarray) -> None:
    """Derivatives (3, 6) of theta with respect to (a, b)."""
    length = np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    b1 = b[0] * axes[0, 0] + b[1] * axes[0, 1] + b[2] * axes[0, 2]
    b2 = b[0] * axes[1, 0] + b[1] * axes[1, 1] + b[2] * axes[1, 2]
    for k in range(3):
        out[0, k] = -b1 / (length * b2) * axes[2, k]
        out[0, 3 + k] = axes[2, k] / b2
        out[1, k] = -axes[2, k] / length
        out[1, 3 + k] = 0.0
        out[2, k] = axes[1, k] / length
        out[2, 3 + k] = 0.0


@kernel
def _second(a: np.ndarray, b: np.ndarray, axes: np.ndarray, gradients: np.ndarray, out: np.ndarray) -> None:
    """Derivatives (3, 6, 6) of `gradients` (3, 6) with respect to (a, b)."""
    length = np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    b1 = b[0] * axes[0, 0] + b[1] * axes[0, 1] + b[2] * axes[0, 2]
    b2 = b[0] * axes[1, 0] + b[1] * axes[1, 1] + b[2] * axes[1, 2]
    for c in range(6):
        t1, t2, t3 = gradients[0, c], gradients[1, c], gradients[2, c]
        d_length = axes[0, c] if c < 3 else 0.0
        d_b1 = t3 * b2 + (0.0 if c < 3 else axes[0, c - 3])
        d_b2 = -t3 * b1 + (0.0 if c < 3 else axes[1, c - 3])
        factor = b1 / (length * b2)
        d_factor = d_b1 / (length * b2) - factor * (d_length / length + d_b2 / b2)
        for k in range(3):
            d_e2 = -t3 * axes[0, k] + t1 * axes[2, k]
            d_e3 = t2 * axes[0, k] - t1 * axes[1, k]
            out[0, k, c] = -d_factor * axes[2, k] - factor * d_e3
            out[0, 3 + k, c] = (d_e3 - axes[2, k] * d_b2 / b2) / b2
            out[1, k, c] = (-d_e3 + axes[2, k] * d_length / length) / length
            out[1, 3 + k, c] = 0.0
            out[2, k, c] = (d_e2 - axes[1, k] * d_length / length) / length
            out[2, 3 + k, c] = 0.0


@kernel(inline=True)
def _turning(
    frames: Frames, i: int, q: np.ndarray, u: np.ndarray, da: np.ndarray, db: np.ndarray, a: np.ndarray, b: np.ndarray,
    axes: np.ndarray, gradients: np.ndarray,
) -> None:  # fmt: skip
    """Write the directions a and b of a frame, their rates, its axes, and the derivatives (3, 6) of the axes."""
    first, last = frames.first[i], frames.first[i + 1]
    a[:], da[:], db[:] = 0.0, 0.0, 0.0
    b[:] = frames.fixed[i]
    _sum(first, last, frames.vectors, frames.along, q, a)
    _sum(first, last, frames.vectors, frames.across, q, b)
    _sum(first, last, frames.vectors, frames.along, u, da)
    _sum(first, last, frames.vectors, frames.across, u, db)
    _axes(a, b, axes)
    _gradients(a, b, axes, gradients)


@kernel
def frame_maps(frames: Frames, q: np.ndarray, u: np.ndarray, maps: np.ndarray, rates: np.ndarray) -> None:
    """Derivatives of the poses of all frames, and their velocities.

    Parameters
    ----------
    frames : Frames
    q, u : (n_q,) arrays
        Coordinates of the ANCF nodes and their rates.
    maps : (m, 6, 3) array of zeros, changed in place
        T of each vector: derivative of (dr, theta).
    rates : (n, 6) array, changed in place
        Velocity (r', omega) of each frame, omega in its axes.
    """
    _, first, vectors, weights, along, across, fixed, oriented = frames
    a, b, axes = np.empty(3), np.empty(3), np.empty((3, 3))
    da, db = np.empty(3), np.empty(3)
    gradients = np.empty((3, 6))
    for i in range(fixed.shape[0]):
        rates[i] = 0.0
        _sum(first[i], first[i + 1], vectors, weights, u, rates[i])
        for j in range(first[i], first[i + 1]):  # all other entries are zero
            for k in range(3):
                maps[j, k, k] = weights[j]
        if not oriented[i]:
            continue
        _turning(frames, i, q, u, da, db, a, b, axes, gradients)
        for k in range(3):
            total = 0.0
            for c in range(3):
                total += gradients[k, c] * da[c] + gradients[k, 3 + c] * db[c]
            rates[i, 3 + k] = total
        for j in range(first[i], first[i + 1]):
            for k in range(3):
                for c in range(3):
                    maps[j, 3 + k, c] = along[j] * gradients[k, c] + across[j] * gradients[k, 3 + c]


@kernel
def frame_turns(
    frames: Frames, q: np.ndarray, u: np.ndarray, moments: np.ndarray, turns: np.ndarray, curvatures: np.ndarray
) -> None:
    """Second derivatives of the poses of all frames, for tangents.

    Parameters
    ----------
    frames : Frames
    q, u : (n_q,) arrays
        Coordinates of the ANCF nodes and their rates.
    moments : (n, 3) array, N m
        Moment on each frame, in its axes.
    turns : (m, 6, 3) array of zeros, changed in place
        Derivative of the velocity (r', omega) with respect to each vector, at the rates u.
    curvatures : (n, 6, 6) array of zeros, changed in place
        Derivative with respect to (a, b) of the generalised forces of the moments on (a, b).
    """
    _, first, _, _, along, across, fixed, oriented = frames
    a, b, axes = np.empty(3), np.empty(3), np.empty((3, 3))
    da, db, change = np.empty(3), np.empty(3), np.empty((3, 6))
    gradients, second = np.empty((3, 6)), np.empty((3, 6, 6))
    for i in range(fixed.shape[0]):
        if not oriented[i]:
            continue
        _turning(frames, i, q, u, da, db, a, b, axes, gradients)
        _second(a, b, axes, gradients, second)
        for k in range(3):
            for c in range(6):
                total = 0.0
                for d in range(3):
                    total += da[d] * second[k, d, c] + db[d] * second[k, 3 + d, c]
                change[k, c] = total
        for c in range(6):
            for d in range(6):
                curvatures[i, c, d] = (
                    moments[i, 0] * second[0, c, d] + moments[i, 1] * second[1, c, d] + moments[i, 2] * second[2, c, d]
                )
        for j in range(first[i], first[i + 1]):
            for k in range(3):
                for c in range(3):
                    turns[j, 3 + k, c] = along[j] * change[k, c] + across[j] * change[k, 3 + c]
