"""Distance of a point from a convex polygon in its plane z = 0, without sign, with gradient and Hessian.

The sizes of a polygon are the number of its corners, then their coordinates x and y in counterclockwise order.

The closest point lies in the polygon, on a side or at a corner. With the unit vector n from it to the point, at the
distance d, the Hessian is zero, (I - n n^T - t t^T)/d with the direction t of the side, or (I - n n^T)/d.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

MOST_CORNERS = 6


@kernel
def _closest(size: np.ndarray, x: float, y: float) -> tuple[float, float, int]:
    """Vector in the plane from the closest point of the polygon to (x, y), and its feature.

    Returns
    -------
    x, y : m
    int
        -1 if the point is inside the polygon; the number of the corner at which the nearest side starts; the number of
        corners if the nearest feature is a corner.
    """
    corners = int(size[0])
    feature, best_x, best_y, least = -1, 0.0, 0.0, np.inf
    for k in range(corners):
        following = 0 if k == corners - 1 else k + 1
        from_x, from_y = size[1 + 2 * k], size[2 + 2 * k]
        along_x, along_y = size[1 + 2 * following] - from_x, size[2 + 2 * following] - from_y
        over_x, over_y = x - from_x, y - from_y
        if along_x * over_y - along_y * over_x >= 0.0:
            continue
        part = (over_x * along_x + over_y * along_y) / (along_x * along_x + along_y * along_y)
        side = k
        if part <= 0.0 or part >= 1.0:
            part, side = (0.0 if part <= 0.0 else 1.0), corners
        rest_x, rest_y = over_x - part * along_x, over_y - part * along_y
        square = rest_x * rest_x + rest_y * rest_y
        if square < least:
            least, best_x, best_y, feature = square, rest_x, rest_y, side
    return best_x, best_y, feature


@kernel
def polygon_distance(size: np.ndarray, point: np.ndarray) -> float:
    """Distance of a point (3,) from the polygon, m."""
    x, y, _ = _closest(size, point[0], point[1])
    return float(np.sqrt(x * x + y * y + point[2] * point[2]))


@kernel
def polygon_derivatives(size: np.ndarray, point: np.ndarray, gradient: np.ndarray, hessian: np.ndarray) -> None:
    """Derivatives of the distance; the arrays (3,) and (3, 3) are zero before and are changed in place."""
    x, y, feature = _closest(size, point[0], point[1])
    far = np.sqrt(x * x + y * y + point[2] * point[2])
    if feature < 0 or far == 0.0:
        gradient[2] = 1.0 if point[2] >= 0.0 else -1.0
        return
    gradient[0], gradient[1], gradient[2] = x / far, y / far, point[2] / far
    for i in range(3):
        hessian[i, i] = 1.0 / far
        for j in range(3):
            hessian[i, j] -= gradient[i] * gradient[j] / far
    corners = int(size[0])
    if feature == corners:
        return
    following = 0 if feature == corners - 1 else feature + 1
    t_x, t_y = size[1 + 2 * following] - size[1 + 2 * feature], size[2 + 2 * following] - size[2 + 2 * feature]
    square = t_x * t_x + t_y * t_y
    hessian[0, 0] -= t_x * t_x / square / far
    hessian[0, 1] -= t_x * t_y / square / far
    hessian[1, 0] -= t_y * t_x / square / far
    hessian[1, 1] -= t_y * t_y / square / far


@kernel
def polygon_passed(size: np.ndarray, start: np.ndarray, end: np.ndarray, inside: float) -> bool:
    """Whether a point passes through the polygon.

    Parameters
    ----------
    start, end : (3,) arrays, m
        First and last position of the point on a straight path.
    inside : float
        Fraction of the polygon that counts; it is measured from the mean of the corners.
    """
    if (start[2] >= 0.0) == (end[2] >= 0.0):
        return False
    corners = int(size[0])
    middle_x = middle_y = 0.0
    for k in range(corners):
        middle_x += size[1 + 2 * k] / corners
        middle_y += size[2 + 2 * k] / corners
    part = -start[2] / (end[2] - start[2])
    x = middle_x + (start[0] + part * (end[0] - start[0]) - middle_x) / inside
    y = middle_y + (start[1] + part * (end[1] - start[1]) - middle_y) / inside
    _, _, feature = _closest(size, x, y)
    return feature < 0
