"""Contact of two rounded edges in space, for example of plates that cross like an X.

    d = min |x_1(s) - x_2(sigma)| over both segments,     x_i = m_i + s t_i,  |s| <= l_i,      n = (x_1 - x_2)/d
    gap = d - c outside,     gap = w (d - c) inside,     c = r_1 + r_2, or less near a common crease

The closest points are limited to the segments. If an edge slides past the end of the other edge, the contact changes to a
contact of a point with an edge or a corner. The gap and its gradient stay continuous.

The closest points of parallel edges are not unique. Near the parallel position these points move along the edges when
the edges rotate. In this position the corners and the points along the edges carry the contact (`point_shape_spatial`).
The depth of the edges is scaled down to zero by a function of the sine of their angle alone,

    w = y (2 - y),  y = min(1, |t_1 x t_2|^2/e)             mollifier of Li et al. (2020), Incremental Potential Contact

The scaled depth is a function of the poses with a continuous gradient, and the contact energy is a function of this depth.
The forces are therefore conservative, and the gradient of w is a couple between the two bodies. N w vanishes faster than
the closest points move, so the moment is continuous through the parallel position.

Slip is measured at x_c = x_1 - r_1 n, on the face of edge 1; see `contact_frame`. With d_i the relative motion of the two
bodies at x_1 and x_2,

    ds, dsigma from (x_1 - x_2).t_i = 0 where s and sigma are not at an end,   dn = (I - n n^T)(d + t_1 ds - t_2 dsigma)/d

Coordinates: (dr, dtheta) of the body of edge 1, then of edge 2; dtheta in body axes.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.contact_frame import (
    add_contact_tangent,
    contact_derivatives,
    contact_gradient,
    relative_motion,
)
from fsm.interactions.contact.shapes import BlockIndex, ContactForces, EdgePairs, Edges
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.vector import cross, dot, rotate

# rows of the table of vectors of a state
_ARM_1, _ARM_2, _T_1, _T_2, _ACROSS, _APART, _NORMAL = 0, 1, 2, 3, 4, 5, 6


@kernel
def _edge_frame(
    poses: np.ndarray,
    body: int,
    middle: np.ndarray,
    direction: np.ndarray,
    frame: np.ndarray,
    arm: np.ndarray,
    along: np.ndarray,
) -> None:
    """Body frame, arm from the body's centre to the middle of its edge, and direction of the edge; inertial axes."""
    fill_rotation(poses[body, 3:], frame)
    rotate(frame, middle, arm)
    rotate(frame, direction, along)


@kernel
def _closest(apart: np.ndarray, t_1: np.ndarray, t_2: np.ndarray, half_1: float, half_2: float) -> tuple[float, float]:
    """Coordinates s, sigma of the closest points from the middles, m; `apart` joins the middles; parallel edges: s = 0."""
    c, a, b = dot(t_1, t_2), dot(apart, t_1), dot(apart, t_2)
    square = 1.0 - c * c
    s = (c * b - a) / square if square > 1e-14 else 0.0
    s = min(half_1, max(-half_1, s))
    sigma = b + c * s
    if abs(sigma) > half_2:
        sigma = min(half_2, max(-half_2, sigma))
        s = min(half_1, max(-half_1, c * sigma - a))
    return s, sigma


