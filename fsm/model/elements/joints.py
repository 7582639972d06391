"""Ideal joints: locked openings between two bodies. The group, its table, and its kernels.

A joint is a set of openings x (`fsm.interactions.openings`) that stay zero. Newton's method of a time step has the effort
lambda + r x of each opening and the tangent r J^T J + (lambda + r x) dJ/dq, and advances lambda by r (x + J d) with each
increment d (augmented Lagrangian; Bayo and Ledesma 1996). The penalty is r = 1e4 m c, with the mass m of the opening at the
start and c = d(acceleration)/d(increment); it has no effect on the converged step. After an accepted step the multipliers
are those of the accelerations, and r = 0. Openings that follow from others have multipliers too, those of least work.

A step of the mean-force method has the openings x at its end, and its multipliers act along the mean gradient over the step,
so that they do no work (the discrete gradient of Gonzalez 1999). The kernel of forces adds to the gradient at a Gauss point
of the step the difference between the mean of four points and that of two.

At rest (statics, natural modes) the penalty is r = 1e6 E s, with the energy scale E of `SegmentForces` and the size s of
the opening, and stays at accepted states too: the stiffness then has the stable and unstable modes of the motions that the
joints allow, and the opening of a state is the change of lambda in the last iteration over r. The second derivatives have
the effort lambda alone, because r x is large until the opening has closed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.interactions.openings import ACROSS, TURN, bend, opening
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import pieces_at, program_at
from fsm.kernels.programs import Pieces, Program, table_of
from fsm.kernels.rotation import rotation_matrix
from fsm.kernels.scatter import add_block
from fsm.model.bodies import arrays as row
from fsm.model.elements.element_group import OWN, ElementGroup, ElementKernels, bodies_of, nothing

_KINDS, _CONSTANTS, _MASSES, _PENALTY, _EFFORT, _VALUE, _GRADIENT, _BEND, _KEPT, _TURNS, _LINES = range(OWN, OWN + 11)
_STILL, _SIZES, _CHANGE, _PROGRAM, _PIECES = range(OWN + 11, OWN + 16)
_FELT, _MEAN, _MORE = range(_PIECES + len(Pieces._fields), _PIECES + len(Pieces._fields) + 3)
STIFF = 1e4
"""Penalty relative to the inertia of an opening at the start. From 1e2 to 1e5 the number of iterations is that of Newton's
method with exact multipliers; inertias change on the way."""
PROJECTION = 1e7
"""The same penalty of projections, and of accelerations at given positions and velocities. These are linear equations, so
each solution reduces the error by this factor."""
RIGID = 1e6
"""Penalty at rest relative to the energy scale over the square of the motion that opens by one, lengths relative to those
of bodies. Each iteration reduces errors of the multipliers by the ratio of the stiffness of an opening to its penalty."""

_TURN = 2.0
"""Largest turn in a step, rad; angles are counted from step to step."""


@kernel
def _measure(table: np.ndarray, own: np.ndarray, t: float, i: int, hessian: np.ndarray) -> None:
    """Write value and gradient of an opening at a time (s), and its second derivatives."""
    poses, bodies = floats_2d(table, row.POSES), bodies_of(own)
    floats_1d(own, _VALUE)[i] = opening(
        integers_1d(own, _KINDS)[i], poses[bodies[i, 0]], poses[bodies[i, 1]], floats_2d(own, _CONSTANTS)[i],
        _prescribed(own, t, i)[0], floats_2d(own, _GRADIENT)[i], hessian,
    )  # fmt: skip


@kernel
def _prescribed(own: np.ndarray, t: float, i: int) -> tuple[float, float, float]:
    """Prescribed value of an opening at a time (s), and its two derivatives; zero without a motor."""
    number = integers_1d(own, _PROGRAM)[i]
    if number < 0:
        return 0.0, 0.0, 0.0
    return program_at(pieces_at(own, _PIECES), number, t)


@kernel
def _push(force: np.ndarray, bodies: np.ndarray, gradient: np.ndarray, effort: float) -> None:
    """Add the forces of an effort to those of both bodies."""
    for side in range(2):
        for k in range(6):
            force[bodies[side], k] -= effort * gradient[6 * side + k]


@kernel
def _along(rates: np.ndarray, bodies: np.ndarray, gradient: np.ndarray) -> float:
    """Rate of an opening from the rates of all bodies."""
    total = 0.0
    for side in range(2):
        for k in range(6):
            total += gradient[6 * side + k] * rates[bodies[side], k]
    return total


@kernel
def _force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    force, bodies, gradient = floats_2d(table, row.FORCE), bodies_of(own), floats_2d(own, _GRADIENT)
    effort, penalty, value, hessian = _efforts(own), floats_1d(own, _PENALTY), floats_1d(own, _VALUE), np.empty((0, 12))
    for i in range(bodies.shape[0]):
        if effort[i] == 0.0 and penalty[i] == 0.0:
            continue  # projections measure openings, and find multipliers afterwards
        if along_step(floats_1d(own, _STILL)):
            along = _gradient_of_step(table, own, i, hessian)
            _push(force, bodies[i], along, effort[i] + penalty[i] * value[i])
        else:
            _measure(table, own, t, i, hessian)
            _push(force, bodies[i], gradient[i], effort[i] + penalty[i] * value[i])
    return 0.0


@kernel(inline=True)
def along_step(still: np.ndarray) -> bool:
    """Whether openings are those at the end of a step, and multipliers act along the mean gradient over it."""
    return bool(still[3] > 0.0)


@kernel
def _gradient_of_step(table: np.ndarray, own: np.ndarray, i: int, hessian: np.ndarray) -> np.ndarray:
    """Gradient (12,) of an opening for the present Gauss point of a step; writes the second derivatives there."""
    poses, bodies, more, found = floats_2d(table, row.POSES), bodies_of(own), floats_2d(own, _MORE), np.empty(12)
    opening(
        integers_1d(own, _KINDS)[i], poses[bodies[i, 0]], poses[bodies[i, 1]], floats_2d(own, _CONSTANTS)[i], 0.0, found,
        hessian,
    )  # fmt: skip
    for k in range(12):
        found[k] += more[i, k]
    return found


@kernel(inline=True)
def _efforts(own: np.ndarray) -> np.ndarray:
    return floats_1d(own, _EFFORT)


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    force, bodies, gradient = floats_2d(table, row.FORCE), bodies_of(own), floats_2d(own, _GRADIENT)
    effort, penalty, value, block = _efforts(own), floats_1d(own, _PENALTY), floats_1d(own, _VALUE), np.empty((12, 12))
    still = floats_1d(own, _STILL)[0] > 0.0
    stiffness, dof, p = floats_3d(table, row.STIFFNESS), integers_1d(table, row.DOF), row.pattern_of(table)
    mean = floats_2d(own, _MEAN)
    for i in range(bodies.shape[0]):
        if along_step(floats_1d(own, _STILL)):
            _push(force, bodies[i], _gradient_of_step(table, own, i, block), effort[i] + penalty[i] * value[i])
            for a in range(12):  # the mean state is half-way, and openings are those at the end
                for b in range(12):
                    block[a, b] = effort[i] * block[a, b] + 2.0 * penalty[i] * mean[i, a] * gradient[i, b]
            add_block(block, dof, bodies[i], p.rows, p.columns, stiffness)
            continue
        _measure(table, own, t, i, block)
        total = effort[i] + penalty[i] * value[i]
        _push(force, bodies[i], gradient[i], total)
        for a in range(12):
            for b in range(12):
                block[a, b] = (effort[i] if still else total) * block[a, b] + penalty[i] * gradient[i, a] * gradient[i, b]
        add_block(block, dof, bodies[i], p.rows, p.columns, stiffness)
    return 0.0


@kernel
def _lock(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Begin Newton's method of a step with the kept multipliers; `per_second` is c, 1/s^2, without effect at rest."""
    effort, penalty, kept, masses = _efforts(own), floats_1d(own, _PENALTY), floats_1d(own, _KEPT), floats_1d(own, _MASSES)
    felt, energy, sizes = floats_1d(own, _FELT), floats_1d(own, _STILL)[0], floats_1d(own, _SIZES)
    floats_1d(own, _STILL)[3] = 0.0
    for i in range(effort.shape[0]):
        effort[i], penalty[i] = kept[i], penalty_of(masses[i], sizes[i], per_second, energy)
        if per_second > 0.0 or energy > 0.0:
            felt[i] = kept[i]
    return 1.0


