"""Chords: straight approximations of the pieces of surfaces (`fsm.interactions.surfaces.surface`), for the contact search.

In the plane a chord is the line between the ends of a piece; in space it is a rectangle that spans the width. Let D be 2 or
3. A table of chords is (n_pieces, 6) in the plane and (n_pieces, 12) in space, with the columns

    0 ... D-1      start, m
    D ... 2D-1     vector to the other end, m; in space without its component across
    2D             1/(length squared), 1/m^2; 0 if both ends coincide
    2D+1           bound of the distance between surface and chord, m (`chords_planar`)
    8, 9, 10       in space: unit vector across, e2 of the first body
    11             in space: half width of the piece, m

In space the distance of a point from a chord ignores the component across within the width. Beyond the sides that component
counts.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.search.control_points import (
    control_points_planar,
    control_points_spatial,
    turned_planar,
    turned_spatial,
)
from fsm.kernels.jit import kernel
from fsm.kernels.vector import dot

ROUNDING = 1e-12
"""Relative enlargement of a box, so that round-off leaves no point of the chord outside it."""


@kernel
def chords_planar(poses: np.ndarray, owners: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """Chords of all pieces in the plane.

    Parameters
    ----------
    poses : (n_bodies, 3) array
    owners, stations : pieces, see `fsm.interactions.surfaces.surface.pieces_of`

    Returns
    -------
    (n_pieces, 6) array
        Column 5, the bound of the distance: the piece lies in the convex hull of its control points, and an end piece is
        extended by its tip.
    """
    return chords_of_planar(control_points_planar(poses, turned_planar(poses), owners, stations), stations)


@kernel
def chords_of_planar(controls: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """Chords from the control points of `fsm.interactions.search.control_points`; returns as `chords_planar`."""
    out = np.empty((controls.shape[0], 6))
    for j in range(controls.shape[0]):
        x0, z0 = controls[j, 0, 0], controls[j, 0, 1]
        ex, ez = controls[j, 3, 0] - x0, controls[j, 3, 1] - z0
        square = ex * ex + ez * ez
        inverse = 1.0 / square if square > 0.0 else 0.0
        one = (controls[j, 1, 1] - z0) * ex - (controls[j, 1, 0] - x0) * ez
        other = (controls[j, 2, 1] - controls[j, 3, 1]) * ex - (controls[j, 2, 0] - controls[j, 3, 0]) * ez
        tip = max(-stations[j, 4], stations[j, 5] - 1.0) * np.sqrt(square)
        out[j, 0], out[j, 1], out[j, 2], out[j, 3], out[j, 4] = x0, z0, ex, ez, inverse
        out[j, 5] = max(abs(one), abs(other)) * np.sqrt(inverse) + tip
    return out


@kernel
def chords_spatial(poses: np.ndarray, owners: np.ndarray, stations: np.ndarray, half_width: np.ndarray) -> np.ndarray:
    """Chords of all pieces in space, (n_pieces, 12); see `chords_planar`.

    Parameters
    ----------
    poses : (n_bodies, 7) array
    half_width : (n_pieces,) array, m
        Half the width of each piece. The bound covers the rotation of the width direction between both bodies.
    """
    controls = control_points_spatial(poses, turned_spatial(poses), owners, stations)
    return chords_of_spatial(controls, stations, half_width)


@kernel
def chords_of_spatial(controls: np.ndarray, stations: np.ndarray, half_width: np.ndarray) -> np.ndarray:
    """Chords from the control points of `fsm.interactions.search.control_points`; returns as `chords_spatial`."""
    out = np.empty((controls.shape[0], 12))
    line, one, other = np.empty(3), np.empty(3), np.empty(3)
    for j in range(controls.shape[0]):
        across, turned = 0.0, 0.0
        for i in range(3):
            turned += (controls[j, 5, i] - controls[j, 4, i]) ** 2
            start = controls[j, 0, i]
            line[i] = controls[j, 3, i] - start
            one[i] = controls[j, 1, i] - start
            other[i] = controls[j, 2, i] - controls[j, 3, i]
            out[j, i], out[j, 8 + i] = start, controls[j, 4, i]
            across += line[i] * controls[j, 4, i]
        for i in range(3):
            line[i] -= across * controls[j, 4, i]
            out[j, 3 + i] = line[i]
        square = dot(line, line)
        inverse = 1.0 / square if square > 0.0 else 0.0
        tip = max(-stations[j, 4], stations[j, 5] - 1.0) * np.sqrt(square)
        away_one = np.sqrt(max(0.0, dot(one, one) - dot(one, line) ** 2 * inverse))
        away_other = np.sqrt(max(0.0, dot(other, other) - dot(other, line) ** 2 * inverse))
        out[j, 6] = inverse
        out[j, 7] = max(away_one, away_other) + tip + half_width[j] * np.sqrt(turned)
        out[j, 11] = half_width[j] + abs(across)
    return out


@kernel(inline=True)
def chord_distance(chord: np.ndarray, point: np.ndarray) -> float:
    """Squared distance (m^2) of a point (D,) from a chord, a row of the table."""
    if point.shape[0] == 2:
        x, z = point[0] - chord[0], point[1] - chord[1]
        share = min(1.0, max(0.0, (x * chord[2] + z * chord[3]) * chord[4]))
        x -= share * chord[2]
        z -= share * chord[3]
        return x * x + z * z
    x, y, z = point[0] - chord[0], point[1] - chord[1], point[2] - chord[2]
    across = x * chord[8] + y * chord[9] + z * chord[10]
    x, y, z = x - across * chord[8], y - across * chord[9], z - across * chord[10]
    share = min(1.0, max(0.0, (x * chord[3] + y * chord[4] + z * chord[5]) * chord[6]))
    x, y, z = x - share * chord[3], y - share * chord[4], z - share * chord[5]
    beside = max(0.0, abs(across) - chord[11])
    return x * x + y * y + z * z + beside * beside


@kernel(inline=True)
def along_chord(chord: np.ndarray, point: np.ndarray) -> float:
    """Position on a chord, 0 ... 1 from its start, nearest to a point (D,); equal to s for a straight piece."""
    return min(1.0, max(0.0, along_line(chord, point)))


@kernel(inline=True)
def along_line(chord: np.ndarray, point: np.ndarray) -> float:
    """Position of a point (D,) along the line through a chord, 0 at its start and 1 at its end."""
    size = point.shape[0]
    total = 0.0
    for i in range(size):
        total += (point[i] - chord[i]) * chord[size + i]
    return total * chord[2 * size]


@kernel(inline=True)
def over_chord(chord: np.ndarray, point: np.ndarray) -> float:
    """Signed height of a point (D,) over a chord times the chord's length, m^2; positive along the surface normal."""
    if point.shape[0] == 2:
        return chord[2] * (point[1] - chord[1]) - chord[3] * (point[0] - chord[0])
    x, y, z = point[0] - chord[0], point[1] - chord[1], point[2] - chord[2]
    return (
        x * (chord[4] * chord[10] - chord[5] * chord[9])
        + y * (chord[5] * chord[8] - chord[3] * chord[10])
        + z * (chord[3] * chord[9] - chord[4] * chord[8])
    )


