"""Bounds of the displacement of bodies, which decide when the broad phase of contact is renewed."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def moved_beyond(
    poses: np.ndarray, reference: np.ndarray, bodies: np.ndarray, radii: np.ndarray, bound: float
) -> bool:
    """Whether any point of any of the bodies may have moved by more than a bound (m) since the reference.

    Parameters
    ----------
    poses, reference : (n_bodies, 3 or 7) arrays
    bodies : (m,) int array
    radii : (m,) array, m
        Distance of the farthest point of each body from its centre.
    """
    planar = poses.shape[1] == 3
    n_position = 2 if planar else 3
    # a quaternion changes by half the rotation angle; 2.2 times its change is a safe bound of the angle
    factor = 1.0 if planar else 2.2
    for i in range(bodies.shape[0]):
        body = bodies[i]
        moved = turned = 0.0
        for k in range(n_position):
            moved += (poses[body, k] - reference[body, k]) ** 2
        for k in range(n_position, poses.shape[1]):
            turned += (poses[body, k] - reference[body, k]) ** 2
        # NaN must count as beyond the bound
        if not np.sqrt(moved) + factor * np.sqrt(turned) * radii[i] < bound:
            return True
    return False


@kernel
def furthest_motion(before: np.ndarray, after: np.ndarray, bodies: np.ndarray, radii: np.ndarray) -> float:
    """Upper bound of the displacement of any point of the bodies between two poses, m; arguments as `moved_beyond`."""
    n_position = 2 if before.shape[1] == 3 else 3
    # a quaternion changes by half the rotation angle
    factor = 1.0 if before.shape[1] == 3 else 2.2
    furthest = 0.0
    for i in range(bodies.shape[0]):
        body, moved, turned = bodies[i], 0.0, 0.0
        for k in range(n_position):
            moved += abs(after[body, k] - before[body, k])
        for k in range(n_position, before.shape[1]):
            turned += abs(after[body, k] - before[body, k])
        furthest = max(furthest, moved + factor * turned * radii[i])
    return furthest
