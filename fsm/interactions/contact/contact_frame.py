"""Contact of two bodies in space at one point: gap and slip from the motion of both bodies' material there.

The unit normal n points from body B to body A. n and the contact point x_c are functions of the poses. Then

    M_m = velocity of A's material at x_c relative to B's, by coordinate m
    dg_m = n.M_m,        V_m = M_m - n (n.M_m)

n.M_m is the gradient of the gap for any x_c on the line along n through the two closest points. Force and friction act on
both bodies at x_c, so that action and reaction have the same moment. Only dn and dx_c depend on the geometry. The second
derivatives follow from them:

    For a rotation about a_j of a body at r: dM_m = da_j x (x_c - r) + a_j x (dx_c - dr), where da_j = a_k x a_j for a
    rotation about a_k

Coordinates: (dr, dtheta) of body A, then of body B; dtheta in body axes.

Stiffness K and damping D of one contact from the derivatives of its gap and slip.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import BlockIndex, ContactForces
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import add_block
from fsm.kernels.vector import cross, dot


@kernel
def relative_motion(frames: np.ndarray, arms: np.ndarray, motion: np.ndarray) -> None:
    """Relative motion M (12, 3) of both bodies' material at a point, by every coordinate.

    Parameters
    ----------
    frames : (2, 3, 3) array
        Rotation matrices of A and B.
    arms : (2, 3) array, m
        Vectors from the bodies' centres to the point; inertial axes.
    motion : (12, 3) array, changed in place
    """
    motion[:] = 0.0
    for side in range(2):
        sign = 1.0 if side == 0 else -1.0
        first = 6 * side
        for j in range(3):
            motion[first + j, j] = sign
            cross(frames[side][:, j], arms[side], motion[first + 3 + j])
            for c in range(3):
                motion[first + 3 + j, c] *= sign


@kernel
def contact_gradient(
    rates: np.ndarray, bodies: np.ndarray, normal: np.ndarray, motion: np.ndarray, rate: np.ndarray, gradient: np.ndarray
) -> None:
    """Compute rates (4,) and gradients (4, 12) of gap and slip from n and M, changed in place."""
    for m in range(12):
        along = dot(normal, motion[m])
        gradient[0, m] = along
        for c in range(3):
            gradient[1 + c, m] = motion[m, c] - normal[c] * along
    for k in range(4):
        total = 0.0
        for m in range(12):
            total += gradient[k, m] * rates[bodies[m // 6], m % 6]
        rate[k] = total


@kernel
def contact_derivatives(
    frames: np.ndarray,
    arms: np.ndarray,
    normal: np.ndarray,
    motion: np.ndarray,
    normal_change: np.ndarray,
    point_change: np.ndarray,
    hessian: np.ndarray,
    slip_second: np.ndarray,
) -> None:
    """Compute second derivatives of the gap, and derivatives of the slip gradient V.

    Parameters
    ----------
    frames, arms, motion : as in `relative_motion`, at x_c
    normal : (3,) array
    normal_change, point_change : (12, 3) arrays
        dn and dx_c by every coordinate.
    hessian : (12, 12) array, changed in place
    slip_second : (12, 12, 3) array, changed in place
    """
    axis, part, moved, shift = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for n in range(12):
        for m in range(12):
            side, row = m // 6, m % 6
            moved[:] = 0.0
            if row >= 3:
                for c in range(3):
                    shift[c] = point_change[n, c]
                if n // 6 == side and n % 6 < 3:
                    shift[n % 6] -= 1.0
                cross(frames[side][:, row - 3], shift, moved)
                if n // 6 == side and n % 6 >= 3:
                    cross(frames[side][:, n % 6 - 3], frames[side][:, row - 3], axis)
                    cross(axis, arms[side], part)
                    for c in range(3):
                        moved[c] += part[c]
                if side == 1:
                    for c in range(3):
                        moved[c] = -moved[c]
            along = dot(normal, motion[m])
            total = dot(normal_change[n], motion[m]) + dot(normal, moved)
            hessian[m, n] = total
            for c in range(3):
                slip_second[m, n, c] = moved[c] - normal_change[n, c] * along - normal[c] * total


@kernel
def add_contact_tangent(
    row: int,
    rates: np.ndarray,
    all_bodies: np.ndarray,
    all_gradients: np.ndarray,
    hessian: np.ndarray,
    slip_second: np.ndarray,
    forces: ContactForces,
    index: BlockIndex,
    stiffness_data: np.ndarray,
    damping_data: np.ndarray,
    block_k: np.ndarray,
    block_d: np.ndarray,
) -> None:
    """Add K = -dh/dx and D = -dh/du of h = N dg/dx - sum_c f_c V_c, with N(-g, -g') and f(V.u, N).

    Parameters
    ----------
    row : int
        Row of the contact in the next two arrays and in the forces.
    all_bodies : (m, k) int array
    all_gradients : (m, 1 + c, n) array
        dg/dx, then the slip's V_c; n = k times the coordinates of a body.
    hessian : (n, n) array
        Derivative of dg/dx_m with respect to coordinate n; not symmetric where both are rotations of one body.
    slip_second : (n, n, c) array
        Derivative of V_c,m with respect to coordinate n; not read without friction.
    forces : ContactForces
    block_k, block_d : (n, n) arrays, scratch
    """
    bodies, size, (dof, indptr, indices) = all_bodies[row], stiffness_data.shape[1], index
    write_contact_tangent(
        row, rates, bodies, all_gradients[row], size, hessian, slip_second, forces, block_k, block_d
    )  # fmt: skip
    add_block(block_k, dof, bodies, indptr, indices, stiffness_data)
    add_block(block_d, dof, bodies, indptr, indices, damping_data)


@kernel
def add_pull_tangent(
    row: int,
    all_bodies: np.ndarray,
    all_gradients: np.ndarray,
    change: np.ndarray,
    forces: ContactForces,
    index: BlockIndex,
    stiffness_data: np.ndarray,
    block: np.ndarray,
) -> None:
    """Add the stiffness of friction due to the change of `ContactArrays.pull`; `change` (n,) is its derivative over its
    value. Other arguments as those of `add_contact_tangent`.
    """
    gradient, (dof, indptr, indices) = all_gradients[row], index
    for n in range(gradient.shape[1]):
        for m in range(gradient.shape[1]):
            block[m, n] = 0.0
            for c in range(forces.effort.shape[1]):
                block[m, n] += gradient[1 + c, m] * forces.by_normal[row, c] * forces.normal[row] * change[n]
    add_block(block, dof, all_bodies[row], indptr, indices, stiffness_data)


@kernel
def write_contact_tangent(
    row: int,
    rates: np.ndarray,
    bodies: np.ndarray,
    gradient: np.ndarray,
    size: int,
    hessian: np.ndarray,
    slip_second: np.ndarray,
    forces: ContactForces,
    block_k: np.ndarray,
    block_d: np.ndarray,
) -> None:
    """Write K and D of one contact, (n, n); `size` is the number of coordinates of a body that have an effect."""
    effort, by_slip, by_normal = forces.effort[row], forces.by_slip[row], forces.by_normal[row]
    normal, by_depth, by_closing = forces.normal[row], forces.by_depth[row], forces.by_closing[row]
    count, slips = gradient.shape[1], effort.shape[0]
    slip_rates = np.empty(slips)
    for n in range(count):
        gap_rate = 0.0
        for m in range(count):
            gap_rate += hessian[m, n] * rates[bodies[m // size], m % size]
        normal_x = -by_depth * gradient[0, n] - by_closing * gap_rate
        normal_u = -by_closing * gradient[0, n]
        for m in range(count):
            block_k[m, n] = -normal * hessian[m, n] - gradient[0, m] * normal_x
            block_d[m, n] = -gradient[0, m] * normal_u
        if not forces.friction:
            continue
        for e in range(slips):
            slip_rates[e] = 0.0
            for m in range(count):
                slip_rates[e] += slip_second[m, n, e] * rates[bodies[m // size], m % size]
        for c in range(slips):
            effort_x, effort_u = by_normal[c] * normal_x, by_normal[c] * normal_u
            for e in range(slips):
                effort_x += by_slip[c, e] * slip_rates[e]
                effort_u += by_slip[c, e] * gradient[1 + e, n]
            for m in range(count):
                block_k[m, n] += gradient[1 + c, m] * effort_x + effort[c] * slip_second[m, n, c]
                block_d[m, n] += gradient[1 + c, m] * effort_u
