"""Static equilibrium h(t, q, 0) = 0 by Newton's method with the exact tangent and load stepping.

Penalties of locked directions in equilibria and in motions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import numpy as np

from fsm.errors import NotConverged
from fsm.kernels.blocks import BlockMatrix
from fsm.kernels.pointers import enter
from fsm.kernels.vector import largest_ratio
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.interface.system import System
from fsm.solve.stepping.equilibrium import RestCalls, RestModel, find, follow_arrays, predicted


@contextmanager
def at_rest(system: System, still: bool = True) -> Iterator[None]:
    """Use the penalties of equilibria, or with `still` false those of motions, for a while."""
    before = system.hold_still(still)
    try:
        yield
    finally:
        system.hold_still(before)


_SAME = 1e-9
"""Distance to an equilibrium, over the size of a segment or a radian, below which a state is this equilibrium."""


def equilibrium(
    system: System,
    q: np.ndarray,
    times: np.ndarray,
    tolerance: float = 1e-10,
    max_iterations: int = 50,
    on_state: Callable[[float, np.ndarray], None] | None = None,
) -> np.ndarray:
    """Follow static equilibria through the given times, at which loads and drives have their values.

    Parameters
    ----------
    system : System
    q : (nq,) array
        Configuration to start from.
    times : increasing times, s
        Times of loads and drives; small steps keep the iteration on its branch. If `q` is an equilibrium, start with
        its time: the tangent there predicts the next equilibrium.
    tolerance : -
        Bound of the last Newton step, over the size of a segment or a radian.
    max_iterations : int
    on_state : called with (time, q) at each equilibrium

    Returns
    -------
    (nq,) array
        Equilibrium at the last time. The stability is not checked; see `negative_pivots`.

    Raises
    ------
    NotConverged
        The message states the time and the worst body.
    """
    with at_rest(system):
        return _through(system, q, times, tolerance, max_iterations, on_state)


def _through(
    system: System, q: np.ndarray, times: np.ndarray, tolerance: float, most: int,
    on_state: Callable[[float, np.ndarray], None] | None,
) -> np.ndarray:  # fmt: skip
    """See `equilibrium`."""
    size, begun = system.scales().increment, 0
    arrays = system.arrays_at_rest(LinearSolver().ready)
    if arrays is not None:
        states = np.empty((len(times), len(q)))
        numbers = np.array(times, dtype=float), np.array(q, dtype=float), size, float(tolerance), int(most)
        begun = enter(arrays.calls.force, follow_arrays, arrays, *numbers, states)
        for t, state in zip(times[:begun], states, strict=False):
            q = state
            if on_state is not None:
                on_state(float(t), q)
    if begun == len(times):
        return q
    model, before = RestModel(_CALLS, _AtRest(system, LinearSolver())), times[max(begun - 1, 0)]
    for t in times[begun:]:
        found, q, residual = find(model, before, t, q, size, tolerance, most)
        if not found:
            raise NotConverged(
                f"no equilibrium found at t = {t:.6g} s in {most} iterations; the largest residual, "
                f"{np.abs(residual).max():.3g}, is at {system.worst_body(residual)}; take smaller steps"
            )
        before = t
        if on_state is not None:
            on_state(float(t), q)
    return q


def held_still(system: System, t: float, q: np.ndarray) -> np.ndarray:
    """Begin equilibria of a system at a time (s) near q (nq,), and return q with closed locked directions.

    The multipliers are those of the equilibrium if q is one, else those that hold the bodies together in the first instant
    after a release.
    """
    system.hold_still(True)
    closed = q.copy()
    if not system.consistent(t, closed, np.zeros(system.nu), np.zeros(system.nu)):
        return q
    system.lock(0.0)
    with suppress(NotConverged):
        found = equilibrium(system, closed, np.array([t]))
        if largest_ratio(system.difference(closed, found), system.scales().increment) <= _SAME:
            return found
    system.lock(0.0)
    return closed


class _AtRest:
    """Model of a system at rest (`fsm.solve.stepping.equilibrium`), with its stiffness and factorisation."""

    def __init__(self, system: System, solver: LinearSolver) -> None:
        self.system, self.solver = system, solver
        self._stiffness: BlockMatrix | None = None

    def force(self, t: float, q: np.ndarray) -> np.ndarray:
        """Force h (nu,)."""
        return self.system.force(t, q, None)

    def renewed_force(self, t: float, q: np.ndarray) -> np.ndarray:
        """Force h (nu,); the stiffness is evaluated there."""
        linear = self.system.linearise(t, q, None)
        self._stiffness = linear.stiffness
        return linear.force

    def factorise(self) -> bool:
        """Factorise the stiffness."""
        assert self._stiffness is not None
        self.solver.factorise(self._stiffness)
        return True

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solution (nu,) with the last factors."""
        return self.solver.solve(right)

    def retract(self, q: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Configuration (nq,) after an increment."""
        return self.system.retract(q, x)

    def lock(self) -> bool:
        """Begin with the multipliers of locked directions of the last accepted state; false without any."""
        return self.system.lock(0.0)

    def advance(self, x: np.ndarray, part: float) -> None:
        """Advance multipliers; see `RestCalls`."""
        self.system.advance(x, part)


_CALLS = RestCalls(
    _AtRest.force, _AtRest.renewed_force, _AtRest.factorise, _AtRest.solve, _AtRest.retract, _AtRest.lock, _AtRest.advance
)


def tangent_prediction(
    system: System, before: float, t: float, q: np.ndarray, solver: LinearSolver | None = None
) -> np.ndarray:
    """Increment of the equilibrium from `before` to t, to first order; see `fsm.solve.stepping.equilibrium.predicted`.

    The function overwrites the factorisation of `solver`.
    """
    return predicted(RestModel(_CALLS, _AtRest(system, solver or LinearSolver())), before, t, q)


def negative_pivots(system: System, t: float, q: np.ndarray, solver: LinearSolver | None = None) -> int:
    """Number of negative pivots of the tangent stiffness at rest; 0 where stable.

    Sylvester's law of inertia counts them for the symmetric part, by a factorisation without row exchanges between blocks.
    Friction bristles make the stiffness unsymmetric. If the symmetric part then has negative pivots, the negative real
    pivots of the stiffness itself count (see `fsm.solve.equations.equilibrium_step`). With a given `solver` the pattern is
    not analysed again; the factorisation of the solver is overwritten.
    """
    return 0 if system.nu == 0 else _negative(_stiffness_at_rest(system, t, q), solver or LinearSolver())


def negative_pivots_sticking(
    system: System, t: float, q: np.ndarray, solver: LinearSolver, sticking: float
) -> tuple[int, bool]:
    """`negative_pivots`, and whether contacts that stick for the time `sticking` (s) prevent that modes grow.

    The second result is true if no mode grows by the factor e in less than this time with the damping of regularised
    friction.
    """
    stiffness = _stiffness_at_rest(system, t, q)
    found = _negative(stiffness, solver)
    damping = system.sticking_damping(t, q) if found else None
    if damping is None:
        return found, False
    return found, not _negative(stiffness.with_data(stiffness.data + damping.data / sticking), solver)


def _stiffness_at_rest(system: System, t: float, q: np.ndarray) -> BlockMatrix:
    with at_rest(system):
        return system.linearise(t, q, None).stiffness


def _negative(stiffness: BlockMatrix, solver: LinearSolver) -> int:
    """See `negative_pivots`."""
    matrix = stiffness.symmetric()
    try:
        solver.factorise(matrix)
        if solver.negative_pivots() == 0:
            return 0
        solver.factorise(stiffness)
    except NotConverged:  # the matrix is exactly singular: the system has a mechanism or a free body
        return solver.negative_eigenvalues(matrix)
    return solver.negative_real_pivots()
