"""One quasi-static step by Newton's method: h(t, q, u) = 0 with u the mean velocity since the last state.

Inertia is neglected. Damping and friction act with mean velocities over the step (implicit Euler). A system without damping
and friction is solved at rest. `fsm.solve.stepping.quasi_static` contains the iterations; systems with arrays are solved in
one kernel.

The efforts of stiff springs may be separate unknowns (`System.mixed`). They start from predicted values. Contacts are
linearised at separate depths, which are unknowns too. On the pulled strip these unknowns halve the iterations, and steps
are three times as long.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from fsm.errors import NotConverged
from fsm.kernels.blocks import BlockMatrix
from fsm.kernels.pointers import enter
from fsm.kernels.scatter import effective_stiffness
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.interface.records import Depths, Linearised, PreviousState
from fsm.solve.interface.system import StaticArrays, System
from fsm.solve.stepping import quasi_static
from fsm.solve.stepping import quasi_static as newton
from fsm.solve.stepping.quasi_static import NewtonRules, Settled, StaticCalls, StaticModel

_PATTERNS = 20
"""Largest number of repetitions of a step because bodies came near each other whose block the pattern lacks."""


class Ending(Enum):
    """Outcome of Newton's method in a step."""

    CONVERGED = "converged"
    UNSTABLE = "the equilibrium is unstable"
    ITERATIONS = "too many iterations"
    NOT_FINITE = "not finite"
    SINGULAR = "the stiffness is singular"


_FAILURES = {
    quasi_static.NOT_FINITE: Ending.NOT_FINITE,
    quasi_static.SINGULAR: Ending.SINGULAR,
    quasi_static.TOO_MANY: Ending.ITERATIONS,
}


