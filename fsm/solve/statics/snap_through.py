"""Snap-through: motion with inertia and damping until it has decayed, or a slide without damping."""

from __future__ import annotations

import math
from typing import NamedTuple, cast

import numpy as np

from fsm.errors import NotConverged
from fsm.kernels.block_lu import multiply_blocks
from fsm.kernels.blocks import BlockMatrix
from fsm.kernels.vector import mean_ratio
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.equations.newton import at_rest, negative_pivots
from fsm.solve.interface.system import System
from fsm.solve.outcome.status import Outcome, StepFailed
from fsm.solve.settings import PathSettings
from fsm.solve.statics.path_recorder import PathRecorder
from fsm.solve.stepping.generalized_alpha import STEP_SIZE
from fsm.solve.stepping.model import KINETIC
from fsm.solve.stepping.path import EXACT
from fsm.solve.time.artificial_damping import DampedSystem
from fsm.solve.time.generalized_alpha import GeneralizedAlpha

_CALM = 1e-4
"""Kinetic energy relative to its largest value since the snap, below which the motion is nearly at rest."""
_AS_THE_PATH = 4.0
"""Largest ratio of the kinetic energy of a motion along stable equilibria to the kinetic energy of the equilibrium path
(twice the speed)."""
_LOOKS, _FEW = 8, 2
"""Steps between two checks of the path, and steps of one kernel where the motion may end; the energy balance is checked at
their end."""
_RHO_INF = 0.6
_LOST = 2e-3
"""Energy error of one step, or of the steps of one kernel, relative to the reference energy, above which they are repeated:
several steps one by one, and one step with a shorter size."""
_IN_MOTION = 10.0
"""Tolerance of the motion relative to the tolerance of the path."""
_SHORTER, _LONGER = 0.25, 1.5
_TRIES = 4
"""Largest number of repetitions of a step; the remaining loss is numerical damping of fast modes."""
_RINGING = 500
"""Steps of a motion after which artificial damping is added."""
_RELAXATIONS = 3
_RELAXATION_TIME = 1e-2
"""Time of the relaxation, relative to the first step of the path, or to the time in which the forces at rest move the parts
by their span if that is shorter."""
_SLIDES = 200
_SLIDE_STEP = 0.02
"""Largest step of a slide, relative to the span or in rad."""
_SETTLED = 1e-9
"""Size of the Newton step below which a slide has ended."""


class RestCriterion(NamedTuple):
    """Criterion for the end of a motion.

    Attributes
    ----------
    part, scale : -, J
        Bound of the kinetic energy relative to the reference energy so far, or to `scale` if that is larger; the
        kinetic energy must also be far below its largest value.
    slow, wait : J, s
        After the time `wait`, if the stiffness is positive definite, a larger bound: the kinetic energy that the drives
        cause (`slow`), or four times the kinetic energy of the path of equilibria. A small snap never has much more.
    """

    part: float
    scale: float
    slow: float
    wait: float


