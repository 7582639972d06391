"""Kernels of contacts of panels in segments for a compiled model (`ArrayModel`); see `fsm.segments.surface_contacts`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.box_tree import fit_tree, window_pieces
from fsm.interactions.chord import chord_boxes, chords_planar, chords_spatial
from fsm.interactions.closest_planar import find_contacts_planar, heights_planar, probe_points_planar
from fsm.interactions.closest_spatial import find_contacts_spatial, heights_spatial, probe_points_spatial
from fsm.interactions.contact_body_pairs import coupled_bodies
from fsm.interactions.displacement_bound import furthest_motion
from fsm.interactions.end_taper import tapered_planar, tapered_spatial
from fsm.interactions.gap_planar import tangent_gap_planar, write_gap_planar
from fsm.interactions.gap_spatial import write_gap_spatial
from fsm.interactions.gap_spatial_tangent import tangent_gap_spatial
from fsm.interactions.probe_sides import over_ends, passed_through, probe_sides, round_tips, turned_sides
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import find_slot
from fsm.segments.contact_arrays import (
    BODIES,
    COMMITTED,
    FOUND,
    GAP,
    GRADIENT,
    LACKS,
    MARGIN,
    MOVING,
    NUMBERS,
    OWN,
    OWN_STATE,
    RADII,
    RATE,
    REFERENCE,
    REFERRED,
    RENEWAL,
    SLOT,
    STARTED,
    STATE,
    GeometryKernels,
    forces_of,
    index_of,
    must_renew,
)
from fsm.stepping.vectors import copy_into

__all__ = ["PLANAR_SURFACES", "SPATIAL_SURFACES", "TAPERS", "SurfaceArrays"]


class SurfaceArrays(NamedTuple):
    """Arrays of surfaces, after `ContactArrays`; see `Probes`, `Surfaces` and `Corners`.

    Attributes
    ----------
    side : (n,) array
        Present sides.
    no_share, tips, reach : (n,), (n_pieces,), (n,) arrays, see `SurfaceContacts`
    nearest, nearest_of_all, window : (n,), (n,), (n, 2) int arrays
    found_piece, found_side, found_at : pieces and sides of the contacts of the last search, and positions of the contacts on
    the pieces
    """

    body: np.ndarray
    place: np.ndarray
    straight: np.ndarray
    inset: np.ndarray
    clearance: np.ndarray
    depth_limit: np.ndarray
    cell: np.ndarray
    first_piece: np.ndarray
    last_piece: np.ndarray
    side: np.ndarray
    owners: np.ndarray
    stations: np.ndarray
    half_width: np.ndarray
    no_share: np.ndarray
    tips: np.ndarray
    reach: np.ndarray
    twin: np.ndarray
    across: np.ndarray
    inside: np.ndarray
    inside_across: np.ndarray
    nearest: np.ndarray
    nearest_of_all: np.ndarray
    window: np.ndarray
    found_piece: np.ndarray
    found_side: np.ndarray
    found_at: np.ndarray


(
    _BODY, _PLACE, _STRAIGHT, _INSET, _CLEARANCE, _LIMIT, _CELL, _FIRST, _LAST, _SIDE, _OWNERS, _STATIONS, _HALF_WIDTH,
    _NO_SHARE, _TIPS, _REACH, _TWIN, _ACROSS, _INSIDE, _INSIDE_ACROSS, _NEAREST, _NEAREST_OF_ALL, _WINDOW, _FOUND_PIECE,
    _FOUND_SIDE, _FOUND_AT,
) = range(OWN, OWN + 26)  # fmt: skip
TAPERS = OWN_STATE
"""Index of `ContactArrays.state`: 1 if shares are tapered."""


# broad phase ------------------------------------------------------------------------------------------------------------


@kernel
def _set_windows(g: np.ndarray, poses: np.ndarray, points: np.ndarray, chords: np.ndarray, dimension: int) -> None:
    """Write the pieces within reach of each probe, and mark whether the pattern lacks one of the pairs of bodies."""
    tips, reach, bulge = floats_1d(g, _TIPS), floats_1d(g, _REACH), -np.inf
    # sum of the distance of pieces from their chords and the length of the tips beyond the ends
    for j in range(chords.shape[0]):
        bulge = max(bulge, chords[j, 2 * dimension + 1] - tips[j] / np.sqrt(chords[j, 2 * dimension]))
    low, high = chord_boxes(chords)
    window, body, owners = integers_2d(g, _WINDOW), integers_1d(g, _BODY), integers_2d(g, _OWNERS)
    apart = 2.0 * RENEWAL * floats_1d(g, NUMBERS)[MARGIN]
    window_pieces(
        points, integers_1d(g, _FIRST), integers_1d(g, _LAST), chords, fit_tree(low, high), reach + bulge,
        2.0 * (apart + bulge), integers_1d(g, _NEAREST), window,
    )  # fmt: skip
    dof, indptr, indices = index_of(g)
    state, pairs = integers_1d(g, STATE), coupled_bodies(body, window, owners, poses.shape[0])
    for k in range(pairs.shape[0]):
        row, column = dof[pairs[k, 0]], dof[pairs[k, 1]]
        if row >= 0 and column >= 0 and find_slot(indptr, indices, row, column) < 0:
            state[LACKS] = 1
    copy_into(poses, floats_2d(g, REFERENCE))
    state[REFERRED] = 1


@kernel
def _renew_planar(g: np.ndarray, poses: np.ndarray) -> int:
    if not must_renew(g, poses):
        return 0
    points = probe_points_planar(poses, integers_1d(g, _BODY), floats_1d(g, _PLACE))
    _set_windows(g, poses, points, chords_planar(poses, integers_2d(g, _OWNERS), floats_2d(g, _STATIONS)), 2)
    return 1


@kernel
def _renew_spatial(g: np.ndarray, poses: np.ndarray) -> int:
    if not must_renew(g, poses):
        return 0
    points = probe_points_spatial(poses, integers_1d(g, _BODY), floats_2d(g, _PLACE))
    chords = chords_spatial(poses, integers_2d(g, _OWNERS), floats_2d(g, _STATIONS), floats_1d(g, _HALF_WIDTH))
    _set_windows(g, poses, points, chords, 3)
    return 1


# contacts ---------------------------------------------------------------------------------------------------------------


@kernel
def _find_planar(g: np.ndarray, poses: np.ndarray, below: float) -> int:
    return int(find_contacts_planar(
        poses, integers_1d(g, _BODY), floats_1d(g, _PLACE), floats_1d(g, _SIDE), floats_1d(g, _STRAIGHT),
        floats_1d(g, _CLEARANCE), floats_1d(g, _LIMIT), floats_1d(g, _NO_SHARE), integers_2d(g, _WINDOW),
        integers_2d(g, _OWNERS), floats_2d(g, _STATIONS), below,
        (integers_1d(g, SLOT), integers_1d(g, _FOUND_PIECE), floats_1d(g, _FOUND_SIDE), floats_1d(g, _FOUND_AT),
         floats_1d(g, GAP)),
    ))  # fmt: skip


@kernel
def _find_spatial(g: np.ndarray, poses: np.ndarray, below: float) -> int:
    return int(find_contacts_spatial(
        poses, integers_1d(g, _BODY), floats_2d(g, _PLACE), floats_1d(g, _SIDE), floats_1d(g, _STRAIGHT),
        floats_1d(g, _CLEARANCE), floats_1d(g, _LIMIT), floats_1d(g, _NO_SHARE), integers_2d(g, _WINDOW),
        integers_2d(g, _OWNERS), floats_2d(g, _STATIONS), floats_1d(g, _HALF_WIDTH), below,
        (integers_1d(g, SLOT), integers_1d(g, _FOUND_PIECE), floats_1d(g, _FOUND_SIDE), floats_2d(g, _FOUND_AT),
         floats_1d(g, GAP)),
    ))  # fmt: skip


@kernel
def _measure_planar(g: np.ndarray, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    write_gap_planar(
        poses, rates,
        (integers_1d(g, SLOT)[:count], integers_1d(g, _FOUND_PIECE), floats_1d(g, _FOUND_SIDE), floats_1d(g, _FOUND_AT)),
        integers_1d(g, _BODY), floats_1d(g, _PLACE), floats_1d(g, _STRAIGHT), floats_1d(g, _CLEARANCE),
        floats_1d(g, _INSET), integers_2d(g, _OWNERS), floats_2d(g, _STATIONS), integers_2d(g, BODIES), floats_2d(g, RATE),
        floats_3d(g, GRADIENT),
    )  # fmt: skip


@kernel
def _measure_spatial(g: np.ndarray, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    write_gap_spatial(
        poses, rates,
        (integers_1d(g, SLOT)[:count], integers_1d(g, _FOUND_PIECE), floats_1d(g, _FOUND_SIDE), floats_2d(g, _FOUND_AT)),
        integers_1d(g, _BODY), floats_2d(g, _PLACE), floats_1d(g, _STRAIGHT), floats_1d(g, _CLEARANCE),
        floats_1d(g, _INSET), integers_2d(g, _OWNERS), floats_2d(g, _STATIONS), integers_2d(g, BODIES), floats_2d(g, RATE),
        floats_3d(g, GRADIENT),
    )  # fmt: skip


@kernel
def _tapered_planar(
    g: np.ndarray, poses: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    slot = integers_1d(g, SLOT)
    # these are views of other arrays, because the allocation of new arrays takes time
    if integers_1d(g, STATE)[TAPERS] == 0:
        return slot[:0], floats_1d(g, _SIDE)[:0], floats_2d(g, RATE)[:0], floats_3d(g, GRADIENT)[:0]
    found: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] = tapered_planar(
        poses, integers_2d(g, BODIES), count, slot, integers_1d(g, _FOUND_PIECE), floats_1d(g, _FOUND_AT),
        floats_1d(g, _PLACE), floats_2d(g, _CELL), floats_2d(g, _STATIONS),
    )  # fmt: skip
    return found


@kernel
def _tapered_spatial(
    g: np.ndarray, poses: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    slot = integers_1d(g, SLOT)
    # these are views of other arrays, because the allocation of new arrays takes time
    if integers_1d(g, STATE)[TAPERS] == 0:
        return slot[:0], floats_1d(g, _SIDE)[:0], floats_2d(g, RATE)[:0], floats_3d(g, GRADIENT)[:0]
    found: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] = tapered_spatial(
        poses, integers_2d(g, BODIES), count, slot, integers_1d(g, _FOUND_PIECE), floats_2d(g, _FOUND_AT),
        floats_2d(g, _PLACE), floats_2d(g, _CELL), floats_2d(g, _STATIONS),
    )  # fmt: skip
    return found


@kernel
def _tangent_planar(
    g: np.ndarray, poses: np.ndarray, rates: np.ndarray, count: int, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    tangent_gap_planar(
        poses, rates, integers_2d(g, BODIES)[:count], floats_3d(g, GRADIENT)[:count],
        (integers_1d(g, SLOT)[:count], integers_1d(g, _FOUND_PIECE), floats_1d(g, _FOUND_SIDE), floats_1d(g, _FOUND_AT)),
        floats_1d(g, _PLACE), floats_1d(g, _STRAIGHT), floats_1d(g, _CLEARANCE), floats_1d(g, _INSET),
        floats_2d(g, _STATIONS), forces_of(g, 0, count), index_of(g), stiffness, damping,
    )  # fmt: skip


@kernel
def _tangent_spatial(
    g: np.ndarray, poses: np.ndarray, rates: np.ndarray, count: int, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    tangent_gap_spatial(
        poses, rates, integers_2d(g, BODIES)[:count], floats_3d(g, GRADIENT)[:count],
        (integers_1d(g, SLOT)[:count], integers_1d(g, _FOUND_PIECE), floats_1d(g, _FOUND_SIDE), floats_2d(g, _FOUND_AT)),
        floats_2d(g, _PLACE), floats_1d(g, _STRAIGHT), floats_1d(g, _CLEARANCE), floats_1d(g, _INSET),
        floats_2d(g, _STATIONS), forces_of(g, 0, count), index_of(g), stiffness, damping,
    )  # fmt: skip


# sides of probes --------------------------------------------------------------------------------------------------------


@kernel
def _pieces(g: np.ndarray, within: bool) -> tuple[np.ndarray, np.ndarray]:
    """First and last pieces of all probes: the pieces of their windows if `within` is true, else the pieces of the whole
    surfaces.
    """
    if not within:
        return integers_1d(g, _FIRST), integers_1d(g, _LAST)
    window = integers_2d(g, _WINDOW)
    first, last = np.empty(window.shape[0], dtype=np.int64), np.empty(window.shape[0], dtype=np.int64)
    for i in range(window.shape[0]):
        first[i], last[i] = window[i, 0], window[i, 1]
    return first, last


@kernel
def _heights_planar(g: np.ndarray, poses: np.ndarray, farther: float) -> np.ndarray:
    first, last = _pieces(g, farther == 0.0)
    height = np.empty(first.shape[0])
    heights_planar(
        poses, integers_1d(g, _BODY), floats_1d(g, _PLACE), floats_1d(g, _STRAIGHT), floats_1d(g, _LIMIT), first, last,
        integers_2d(g, _OWNERS), floats_2d(g, _STATIONS), floats_1d(g, _REACH) + farther, integers_1d(g, _NEAREST_OF_ALL),
        height,
    )  # fmt: skip
    return height


@kernel
def _heights_spatial(g: np.ndarray, poses: np.ndarray, farther: float) -> np.ndarray:
    first, last = _pieces(g, farther == 0.0)
    height = np.empty(first.shape[0])
    heights_spatial(
        poses, integers_1d(g, _BODY), floats_2d(g, _PLACE), floats_1d(g, _STRAIGHT), floats_1d(g, _LIMIT), first, last,
        integers_2d(g, _OWNERS), floats_2d(g, _STATIONS), floats_1d(g, _HALF_WIDTH), floats_1d(g, _REACH) + farther,
        integers_1d(g, _NEAREST_OF_ALL), height,
    )  # fmt: skip
    return height


@kernel
def _behind(g: np.ndarray, height: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Probes near the tip of a surface that have moved to the other side of the surface."""
    side, straight = floats_1d(g, _SIDE), floats_1d(g, _STRAIGHT)
    out, count = np.empty(near.shape[0], dtype=np.int64), 0
    for k in range(near.shape[0]):
        if side[near[k]] * height[near[k]] < 0.0 and straight[near[k]] >= 0.0:
            out[count] = near[k]
            count += 1
    return out[:count]


