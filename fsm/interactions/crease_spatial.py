"""Creases in space: twist angle, tabulated moment and assembly in one loop over the elements.

`fsm.interactions.hinge_spatial` defines the angle. The law of `fsm.laws.crease` gives the effort. In the joint axes of the
outer body and with the notation of `fsm.interactions.bushing_spatial`,

    K_aa = -K_ab = g (k g + c N)^T + e S + e [g]/2,    K_bb = -K_ba = g (k g + c N)^T + e S - e [g]/2,    D_aa = c g g^T.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.swing_twist import curvature_matrix, turn_curvature, turn_gradient, twist_slopes
from fsm.kernels import tensor
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import add_turns_spatial
from fsm.kernels.tensor import Matrix, Quaternion
from fsm.laws.crease import CreaseLaws, crease_effort


@kernel(inline=True)
def _place(
    poses: np.ndarray, a: int, b: int, axes_inner: np.ndarray, axes_outer: np.ndarray
) -> tuple[Quaternion, Matrix, Matrix]:
    """Relative rotation q; components of body a and of body b in the joint axes of the outer body."""
    outer = (axes_outer[0], axes_outer[1], axes_outer[2], axes_outer[3])
    joint = tensor.quaternion_product((poses[b, 3], poses[b, 4], poses[b, 5], poses[b, 6]), outer)
    relative = tensor.quaternion_product(
        (joint[0], -joint[1], -joint[2], -joint[3]), (poses[a, 3], poses[a, 4], poses[a, 5], poses[a, 6])
    )
    q = tensor.quaternion_product(relative, (axes_inner[0], axes_inner[1], axes_inner[2], axes_inner[3]))
    return q, tensor.quaternion_matrix(relative), tensor.quaternion_matrix((outer[0], -outer[1], -outer[2], -outer[3]))


@kernel
def force_crease_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    axes_inner: np.ndarray,
    axes_outer: np.ndarray,
    angle_offset: np.ndarray,
    law: CreaseLaws,
    before: np.ndarray,
    per_second: float,
    force: np.ndarray,
) -> None:
    """Add the moments of all creases.

    Parameters
    ----------
    poses, rates : (n_bodies, 7) and (n_bodies, 6) arrays
        Poses with quaternions of unit length, and rates of all bodies.
    bodies : (m, 2) int array
        Inner and outer body.
    axes_inner, axes_outer, angle_offset : as in `measure_hinge_spatial`
    law : CreaseLaws
    before : (m,) array
        Angles at a past state; not read if `per_second` is zero.
    per_second : float, 1/s
        Inverse of the time since the past state. If zero, the rates are those of the bodies.
    force : (n_bodies, 6) array, changed in place
    """
    for i in range(bodies.shape[0]):
        a, b = bodies[i, 0], bodies[i, 1]
        q, from_a, from_b = _place(poses, a, b, axes_inner[i], axes_outer[i])
        angle, slopes = twist_slopes(q)
        angle += angle_offset[i]
        g = turn_gradient(slopes, q)
        if per_second == 0.0:
            wa = tensor.times_vector(from_a, (rates[a, 3], rates[a, 4], rates[a, 5]))
            wb = tensor.times_vector(from_b, (rates[b, 3], rates[b, 4], rates[b, 5]))
            w = (wa[0] - wb[0], wa[1] - wb[1], wa[2] - wb[2])
            rate = g[0] * w[0] + g[1] * w[1] + g[2] * w[2]
        else:
            rate = (angle - before[i]) * per_second
        effort, _ = crease_effort(law, i, angle, rate)
        moment_a = tensor.transposed_times_vector(from_a, g)
        moment_b = tensor.transposed_times_vector(from_b, g)
        for j in range(3):
            force[a, 3 + j] -= effort * moment_a[j]
            force[b, 3 + j] += effort * moment_b[j]


@kernel
def linearise_crease_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    axes_inner: np.ndarray,
    axes_outer: np.ndarray,
    angle_offset: np.ndarray,
    law: CreaseLaws,
    before: np.ndarray,
    per_second: float,
    slots: np.ndarray,
    force: np.ndarray,
    stiffness_data: np.ndarray,
    damping_data: np.ndarray,
) -> None:
    """Add the moments of all creases, and K = -dh/dx and D = -dh/du to the block data.

    Parameters
    ----------
    poses ... per_second, force : as in `force_crease_spatial`
    slots : (m, 4) int array of `pair_slots`
    stiffness_data, damping_data : (n_blocks, 6, 6) arrays, changed in place
    """
    stiffness_flat, damping_flat = stiffness_data.reshape(-1), damping_data.reshape(-1)
    nothing = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(bodies.shape[0]):
        a, b = bodies[i, 0], bodies[i, 1]
        q, from_a, from_b = _place(poses, a, b, axes_inner[i], axes_outer[i])
        angle, slopes = twist_slopes(q)
        angle += angle_offset[i]
        g = turn_gradient(slopes, q)
        if per_second == 0.0:
            wa = tensor.times_vector(from_a, (rates[a, 3], rates[a, 4], rates[a, 5]))
            wb = tensor.times_vector(from_b, (rates[b, 3], rates[b, 4], rates[b, 5]))
            w = (wa[0] - wb[0], wa[1] - wb[1], wa[2] - wb[2])
            rate = g[0] * w[0] + g[1] * w[1] + g[2] * w[2]
        else:
            wa = wb = w = (0.0, 0.0, 0.0)
            rate = (angle - before[i]) * per_second
        effort, slope = crease_effort(law, i, angle, rate)
        moment_a = tensor.transposed_times_vector(from_a, g)
        moment_b = tensor.transposed_times_vector(from_b, g)
        for j in range(3):
            force[a, 3 + j] -= effort * moment_a[j]
            force[b, 3 + j] += effort * moment_b[j]

        c = law.damping[i]
        n = turn_curvature(slopes, q, w)
        swept = tensor.crossed(g, (wa[0] + wb[0], wa[1] + wb[1], wa[2] + wb[2]))
        hx = slope * g[0] + c * (n[0] - 0.5 * swept[0])
        hy = slope * g[1] + c * (n[1] - 0.5 * swept[1])
        hz = slope * g[2] + c * (n[2] - 0.5 * swept[2])
        turn = tensor.added(tensor.with_product(nothing, g, hx, hy, hz), effort, curvature_matrix(slopes, q))
        half = (0.0, -g[2], g[1], g[2], 0.0, -g[0], -g[1], g[0], 0.0)
        own_a, own_b = tensor.added(turn, 0.5 * effort, half), tensor.added(turn, -0.5 * effort, half)
        back = tensor.added(nothing, -1.0, from_b)
        add_turns_spatial(
            stiffness_flat, slots[i],
            tensor.transposed_times(from_a, tensor.times(own_a, from_a)),
            tensor.transposed_times(from_a, tensor.times(own_a, back)),
            tensor.transposed_times(back, tensor.times(own_b, from_a)),
            tensor.transposed_times(from_b, tensor.times(own_b, from_b)),
        )  # fmt: skip
        if c != 0.0:
            ga, gb = moment_a, (-moment_b[0], -moment_b[1], -moment_b[2])
            add_turns_spatial(
                damping_flat, slots[i],
                tensor.with_product(nothing, ga, c * ga[0], c * ga[1], c * ga[2]),
                tensor.with_product(nothing, ga, c * gb[0], c * gb[1], c * gb[2]),
                tensor.with_product(nothing, gb, c * ga[0], c * ga[1], c * ga[2]),
                tensor.with_product(nothing, gb, c * gb[0], c * gb[1], c * gb[2]),
            )  # fmt: skip
