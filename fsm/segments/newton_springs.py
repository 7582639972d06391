"""Newton's method of one quasi-static step in one kernel, for bodies joined by springs and dampers only.

It repeats the iterations of `fsm.solve.equilibrium_step` with the same kernels, and the results agree to the last bit. In a
small model, separate calls of the kernels cost several times as much as the kernels. If a step overshoots, diverges or
meets a singular matrix, this kernel returns without a result. `fsm.solve.equilibrium_step` then solves the whole step.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.bushing_planar import advance_efforts_planar, force_pose_planar, linearise_pose_planar
from fsm.interactions.bushing_spatial import advance_efforts_spatial, force_pose_spatial, linearise_pose_spatial
from fsm.kernels.block_lu import MAX_ERROR, REFINE_ABOVE, SYMMETRY_TOLERANCE, factorise, is_symmetric, solve_refined
from fsm.kernels.block_sum import effective_stiffness, multiply_block_diagonal
from fsm.kernels.body_poses import gather_free, increment_blocks, pose_difference, retract_poses, scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.newton_euler import add_gyroscopic, gyroscopic_damping
from fsm.kernels.vector import largest_ratio

__all__ = ["solve_springs"]


@kernel
def _forces(
    moving: bool,
    poses: np.ndarray,
    rates: np.ndarray,
    inertia: np.ndarray | None,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
    force: np.ndarray,
) -> None:
    """Compute the forces on all bodies into `force`."""
    force[:] = 0.0
    if inertia is None:
        force_pose_planar(poses, rates, bodies, constants, before, per_second, force)
    else:
        force_pose_spatial(poses, rates, bodies, constants, before, per_second, force)
        if moving:
            add_gyroscopic(rates, inertia, force)


@kernel
def _linearise(
    moving: bool,
    poses: np.ndarray,
    rates: np.ndarray,
    inertia: np.ndarray | None,
    since: np.ndarray,
    dof: np.ndarray,
    rows: np.ndarray,
    columns: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
    efforts: np.ndarray,
    slots: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    damping: np.ndarray,
) -> None:
    """Compute the forces, K and D into the last three arguments; `since` holds the increments from the last state."""
    force[:] = 0.0
    stiffness[:] = 0.0
    damping[:] = 0.0
    if inertia is None:
        linearise_pose_planar(
            poses, rates, bodies, constants, before, per_second, efforts, slots, force, stiffness, damping
        )
    else:
        if moving:
            add_gyroscopic(rates, inertia, force)
            gyroscopic_damping(rates, inertia, dof, rows, columns, damping)
            multiply_block_diagonal(damping, increment_blocks(since), columns)
        linearise_pose_spatial(
            poses, rates, bodies, constants, before, per_second, efforts, slots, force, stiffness, damping
        )


@kernel
def _largest(values: np.ndarray) -> float:
    """Largest magnitude of (n,) numbers."""
    largest = 0.0
    for i in range(values.shape[0]):
        largest = max(largest, abs(values[i]))
    return largest


@kernel
def _difference(start: np.ndarray, end: np.ndarray, inertia: np.ndarray | None) -> np.ndarray:
    """Increments (nu,) from one configuration to another."""
    if inertia is None:
        return end - start
    else:
        return pose_difference(start, end)


@kernel
def _retract(q: np.ndarray, dx: np.ndarray, inertia: np.ndarray | None) -> np.ndarray:
    """Configuration (nq,) displaced by increments."""
    if inertia is None:
        return q + dx
    else:
        return retract_poses(q, dx)


@kernel
def _advance(
    poses: np.ndarray,
    change: np.ndarray,
    inertia: np.ndarray | None,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
) -> np.ndarray:
    """Efforts after a change of the poses, to first order."""
    if inertia is None:
        return advance_efforts_planar(poses, change, bodies, constants, before, per_second)
    else:
        return advance_efforts_spatial(poses, change, bodies, constants, before, per_second)


@kernel
def solve_springs(
    q: np.ndarray,
    efforts: np.ndarray,
    q_before: np.ndarray,
    duration: float,
    poses: np.ndarray,
    rates: np.ndarray,
    free: np.ndarray,
    dof: np.ndarray,
    inertia: np.ndarray | None,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
    slots: np.ndarray,
    rows: np.ndarray,
    columns: np.ndarray,
    transposed: np.ndarray,
    order: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    diagonal: np.ndarray,
    place: np.ndarray,
    factors: np.ndarray,
    span: np.ndarray,
    to_force: np.ndarray,
    largest_span: float,
    largest_reaction: float,
    tolerance: float,
    round_off: float,
    small_correction: float,
    largest_correction: float,
    overshoot: float,
    large_residual: float,
    slow_reduction: float,
    patience: float,
    max_iterations: int,
) -> tuple[bool, np.ndarray, np.ndarray, np.ndarray, np.ndarray, bool, int, float]:
    """Find the equilibrium with u as the mean velocity since the last state.

    Parameters
    ----------
    q, efforts : initial configuration (nq,) and efforts (m, 3 or 6) of the springs
    q_before, duration : configuration of the last state, and elapsed time, s; zero: rates are ignored
    poses, rates : (n_bodies, 3 or 7) and (n_bodies, 3 or 6) arrays, rows of free bodies changed in place
        Rows of held and driven bodies are input and do not change.
    free, dof, inertia : see `fsm.segments.configuration.Bodies` and `fsm.segments.pattern.BodyPattern`
        None in the plane, where there is no gyroscopic term: the type selects the kernels at compile time. Such branches
        must be written with `if` and `else`.
    bodies, constants, before, per_second, slots : as in `linearise_pose_planar`
    rows, columns, transposed : block-sparse pattern of the matrix
    order, indptr, indices, diagonal, place : `Elimination` of the pattern
    factors : (n_filled, 3 or 6, 3 or 6) array, changed in place
        Factors of the last matrix.
    span, to_force : (nu,) arrays
        Scales of the increments and of the residual.
    largest_span : m or rad, largest of `span`
    largest_reaction : N
    tolerance ... max_iterations : see `fsm.system_records.NewtonRules`

    Returns
    -------
    settled : bool
        False if the iterations failed; the other results are then undefined.
    q, efforts : configuration and efforts at the equilibrium
    residual : (nu,) array, N and N m
    matrix : (n_blocks, 3 or 6, 3 or 6) array
        K + D/dt of the last iteration.
    symmetric : bool
        Whether the matrix is symmetric.
    iterations : int
    balanced : N
        Forces smaller than this are round-off.
    """
    spatial, moving = inertia is not None, duration > 0.0
    no = duration < 0.0  # a variable, because a constant would compile the kernels again
    change, force = np.zeros(rates.shape), np.empty(rates.shape)
    blocks = (columns.shape[0], rates.shape[1], rates.shape[1])
    stiffness, damping = np.empty(blocks), np.empty(blocks)
    own = np.empty((0, rates.shape[1]))
    matrix, symmetric, balanced = stiffness, False, 0.0
    failed = (False, q, efforts, q, matrix, False, 0, 0.0)
    step = since = np.zeros(span.shape[0])
    work = lost = 0.0
    size = last_size = np.inf
    for iteration in range(max_iterations + 1):
        scatter_free(free, q, spatial, poses)
        if moving:
            since = _difference(q_before, q, inertia)
            scatter_free(free, since / duration, no, rates)
        found = False
        if size < small_correction and iteration > 0:
            _forces(moving, poses, rates, inertia, bodies, constants, before, per_second, force)
            residual = gather_free(free, force)
            found = largest_ratio(residual, to_force) <= max(tolerance * largest_reaction, balanced)
            if found and iteration > 1:
                change[:] = 0.0
                efforts = _advance(poses, change, inertia, bodies, constants, before, per_second)
                return True, q, efforts, residual, matrix, symmetric, iteration, balanced
        # if the first iterate converged, its efforts were only predicted; the matrix uses the efforts at the state
        given = own if found else efforts
        _linearise(
            moving, poses, rates, inertia, since, dof, rows, columns, bodies, constants, before, per_second, given, slots,
            force, stiffness, damping,
        )  # fmt: skip
        if not found:
            residual = gather_free(free, force)
            left_over = largest_ratio(residual, to_force)
            if iteration == 0:
                lost = max(large_residual * largest_reaction, slow_reduction * left_over)
            overshot = work > 0.0 and np.sum(step * residual) < -overshoot * work
            wandering = (iteration > 7 and size > 2.0 * last_size) or (iteration >= patience and left_over > lost)
            if not np.isfinite(left_over) or overshot or wandering or iteration == max_iterations:
                return failed
        matrix = effective_stiffness(stiffness, damping, 1.0 / duration, None, columns) if moving else stiffness
        if iteration == 0:
            balanced = round_off * largest_span * _largest(matrix.reshape(-1))
        symmetric = is_symmetric(matrix, transposed, SYMMETRY_TOLERANCE)
        if factorise(matrix, place, indptr, indices, diagonal, symmetric, factors) >= 0:
            return failed
        step, error, _ = solve_refined(
            order, indptr, indices, diagonal, factors, rows, columns, matrix, residual, REFINE_ABOVE, symmetric, no
        )
        if not error <= MAX_ERROR:
            return failed
        if found:
            change[:] = 0.0
            efforts = _advance(poses, change, inertia, bodies, constants, before, per_second)
            return True, q, efforts, residual, matrix, symmetric, iteration, balanced
        work = np.sum(step * residual)
        last_size, size = size, largest_ratio(step, span)
        if not np.isfinite(size):
            return failed
        if size > largest_correction:
            step = step * (largest_correction / size)
        scatter_free(free, step, no, change)
        efforts = _advance(poses, change, inertia, bodies, constants, before, per_second)
        q = _retract(q, step, inertia)
    return failed
