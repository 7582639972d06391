"""What happens at a snap: motion with inertia and damping until it has died, or a slide where nothing damps it."""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np

from fsm.blocks import BlockMatrix
from fsm.errors import NotConverged
from fsm.kernels.block_lu import multiply_blocks
from fsm.solve.path_recorder import PathRecorder
from fsm.solve.generalized_alpha import GeneralizedAlpha
from fsm.solve.in_air import InAir
from fsm.solve.ledger import JUDGED_FROM
from fsm.solve.linear import LinearSolver
from fsm.solve.newton import negative_pivots
from fsm.system import System

__all__ = ["Calm", "move_until_calm", "slide"]

_CALM = 1e-4
"""Kinetic energy over the largest since the snap, below which rest is near."""
_AS_THE_PATH = 4.0
"""Kinetic energy of a motion along stable equilibria over that of their path, at most: it goes at twice the speed."""
_LOOKS = 8
"""Steps from one look at the path to the next."""
_RHO_INF = 0.6
_LOST = 2e-3
"""Energy error of one step, over the energy turned over, above which it was too long: it is done again, shorter."""
_SHORTER, _LONGER = 0.25, 1.5
_TRIES = 4
"""How often a step is done again; what is lost still is numerical damping of what is too fast to be followed."""
_RINGING = 500
"""Steps of a motion after which air takes from it what its own dampers do not."""
_RELAXATIONS = 3
_RELAXATION_TIME = 1e-3
"""s"""
_SLIDES = 200
_SLIDE_STEP = 0.02
"""Largest part of the span, or radians, of one step of a slide."""
_SETTLED = 1e-9
"""Step of Newton's method at which a slide has ended."""


class Calm(NamedTuple):
    """When a motion has died.

    Attributes
    ----------
    part, scale : -, J
        Kinetic energy that it must have come down to, far below its largest, over the energy turned over so far, or over
        `scale` if that is more.
    slow, wait : J, s
        Or only to what the drives bring about by themselves, or to four times that of the path of equilibria, after a while,
        where the stiffness is positive definite: a small snap never has much more.
    """

    part: float
    scale: float
    slow: float
    wait: float


def move_until_calm(
    system: System, recorder: PathRecorder, u: np.ndarray, until: float, calm: Calm, worst: float, rtol: float, begins: bool = True
) -> int:
    """Integrate with inertia and damping until the motion has died or the time is `until` (s).

    Stops, too, when the energy error is more than `worst` of the energy turned over. What rings on after some hundred steps,
    with friction alone to damp it, say, moves in air from there on, whose force on a body is proportional to its momentum.
    A motion that `begins` has velocities of statics; one that goes on has its own.

    Returns
    -------
    int
        Newton iterations taken.
    """
    began, earliest = recorder.time, recorder.time + calm.wait
    air: InAir | None = None
    if begins:
        u = _relaxed(system, recorder.time, recorder.q, u)
    solver = GeneralizedAlpha(system, recorder.time, recorder.q, u, rtol, rho_inf=_RHO_INF)
    largest, iterations, tries, steps = 0.0, 0, 0, 0
    while recorder.time < until:
        if steps == _RINGING:
            air = InAir(system, began)
            iterations += solver.iterations
            system = cast(System, air)
            solver = GeneralizedAlpha(system, recorder.time, recorder.q, recorder.u, rtol, rho_inf=_RHO_INF, max_step=solver.max_step)
        before, memory = (solver.t, solver.q, solver.u), system.memory()
        solver.step(recorder.next_save(until))
        seen = system.observe(solver.t, solver.q, solver.u)
        turned_over = recorder.turned_over_in_motion(solver.t, solver.q, seen)
        if air is not None:
            taken = air.taken(before[:2], (solver.t, solver.q))
            turned_over = turned_over._replace(dissipated=turned_over.dissipated + taken)
        if recorder.loss(seen, turned_over) > _LOST and tries < _TRIES:
            tries, iterations = tries + 1, iterations + solver.iterations
            system.restore(memory)
            shorter = _SHORTER * (solver.t - before[0])
            solver = GeneralizedAlpha(system, *before, rtol, rho_inf=_RHO_INF, max_step=shorter)
            continue
        tries, steps = 0, steps + 1
        solver.max_step *= _LONGER
        kinetic = seen.energy.kinetic
        quiet = calm.part * max(calm.scale, recorder.ledger.turnover)
        # a column that buckles is nearly straight for a while, far above its critical load, and hardly moves
        near = kinetic < quiet and (kinetic < calm.slow or steps % _LOOKS == 0)
        rests = near and _on_path(system, solver.t, solver.q, kinetic, calm.slow)
        recorder.dynamic(solver.t, solver.q, solver.u, seen, turned_over, rests)
        largest = max(largest, kinetic)
        if recorder.time >= JUDGED_FROM * until and recorder.ledger.relative_error > worst:
            break
        if kinetic < quiet and kinetic < _CALM * largest:
            break
        if rests and recorder.time >= earliest:
            break
    return iterations + solver.iterations


