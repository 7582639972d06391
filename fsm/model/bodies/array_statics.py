"""Kernels of bodies for quasi-static steps; see `fsm.model.system.array_statics`."""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d
from fsm.kernels.block_equations import Pattern
from fsm.kernels.body_poses import pose_difference, scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import call_at
from fsm.kernels.small_blocks import is_zero
from fsm.model.bodies import arrays as at
from fsm.model.bodies.arrays import Segments, springs_of
from fsm.solve.stepping.vectors import copy_into, subtracted


@kernel
def per_second_of(table: np.ndarray) -> float:
    """Inverse of the time since the last state, 1/s; zero at rest."""
    duration = floats_1d(table, at.INTERVAL)[1]
    return 1.0 / duration if duration > 0.0 else 0.0


@kernel
def place_mean(table: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Write poses and mean rates of the free bodies; returns the increments since the last state, empty at rest."""
    free, poses, duration = integers_1d(table, at.FREE), floats_2d(table, at.POSES), floats_1d(table, at.INTERVAL)[1]
    no = q.shape[0] < 0  # this is a variable, because a constant would cause a new compilation of the kernel
    scatter_free(free, q, not no and poses.shape[1] == 7, poses)
    if not duration > 0.0:
        return q[:0]
    last = floats_1d(table, at.LAST_Q)
    since = pose_difference(last, q) if poses.shape[1] == 7 else subtracted(q, last)
    mean = np.empty(since.shape[0])
    for i in range(mean.shape[0]):
        mean[i] = since[i] / duration
    scatter_free(free, mean, no, floats_2d(table, at.RATES))
    return since


@kernel
def add_damping(damping: np.ndarray, per_second: float, matrix: np.ndarray) -> None:
    """Add D/dt to block data."""
    if per_second > 0.0:
        flat, values = matrix.reshape(-1), damping.reshape(-1)
        for i in range(flat.shape[0]):
            flat[i] += per_second * values[i]


@kernel
def largest_force_along(
    matrix: np.ndarray, pattern: Pattern, span: np.ndarray, force_scale: np.ndarray, held: np.ndarray
) -> float:
    """See `StaticCalls.largest_force`; the last rows have a 1 in `held` if they are held and do not count."""
    largest = 0.0
    size = matrix.shape[1]
    free = (pattern.rows.shape[0] - 1) * size - held.shape[0]
    for row in range(pattern.rows.shape[0] - 1):
        for block in range(pattern.rows[row], pattern.rows[row + 1]):
            if is_zero(matrix[block]):
                continue
            first = pattern.columns[block] * size
            for i in range(size):
                force, number = 0.0, row * size + i - free
                if number >= 0 and held[number] == 1:
                    continue
                for j in range(size):
                    force = max(force, abs(matrix[block, i, j]) * span[first + j])
                largest = max(largest, force / force_scale[row * size + i])
    return largest


@kernel
def advance_by(model: Segments, change: np.ndarray, cut: bool) -> None:
    """Advance efforts and depths by increments (n_bodies, 3 or 6) from the present poses; see `StaticCalls.advance`."""
    table = model.table
    poses, springs = floats_2d(table, at.POSES), springs_of(table)
    later = model.by_springs.advance(poses, change, springs.bodies, springs.constants, springs.last, per_second_of(table))
    copy_into(later, springs.efforts)
    if model.groups.shape[0] > 0 and not cut:
        model.by_contacts.advance(model.groups, change, per_second_of(table))


@kernel
def take_up(model: Segments, task: int) -> float:
    """See `StaticCalls`."""
    found = 0.0
    for k in range(model.elements.shape[0]):
        found += call_at(model.elements[k, at.TAKE_UP_BY], model.table, model.element_tables[k], 0.0, float(task))
    return found
