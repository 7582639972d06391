"""Closest points of surfaces in space; see `fsm.interactions.surfaces.closest_planar`.

Newton's method solves (p - S(s, y)) . S_a = 0 for a = s, y. `fsm.interactions.surfaces.gap_spatial` gives the derivatives of
gaps.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.search import chord as chording
from fsm.interactions.search import control_points as control
from fsm.interactions.search.box_tree import fit_tree, nearest_of_few
from fsm.interactions.surfaces.closest_planar import EXACT, LINEAR, ROUGH
from fsm.interactions.surfaces.end_taper import inside_of_end
from fsm.interactions.surfaces.surface import beyond_end, known_place, overshoot
from fsm.kernels.jit import kernel
from fsm.kernels.vector import cross, dot

_WELL_WITHIN = 0.9
"""Fraction of the half width within which a point certainly lies over the surface."""


@kernel
def probe_points_spatial(poses: np.ndarray, probe_body: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Positions (n, 3) of the probes, m."""
    points, axes = np.empty((probe_body.shape[0], 3)), control.turned_spatial(poses)
    for i in range(probe_body.shape[0]):
        control.point_spatial(poses, axes, probe_body[i], place[i], points[i])
    return points


@kernel
def _closest(
    point: np.ndarray,
    piece: int,
    first: int,
    last: int,
    controls: np.ndarray,
    stations: np.ndarray,
    half_width: np.ndarray,
    s: float,
    y: float,
    tolerance: float,
    curve: np.ndarray,
    surface: np.ndarray,
) -> tuple[int, float, float]:
    """Find the closest point (piece, s, y) of pieces [first, last); on return `surface` (5, 3) is evaluated there."""
    gap = curve[0]  # C is not needed after the surface is evaluated
    for _ in range(40):
        control.surface_at(s, y, controls, piece, curve, surface)
        for m in range(3):
            gap[m] = point[m] - surface[control.ROW, m]
        r_s, r_y = dot(gap, surface[control.ROW_S]), dot(gap, surface[control.ROW_Y])
        g_ss, g_sy, g_yy = (
            dot(surface[control.ROW_S], surface[control.ROW_S]),
            dot(surface[control.ROW_S], surface[control.ROW_Y]),
            dot(surface[control.ROW_Y], surface[control.ROW_Y]),
        )
        m_ss, m_sy, bound = g_ss - dot(gap, surface[control.ROW_SS]), g_sy - dot(gap, surface[control.ROW_SY]), tolerance
        if m_ss * g_yy - m_sy * m_sy < 0.1 * (g_ss * g_yy - g_sy * g_sy):
            m_ss, m_sy, bound = g_ss, g_sy, LINEAR * tolerance
        determinant = m_ss * g_yy - m_sy * m_sy
        step_s = min(0.5, max(-0.5, (g_yy * r_s - m_sy * r_y) / determinant))
        step_y = (m_ss * r_y - m_sy * r_s) / determinant
        y += step_y
        new = s + step_s
        if new > 1.0 and piece + 1 < last:
            piece, s = piece + 1, 0.0
            continue
        if new < 0.0 and piece > first:
            piece, s = piece - 1, 1.0
            continue
        before, s = s, min(stations[piece, 5] + 0.5, max(stations[piece, 4] - 0.5, new))
        if abs(step_s) < bound and abs(step_y) < bound * half_width[piece]:
            break
        if s == before and s != new:  # the point is far beyond an end
            break
    return piece, s, y


