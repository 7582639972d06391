"""Kernels of contacts of panels in segments for a compiled model (`ArrayModel`); see
`fsm.model.contact.surfaces.surface_contacts`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.search.box_tree import fit_tree, window_pieces
from fsm.interactions.search.chord import chord_boxes, chords_planar, chords_spatial
from fsm.interactions.search.displacement_bound import furthest_motion
from fsm.interactions.surfaces.closest_planar import find_contacts_planar, heights_planar, probe_points_planar
from fsm.interactions.surfaces.closest_spatial import find_contacts_spatial, heights_spatial, probe_points_spatial
from fsm.interactions.surfaces.end_taper import tapered_planar, tapered_spatial
from fsm.interactions.surfaces.gap_planar import tangent_gap_planar, write_gap_planar
from fsm.interactions.surfaces.gap_spatial import write_gap_spatial
from fsm.interactions.surfaces.gap_spatial_tangent import tangent_gap_spatial
from fsm.interactions.surfaces.probe_sides import over_ends, passed_through, probe_sides, round_tips, turned_sides
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import find_slot
from fsm.kernels.tables import Floats1, Floats2, Integers1, Integers2, follows
from fsm.model.bodies import contact_arrays as state
from fsm.model.bodies.contact_arrays import ContactArrays, GeometryKernels, forces_of, index_of, must_renew
from fsm.model.contact.array_contact_state import equal_poses
from fsm.solve.stepping.vectors import copy_into


class SurfaceArrays(NamedTuple):
    """Arrays of surfaces, after `ContactArrays`; see `Probes`, `Surfaces` and `Corners`.

    Attributes
    ----------
    side : (n,) array
        Present sides.
    no_share, tips, reach : (n,), (n_pieces,), (n,) arrays, see `SurfaceContacts`
    nearest, nearest_of_all, window : (n,), (n,), (n, 2) int arrays
    near : (n,) int array
        Probes with pieces in their windows, in the first `NEAR` rows.
    height, height_at : heights (n,) of all probes, m, and the poses of these heights, see `HEIGHTS`
    found_piece, found_side, found_at : pieces and sides of the contacts of the last search, and positions of the contacts on
    the pieces
    """

    body: Integers1
    place: Floats2
    straight: Floats1
    inset: Floats1
    clearance: Floats1
    depth_limit: Floats1
    cell: Floats2
    first_piece: Integers1
    last_piece: Integers1
    side: Floats1
    owners: Integers2
    stations: Floats2
    half_width: Floats1
    no_share: Floats1
    tips: Floats1
    reach: Floats1
    twin: Integers1
    across: Integers2
    inside: Floats2
    inside_across: Floats2
    nearest: Integers1
    nearest_of_all: Integers1
    window: Integers2
    near: Integers1
    height: Floats1
    height_at: Floats2
    found_piece: Integers1
    found_side: Floats1
    found_at: Floats2


surfaces_of = follows(SurfaceArrays, ContactArrays)
"""Arrays of the surfaces of a table, in kernels."""
TAPERS, NEAR, HEIGHTS = state.OWN_STATE, state.OWN_STATE + 1, state.OWN_STATE + 2
"""Indices of `ContactArrays.state`: 1 if shares are tapered; number of probes in `near`; 1 if the heights hold."""


# broad phase ------------------------------------------------------------------------------------------------------------


@kernel
def _set_windows(g: ContactArrays, poses: np.ndarray, points: np.ndarray, chords: np.ndarray, dimension: int) -> None:
    """Write the pieces within reach of each probe."""
    own = surfaces_of(g)
    tips, reach, bulge = own.tips, own.reach, -np.inf
    # sum of the distance of pieces from their chords and the length of the tips beyond the ends
    for j in range(chords.shape[0]):
        bulge = max(bulge, chords[j, 2 * dimension + 1] - tips[j] / np.sqrt(chords[j, 2 * dimension]))
    low, high = chord_boxes(chords)
    window = own.window
    apart = 2.0 * state.RENEWAL * g.numbers[state.MARGIN]
    window_pieces(
        points, own.first_piece, own.last_piece, chords, fit_tree(low, high), reach + bulge,
        2.0 * (apart + bulge), own.nearest, window,
    )  # fmt: skip
    near, count = own.near, 0
    for i in range(window.shape[0]):
        if window[i, 0] < window[i, 1]:
            near[count] = i
            count += 1
    copy_into(poses, g.reference)
    g.state[NEAR], g.state[HEIGHTS], g.state[state.REFERRED] = count, 0, 1


@kernel
def _renew_planar(g: ContactArrays, poses: np.ndarray) -> int:
    own = surfaces_of(g)
    if not must_renew(g, poses):
        return 0
    points = probe_points_planar(poses, own.body, own.place.reshape(-1))
    _set_windows(g, poses, points, chords_planar(poses, own.owners, own.stations), 2)
    return 1


@kernel
def _renew_spatial(g: ContactArrays, poses: np.ndarray) -> int:
    own = surfaces_of(g)
    if not must_renew(g, poses):
        return 0
    points = probe_points_spatial(poses, own.body, own.place)
    chords = chords_spatial(poses, own.owners, own.stations, own.half_width)
    _set_windows(g, poses, points, chords, 3)
    return 1


# contacts ---------------------------------------------------------------------------------------------------------------


@kernel
def _find_planar(g: ContactArrays, poses: np.ndarray, below: float) -> int:
    return _search_planar(g, poses, surfaces_of(g).near[: g.state[NEAR]], below)


@kernel
def _search_planar(g: ContactArrays, poses: np.ndarray, probes: np.ndarray, below: float) -> int:
    own = surfaces_of(g)
    return int(find_contacts_planar(
        poses, own.body, own.place.reshape(-1), own.side, own.straight,
        (own.clearance, own.depth_limit, own.no_share), own.window,
        own.owners, own.stations, probes, below,
        (g.slot, own.found_piece, own.found_side, own.found_at.reshape(-1),
         g.gap),
    ))  # fmt: skip


@kernel
def _find_spatial(g: ContactArrays, poses: np.ndarray, below: float) -> int:
    return _search_spatial(g, poses, surfaces_of(g).near[: g.state[NEAR]], below)


@kernel
def _search_spatial(g: ContactArrays, poses: np.ndarray, probes: np.ndarray, below: float) -> int:
    own = surfaces_of(g)
    return int(find_contacts_spatial(
        poses, own.body, own.place, own.side, own.straight,
        (own.clearance, own.depth_limit, own.no_share), own.window,
        own.owners, own.stations, own.half_width, probes, below,
        (g.slot, own.found_piece, own.found_side, own.found_at,
         g.gap),
    ))  # fmt: skip


@kernel
def _measure_planar(g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    own = surfaces_of(g)
    write_gap_planar(
        poses, rates,
        (g.slot[:count], own.found_piece, own.found_side, own.found_at.reshape(-1)),
        own.body, own.place.reshape(-1), own.straight, own.clearance,
        own.inset, own.owners, own.stations, g.bodies, g.rate,
        g.gradient,
    )  # fmt: skip


@kernel
def _measure_spatial(g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    own = surfaces_of(g)
    write_gap_spatial(
        poses, rates,
        (g.slot[:count], own.found_piece, own.found_side, own.found_at),
        own.body, own.place, own.straight, own.clearance,
        own.inset, own.owners, own.stations, g.bodies, g.rate,
        g.gradient,
    )  # fmt: skip


@kernel
def _keep_rows(g: ContactArrays, rows: np.ndarray) -> None:
    own = surfaces_of(g)
    piece, side, at = own.found_piece, own.found_side, own.found_at
    for i in range(rows.shape[0]):
        piece[i], side[i] = piece[rows[i]], side[rows[i]]
        for c in range(at.shape[1]):
            at[i, c] = at[rows[i], c]


@kernel
def _tapered_planar(
    g: ContactArrays, poses: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    own = surfaces_of(g)
    slot = g.slot
    # these are views of other arrays, because the allocation of new arrays takes time
    if g.state[TAPERS] == 0:
        return slot[:0], own.side[:0], g.rate[:0], g.gradient[:0]
    found: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] = tapered_planar(
        poses, g.bodies, count, slot, own.found_piece, own.found_at.reshape(-1),
        own.place.reshape(-1), own.cell, own.stations,
    )  # fmt: skip
    return found


@kernel
def _tapered_spatial(
    g: ContactArrays, poses: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    own = surfaces_of(g)
    slot = g.slot
    # these are views of other arrays, because the allocation of new arrays takes time
    if g.state[TAPERS] == 0:
        return slot[:0], own.side[:0], g.rate[:0], g.gradient[:0]
    found: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] = tapered_spatial(
        poses, g.bodies, count, slot, own.found_piece, own.found_at,
        own.place, own.cell, own.stations,
    )  # fmt: skip
    return found


@kernel
def _check_pattern(g: ContactArrays, count: int) -> None:
    """Mark a pattern that lacks a block of the contacts."""
    dof, indptr, indices = index_of(g)
    bodies = g.bodies
    for i in range(count):
        for j in range(bodies.shape[1]):
            for k in range(j):
                row, column = dof[bodies[i, j]], dof[bodies[i, k]]
                if row >= 0 and column >= 0 and find_slot(indptr, indices, row, column) < 0:
                    g.state[state.LACKS] = 1


@kernel
def _tangent_planar(
    g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    own = surfaces_of(g)
    _check_pattern(g, count)
    tangent_gap_planar(
        poses, rates, g.bodies[:count], g.gradient[:count],
        (g.slot[:count], own.found_piece, own.found_side, own.found_at.reshape(-1)),
        own.place.reshape(-1), own.straight, own.clearance, own.inset,
        own.stations, forces_of(g, 0, count), index_of(g), stiffness, damping,
    )  # fmt: skip


@kernel
def _tangent_spatial(
    g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    own = surfaces_of(g)
    _check_pattern(g, count)
    tangent_gap_spatial(
        poses, rates, g.bodies[:count], g.gradient[:count],
        (g.slot[:count], own.found_piece, own.found_side, own.found_at),
        own.place, own.straight, own.clearance, own.inset,
        own.stations, forces_of(g, 0, count), index_of(g), stiffness, damping,
    )  # fmt: skip


# sides of probes --------------------------------------------------------------------------------------------------------


@kernel
def _pieces(g: ContactArrays, within: bool) -> tuple[np.ndarray, np.ndarray]:
    """First and last pieces of all probes: the pieces of their windows if `within` is true, else the pieces of the whole
    surfaces.
    """
    own = surfaces_of(g)
    if not within:
        return own.first_piece, own.last_piece
    window = own.window
    first, last = np.empty(window.shape[0], dtype=np.int64), np.empty(window.shape[0], dtype=np.int64)
    for i in range(window.shape[0]):
        first[i], last[i] = window[i, 0], window[i, 1]
    return first, last


@kernel
def _known_heights(g: ContactArrays, poses: np.ndarray, farther: float) -> bool:
    """Whether the heights of the last search hold for these poses and the reach of the probes."""
    return bool(farther == 0.0 and g.state[HEIGHTS] == 1 and equal_poses(poses, surfaces_of(g).height_at))


@kernel
def _keep_heights(g: ContactArrays, poses: np.ndarray, farther: float) -> None:
    """Store the poses of the heights; heights beyond the reach of the probes are not used again."""
    copy_into(poses, surfaces_of(g).height_at)
    g.state[HEIGHTS] = 1 if farther == 0.0 else 0


@kernel
def probe_heights_planar(g: ContactArrays, poses: np.ndarray, farther: float) -> np.ndarray:
    """Heights (n,) of all probes in the plane, within their reach plus a distance, m; nan beyond."""
    own = surfaces_of(g)
    if not _known_heights(g, poses, farther):
        first, last = _pieces(g, farther == 0.0)
        heights_planar(
            poses, own.body, own.place.reshape(-1), own.straight, own.depth_limit, first, last,
            own.owners, own.stations, own.reach + farther, own.nearest_of_all,
            own.height,
        )  # fmt: skip
        _keep_heights(g, poses, farther)
    return own.height


@kernel
def probe_heights_spatial(g: ContactArrays, poses: np.ndarray, farther: float) -> np.ndarray:
    """Heights (n,) of all probes in space, within their reach plus a distance, m; nan beyond."""
    own = surfaces_of(g)
    if not _known_heights(g, poses, farther):
        first, last = _pieces(g, farther == 0.0)
        heights_spatial(
            poses, own.body, own.place, own.straight, own.depth_limit, first, last,
            own.owners, own.stations, own.half_width, own.reach + farther,
            own.nearest_of_all, own.height,
        )  # fmt: skip
        _keep_heights(g, poses, farther)
    return own.height


@kernel
def _behind(g: ContactArrays, height: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Probes near the tip of a surface that have moved to the other side of the surface."""
    own = surfaces_of(g)
    side, straight = own.side, own.straight
    out, count = np.empty(near.shape[0], dtype=np.int64), 0
    for k in range(near.shape[0]):
        if side[near[k]] * height[near[k]] < 0.0 and straight[near[k]] >= 0.0:
            out[count] = near[k]
            count += 1
    return out[:count]


