"""One quasi-static step by Newton's method: h(t, q, u) = 0 with u the mean velocity since the last state.

Inertia is neglected. Damping and friction act with mean velocities over the step (implicit Euler). A system without damping
and friction is solved at rest.

The efforts of stiff springs are separate unknowns in a `fsm.system.MixedSystem`. The efforts start from predicted values,
and contacts are linearised at separate depths. On the pulled strip this halves the iterations, with steps three times as
long.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from functools import cache
from typing import cast

import numpy as np

from fsm.blocks import BlockMatrix
from fsm.errors import NotConverged
from fsm.kernels.block_sum import effective_stiffness
from fsm.kernels.vector import largest_ratio
from fsm.solve.linear import LinearSolver
from fsm.system import MixedSystem, System
from fsm.system_records import Depths, Linearised, NewtonRules, PreviousState

__all__ = ["Ending", "Equilibrium", "EquilibriumStep"]

_ROUND_OFF = 1e-15
"""Round-off of forces relative to stiffness times size."""
_OVERSHOOT = 4.0
"""A step is cut if its work becomes more negative than this factor times its initial work: contacts opened or closed."""
_ENOUGH = 0.5
"""Remaining work of a cut step relative to its initial work."""
_TRIALS = 10
"""Largest number of trial states for the cut."""
_SMALL_CORRECTION = 1e-4
"""Step below which only the forces are evaluated first, since they are probably in balance."""
_PATIENCE = 4
"""Number of iterations after which the residual is compared with the reactions."""
_LARGE_RESIDUAL, _SLOW_REDUCTION = 200.0, 1e-2
"""Residual relative to the largest reaction, and relative to the first residual, above which the iteration stops."""


@cache
def _is_mixed(kind: type) -> bool:
    """Whether systems of this class are `MixedSystem`; cached, since the check is slow."""
    return issubclass(kind, MixedSystem)


class Ending(Enum):
    """Outcome of Newton's method."""

    CONVERGED = "converged"
    UNSTABLE = "the equilibrium is unstable"
    ITERATIONS = "too many iterations"
    NOT_FINITE = "not finite"
    SINGULAR = "the stiffness is singular"


@dataclass
class Equilibrium:
    """Result of Newton's method.

    Attributes
    ----------
    q : configuration
    u : (nu,) array
        Mean velocity since the last state.
    efforts : of the springs at q, if they are unknowns; None without an equilibrium
    ending : Ending
    iterations : int
    residual : (nu,) array, N and N m
        Residual of the forces.
    negative_pivots : int
        Negative pivots of the symmetric part of the last matrix, K + D/dt.
    """

    q: np.ndarray
    u: np.ndarray
    efforts: np.ndarray | None
    ending: Ending
    iterations: int
    residual: np.ndarray
    negative_pivots: int = 0