@kernel
def _state(
    poses: np.ndarray,
    pair: np.ndarray,
    edges: Edges,
    frames: np.ndarray,
    vectors: np.ndarray,
) -> tuple[float, float, float, float]:
    """Distance of a pair of edges, |t_1 x t_2|^2, and the coordinates s and sigma of the closest points.

    `frames` (2, 3, 3) and `vectors` (7, 3) are changed in place: arms of x_1 and x_2 from their bodies' centres, t_1, t_2,
    t_1 x t_2, x_1 - x_2, n.
    """
    apart, along = vectors[_APART], vectors[_ACROSS]
    one, two = pair[0], pair[1]
    a, b = edges.body[one], edges.body[two]
    _edge_frame(poses, a, edges.middle[one], edges.direction[one], frames[0], vectors[_ARM_1], vectors[_T_1])
    _edge_frame(poses, b, edges.middle[two], edges.direction[two], frames[1], vectors[_ARM_2], vectors[_T_2])
    for c in range(3):
        apart[c] = poses[a, c] + vectors[_ARM_1, c] - poses[b, c] - vectors[_ARM_2, c]
    s, sigma = _closest(apart, vectors[_T_1], vectors[_T_2], edges.half[one], edges.half[two])
    for c in range(3):
        vectors[_ARM_1, c] += s * vectors[_T_1, c]
        vectors[_ARM_2, c] += sigma * vectors[_T_2, c]
        apart[c] += s * vectors[_T_1, c] - sigma * vectors[_T_2, c]
    cross(vectors[_T_1], vectors[_T_2], along)
    distance, sine = np.sqrt(dot(apart, apart)), dot(along, along)
    for c in range(3):
        if distance > 0.0:
            vectors[_NORMAL, c] = apart[c] / distance
        else:
            vectors[_NORMAL, c] = along[c] / np.sqrt(sine) if sine > 0.0 else 0.0
    return distance, sine, s, sigma


@kernel(inline=True)
def _parallel_weight(square: float, parallel: float) -> tuple[float, float, float]:
    """w and its first two derivatives with respect to |t_1 x t_2|^2."""
    if square >= parallel:
        return 1.0, 0.0, 0.0
    y = square / parallel
    return y * (2.0 - y), 2.0 * (1.0 - y) / parallel, -2.0 / (parallel * parallel)


@kernel
def _edge_boxes(
    poses: np.ndarray,
    edges: Edges,
) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corners (e, 3) of the boxes around all edges, m."""
    low, high = np.empty(edges.middle.shape), np.empty(edges.middle.shape)
    frame, arm, along = np.empty((3, 3)), np.empty(3), np.empty(3)
    for i in range(edges.middle.shape[0]):
        body = edges.body[i]
        _edge_frame(poses, body, edges.middle[i], edges.direction[i], frame, arm, along)
        for c in range(3):
            half = abs(along[c]) * edges.half[i] + edges.radius[i]
            low[i, c], high[i, c] = poses[body, c] + arm[c] - half, poses[body, c] + arm[c] + half
    return low, high


@kernel
def find_edges(
    poses: np.ndarray,
    slots: np.ndarray,
    pairs: EdgePairs,
    edges: Edges,
    below: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Find the pairs of edges whose gap is below a bound.

    Parameters
    ----------
    poses : (n_bodies, 7) array
    slots : (m,) int array
        Pairs to test.
    pairs, edges : tables
    below : float, m

    Returns
    -------
    slot : (count,) int array
    gap : (count,) array, m
    """
    slot, gap = np.empty(slots.shape[0], dtype=np.int64), np.empty(slots.shape[0])
    frames, vectors = np.empty((2, 3, 3)), np.empty((7, 3))
    low, high = _edge_boxes(poses, edges)
    count = 0
    for i in range(slots.shape[0]):
        pair = pairs.edges[slots[i]]
        one, two = pair[0], pair[1]
        apart = max(low[one, 0] - high[two, 0], low[two, 0] - high[one, 0])
        apart = max(apart, low[one, 1] - high[two, 1], low[two, 1] - high[one, 1])
        if max(apart, low[one, 2] - high[two, 2], low[two, 2] - high[one, 2]) > below:
            continue
        distance, square, _, _ = _state(poses, pair, edges, frames, vectors)
        value = distance - pairs.clearance[slots[i]]
        if value < 0.0:
            value *= _parallel_weight(square, pairs.parallel[slots[i]])[0]
        if value < below:
            slot[count] = slots[i]
            gap[count] = value
            count += 1
    return slot[:count].copy(), gap[:count].copy()


@kernel
def _cosine_gradient(frames: np.ndarray, across: np.ndarray, out: np.ndarray) -> None:
    """Gradient (12,) of t_1.t_2: +-A e_j . (t_1 x t_2) by the turns."""
    out[:] = 0.0
    for j in range(3):
        out[3 + j] = dot(frames[0][:, j], across)
        out[9 + j] = -dot(frames[1][:, j], across)


