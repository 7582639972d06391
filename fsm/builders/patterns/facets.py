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


def facet_frames(pattern: Pattern) -> FacetFrames:
    """Frames of all facets of a pattern at its start."""
    centres, frames, areas, moments, outlines = [], [], [], [], []
    normals = pattern.normals()
    for face, normal in zip(pattern.faces, normals, strict=True):
        points = pattern.vertices[list(face)]
        origin = points.mean(axis=0)
        first = points[1] - points[0]
        first = first - (first @ normal) * normal
        first /= np.linalg.norm(first)
        axes = np.column_stack([first, np.cross(normal, first), normal])
        flat = (points - origin) @ axes[:, :2]
        area, centroid, tensor = _area_moments(flat)
        # second moments x x^T over the area: the larger value belongs to the direction of the longer side
        values, vectors = np.linalg.eigh(tensor)
        turned = vectors[:, ::-1]
        if np.linalg.det(turned) < 0.0:
            turned[:, 1] = -turned[:, 1]
        centres.append(origin + axes[:, :2] @ centroid)
        frames.append(np.column_stack([axes[:, :2] @ turned, normal]))
        areas.append(area)
        # the moment about the first axis is the integral of the square of the second coordinate
        moments.append((values[0], values[1]))
        outlines.append((flat - centroid) @ turned)
    return FacetFrames(
        np.array(centres), np.array(frames), np.array(areas), np.array(moments), tuple(outlines)
    )


def facet_areas(pattern: Pattern) -> np.ndarray:
    """Areas of all facets of a pattern, (n,), m^2."""
    return facet_frames(pattern).area


def _area_moments(points: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Area, centroid (2,), and integral of x x^T about it (2, 2), of a polygon (k, 2) in counter-clockwise order."""
    following = np.roll(points, -1, axis=0)
    cross = points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]
    area = 0.5 * float(cross.sum())
    centroid = (cross @ (points + following)) / (6.0 * area)
    tensor = np.zeros((2, 2))
    for weight, p, q in zip(cross, points, following, strict=True):
        both = p + q
        tensor += weight / 24.0 * (np.outer(p, p) + np.outer(q, q) + np.outer(both, both))
    return area, centroid, tensor - area * np.outer(centroid, centroid)


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