@kernel
def _ends(g: np.ndarray, near: np.ndarray) -> np.ndarray:
    """End of the surface at which each probe is: 0 for the start, 1 for the end."""
    nearest, last, out = integers_1d(g, _NEAREST_OF_ALL), integers_1d(g, _LAST), np.zeros(near.shape[0], dtype=np.int64)
    for k in range(near.shape[0]):
        if nearest[near[k]] == last[near[k]] - 1:
            out[k] = 1
    return out


@kernel
def _turn(g: np.ndarray, height: np.ndarray, near: np.ndarray, behind: np.ndarray, round_it: np.ndarray) -> None:
    """Write the sides of all probes after a step."""
    own, limit = floats_1d(g, _SIDE), floats_1d(g, _LIMIT)
    side = probe_sides(own, height, limit)
    for k in range(behind.shape[0]):
        if round_it[behind[k]]:
            side[behind[k]] = -own[behind[k]]
    corners = integers_1d(g, _TWIN), integers_2d(g, _ACROSS), floats_2d(g, _INSIDE), floats_2d(g, _INSIDE_ACROSS)
    turned = turned_sides(corners, own, side, height, limit, near, _ends(g, near))
    for k in range(own.shape[0]):
        if own[k] != turned[k]:  # the contacts that were found with the old sides are no longer valid
            integers_1d(g, STATE)[FOUND] = -1
        own[k] = turned[k]


