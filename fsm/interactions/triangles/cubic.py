"""Cubic of Zienkiewicz on triangles: position and slopes as linear functions of nodal vectors r, r_1, r_2 at the corners.

r_1 and r_2 are the derivatives of r along two orthogonal unit vectors of the plane. Each corner may have other unit vectors.
"""

from __future__ import annotations

import numpy as np


def cubic_rows(plane: np.ndarray, angle: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Rows (m, p, 9) of the position at points with area coordinates `at` (p, 3); see `cubic_shapes`."""
    return cubic_shapes(plane, angle, at)[0]


def cubic_shapes(plane: np.ndarray, angle: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows (m, p, 9) of the position at points, and of its slopes (m, p, 2, 9) in the plane: the cubic of Zienkiewicz.

    Parameters
    ----------
    plane, angle : as in `facet_rows`
    at : (p, 3) array
        Area coordinates.
    """
    along = np.roll(plane, -1, axis=1) - plane
    double = along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0]
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1) / double[:, None, None]
    slope = np.roll(across, -1, axis=1)  # gradients of the area coordinates
    axes = np.stack([np.stack([np.cos(angle), np.sin(angle)], -1), np.stack([-np.sin(angle), np.cos(angle)], -1)], axis=2)
    value, by = _cubic(np.eye(3))
    gradient = np.einsum("pkb,mbc->mpkc", by, slope)
    nodal = np.empty((len(plane), 9, 9))
    for i in range(3):
        nodal[:, 3 * i] = value[i]
        nodal[:, 3 * i + 1 : 3 * i + 3] = np.einsum("mac,mkc->mak", axes[:, i], gradient[:, i])
    to_cubics = np.linalg.inv(nodal)
    cubics, by = _cubic(at)
    slopes = np.einsum("pkb,mbc,mkv->mpcv", by, slope, to_cubics, optimize=True)
    return np.einsum("pk,mkv->mpv", cubics, to_cubics), slopes


def _cubic(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nine cubics (p, 9) in area coordinates (p, 3), and their derivatives with respect to these (p, 9, 3)."""
    value, slope = np.zeros((len(at), 9)), np.zeros((len(at), 9, 3))
    bubble = at.prod(axis=1)
    of_bubble = np.stack([at[:, 1] * at[:, 2], at[:, 2] * at[:, 0], at[:, 0] * at[:, 1]], axis=1)
    value[:, :3] = at
    slope[:, range(3), range(3)] = 1.0
    pairs = [(i, j) for i in range(3) for j in range(3) if i != j]
    for k, (i, j) in enumerate(pairs, 3):
        value[:, k] = at[:, i] ** 2 * at[:, j] + 0.5 * bubble
        slope[:, k] = 0.5 * of_bubble
        slope[:, k, i] += 2.0 * at[:, i] * at[:, j]
        slope[:, k, j] += at[:, i] ** 2
    return value, slope
