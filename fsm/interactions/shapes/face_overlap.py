"""Weights of the contact points and edges of two shapes whose faces lie flat on each other.

The contact force of two faces is proportional to T = O/A. O is the area of their overlap, and A the area of the smaller
face. The points of each face over the other face, and the crossing edges, share T in proportion to their weights. The face
with the larger covered fraction gets most of T. Faces tilted by more than rounding/size do not meet as faces. The faces'
corners and edges then have separate weights. The weights change smoothly from one case to the other.

`fsm.interactions.shapes.face_weights` defines the change of the weights within a step.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.shapes.shape_distance import BOX, CYLINDER, HALF_SPACE, RECTANGLE
from fsm.kernels.jit import kernel

COLUMNS = 5
"""Number of weights of a pair: face and axis points of the first shape, the same of the second, pairs of edges."""

_FIRST, _FIRST_AXIS, _SECOND, _SECOND_AXIS, _EDGES = 0, 1, 2, 3, 4
_ASIDE = 0.02
"""Distance outside a face, relative to the sum of the roundings, up to which a point touches the face."""
LEAST = 1e-9
"""Weight of points without contact force; not zero, to avoid a division by zero."""
_SHARPER = 16
"""Exponent of the covered fraction of a face in the distribution of the load on both faces."""
_SIDES = 32
"""Number of sides of the polygon that replaces a disc; both have the same area."""
_CROSSING, _CROSSING_INSIDE = 0.2, 1e-3
"""Weights of crossing edges, relative to the weights of tilted faces: for partial overlap, and if one face covers the
other."""


@kernel
def _corners(x: float, y: float, out: np.ndarray) -> int:
    """Write the corners of a rectangle of half sizes x, y into `out`, in cyclic order; returns their number."""
    out[0, 0], out[0, 1] = -x, -y
    out[1, 0], out[1, 1] = x, -y
    out[2, 0], out[2, 1] = x, y
    out[3, 0], out[3, 1] = -x, y
    return 4


@kernel
def _clipped_area(points: np.ndarray, count: int, x: float, y: float, other: np.ndarray) -> float:
    """Area of a convex polygon within a rectangle of half sizes x, y; `points` and `other` are overwritten."""
    for side in range(4):
        axis, sign, limit = side // 2, 1.0 - 2.0 * (side % 2), x if side < 2 else y
        kept = 0
        for i in range(count):
            j = (i + 1) % count
            here, there = limit - sign * points[i, axis], limit - sign * points[j, axis]
            if here >= 0.0:
                other[kept] = points[i]
                kept += 1
            if (here >= 0.0) != (there >= 0.0):
                part = here / (here - there)
                other[kept] = points[i] + part * (points[j] - points[i])
                kept += 1
        for i in range(kept):
            points[i] = other[i]
        count = kept
    area = 0.0
    for i in range(count):
        j = (i + 1) % count
        area += points[i, 0] * points[j, 1] - points[j, 0] * points[i, 1]
    return 0.5 * abs(area)


@kernel
def _crossings(corners: np.ndarray, x: float, y: float, aside: float, parallel: float) -> int:
    """Number of crossings between the edges of a rectangle and of another one of half sizes x, y, without parallel edges."""
    found = 0
    for i in range(4):
        start, along = corners[i], corners[(i + 1) % 4] - corners[i]
        length = np.sqrt(along[0] ** 2 + along[1] ** 2)
        for side in range(4):
            axis, sign, limit = side // 2, 1.0 - 2.0 * (side % 2), x if side < 2 else y
            reach = y if side < 2 else x
            # on the other edge, coordinate `axis` is sign * limit
            if (along[axis] / length) ** 2 <= parallel:
                continue
            part = (sign * limit - start[axis]) / along[axis]
            at = start[1 - axis] + part * along[1 - axis]
            if -aside <= part * length <= length + aside and abs(at) <= reach + aside:
                found += 1
    return found


@kernel(inline=True)
def _flatness(sine: float, limit: float) -> float:
    """Factor of the tilt: 1 for parallel faces, 0 at the limit and beyond."""
    part = (sine / limit) ** 2
    return (1.0 - part) ** 2 if part < 1.0 else 0.0


@kernel
def _reduced_force(out_u: float, out_v: float, height: float, rounding: float) -> float:
    """Force of a point outside a rounded face, relative to a point on the face."""
    outside = np.sqrt(max(0.0, out_u) ** 2 + max(0.0, out_v) ** 2)
    if outside == 0.0:
        return 1.0
    depth = rounding - height
    if depth <= 0.0:
        return 1.0 if outside <= _ASIDE * rounding else 0.0
    own = rounding - np.sqrt(outside**2 + height**2)
    return (own / depth) ** 1.5 if own > 0.0 else 0.0


@kernel
def pair_weights(
    kinds: tuple[int, int],
    sizes: tuple[np.ndarray, np.ndarray],
    rounding: float,
    turn: np.ndarray,
    shift: np.ndarray,
    points_a: tuple[np.ndarray, np.ndarray],
    points_b: tuple[np.ndarray, np.ndarray, np.ndarray],
    whole: tuple[float, float],
    spatial: bool,
    base: np.ndarray,
    out: np.ndarray,
    scratch: tuple[np.ndarray, np.ndarray],
) -> None:
    """Factors (5,) of the weights of points and edges of one pair.

    For the arguments see `fsm.interactions.shapes.face_weights.weigh_units`. `turn` contains the axes and `shift` the centre
    of the first shape, in the axes of the second. Points have positions and weights; for points of the second shape, a flag
    states whether they are on its axis. `scratch` is work space, (48, 2) arrays.
    """
    size_a, size_b = sizes
    (places_a, weights_a), (places_b, weights_b, axis_b) = points_a, points_b
    (whole_a, whole_b), (polygon, other) = whole, scratch
    for c in range(COLUMNS):
        out[c] = base[c]
    kind_a, kind_b = kinds
    if kind_b == HALF_SPACE:
        if kind_a == CYLINDER and size_a[1] >= size_a[0] and spatial:
            # a cylinder lies on its side, or stands on a cap
            lies, stands = _flatness(abs(turn[2, 1]), 1e-3), _flatness(np.sqrt(max(0.0, 1.0 - turn[2, 1] ** 2)), 1e-3)
            out[_FIRST] += lies * (LEAST - base[_FIRST])
            out[_FIRST_AXIS] += stands * (LEAST - base[_FIRST_AXIS])
        return
    if kind_a != RECTANGLE:
        return
    # the face of the second shape that is towards the first shape has the normal k and the axes i and j
    k, i, j = 2, 0, 1
    if kind_b == BOX:
        for c in range(2):
            if abs(turn[c, 2]) > abs(turn[k, 2]):
                k = c
        i, j = (1, 2) if k == 0 else ((0, 2) if k == 1 else (0, 1))
    elif kind_b == CYLINDER:
        k, i, j = 1, 0, 2
    elif kind_b != RECTANGLE:
        return
    if not spatial and k == 1:
        return
    half_i, half_j = size_b[i], size_b[j]
    if kind_b == BOX and not spatial:  # in a plane motion the box has no limit across the plane
        if i == 1:
            half_i = size_a[1]
        else:
            half_j = size_a[1] if j == 1 else half_j
    if spatial:
        smallest = min(min(size_a[0], size_a[1]), min(half_i, half_j))
    else:
        smallest = min(size_a[0], half_i if i != 1 else half_j)
    limit = min(0.2, max(1e-3, rounding / smallest))
    aside = _ASIDE * rounding
    upper = 1.0 if shift[k] < 0.0 else -1.0  # sign of the face of the second shape, along the normal of the first shape
    if kind_b == CYLINDER and spatial and size_b[1] >= size_b[0]:
        flat = _flatness(abs(turn[1, 2]), limit)
        if flat > 0.0:
            _line_weights(size_a, size_b, turn, shift, places_b, weights_b, axis_b, aside, flat, out, polygon)
            return
    sine = np.sqrt(max(0.0, 1.0 - turn[k, 2] ** 2))
    flat = _flatness(sine, limit)
    if flat == 0.0:
        return
    own_a = 4.0 * size_a[0] * size_a[1]
    corners = polygon[40:44]
    if kind_b == CYLINDER:
        own_b = np.pi * half_i**2
        fit = half_i * np.sqrt(2.0 * np.pi / (_SIDES * np.sin(2.0 * np.pi / _SIDES)))
        for n in range(_SIDES):
            u, v = fit * np.cos(2.0 * np.pi * n / _SIDES), fit * np.sin(2.0 * np.pi * n / _SIDES)
            for c in range(2):
                polygon[n, c] = turn[i, c] * (u - shift[i]) + turn[j, c] * (v - shift[j])
                polygon[n, c] += turn[k, c] * (-upper * size_b[1] - shift[k])
        overlap, crossing = _clipped_area(polygon, _SIDES, size_a[0], size_a[1], other), 0
    else:
        own_b = 4.0 * half_i * half_j
        _corners(size_a[0], size_a[1], corners)
        for n in range(4):
            x, y = corners[n, 0], corners[n, 1]
            corners[n, 0] = turn[i, 0] * x + turn[i, 1] * y + shift[i]
            corners[n, 1] = turn[j, 0] * x + turn[j, 1] * y + shift[j]
            polygon[n] = corners[n]
        parallel = limit**2
        crossing = _crossings(corners, half_i, half_j, aside, parallel) if spatial else 0
        overlap = _clipped_area(polygon, 4, half_i, half_j, other)
    if overlap <= 1e-6 * min(own_a, own_b):
        return
    smaller = min(whole_a, whole_b if kind_b == RECTANGLE else own_b)
    covered_a, covered_b = min(1.0, overlap / own_a) ** _SHARPER, min(1.0, overlap / own_b) ** _SHARPER
    first = covered_a / (covered_a + covered_b)
    seen_a = seen_b = 0.0
    height = abs(shift[k]) - (0.0 if kind_b == RECTANGLE else size_b[k])
    for n in range(places_a.shape[0]):
        x, y = places_a[n, 0], places_a[n, 1]
        u, v = turn[i, 0] * x + turn[i, 1] * y + shift[i], turn[j, 0] * x + turn[j, 1] * y + shift[j]
        if kind_b == CYLINDER:
            out_u, out_v = np.sqrt(u * u + v * v) - half_i, 0.0
        else:
            out_u, out_v = abs(u) - half_i, abs(v) - half_j
        seen_a += weights_a[n] * _reduced_force(out_u, out_v, height, rounding)
    for n in range(places_b.shape[0]):
        if axis_b[n] or (kind_b != RECTANGLE and places_b[n, k] * -upper < 0.999 * size_b[k]):
            continue
        x = y = 0.0
        for c in range(3):
            x += turn[c, 0] * (places_b[n, c] - shift[c])
            y += turn[c, 1] * (places_b[n, c] - shift[c])
        seen_b += weights_b[n] * _reduced_force(abs(x) - size_a[0], abs(y) - size_a[1], height, rounding)
    of_a, of_b = first * own_a / smaller, (1.0 - first) * own_b / smaller
    part = (1.0 - covered_a) * (1.0 - covered_b)
    edges = (_CROSSING_INSIDE + _CROSSING * part) * base[_EDGES]
    seen = of_a * seen_a + of_b * seen_b + edges * crossing
    if seen <= 0.0:
        return
    whole = overlap / smaller / seen
    out[_FIRST] += flat * (max(LEAST, whole * of_a) - base[_FIRST])
    out[_SECOND] += flat * (max(LEAST, whole * of_b) - base[_SECOND])
    out[_SECOND_AXIS] += flat * (LEAST - base[_SECOND_AXIS])
    out[_EDGES] += flat * (max(LEAST, whole * edges) - base[_EDGES])


@kernel
def _line_weights(
    size_a: np.ndarray,
    size_b: np.ndarray,
    turn: np.ndarray,
    shift: np.ndarray,
    places_b: np.ndarray,
    weights_b: np.ndarray,
    axis_b: np.ndarray,
    aside: float,
    flat: float,
    out: np.ndarray,
    scratch: np.ndarray,
) -> None:
    """Weights of a cylinder lying on a rectangle: length of its line on the rectangle over the shorter of both."""
    low, high, chord = -size_b[1], size_b[1], np.inf
    for c in range(2):
        # the axis in the rectangle's axes: middle + s * along
        along, middle = turn[1, c], 0.0
        for n in range(3):
            middle -= turn[n, c] * shift[n]
        if abs(along) > 1e-12:
            ends = (-size_a[c] - middle) / along, (size_a[c] - middle) / along
            low, high = max(low, min(ends)), min(high, max(ends))
            chord = min(chord, 2.0 * size_a[c] / abs(along))
        elif abs(middle) > size_a[c]:
            return
    if high <= low:
        return
    seen = 0.0
    for n in range(places_b.shape[0]):
        if axis_b[n] and low - aside <= places_b[n, 1] <= high + aside:
            seen += weights_b[n]
    if seen == 0.0:
        return
    whole = min(1.0, (high - low) / min(2.0 * size_b[1], chord)) / seen
    for column in range(COLUMNS):
        target = whole if column == _SECOND_AXIS else LEAST
        out[column] += flat * (target - out[column])