@kernel
def write_edges(
    poses: np.ndarray, rates: np.ndarray, slots: np.ndarray, pairs: EdgePairs, edges: Edges, bodies: np.ndarray,
    rate: np.ndarray, gradient: np.ndarray,
) -> None:  # fmt: skip
    """Write bodies (count, 2), rates (count, 4), m/s, and gradients (count, 4, 12) of gap and slip."""
    frames, vectors, motion = np.empty((2, 3, 3)), np.empty((7, 3)), np.empty((12, 3))
    cosine = np.empty(12)
    for i in range(slots.shape[0]):
        pair = pairs.edges[slots[i]]
        bodies[i, 0], bodies[i, 1] = edges.body[pair[0]], edges.body[pair[1]]
        distance, square, _, _ = _state(poses, pair, edges, frames, vectors)
        _move_to_contact(vectors, distance, edges.radius[pair[0]])
        relative_motion(frames, vectors[:2], motion)
        contact_gradient(rates, bodies[i], vectors[_NORMAL], motion, rate[i], gradient[i])
        gap = distance - pairs.clearance[slots[i]]
        if gap >= 0.0 or square >= pairs.parallel[slots[i]]:
            continue
        weight, slope, _ = _parallel_weight(square, pairs.parallel[slots[i]])
        _cosine_gradient(frames, vectors[_ACROSS], cosine)
        slope *= -2.0 * dot(vectors[_T_1], vectors[_T_2])
        rate[i, 0] = 0.0
        for m in range(12):
            gradient[i, 0, m] = weight * gradient[i, 0, m] + gap * slope * cosine[m]
            rate[i, 0] += gradient[i, 0, m] * rates[bodies[i, m // 6], m % 6]


@kernel(inline=True)
def _move_to_contact(vectors: np.ndarray, distance: float, radius: float) -> None:
    """Replace the arms of x_1 and x_2 by the arms of x_c."""
    for c in range(3):
        vectors[_ARM_2, c] += (distance - radius) * vectors[_NORMAL, c]
        vectors[_ARM_1, c] -= radius * vectors[_NORMAL, c]


@kernel
def _normal_and_point_changes(
    frames: np.ndarray,
    vectors: np.ndarray,
    motion: np.ndarray,
    distance: float,
    free_1: bool,
    free_2: bool,
    radius: float,
    normal_change: np.ndarray,
    point_change: np.ndarray,
) -> None:
    """Compute dn and dx_c (12, 3); `motion` (12, 3) holds the motion of x_1 and the negative motion of x_2."""
    turn_1, turn_2, apart = np.empty(3), np.empty(3), np.empty(3)
    t_1, t_2, normal = vectors[_T_1], vectors[_T_2], vectors[_NORMAL]
    c = dot(t_1, t_2)
    square = 1.0 - c * c
    for n in range(12):
        turn_1[:] = 0.0
        turn_2[:] = 0.0
        if 3 <= n < 6:
            cross(frames[0][:, n - 3], t_1, turn_1)
        if n >= 9:
            cross(frames[1][:, n - 9], t_2, turn_2)
        # the conditions (x_1 - x_2).t_i = 0, linearised
        one = dot(motion[n], t_1) + dot(vectors[_APART], turn_1)
        two = dot(motion[n], t_2) + dot(vectors[_APART], turn_2)
        ds = dsigma = 0.0
        if free_1 and free_2:
            if square > 1e-14:
                ds = (c * two - one) / square
                dsigma = two + c * ds
        elif free_1:
            ds = -one
        elif free_2:
            dsigma = two
        for k in range(3):
            apart[k] = motion[n, k] + t_1[k] * ds - t_2[k] * dsigma
        along = dot(normal, apart)
        for k in range(3):
            normal_change[n, k] = (apart[k] - normal[k] * along) / distance
            moved = motion[n, k] if n < 6 else 0.0
            point_change[n, k] = moved + t_1[k] * ds - radius * normal_change[n, k]


@kernel
def _scale_second(
    frames: np.ndarray,
    vectors: np.ndarray,
    gap: float,
    square: float,
    parallel: float,
    motion: np.ndarray,
    cosine: np.ndarray,
    hessian: np.ndarray,
) -> None:
    """Replace the second derivatives of d by the second derivatives of w (d - r): w H + dw dg + dg dw + gap d2w."""
    weight, slope, curve = _parallel_weight(square, parallel)
    _cosine_gradient(frames, vectors[_ACROSS], cosine)
    c = dot(vectors[_T_1], vectors[_T_2])
    axis, turned, change = np.empty(3), np.empty(3), np.empty(3)
    for n in range(12):
        change[:] = 0.0
        if 3 <= n < 6:
            cross(frames[0][:, n - 3], vectors[_T_1], turned)
            cross(turned, vectors[_T_2], change)
        if n >= 9:
            cross(frames[1][:, n - 9], vectors[_T_2], turned)
            cross(vectors[_T_1], turned, change)
        for m in range(12):
            second = 0.0
            if m % 6 >= 3:
                side, sign = m // 6, 1.0 if m < 6 else -1.0
                second = dot(frames[side][:, m % 6 - 3], change)
                if n // 6 == side and n % 6 >= 3:
                    cross(frames[side][:, n % 6 - 3], frames[side][:, m % 6 - 3], axis)
                    second += dot(axis, vectors[_ACROSS])
                second *= sign
            # |t_1 x t_2|^2 = 1 - c^2
            weight_second = (4.0 * curve * c * c - 2.0 * slope) * cosine[m] * cosine[n] - 2.0 * slope * c * second
            gap_m, gap_n = dot(vectors[_NORMAL], motion[m]), dot(vectors[_NORMAL], motion[n])
            hessian[m, n] = (
                weight * hessian[m, n]
                - 2.0 * slope * c * (cosine[m] * gap_n + gap_m * cosine[n])
                + gap * weight_second
            )


@kernel
def tangent_edges(
    poses: np.ndarray,
    rates: np.ndarray,
    slots: np.ndarray,
    bodies: np.ndarray,
    gradient: np.ndarray,
    pairs: EdgePairs,
    edges: Edges,
    forces: ContactForces,
    index: BlockIndex,
    stiffness_data: np.ndarray,
    damping_data: np.ndarray,
) -> None:
    """Add K and D; `bodies` and `gradient` come from `measure_edges`; forces as in `add_contact_tangent`."""
    frames, vectors, motion = np.empty((2, 3, 3)), np.empty((7, 3)), np.empty((12, 3))
    normal_change, point_change, cosine = np.empty((12, 3)), np.empty((12, 3)), np.empty(12)
    hessian, slip_second = np.empty((12, 12)), np.empty((12, 12, 3))
    block_k, block_d = np.empty((12, 12)), np.empty((12, 12))
    for i in range(slots.shape[0]):
        one, two = pairs.edges[slots[i], 0], pairs.edges[slots[i], 1]
        distance, square, s, sigma = _state(poses, pairs.edges[slots[i]], edges, frames, vectors)
        if distance == 0.0:
            continue
        relative_motion(frames, vectors[:2], motion)
        _normal_and_point_changes(
            frames, vectors, motion, distance, abs(s) < edges.half[one], abs(sigma) < edges.half[two],
            edges.radius[one], normal_change, point_change,
        )  # fmt: skip
        _move_to_contact(vectors, distance, edges.radius[one])
        relative_motion(frames, vectors[:2], motion)
        contact_derivatives(
            frames, vectors[:2], vectors[_NORMAL], motion, normal_change, point_change, hessian, slip_second
        )
        gap = distance - pairs.clearance[slots[i]]
        if gap < 0.0 and square < pairs.parallel[slots[i]]:
            _scale_second(frames, vectors, gap, square, pairs.parallel[slots[i]], motion, cosine, hessian)
        add_contact_tangent(
            i, rates, bodies, gradient, hessian, slip_second, forces, index, stiffness_data, damping_data, block_k, block_d
        )  # fmt: skip
