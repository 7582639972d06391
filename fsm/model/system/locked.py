"""Projection of velocities and accelerations of a system with locked directions, in Python.

The compiled form is `fsm.model.bodies.array_locked`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from fsm.interactions.driven import accelerate_driven
from fsm.kernels.blocks import BlockMatrix
from fsm.kernels.body_poses import gather_free, scatter_free
from fsm.model.bodies.array_locked import MOST, STALLED
from fsm.model.bodies.arrays import AT_ACCELERATIONS, AT_RATES, CLOSE, KEEP, MEASURE
from fsm.model.bodies.pattern import BodyPattern

if TYPE_CHECKING:
    from fsm.model.system.force_system import SegmentForces


def consistent(
    system: SegmentForces, pattern: BodyPattern, t: float, q: np.ndarray, u: np.ndarray, rate: np.ndarray
) -> bool:
    """See `fsm.solve.stepping.model`; `pattern` is that of the matrices."""
    from scipy.sparse.linalg import splu

    system.lock(0.0)
    poses, rates = (rows.copy() for rows in system.place(t, q, u))
    force, stiffness, free = np.zeros(rates.shape), pattern.zeros(), system.bodies.free

    def project(task: int) -> float:
        return sum(group.project(task, t, poses, rates, pattern, force, stiffness) for group in system.locking)

    def move(vector: np.ndarray, change: np.ndarray) -> None:
        vector += change
        scatter_free(free, vector, False, rates)

    project(MEASURE)
    linear = splu(BlockMatrix(pattern, stiffness + system.inertia(q, pattern)).bsr().tocsc())
    if project(CLOSE) > 0.0:
        q[:] = system.retract(q, linear.solve(gather_free(free, force)))
        poses[:] = system.place(t, q, u)[0]
        project(MEASURE)
    before = math.inf
    for _ in range(MOST):
        force[:] = 0.0
        error = project(AT_RATES)
        if not 0.0 < error < STALLED * before:
            break
        before = error
        move(u, linear.solve(gather_free(free, force)))
    project(MEASURE)
    others = system.wrenches(t, q, u)
    accelerate_driven(system.driven_arrays(), t, rates)
    move(rate, np.zeros(len(rate)))
    before = math.inf
    for number in range(MOST):
        force[:] = others
        error = project(AT_ACCELERATIONS)
        move(rate, linear.solve(gather_free(free, force) - system.momentum(q, rate)))
        if number > 1 and not 0.0 < error < STALLED * before:
            break
        before = error
    project(KEEP)
    return True
