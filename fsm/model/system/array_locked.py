"""Kernels of a compiled model (`ArrayModel`) for locked directions; see `fsm.solve.stepping.model` and
`fsm.model.elements.joints`.

Velocities and accelerations are projected with the matrix M + r J^T J, whose penalty is 1e7 times the inertia of each
opening. Each solution reduces the rates of openings by about this factor; the loops end at round-off. In steps of
generalized-alpha, M of nodes is M + h D, with the damping D of the last tangent and h^2 the inverse of the factor of M in
the matrix of the step. Else a projection would excite modes of flexible parts that are damped much faster than a step, and
their u' would be huge. A frame at the rates T u of its vectors has the acceleration T u' + (dT/dt) u.
"""

from __future__ import annotations

import math

import numpy as np

from fsm.interactions.driven import accelerate_driven
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.block_lu import REFINE_ABOVE
from fsm.kernels.body_poses import gather_free
from fsm.kernels.jit import kernel
from fsm.model.bodies import arrays as rows
from fsm.model.bodies.array_locked import add_inertia, do_along_rates, project
from fsm.model.bodies.array_locked import lock as lock_bodies
from fsm.model.nodes import arrays as of_nodes
from fsm.model.nodes.arrays import Coordinates
from fsm.model.nodes.system.array_forces import (
    factorise_matrix,
    forces_of_coordinates,
    hold_rows,
    rows_times,
    solve,
)
from fsm.model.system import arrays as at
from fsm.model.system.array_forces import add_from_frames, fill_turns, free_bodies, place, retract, spread, sum_forces
from fsm.model.system.arrays import Joined, sizes
from fsm.model.system.condense import add_condensed
from fsm.solve.stepping.vectors import copy_into, scaled

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_POINTS = tuple((0.5 + 0.5 * s, 0.5 * w) for s, w in zip(_NODES.tolist(), _WEIGHTS.tolist(), strict=True))
_POINTS = (*_POINTS, (0.5 - 0.5 / math.sqrt(3.0), -0.5), (0.5 + 0.5 / math.sqrt(3.0), -0.5))
"""Gauss points of a step, and their weights: four for the mean gradient, then both of the mean-force method."""
MOST = 50
"""Largest number of solutions of a projection."""
STALLED = 0.25
"""Ratio of successive errors (squares) above which only round-off is left."""
SETTLED = 1e-20
"""Change (a square) of accelerations relative to them, at which friction is that of the reactions."""
EXACT = 1e-26
"""Error (a square) relative to the first ones, at which rates and accelerations are exact."""


@kernel
def lock(model: Joined, by_acceleration: float) -> bool:
    """See `fsm.solve.stepping.model`."""
    floats_1d(model.bodies.table, rows.INTERVAL)[rows.LOCKED_BY] = by_acceleration
    least = _least_of_waves(model.nodes, model) if by_acceleration > 0.0 else 0.0
    return bool(lock_bodies(model.bodies, by_acceleration + least))


@kernel
def _least_of_waves(nodes: Coordinates | None, model: Joined) -> float:
    """Least factor on the inertia, 1/s^2; see `JoinedArrays.waves`."""
    if nodes is None:
        return 0.0
    return float(floats_1d(model.table, at.WAVES)[0])


@kernel
def advance(model: Joined, change: np.ndarray) -> bool:
    """See `fsm.solve.stepping.model`."""
    table = model.bodies.table
    spread(model, change, floats_2d(table, rows.RATES))
    do_along_rates(model.bodies, table, rows.STEP, 1.0)
    return True


@kernel
def measure_step(model: Joined, t: float, h: float, q: np.ndarray, x: np.ndarray) -> bool:
    """See `fsm.solve.stepping.model`."""
    _place(model, t + h, retract(model, q, x), x)
    project(model.bodies, t + h, rows.AT_END)
    for part, weight in _POINTS:
        place(model, t + part * h, retract(model, q, scaled(part, x)), x)
        project(model.bodies, weight, rows.ALONG_STEP)
    return True


@kernel
def _measure_and_factorise(model: Joined, t: float) -> None:
    """Measure openings at the present poses, and factorise M + r J^T J."""
    stiffness = floats_3d(model.bodies.at_rest, rows.STIFFNESS)
    stiffness[:] = 0.0
    project(model.bodies, t, rows.MEASURE)
    _factorise(model.projection, model, stiffness)