def _on_path(system: System, t: float, q: np.ndarray, kinetic: float, slow: float) -> bool:
    """Whether a state is near stable equilibria and no faster than their path, whose velocity is K^-1 dh/dt."""
    solver = LinearSolver()
    if negative_pivots(system, t, q, solver):
        return False
    if kinetic < slow:
        return True
    try:
        velocity = solver.solve(system.force_rate(t, q))
    except NotConverged:
        return False
    return kinetic < _AS_THE_PATH * 0.5 * float(velocity @ (system.mass(q) @ velocity))


def _relaxed(system: System, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Velocities for a motion to start with, from zero or the mean ones of the last step.

    Mean velocities are chords, and stiff dampers would answer with forces of their own, as they would to rest. So
    M (v - u)/tau = h(t, q, v) is solved at a fixed configuration: what is damped fast takes the velocity in balance, the
    rest keeps its own.
    """
    solver = LinearSolver()
    velocity = u
    for _ in range(_RELAXATIONS):
        linear = system.linearise(t, q, velocity)
        pattern = linear.damping.pattern
        inertia = system.inertia(q, pattern) / _RELAXATION_TIME
        solver.factorise(BlockMatrix(pattern, inertia + linear.damping.data))
        lag = multiply_blocks(pattern.indptr, pattern.indices, inertia, velocity - u)
        velocity = velocity + solver.solve(linear.force - lag)
    return velocity


def slide(system: System, recorder: PathRecorder, t: float) -> bool:
    """Slide downhill in energy at time t, just past a critical point, as if overdamped, to a stable equilibrium.

    Steps of (M/theta + K) dx = h with theta as large as the matrix stays positive definite and the step small, an
    implicit gradient flow, which never climbs; of K dx = h as soon as those are.

    Returns
    -------
    bool
        Whether a stable equilibrium was reached.
    """
    q, solver, theta = recorder.q, LinearSolver(), 0.0
    for _ in range(_SLIDES):
        linear = system.linearise(t, q, None)
        stiffness = linear.stiffness.symmetric()
        step, size = _downhill(system, solver, stiffness, linear.force)
        if step is None:  # not yet near a stable equilibrium: inertia holds the step back
            inertia = system.inertia(q, stiffness.pattern)
            diagonal = stiffness.pattern.diagonal
            softness = _ratio(inertia[diagonal], stiffness.data[diagonal])
            theta = 4.0 * theta if theta else 1e3 * softness
            while step is None:
                held = BlockMatrix(stiffness.pattern, stiffness.data + inertia / theta)
                step, size = _downhill(system, solver, held, linear.force)
                theta *= 0.5 if step is None else 1.0
                if theta < 1e-3 * softness:
                    return False
            size = np.inf
        q = system.retract(q, step)
        if size < _SETTLED:
            seen = system.observe(t, q, None)
            if not recorder.may_jump(t, q, seen):
                return False
            recorder.slide(t, q, seen)
            return True
    return False


def _downhill(
    system: System, solver: LinearSolver, matrix: BlockMatrix, force: np.ndarray
) -> tuple[np.ndarray | None, float]:
    """Step and its size over the span; None if the matrix is not positive definite or the step too long."""
    solver.factorise(matrix)
    step = solver.solve(force)
    size = float(np.abs(step / system.scales().span).max(initial=0.0))
    if solver.negative_pivots() or not size < _SLIDE_STEP:
        return None, np.inf
    return step, size


def _ratio(inertia: np.ndarray, stiffness: np.ndarray) -> float:
    """Smallest mass over stiffness on the diagonal: one over the square of the highest frequency, about."""
    size = inertia.shape[1]
    masses, springs = inertia[:, range(size), range(size)], np.abs(stiffness[:, range(size), range(size)])
    return float(np.min(masses / np.maximum(springs, 1e-300)))
