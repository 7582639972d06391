"""Bristles rotate with their bodies, and their force opposes the slip."""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.bristle import add_way_stiffness, carried
from fsm.kernels.rotation import rotation_matrix


def poses(rng: np.random.Generator, count: int) -> np.ndarray:
    quaternion = rng.normal(size=(count, 4))
    return np.hstack([rng.normal(size=(count, 3)), quaternion / np.linalg.norm(quaternion, axis=1)[:, None]])


def test_carried_vectors_keep_their_components_in_the_body() -> None:
    rng = np.random.default_rng(1)
    before, after, vectors = poses(rng, 3), poses(rng, 3), rng.normal(size=(5, 3))
    bodies = np.array([0, 2, 1, 1, 0])
    out = carried(vectors, before, after, bodies)
    for i, body in enumerate(bodies):
        old, new = rotation_matrix(before[body, 3:]), rotation_matrix(after[body, 3:])
        np.testing.assert_allclose(new.T @ out[i], old.T @ vectors[i], atol=1e-14)


def test_stiffness_of_the_way_is_that_of_springs_along_it() -> None:
    """G^T K G of two contacts, gathered block by block; one body is the ground."""
    rng = np.random.default_rng(2)
    size, bodies = 3, np.array([[0, 1], [1, 2]])
    dof = np.array([-1, 0, 1])
    gradient, by_way = rng.normal(size=(2, 2, 2 * size)), rng.normal(size=(2, 1, 1))
    indptr, indices = np.array([0, 2, 4]), np.array([0, 1, 0, 1])
    data = np.zeros((4, size, size))
    add_way_stiffness(bodies, gradient, by_way, dof, indptr, indices, data)
    wanted = np.zeros((9, 9))
    for i in range(2):
        rows = np.concatenate([size * bodies[i, side] + np.arange(size) for side in range(2)])
        wanted[np.ix_(rows, rows)] += gradient[i, 1:].T @ by_way[i] @ gradient[i, 1:]
    found = np.block([[data[0], data[1]], [data[2], data[3]]])
    np.testing.assert_allclose(found, wanted[3:, 3:], atol=1e-14)