@kernel
def _ends(g: ContactArrays, near: np.ndarray) -> np.ndarray:
    """End of the surface at which each probe is: 0 for the start, 1 for the end."""
    own = surfaces_of(g)
    nearest, last, out = own.nearest_of_all, own.last_piece, np.zeros(near.shape[0], dtype=np.int64)
    for k in range(near.shape[0]):
        if nearest[near[k]] == last[near[k]] - 1:
            out[k] = 1
    return out


@kernel
def _turn(g: ContactArrays, height: np.ndarray, near: np.ndarray, behind: np.ndarray, count: int) -> None:
    """Write the sides of all probes after a step, with the contacts that have been found if any probe is `behind`."""
    own = surfaces_of(g)
    present, limit = own.side, own.depth_limit
    side = probe_sides(present, height, limit)
    if behind.shape[0] > 0:
        g.state[state.FOUND] = -1
        round_it = _rounded(g, count, height)
        for k in range(behind.shape[0]):
            if round_it[behind[k]]:
                side[behind[k]] = -present[behind[k]]
    corners = own.twin, own.across, own.inside, own.inside_across
    turned = turned_sides(corners, present, side, height, limit, near, _ends(g, near))
    for k in range(present.shape[0]):
        if present[k] != turned[k]:  # the contacts that were found with the old sides are no longer valid
            g.state[state.FOUND] = -1
        present[k] = turned[k]


