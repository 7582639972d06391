"""Relative pose of two bodies in the plane: (Z1, Z3, psi) in the joint axes of the outer body.

    Z_k = e_k . (A_b^T (r_a + A_a c_a - r_b) - c_b),      psi = phi_a - phi_b + psi_0

A pose is (x, z, phi). phi is a rotation about +y, which turns the x axis towards -z; its generator is W v = (v_z, -v_x).
Coordinates of an element: (x, z, phi) of the inner body a, then of the outer body b.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def measure_pose_planar(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    point_inner: np.ndarray,
    point_outer: np.ndarray,
    axes_angle: np.ndarray,
    angle_offset: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the deformations of all force elements, their rates and gradients.

    Parameters
    ----------
    poses, rates : (n_bodies, 3) arrays
    bodies : (m, 2) int array
        Inner and outer body.
    point_inner, point_outer : (m, 2) arrays, m, body axes
    axes_angle : (m,) array, rad
        Angle of the joint axes in the outer body.
    angle_offset : (m,) array, rad
        psi_0.

    Returns
    -------
    value, rate : (m, 3) arrays, m and rad, m/s and rad/s
    gradient : (m, 3, 6) array
    """
    count = bodies.shape[0]
    value = np.empty((count, 3))
    rate = np.empty((count, 3))
    gradient = np.zeros((count, 3, 6))
    for i in range(count):
        a, b = bodies[i, 0], bodies[i, 1]
        ca, sa = np.cos(poses[a, 2]), np.sin(poses[a, 2])
        armx = ca * point_inner[i, 0] + sa * point_inner[i, 1]
        armz = -sa * point_inner[i, 0] + ca * point_inner[i, 1]
        dx = poses[a, 0] + armx - poses[b, 0]
        dz = poses[a, 1] + armz - poses[b, 1]
        turn = poses[b, 2] + axes_angle[i]
        ct, st = np.cos(turn), np.sin(turn)
        cb, sb = np.cos(axes_angle[i]), np.sin(axes_angle[i])
        # world axes e1 = (ct, -st), e3 = (st, ct); the same formulas give the body axes, with the angle of the axes
        for k in range(2):
            ex, ez = (ct, -st) if k == 0 else (st, ct)
            bx, bz = (cb, -sb) if k == 0 else (sb, cb)
            value[i, k] = ex * dx + ez * dz - (bx * point_outer[i, 0] + bz * point_outer[i, 1])
            gradient[i, k, 0] = ex
            gradient[i, k, 1] = ez
            gradient[i, k, 2] = ex * armz - ez * armx
            gradient[i, k, 3] = -ex
            gradient[i, k, 4] = -ez
            gradient[i, k, 5] = ez * dx - ex * dz
        value[i, 2] = poses[a, 2] - poses[b, 2] + angle_offset[i]
        gradient[i, 2, 2] = 1.0
        gradient[i, 2, 5] = -1.0
        for k in range(3):
            total = 0.0
            for c in range(3):
                total += gradient[i, k, c] * rates[a, c] + gradient[i, k, 3 + c] * rates[b, c]
            rate[i, k] = total
    return value, rate, gradient
