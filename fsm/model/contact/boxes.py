"""Contact of two boxes, from flat faces to corners and crossed edges: an elastic foundation of one box, as a sum over cells.

The box A with the smaller largest face (of equal ones, the thicker box) is divided into cells: each of its faces has n x
n parts (`contact.points_per_segment`), and a cell is the volume below a part whose nearest face is this one. With the depth
t(x) of a point below this face and the area S_c of the part, a cell has the penetration

    d = (2/S_c int t dV)^(1/2)        over the volume of the cell that is inside the other box B.

Its force is K S_c/S d^e grad d, with the largest face S of A. d is the depth of a flat face that covers the cell. With e = 1
the energy of all cells is

    U = K/S int t dV        over the common volume of both boxes,

and the force is the pressure K/S t on the faces of B inside A (an elastic foundation: Johnson, Contact Mechanics, Cambridge
1985, section 4.3; over volumes: Elandt, Drumwright, Sherman and Ruina 2019). Faces, edges and corners are not distinguished,
so force, energy and tangent are continuous from one kind of contact to another. With e = 1, for a penetration delta that is
small compared with the boxes, and edges and corners symmetric to the normal:

    face on face                    K/S delta times the overlapping area
    edge of B on a face of A        K/S L delta^2 for the length L of the edge on the face
    corner of B on a face of A      sqrt(3)/2 K/S delta^3
    edge or corner of A on B        1/sqrt(2) or 1/sqrt(3) of it
    edges crossed at the angle a    sqrt(2)/3 K/S delta^3/sin a

All integrals are those of polynomials over polygons: the faces of B cut by the planes of a cell. Each corner of a polygon
carries its derivative by the relative motion through all cuts, so the tangent is exact.

Known errors: cells do not deform each other, so K belongs to one kind of contact. A band along the edges of A is nearest
to its sides: a square face of the side L has 1 - 2 delta/L of the stiffness, to first order. If e is not 1, a cell of which
the part T is covered has the force K S_c/S T^((e+1)/2) delta^e. Friction acts at the centre of pressure of each cell, across
the direction of the force of all cells: the friction torque of a spinning square face is 7.6 % low with n = 2. Before they
touch, cells have the gap of the middle of their part.
"""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.contact.contact_frame import add_contact_tangent, add_pull_tangent
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.tables import Floats1, Floats2, Floats3, Integers2, follows
from fsm.kernels.vector import cross, dot
from fsm.model.bodies.contact_arrays import STARTED, ContactArrays, forces_of, index_of
from fsm.model.contact.pair_contacts import PairContacts
from fsm.model.contact.touching import Touching

_PLANES, _WALLS, _CORNERS = 10, 5, 10
"""Planes of a cell, its faces that are not parallel to the depth, and the largest number of their corners."""
_MOST = 24
"""Room for the corners of a polygon."""
_OF_PAIRS = ("ends", "middles", "first_axes", "second_axes", "halves", "reach", "deepest")
"""Fields of `BoxArrays` with a row for each pair; the others have rows for the cells of all pairs."""
_LOOKS = 2000
"""Largest number of places between two states at which boxes are examined for passing through each other."""


class Box(NamedTuple):
    """Box on a body: its number, half sizes (3,) and middle (3,) in m, and axes (3, 3) in those of the body."""

    body: int
    half: np.ndarray
    middle: np.ndarray
    axes: np.ndarray


class BoxArrays(NamedTuple):
    """Bodies of all pairs, the smaller box first; middles and axes of the boxes in body axes, half sizes (m), distances
    of their corners from the middles (m), and the largest depth (m). For each cell: axis and side of its face, the area
    S_c (m^2), the middle of its part, planes (normal, distance) around it, and its walls (corners, their numbers, and the
    cosine of the angle of their normal with the depth); axes of the smaller box.
    """

    ends: Integers2
    middles: Floats3
    first_axes: Floats3
    second_axes: Floats3
    halves: Floats3
    reach: Floats2
    deepest: Floats1
    faces: Integers2
    areas: Floats1
    centres: Floats2
    planes: Floats3
    walls: Floats3
    corners: Integers2
    slopes: Floats2


_own = follows(BoxArrays, ContactArrays)


class _Pair(NamedTuple):
    """Rotation (3, 3) of the smaller box (A), and in its axes: the axes of the other (B) as columns, and its middle from
    that of A (m).
    """

    frame: np.ndarray
    turn: np.ndarray
    apart: np.ndarray


