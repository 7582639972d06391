"""Static equilibrium h(t, q, 0) = 0 by Newton's method with the exact tangent.

As for time steps, Python runs these functions for any system, and a kernel compiles them for models of arrays.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.jit import compiled_as, kernel, shared
from fsm.kernels.pointers import Pointer, borrowed, typed_by
from fsm.kernels.vector import largest_ratio
from fsm.stepping.vectors import copy_into, scaled, subtracted

__all__ = ["RestCalls", "RestModel", "find", "follow_arrays", "predicted"]

_REACH = 0.5
"""Largest step over the size of a segment or a radian, the range of the linearisation."""
_SMALLEST = 1e-300


class RestCalls(NamedTuple):
    """Kernels of the functions below; their first argument are the arrays of the model."""

    force: Any
    renewed_force: Any
    factorise: Any
    solve: Any
    retract: Any


class RestModel(NamedTuple):
    """Model of arrays at rest. `calls` holds `Pointer`s to kernels, and `arrays` is their first argument."""

    calls: RestCalls
    arrays: Any

    @classmethod
    def of(cls, kernels: RestCalls, arrays: Any, q: np.ndarray) -> RestModel:
        """Create a model from arrays and kernels; q (nq,) is an example of a configuration."""
        arguments = RestCalls((0.0, q), (0.0, q), (), (q,), (q, q))
        pointers = (Pointer(kernel, arrays, *rest) for kernel, rest in zip(kernels, arguments, strict=True))
        return cls(RestCalls(*pointers), arrays)


def _force(model: Any, t: float, q: np.ndarray) -> np.ndarray:
    """Force h (nu,) at rest."""
    return np.asarray(model.force(t, q))


def _renewed_force(model: Any, t: float, q: np.ndarray) -> np.ndarray:
    """Force h (nu,) at rest; the stiffness K is evaluated there."""
    return np.asarray(model.renewed_force(t, q))


def _factorise(model: Any) -> bool:
    """Factorise K. False if it is singular."""
    return bool(model.factorise())


def _solve(model: Any, right: np.ndarray) -> np.ndarray:
    """Solution (nu,) with the last factors; NaN if the equations cannot be solved."""
    return np.asarray(model.solve(right))


def _retract(model: Any, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Configuration (nq,) after an increment."""
    return np.asarray(model.retract(q, x))


@kernel
def _advanced(start: np.ndarray, whole: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Forces `start`, plus the part of `change` that is closest to `whole`, (n,)."""
    along = size = 0.0
    for i in range(start.shape[0]):
        along += whole[i] * change[i]
        size += change[i] * change[i]
    scale, out = along / max(size, _SMALLEST), np.empty(start.shape[0])
    for i in range(start.shape[0]):
        out[i] = start[i] + scale * change[i]
    return out


@shared
def predicted(model: Any, before: float, t: float, q: np.ndarray) -> np.ndarray:
    """Increment (nu,) of the equilibrium from `before` to t, to first order.

    A large motion of the drive alone would stretch its springs beyond the range of the linearisation. So the change of the
    forces is computed for the beginning of the step, and scaled to the whole step.
    """
    start = _force(model, before, q)
    whole = subtracted(_force(model, t, q), start)
    change = subtracted(_force(model, before + 0.01 * (t - before), q), start)
    _renewed_force(model, before, q)
    _factorise(model)
    return _solve(model, _advanced(start, whole, change))


@shared
def find(
    model: Any, before: float, t: float, q: np.ndarray, size: np.ndarray, tolerance: float, most: int
) -> tuple[bool, np.ndarray, np.ndarray]:
    """Equilibrium at t from one at `before` (s), in at most so many iterations.

    Returns whether it was found, the configuration (nq,), and the force (nu,) before the last iteration. `size` (nu,) and
    `tolerance` bound the last step.
    """
    if t != before:
        step = predicted(model, before, t, q)
        q = _retract(model, q, scaled(min(1.0, _REACH / max(largest_ratio(step, size), _SMALLEST)), step))
    residual = q
    for _ in range(most):
        residual = _renewed_force(model, t, q)
        if not _factorise(model):
            break
        step = _solve(model, residual)
        largest = largest_ratio(step, size)
        if not math.isfinite(largest):
            break
        q = _retract(model, q, scaled(min(1.0, _REACH / max(largest, _SMALLEST)), step))
        if largest <= tolerance:
            return True, q, residual
    return False, q, residual


@shared
def _follow(
    model: Any, times: np.ndarray, q: np.ndarray, size: np.ndarray, tolerance: float, most: int, states: np.ndarray
) -> int:
    """Write the equilibria (m, nq) at times (m,) to `states`, up to the first that is not found; return their number."""
    before = times[0] if times.shape[0] > 0 else 0.0
    for k in range(times.shape[0]):
        found, q, _ = find(model, before, times[k], q, size, tolerance, most)
        if not found:
            return k
        copy_into(q, states[k])
        before = times[k]
    return times.shape[0]


@kernel
def follow_arrays(
    model: Any, times: np.ndarray, q: np.ndarray, size: np.ndarray, tolerance: float, most: int, states: np.ndarray
) -> int:
    """Compiled `_follow` for a `RestModel`."""
    return _follow(borrowed(model), borrowed(times), borrowed(q), borrowed(size), tolerance, most, borrowed(states))


def _array_force(model: Any, t: float, q: np.ndarray) -> Any:
    return model.calls.force(model.arrays, t, q)


def _array_renewed_force(model: Any, t: float, q: np.ndarray) -> Any:
    return model.calls.renewed_force(model.arrays, t, q)


def _array_factorise(model: Any) -> Any:
    return model.calls.factorise(model.arrays)


def _array_solve(model: Any, right: np.ndarray) -> Any:
    return model.calls.solve(model.arrays, right)


def _array_retract(model: Any, q: np.ndarray, x: np.ndarray) -> Any:
    return model.calls.retract(model.arrays, q, x)


_ASKED: tuple[Any, ...] = (_force, _renewed_force, _factorise, _solve, _retract)
_INSTEAD: tuple[Any, ...] = (_array_force, _array_renewed_force, _array_factorise, _array_solve, _array_retract)
for _asked, _instead in zip(_ASKED, _INSTEAD, strict=True):
    compiled_as(_asked, RestModel, _instead)
typed_by(RestModel)
