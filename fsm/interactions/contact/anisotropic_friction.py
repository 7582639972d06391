"""Anisotropic friction: the friction depends on the slip direction in the axes of the body that carries the contact point.

e is the unit vector of the second axis of the body that carries the point, and A = 1 + (a - 1) e e^T, with the ratio a of
the coefficients across and along a plate. The law receives the slip A v; the friction is A times its effort:

    f = A f_law(A v)        f.v = f_law(A v).(A v) >= 0

The friction therefore dissipates energy if the law does. If the law has a potential of v, the friction has one too. For
a coefficient mu(s) with s = |A v| the friction is f = mu N A^2 v/s. The magnitude is mu N along the first axis and a mu
N along the second.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.scatter import add_block


@kernel
def _stretch(vector: np.ndarray, axes: np.ndarray, across: float) -> None:
    """Multiply a vector (3,) by A."""
    along = axes[0, 1] * vector[0] + axes[1, 1] * vector[1] + axes[2, 1] * vector[2]
    for c in range(3):
        vector[c] += (across - 1.0) * along * axes[c, 1]


@kernel
def _stretch_both(matrix: np.ndarray, axes: np.ndarray, across: float) -> None:
    """Replace a matrix M (3, 3) by A M A."""
    for k in range(3):
        _stretch(matrix[:, k], axes, across)
    for c in range(3):
        _stretch(matrix[c], axes, across)


@kernel
def _add_turned(vector: np.ndarray, axes: np.ndarray, across: float, slope: np.ndarray, out: np.ndarray) -> None:
    """Add M times the derivative (3, 3) of A v with respect to rotations about the three axes, for a slope M (3, 3)."""
    turned = np.zeros((3, 3))
    along = axes[0, 1] * vector[0] + axes[1, 1] * vector[1] + axes[2, 1] * vector[2]
    # de = e3 for a rotation about the first axis, and -e1 for a rotation about the third axis
    for j, axis, sign in ((0, 2, 1.0), (2, 0, -1.0)):
        change = axes[0, axis] * vector[0] + axes[1, axis] * vector[1] + axes[2, axis] * vector[2]
        for c in range(3):
            turned[c, j] = (across - 1.0) * sign * (axes[c, axis] * along + axes[c, 1] * change)
    for c in range(3):
        for j in range(3):
            for k in range(3):
                out[c, j] += slope[c, k] * turned[k, j]


@kernel
def stretch(vectors: np.ndarray, poses: np.ndarray, bodies: np.ndarray, across: float) -> None:
    """Multiply vectors (m, 3) by A, in the axes of the first of the bodies (m, k) of each contact."""
    axes = np.empty((3, 3))
    for i in range(vectors.shape[0]):
        fill_rotation(poses[bodies[i, 0], 3:], axes)
        _stretch(vectors[i], axes, across)


@kernel
def stretch_efforts(
    poses: np.ndarray, bodies: np.ndarray, across: float, rate: np.ndarray, mean: np.ndarray, effort: np.ndarray,
    by_slip: np.ndarray, by_mean: np.ndarray, by_normal: np.ndarray, by_turn: np.ndarray,
) -> None:  # fmt: skip
    """Replace the results of a law at the slip A v by those of the friction f, in place.

    Parameters
    ----------
    poses, bodies, across : as in `stretch`
    rate : (m, 4) array, m/s
        Slip velocity v in the columns from 1 on.
    mean : (m, 3) array, m/s
        Mean of v since the last accepted state; empty without bristles, as is `by_mean`.
    effort, by_slip, by_mean, by_normal : results of the law
    by_turn : (m, 3, 3) array, N
        Written: derivative of f with respect to rotations of the body that carries the point, about its axes.
    """
    axes, slip, law, one = np.empty((3, 3)), np.empty(3), np.empty(3), np.eye(3)
    for i in range(effort.shape[0]):
        fill_rotation(poses[bodies[i, 0], 3:], axes)
        for c in range(3):
            slip[c], law[c] = rate[i, 1 + c], effort[i, c]
        out = by_turn[i]
        out[:] = 0.0
        _add_turned(slip, axes, across, by_slip[i], out)
        if mean.shape[0] > 0:
            _add_turned(mean[i], axes, across, by_mean[i], out)
            _stretch_both(by_mean[i], axes, across)
        for j in range(3):
            _stretch(out[:, j], axes, across)
        _add_turned(law, axes, across, one, out)
        _stretch(effort[i], axes, across)
        _stretch(by_normal[i], axes, across)
        _stretch_both(by_slip[i], axes, across)


@kernel
def add_turn_stiffness(
    bodies: np.ndarray,
    gradient: np.ndarray,
    by_turn: np.ndarray,
    dof: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    stiffness: np.ndarray,
) -> None:
    """Add the stiffness V^T df/dtheta of friction with respect to rotations of the first body of every contact.

    Parameters
    ----------
    bodies : (m, k) int array
    gradient : (m, 4, 6 k) array
        V in the rows from 1 on: slip velocity per rate of the bodies.
    by_turn : (m, 3, 3) array, N
        Derivative of f_c with respect to a rotation about axis j of the body.
    dof, indptr, indices : see `fsm.model.bodies.group.BodyPattern`
    stiffness : block data, changed in place
    """
    size = gradient.shape[2]
    block = np.zeros((size, size))
    for i in range(bodies.shape[0]):
        for m in range(size):
            for j in range(3):
                total = 0.0
                for c in range(3):
                    total += gradient[i, 1 + c, m] * by_turn[i, c, j]
                block[m, 3 + j] = total
        add_block(block, dof, bodies[i], indptr, indices, stiffness)
