"""Weights of the contact points and edges of pairs of shapes, as functions of the relative pose within a step.

The weights of a pair (`fsm.interactions.shapes.face_overlap`) are computed at an accepted state. Within the next step they
follow the relative pose linearly, w = w_0 + s (x - x_0). A contact energy w U gives the forces -w dU/dx and -U dw/dx. The
work of a change of weight under load thus equals the stored energy, and the energy balance holds to second order in the
step. The weights do not follow displacements along the normal: the energy of two faces that approach is the integral of
their force.

The slopes s are differences of the weights. Where the weights jump or have a kink, the slope of smaller magnitude is used. A
jump changes the stored energy without work. During an impact this energy is large. A pair then keeps the weights of the
linear function and uses only the new slopes. The weights change to their new values after the impact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.contact.shapes import Shapes
from fsm.interactions.shapes.face_overlap import COLUMNS, LEAST, pair_weights
from fsm.interactions.shapes.shape_distance import CYLINDER, HALF_SPACE, POLYGON, RECTANGLE, SPHERE
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation

SHARE, _SLOPE, ROW = 12, 12 + COLUMNS, 12 + 7 * COLUMNS
"""First columns of the weights and of their slopes in the row of a unit, and the length of the row; before them are the axes
and the centre of the first shape in the axes of the second."""
_SLIDE = 1e-4
"""Relative displacement of faces, over half the smallest size, after which the weights are computed again."""
_TURN = 1e-4
"""Relative rotation after which the weights are computed again, rad."""
_DIFFERENCE = 1e-6
"""Rotation (rad) and displacement, over half the smallest size, of the differences that give the slopes."""
_LEAST_PART = 0.1
"""Smallest factor of a weight within a step."""
_JUMP = 2e-3
"""Difference of a weight from the line, relative to the largest weight of the pair, from which it counts as a jump."""


@kernel
def _relative_pose(
    poses: np.ndarray,
    one: int,
    two: int,
    body: np.ndarray,
    offset: np.ndarray,
    axes: np.ndarray,
    frames: np.ndarray,
    arms: np.ndarray,
    turn: np.ndarray,
    shift: np.ndarray,
) -> None:
    """Axes (3, 3) and centre (3,) of a shape in the axes of another shape.

    The function also writes, in inertial axes, the axes of both bodies (rows 0 and 1 of `frames`) and of both shapes (2 and
    3), and the positions of both shapes relative to their bodies (`arms`).
    """
    for c in range(3):
        shift[c] = 0.0
    for k in range(2):
        shape = one if k == 0 else two
        pose, sign = poses[body[shape]], 1.0 if k == 0 else -1.0
        if pose.shape[0] == 3:
            c, s = np.cos(pose[2]), np.sin(pose[2])
            frames[k] = 0.0
            frames[k, 0, 0] = frames[k, 2, 2] = c
            frames[k, 0, 2], frames[k, 2, 0], frames[k, 1, 1] = s, -s, 1.0
        else:
            fill_rotation(pose[3:], frames[k])
        for i in range(3):
            arms[k, i] = 0.0
            for j in range(3):
                arms[k, i] += frames[k, i, j] * offset[shape, j]
            at = (0.0 if i == 1 else pose[i // 2]) if pose.shape[0] == 3 else pose[i]
            shift[i] += sign * (at + arms[k, i])
        frames[2 + k] = frames[k] @ axes[shape]
    apart = shift.copy()
    for i in range(3):
        shift[i] = 0.0
        for c in range(3):
            shift[i] += frames[3, c, i] * apart[c]
        for j in range(3):
            turn[i, j] = 0.0
            for c in range(3):
                turn[i, j] += frames[3, c, i] * frames[2, c, j]


@kernel
def _turned(turn: np.ndarray, axis: int, angle: float, out: np.ndarray) -> None:
    """Rotate the columns of `turn` about an axis by a small angle, into `out`."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    for n in range(3):
        out[axis, n] = turn[axis, n]
        out[i, n] = c * turn[i, n] - s * turn[j, n]
        out[j, n] = s * turn[i, n] + c * turn[j, n]


@kernel
def _displacement(turn: np.ndarray, shift: np.ndarray, row: np.ndarray, way: np.ndarray) -> None:
    """Write displacement and small rotation (6,) between the pose of a unit's row and a relative pose to `way`."""
    for c in range(3):
        i, j = (c + 1) % 3, (c + 2) % 3
        way[c], way[3 + c] = shift[c] - row[9 + c], 0.0
        for n in range(3):
            way[3 + c] += 0.5 * (turn[j, n] * row[3 * i + n] - turn[i, n] * row[3 * j + n])