@kernel
def _factorise(own: Coordinates | None, model: Joined, stiffness: np.ndarray) -> None:
    bodies, p = model.bodies, rows.pattern_of(model.bodies.at_rest)
    if own is None:
        matrix = floats_3d(bodies.at_rest, rows.MATRIX)
        copy_into(stiffness, matrix)
        add_inertia(bodies.at_rest, 1.0)
        bodies.equations.factorise(
            matrix, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, True,
            floats_3d(bodies.at_rest, rows.FACTORS),
        )  # fmt: skip
        return
    joined, table, members = floats_3d(own.table, of_nodes.MATRIX), model.table, floats_3d(model.table, at.MEMBERS)
    copy_into(floats_3d(own.table, of_nodes.MASS), joined)
    _add_damping(own, floats_1d(bodies.table, rows.INTERVAL)[rows.LOCKED_BY], joined)
    add_condensed(
        p.rows, p.columns, stiffness, integers_1d(table, at.OF_MEMBERS), members, members, integers_1d(table, at.STARTS),
        integers_1d(table, at.SLOTS), joined,
    )  # fmt: skip
    hold_rows(own.table, floats_1d(own.table, of_nodes.NUMBERS)[of_nodes.HELD_STIFFNESS], joined)
    factorise_matrix(own, False)


@kernel
def _add_damping(own: Coordinates, by_acceleration: float, matrix: np.ndarray) -> None:
    """Add h D with h^2 = 1/`by_acceleration`, unless that is zero."""
    if by_acceleration > 0.0:
        damping, step = floats_3d(own.table, of_nodes.DAMPING), 1.0 / np.sqrt(by_acceleration)
        for i in range(matrix.shape[0]):
            for j in range(matrix.shape[1]):
                for k in range(matrix.shape[2]):
                    matrix[i, j, k] += step * damping[i, j, k]


@kernel
def _correction(own: Coordinates | None, model: Joined, right: np.ndarray) -> np.ndarray:
    """Solution (nu,) with the factors of the projection; further solutions reduce its error."""
    if own is None:
        table, p = model.bodies.at_rest, rows.pattern_of(model.bodies.at_rest)
        x: np.ndarray
        x, _, _ = model.bodies.equations.solve(
            p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, floats_3d(table, rows.FACTORS), p.rows, p.columns,
            floats_3d(table, rows.MATRIX), right, REFINE_ABOVE, True, True,
        )  # fmt: skip
        return x
    return solve(own, right)


@kernel
def _folded(nodes: Coordinates | None, model: Joined, wrenches: np.ndarray) -> np.ndarray:
    """Generalised forces (nu,) of wrenches (n_bodies, 3 or 6) on bodies and frames; zero at held coordinates."""
    of_bodies = gather_free(integers_1d(model.bodies.table, rows.FREE), wrenches)
    if nodes is None:
        return of_bodies
    held, first = integers_2d(nodes.table, of_nodes.FIXED).reshape(-1), of_bodies.shape[0]
    out = np.zeros(first + held.shape[0])
    copy_into(of_bodies, out[:first])
    add_from_frames(model, wrenches, out[first:])
    for i in range(held.shape[0]):
        if held[i] == 1:
            out[first + i] = 0.0
    return out


@kernel
def _place(model: Joined, t: float, q: np.ndarray, u: np.ndarray) -> None:
    """Write a state, also to the rates of the arrays at rest."""
    place(model, t, q, u)
    copy_into(floats_2d(model.bodies.table, rows.RATES), floats_2d(model.bodies.at_rest, rows.RATES))


@kernel
def _in_tree(model: Joined, inside: bool) -> bool:
    """Whether a state is inside a step, and the joints form no loops and have no friction that follows reactions."""
    interval = floats_1d(model.bodies.table, rows.INTERVAL)
    return inside and interval[rows.LOOPS] == 0.0 and interval[rows.FEELS] == 0.0


@kernel
def _add(change: np.ndarray, vector: np.ndarray) -> None:
    for i in range(vector.shape[0]):
        vector[i] += change[i]


@kernel
def close_openings(model: Joined, t: float, q: np.ndarray, u: np.ndarray, inside: bool) -> bool:
    """Correct q and u as `fsm.solve.stepping.model.consistent` does, and measure openings there; multipliers are zero.

    `inside` a step, q stays; in a tree of joints one solution corrects u.
    """
    bodies, force = model.bodies, floats_2d(model.bodies.at_rest, rows.FORCE)
    lock_bodies(bodies, 0.0)
    _place(model, t, q, u)
    _measure_and_factorise(model, t)
    force[:] = 0.0
    if not inside and project(bodies, t, rows.CLOSE) > 0.0:
        copy_into(retract(model, q, _correction(model.projection, model, _folded(model.nodes, model, force))), q)
        _place(model, t, q, u)
        _measure_and_factorise(model, t)  # with the old factors, r times the square of the rotation limits convergence
    before, largest = np.inf, 0.0
    for _ in range(1 if _in_tree(model, inside) else MOST):
        force[:] = 0.0
        error = project(bodies, t, rows.AT_RATES)
        if not EXACT * largest < error < STALLED * before:
            break
        before, largest = error, max(largest, error)
        _add(_correction(model.projection, model, _folded(model.nodes, model, force)), u)
        _place(model, t, q, u)
    project(bodies, t, rows.BEND)
    return True


