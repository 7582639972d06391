"""Accelerations of a model at varied states, for derivatives of motions."""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.kernels.jit import kernel, shared
from fsm.kernels.pointers import borrowed
from fsm.kernels.rotation import increments_of_rates, pose_rates, with_unit_quaternions
from fsm.solve.stepping.model import consistent, factorise_mass, force, solve
from fsm.solve.stepping.outcomes import NO_SOLUTION, STEPPED
from fsm.solve.stepping.vectors import copy_into


@shared
def respond(model: Any, t: float, q: np.ndarray, u: np.ndarray, ways: np.ndarray, out: np.ndarray) -> int:
    """Write the consistent states at varied states, and their accelerations.

    Parameters
    ----------
    t, q, u : time (s), configuration (nq,), velocity (nu,)
    ways : (m, 2 nu) array
        Small changes of configuration and velocity, one row for each varied state.
    out : (m, 3 nu) array
        Increments of the configuration from q, velocities and accelerations, after the projection to openings of zero.

    Returns
    -------
    Outcome; `NO_SOLUTION` if the mass is singular.
    """
    n = u.shape[0]
    for row in range(ways.shape[0]):
        by, speed, rate = pose_rates(q, ways[row, :n].copy()), u + ways[row, n:], np.zeros(n)
        there = q + by
        with_unit_quaternions(there, n)
        if not consistent(model, t, there, speed, rate, False):
            if not factorise_mass(model):
                return NO_SOLUTION
            copy_into(solve(model, force(model, t, there, speed)), rate)
        copy_into(increments_of_rates(q, there - q, n), out[row, :n])
        copy_into(speed, out[row, n : 2 * n])
        copy_into(rate, out[row, 2 * n :])
    return STEPPED


@kernel
def respond_arrays(model: Any, t: float, q: np.ndarray, u: np.ndarray, ways: np.ndarray, out: np.ndarray) -> int:
    """Compiled `respond` for an `ArrayModel`."""
    return respond(borrowed(model), t, q, u, ways, out)
