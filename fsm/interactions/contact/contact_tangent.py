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
    bodies, size, (dof, indptr, indices) = all_bodies[row], stiffness_data.shape[1], index
    write_contact_tangent(
        row, rates, bodies, all_gradients[row], size, hessian, slip_second, forces, block_k, block_d
    )  # fmt: skip
    add_block(block_k, dof, bodies, indptr, indices, stiffness_data)
    add_block(block_d, dof, bodies, indptr, indices, damping_data)


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
