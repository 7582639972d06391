"""Closest points of surfaces in the plane: contact search, and the side of a surface on which each probe lies.

The search tests the chords first (`fsm.interactions.search.chord`). Newton's method then solves (p - C(s)) . C_s(s) = 0 with
the control points of `fsm.interactions.search.control_points`. `fsm.interactions.surfaces.gap_planar` gives the derivatives
of the gaps.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.search import chord
from fsm.interactions.search.box_tree import fit_tree, nearest_of_few
from fsm.interactions.search.control_points import control_points_planar, curve_at, point_planar, turned_planar
from fsm.interactions.surfaces.end_taper import inside_of_end
from fsm.interactions.surfaces.surface import beyond_end, known_place, overshoot
from fsm.kernels.jit import kernel

EXACT, ROUGH = 1e-8, 1e-3
"""Largest last steps in s of Newton's method for closest points: for forces, and for heights only. The error after a step
is its square; the distance from the surface changes with the square of the error."""
LINEAR = 1e-6
"""Factor on these steps if the last one had a simplified slope, so that the error is not the square of the step."""


@kernel
def probe_points_planar(poses: np.ndarray, probe_body: np.ndarray, probe_x: np.ndarray) -> np.ndarray:
    """Positions (n, 2) of the probes, m."""
    points, axes = np.empty((probe_body.shape[0], 2)), turned_planar(poses)
    for i in range(probe_body.shape[0]):
        point_planar(poses, axes, probe_body[i], probe_x[i], points[i])
    return points


@kernel
def _closest(
    px: float,
    pz: float,
    piece: int,
    first: int,
    last: int,
    at: float,
    controls: np.ndarray,
    stations: np.ndarray,
    tolerance: float,
    curve: np.ndarray,
) -> tuple[int, float]:
    """Find the closest point (piece, s) of pieces [first, last) by Newton's method from a given piece and s.

    On return `curve` (3, 2) holds C, C_s, C_ss there. s is outside its piece if the point is beyond the tips.
    """
    for _ in range(40):
        curve_at(at, controls, piece, curve)
        dx, dz = px - curve[0, 0], pz - curve[0, 1]
        residual = dx * curve[1, 0] + dz * curve[1, 1]
        metric = curve[1, 0] ** 2 + curve[1, 1] ** 2
        slope, bound = metric - dx * curve[2, 0] - dz * curve[2, 1], tolerance
        if slope < 0.1 * metric:
            slope, bound = metric, LINEAR * tolerance
        step = min(0.5, max(-0.5, residual / slope))
        new = at + step
        if new > 1.0 and piece + 1 < last:
            piece, at = piece + 1, 0.0
            continue
        if new < 0.0 and piece > first:
            piece, at = piece - 1, 1.0
            continue
        before, at = at, min(stations[piece, 5] + 0.5, max(stations[piece, 4] - 0.5, new))
        if abs(step) < bound:
            break
        if at == before and at != new:  # the point is far beyond an end
            break
    return piece, at


@kernel
def find_contacts_planar(
    poses: np.ndarray,
    probe_body: np.ndarray,
    probe_x: np.ndarray,
    side: np.ndarray,
    straight: np.ndarray,
    limits: tuple[np.ndarray, np.ndarray, np.ndarray],
    window: np.ndarray,
    owners: np.ndarray,
    stations: np.ndarray,
    probes: np.ndarray,
    below: float,
    found: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> int:
    """Find the closest points of some probes whose gap is below a bound.

    Parameters
    ----------
    side : (n,) array
        Side of the surface on which the probe lies, +1 or -1; 0 for a new probe, whose side is found here.
    limits : (n,) arrays, m
        Clearance; depth limit; distance from an end of the surface below which the probe's share is zero, negative for no
        taper.
    probes : int array
        Probes of the search, ascending.
    below : float, m
        Largest gap; 0 for contacts only.
    found : (n,) arrays, changed in place
        Probes, pieces, sides, s, and gaps.

    Returns
    -------
    int
        Number of contacts. A probe beyond the ends of its surface, or deeper than its depth limit, has no contact.
    """
    curve, point = np.empty((3, 2)), np.empty(2)
    axes = turned_planar(poses)
    controls = control_points_planar(poses, axes, owners, stations)
    chords = chord.chords_of_planar(controls, stations)
    clearance, depth_limit, no_share = limits
    found_probe, found_piece, found_side, found_s, found_gap = found
    count = 0
    for k in range(probes.shape[0]):
        i = probes[k]
        if window[i, 0] >= window[i, 1]:
            continue
        point_planar(poses, axes, probe_body[i], probe_x[i], point)
        piece, nearest, bound = -1, np.inf, 0.0
        for j in range(window[i, 0], window[i, 1]):
            distance = chord.chord_distance(chords[j], point)
            bound = max(bound, chords[j, 5])
            if distance < nearest:
                piece, nearest = j, distance
        distance = np.sqrt(nearest)
        if distance > max(clearance[i] + below, depth_limit[i]) + bound:
            continue
        # gap larger than the bound: no contact
        if distance > max(clearance[i] + below, 0.0) + bound and side[i] * chord.over_chord(chords[piece], point) >= 0.0:
            continue
        px, pz = point[0], point[1]
        at = chord.along_chord(chords[piece], point)
        piece, at = _closest(px, pz, piece, window[i, 0], window[i, 1], at, controls, stations, EXACT, curve)
        if at < stations[piece, 4] - 1e-12 or at > stations[piece, 5] + 1e-12:
            continue
        if no_share[i] >= 0.0 and inside_of_end(at, stations[piece])[0] <= no_share[i]:
            continue
        length = np.sqrt(curve[1, 0] ** 2 + curve[1, 1] ** 2)
        height = (curve[1, 0] * (pz - curve[0, 1]) - curve[1, 1] * (px - curve[0, 0])) / length
        facing = side[i]
        if facing == 0.0:
            facing = 1.0 if height >= 0.0 else -1.0
        gap = facing * height - clearance[i]
        over, radius = overshoot(at, stations[piece], length, straight[i], clearance[i])
        if over != 0.0:
            gap = np.hypot(over, gap + radius) - radius
        if gap < below and gap > -depth_limit[i]:
            found_probe[count] = i
            found_piece[count] = piece
            found_side[count] = facing
            found_s[count] = at
            found_gap[count] = gap
            count += 1
    return count


@kernel
def heights_planar(
    poses: np.ndarray,
    probe_body: np.ndarray,
    probe_x: np.ndarray,
    straight: np.ndarray,
    depth_limit: np.ndarray,
    first_piece: np.ndarray,
    last_piece: np.ndarray,
    owners: np.ndarray,
    stations: np.ndarray,
    reach: np.ndarray,
    nearest: np.ndarray,
    height: np.ndarray,
) -> None:
    """Heights (n,) of all probes over their surfaces, m, along the normal (-z', x') of the curve.

    The height is nan beyond the ends and tips, and farther from all pieces than `reach` (n,), m. `nearest` (n,), changed
    in place, holds the piece where each search starts and then the nearest piece. If the chord alone determines the side and
    whether the depth limit is exceeded, the height over the chord is returned.
    """
    curve, point = np.empty((3, 2)), np.empty(2)
    axes = turned_planar(poses)
    controls = control_points_planar(poses, axes, owners, stations)
    chords = chord.chords_of_planar(controls, stations)
    lower, upper = chord.chord_boxes(chords)
    tree = fit_tree(lower, upper)
    bulge = chord.largest_bulge(chords, stations)
    for i in range(probe_body.shape[0]):
        first, last = first_piece[i], last_piece[i]
        height[i] = np.nan
        if first >= last:
            nearest[i] = -1
            continue
        point_planar(poses, axes, probe_body[i], probe_x[i], point)
        nearest[i], square = nearest_of_few(point, first, last, chords, tree, nearest[i], reach[i] * reach[i])
        if nearest[i] < 0:
            continue
        distance = np.sqrt(square)
        place = known_place(chord.along_line(chords[nearest[i]], point), owners[nearest[i]], stations[nearest[i]])
        if place < 0:
            continue
        if place > 0 and distance > bulge and abs(distance - depth_limit[i]) > bulge:
            height[i] = distance if chord.over_chord(chords[nearest[i]], point) >= 0.0 else -distance
            continue
        px, pz = point[0], point[1]
        at = chord.along_chord(chords[nearest[i]], point)
        piece, at = _closest(px, pz, nearest[i], first, last, at, controls, stations, ROUGH, curve)
        on_it = stations[piece, 4] - 1e-12 <= at <= stations[piece, 5] + 1e-12
        if on_it and not beyond_end(at, straight[i]):
            length = np.sqrt(curve[1, 0] ** 2 + curve[1, 1] ** 2)
            height[i] = (curve[1, 0] * (pz - curve[0, 1]) - curve[1, 1] * (px - curve[0, 0])) / length