@kernel
def largest_bulge(chords: np.ndarray, stations: np.ndarray) -> float:
    """Bound of the distance between a surface and its chords, m, tips excluded."""
    column = 5 if chords.shape[1] == 6 else 7
    largest = 0.0
    for j in range(chords.shape[0]):
        tip = max(-stations[j, 4], stations[j, 5] - 1.0)
        inverse = chords[j, column - 1]
        bulge = chords[j, column] - (tip / np.sqrt(inverse) if inverse > 0.0 else 0.0)
        largest = max(largest, bulge)
    return largest


@kernel
def chord_boxes(chords: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corners (n, D), m, of axis-aligned boxes around the chords, for `box_tree.fit_tree`."""
    count, size = chords.shape[0], 2 if chords.shape[1] == 6 else 3
    lower, upper = np.empty((count, size)), np.empty((count, size))
    for j in range(count):
        for i in range(size):
            start, end = chords[j, i], chords[j, i] + chords[j, size + i]
            beyond = ROUNDING * (abs(start) + abs(end))
            if size == 3:
                beyond += (1.0 + ROUNDING) * chords[j, 11] * abs(chords[j, 8 + i])
            lower[j, i] = min(start, end) - beyond
            upper[j, i] = max(start, end) + beyond
    return lower, upper