class _Sums(NamedTuple):
    """Integrals over the faces of B in a cell, axes of A: pressure t with the normals (m^3), with the moments of the
    normals (m^4), with the places (m^4), and alone (m^3); each with its derivatives by a small motion of B in A
    (translation, rotation).
    """

    push: np.ndarray
    couple: np.ndarray
    lever: np.ndarray
    load: np.ndarray
    push_by: np.ndarray
    couple_by: np.ndarray
    lever_by: np.ndarray
    load_by: np.ndarray


class _Room(NamedTuple):
    """Corners of two polygons, and their derivatives by the motion."""

    one: np.ndarray
    two: np.ndarray
    one_by: np.ndarray
    two_by: np.ndarray


@kernel
def _sums() -> _Sums:
    return _Sums(
        np.empty(3), np.empty(3), np.empty(3), np.empty(1), np.empty((6, 3)), np.empty((6, 3)), np.empty((6, 3)), np.empty(6)
    )


@kernel
def _room(bent: bool) -> _Room:
    size = _MOST if bent else 0
    return _Room(np.empty((_MOST, 3)), np.empty((_MOST, 3)), np.empty((size, 6, 3)), np.empty((size, 6, 3)))


@kernel
def _pair(g: ContactArrays, poses: np.ndarray, number: int) -> _Pair:
    own = _own(g)
    pair, turn, other = _Pair(np.empty((3, 3)), np.empty((3, 3)), np.empty(3)), np.empty((3, 3)), np.empty((3, 3))
    away = np.empty(3)
    one, two = own.ends[number, 0], own.ends[number, 1]
    fill_rotation(poses[one, 3:7], turn)
    fill_rotation(poses[two, 3:7], other)
    for i in range(3):
        away[i] = poses[two, i] - poses[one, i]
        for k in range(3):
            away[i] += other[i, k] * own.middles[number, 1, k] - turn[i, k] * own.middles[number, 0, k]
            pair.frame[i, k] = 0.0
            for m in range(3):
                pair.frame[i, k] += turn[i, m] * own.first_axes[number, m, k]
    for i in range(3):
        pair.apart[i] = dot(pair.frame[:, i], away)
        for k in range(3):
            pair.turn[i, k] = 0.0
            for m in range(3):
                for c in range(3):
                    pair.turn[i, k] += pair.frame[m, i] * other[m, c] * own.second_axes[number, c, k]
    return pair


@kernel
def _separation(g: ContactArrays, pair: _Pair, number: int) -> float:
    """Largest distance of both boxes along normals of faces and of pairs of edges, m; below zero where they overlap."""
    one, two = _own(g).halves[number, 0], _own(g).halves[number, 1]
    axis, most = np.empty(3), -np.inf
    for k in range(15):
        for i in range(3):
            axis[i] = (1.0 if i == k else 0.0) if k < 3 else pair.turn[i, k % 3]
        if k >= 6:
            edge, (x, y, z) = (k - 6) // 3, (axis[0], axis[1], axis[2])
            axis[0], axis[1], axis[2] = (
                (0.0, -z, y) if edge == 0 else (z, 0.0, -x) if edge == 1 else (-y, x, 0.0)
            )  # fmt: skip
        size = np.sqrt(dot(axis, axis))
        if size < 1e-6:
            continue
        away = abs(dot(axis, pair.apart))
        for i in range(3):
            away -= one[i] * abs(axis[i]) + two[i] * abs(dot(axis, pair.turn[:, i]))
        most = max(most, away / size)
    return float(most)


@kernel
def _cut(
    points: np.ndarray, points_by: np.ndarray, count: int, plane: np.ndarray, kept: np.ndarray, kept_by: np.ndarray
) -> int:
    """Write the part of a convex polygon where plane[:3].x < plane[3]; return the number of its corners."""
    out, bent = 0, points_by.shape[0] > 0
    for v in range(count):
        w = v + 1 if v + 1 < count else 0
        a, b = dot(plane, points[v]) - plane[3], dot(plane, points[w]) - plane[3]
        if a <= 0.0:
            for c in range(3):
                kept[out, c] = points[v, c]
            if bent:
                for m in range(6):
                    for c in range(3):
                        kept_by[out, m, c] = points_by[v, m, c]
            out += 1
        if (a < 0.0 < b) or (b < 0.0 < a):
            part = a / (a - b)
            for c in range(3):
                kept[out, c] = points[v, c] + part * (points[w, c] - points[v, c])
            if bent:
                for m in range(6):
                    shift = (a * dot(plane, points_by[w, m]) - b * dot(plane, points_by[v, m])) / (a - b) ** 2
                    for c in range(3):
                        kept_by[out, m, c] = (
                            points_by[v, m, c] + part * (points_by[w, m, c] - points_by[v, m, c])
                            + shift * (points[w, c] - points[v, c])
                        )  # fmt: skip
            out += 1
    return out if out > 2 else 0


