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
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
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