@kernel
def _set_accelerations(model: Joined, t: float, rate: np.ndarray) -> None:
    """Write the accelerations of all bodies and frames to the rates of the arrays at rest."""
    rates = floats_2d(model.bodies.at_rest, rows.RATES)
    spread(model, rate, rates)
    _turn_frames(model.nodes, model, rates)
    accelerate_driven(rows.driven_of(model.bodies.table), t, rates)


@kernel
def _turn_frames(nodes: Coordinates | None, model: Joined, rates: np.ndarray) -> None:
    if nodes is None:
        return
    fill_turns(nodes, model)
    table, now = model.table, floats_1d(nodes.table, of_nodes.U)
    f, first, turns = at.frames_of(table), integers_1d(table, at.NODE_ROWS), floats_3d(table, at.TURNING)
    turns = turns[2 * free_bodies(model) :]
    for i in range(f.bodies.shape[0]):
        for j in range(f.first[i], f.first[i + 1]):
            for k in range(6):
                for c in range(3):
                    rates[f.bodies[i], k] += turns[j, k, c] * now[3 * first[j] + c]


@kernel
def find_multipliers(model: Joined, t: float, rate: np.ndarray, on_nodes: np.ndarray, inside: bool) -> bool:
    """Correct and keep accelerations and multipliers as `fsm.solve.stepping.model.consistent` does, after `close_openings`.

    The table of the bodies has the forces on all bodies and frames without the multipliers, and `on_nodes` are the other
    forces on the coordinates of nodes. `inside` a step of a tree of joints, there are two solutions: the first one has a
    small error normal to all motions that the joints allow, but its large penalties cause round-off of these motions.
    """
    bodies, force, few = model.bodies, floats_2d(model.bodies.at_rest, rows.FORCE), _in_tree(model, inside)
    mass = floats_1d(bodies.table, rows.MASS)
    _set_accelerations(model, t, rate)
    before, largest = np.inf, 0.0
    for number in range(MOST):
        copy_into(floats_2d(bodies.table, rows.FORCE), force)
        error = project(bodies, t, rows.AT_GIVEN if number == 0 else rows.AT_ACCELERATIONS)
        if number > 1 and (few or error <= EXACT * largest):
            break
        right = _folded(model.nodes, model, force)
        for i in range(mass.shape[0]):
            right[i] -= mass[i] * rate[i]
        _add_on_nodes(model.nodes, on_nodes, rate, right, mass.shape[0])
        _add(_correction(model.projection, model, right), rate)
        _set_accelerations(model, t, rate)
        if number > 1 and not 0.0 < error < STALLED * before:  # the first error follows from the given acceleration
            break
        before, largest = error, max(largest, error)
    project(bodies, t, rows.KEEP)
    floats_2d(bodies.at_rest, rows.RATES)[:] = 0.0
    return True


@kernel
def _add_on_nodes(
    nodes: Coordinates | None, on_nodes: np.ndarray, rate: np.ndarray, right: np.ndarray, first: int
) -> None:
    if nodes is None:
        return
    inertial = rows_times(of_nodes.mass_of(nodes.table), rate[first:])
    for i in range(inertial.shape[0]):
        right[first + i] += on_nodes[i] - inertial[i]


@kernel
def settled(model: Joined, t: float, before: np.ndarray, rate: np.ndarray) -> bool:
    """Whether friction that follows reactions is that of the multipliers which belong to it. If not, the multipliers become
    zero for another solution.

    Forces have the multipliers of the last solution. These iterations converge if friction changes reactions by less than
    itself; explicit steps end where they do not, as in a joint that jams. `before` (nu,) becomes the accelerations.
    """
    change = size = 0.0
    for i in range(rate.shape[0]):
        change += (rate[i] - before[i]) ** 2
        size += rate[i] ** 2
        before[i] = rate[i]
    if change <= SETTLED * size:
        return True
    _measure_and_factorise(model, t)
    return False


@kernel
def consistent(model: Joined, t: float, q: np.ndarray, u: np.ndarray, rate: np.ndarray, inside: bool) -> bool:
    """See `fsm.solve.stepping.model`."""
    if not lock_bodies(model.bodies, 0.0):
        return False
    feels, before = floats_1d(model.bodies.table, rows.INTERVAL)[rows.FEELS] > 0.0, np.zeros(rate.shape[0])
    stays = inside and model.table.shape[0] == 0  # without nodes
    close_openings(model, t, q, u, stays)
    for _ in range(MOST):
        sum_forces(model, t, 0.0, 1.0)
        find_multipliers(model, t, rate, _forces_on_nodes(model.nodes, model, q), stays)
        if not feels or settled(model, t, before, rate):
            return True
    if inside:
        rate[:] = np.nan
    return True


@kernel
def _forces_on_nodes(nodes: Coordinates | None, model: Joined, q: np.ndarray) -> np.ndarray:
    """Forces on the coordinates of nodes, apart from those on frames."""
    if nodes is None:
        return q
    return forces_of_coordinates(nodes.table, q[sizes(model)[0] :])