@kernel
def find_contacts_spatial(
    poses: np.ndarray,
    probe_body: np.ndarray,
    place: np.ndarray,
    side: np.ndarray,
    straight: np.ndarray,
    limits: tuple[np.ndarray, np.ndarray, np.ndarray],
    window: np.ndarray,
    owners: np.ndarray,
    stations: np.ndarray,
    half_width: np.ndarray,
    probes: np.ndarray,
    below: float,
    found: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> int:
    """Find the closest points of some probes with gaps below a bound, as `find_contacts_planar`; (s, y) in place of s."""
    curve, surface, point, normal = np.empty((3, 3)), np.empty((5, 3)), np.empty(3), np.empty(3)
    axes = control.turned_spatial(poses)
    controls = control.control_points_spatial(poses, axes, owners, stations)
    chords = chording.chords_of_spatial(controls, stations, half_width)
    clearance, depth_limit, no_share = limits
    found_probe, found_piece, found_side, found_at, found_gap = found
    count = 0
    for k in range(probes.shape[0]):
        i = probes[k]
        if window[i, 0] >= window[i, 1]:
            continue
        control.point_spatial(poses, axes, probe_body[i], place[i], point)
        piece, nearest, bound = -1, np.inf, 0.0
        for j in range(window[i, 0], window[i, 1]):
            distance = chording.chord_distance(chords[j], point)
            bound = max(bound, chords[j, 7])
            if distance < nearest:
                piece, nearest = j, distance
        distance = np.sqrt(nearest)
        if distance > max(clearance[i] + below, depth_limit[i]) + bound:
            continue
        # gap larger than the bound: no contact
        if distance > max(clearance[i] + below, 0.0) + bound and side[i] * chording.over_chord(chords[piece], point) >= 0.0:
            continue
        s = chording.along_chord(chords[piece], point)
        piece, s, y = _closest(
            point, piece, window[i, 0], window[i, 1], controls, stations, half_width, s, place[i, 1], EXACT, curve, surface
        )
        if s < stations[piece, 4] - 1e-12 or s > stations[piece, 5] + 1e-12 or abs(y) > half_width[piece]:
            continue
        if no_share[i] >= 0.0 and inside_of_end(s, stations[piece])[0] <= no_share[i]:
            continue
        height = _height(point, surface, normal)
        facing = side[i]
        if facing == 0.0:
            facing = 1.0 if height >= 0.0 else -1.0
        value = facing * height - clearance[i]
        over, radius = overshoot(
            s, stations[piece], np.sqrt(dot(surface[control.ROW_S], surface[control.ROW_S])), straight[i], clearance[i]
        )
        if over != 0.0:
            value = np.hypot(over, value + radius) - radius
        if value < below and value > -depth_limit[i]:
            found_probe[count] = i
            found_piece[count] = piece
            found_side[count] = facing
            found_at[count, 0] = s
            found_at[count, 1] = y
            found_gap[count] = value
            count += 1
    return count


@kernel(inline=True)
def _height(point: np.ndarray, surface: np.ndarray, normal: np.ndarray) -> float:
    """Height of a point over the surface along S_s x S_y, m."""
    cross(surface[control.ROW_S], surface[control.ROW_Y], normal)
    total = 0.0
    for m in range(3):
        total += normal[m] * (point[m] - surface[control.ROW, m])
    return total / np.sqrt(dot(normal, normal))


@kernel
def heights_spatial(
    poses: np.ndarray,
    probe_body: np.ndarray,
    place: np.ndarray,
    straight: np.ndarray,
    depth_limit: np.ndarray,
    first_piece: np.ndarray,
    last_piece: np.ndarray,
    owners: np.ndarray,
    stations: np.ndarray,
    half_width: np.ndarray,
    reach: np.ndarray,
    nearest: np.ndarray,
    height: np.ndarray,
) -> None:
    """Heights (n,) of all probes over their surfaces, m; see `heights_planar`."""
    curve, surface, point, normal = np.empty((3, 3)), np.empty((5, 3)), np.empty(3), np.empty(3)
    axes = control.turned_spatial(poses)
    controls = control.control_points_spatial(poses, axes, owners, stations)
    chords = chording.chords_of_spatial(controls, stations, half_width)
    lower, upper = chording.chord_boxes(chords)
    tree = fit_tree(lower, upper)
    bulge = chording.largest_bulge(chords, stations)
    for i in range(probe_body.shape[0]):
        first, last = first_piece[i], last_piece[i]
        height[i] = np.nan
        if first >= last:
            nearest[i] = -1
            continue
        control.point_spatial(poses, axes, probe_body[i], place[i], point)
        nearest[i], square = nearest_of_few(point, first, last, chords, tree, nearest[i], reach[i] * reach[i])
        if nearest[i] < 0:
            continue
        chord, distance, across = chords[nearest[i]], np.sqrt(square), 0.0
        for m in range(3):
            across += (point[m] - chord[m]) * chord[8 + m]
        beside = known_place(chording.along_line(chord, point), owners[nearest[i]], stations[nearest[i]])
        if beside < 0:
            continue
        within = abs(across) < _WELL_WITHIN * half_width[nearest[i]]
        if within and beside > 0 and distance > bulge and abs(distance - depth_limit[i]) > bulge:
            height[i] = distance if chording.over_chord(chord, point) >= 0.0 else -distance
            continue
        s = chording.along_chord(chord, point)
        piece, s, y = _closest(
            point, nearest[i], first, last, controls, stations, half_width, s, place[i, 1], ROUGH, curve, surface
        )
        on_it = stations[piece, 4] - 1e-12 <= s <= stations[piece, 5] + 1e-12 and abs(y) <= half_width[piece]
        if on_it and not beyond_end(s, straight[i]):
            height[i] = _height(point, surface, normal)