@kernel
def _face(g: ContactArrays, pair: _Pair, number: int, slot: int, face: int, bent: bool, room: _Room) -> tuple[int, bool]:
    """Write the part of a face of B inside a cell; return the number of its corners, and whether it is `room.one`."""
    own, axis, side = _own(g), face // 2, 1.0 - 2.0 * (face % 2)
    half, points = own.halves[number, 1], room.one
    b, c = (axis + 1) % 3, (axis + 2) % 3
    for v in range(4):
        s, t = (1.0 if v in (0, 3) else -1.0) * half[b], (1.0 if v < 2 else -1.0) * half[c]
        for i in range(3):
            points[v, i] = (
                pair.apart[i] + side * half[axis] * pair.turn[i, axis] + s * pair.turn[i, b] + t * pair.turn[i, c]
            )
        if bent:
            x, y, z, by = points[v, 0], points[v, 1], points[v, 2], room.one_by[v]
            by[:] = 0.0
            by[0, 0] = by[1, 1] = by[2, 2] = 1.0
            by[3, 1], by[3, 2], by[4, 0], by[4, 2], by[5, 0], by[5, 1] = -z, y, z, -x, -y, x
    count, first = 4, True
    for p in range(_PLANES):
        plane = own.planes[slot, p]
        if first:
            count = _cut(room.one, room.one_by, count, plane, room.two, room.two_by)
        else:
            count = _cut(room.two, room.two_by, count, plane, room.one, room.one_by)
        first = not first
        if count == 0:
            break
    return count, first


@kernel
def _cell(g: ContactArrays, pair: _Pair, number: int, slot: int, bent: bool, room: _Room, out: _Sums) -> float:
    """Write the integrals over the faces of B in a cell, with their derivatives if `bent`; return int t dV, m^4."""
    own = _own(g)
    i, s = own.faces[slot, 0], float(own.faces[slot, 1])
    high = own.halves[number, 0, i]
    total = 0.0
    normal, area, moved, edge, other = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    t, moment, part = np.empty(3), np.empty(3), np.empty(3)
    out.push[:], out.couple[:], out.lever[:], out.load[:] = 0.0, 0.0, 0.0, 0.0
    if bent:
        out.push_by[:], out.couple_by[:], out.lever_by[:], out.load_by[:] = 0.0, 0.0, 0.0, 0.0
    for face in range(6):
        count, first = _face(g, pair, number, slot, face, bent, room)
        if count == 0:
            continue
        points, points_by = (room.one, room.one_by) if first else (room.two, room.two_by)
        axis, side = face // 2, 1.0 - 2.0 * (face % 2)
        for c in range(3):
            normal[c] = side * pair.turn[c, axis]
        for v in range(1, count - 1):
            for c in range(3):
                edge[c], other[c] = points[v, c] - points[0, c], points[v + 1, c] - points[0, c]
            cross(edge, other, area)
            size = 0.5 * side * dot(area, normal)
            t[0], t[1], t[2] = high - s * points[0, i], high - s * points[v, i], high - s * points[v + 1, i]
            sum_t = t[0] + t[1] + t[2]
            total -= 0.5 * s * normal[i] * size / 12.0 * (t[0] ** 2 + t[1] ** 2 + t[2] ** 2 + sum_t**2)
            load = size * sum_t / 3.0
            out.load[0] += load
            for c in range(3):
                sum_x = points[0, c] + points[v, c] + points[v + 1, c]
                moment[c] = (t[0] * points[0, c] + t[1] * points[v, c] + t[2] * points[v + 1, c] + sum_t * sum_x) / 12.0
                out.push[c] += load * normal[c]
                out.lever[c] += size * moment[c]
            cross(moment, normal, part)
            for c in range(3):
                out.couple[c] += size * part[c]
            if not bent:
                continue
            for m in range(6):
                by_0, by_1, by_2 = points_by[0, m], points_by[v, m], points_by[v + 1, m]
                size_by = 0.0
                for c in range(3):
                    d, e = (c + 1) % 3, (c + 2) % 3
                    size_by += 0.5 * side * normal[c] * (
                        (by_1[d] - by_0[d]) * other[e] - (by_1[e] - by_0[e]) * other[d]
                        + edge[d] * (by_2[e] - by_0[e]) - edge[e] * (by_2[d] - by_0[d])
                    )  # fmt: skip
                sum_by = -s * (by_0[i] + by_1[i] + by_2[i])
                load_by = (size_by * sum_t + size * sum_by) / 3.0
                out.load_by[m] += load_by
                for c in range(3):
                    sum_x = points[0, c] + points[v, c] + points[v + 1, c]
                    moved[c] = size_by * moment[c] + size / 12.0 * (
                        t[0] * by_0[c] + t[1] * by_1[c] + t[2] * by_2[c] + sum_by * sum_x
                        + sum_t * (by_0[c] + by_1[c] + by_2[c])
                        - s * (by_0[i] * points[0, c] + by_1[i] * points[v, c] + by_2[i] * points[v + 1, c])
                    )  # fmt: skip
                    out.push_by[m, c] += load_by * normal[c]
                    out.lever_by[m, c] += moved[c]
                cross(moved, normal, part)
                for c in range(3):
                    out.couple_by[m, c] += part[c]
                if m >= 3:  # the normal turns too
                    area[:] = 0.0
                    area[m - 3] = 1.0
                    cross(area, normal, moved)
                    cross(moment, moved, part)
                    for c in range(3):
                        out.push_by[m, c] += load * moved[c]
                        out.couple_by[m, c] += size * part[c]
    if out.load[0] == 0.0:
        return 0.0
    plane = np.empty(4)
    for wall in range(_WALLS):
        count, first = own.corners[slot, wall], True
        for v in range(count):
            for c in range(3):
                room.one[v, c] = own.walls[_WALLS * slot + wall, v, c]
        for face in range(6):
            if count == 0:
                break
            axis, side = face // 2, 1.0 - 2.0 * (face % 2)
            for c in range(3):
                plane[c] = side * pair.turn[c, axis]
            plane[3] = own.halves[number, 1, axis] + dot(plane, pair.apart)
            if first:
                count = _cut(room.one, room.one_by[:0], count, plane, room.two, room.two_by[:0])
            else:
                count = _cut(room.two, room.two_by[:0], count, plane, room.one, room.one_by[:0])
            first = not first
        points = room.one if first else room.two
        for v in range(1, count - 1):
            for c in range(3):
                edge[c], other[c] = points[v, c] - points[0, c], points[v + 1, c] - points[0, c]
            cross(edge, other, area)
            t[0], t[1], t[2] = high - s * points[0, i], high - s * points[v, i], high - s * points[v + 1, i]
            total -= own.slopes[slot, wall] * np.sqrt(dot(area, area)) / 48.0 * (
                t[0] ** 2 + t[1] ** 2 + t[2] ** 2 + (t[0] + t[1] + t[2]) ** 2
            )  # fmt: skip
    return max(total, 0.0)


