"""One quasi-static step by Newton's method: h(t, q, u) = 0 with u the mean velocity since the last state.

As for time steps, Python runs `settle` for any system, and a kernel compiles it for compiled models. The model stores
the time and the last state. The model also stores the efforts of springs and the depths of contacts if they are separate
unknowns (see `fsm.solve.interface.system.System`).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.jit import kernel, shared
from fsm.kernels.pointers import Example, pointers, typed_by
from fsm.kernels.vector import largest_ratio
from fsm.solve.stepping.vectors import inner, scaled

FOUND, NOT_FINITE, SINGULAR, TOO_MANY = range(4)
"""Outcomes of Newton's method; the last one means too many iterations."""

_ROUND_OFF = 4e-15
"""Round-off of forces relative to stiffness times span."""
_OVERSHOOT = 4.0
"""A step is cut if its work becomes more negative than this factor times its initial work: contacts opened or closed."""
_ENOUGH = 0.5
"""Remaining work of a cut step relative to its initial work."""
_TRIALS = 10
"""Largest number of trial states for the cut."""
_SMALL_CORRECTION = 1e-4
"""Step below which only the forces are evaluated first, since they are probably in balance."""
_PATIENCE = 4
"""Number of iterations after which the residual is first compared with the reactions."""
BEGIN, NONE, FIRST, NEXT, BEFORE = range(5)
"""Tasks for the multipliers of locked springs, see `StaticCalls.take_up`."""
_CLOSES, _STAYS_CLOSED = 1e-4, 0.1
"""Largest ratio of successive energies of the changes of multipliers of locked springs that close, and of those that were
closed in the last state."""
_CLOSED, _CLOSURES = 1e-17, 8
"""Ratio to the first of these energies at which they are closed, and largest number of solutions."""
_LARGE_RESIDUAL, _SLOW_REDUCTION = 200.0, 1e-2
"""Residual relative to the largest reaction, and relative to the first residual, above which the iteration stops."""


class NewtonRules(NamedTuple):
    """Tolerances and scales.

    Attributes
    ----------
    tolerance : N
        Largest component of the residual at an equilibrium, unless round-off is larger.
    largest_reaction : N
    reach : -
        Largest correction, relative to the span of the structure or in radians.
    max_iterations : int
    mixed : bool
        Whether efforts of springs and depths of contacts are separate unknowns.
    span, force_scale : (nu,) arrays
        Scales of the increments, and divisors that convert generalised forces to N.
    """

    tolerance: float
    largest_reaction: float
    reach: float
    max_iterations: int
    mixed: bool
    span: np.ndarray
    force_scale: np.ndarray


ITERATION, SOLVED, FACTORISED, EVALUATED = range(4)
"""Indices of `Settled.counts`: number of the last iteration, and of solutions, factorisations and evaluated states."""


class Settled(NamedTuple):
    """Result of `settle`.

    Attributes
    ----------
    ending : int
        `FOUND`, or the reason for the failure.
    q : configuration
    residual : (nu,) array, N and N m
    counts : (4,) int array
    round_off : N
        Forces below this are round-off.
    """

    ending: int
    q: np.ndarray
    residual: np.ndarray
    counts: np.ndarray
    round_off: float


