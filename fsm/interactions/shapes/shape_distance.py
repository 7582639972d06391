"""Distance phi of a point from a solid shape in the shape's own axes, its gradient and its Hessian.

    half-space   z <= 0 is solid, +z its normal                                   phi = z
    box          half sizes (a, b, c) along x, y, z
    cylinder     radius R about y, half length h:                                 sizes (R, h, R)
    sphere       radius R:                                                        sizes (R, R, R)
    rectangle    half sizes (a, b, 0): a box without height; phi is unsigned, a plate's thickness is a radius around it
    polygon      convex; sizes as in `fsm.interactions.shapes.polygon_distance`; unsigned like a rectangle

Outside the shape phi is the exact distance. phi is C1 there; its Hessian jumps where the closest feature changes from a face
to an edge or a corner. Inside the shape phi is minus the distance to the nearest face, side or cap.

All kinks are inside the shape or on its surface. A box and a cylinder have kinks where two faces are equally near. The axis
of a cylinder, the centre of a sphere, and rectangle and polygon themselves (phi = |z|) are kinks. A rounded point of radius
r does not reach a kink if its depth is less than r.

A half size may be infinite; the shape is then unlimited in that direction, as across the plane in a plane motion.

Axis-aligned boxes around rounded shapes.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import Points, Shapes
from fsm.interactions.shapes.polygon_distance import polygon_derivatives, polygon_distance
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation

HALF_SPACE, BOX, CYLINDER, SPHERE, RECTANGLE, POLYGON = 0, 1, 2, 3, 4, 5


@kernel
def shape_distance(kind: int, size: np.ndarray, point: np.ndarray) -> float:
    """Signed distance of a point, m.

    Parameters
    ----------
    kind : HALF_SPACE, BOX, CYLINDER, SPHERE, RECTANGLE or POLYGON
    size : (3,) array, m; longer with polygons
        Sizes as in the module docstring; not read for a half-space.
    point : (3,) array, m, axes of the shape
    """
    if kind == HALF_SPACE:
        return float(point[2])
    if kind == SPHERE:
        return float(np.sqrt(point[0] ** 2 + point[1] ** 2 + point[2] ** 2) - size[0])
    if kind == POLYGON:
        return polygon_distance(size, point)
    over_y = abs(point[1]) - size[1]
    if kind == CYLINDER:
        over_x, over_z = np.sqrt(point[0] ** 2 + point[2] ** 2) - size[0], -np.inf
    else:
        over_x, over_z = abs(point[0]) - size[0], abs(point[2]) - size[2]
    deepest = max(over_x, over_y, over_z)
    if deepest <= 0.0:
        return float(deepest)
    return float(np.sqrt(max(over_x, 0.0) ** 2 + max(over_y, 0.0) ** 2 + max(over_z, 0.0) ** 2))


@kernel
def shape_derivatives(
    kind: int, size: np.ndarray, point: np.ndarray, gradient: np.ndarray, hessian: np.ndarray
) -> float:
    """Compute the distance as `shape_distance`, with its derivatives.

    Parameters
    ----------
    gradient : (3,) array, changed in place
        Unit vector; on a kink, the gradient of one side.
    hessian : (3, 3) array, 1/m, changed in place

    Returns
    -------
    float, m
    """
    gradient[:] = 0.0
    hessian[:] = 0.0
    if kind == HALF_SPACE:
        gradient[2] = 1.0
    elif kind == SPHERE:
        _radial(point, 1.0, gradient, hessian)
    elif kind == CYLINDER:
        _cylinder(size, point, gradient, hessian)
    elif kind == POLYGON:
        polygon_derivatives(size, point, gradient, hessian)
    else:
        _box(size, point, gradient, hessian)
    return shape_distance(kind, size, point)


@kernel
def _radial(point: np.ndarray, along: float, gradient: np.ndarray, hessian: np.ndarray) -> None:
    """Derivatives of sqrt(x^2 + along y^2 + z^2), along = 0 or 1; the direction at zero is +z."""
    far = np.sqrt(point[0] ** 2 + along * point[1] ** 2 + point[2] ** 2)
    if far == 0.0:
        gradient[2] = 1.0
        return
    gradient[0], gradient[1], gradient[2] = point[0] / far, along * point[1] / far, point[2] / far
    for i in range(3):
        hessian[i, i] = 1.0 / far
        for j in range(3):
            hessian[i, j] -= gradient[i] * gradient[j] / far
    hessian[1, 1] *= along


@kernel
def _cylinder(size: np.ndarray, point: np.ndarray, gradient: np.ndarray, hessian: np.ndarray) -> None:
    """Distance from side, cap or rim of a cylinder; from the rim it is sqrt(u^2 + v^2), u past the side, v past the cap."""
    over_side = np.sqrt(point[0] ** 2 + point[2] ** 2) - size[0]
    over_cap = abs(point[1]) - size[1]
    sign = 1.0 if point[1] >= 0.0 else -1.0
    if over_cap > over_side and over_side <= 0.0:
        gradient[1] = sign
        return
    _radial(point, 0.0, gradient, hessian)
    if over_cap <= 0.0:
        return
    far = np.sqrt(over_side**2 + over_cap**2)
    side, cap = over_side / far, over_cap / far
    for i in range(3):
        gradient[i] *= side
    gradient[1] = sign * cap
    # curvature of the side, and of the circle around the rim: (I2 - n n)/far in the plane of (u, v)
    for i in range(3):
        for j in range(3):
            hessian[i, j] *= side
    radial_x, radial_z = gradient[0] / side, gradient[2] / side
    turn_x, turn_y, turn_z = cap * radial_x, -side * sign, cap * radial_z
    hessian[0, 0] += turn_x * turn_x / far
    hessian[0, 1] += turn_x * turn_y / far
    hessian[0, 2] += turn_x * turn_z / far
    hessian[1, 0] += turn_y * turn_x / far
    hessian[1, 1] += turn_y * turn_y / far
    hessian[1, 2] += turn_y * turn_z / far
    hessian[2, 0] += turn_z * turn_x / far
    hessian[2, 1] += turn_z * turn_y / far
    hessian[2, 2] += turn_z * turn_z / far


@kernel
def _box(size: np.ndarray, point: np.ndarray, gradient: np.ndarray, hessian: np.ndarray) -> None:
    """Distance from a box: one coordinate is past a face, two past an edge, three past a corner; inside, nearest face."""
    past, nearest, square = 0, 2, 0.0
    for i in range(3):
        over = abs(point[i]) - size[i]
        if over > abs(point[nearest]) - size[nearest]:
            nearest = i
        if over > 0.0:
            past += 1
            square += over * over
    if past < 2:
        gradient[nearest] = 1.0 if point[nearest] >= 0.0 else -1.0
        return
    far = np.sqrt(square)
    for i in range(3):
        over = abs(point[i]) - size[i]
        if over > 0.0:
            gradient[i] = (over if point[i] >= 0.0 else -over) / far
            hessian[i, i] = 1.0 / far
    for i in range(3):
        for j in range(3):
            hessian[i, j] -= gradient[i] * gradient[j] / far


@kernel
def points_within(
    local: np.ndarray, slots: np.ndarray, points: Points, shapes: Shapes, below: float, slot: np.ndarray, gap: np.ndarray
) -> int:
    """Write the slots of probes whose gap is below a bound, m, and their gaps to the first rows of arrays, and return their
    number; `local` are the places of the probes as in `local_points_spatial`.
    """
    count = 0
    for i in range(slots.shape[0]):
        shape = points.shape[slots[i]]
        value = shape_distance(shapes.kind[shape], shapes.size[shape], local[i])
        value -= points.radius[slots[i]] + shapes.radius[shape]
        if value < below:
            slot[count] = slots[i]
            gap[count] = value
            count += 1
    return count


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
