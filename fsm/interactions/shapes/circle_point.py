"""Points of circles that turn with the tilt of a circle over a shape: the points of the caps of a cylinder.

The circle is p(a) = c + cos a u + sin a w in the axes of the shape, with the perpendicular vectors u and w of the length R.
Over a plane, or over the plane of a plate on the side of the circle's centre, its lowest point has the angle a_0 with

    u_z cos a_0 + w_z sin a_0 = -R s,      s sine of the tilt

The points of a cap are at a_0 + k pi/4. Their heights and therefore their energy depend only on the height and the tilt of
the cap, not on the rotation of the cylinder about its axis. One point is the lowest one of the rim: a disc rolls as on a
circle. The points k and -k have the same height, so the part of the gap's gradient by da_0 cancels in the sum of their
forces. Below the tilt `FLAT` the points do not turn: all of them have contact, and the direction of the tilt is round-off.

Where the lowest point is not over the plate, the nearest point of the rim replaces it: f(a) = phi(p(a))
(`fsm.interactions.shapes.shape_distance`) has f' = 0 and f'' > 0. Where two points of the rim are equally near, one touches.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.shapes.shape_distance import HALF_SPACE, POLYGON, RECTANGLE, shape_derivatives, shape_distance
from fsm.kernels.jit import kernel

FIXED, LOWEST, NEAREST = 0, 1, 2
"""Ways of a point: at its place, at an angle from the lowest point of the circle, or the nearest point of the circle."""
FLAT = 1e-6
"""Sine of the tilt below which points of a circle do not turn."""
_STARTS = 16
_ITERATIONS = 60
_ROUND_OFF = 1e-15
"""Change of the angle at which the search ends, rad."""


@kernel
def circle_angle(
    kind: int, size: np.ndarray, centre: np.ndarray, around: np.ndarray, nearest: bool
) -> tuple[float, int]:
    """Angle from which the points of a circle are counted, rad, and the way of the point.

    Parameters
    ----------
    kind, size : as in `fsm.interactions.shapes.shape_distance`
    centre : (3,) array, m
        Centre of the circle in the axes of the shape.
    around : (2, 3) array, m
        Radii u and w in the axes of the shape.
    nearest : bool
        Whether the point is the nearest one where the lowest one is not over the shape.
    """
    angle, way, point = 0.0, FIXED, np.empty(3)
    if kind in (HALF_SPACE, RECTANGLE, POLYGON):
        side = 1.0 if kind == HALF_SPACE or centre[2] >= 0.0 else -1.0
        rise, run, square = side * around[0, 2], side * around[1, 2], 0.0
        for c in range(3):
            square += around[0, c] ** 2
        if rise * rise + run * run > FLAT * FLAT * square:
            angle, way = float(np.arctan2(-run, -rise)), LOWEST
        if kind == HALF_SPACE or not nearest:
            return angle, way
        for c in range(2):
            point[c] = centre[c] + np.cos(angle) * around[0, c] + np.sin(angle) * around[1, c]
        point[2] = 0.0
        if way == FIXED or shape_distance(kind, size, point) <= 0.0:
            return angle, way
    elif not nearest:
        return angle, way
    best = np.inf
    for k in range(_STARTS):
        trial = 2.0 * np.pi * k / _STARTS
        for c in range(3):
            point[c] = centre[c] + np.cos(trial) * around[0, c] + np.sin(trial) * around[1, c]
        value = shape_distance(kind, size, point)
        if value < best:
            best, angle = value, trial
    return _descended(kind, size, centre, around, angle), NEAREST


@kernel
def _descended(kind: int, size: np.ndarray, centre: np.ndarray, around: np.ndarray, angle: float) -> float:
    """Root of f' near the best of some points: Newton's method, with bisection outside the bracket."""
    low, high = angle - 2.0 * np.pi / _STARTS, angle + 2.0 * np.pi / _STARTS
    point, along, inward, gradient, hessian = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    for _ in range(_ITERATIONS):
        cosine, sine = np.cos(angle), np.sin(angle)
        slope = bend = 0.0
        for c in range(3):
            inward[c] = -cosine * around[0, c] - sine * around[1, c]
            along[c] = cosine * around[1, c] - sine * around[0, c]
            point[c] = centre[c] - inward[c]
        shape_derivatives(kind, size, point, gradient, hessian)
        for i in range(3):
            slope += along[i] * gradient[i]
            bend += inward[i] * gradient[i]
            for j in range(3):
                bend += along[i] * hessian[i, j] * along[j]
        if slope > 0.0:
            high = angle
        else:
            low = angle
        after = angle - slope / bend if bend > 0.0 else low
        if bend > 0.0 and abs(after - angle) <= _ROUND_OFF:
            break
        if not low < after < high:
            after = 0.5 * (low + high)
        if high - low <= _ROUND_OFF:
            break
        angle = after
    return float(angle)