@kernel
def _open_gap(g: ContactArrays, pair: _Pair, number: int, slot: int, normal: np.ndarray) -> tuple[float, int]:
    """Distance of the middle of a part of a face from B, m, and the number of directions in which it is beside B; writes
    the distance as a vector in the axes of B.
    """
    own, beside = _own(g), 0
    for k in range(3):
        y = 0.0
        for c in range(3):
            y += pair.turn[c, k] * (own.centres[slot, c] - pair.apart[c])
        half = own.halves[number, 1, k]
        normal[k] = y - half if y > half else y + half if y < -half else 0.0
        if normal[k] != 0.0:
            beside += 1
    return np.sqrt(dot(normal, normal)), beside


@kernel
def _apart(g: ContactArrays, poses: np.ndarray, number: int) -> float:
    """Distance of the spheres around both boxes, m."""
    own = _own(g)
    one, two, turn, square = own.ends[number, 0], own.ends[number, 1], np.empty((2, 3, 3)), 0.0
    fill_rotation(poses[one, 3:7], turn[0])
    fill_rotation(poses[two, 3:7], turn[1])
    for i in range(3):
        away = poses[two, i] - poses[one, i]
        for k in range(3):
            away += turn[1, i, k] * own.middles[number, 1, k] - turn[0, i, k] * own.middles[number, 0, k]
        square += away * away
    return float(np.sqrt(square) - own.reach[number, 0] - own.reach[number, 1])


