"""Frames, areas and moments of area of the facets of a pattern."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.case.pattern_files.pattern import Pattern


class FacetFrames(NamedTuple):
    """Body axes of facets, along the principal axes of their area.

    Attributes
    ----------
    centre : (n, 3) array
        Centroids, m.
    axes : (n, 3, 3) array
        Body axes as columns; the third is the normal.
    area : (n,) array, m^2
    moments : (n, 2) array
        Second moments of area about the first and the second axis, m^4.
    outlines : corners of each facet in its body axes, (k, 2), m
    """

    centre: np.ndarray
    axes: np.ndarray
    area: np.ndarray
    moments: np.ndarray
    outlines: tuple[np.ndarray, ...]

    def local(self, facets: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Points (m, 3) in the body axes of facets (m,)."""
        return np.asarray(np.einsum("nji,nj->ni", self.axes[facets], points - self.centre[facets]))


_ROUND = 1e-5
"""Relative difference of both second moments below which all axes are principal; the first one is along a side then."""


def facet_frames(pattern: Pattern) -> FacetFrames:
    """Frames of all facets of a pattern at its start; facets with the same number of corners are computed together."""
    n, normals = len(pattern.faces), pattern.normals()
    centre, axes, area, moments = np.zeros((n, 3)), np.zeros((n, 3, 3)), np.zeros(n), np.zeros((n, 2))
    outlines: list[np.ndarray] = [np.zeros((0, 2))] * n
    for rows, faces in pattern.faces_by_size():
        points, normal = pattern.vertices[faces], normals[rows]  # (m, k, 3), (m, 3)
        origin = points.mean(axis=1)
        first = points[:, 1] - points[:, 0]
        first = first - np.einsum("mi,mi->m", first, normal)[:, None] * normal
        first /= np.linalg.norm(first, axis=1)[:, None]
        plane = np.stack([first, np.cross(normal, first)], axis=2)
        flat = (points - origin[:, None]) @ plane
        area[rows], centroid, tensor = _area_moments(flat)
        # second moments x x^T over the area: the larger value belongs to the direction of the longer side
        values, vectors = np.linalg.eigh(tensor)
        turned = vectors[:, :, ::-1].copy()
        turned[np.linalg.det(turned) < 0.0, :, 1] *= -1.0
        turned[values[:, 1] - values[:, 0] < _ROUND * values[:, 1]] = np.eye(2)
        centre[rows] = origin + np.einsum("mij,mj->mi", plane, centroid)
        axes[rows] = np.concatenate([plane @ turned, normal[:, :, None]], axis=2)
        # the moment about the first axis is the integral of the square of the second coordinate
        moments[rows] = values
        for row, outline in zip(rows.tolist(), (flat - centroid[:, None]) @ turned, strict=True):
            outlines[row] = outline
    return FacetFrames(centre, axes, area, moments, tuple(outlines))


def facet_areas(pattern: Pattern) -> np.ndarray:
    """Areas of all facets of a pattern, (n,), m^2."""
    return facet_frames(pattern).area


def _area_moments(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Areas (m,), centroids (m, 2), and integrals of x x^T about them (m, 2, 2), of polygons (m, k, 2) in counter-clockwise
    order.
    """
    following = np.roll(points, -1, axis=1)
    cross = points[:, :, 0] * following[:, :, 1] - points[:, :, 1] * following[:, :, 0]
    area = 0.5 * cross.sum(axis=1)
    both = points + following
    centroid = (cross[:, None] @ both)[:, 0] / (6.0 * area)[:, None]
    squares = [x[:, :, :, None] * x[:, :, None, :] for x in (points, following, both)]
    tensor = ((cross / 24.0)[:, :, None, None] * (squares[0] + squares[1] + squares[2])).sum(axis=1)
    return area, centroid, tensor - area[:, None, None] * centroid[:, :, None] * centroid[:, None, :]


def quaternions(matrices: np.ndarray) -> np.ndarray:
    """Unit quaternions (n, 4), scalar part first, of rotation matrices (n, 3, 3)."""
    m = matrices
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    # q q^T times 4: its largest diagonal entry gives the row that is well conditioned (Shepperd, 1978)
    outer = np.empty((len(m), 4, 4))
    outer[:, 0, 0] = 1.0 + trace
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        outer[:, i + 1, i + 1] = 1.0 + 2.0 * m[:, i, i] - trace
        outer[:, 0, i + 1] = outer[:, i + 1, 0] = m[:, k, j] - m[:, j, k]
        outer[:, j + 1, k + 1] = outer[:, k + 1, j + 1] = m[:, j, k] + m[:, k, j]
    best = np.argmax(np.einsum("nii->ni", outer), axis=1)
    rows = outer[np.arange(len(m)), best]
    return np.asarray(rows / np.linalg.norm(rows, axis=1)[:, None])