@kernel
def _near_ends(g: np.ndarray, height: np.ndarray) -> np.ndarray:
    found: np.ndarray = over_ends(
        floats_1d(g, _SIDE), height, floats_1d(g, _LIMIT), integers_1d(g, _NEAREST_OF_ALL), integers_1d(g, _FIRST),
        integers_1d(g, _LAST),
    )  # fmt: skip
    return found


@kernel
def _rounded(g: np.ndarray, count: int, place: np.ndarray, height: np.ndarray) -> np.ndarray:
    slot, gap = integers_1d(g, SLOT)[:count], floats_1d(g, GAP)[:count]
    found: np.ndarray = round_tips(
        slot, gap, integers_1d(g, _FOUND_PIECE), floats_1d(g, _FOUND_SIDE), place, floats_2d(g, _STATIONS),
        floats_1d(g, _STRAIGHT), floats_1d(g, _CLEARANCE), height,
    )  # fmt: skip
    return found


@kernel
def _settle_planar(g: np.ndarray, poses: np.ndarray, young: np.ndarray, new: bool) -> None:
    if new:
        return
    height = _heights_planar(g, poses, 0.0)
    near = _near_ends(g, height)
    behind, round_it = _behind(g, height, near), np.zeros(0, dtype=np.bool_)
    if behind.shape[0] > 0:
        count = _find_planar(g, poses, floats_1d(g, NUMBERS)[MARGIN])
        integers_1d(g, STATE)[FOUND] = -1
        round_it = _rounded(g, count, floats_1d(g, _FOUND_AT), height)
    _turn(g, height, near, behind, round_it)