@kernel
def _part(row: np.ndarray, column: int, way: np.ndarray) -> float:
    """Factor of a weight after a displacement."""
    change = 0.0
    for c in range(6):
        change += row[_SLOPE + 6 * column + c] * way[c]
    return 1.0 + change / max(LEAST, row[SHARE + column])


@kernel(inline=True)
def _constant(one: int, two: int) -> bool:
    """Whether the weights of a pair of shapes are the same in all poses."""
    if two == HALF_SPACE:
        return one != CYLINDER
    return one != RECTANGLE or two in (SPHERE, POLYGON)


class ShapePoints(NamedTuple):
    """Points of shapes.

    Attributes
    ----------
    start : (s + 1,) int array
        First point of every shape.
    place : (p, 3) array
        Position of each point in the axes of its shape, m.
    weight : (p,) array
        Fraction of a face that each point represents.
    on_axis : (p,) bool array
        Whether a point lies on the axis of a cylinder.
    """

    start: np.ndarray
    place: np.ndarray
    weight: np.ndarray
    on_axis: np.ndarray


class UnitTable(NamedTuple):
    """Units: pairs of shapes.

    Attributes
    ----------
    shapes : (u, 2) int array
    whole : (u, 2) array, m^2
        Areas of the complete faces to which plates belong.
    base : (u, 5) array
        Weights for tilted faces.
    """

    shapes: np.ndarray
    whole: np.ndarray
    base: np.ndarray


@kernel
def weigh_units(
    poses: np.ndarray,
    rows: np.ndarray,
    held: np.ndarray,
    units: UnitTable,
    solids: Shapes,
    points: ShapePoints,
    known: np.ndarray,
    state: np.ndarray,
) -> int:
    """Update the weights of units that have moved relative to each other or have no weights yet.

    Parameters
    ----------
    poses : (n_bodies, 3 or 7) array
    rows : (m,) int array
        Units to test.
    held : (m,) bool array
        Units whose weights must not jump.
    units : UnitTable
    solids : Shapes
        In three dimensions also in a plane motion.
    points : ShapePoints
    known, state : (u,) bool, (u, ROW) arrays, changed in place
        Whether weights exist; relative pose at which they were computed, weights, and slopes by displacement (1/m) and
        rotation (1/rad) of the first shape, in the axes of the second.

    Returns
    -------
    int : number of changed units
    """
    shapes, whole, base = units
    body, kind, size, offset, axes, radius = solids
    start, place, weight, on_axis = points
    changed, spatial = 0, poses.shape[1] == 7
    frames, arms, turn, shift = np.empty((4, 3, 3)), np.empty((2, 3)), np.empty((3, 3)), np.empty(3)
    other_turn, other_shift, sides = np.empty((3, 3)), np.empty(3), np.empty((2, COLUMNS))
    polygon, scratch, way, line = np.empty((48, 2)), np.empty((48, 2)), np.empty(6), np.empty(COLUMNS)
    for number in range(len(rows)):
        unit = rows[number]
        one, two = shapes[unit]
        if _constant(kind[one], kind[two]):
            if not known[unit]:
                state[unit] = 0.0
                state[unit, SHARE:_SLOPE] = base[unit]
                known[unit] = True
                changed += 1
            continue
        _relative_pose(poses, one, two, body, offset, axes, frames, arms, turn, shift)
        smallest = np.inf
        for c in range(3):
            for k in range(2):
                if size[shapes[unit, k], c] > 0.0:
                    smallest = min(smallest, size[shapes[unit, k], c])
        old_turn, old_shift = state[unit, :9].reshape(3, 3), state[unit, 9:SHARE]
        if known[unit]:
            away, turned, lift = 0.0, 0.0, 0.0
            for c in range(3):
                lift += turn[c, 2] * (shift[c] - old_shift[c])
                for j in range(3):
                    turned = max(turned, abs(turn[c, j] - old_turn[c, j]))
            for c in range(3):
                away = max(away, abs(shift[c] - old_shift[c] - lift * turn[c, 2]))
            if away <= _SLIDE * smallest and turned <= _TURN:
                continue
        kinds, rounding = (kind[one], kind[two]), radius[one] + radius[two]
        of_one, of_two = slice(start[one], start[one + 1]), slice(start[two], start[two + 1])
        shares, slopes = state[unit, SHARE:_SLOPE], state[unit, _SLOPE:].reshape(COLUMNS, 6)
        keeps = held[number] and known[unit]
        if keeps:
            _displacement(turn, shift, state[unit], way)
            for c in range(COLUMNS):
                line[c] = max(LEAST, shares[c]) * max(_LEAST_PART, _part(state[unit], c, way))
        sizes, of_faces = (size[one], size[two]), (whole[unit, 0], whole[unit, 1])
        points_one, points_two = (place[of_one], weight[of_one]), (place[of_two], weight[of_two], on_axis[of_two])
        pair_weights(
            kinds, sizes, rounding, turn, shift, points_one, points_two, of_faces, spatial, base[unit], shares,
            (polygon, scratch),
        )  # fmt: skip
        old_turn[:], old_shift[:] = turn, shift
        slopes[:] = 0.0
        for direction in range(6):
            axis = direction % 3
            if not spatial and (axis == 1) != (direction >= 3):
                continue
            step = _DIFFERENCE * (smallest if direction < 3 else 1.0)
            for side in range(2):
                sign = 1.0 - 2.0 * side
                other_turn[:], other_shift[:] = turn, shift
                if direction < 3:
                    other_shift[axis] += sign * step
                else:
                    _turned(turn, axis, sign * step, other_turn)
                pair_weights(
                    kinds, sizes, rounding, other_turn, other_shift, points_one, points_two, of_faces, spatial, base[unit],
                    sides[side], (polygon, scratch),
                )  # fmt: skip
            for c in range(COLUMNS):
                after, before = (sides[0, c] - shares[c]) / step, (shares[c] - sides[1, c]) / step
                if after * before > 0.0:
                    slopes[c, direction] = after if abs(after) < abs(before) else before
        for c in range(COLUMNS):
            lift = turn[0, 2] * slopes[c, 0] + turn[1, 2] * slopes[c, 1] + turn[2, 2] * slopes[c, 2]
            for i in range(3):
                slopes[c, i] -= lift * turn[i, 2]
        if keeps and np.abs(shares - line).max() > _JUMP * shares.max():
            shares[:] = line
        known[unit] = True
        changed += 1
    return changed


