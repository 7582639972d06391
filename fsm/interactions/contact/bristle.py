"""Friction bristles: rotation with the body that carries them, and stiffness with respect to the slip distance."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.scatter import add_block


@kernel
def carried(vectors: np.ndarray, before: np.ndarray, after: np.ndarray, bodies: np.ndarray) -> np.ndarray:
    """Rotate vectors with their bodies from one set of poses to another.

    Parameters
    ----------
    vectors : (m, 3) array, inertial axes
    before, after : (n_bodies, 7) arrays
    bodies : (m,) int array
    """
    out = np.empty(vectors.shape)
    old, new, local = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for i in range(vectors.shape[0]):
        fill_rotation(before[bodies[i], 3:], old)
        fill_rotation(after[bodies[i], 3:], new)
        for j in range(3):
            local[j] = 0.0
            for k in range(3):
                local[j] += old[k, j] * vectors[i, k]
        for j in range(3):
            out[i, j] = 0.0
            for k in range(3):
                out[i, j] += new[j, k] * local[k]
    return out


@kernel
def add_way_stiffness(
    bodies: np.ndarray,
    gradient: np.ndarray,
    by_way: np.ndarray,
    dof: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    stiffness: np.ndarray,
) -> None:
    """Add the stiffness of bristle friction, G^T (df/ds) G for every contact; s is the slip distance, m.

    Parameters
    ----------
    bodies : (m, k) int array
    gradient : (m, 1 + c, k size) array
        G in the rows from 1 on: slip distance per displacement of the bodies. The change of G in a step is neglected.
    by_way : (m, c, c) array df/ds, N/m
    dof, indptr, indices : see `fsm.model.bodies.group.BodyPattern`
    stiffness : block data, changed in place
    """
    order = gradient.shape[2]
    block, half = np.empty((order, order)), np.empty(order)
    for i in range(bodies.shape[0]):
        block[:] = 0.0
        for c in range(by_way.shape[1]):
            for n in range(order):
                half[n] = 0.0
                for e in range(by_way.shape[2]):
                    half[n] += by_way[i, c, e] * gradient[i, 1 + e, n]
            for m in range(order):
                for n in range(order):
                    block[m, n] += gradient[i, 1 + c, m] * half[n]
        add_block(block, dof, bodies[i], indptr, indices, stiffness)