@kernel
def _find(g: ContactArrays, poses: np.ndarray, below: float) -> int:
    own, room, found, normal, count = _own(g), _room(False), _sums(), np.empty(3), 0
    pairs = own.ends.shape[0]
    cells = own.areas.shape[0] // pairs
    for number in range(pairs):
        if _apart(g, poses, number) >= below:
            continue
        pair = _pair(g, poses, number)
        away = _separation(g, pair, number)
        if away >= below:
            continue
        for slot in range(number * cells, (number + 1) * cells):
            inside = _cell(g, pair, number, slot, False, room, found) if away < 0.0 else 0.0
            if inside > 0.0:
                gap = -np.sqrt(2.0 * inside / own.areas[slot])
            else:
                gap = _open_gap(g, pair, number, slot, normal)[0]
            if gap < below:
                g.slot[count], g.gap[count] = slot, gap
                count += 1
    return count


@kernel
def _motions(g: ContactArrays, poses: np.ndarray, pair: _Pair, number: int, way: np.ndarray, change: np.ndarray) -> None:
    """Write the motion of B in A (translation, rotation) by each coordinate, (12, 6), and its derivatives (12, 12, 6)."""
    own, other, at, moved, part = _own(g), np.empty((3, 3)), np.empty((2, 3)), np.empty(3), np.empty(3)
    fill_rotation(poses[own.ends[number, 1], 3:7], other)
    way[:], change[:] = 0.0, 0.0
    for k in range(3):  # centres of the bodies from the middle of A, in its axes
        at[0, k] = -dot(own.first_axes[number, :, k], own.middles[number, 0])
        at[1, k] = pair.apart[k]
        for c in range(3):
            at[1, k] -= pair.turn[k, c] * dot(own.second_axes[number, :, c], own.middles[number, 1])
    for j in range(3):
        for k in range(3):
            way[j, k], way[6 + j, k] = -pair.frame[j, k], pair.frame[j, k]
            way[3 + j, 3 + k], way[9 + j, 3 + k] = -own.first_axes[number, j, k], dot(pair.frame[:, k], other[:, j])
        for side in range(2):
            cross(at[side], way[3 + 6 * side + j, 3:], way[3 + 6 * side + j, :3])
    for n in range(12):
        cross(way[n, 3:], at[1], moved)
        for k in range(3):
            moved[k] += way[n, k]
        for j in range(3):
            if 3 <= n < 6:
                cross(way[n, 3:], way[j, :3], change[j, n, :3])
                cross(way[n, 3:], way[6 + j, :3], change[6 + j, n, :3])
            cross(way[n, 3:], way[9 + j, 3:], change[9 + j, n, 3:])
            cross(at[1], change[9 + j, n, 3:], change[9 + j, n, :3])
            cross(moved, way[9 + j, 3:], part)
            for k in range(3):
                change[9 + j, n, k] += part[k]


class _Contact(NamedTuple):
    """Pressed point in the axes of A: gradient of the gap as a force and a moment (6,), with its derivatives by the
    motion (6, 6); normal and point of the slip, with their derivatives (6, 3).
    """

    pull: np.ndarray
    pull_by: np.ndarray
    normal: np.ndarray
    normal_by: np.ndarray
    place: np.ndarray
    place_by: np.ndarray


@kernel
def _write_normal(
    g: ContactArrays, pair: _Pair, number: int, bent: bool, room: _Room, found: _Sums, normal: np.ndarray, by: np.ndarray
) -> None:
    """Write the direction (3,) of the force of all cells of a pair, and its derivatives (6, 3) by the motion."""
    cells = _own(g).areas.shape[0] // _own(g).ends.shape[0]
    normal[:], by[:] = 0.0, 0.0
    for slot in range(number * cells, (number + 1) * cells):
        if _cell(g, pair, number, slot, bent, room, found) > 0.0:
            normal += found.push
            if bent:
                by += found.push_by
    size = np.sqrt(dot(normal, normal))
    if size == 0.0:
        return
    normal /= size
    for m in range(6):
        along = dot(normal, by[m])
        for k in range(3):
            by[m, k] = (by[m, k] - along * normal[k]) / size


