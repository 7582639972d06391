"""Static equilibrium h(t, q, 0) = 0 by Newton's method with the exact tangent.

As for time steps, Python runs these functions for any system, and a kernel compiles them for compiled models.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.jit import kernel, shared
from fsm.kernels.pointers import Example, pointers, typed_by
from fsm.kernels.vector import largest_ratio
from fsm.solve.stepping.vectors import copy_into, scaled, subtracted

_REACH = 0.5
"""Largest step relative to the size of a segment or to a radian: range of the linearisation."""
_SMALLEST = 1e-300


class RestCalls(NamedTuple):
    """Functions of a model at rest, or `Pointer`s to kernels. The first argument is the model, or its arrays.

    Attributes
    ----------
    force : ``force(model, t, q)``
        Force h (nu,) at rest.
    renewed_force : ``renewed_force(model, t, q)``
        The same; the stiffness K is evaluated there.
    factorise : ``factorise(model)``
        Factorise K; the result is false if it is singular.
    solve : ``solve(model, right)``
        Solution (nu,) with the last factors; NaN if the equations cannot be solved.
    retract : ``retract(model, q, x)``
        Configuration (nq,) after an increment.
    lock, advance : ``lock(model)``, ``advance(model, x, part)``
        Begin with the multipliers of locked directions of the last accepted state, whether there are any, and advance them
        by a part of those of an increment from the last evaluated state.
    """

    force: Any
    renewed_force: Any
    factorise: Any
    solve: Any
    retract: Any
    lock: Any
    advance: Any


class RestModel(NamedTuple):
    """Model at rest: its functions, and their first argument."""

    calls: RestCalls
    arrays: Any

    @classmethod
    def of(cls, kernels: RestCalls, arrays: Any, q: np.ndarray) -> RestModel:
        """Create a model from arrays and kernels; q (nq,) is an example of a configuration."""
        arguments = RestCalls((0.0, q), (0.0, q), (), (q,), (q, q), (), (q, 0.0))
        example = Example(arrays)
        return cls(pointers(kernels, RestCalls(*((example, *rest) for rest in arguments))), arrays)


@kernel
def _advanced(start: np.ndarray, whole: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Forces `start` plus a multiple of `change`, (n,), such that the sum is closest to `whole`."""
    along = size = 0.0
    for i in range(start.shape[0]):
        along += whole[i] * change[i]
        size += change[i] * change[i]
    scale, out = along / max(size, _SMALLEST), np.empty(start.shape[0])
    for i in range(start.shape[0]):
        out[i] = start[i] + scale * change[i]
    return out


@shared
def predicted(model: RestModel, before: float, t: float, q: np.ndarray) -> np.ndarray:
    """Increment (nu,) of the equilibrium from `before` to t, to first order.

    A large motion of the drive alone would stretch its springs beyond the range of the linearisation. The change of the
    forces is therefore computed for the beginning of the step, and scaled to the whole step.
    """
    calls, arrays = model.calls, model.arrays
    start = calls.force(arrays, before, q)
    whole = subtracted(calls.force(arrays, t, q), start)
    change = subtracted(calls.force(arrays, before + 0.01 * (t - before), q), start)
    calls.renewed_force(arrays, before, q)
    calls.factorise(arrays)
    return calls.solve(arrays, _advanced(start, whole, change))


@shared
def find(
    model: RestModel, before: float, t: float, q: np.ndarray, size: np.ndarray, tolerance: float, most: int
) -> tuple[bool, np.ndarray, np.ndarray]:
    """Equilibrium at t from an equilibrium at `before` (s), in at most `most` iterations.

    Returns whether the equilibrium was found, the configuration (nq,), and the force (nu,) before the last iteration.
    `size` (nu,) and `tolerance` bound the last step.
    """
    calls, arrays = model.calls, model.arrays
    locks = calls.lock(arrays)
    if t != before:
        step = predicted(model, before, t, q)
        q = calls.retract(arrays, q, scaled(min(1.0, _REACH / max(largest_ratio(step, size), _SMALLEST)), step))
    residual = q
    for iteration in range(most):
        residual = calls.renewed_force(arrays, t, q)
        if not calls.factorise(arrays):
            break
        step = calls.solve(arrays, residual)
        largest = largest_ratio(step, size)
        if not math.isfinite(largest):
            break
        part = min(1.0, _REACH / max(largest, _SMALLEST))
        calls.advance(arrays, step, part)
        q = calls.retract(arrays, q, scaled(part, step))
        if largest <= tolerance and (iteration > 0 or not locks):  # the first multipliers may hold openings open
            return True, q, residual
    return False, q, residual


def _follow(
    model: RestModel, times: np.ndarray, q: np.ndarray, size: np.ndarray, tolerance: float, most: int, states: np.ndarray
) -> int:
    """Write the equilibria (m, nq) at times (m,) to `states`, up to the first time without one; return their number."""
    before = times[0] if times.shape[0] > 0 else 0.0
    for k in range(times.shape[0]):
        found, q, _ = find(model, before, times[k], q, size, tolerance, most)
        if not found:
            return k
        copy_into(q, states[k])
        before = times[k]
    return times.shape[0]


@kernel
def never_lock(model: Any) -> bool:
    """`lock` of models without locked directions."""
    return False


@kernel
def never_advance(model: Any, x: np.ndarray, part: float) -> None:
    """`advance` of models without locked directions."""


follow_arrays = kernel(_follow)
"""`_follow` for compiled models."""
typed_by(RestModel)