@dataclass
class Equilibrium:
    """Result of Newton's method.

    Attributes
    ----------
    q : configuration
    u : (nu,) array
        Mean velocity since the last state.
    efforts : efforts of the springs at q, if they are unknowns; None without an equilibrium
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
    """Newton's method with the exact tangent in a trust region; steps that are too long are shortened.

    Parameters
    ----------
    system : System
    tolerance : -
        Bound of the residual, relative to the largest reaction.
    max_iterations : int
    reach : -
        Largest motion of any part in one iteration, over the structure's span or in rad.
    in_one_call : bool
        Whether a kernel solves the step if the system has arrays; if not, or if the kernel fails, Python solves it.

    Attributes
    ----------
    solver : LinearSolver
    iterations, evaluations : int
        Numbers of iterations and of force evaluations, summed over all steps so far.
    largest_reaction : N
        Largest reaction so far; the caller updates it.
    round_off : N
        Round-off of the forces of the last step.
    """

    def __init__(
        self, system: System, tolerance: float = 1e-8, max_iterations: int = 15, reach: float = 0.2, in_one_call: bool = True
    ) -> None:
        self.system, self._in_one_call = system, in_one_call
        self.tolerance, self.max_iterations, self.reach = float(tolerance), int(max_iterations), float(reach)
        self.solver = LinearSolver()
        self.scales = system.scales()
        self.iterations = self.evaluations = 0
        self.largest_reaction = 0.0
        self.round_off = 0.0

    def efforts(
        self, t: float, q: np.ndarray, before: PreviousState | None = None, dx: np.ndarray | None = None
    ) -> np.ndarray:
        """Efforts of the springs, as in `System`; `before` as in `solve`."""
        return self.system.efforts(t, q, self._rates(t, before), dx)

    def solve(self, t: float, guess: np.ndarray, before: PreviousState, efforts: np.ndarray | None = None) -> Equilibrium:
        """Equilibrium at time t.

        Parameters
        ----------
        t, guess : time (s) and initial guess of the configuration
        before : time and configuration of the last state; if the time equals t, the solution is at rest
        efforts : initial guess of the efforts of the springs; if absent, the efforts at the initial guess of the
        configuration
        """
        if efforts is None:
            efforts = self.efforts(t, guess, before)
        scales, largest_reaction = self.scales, float(self.largest_reaction)
        rules = NewtonRules(
            self.tolerance * largest_reaction, largest_reaction, self.reach, self.max_iterations, self.system.mixed,
            scales.span, scales.force_scale,
        )  # fmt: skip
        found = self._solve_arrays(t, guess, before, efforts, rules)
        if found is None:
            depths = self.system.depths(self.largest_reaction)
            model = _Model(self.system, self.solver, t, before, self._rates(t, before), efforts, depths)
            settled = newton.settle(StaticModel(_CALLS, model), guess, rules)
            found = settled, model.efforts, model.matrix
        settled, efforts, matrix = found
        counts = settled.counts.tolist()
        self.iterations += counts[quasi_static.SOLVED]
        self.evaluations += counts[quasi_static.EVALUATED]
        self.round_off = settled.round_off
        iterations = counts[quasi_static.ITERATION]
        if settled.ending != quasi_static.FOUND:
            ending = _FAILURES[settled.ending]
            return Equilibrium(settled.q, np.zeros(self.system.nu), None, ending, iterations, settled.residual)
        assert matrix is not None
        return self._found(t, settled.q, before, iterations, settled.residual, matrix, efforts)

    def judged(self, t: float, q: np.ndarray, before: PreviousState, arrays: StaticArrays) -> Equilibrium:
        """Equilibrium that a kernel has found, with the stability from its last matrix."""
        _, matrix, symmetric, trusted = arrays.end()
        self.solver.adopt(matrix, symmetric, trusted, 0)
        return self._found(t, q, before, 0, np.zeros(self.system.nu), matrix, None)

    def _solve_arrays(
        self, t: float, guess: np.ndarray, before: PreviousState, efforts: np.ndarray, rules: NewtonRules
    ) -> tuple[Settled, np.ndarray, BlockMatrix | None] | None:
        """Solve the equations in one call of a kernel.

        The result has the efforts and the last matrix. It is None if the system has no arrays, or if the kernel could not
        solve the equations; the methods in Python may then solve them.
        """
        arrays = self.system.static_arrays(self.solver.ready) if self._in_one_call else None
        if arrays is None:
            return None
        q = np.ascontiguousarray(guess, dtype=float)
        for _ in range(_PATTERNS):
            arrays.begin(t, before, efforts, rules.largest_reaction)
            model = arrays.model
            settled = Settled._make(enter(model.calls.force, newton.settle_arrays, model, q, rules))
            if not arrays.lacks:
                break
        else:
            return None
        later, matrix, symmetric, trusted = arrays.end()
        if settled.ending in (quasi_static.SINGULAR, quasi_static.NOT_FINITE):
            return None
        if settled.counts[quasi_static.FACTORISED]:
            self.solver.adopt(matrix, symmetric, trusted, int(settled.counts[quasi_static.FACTORISED]))
        return settled, later, matrix

    def _rates(self, t: float, before: PreviousState | None) -> PreviousState | None:
        """Last state, if forces depend on rates; else None."""
        return before if before is not None and self.system.rate_dependent and t > before[0] else None

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
        """Equilibrium, with the stability from the matrix of the last iteration, whose state is very near to the
        equilibrium.

        If the symmetric part is not definite, the unsymmetric matrix decides on stability. Sliding friction couples the
        tangential force to the normal displacement (mu k) but not the reverse. The symmetric part then has a negative
        eigenvalue if the stiffness along a stiff contact is below mu^2 k/4, although the equilibrium is stable.
        """
        duration = t - before[0]
        u = self.system.difference(before[1], q) / duration if duration > 0.0 else np.zeros(self.system.nu)
        # friction and rotating dampers make the matrix unsymmetric; else the last factors are those of the symmetric part
        unsymmetric = self.system.rate_dependent and not self.solver.symmetric
        if unsymmetric:
            self.solver.factorise(matrix.symmetric())
        negative = self.solver.negative_pivots()
        if negative and unsymmetric:
            self.solver.factorise(matrix)
            negative = self.solver.negative_real_pivots()
        ending = Ending.UNSTABLE if negative else Ending.CONVERGED
        return Equilibrium(q, u, efforts, ending, iterations, residual, negative)


class _Model:
    """Model of a system for `fsm.solve.stepping.quasi_static`, with the efforts, the depths and the last matrix.

    Parameters
    ----------
    system, solver : as in `EquilibriumStep`
    t, before : as in `EquilibriumStep.solve`
    rates : the last state if forces depend on rates, else None
    efforts, depths : initial guesses
    """

    def __init__(
        self, system: System, solver: LinearSolver, t: float, before: PreviousState, rates: PreviousState | None,
        efforts: np.ndarray, depths: Depths,
    ) -> None:  # fmt: skip
        self.system, self.solver = system, solver
        self.efforts, self.depths, self._depths_before = efforts, depths, depths
        self._t, self._before, self._rates, self._u = t, before, rates, np.zeros(0)
        self._linear: Linearised | None = None
        self.matrix: BlockMatrix | None = None
        system.lock(0.0)
        self.take_up(quasi_static.BEGIN)

    def _mean_velocity(self, q: np.ndarray) -> np.ndarray | None:
        """Mean velocity since the last state; None at rest."""
        if self._rates is None:
            return None
        self._u = self.system.difference(self._before[1], q) / (self._t - self._before[0])
        return self._u

    def force(self, q: np.ndarray) -> np.ndarray:
        """Force h (nu,)."""
        return self.system.force(self._t, q, self._mean_velocity(q), self._rates)

    def linearised_force(self, q: np.ndarray, mixed: bool) -> np.ndarray:
        """Force h (nu,); K and D are evaluated there."""
        given = (self.efforts, self.depths) if mixed else ()
        self._linear = self.system.linearise(self._t, q, self._mean_velocity(q), self._rates, *given)
        return self._linear.force

    def factorise(self) -> bool:
        """Factorise K + D/dt, or K at rest."""
        assert self._linear is not None
        self.matrix = stiffness = self._linear.stiffness
        if self._rates is not None:
            pattern, by_rate = stiffness.pattern, 1.0 / (self._t - self._before[0])
            data = effective_stiffness(stiffness.data, self._linear.damping.data, by_rate, None, pattern.indices)
            self.matrix = stiffness.with_data(data)
        try:
            self.solver.factorise(self.matrix)
        except NotConverged:
            return False
        return True

    def largest_force(self, span: np.ndarray, force_scale: np.ndarray) -> float:
        """Largest force of an entry of the last matrix along the spans of the system's scales, N."""
        assert self.matrix is not None
        forces = self.system.scales().span_forces(self.matrix) / force_scale
        return float(forces.max(initial=0.0))

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solution (nu,) with the last factors."""
        return self.solver.solve(right)

    def retract(self, q: np.ndarray, dx: np.ndarray) -> np.ndarray:
        """Configuration (nq,) after an increment."""
        return self.system.retract(q, dx)

    def advance(self, q: np.ndarray, dx: np.ndarray, cut: bool) -> None:
        """Advance efforts and depths by an increment from q; if `cut` is true, start from the depths before the last
        increment.
        """
        self.efforts = self.system.efforts(self._t, q, self._rates, dx)
        if cut:
            self.depths = self._depths_before
            return
        u = None if self._rates is None else self._u
        self._depths_before = self.depths
        self.depths = self.system.advance_depths(self._t, q, u, self._rates, dx, self.depths)

    def multiply(self, dx: np.ndarray, part: float, again: bool) -> None:
        """Advance multipliers; see `StaticCalls`."""
        self.system.advance(dx, part, again)

    def work_of_locks(self, dx: np.ndarray) -> float:
        """See `StaticCalls`."""
        return self.system.work_of_locks(dx)

    def take_up(self, task: int) -> float:
        """See `StaticCalls`."""
        return self.system.take_up(self.efforts, task)


def with_closed_locks(
    system: System, solver: LinearSolver, t: float, q: np.ndarray, efforts: np.ndarray, depths: Depths
) -> np.ndarray:
    """Configuration near an equilibrium q (nq,) at rest with these efforts, in which locked springs are not deformed; q
    itself if they do not close. The solver has the factors of the stiffness. Multipliers of ideal joints are lost.
    """
    if system.take_up(efforts, newton.BEFORE) == 0.0:
        return q
    _, later = newton.closed_locks(StaticModel(_CALLS, _Model(system, solver, t, (t, q), None, efforts, depths)), q)
    if later is q:
        system.lock(0.0)
    return later


_CALLS = StaticCalls(
    _Model.force, _Model.linearised_force, _Model.factorise, _Model.largest_force, _Model.solve, _Model.retract,
    _Model.advance, _Model.multiply, _Model.work_of_locks, _Model.take_up,
)  # fmt: skip