class StaticCalls(NamedTuple):
    """Functions of a model, or `Pointer`s to kernels. The first argument is the model, or its arrays.

    Attributes
    ----------
    force : ``force(model, q)``
        Force h (nu,).
    linearised_force : ``linearised_force(model, q, mixed)``
        The same as `force`; also evaluates K and D, with the efforts and depths that the model keeps if `mixed` is true.
    factorise : ``factorise(model)``
        Factorise K + D/dt; the result is false if it is singular.
    largest_force : ``largest_force(model, span, force_scale)``
        Largest force of an entry of the last matrix along the spans of `NewtonRules`, N.
    solve : ``solve(model, right)``
        Solution (nu,) with the last factors; NaN if the equations cannot be solved.
    retract : ``retract(model, q, dx)``
        Configuration (nq,) after an increment.
    advance : ``advance(model, q, dx, cut)``
        Advance efforts and depths by an increment from q, to first order; with `cut`, start from the depths before the
        last increment.
    multiply : ``multiply(model, dx, part, again)``
        Advance the multipliers of locked directions by a part of those of the increment dx from the last evaluated state;
        with `again`, this part replaces the last one.
    work_of_locks : ``work_of_locks(model, dx)``
        Work of the penalties of locked directions along an increment of the last evaluated state, J.
    take_up : ``take_up(model, task)``
        Do a task for the multipliers of locked springs. `FIRST`, `NEXT`: they become the efforts that the model keeps; the
        result is the energy of their change in the springs, J. `BEGIN`: the same if the springs were closed in the last
        accepted state, else they become zero. `NONE`: they become zero. `BEFORE`: the result is 2 if the springs were closed
        there, else 1, and 0 without locked springs.

    Only compiled models have the rest, for `fsm.solve.stepping.path`:

    begin : ``begin(model, t, before, q, efforts, rate_dependent, most)``
        Begin a step from the last state (time and q) to t, with these efforts; `most` (N) as in `System.depths`.
    lacks : ``lacks(model)``
        Whether bodies have met whose block the pattern of the matrix lacks.
    efforts : ``efforts(model, out)``
        Write the efforts of springs to `out` (m,).
    end_of_step : ``end_of_step(model, q, trial, accurate, at_rest, record)``
        Write the record of a state at the end of a step. `trial` (nu,) is a vector of entries 1 and -1; if the solution of
        equations with this vector has an error above `accurate`, numbers of pivots are `UNKNOWN`. Without `at_rest` the
        pivots of the stiffness at rest are left out.
    accept : ``accept(model, q)``
        Accept this state: update the memory of contacts and elements.
    progress, difference : as `System.progress`, `System.difference`
    contact_force : ``contact_force(model, t, q)``
        Largest component of the forces of contacts at rest, N.
    balance_at_rest : ``balance_at_rest(model, t, q, force, drives)``
        Write the force (nu,) and the forces of all drives (n_drives,) at rest.
    power_before : ``power_before(model, t, q)``
        Power of loads (W) in the last state, with the mean velocities of the step whose end was recorded.
    sticks : ``sticks(model, q, trial, accurate, sticking)``
        Whether contacts that stick for the time `sticking` (s) prevent that modes grow: 1 or 0, for the stiffness at rest of
        the state q that was recorded last; `UNKNOWN` if this stiffness is not symmetric, or the signs are not certain.
    """

    force: Any
    linearised_force: Any
    factorise: Any
    largest_force: Any
    solve: Any
    retract: Any
    advance: Any
    multiply: Any
    work_of_locks: Any
    take_up: Any
    begin: Any = None
    lacks: Any = None
    efforts: Any = None
    end_of_step: Any = None
    accept: Any = None
    progress: Any = None
    difference: Any = None
    contact_force: Any = None
    balance_at_rest: Any = None
    power_before: Any = None
    sticks: Any = None


class StaticModel(NamedTuple):
    """Model in a quasi-static step: its functions, and their first argument."""

    calls: StaticCalls
    arrays: Any

    @classmethod
    def of(cls, kernels: StaticCalls, arrays: Any, q: np.ndarray) -> StaticModel:
        """Create a model from arrays and kernels; q (nq,) is an example of a configuration."""
        arguments = StaticCalls(
            (q,), (q, True), (), (q, q), (q,), (q, q), (q, q, True), (q, 0.0, True), (q,), (0,), (0.0, 0.0, q, q, True, 0.0),
            (), (q,), (q, q, 0.0, True, q), (q,), (0.0,), (q, q), (0.0, q), (0.0, q, q, q), (0.0, q),
            (q, q, 0.0, 0.0),
        )  # fmt: skip
        example = Example(arrays)
        return cls(pointers(kernels, StaticCalls(*((example, *rest) for rest in arguments))), arrays)


