"""The contact surface of a panel: a C1 curve through the middle of every segment (docs/theory.md).

Piece j of a surface of N segments (j = 0 ... N) is a cubic Bezier curve between the middles of segments j-1 and j, whose
inner control points lie on the axes of the two segments, two thirds of the way to the joint. If the joint has no
opening, the curve is the quadratic B-spline whose control points are the joints. The surface stays C1 when the joint's
springs deform, and every control point belongs to one body. At a joint turned by alpha the surface deviates from the
polygon of segments by l alpha/8.

At each end the surface is extended by a tip of `TIP` times its length, which is rounded. At a distance x past the end of the
straight part, the gap g over the line becomes the gap over a disc of radius R tangent to that line,

    sqrt(x^2 + (g + R)^2) - R,     R = half the tip,

The rounding releases a body gradually when it slides off an end. An edge that stands on a face receives a force along the
face's normal. Two creases that meet tip to tip must not slip past each other; panels 3 and 4 of the pulled strip meet in
this way on their mirror plane. Therefore the first half of the tip is straight for the ends of another panel. For all other
points the whole tip is round.

These tips are for panels that share a crease. The scene gives the side of each panel on which the other lies. The ends of
other surfaces have a cap for the ends of panels: R is the clearance and x is measured from the end itself. With h the
height over the middle line, g = sqrt(x^2 + h^2) - clearance, which is the same from both sides and also holds for
frontal contact. For points between the ends of a panel, these surfaces stop at their ends, and the weight of the points
is tapered (`fsm.interactions.surfaces.end_taper`). The ends of two panels of one chain can pass each other. Such ends touch
in the same way as the panels between them, and their weights are tapered over a short distance.

    C(s) = sum_k B_k(s) (r_k + A_k (X_k, 0)),     k = 0 ... 3, the first two on body a, the last two on body b

In space y e2 is added to every control point, which gives a ruled surface S(s, y).
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

TIP = 0.025
"""Extension of a surface beyond its ends, as a fraction of its length."""

STRAIGHT = 0.5
"""Straight fraction of a tip for the ends of another panel."""
CAP, BARE = -1.0, -2.0
"""Values in place of `STRAIGHT`: the end has a round cap with the clearance as radius; or the surface stops there."""
_CLEARLY = 0.01
"""Distance from an end or a tip, relative to the length of the piece, above which a point is certainly on one side of it."""


def pieces_of(bodies: np.ndarray, half_lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Divide one surface into pieces.

    Parameters
    ----------
    bodies : (n,) int array
        Bodies of the segments in order.
    half_lengths : (n,) array, m

    Returns
    -------
    owners : (n + 1, 2) int array
        Bodies a and b of every piece.
    stations : (n + 1, 6) array
        X of the four control points along their body's axis, m; the lowest and highest s of the piece.
    """
    count = len(bodies)
    tip = TIP * 2.0 * float(np.sum(half_lengths))
    owners = np.empty((count + 1, 2), dtype=np.int64)
    stations = np.empty((count + 1, 6))
    owners[0] = bodies[0]
    stations[0, :4] = half_lengths[0] * np.array([-1.0, -2 / 3, -1 / 3, 0.0])
    owners[count] = bodies[-1]
    stations[count, :4] = half_lengths[-1] * np.array([0.0, 1 / 3, 2 / 3, 1.0])
    for j in range(1, count):
        owners[j] = bodies[j - 1], bodies[j]
        stations[j, :4] = [0.0, 2 / 3 * half_lengths[j - 1], -2 / 3 * half_lengths[j], 0.0]
    stations[:, 4], stations[:, 5] = 0.0, 1.0
    stations[0, 4] = -tip / half_lengths[0]
    stations[count, 5] = 1.0 + tip / half_lengths[-1]
    return owners, stations


@kernel(inline=True)
def blend(s: float, stations: np.ndarray, out: np.ndarray) -> None:
    """Compute the weights and stations of a piece at s with two derivatives.

    `out` (3, 4), changed in place: row d holds the d-th derivative of (W_a, W_a-weighted X, W_b, W_b-weighted X), so
    that C^(d) = W_a r_a + A_a (x_a, 0) + W_b r_b + A_b (x_b, 0).
    """
    r = 1.0 - s
    b0, b1, b2, b3 = r * r * r, 3 * s * r * r, 3 * s * s * r, s * s * s
    d0, d1, d2, d3 = -3 * r * r, 3 * r * r - 6 * s * r, 6 * s * r - 3 * s * s, 3 * s * s
    e0, e1, e2, e3 = 6 * r, 6 * s - 12 * r, 6 * r - 12 * s, 6 * s
    out[0, 0] = b0 + b1
    out[0, 1] = b0 * stations[0] + b1 * stations[1]
    out[0, 2] = b2 + b3
    out[0, 3] = b2 * stations[2] + b3 * stations[3]
    out[1, 0] = d0 + d1
    out[1, 1] = d0 * stations[0] + d1 * stations[1]
    out[1, 2] = d2 + d3
    out[1, 3] = d2 * stations[2] + d3 * stations[3]
    out[2, 0] = e0 + e1
    out[2, 1] = e0 * stations[0] + e1 * stations[1]
    out[2, 2] = e2 + e3
    out[2, 3] = e2 * stations[2] + e3 * stations[3]


@kernel(inline=True)
def known_place(along: float, owners: np.ndarray, stations: np.ndarray) -> int:
    """Whether a point is certainly beside a piece, 1, or certainly beyond it and its tip, -1; 0 if Newton's method decides.

    `along` is the position of the point on the line through the chord of the nearest piece. An end piece belongs to one
    body, so that it is straight.
    """
    begins, ends = stations[4] < 0.0, stations[5] > 1.0
    if not begins and not ends:
        return 1
    if owners[0] != owners[1]:
        return 0
    if (begins and along < stations[4] - _CLEARLY) or (ends and along > stations[5] + _CLEARLY):
        return -1
    return 1 if (not begins or along > _CLEARLY) and (not ends or along < 1.0 - _CLEARLY) else 0


@kernel(inline=True)
def beyond_end(s: float, straight: float) -> bool:
    """Whether a point at s of an end piece is beyond an end without a tip (CAP or BARE)."""
    return straight < 0.0 and (s < -1e-12 or s > 1.0 + 1e-12)


@kernel(inline=True)
def overshoot(
    s: float, stations: np.ndarray, length: float, straight: float, clearance: float
) -> tuple[float, float]:
    """Distance x of a point at s past the straight part of a tip, m (negative at the beginning of the surface), and R, m.

    `straight` is the straight fraction of the tip, CAP or BARE; `length` is |C_s|. Both results are zero elsewhere.
    """
    if straight < 0.0:
        if s < 0.0:
            return s * length, clearance
        if s > 1.0:
            return (s - 1.0) * length, clearance
        return 0.0, 0.0
    if s < straight * stations[4]:
        return (s - straight * stations[4]) * length, -0.5 * stations[4] * length
    high = stations[5] - 1.0
    if s > 1.0 + straight * high:
        return (s - 1.0 - straight * high) * length, 0.5 * high * length
    return 0.0, 0.0