@kernel
def _contact(
    g: ContactArrays, pair: _Pair, number: int, slot: int, bent: bool, room: _Room, found: _Sums, net: np.ndarray,
    net_by: np.ndarray, out: _Contact,
) -> bool:  # fmt: skip
    """Write the contact of a cell, with the normal of the whole pair if the cell touches; return whether it does."""
    own = _own(g)
    inside = _cell(g, pair, number, slot, bent, room, found)
    if inside > 0.0:
        scale = 1.0 / (own.areas[slot] * np.sqrt(2.0 * inside / own.areas[slot]))  # 1/(S_c d)
        load = found.load[0]
        for k in range(3):
            out.pull[k], out.pull[3 + k] = -scale * found.push[k], -scale * found.couple[k]
            out.normal[k], out.place[k] = net[k], found.lever[k] / load
        if bent:
            for m in range(6):
                # the integral changes with the motion by (push, couple), so 1/d by -(push, couple)/(S_c d^3)
                less = -(found.push[m] if m < 3 else found.couple[m - 3]) * scale * scale * scale * own.areas[slot]
                for k in range(3):
                    out.normal_by[m, k] = net_by[m, k]
                    out.pull_by[m, k] = -scale * found.push_by[m, k] - less * found.push[k]
                    out.pull_by[m, 3 + k] = -scale * found.couple_by[m, k] - less * found.couple[k]
                    out.place_by[m, k] = (found.lever_by[m, k] - out.place[k] * found.load_by[m]) / load
        return True
    local, point = np.empty(3), own.centres[slot]
    gap, beside = _open_gap(g, pair, number, slot, local)
    for k in range(3):
        out.normal[k], out.place[k] = 0.0, point[k]
        for c in range(3):
            out.normal[k] += pair.turn[k, c] * local[c] / gap
    moment, axis, moved, turned, change = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    cross(point, out.normal, moment)
    for k in range(3):
        out.pull[k], out.pull[3 + k] = -out.normal[k], -moment[k]
    if not bent:
        return False
    for m in range(6):
        axis[:] = 0.0
        axis[m % 3] = 1.0
        if m < 3:
            turned[:] = 0.0
            for k in range(3):
                moved[k] = -axis[k]
        else:
            cross(axis, out.normal, turned)
            cross(point, axis, moved)
        for k in range(3):
            change[k] = turned[k]
        if beside > 1:  # nearest to an edge or a corner
            along = dot(out.normal, moved)
            for c in range(3):
                if local[c] != 0.0:
                    part = dot(pair.turn[:, c], moved) - along * local[c] / gap
                    for k in range(3):
                        change[k] += pair.turn[k, c] * part / gap
        cross(point, change, moment)
        for k in range(3):
            out.normal_by[m, k], out.place_by[m, k] = change[k], 0.0
            out.pull_by[m, k], out.pull_by[m, 3 + k] = -change[k], -moment[k]
    return False


@kernel
def _empty_contact() -> _Contact:
    return _Contact(np.empty(6), np.empty((6, 6)), np.empty(3), np.empty((6, 3)), np.empty(3), np.empty((6, 3)))


@kernel
def _velocity(way: np.ndarray, point: np.ndarray, out: np.ndarray) -> None:
    """Velocity of A from B at a point, for a motion of B in A."""
    cross(point, way[3:], out)
    for k in range(3):
        out[k] -= way[k]


