"""Creases in the plane: hinge angle, tabulated moment and assembly in one loop over the elements.

`fsm.interactions.hinge_planar` defines the angle. The law of `fsm.laws.crease` gives the effort.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.scatter import add_turn_planar
from fsm.laws.crease import CreaseLaws, crease_effort


@kernel
def force_crease_planar(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    angle_offset: np.ndarray,
    law: CreaseLaws,
    before: np.ndarray,
    per_second: float,
    force: np.ndarray,
) -> None:
    """Add the moments of all creases.

    Parameters
    ----------
    poses, rates : (n_bodies, 3) arrays
    bodies : (m, 2) int array
        Inner and outer body.
    angle_offset : (m,) array, rad
    law : CreaseLaws
    before : (m,) array
        Angles at a past state; not read if `per_second` is zero.
    per_second : float, 1/s
        Inverse of the time since the past state. If zero, the rates are those of the bodies.
    force : (n_bodies, 3) array, changed in place
    """
    for i in range(bodies.shape[0]):
        a, b = bodies[i, 0], bodies[i, 1]
        angle = poses[a, 2] - poses[b, 2] + angle_offset[i]
        rate = rates[a, 2] - rates[b, 2] if per_second == 0.0 else (angle - before[i]) * per_second
        effort, _ = crease_effort(law, i, angle, rate)
        force[a, 2] -= effort
        force[b, 2] += effort


@kernel
def linearise_crease_planar(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
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
    poses ... per_second, force : as in `force_crease_planar`
    slots : (m, 4) int array of `pair_slots`
    stiffness_data, damping_data : (n_blocks, 3, 3) arrays, changed in place
    """
    stiffness_flat, damping_flat = stiffness_data.reshape(-1), damping_data.reshape(-1)
    for i in range(bodies.shape[0]):
        a, b = bodies[i, 0], bodies[i, 1]
        angle = poses[a, 2] - poses[b, 2] + angle_offset[i]
        rate = rates[a, 2] - rates[b, 2] if per_second == 0.0 else (angle - before[i]) * per_second
        effort, slope = crease_effort(law, i, angle, rate)
        force[a, 2] -= effort
        force[b, 2] += effort
        add_turn_planar(stiffness_flat, slots[i], slope)
        if law.damping[i] != 0.0:
            add_turn_planar(damping_flat, slots[i], law.damping[i])