@kernel
def _settle_spatial(g: np.ndarray, poses: np.ndarray, young: np.ndarray, new: bool) -> None:
    if new:
        return
    height = _heights_spatial(g, poses, 0.0)
    near = _near_ends(g, height)
    behind, round_it = _behind(g, height, near), np.zeros(0, dtype=np.bool_)
    if behind.shape[0] > 0:
        count = _find_spatial(g, poses, floats_1d(g, NUMBERS)[MARGIN])
        integers_1d(g, STATE)[FOUND] = -1
        place, at = np.empty(count), floats_2d(g, _FOUND_AT)
        for k in range(count):
            place[k] = at[k, 0]
        round_it = _rounded(g, count, place, height)
    _turn(g, height, near, behind, round_it)


@kernel
def _motion(g: np.ndarray, poses: np.ndarray) -> tuple[float, float]:
    """Upper bound of the displacement since the last accepted state, m, and the depth that such a displacement can cause."""
    if integers_1d(g, STATE)[STARTED] == 0:
        return 0.0, np.inf
    margin = floats_1d(g, NUMBERS)[MARGIN]
    motion = furthest_motion(floats_2d(g, COMMITTED), poses, integers_1d(g, MOVING), floats_1d(g, RADII))
    deepest = 2.0 * motion + 0.5 * margin  # heights have an error of a fraction of a segment
    return (0.0 if motion <= RENEWAL * margin else motion), deepest  # only probes within reach have a side


