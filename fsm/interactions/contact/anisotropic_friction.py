"""Anisotropic friction: the friction depends on the slip direction in the axes of the body that carries the contact
point.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.scatter import add_block


@kernel
def axes_of(poses: np.ndarray, bodies: np.ndarray) -> np.ndarray:
    """Rotation matrices (m, 3, 3) of the bodies (m,); their columns are the body axes."""
    axes = np.empty((bodies.shape[0], 3, 3))
    for i in range(bodies.shape[0]):
        fill_rotation(poses[bodies[i], 3:], axes[i])
    return axes


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
    dof, indptr, indices : see `fsm.model.bodies.pattern.BodyPattern`
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