def move_until_rest(
    system: System,
    recorder: PathRecorder,
    u: np.ndarray,
    settings: PathSettings,
    rest: RestCriterion,
    worst: float,
    begins: bool = True,
) -> int:
    """Integrate with inertia and damping until the motion has decayed, or to the end time of the path.

    The integration also ends where the force of the first drive reaches its limit. From `judged_from` of the settings on,
    it also ends if the energy error exceeds `worst` times the reference energy.
    A motion that still vibrates after several hundred steps, for example with friction only, has artificial damping
    added in proportion to the momentum. If the motion `begins` here, its initial velocities follow from statics.

    Returns
    -------
    int
        Newton iterations taken.

    Raises
    ------
    StepFailed
        A step cannot be solved, or the path has more than `max_steps` steps.
    """
    until, rtol = settings.end_time, _IN_MOTION * settings.rtol
    began, earliest = recorder.time, recorder.time + rest.wait
    damped: DampedSystem | None = None
    equations = LinearSolver()
    if begins:
        u = _relaxed(system, recorder.time, recorder.q, u, settings.first_step)
        u = _allowed(system, recorder, u)
    solver = GeneralizedAlpha(system, recorder.time, recorder.q, u, rtol, rho_inf=_RHO_INF, first=recorder.last, parts=1)
    largest, iterations, tries, steps, unseen, near = 0.0, 0, 0, 0, 0, False
    alone = math.inf if math.isfinite(settings.force_limit) else 0.0  # number of steps that are taken one by one
    while recorder.time < until:
        if recorder.statistics.steps >= settings.max_steps:
            raise StepFailed(Outcome.TOO_MANY_STEPS_IN_SNAP, recorder.time, system.worst_body(u))
        if damped is None and steps >= _RINGING:
            damped = DampedSystem(system, began)
            iterations += solver.iterations
            system = cast(System, damped)
            solver = GeneralizedAlpha(
                system, recorder.time, recorder.q, recorder.u, rtol, _RHO_INF, max_step=solver.max_step,
                first=recorder.last, parts=1,
            )  # fmt: skip
        before, state, memory = (solver.t, solver.q, solver.u), solver.state(), system.memory()
        soon = recorder.time + _LOOKS * solver.motion.sizes[STEP_SIZE] > earliest
        most = 1 if alone else min(_FEW if soon else _LOOKS, settings.max_steps - recorder.statistics.steps)
        records, step_energy = recorder.march(solver, recorder.next_save(until), most, _LOST)
        observed = system.observe(solver.t, solver.q, solver.u)
        if damped is not None:
            damping_loss = damped.damping_loss(before[:2], (solver.t, solver.q))
            step_energy = step_energy._replace(dissipated=step_energy.dissipated + damping_loss)
        shorter = _SHORTER if recorder.loss(observed, step_energy) > _LOST else 1.0
        if shorter < 1.0 and len(records) > 1:
            alone = len(records)
            system.restore(memory)
            solver.back_to(*before, state)
            continue
        shorter = min(shorter, _until_limit(settings.force_ratio(recorder.last.drive), settings.force_ratio(observed.drive)))
        if shorter < 1.0 and tries < _TRIES:
            tries, iterations = tries + 1, iterations + solver.iterations
            system.restore(memory)
            shorter *= solver.t - before[0]
            solver = GeneralizedAlpha(system, *before, rtol, _RHO_INF, max_step=shorter, first=recorder.last, parts=1)
            alone = max(alone, _LOOKS)
            continue
        tries, steps, alone = 0, steps + len(records), max(alone - len(records), 0)
        solver.max_step *= _LONGER ** len(records)
        kinetic = observed.energy.kinetic
        quiet = rest.part * max(rest.scale, recorder.energy_balance.turnover)
        # a buckling column stays nearly straight for some time above its critical load, and hardly moves
        unseen += len(records)
        looks = kinetic < quiet and (kinetic < rest.slow or unseen >= _LOOKS)
        unseen = 0 if looks else unseen
        rested, near = near, looks and _on_path(system, equations, solver.t, solver.q, kinetic, rest.slow)
        recorder.dynamic(solver.t, solver.q, solver.u, observed, step_energy, near, records[:-1], rested and near)
        largest = max(largest, float(records[:, KINETIC].max()))
        if recorder.time >= settings.judged_from and recorder.is_off(worst):
            break
        if settings.force_ratio(observed.drive) >= 1.0 - EXACT:
            break
        if kinetic < quiet and kinetic < _CALM * largest:
            break
        if near and recorder.time >= earliest:
            break
    return iterations + solver.iterations


def _until_limit(before: float, after: float) -> float:
    """Part of a step until the force reaches its limit, by linear interpolation; the arguments are ratios of the force to
    the limit at the ends of the step. The result is 1 if the limit is not exceeded, or is exceeded from the start.
    """
    return (1.0 - before) / (after - before) if after > 1.0 + EXACT and before < 1.0 - EXACT else 1.0