@kernel
def _passed_planar(g: np.ndarray, poses: np.ndarray) -> bool:
    motion, deepest = _motion(g, poses)
    before = np.zeros(0)
    if motion > 0.5 * floats_1d(g, NUMBERS)[MARGIN]:  # a probe outside the reach had no side, and may have passed through
        before = _heights_planar(g, floats_2d(g, COMMITTED), 2.0 * motion)
    height = _heights_planar(g, poses, 2.0 * motion)
    return passed_through(floats_1d(g, _SIDE), floats_1d(g, _LIMIT), height, before, deepest).shape[0] > 0


@kernel
def _passed_spatial(g: np.ndarray, poses: np.ndarray) -> bool:
    motion, deepest = _motion(g, poses)
    before = np.zeros(0)
    if motion > 0.5 * floats_1d(g, NUMBERS)[MARGIN]:
        before = _heights_spatial(g, floats_2d(g, COMMITTED), 2.0 * motion)
    height = _heights_spatial(g, poses, 2.0 * motion)
    return passed_through(floats_1d(g, _SIDE), floats_1d(g, _LIMIT), height, before, deepest).shape[0] > 0


PLANAR_SURFACES = GeometryKernels(
    _renew_planar, _find_planar, _measure_planar, _tapered_planar, _tangent_planar, _passed_planar,
    _settle_planar,
)
SPATIAL_SURFACES = GeometryKernels(
    _renew_spatial, _find_spatial, _measure_spatial, _tapered_spatial, _tangent_spatial, _passed_spatial,
    _settle_spatial,
)
