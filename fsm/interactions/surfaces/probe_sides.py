"""Sides of surfaces on which probes lie, and probes that have passed through; see
`fsm.model.contact.surfaces.surface_contacts`.

Heights (n,) are those of `heights_planar`: nan for probes that are not over their surface.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

_BEHIND = 0.9
"""Depth relative to the depth limit above which a point near a corner has moved round the corner."""
_ROUND = 1.5
"""Distance below the top of a rounded tip, relative to its radius, at which a touching point is released."""


@kernel(inline=True)
def _side_of(height: float) -> float:
    return 1.0 if height >= 0.0 else -1.0


@kernel
def _is_over(side: float, height: float, limit: float) -> bool:
    return bool(np.isfinite(height) and side * height > -limit)


@kernel
def probe_sides(side: np.ndarray, height: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """Sides (n,) after a step: probes over their surface keep their side, new probes get their present side, and all others
    get 0.
    """
    out = np.zeros(side.shape[0])
    for i in range(side.shape[0]):
        if _is_over(side[i], height[i], limit[i]):
            out[i] = _side_of(height[i]) if side[i] == 0.0 else side[i]
    return out


@kernel
def over_ends(
    side: np.ndarray, height: np.ndarray, limit: np.ndarray, nearest: np.ndarray, first: np.ndarray, last: np.ndarray
) -> np.ndarray:
    """Probes (m,) over the first or the last piece of a surface."""
    out, count = np.empty(side.shape[0], dtype=np.int64), 0
    for i in range(side.shape[0]):
        at_end = nearest[i] == first[i] or nearest[i] == last[i] - 1
        if at_end and _is_over(side[i], height[i], limit[i]):
            out[count] = i
            count += 1
    return out[:count]


@kernel
def turned_sides(
    corners: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray], before: np.ndarray, side: np.ndarray,
    height: np.ndarray, limit: np.ndarray, near: np.ndarray, at_end: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Sides (n,) of all probes, corrected near corners; see `fsm.model.contact.surfaces.panel_points`.

    Parameters
    ----------
    corners : arrays of `fsm.model.contact.surfaces.panel_points.Corners`
    before : (n,) array
        Sides at the last step; 0 for a probe that was not over its surface.
    side : (n,) array
        Sides so far; for new probes the present sides.
    height, limit : (n,) arrays, m
        Height of each probe over its surface, and depth limit. The depth limit scales the depth on the wrong side above
        which a point has moved round the corner.
    near : (m,) int array
        Probes over the end piece of a surface.
    at_end : (m,) int array
        Their ends.
    """
    twin, across, inside, inside_across = corners
    found, out = side.copy(), np.empty(side.shape[0])
    # three passes, because each correction replaces the one before it
    for case in range(3):
        for k in range(near.shape[0]):
            i, end = near[k], at_end[k]
            other = across[i, end]
            if other < 0:
                continue
            into, into_across, deep = inside[i, end], inside_across[i, end], _BEHIND * limit[i]
            depth, depth_across = height[i] * into, height[other] * into_across
            outside = side[other] == -into_across
            if case == 0 and outside and before[i] == 0.0 and depth > 0.0 and depth_across > 0.0:
                # the point has contact with the face in which it is less deep; the other face has no side until both depths
                # are equal
                found[i] = -into if depth <= depth_across else 0.0
            if case == 1 and outside and side[i] == -into and depth > deep and depth_across < 0.0:
                found[i] = into
            if case == 2 and side[other] != into_across and side[i] == into and depth < -deep:
                found[i] = -into
    for i in range(side.shape[0]):
        out[i] = found[twin[i]]
    return out


@kernel
def round_tips(
    slot: np.ndarray, gap: np.ndarray, piece: np.ndarray, facing: np.ndarray, place: np.ndarray, stations: np.ndarray,
    straight: np.ndarray, clearance: np.ndarray, height: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Mask (n,) of probes that have slid round the rounded tip of a surface and are free on its other side.

    They are beyond the middle of the disc of the tip and do not touch its other side. A probe that still touches its
    own side keeps this side until it is well beyond the middle.

    Parameters
    ----------
    slot, gap, piece, facing, place : (m,) arrays
        Probes that are near, and their gaps, pieces, sides and coordinates s.
    """
    out = np.zeros(straight.shape[0], dtype=np.bool_)
    for k in range(slot.shape[0]):
        i, row, s = slot[k], stations[piece[k]], place[k]
        if straight[i] < 0.0:
            continue
        length = row[3] - row[0]  # end pieces are straight
        start, end = row[4] * length, (row[5] - 1.0) * length
        beyond = 0.0
        if start < 0.0:
            beyond += min(s * length - straight[i] * start, 0.0)
        if end > 0.0:
            beyond += max((s - 1.0) * length - straight[i] * end, 0.0)
        radius = 0.5 * (-start if start < 0.0 else end)
        deep = facing[k] * height[i] - clearance[i]
        passed = deep < (-1.0 if gap[k] >= 0.0 else -_ROUND) * radius
        other = np.hypot(beyond, -deep - 2.0 * clearance[i] + radius) - radius
        out[i] = out[i] or (beyond != 0.0 and passed and other >= 0.0)
    return out


@kernel
def passed_through(
    side: np.ndarray, limit: np.ndarray, height: np.ndarray, before: np.ndarray, deepest: float
) -> np.ndarray:
    """Indices (m,) of the probes whose depth exceeds their limit by at most `deepest`, m.

    `before` contains the heights at the last accepted state. If it is empty, probes without a side in that state are
    included too.
    """
    out, count = np.empty(side.shape[0], dtype=np.int64), 0
    for i in range(side.shape[0]):
        own, most = side[i], limit[i]
        if before.shape[0] > 0 and own == 0.0 and np.isfinite(before[i]):
            own, most = _side_of(before[i]), 0.0  # a probe without a side had no contact force
        depth = -own * height[i]
        if depth >= most and depth <= most + deepest:
            out[count] = i
            count += 1
    return out[:count]