@kernel
def _measure(g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    own, found, out, room = _own(g), _sums(), _empty_contact(), _room(False)
    cells, velocity, slip = own.areas.shape[0] // own.ends.shape[0], np.empty(3), np.empty(3)
    way, change, pair, last = np.empty((12, 6)), np.empty((12, 12, 6)), _pair(g, poses, 0), -1
    net, net_by = np.empty(3), np.empty((6, 3))
    for i in range(count):
        slot = g.slot[i]
        number = slot // cells
        if number != last:
            pair, last = _pair(g, poses, number), number
            _motions(g, poses, pair, number, way, change)
            _write_normal(g, pair, number, False, room, found, net, net_by)
        _contact(g, pair, number, slot, False, room, found, net, net_by, out)
        g.pull[i] = max(-dot(out.normal, out.pull), 0.0)
        for end in range(2):
            g.bodies[i, end] = own.ends[number, end]
        for m in range(12):
            g.gradient[i, 0, m] = dot(out.pull, way[m]) + dot(out.pull[3:], way[m, 3:])
            _velocity(way[m], out.place, velocity)
            along = dot(out.normal, velocity)
            for c in range(3):
                slip[c] = velocity[c] - along * out.normal[c]
            for c in range(3):
                g.gradient[i, 1 + c, m] = dot(pair.frame[c], slip)
        for a in range(4):
            g.rate[i, a] = 0.0
            for m in range(12):
                g.rate[i, a] += g.gradient[i, a, m] * rates[own.ends[number, m // 6], m % 6]


@kernel
def _tangent(
    g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    own, found, out, room = _own(g), _sums(), _empty_contact(), _room(True)
    cells, friction = own.areas.shape[0] // own.ends.shape[0], forces_of(g, 0, count).friction
    way, change, pair, last = np.empty((12, 6)), np.empty((12, 12, 6)), _pair(g, poses, 0), -1
    hessian, second, pull, normal, place = np.empty((12, 12)), np.zeros((12, 12, 3)), np.empty(6), np.empty(3), np.empty(3)
    velocity, faster, part, slip = np.empty((12, 3)), np.empty(3), np.empty(3), np.empty(3)
    block_k, block_d, larger = np.empty((12, 12)), np.empty((12, 12)), np.empty(12)
    net, net_by = np.empty(3), np.empty((6, 3))
    for i in range(count):
        slot = g.slot[i]
        number = slot // cells
        if number != last:
            pair, last = _pair(g, poses, number), number
            _motions(g, poses, pair, number, way, change)
            _write_normal(g, pair, number, True, room, found, net, net_by)
        touches = _contact(g, pair, number, slot, True, room, found, net, net_by, out)
        along_pull = dot(out.normal, out.pull)
        for m in range(12):
            _velocity(way[m], out.place, velocity[m])
        for n in range(12):
            pull[:], normal[:], place[:] = 0.0, 0.0, 0.0
            for a in range(6):
                for k in range(6):
                    pull[k] += out.pull_by[a, k] * way[n, a]
                for k in range(3):
                    normal[k] += out.normal_by[a, k] * way[n, a]
                    place[k] += out.place_by[a, k] * way[n, a]
            larger[n] = 0.0
            if along_pull < 0.0:
                larger[n] = (dot(normal, out.pull) + dot(out.normal, pull)) / along_pull
            for m in range(12):
                hessian[m, n] = (
                    dot(pull, way[m]) + dot(pull[3:], way[m, 3:])
                    + dot(out.pull, change[m, n]) + dot(out.pull[3:], change[m, n, 3:])
                )  # fmt: skip
                if not friction:
                    continue
                _velocity(change[m, n], out.place, faster)
                cross(place, way[m, 3:], part)
                for c in range(3):
                    faster[c] += part[c]
                along = dot(out.normal, velocity[m])
                along_by = dot(normal, velocity[m]) + dot(out.normal, faster)
                for c in range(3):
                    slip[c] = faster[c] - along_by * out.normal[c] - along * normal[c]
                if 3 <= n < 6:  # the axes of A turn
                    for c in range(3):
                        part[c] = velocity[m, c] - along * out.normal[c]
                    cross(part, way[n, 3:], faster)
                    for c in range(3):
                        slip[c] += faster[c]
                for c in range(3):
                    second[m, n, c] = dot(pair.frame[c], slip)
        add_contact_tangent(
            i, rates, g.bodies[:count], g.gradient[:count], hessian, second, forces_of(g, 0, count), index_of(g), stiffness,
            damping, block_k, block_d,
        )  # fmt: skip
        if friction and touches and along_pull < 0.0:
            add_pull_tangent(
                i, g.bodies[:count], g.gradient[:count], larger, forces_of(g, 0, count), index_of(g), stiffness, block_k
            )


@kernel
def _passed(g: ContactArrays, poses: np.ndarray) -> int:
    own, between, started = _own(g), poses.copy(), g.state[STARTED] == 1
    for number in range(own.ends.shape[0]):
        moved, looks = 0.0, 1
        if started:
            for end in range(2):
                body, start, square, turn = own.ends[number, end], g.committed[own.ends[number, end]], 0.0, 0.0
                for k in range(3):
                    square += (poses[body, k] - start[k]) ** 2
                for k in range(3, 7):
                    turn += (poses[body, k] - start[k]) ** 2
                away = own.middles[number, end]
                moved += np.sqrt(square) + 2.5 * np.sqrt(turn) * (own.reach[number, end] + np.sqrt(dot(away, away)))
            looks = min(_LOOKS, 1 + int(moved / own.deepest[number]))
        if _apart(g, poses, number) >= moved:
            continue
        for look in range(1, looks + 1):
            part = look / looks
            for end in range(2):
                body = own.ends[number, end]
                size = 0.0
                for k in range(7):
                    between[body, k] = poses[body, k]
                    if look < looks:
                        between[body, k] += (1.0 - part) * (g.committed[body, k] - poses[body, k])
                    if k >= 3:
                        size += between[body, k] ** 2
                for k in range(3, 7):
                    between[body, k] /= np.sqrt(size)
            if _separation(g, _pair(g, between, number), number) < -own.deepest[number]:
                return number
    return -1


# construction -----------------------------------------------------------------------------------------------------------


class _Cell(NamedTuple):
    """Cell of a box: axis and side (1 or -1) of its face; area (m^2) and middle (m) of its part; planes around it: the face,
    five walls, and planes parallel to the depth, as normals with their distances (m).
    """

    axis: int
    side: int
    area: float
    middle: np.ndarray
    planes: list[tuple[np.ndarray, float]]


def _cells(half: np.ndarray, parts: int) -> list[_Cell]:
    """Cells of a box with these half sizes, m."""
    out, unit = list[_Cell](), np.eye(3)
    for i, s in product(range(3), (1, -1)):
        j, k = (i + 1) % 3, (i + 2) % 3
        around = [(s * unit[i], float(half[i])), (-s * unit[i], 0.0)]
        for c, t in product((j, k), (1, -1)):
            around.append(((t * unit[c] - s * unit[i]) / np.sqrt(2.0), float(half[c] - half[i]) / np.sqrt(2.0)))
        for numbers in product(range(parts), repeat=2):
            middle, planes = half[i] * s * unit[i], list(around)
            for c, number in zip((j, k), numbers, strict=True):
                low, high = (float(half[c]) * (2.0 * (number + end) / parts - 1.0) for end in (0, 1))
                middle = middle + 0.5 * (low + high) * unit[c]
                planes += [(unit[c], high)] * (number < parts - 1) + [(-unit[c], -low)] * (number > 0)
            out.append(_Cell(i, s, float(4.0 * half[j] * half[k]) / parts**2, middle, planes))
    return out


def _wall(planes: list[tuple[np.ndarray, float]], number: int, size: float) -> np.ndarray:
    """Corners of the face of a cell on one of its planes, (n, 3)."""
    normal, height = planes[number]
    one = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    one /= np.linalg.norm(one)
    two = np.cross(normal, one)
    corners = [height * normal + size * (a * one + b * two) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    points, kept, none = np.zeros((_MOST, 3)), np.zeros((_MOST, 3)), np.zeros((0, 6, 3))
    points[:4], count = corners, 4
    for other, (way, limit) in enumerate(planes):
        if other != number and count:
            count = _cut(points, none, count, np.array([*way, limit]), kept, none)
            points, kept = kept, points
    return points[:count]


def box_contacts(touching: Touching, boxes: list[tuple[Box, Box]], parts: int) -> PairContacts:
    """Table of pairs of boxes.

    Parameters
    ----------
    touching : Touching
        The pairs; both sides are bodies.
    boxes : both boxes of each pair
    parts : parts along each side of a face
    """
    rows, share, area = list[dict[str, Any]](), [], []
    for pair in boxes:
        own, other = sorted(pair, key=lambda box: (_largest(box), -box.half.min()))
        cells = _cells(own.half, parts)
        planes, walls = np.zeros((len(cells), _PLANES, 4)), np.zeros((len(cells), _WALLS, _CORNERS, 3))
        planes[:, :, 3] = 1.0  # a plane with the normal zero cuts nothing
        corners, slopes = np.zeros((len(cells), _WALLS), dtype=np.int64), np.zeros((len(cells), _WALLS))
        for k, cell in enumerate(cells):
            planes[k, : len(cell.planes)] = [[*normal, limit] for normal, limit in cell.planes]
            for wall in range(_WALLS):  # the planes after the walls are parallel to the depth
                found = _wall(cell.planes, 1 + wall, 4.0 * own.half.sum())
                corners[k, wall], slopes[k, wall] = len(found), cell.side * cell.planes[1 + wall][0][cell.axis]
                walls[k, wall, : len(found)] = found
        both, areas = (own, other), np.array([cell.area for cell in cells])
        halves = np.array([box.half for box in both])
        rows.append({
            "ends": [box.body for box in both], "middles": [box.middle for box in both], "first_axes": own.axes,
            "second_axes": other.axes, "halves": halves, "reach": np.linalg.norm(halves, axis=1), "deepest": halves.min(),
            "faces": [[cell.axis, cell.side] for cell in cells], "areas": areas,
            "centres": [cell.middle for cell in cells], "planes": planes, "walls": walls.reshape(-1, _CORNERS, 3),
            "corners": corners, "slopes": slopes,
        })  # fmt: skip
        share.append(areas / _largest(own))
        area.append(areas)
    stacked = {
        name: (np.array if name in _OF_PAIRS else np.concatenate)([row[name] for row in rows]) for name in BoxArrays._fields
    }
    return PairContacts(
        touching, BoxArrays(**stacked), float(stacked["deepest"].min()), _find, _measure, _tangent, _passed,
        share=np.array(share), area=np.array(area), means=True,
    )  # fmt: skip


def _largest(box: Box) -> float:
    """Area of the largest face, m^2."""
    return float(4.0 * np.sort(box.half)[1:].prod())
