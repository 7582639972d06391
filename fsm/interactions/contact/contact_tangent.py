"""Stiffness K and damping D of one contact from the derivatives of its gap and slip."""

from __future__ import annotations

import numpy as np

from fsm.interactions.contact.shapes import BlockIndex, ContactForces
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import add_block


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
    bodies, gradient, effort, by_slip, by_normal = (
        all_bodies[row], all_gradients[row], forces.effort[row], forces.by_slip[row], forces.by_normal[row]
    )  # fmt: skip
    normal, by_depth, by_closing = forces.normal[row], forces.by_depth[row], forces.by_closing[row]
    dof, indptr, indices = index
    count, size, slips = gradient.shape[1], stiffness_data.shape[1], effort.shape[0]
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
        for c in range(slips):
            effort_x, effort_u = by_normal[c] * normal_x, by_normal[c] * normal_u
            for e in range(slips):
                slip_rate = 0.0
                for m in range(count):
                    slip_rate += slip_second[m, n, e] * rates[bodies[m // size], m % size]
                effort_x += by_slip[c, e] * slip_rate
                effort_u += by_slip[c, e] * gradient[1 + e, n]
            for m in range(count):
                block_k[m, n] += gradient[1 + c, m] * effort_x + effort[c] * slip_second[m, n, c]
                block_d[m, n] += gradient[1 + c, m] * effort_u
    add_block(block_k, dof, bodies, indptr, indices, stiffness_data)
    add_block(block_d, dof, bodies, indptr, indices, damping_data)
