"""Hinge angle between two bodies in the plane: psi = phi_a - phi_b + psi_0. The angle's second derivative is zero."""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import BlockIndex
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import add_block


@kernel
def measure_hinge_planar(
    poses: np.ndarray, rates: np.ndarray, bodies: np.ndarray, angle_offset: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles (m,) rad, rates (m,) rad/s and gradients (m, 1, 6) of all hinges; poses and rates are (n_bodies, 3)."""
    count = bodies.shape[0]
    value = np.empty(count)
    rate = np.empty(count)
    gradient = np.zeros((count, 1, 6))
    for i in range(count):
        a, b = bodies[i, 0], bodies[i, 1]
        value[i] = poses[a, 2] - poses[b, 2] + angle_offset[i]
        rate[i] = rates[a, 2] - rates[b, 2]
        gradient[i, 0, 2] = 1.0
        gradient[i, 0, 5] = -1.0
    return value, rate, gradient


@kernel
def stiffness_hinge_planar(
    bodies: np.ndarray, stiffness: np.ndarray, index: BlockIndex, stiffness_data: np.ndarray
) -> None:
    """Add K of all hinges; `stiffness` (m, 1), N m/rad."""
    dof, indptr, indices = index
    block = np.zeros((6, 6))
    for i in range(bodies.shape[0]):
        for sign_row, row in ((1.0, 2), (-1.0, 5)):
            for sign_column, column in ((1.0, 2), (-1.0, 5)):
                block[row, column] = sign_row * sign_column * stiffness[i, 0]
        add_block(block, dof, bodies[i], indptr, indices, stiffness_data)