def settle(model: StaticModel, q: np.ndarray, rules: NewtonRules) -> Settled:
    """Find the equilibrium by Newton's method in a trust region, from q (nq,); steps that overshoot are cut."""
    calls, arrays = model.calls, model.arrays
    counts, q = np.zeros(4, dtype=np.int64), q.copy()
    step, q_before, residual, cut = scaled(0.0, rules.span), q, q, False
    work = round_off = 0.0
    taken = 1.0
    size = last_size = lost = math.inf
    closed = False
    for iteration in range(rules.max_iterations + 1):
        counts[ITERATION] = iteration
        counts[EVALUATED] += 1
        if size < _SMALL_CORRECTION:
            residual = calls.force(arrays, q)
            if largest_ratio(residual, rules.force_scale) <= max(rules.tolerance, round_off):
                if iteration == 1 and rules.mixed:  # the efforts of this step were only predicted
                    calls.linearised_force(arrays, q, False)
                    counts[FACTORISED] += 1
                    if not calls.factorise(arrays):
                        return Settled(SINGULAR, q, residual, counts, round_off)
                calls.advance(arrays, q, scaled(0.0, step), True)
                if closed:
                    return Settled(FOUND, q, residual, counts, round_off)
                moved, q = closed_locks(model, q)
                residual, closed = calls.force(arrays, q) if moved else residual, True
                if largest_ratio(residual, rules.force_scale) <= max(rules.tolerance, round_off):
                    return Settled(FOUND, q, residual, counts, round_off)
        residual = calls.linearised_force(arrays, q, True)
        left_over = largest_ratio(residual, rules.force_scale)
        if not math.isfinite(left_over):
            return Settled(NOT_FINITE, q, residual, counts, round_off)
        if iteration == 0:
            lost = max(_LARGE_RESIDUAL * rules.largest_reaction, _SLOW_REDUCTION * left_over)
        after = inner(step, residual) + calls.work_of_locks(arrays, step)
        if work > 0.0 and after < -_OVERSHOOT * work and not cut:
            part = _shortened(model, q_before, step, taken, work, after, counts)
            calls.advance(arrays, q_before, scaled(part, step), True)
            calls.multiply(arrays, step, part * taken, True)
            q, size, cut = calls.retract(arrays, q_before, scaled(part, step)), part * size, True
            continue
        cut = False
        wandering = (iteration > 7 and size > 2.0 * last_size) or (iteration >= _PATIENCE and left_over > lost)
        if wandering or iteration == rules.max_iterations:
            break
        counts[FACTORISED] += 1
        if not calls.factorise(arrays):
            return Settled(SINGULAR, q, residual, counts, round_off)
        if iteration == 0:
            round_off = _ROUND_OFF * calls.largest_force(arrays, rules.span, rules.force_scale)
        step = calls.solve(arrays, residual)
        counts[SOLVED] += 1
        work = inner(step, residual)
        last_size, size, taken = size, largest_ratio(step, rules.span), 1.0
        if not math.isfinite(size):
            return Settled(NOT_FINITE, q, residual, counts, round_off)
        whole = step
        if size > rules.reach:
            taken = rules.reach / size
            step = scaled(taken, step)
        calls.advance(arrays, q, step, False)
        calls.multiply(arrays, whole, taken, False)
        q_before, q = q, calls.retract(arrays, q, step)
    return Settled(TOO_MANY, q, residual, counts, round_off)


@shared
def closed_locks(model: StaticModel, q: np.ndarray) -> tuple[bool, np.ndarray]:
    """Whether the multipliers of locked springs have changed, and a configuration near an equilibrium q (nq,), in which the
    springs are not deformed if they close.

    A solution without multipliers gives those of least work, as the efforts of the springs. Further solutions with the last
    factors close the springs (augmented Lagrangian; Bayo and Ledesma 1996). The multipliers of the begin of the step are not
    used: parts of them that act against each other, as in a sheet with more constraints than it needs, would grow from step
    to step. Springs with little resistance to a motion, as those of a flat sheet to folding, do not close in this way; they
    then have no multipliers.
    """
    calls, arrays, start = model.calls, model.arrays, q
    found = calls.take_up(arrays, BEFORE)
    if found == 0.0:
        return False, start
    closes = _STAYS_CLOSED if found > 1.0 else _CLOSES
    calls.take_up(arrays, NONE)
    step = calls.solve(arrays, calls.force(arrays, q))
    calls.advance(arrays, q, step, True)
    before = calls.take_up(arrays, FIRST)
    first = before
    for number in range(_CLOSURES):
        step = calls.solve(arrays, calls.force(arrays, q))
        calls.advance(arrays, q, step, True)
        after = calls.take_up(arrays, NEXT)
        if number == 0 and not after <= closes * before:
            calls.take_up(arrays, NONE)
            calls.advance(arrays, start, scaled(0.0, step), True)
            return True, start
        q = calls.retract(arrays, q, step)
        if after <= _CLOSED * first or after > closes * before:
            break
        before = after
    calls.advance(arrays, q, scaled(0.0, step), True)
    return True, q


@shared
def _shortened(
    model: StaticModel, q: np.ndarray, step: np.ndarray, taken: float, work: float, after: float, counts: np.ndarray
) -> float:
    """Part of an overshooting step at which its work is about zero, by the Illinois method.

    Contacts that close along the step just touch at its end, and the next matrix includes them.
    """
    low, high, side = 0.0, 1.0, 0
    at_low, at_high, part = work, after, high
    for _ in range(_TRIALS):
        part = low + (high - low) * at_low / (at_low - at_high)
        part = min(max(part, low + 0.1 * (high - low)), high - 0.1 * (high - low))
        counts[EVALUATED] += 1
        there = model.calls.retract(model.arrays, q, scaled(part, step))
        model.calls.multiply(model.arrays, step, part * taken, True)
        now = inner(step, model.calls.force(model.arrays, there)) + model.calls.work_of_locks(model.arrays, step)
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


settle_arrays = kernel(settle)
"""`settle` for compiled models."""
typed_by(StaticModel)
