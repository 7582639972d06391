"""Forces and moments on bodies, in the plane and in space: wrenches, their tangents and their power.

A dead load keeps its direction in inertial axes; a follower load rotates with its body. With the point p, the force f and
the moment m of the load and the rotation R of its body, the wrench in space (force in inertial axes, moment in body axes) is

    follower: (R f, p x f + m),    dead: (f, p x R^T f + R^T m)
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.tensor import crossed, quaternion_matrix, times_vector, transposed_times_vector


@kernel
def _set_wrench(
    pose: np.ndarray, point: np.ndarray, force: np.ndarray, moment: np.ndarray, follower: int, out: np.ndarray
) -> None:
    """Write the wrench of one load (3 or 6,) at a pose (3 or 7,)."""
    if pose.shape[0] == 3:
        cosine, sine = np.cos(pose[2]), np.sin(pose[2])
        fx, fz = force[0], force[1]
        if follower == 1:
            fx, fz = cosine * force[0] + sine * force[1], cosine * force[1] - sine * force[0]
        ax, az = cosine * point[0] + sine * point[1], cosine * point[1] - sine * point[0]
        out[0], out[1], out[2] = fx, fz, fx * az - fz * ax + moment[0]
    else:
        rotation = quaternion_matrix((pose[3], pose[4], pose[5], pose[6]))
        arm = (point[0], point[1], point[2])
        push, turn = (force[0], force[1], force[2]), (moment[0], moment[1], moment[2])
        if follower == 1:
            about = crossed(arm, push)
            push = times_vector(rotation, push)
        else:
            about = crossed(arm, transposed_times_vector(rotation, push))
            turn = transposed_times_vector(rotation, turn)
        for k in range(3):
            out[k], out[3 + k] = push[k], about[k] + turn[k]


@kernel
def add_applied(
    poses: np.ndarray, bodies: np.ndarray, points: np.ndarray, forces: np.ndarray, moments: np.ndarray,
    follower: np.ndarray, factors: np.ndarray, total: np.ndarray,
) -> None:  # fmt: skip
    """Add the wrenches of all loads to the wrenches of the bodies.

    Parameters
    ----------
    poses : (n_bodies, 3 or 7) array
    bodies : (m,) int array
    points, forces, moments : (m, 2 or 3), (m, 2 or 3), (m, 1 or 3) arrays
        Point in body axes, m; force, N, and moment, N m, of the factor 1.
    follower : (m,) int array
        1: rotates with the body.
    factors : (m,) array
    total : (n_bodies, 3 or 6) array, changed in place
    """
    wrench = np.empty(total.shape[1])
    for i in range(bodies.shape[0]):
        _set_wrench(poses[bodies[i]], points[i], forces[i], moments[i], follower[i], wrench)
        for k in range(total.shape[1]):
            total[bodies[i], k] += factors[i] * wrench[k]


@kernel
def applied_power(
    poses: np.ndarray, rates: np.ndarray, bodies: np.ndarray, points: np.ndarray, forces: np.ndarray,
    moments: np.ndarray, follower: np.ndarray, factors: np.ndarray,
) -> float:  # fmt: skip
    """Power of all loads, W; arguments as in `add_applied`, rates (n_bodies, 3 or 6)."""
    wrench, power = np.empty(rates.shape[1]), 0.0
    for i in range(bodies.shape[0]):
        _set_wrench(poses[bodies[i]], points[i], forces[i], moments[i], follower[i], wrench)
        for k in range(rates.shape[1]):
            power += factors[i] * wrench[k] * rates[bodies[i], k]
    return power


@kernel
def add_applied_stiffness(
    poses: np.ndarray, bodies: np.ndarray, points: np.ndarray, forces: np.ndarray, moments: np.ndarray,
    follower: np.ndarray, factors: np.ndarray, slots: np.ndarray, stiffness: np.ndarray,
) -> None:  # fmt: skip
    """Add -d(wrench)/dx of all loads to the block data (n_blocks, 3 or 6, 3 or 6).

    Other arguments as in `add_applied`; `slots` (m,) are the positions of the diagonal blocks, -1 for bodies without
    degrees of freedom.
    """
    for i in range(bodies.shape[0]):
        if slots[i] < 0:
            continue
        pose, block, c = poses[bodies[i]], stiffness[slots[i]], factors[i]
        force, point, moment = forces[i], points[i], moments[i]
        if poses.shape[1] == 3:
            cosine, sine = np.cos(pose[2]), np.sin(pose[2])
            if follower[i] == 1:
                block[0, 2] -= c * (cosine * force[1] - sine * force[0])
                block[1, 2] += c * (cosine * force[0] + sine * force[1])
            else:
                ax, az = cosine * point[0] + sine * point[1], cosine * point[1] - sine * point[0]
                block[2, 2] += c * (force[0] * ax + force[1] * az)
            continue
        rotation = quaternion_matrix((pose[3], pose[4], pose[5], pose[6]))
        push, turn = (force[0], force[1], force[2]), (moment[0], moment[1], moment[2])
        arm = (point[0], point[1], point[2])
        if follower[i] == 0:
            push, turn = transposed_times_vector(rotation, push), transposed_times_vector(rotation, turn)
        for j in range(3):
            axis = (1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0)
            if follower[i] == 1:
                change = times_vector(rotation, crossed(axis, push))
                for k in range(3):
                    block[k, 3 + j] -= c * change[k]
            else:
                change, more = crossed(arm, crossed(axis, push)), crossed(axis, turn)
                for k in range(3):
                    block[3 + k, 3 + j] += c * (change[k] + more[k])