@kernel
def _near_ends(g: ContactArrays, height: np.ndarray) -> np.ndarray:
    own = surfaces_of(g)
    found: np.ndarray = over_ends(
        own.side, height, own.depth_limit, own.nearest_of_all, own.first_piece,
        own.last_piece,
    )  # fmt: skip
    return found


@kernel
def _rounded(g: ContactArrays, count: int, height: np.ndarray) -> np.ndarray:
    own, place = surfaces_of(g), np.empty(count)
    for k in range(count):
        place[k] = own.found_at[k, 0]
    found: np.ndarray = round_tips(
        g.slot[:count], g.gap[:count], own.found_piece, own.found_side, place, own.stations, own.straight, own.clearance,
        height,
    )  # fmt: skip
    return found


@kernel
def _settle_planar(g: ContactArrays, poses: np.ndarray, young: np.ndarray, new: bool) -> None:
    if new:
        return
    height = probe_heights_planar(g, poses, 0.0)
    near = _near_ends(g, height)
    behind, count = _behind(g, height, near), 0
    if behind.shape[0] > 0:
        count = _search_planar(g, poses, behind, g.numbers[state.MARGIN])
    _turn(g, height, near, behind, count)


@kernel
def _settle_spatial(g: ContactArrays, poses: np.ndarray, young: np.ndarray, new: bool) -> None:
    if new:
        return
    height = probe_heights_spatial(g, poses, 0.0)
    near = _near_ends(g, height)
    behind, count = _behind(g, height, near), 0
    if behind.shape[0] > 0:
        count = _search_spatial(g, poses, behind, g.numbers[state.MARGIN])
    _turn(g, height, near, behind, count)