def _on_path(system: System, solver: LinearSolver, t: float, q: np.ndarray, kinetic: float, slow: float) -> bool:
    """Whether a state is near stable equilibria and not faster than the equilibrium path with the velocity K^-1 dh/dt."""
    with at_rest(system):
        if negative_pivots(system, t, q, solver):
            return False
        if kinetic < slow:
            return True
        try:
            velocity = solver.solve(system.force_rate(t, q))
        except NotConverged:
            return False
    return kinetic < _AS_THE_PATH * 0.5 * float(velocity @ system.momentum(q, velocity))


def _relaxed(system: System, t: float, q: np.ndarray, u: np.ndarray, longest: float) -> np.ndarray:
    """Initial velocities of a motion, from zero or from the mean velocities of the last step.

    At mean velocities, or at zero, stiff dampers would have large forces. M (v - u)/tau = h(t, q, v) is therefore
    solved at a fixed configuration. Strongly damped modes then have the velocity at which forces balance; the others
    keep u. `longest` (s) bounds the time tau.
    """
    solver = LinearSolver()
    pace = math.sqrt(mean_ratio(system.acceleration(t, q, np.zeros(system.nu)), system.scales().span))
    duration = _RELAXATION_TIME / max(pace, 1.0 / longest)
    velocity = u
    for _ in range(_RELAXATIONS):
        linear = system.linearise(t, q, velocity)
        pattern = linear.damping.pattern
        inertia = system.inertia(q, pattern) / duration
        solver.factorise(BlockMatrix(pattern, inertia + linear.damping.data))
        lag = multiply_blocks(pattern.indptr, pattern.indices, inertia, velocity - u)
        velocity = velocity + solver.solve(linear.force - lag)
    return velocity


def _allowed(system: System, recorder: PathRecorder, u: np.ndarray) -> np.ndarray:
    """Initial velocities that locked directions and their motors allow; the change of the kinetic energy is work."""
    t, q, changed = recorder.time, recorder.q.copy(), u.copy()
    if not system.consistent(math.nextafter(t, math.inf), q, changed, np.zeros(system.nu)):
        return u
    kinetic = [system.energy(t, recorder.q, each).kinetic for each in (u, changed)]
    recorder.energy_balance.work += kinetic[1] - kinetic[0]
    return changed


def slide(system: System, recorder: PathRecorder, t: float) -> bool:
    """Slide to a stable equilibrium of lower energy at time t, just past a critical point (overdamped motion).

    The steps solve (M/theta + K) dx = h with the largest theta for which the matrix is positive definite and the step
    small. This implicit gradient flow never increases the energy. When K itself is positive definite, K dx = h is solved.

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
        if step is None:  # the state is not yet near a stable equilibrium, so the mass term limits the step
            inertia = system.inertia(q, stiffness.pattern)
            diagonal = stiffness.pattern.diagonal
            softness = _ratio(inertia[diagonal], stiffness.data[diagonal])
            theta = 4.0 * theta if theta else 1e3 * softness
            while step is None:
                held = stiffness.with_data(stiffness.data + inertia / theta)
                step, size = _downhill(system, solver, held, linear.force)
                theta *= 0.5 if step is None else 1.0
                if theta < 1e-3 * softness:
                    return False
            size = np.inf
        system.advance(step)
        q = system.retract(q, step)
        if size < _SETTLED:
            observed = system.observe(t, q, None)
            if not recorder.jump_admissible(t, q, observed):
                return False
            recorder.slide(t, q, observed)
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
    """Smallest ratio of mass to stiffness on the diagonal, about 1/omega^2 of the highest frequency."""
    size = inertia.shape[1]
    masses, springs = inertia[:, range(size), range(size)], np.abs(stiffness[:, range(size), range(size)])
    return float(np.min(masses / np.maximum(springs, 1e-300)))