@kernel(inline=True)
def penalty_of(mass: float, size: float, by_acceleration: float, energy: float) -> float:
    """Penalty of an opening of this inertia and size: at rest with an energy scale, J, else in motions; 0 without inertia,
    as openings have that do not act.
    """
    if mass == 0.0:
        return 0.0
    return RIGID * energy * size if energy > 0.0 else STIFF * by_acceleration * mass


@kernel
def _advance(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Advance the multipliers by the part `per_second` of an increment of all bodies, which the rates of the model contain.

    The task t is `STEP`, or `AGAIN` to replace the last part by another one. `WORK` returns the work of the penalties along
    the increment instead, and `LARGEST` the largest force of a multiplier, N; moments count over the length of a body.
    """
    rates, bodies, gradient = floats_2d(table, row.RATES), bodies_of(own), floats_2d(own, _GRADIENT)
    effort, felt = _efforts(own), floats_1d(own, _FELT)
    along = np.empty(effort.shape[0])
    if t == row.WORK or t == row.STEP:
        for i in range(effort.shape[0]):
            along[i] = _along(rates, bodies[i], gradient[i])
    found = advance_efforts(
        t, per_second, effort, floats_1d(own, _PENALTY), floats_1d(own, _VALUE), along, floats_1d(own, _CHANGE),
        floats_1d(own, _SIZES), floats_1d(own, _STILL),
    )  # fmt: skip
    if t == row.STEP or t == row.AGAIN:
        for i in range(effort.shape[0]):
            felt[i] = effort[i]
    return found


@kernel
def advance_efforts(
    t: float, per_second: float, effort: np.ndarray, penalty: np.ndarray, value: np.ndarray, along: np.ndarray,
    change: np.ndarray, sizes: np.ndarray, still: np.ndarray,
) -> float:  # fmt: skip
    """Advance the multipliers of locked directions, whose openings change by `along` (n,); see `ElementKernels`."""
    work = 0.0
    if t == row.LARGEST:
        for i in range(effort.shape[0]):
            work = max(work, abs(effort[i]) / np.sqrt(2.0 * sizes[i]) / still[2])
        return work
    if t == row.WORK:
        for i in range(effort.shape[0]):
            work += penalty[i] * value[i] * along[i]
        return work
    if t == row.STEP:
        still[1] = 0.0
        for i in range(effort.shape[0]):
            change[i] = penalty[i] * (value[i] + along[i])
    part = per_second - still[1]
    still[1] = per_second
    for i in range(effort.shape[0]):
        effort[i] += part * change[i]
    return 0.0


@kernel
def _project(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Task `per_second` of a projection, and its error.

    `MEASURE`: openings at the present poses, penalties in the stiffness, multipliers of zero. `BEND`: their second
    derivatives in time at the present rates. `CLOSE`: forces
    against openings. `AT_RATES`: forces against opening rates. `AT_ACCELERATIONS`: the rates of the model are accelerations;
    the multipliers advance by the penalties times the opening accelerations, and add to these forces. `AT_GIVEN`: forces
    against opening accelerations, without a change of the multipliers, which are zero. `KEEP`: keep the multipliers. `SWAP`:
    exchange the present multipliers and the kept ones. `AT_END`: openings at the end of a step, whose increments are the
    rates of the model. `ALONG_STEP`: a point of the step, of the weight t. The error is the sum of m y^2 over all openings.
    """
    task = int(per_second)
    force, rates, bodies = floats_2d(table, row.FORCE), floats_2d(table, row.RATES), bodies_of(own)
    gradient, value = floats_2d(own, _GRADIENT), floats_1d(own, _VALUE)
    effort, masses, bends = _efforts(own), floats_1d(own, _MASSES), floats_1d(own, _BEND)
    if task == row.SWAP:
        swap(effort, floats_1d(own, _KEPT))
        return 0.0
    if task == row.KEEP:
        kept, penalty, felt = floats_1d(own, _KEPT), floats_1d(own, _PENALTY), floats_1d(own, _FELT)
        for i in range(effort.shape[0]):
            kept[i], penalty[i], felt[i] = effort[i], 0.0, effort[i]
        return 0.0
    if task == row.MEASURE:
        _measure_all(table, own, t)
        return 0.0
    if task == row.BEND:
        _bend_all(table, own)
        return 0.0
    if task == row.AT_END:
        _measure_end(table, own, t)
        return 0.0
    if task == row.ALONG_STEP:
        _measure_along(table, own, t)
        return 0.0
    error = 0.0
    for i in range(bodies.shape[0]):
        _, speed, pick_up = _prescribed(own, t, i)
        rate = value[i] if task == row.CLOSE else _along(rates, bodies[i], gradient[i])
        if task == row.AT_RATES:
            rate -= speed
        if task in (row.AT_ACCELERATIONS, row.AT_GIVEN):
            rate += bends[i] - pick_up
        total = PROJECTION * masses[i] * rate
        if task == row.AT_ACCELERATIONS:
            effort[i] += total
            total += effort[i]
        _push(force, bodies[i], gradient[i], total)
        error += masses[i] * rate * rate
    return error


@kernel
def swap(efforts: np.ndarray, kept: np.ndarray) -> None:
    """Exchange efforts and the first numbers of the memory."""
    for i in range(efforts.shape[0]):
        efforts[i], kept[i] = kept[i], efforts[i]


@kernel
def _measure_all(table: np.ndarray, own: np.ndarray, t: float) -> None:
    """Openings and their penalties, with multipliers of zero."""
    bodies, stiffness, hessian = bodies_of(own), floats_3d(table, row.STIFFNESS), np.empty((0, 12))
    gradient, masses, effort = floats_2d(own, _GRADIENT), floats_1d(own, _MASSES), _efforts(own)
    dof, p, block, last = integers_1d(table, row.DOF), row.pattern_of(table), np.zeros((12, 12)), bodies.shape[0] - 1
    felt = floats_1d(own, _FELT)
    for i in range(bodies.shape[0]):
        _measure(table, own, t, i, hessian)
        effort[i] = 0.0
        if not np.isfinite(felt[i]):
            felt[i] = 0.0  # a step that was too long
        for a in range(12):
            factor = PROJECTION * masses[i] * gradient[i, a]
            for b in range(12):
                block[a, b] += factor * gradient[i, b]
        if i == last or bodies[i + 1, 0] != bodies[i, 0] or bodies[i + 1, 1] != bodies[i, 1]:
            add_block(block, dof, bodies[i], p.rows, p.columns, stiffness)
            block[:] = 0.0


@kernel
def _measure_end(table: np.ndarray, own: np.ndarray, t: float) -> None:
    """Openings at the end of a step, and their derivatives by increments of its middle: to second order in the rotation x of
    the step, g + x/4 x g in the axes of a body.
    """
    bodies, gradient, rates = bodies_of(own), floats_2d(own, _GRADIENT), floats_2d(table, row.RATES)
    hessian = np.empty((0, 12))
    for i in range(bodies.shape[0]):
        _measure(table, own, t, i, hessian)
        for side in range(2):
            x, g = rates[bodies[i, side], 3:], gradient[i, 6 * side + 3 : 6 * side + 6]
            a, b, c = g[0], g[1], g[2]
            g[0] += 0.25 * (x[1] * c - x[2] * b)
            g[1] += 0.25 * (x[2] * a - x[0] * c)
            g[2] += 0.25 * (x[0] * b - x[1] * a)
    floats_2d(own, _MEAN)[:] = 0.0
    floats_2d(own, _MORE)[:] = 0.0
    floats_1d(own, _STILL)[3] = 1.0


@kernel
def _measure_along(table: np.ndarray, own: np.ndarray, weight: float) -> None:
    """Add the gradients at a point of a step to their mean; a negative weight is that of a Gauss point of the method."""
    poses, bodies, mean, more = floats_2d(table, row.POSES), bodies_of(own), floats_2d(own, _MEAN), floats_2d(own, _MORE)
    kinds, constants, gradient = integers_1d(own, _KINDS), floats_2d(own, _CONSTANTS), np.empty(12)
    hessian = np.empty((0, 12))
    for i in range(bodies.shape[0]):
        opening(kinds[i], poses[bodies[i, 0]], poses[bodies[i, 1]], constants[i], 0.0, gradient, hessian)
        for k in range(12):
            mean[i, k] += max(weight, 0.0) * gradient[k]
            more[i, k] += weight * gradient[k]


@kernel
def _bend_all(table: np.ndarray, own: np.ndarray) -> None:
    """Second derivatives in time of the openings at constant rates."""
    poses, rates, bodies = floats_2d(table, row.POSES), floats_2d(table, row.RATES), bodies_of(own)
    bends = floats_1d(own, _BEND)
    kinds, constants, speed = integers_1d(own, _KINDS), floats_2d(own, _CONSTANTS), np.empty(12)
    for i in range(bodies.shape[0]):
        first, second = bodies[i, 0], bodies[i, 1]
        speed[:6], speed[6:] = rates[first, :6], rates[second, :6]
        bends[i] = bend(kinds[i], poses[first], poses[second], constants[i], speed)


@kernel
def _part(table: np.ndarray, own: np.ndarray, t: float, step: float) -> float:
    """Shorten a step in which an angle may turn by more than half a turn."""
    poses, turns, lines = floats_2d(table, row.POSES), integers_2d(own, _TURNS), floats_2d(own, _LINES)
    gradient, hessian, rates, most = np.empty(12), np.empty((0, 12)), floats_2d(table, row.RATES), 0.0
    for i in range(turns.shape[0]):
        opening(TURN, poses[turns[i, 0]], poses[turns[i, 1]], lines[i], 0.0, gradient, hessian)
        most = max(most, abs(_along(rates, turns[i], gradient)) * step)
    return _TURN / most if most > _TURN else 0.0


@kernel
def _accept(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Count the turns of all angles; at rest, keep the multipliers."""
    poses, turns, lines = floats_2d(table, row.POSES), integers_2d(own, _TURNS), floats_2d(own, _LINES)
    kept, count, gradient, hessian = floats_1d(own, _KEPT), _efforts(own).shape[0], np.empty(12), np.empty((0, 12))
    if floats_1d(own, _STILL)[0] > 0.0:
        for i in range(count):
            kept[i] = _efforts(own)[i]
    for i in range(turns.shape[0]):
        k = count + i  # the angle since the last state is less than half a turn
        kept[k] += opening(TURN, poses[turns[i, 0]], poses[turns[i, 1]], lines[i], kept[k], gradient, hessian)
    return 0.0


@kernel
def _put_in(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Add the power of the motors, W; nothing is dissipated.

    Speeds are those at t, or mean values over a step that ends at t (`per_second` positive) or begins there (negative).
    """
    effort, stored = _efforts(own), floats_1d(table, row.STORED)
    if integers_1d(own, _PIECES).shape[0] == 1:
        return 0.0  # there are no motors
    for i in range(effort.shape[0]):
        at, speed, _ = _prescribed(own, t, i)
        if per_second != 0.0 and floats_1d(own, _STILL)[0] > 0.0:
            speed = (at - _prescribed(own, t - 1.0 / per_second, i)[0]) * per_second
        stored[2] -= effort[i] * speed
    return 0.0


_KERNELS = ElementKernels(
    _force, _tangent, nothing, lost=_put_in, accept=_accept, lock=_lock, advance=_advance, project=_project, part=_part
)  # fmt: skip


@dataclass(frozen=True)
class JointGroup(ElementGroup):
    """Openings of all ideal joints.

    Attributes
    ----------
    bodies : (n, 2) int array
        First and second body of each opening.
    kinds : (n,) int array, see `fsm.interactions.openings`
    constants : (n, 14) array, see `fsm.interactions.openings`
    masses : (n,) array, kg or kg m^2
        Inertia of each opening at the start.
    turns : (k, 2) int array
        Bodies of each angle.
    lines : (k, 14) array
        Constants of the kind `TURN` of each angle.
    names : names of the joints
    of : (n,) int array
        Number of the joint of each opening.
    program : (n,) int array
        Number of the motor of each opening in `motors`, -1 without a motor.
    motors : functions of time of the coordinates
    spare : number of the last openings, which act only while an event locks their joint
    """

    bodies: np.ndarray
    kinds: np.ndarray
    constants: np.ndarray
    masses: np.ndarray
    turns: np.ndarray
    lines: np.ndarray
    names: tuple[str, ...]
    of: np.ndarray
    program: np.ndarray
    motors: tuple[Program, ...]
    spare: int = 0
    categories = ()
    rate_dependent = False
    locks = has_events = True
    kernels = _KERNELS

    @cached_property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        n = len(self.kinds)
        work = [np.zeros(n), np.zeros(n), np.zeros(n), np.zeros((n, 12)), np.zeros(n)]
        kept = np.zeros(n + len(self.turns))
        moved = self.program, *table_of(self.motors)
        still, along = (np.zeros(4), np.zeros(n), np.zeros(n)), (np.zeros((n, 12)), np.zeros((n, 12)))
        own = self.kinds, self.constants, self.masses, *work, kept, self.turns, self.lines, *still, *moved, self.felt
        return [*own, *along]

    @cached_property
    def active(self) -> np.ndarray:
        """1 for the openings (n,) that act, 0 for those that do not, in place; the latter have no inertia."""
        return np.asarray(np.arange(len(self.kinds)) < len(self.kinds) - self.spare, dtype=float)

    def lock_at(self, rows: np.ndarray, poses: np.ndarray) -> None:
        """Close openings (rows) of one joint at the present poses."""
        turning = [i for i in rows.tolist() if self.kinds[i] == ACROSS]
        if turning:  # axes of a fixed joint, each at right angles to the next
            first, second = (rotation_matrix(poses[body, 3:]) for body in self.bodies[turning[0]])
            axes = self.constants[turning, :3] @ first.T @ second
            self.constants[turning, 3:6] = np.roll(axes, -1, axis=0)
        values = self.openings(poses)[0]
        for i in (i for i in rows.tolist() if self.kinds[i] != ACROSS):
            self.constants[i, 6] += values[i]

    def let_go(self) -> None:
        """Set the multipliers of openings that do not act to zero."""
        for efforts in (self.efforts, self.arrays[_EFFORT - OWN], self.felt):
            efforts[self.active == 0.0] = 0.0

    @cached_property
    def felt(self) -> np.ndarray:
        """Multipliers (n,) of the last iteration, N or N m, for friction."""
        return np.zeros(len(self.kinds))

    def break_times(self) -> set[float]:
        """See `Group`."""
        return {time for motor in self.motors for time in motor.breaks()}

    @property
    def memory_of(self) -> np.ndarray:
        """Multipliers (n,) of the last accepted state, N or N m, and angles (k,) with their turns, rad."""
        return self.arrays[_KEPT - OWN]

    @property
    def first_memory(self) -> np.ndarray:
        """See `ElementGroup`."""
        return np.zeros(len(self.memory_of))

    def restore(self, memory: np.ndarray) -> None:
        """See `ElementGroup`."""
        super().restore(memory)
        self.lock(0.0)
        self.felt[:] = self.efforts

    @property
    def looks_back(self) -> bool:
        """See `ElementGroup`; whether there are motors with prescribed coordinates."""
        return len(self.motors) > 0

    @property
    def still(self) -> np.ndarray:
        """See `ElementGroup`."""
        return self.arrays[_STILL - OWN]

    @property
    def sizes(self) -> np.ndarray:
        """See `ElementGroup`."""
        return self.arrays[_SIZES - OWN]

    @property
    def acting(self) -> np.ndarray:
        """See `ElementGroup`."""
        return self.masses > 0.0

    def gradients(self, poses: np.ndarray) -> np.ndarray:
        """See `ElementGroup`."""
        return self.openings(poses)[1].reshape(-1, 2, 6)

    def pass_time(self, t: float, passed: float) -> None:
        """See `ElementGroup`."""
        for i in np.flatnonzero(self.program >= 0).tolist():
            self.arrays[_VALUE - OWN][i] -= self.motors[self.program[i]].at(t)[1] * passed

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`."""
        moved = np.flatnonzero(self.program >= 0).tolist()
        if not moved:
            return
        gradients, penalties = self.gradients(poses), self.arrays[_PENALTY - OWN]
        for i in moved:
            rate = penalties[i] * self.motors[self.program[i]].at(t)[1]
            np.add.at(force_rate, self.bodies[i], rate * gradients[i])

    @property
    def efforts(self) -> np.ndarray:
        """Multipliers (n,) of the last accepted state, N or N m."""
        return self.memory_of[: len(self.kinds)]

    @property
    def angles(self) -> np.ndarray:
        """Angles (k,) of the last accepted state with their turns, zero at the start, rad."""
        return self.memory_of[len(self.kinds) :]

    def openings(self, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Openings (n,), m or rad, and their gradients (n, 12)."""
        values, gradients, hessian = np.zeros(len(self.kinds)), np.zeros((len(self.kinds), 12)), np.zeros((12, 12))
        for i, (a, b) in enumerate(self.bodies.tolist()):
            values[i] = opening(int(self.kinds[i]), poses[a], poses[b], self.constants[i], 0.0, gradients[i], hessian)
        return values, gradients