@kernel
def _motion(g: ContactArrays, poses: np.ndarray) -> tuple[float, float]:
    """Upper bound of the displacement since the last accepted state, m, and the depth that such a displacement can cause."""
    if g.state[state.STARTED] == 0:
        return 0.0, np.inf
    margin = g.numbers[state.MARGIN]
    motion = furthest_motion(g.committed, poses, g.moving, g.radii)
    deepest = 2.0 * motion + 0.5 * margin  # heights have an error of a fraction of a segment
    return (0.0 if motion <= state.RENEWAL * margin else motion), deepest  # only probes within reach have a side


@kernel
def _first_pair(g: ContactArrays, probes: np.ndarray) -> int:
    """Smallest number of the pairs of probes; -1 without probes."""
    found = -1
    for k in range(probes.shape[0]):
        of = g.pair[probes[k]]
        found = of if found < 0 else min(found, of)
    return int(found)


@kernel
def _passed_planar(g: ContactArrays, poses: np.ndarray) -> int:
    own = surfaces_of(g)
    motion, deepest = _motion(g, poses)
    before = np.zeros(0)
    if motion > 0.5 * g.numbers[state.MARGIN]:  # a probe outside the reach had no side, and may have passed through
        before = probe_heights_planar(g, g.committed, 2.0 * motion).copy()
    height = probe_heights_planar(g, poses, 2.0 * motion)
    return _first_pair(g, passed_through(own.side, own.depth_limit, height, before, deepest))


@kernel
def _passed_spatial(g: ContactArrays, poses: np.ndarray) -> int:
    own = surfaces_of(g)
    motion, deepest = _motion(g, poses)
    before = np.zeros(0)
    if motion > 0.5 * g.numbers[state.MARGIN]:
        before = probe_heights_spatial(g, g.committed, 2.0 * motion).copy()
    height = probe_heights_spatial(g, poses, 2.0 * motion)
    return _first_pair(g, passed_through(own.side, own.depth_limit, height, before, deepest))


PLANAR_SURFACES = GeometryKernels(
    _renew_planar, _find_planar, _measure_planar, _keep_rows, _tapered_planar, _tangent_planar, _passed_planar,
    _settle_planar,
)
SPATIAL_SURFACES = GeometryKernels(
    _renew_spatial, _find_spatial, _measure_spatial, _keep_rows, _tapered_spatial, _tangent_spatial, _passed_spatial,
    _settle_spatial,
)
