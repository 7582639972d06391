"""Axis-aligned boxes around rounded shapes."""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import Shapes
from fsm.interactions.shapes.shape_distance import HALF_SPACE, POLYGON
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation


@kernel
def shape_boxes_planar(poses: np.ndarray, shapes: Shapes) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corners (s, 2), m; infinite for half-planes."""
    body, kind, size, offset, angle, radius = shapes
    low, high = np.full((body.shape[0], 2), -np.inf), np.full((body.shape[0], 2), np.inf)
    for i in range(body.shape[0]):
        if kind[i] == HALF_SPACE:
            continue
        x, z, turn = poses[body[i]]
        c, s = np.cos(turn), np.sin(turn)
        centre_x, centre_z = x + c * offset[i, 0] + s * offset[i, 1], z + c * offset[i, 1] - s * offset[i, 0]
        c, s = abs(np.cos(turn + angle[i])), abs(np.sin(turn + angle[i]))
        half_x = c * size[i, 0] + s * size[i, 2] + radius[i]
        half_z = s * size[i, 0] + c * size[i, 2] + radius[i]
        low[i, 0], low[i, 1] = centre_x - half_x, centre_z - half_z
        high[i, 0], high[i, 1] = centre_x + half_x, centre_z + half_z
    return low, high


@kernel
def shape_boxes_spatial(poses: np.ndarray, shapes: Shapes) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corners (s, 3), m; see `shape_boxes_planar`."""
    body, kind, size, offset, axes, radius = shapes
    low, high = np.full((body.shape[0], 3), -np.inf), np.full((body.shape[0], 3), np.inf)
    frame = np.empty((3, 3))
    for i in range(body.shape[0]):
        if kind[i] == HALF_SPACE:
            continue
        fill_rotation(poses[body[i], 3:], frame)
        if kind[i] == POLYGON:
            _polygon_box(poses[body[i]], frame, size[i], radius[i], low[i], high[i])
            continue
        for c in range(3):
            centre, half = poses[body[i], c], radius[i]
            for j in range(3):
                centre += frame[c, j] * offset[i, j]
                along = 0.0
                for k in range(3):
                    along += frame[c, k] * axes[i, k, j]
                half += abs(along) * size[i, j]
            low[i, c], high[i, c] = centre - half, centre + half
    return low, high


@kernel
def _polygon_box(
    pose: np.ndarray, frame: np.ndarray, size: np.ndarray, radius: float, low: np.ndarray, high: np.ndarray
) -> None:
    """Write the corners (3,) of the box around a polygon that has the axes of its body."""
    for c in range(3):
        low[c], high[c] = np.inf, -np.inf
        for k in range(int(size[0])):
            at = pose[c] + frame[c, 0] * size[1 + 2 * k] + frame[c, 1] * size[2 + 2 * k]
            low[c], high[c] = min(low[c], at - radius), max(high[c], at + radius)