@kernel
def changed_weights(
    poses: np.ndarray,
    units: np.ndarray,
    shapes: np.ndarray,
    body: np.ndarray,
    offset: np.ndarray,
    axes: np.ndarray,
    state: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Compute factors of the weights of units in these poses, and their gradients.

    Parameters
    ----------
    poses, state : see `weigh_units`
    units : (m,) int array of units
    shapes : (u, 2) int array
    body, offset, axes : of all shapes, see `weigh_units`

    Returns
    -------
    part : (m, 5) array
    gradient : (m, 5, 2, 3 or 6) array
        Derivatives of the factors with respect to the coordinates of the bodies of the first and the second shape.
    """
    count, order = len(units), 3 if poses.shape[1] == 3 else 6
    part, gradient = np.ones((count, COLUMNS)), np.zeros((count, COLUMNS, 2, order))
    frames, arms, turn, shift = np.empty((4, 3, 3)), np.empty((2, 3)), np.empty((3, 3)), np.empty(3)
    way, force, moment, arm, about = np.empty(6), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for row in range(count):
        unit = units[row]
        slopes = state[unit, _SLOPE:].reshape(COLUMNS, 6)
        one, two = shapes[unit]
        _relative_pose(poses, one, two, body, offset, axes, frames, arms, turn, shift)
        _displacement(turn, shift, state[unit], way)
        for column in range(COLUMNS):
            whole = max(LEAST, state[unit, SHARE + column])
            part[row, column] = _part(state[unit], column, way)
            if part[row, column] <= _LEAST_PART:
                part[row, column] = _LEAST_PART
                continue
            for i in range(3):
                force[i] = moment[i] = 0.0
                for c in range(3):
                    force[i] += frames[3, i, c] * slopes[column, c] / whole
                    moment[i] += frames[3, i, c] * slopes[column, 3 + c] / whole
            for k in range(2):
                sign = 1.0 - 2.0 * k
                for i in range(3):
                    arm[i] = arms[k, i]
                    if k == 1:  # the axes of the second shape rotate about its body
                        for c in range(3):
                            arm[i] += frames[3, i, c] * shift[c]
                for i in range(3):
                    a, b = (i + 1) % 3, (i + 2) % 3
                    about[i] = sign * (arm[a] * force[b] - arm[b] * force[a] + moment[i])
                if order == 3:
                    gradient[row, column, k, 0], gradient[row, column, k, 1] = sign * force[0], sign * force[2]
                    gradient[row, column, k, 2] = about[1]
                    continue
                for i in range(3):
                    gradient[row, column, k, i] = sign * force[i]
                    for c in range(3):
                        gradient[row, column, k, 3 + i] += frames[k, c, i] * about[c]
    return part, gradient