class EquilibriumStep:
    """Newton's method with the exact tangent in a trust region; steps that overshoot are cut.

    Parameters
    ----------
    system : System
    tolerance : -
        Bound of the residual, relative to the largest reaction.
    max_iterations : int
    reach : -
        Largest motion of any part in one iteration, over the structure's span or in rad.

    Attributes
    ----------
    solver : LinearSolver
    mixed : MixedSystem or None
        The system, if the efforts of its springs are unknowns.
    iterations, evaluations : int
        Sums over all steps so far.
    largest_reaction : N
        Largest reaction so far; the caller updates it.
    round_off : N
        Round-off of the forces of the last step.
    """

    def __init__(
        self, system: System, tolerance: float = 1e-8, max_iterations: int = 15, reach: float = 0.2
    ) -> None:
        self.system = system
        self.mixed = cast(MixedSystem, system) if _is_mixed(type(system)) else None
        self.tolerance, self.max_iterations, self.reach = tolerance, max_iterations, reach
        self.solver = LinearSolver()
        self.scales = system.scales()
        self.iterations = self.evaluations = 0
        self.largest_reaction = 0.0
        self.round_off = 0.0
        self._rules = NewtonRules(
            tolerance, _ROUND_OFF, _SMALL_CORRECTION, reach, _OVERSHOOT, _LARGE_RESIDUAL, _SLOW_REDUCTION, _PATIENCE,
            max_iterations,
        )

    def efforts(
        self, t: float, q: np.ndarray, before: PreviousState | None = None, dx: np.ndarray | None = None
    ) -> np.ndarray | None:
        """Efforts of the springs, if they can be unknowns, as in `MixedSystem`; `before` as in `solve`."""
        return None if self.mixed is None else self.mixed.efforts(t, q, self._rates(t, before), dx)

    def solve(self, t: float, guess: np.ndarray, before: PreviousState, efforts: np.ndarray | None = None) -> Equilibrium:
        """Equilibrium at time t.

        Parameters
        ----------
        t, guess : time (s) and configuration to begin with
        before : time and configuration of the last state; the same time: at rest
        efforts : of the springs, to begin with; those at the guess if absent
        """
        system = self.system
        rates = self._rates(t, before)
        if efforts is None:
            efforts = self.efforts(t, guess, before)
        settled = self._settle(t, guess, before, efforts)
        if settled is not None:
            return settled
        depths = depths_before = None if self.mixed is None else self.mixed.depths(self.largest_reaction)
        q, q_before, step, work = guess, guess, np.zeros(system.nu), 0.0
        size = last_size = lost = math.inf
        matrix: BlockMatrix | None = None
        cut = False
        for iteration in range(self.max_iterations + 1):
            dx = None if rates is None else system.difference(before[1], q)
            u = None if dx is None else dx / (t - before[0])
            self.evaluations += 1
            if size < _SMALL_CORRECTION and matrix is not None:
                residual = system.force(t, q, u, rates)
                if self._balanced(residual):
                    if iteration == 1 and self.mixed is not None:  # its efforts were only predicted
                        matrix = self._matrix(system.linearise(t, q, u, rates), dx, t - before[0])
                        self.solver.factorise(matrix)
                    return self._found(t, q, before, iteration, residual, matrix, self.efforts(t, q, before))
            linear = self._linearised(t, q, u, rates, efforts, depths)
            residual = linear.force
            left_over = self._left_over(residual)
            if not math.isfinite(left_over):
                return self._ended(Ending.NOT_FINITE, q, iteration, residual)
            if iteration == 0:
                lost = max(_LARGE_RESIDUAL * self.largest_reaction, _SLOW_REDUCTION * left_over)
            after = float(step @ residual)
            if work > 0.0 and after < -_OVERSHOOT * work and not cut:
                part = self._shortened(t, q_before, step, before, work, after)
                efforts = self.efforts(t, q_before, before, part * step)
                q, size, cut, depths = system.retract(q_before, part * step), part * size, True, depths_before
                continue
            cut = False
            wandering = (iteration > 7 and size > 2.0 * last_size) or (iteration >= _PATIENCE and left_over > lost)
            if wandering or iteration == self.max_iterations:
                break
            matrix = self._matrix(linear, dx, t - before[0])
            if iteration == 0:
                self.round_off = _ROUND_OFF * self.scales.largest_span * float(np.abs(matrix.data).max(initial=0.0))
            try:
                self.solver.factorise(matrix)
            except NotConverged:
                return self._ended(Ending.SINGULAR, q, iteration, residual)
            step = self.solver.solve(residual)
            self.iterations += 1
            work = float(step @ residual)
            last_size, size = size, largest_ratio(step, self.scales.span)
            if not math.isfinite(size):
                return self._ended(Ending.NOT_FINITE, q, iteration, residual)
            if size > self.reach:
                step = step * (self.reach / size)
            efforts = self.efforts(t, q, before, step)
            if self.mixed is not None:
                depths_before, depths = depths, self.mixed.advance_depths(t, q, u, rates, step, depths)
            q_before, q = q, system.retract(q, step)
        return self._ended(Ending.ITERATIONS, q, self.max_iterations, residual)

    def _settle(self, t: float, guess: np.ndarray, before: PreviousState, efforts: np.ndarray | None) -> Equilibrium | None:
        """Solve in one call, if the system supports this and the iteration converges; else None."""
        pattern = None if self.mixed is None else self.mixed.newton_pattern()
        if self.mixed is None or efforts is None or pattern is None:
            return None
        ready = self.solver.ready(pattern)
        settled = self.mixed.newton_solve(t, guess, before, efforts, self.largest_reaction, self._rules, *ready)
        if settled is None:
            return None
        count = settled.iterations
        self.iterations += count
        self.evaluations += count + 1
        self.round_off = settled.round_off
        # without an iteration, the last factorisation belongs to the state itself
        self.solver.adopt(settled.matrix, settled.symmetric, max(count, 2))
        return self._found(t, settled.q, before, count, settled.residual, settled.matrix, settled.efforts)

    def _rates(self, t: float, before: PreviousState | None) -> PreviousState | None:
        """Last state, if forces depend on rates."""
        return before if before is not None and self.system.rate_dependent and t > before[0] else None

    def _shortened(
        self, t: float, q: np.ndarray, step: np.ndarray, before: PreviousState, work: float, after: float
    ) -> float:
        """Part of an overshooting step at which its work is about zero, by the Illinois method.

        Contacts that close along the step just touch there, and the next matrix includes them.
        """
        rates = self._rates(t, before)
        low, high, side = 0.0, 1.0, 0
        at_low, at_high = work, after
        part = high
        for _ in range(_TRIALS):
            part = low + (high - low) * at_low / (at_low - at_high)
            part = min(max(part, low + 0.1 * (high - low)), high - 0.1 * (high - low))
            there = self.system.retract(q, part * step)
            u = None if rates is None else self.system.difference(before[1], there) / (t - before[0])
            self.evaluations += 1
            now = float(step @ self.system.force(t, there, u, rates))
            if abs(now) < _ENOUGH * work:
                break
            if now > 0.0:
                low, at_low = part, now
                at_high *= 0.5 if side > 0 else 1.0
                side = 1
            else:
                high, at_high = part, now
                at_low *= 0.5 if side < 0 else 1.0
                side = -1
        return part

    def _linearised(
        self,
        t: float,
        q: np.ndarray,
        u: np.ndarray | None,
        rates: PreviousState | None,
        efforts: np.ndarray | None,
        depths: Depths,
    ) -> Linearised:
        if self.mixed is None or efforts is None:
            return self.system.linearise(t, q, u, rates)
        return self.mixed.linearise_mixed(t, q, u, rates, efforts, depths)

    def _matrix(self, linear: Linearised, dx: np.ndarray | None, duration: float) -> BlockMatrix:
        """K + D/dt, or K without rates."""
        if dx is None:
            return linear.stiffness
        stiffness, damping = linear.stiffness, linear.damping.data
        together = effective_stiffness(stiffness.data, damping, 1.0 / duration, None, stiffness.pattern.indices)
        return BlockMatrix(stiffness.pattern, together)

    def _left_over(self, residual: np.ndarray) -> float:
        """Largest component of the residual, N."""
        return float(largest_ratio(residual, self.scales.force_scale))

    def _balanced(self, residual: np.ndarray) -> bool:
        """Whether the residual is below the tolerance or below round-off."""
        return self._left_over(residual) <= max(self.tolerance * self.largest_reaction, self.round_off)

    def _ended(self, ending: Ending, q: np.ndarray, iterations: int, residual: np.ndarray) -> Equilibrium:
        return Equilibrium(q, np.zeros(self.system.nu), None, ending, iterations, residual)

    def _found(
        self,
        t: float,
        q: np.ndarray,
        before: PreviousState,
        iterations: int,
        residual: np.ndarray,
        matrix: BlockMatrix,
        efforts: np.ndarray | None,
    ) -> Equilibrium:
        """Equilibrium, with the stability from the matrix of the last iteration, whose state is very near.

        If the symmetric part is not definite, the unsymmetric matrix decides on stability. Sliding friction couples the
        tangential force to the normal displacement (mu k) but not the reverse. The symmetric part then has a negative
        eigenvalue if the stiffness along a stiff contact is below mu^2 k/4, although the equilibrium is stable.
        """
        duration = t - before[0]
        u = self.system.difference(before[1], q) / duration if duration > 0.0 else np.zeros(self.system.nu)
        if self.system.rate_dependent:  # unsymmetric: friction, and rotating dampers
            self.solver.factorise(matrix.symmetric())
        negative = self.solver.negative_pivots()
        if negative and self.system.rate_dependent:
            self.solver.factorise(matrix)
            negative = self.solver.negative_real_pivots()
        ending = Ending.UNSTABLE if negative else Ending.CONVERGED
        return Equilibrium(q, u, efforts, ending, iterations, residual, negative)
