"""Stages of the explicit Runge-Kutta method: state, rates and powers; see `fsm.solve.stepping.explicit`."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.jit import kernel, shared
from fsm.kernels.rotation import pose_rates, with_unit_quaternions
from fsm.solve.stepping import generalized_alpha as alpha
from fsm.solve.stepping import model as calls
from fsm.solve.stepping.vectors import copy_into

COORDINATES, SPEEDS = 11, 12
"""Indices of `ExplicitMotion.counts` after those of `fsm.solve.stepping.generalized_alpha`: numbers of minimal coordinates
and of their rates, zero without them."""
STAGES = 12
"""Stages of a step."""


class ExplicitRules(NamedTuple):
    """Constants of the method, tolerances and scales.

    Attributes
    ----------
    rtol : -
    nodes, weights : (12,) arrays
    stages : (12, 12) array
        Row i: weights of the earlier rates in stage i.
    error_5, error_3 : (12,) arrays
        Weights of the errors.
    tolerance, velocity, increment : (nu,) arrays
        Tolerance of the increments, and scales of `fsm.solve.interface.scales.Scales`.
    breaks : increasing times, s
    more_nodes, more_stages : (3,) and (3, 16) arrays
        The same for the rates of the interpolation, after the rate at the end of the step.
    between : (4, 16) array
        Weights of the interpolation.
    """

    rtol: float
    nodes: np.ndarray
    weights: np.ndarray
    stages: np.ndarray
    error_5: np.ndarray
    error_3: np.ndarray
    tolerance: np.ndarray
    velocity: np.ndarray
    increment: np.ndarray
    breaks: np.ndarray
    more_nodes: np.ndarray
    more_stages: np.ndarray
    between: np.ndarray


class ExplicitMotion(NamedTuple):
    """State of the method, changed in place.

    Attributes
    ----------
    q, u, rate : configuration (nq,), velocity and acceleration (nu,)
    sizes, counts : (11,) float and (13,) int arrays
        See the indices above and in `fsm.solve.stepping.generalized_alpha`.
    y, v : (nq,) and (nu,) arrays
        Minimal coordinates and their rates, in the first places.
    of_q, of_u : (16, nq) and (16, nu) arrays
        Rates of q and u, or of y and v, in all stages, at the end, and for the interpolation.
    at_q, at_u, moved, faster : (nq,), (nu,), (nu,) and (nu,) arrays, work space
    of_energy : (16, 2) array, W
        The same of work and dissipated energy.
    all_pairs, drives : (2, 0) and (n_drives,) arrays
        No contact pairs, and work space.
    record : record of a step (`fsm.solve.stepping.model`), work space
    """

    q: np.ndarray
    u: np.ndarray
    rate: np.ndarray
    sizes: np.ndarray
    counts: np.ndarray
    y: np.ndarray
    v: np.ndarray
    of_q: np.ndarray
    of_u: np.ndarray
    at_q: np.ndarray
    at_u: np.ndarray
    moved: np.ndarray
    faster: np.ndarray
    of_energy: np.ndarray
    all_pairs: np.ndarray
    drives: np.ndarray
    record: np.ndarray


@shared
def state_of(motion: ExplicitMotion) -> tuple[np.ndarray, np.ndarray]:
    """Minimal coordinates and their rates; without them q and u."""
    if motion.counts[SPEEDS] > 0:
        return motion.y[: motion.counts[COORDINATES]], motion.v[: motion.counts[SPEEDS]]
    return motion.q, motion.u


@shared
def accelerate(model: Any, t: float, q: np.ndarray, u: np.ndarray, rate: np.ndarray, inside: bool) -> bool:
    """Project q and u, and write their acceleration; false if the mass is singular."""
    if calls.consistent(model, t, q, u, rate, inside):
        return True
    if not calls.factorise_mass(model):
        return False
    copy_into(calls.solve(model, calls.force(model, t, q, u)), rate)
    return True


@shared
def evaluate_stage(
    model: Any, t: float, q: np.ndarray, u: np.ndarray, of_q: np.ndarray, of_u: np.ndarray, of_energy: np.ndarray,
    pairs: np.ndarray, drives: np.ndarray, minimal: bool, counts: bool, inside: bool,
) -> bool:  # fmt: skip
    """Write the rates of a stage, and its powers if it `counts`; q and u are projected, but quaternions keep their lengths
    in their rates. `minimal`: q and u are minimal coordinates and their rates. Other arguments are rows of `ExplicitMotion`.
    """
    if minimal:
        good, of_energy[0], of_energy[1] = calls.minimal_rates(model, t, q, u, of_q, of_u, pairs, drives, counts)
        return good
    raw = q.copy()
    with_unit_quaternions(q, u.shape[0])
    of_u[:] = 0.0
    if not accelerate(model, t, q, u, of_u, inside):
        return False
    copy_into(pose_rates(raw, u), of_q)
    if counts:
        of_energy[0], of_energy[1] = calls.powers(model, t, q, u, pairs, drives)
    return True


@shared
def place_bodies(
    model: Any, motion: ExplicitMotion, t: float, y: np.ndarray, v: np.ndarray, q: np.ndarray, u: np.ndarray
) -> tuple[bool, float]:
    """Write the bodies (q, u) of a state (y, v) at the end of a step. Without minimal coordinates it is projected, and
    the motion gets its acceleration. Returns false if the mass is singular; then the longest step that resolves turns, s.
    """
    if motion.counts[SPEEDS] > 0:
        return True, calls.from_minimal(model, y, v, q, u)
    with_unit_quaternions(y, v.shape[0])
    good = accelerate(model, np.nextafter(t, -math.inf), y, v, motion.rate, False)  # before t, since motors jump at breaks
    copy_into(y, q)
    copy_into(v, u)
    return good, math.inf


@shared
def evaluate_stages(model: Any, motion: ExplicitMotion, rules: ExplicitRules, t: float, end: float, h: float) -> bool:
    """Write the rates of all stages after the first one, which are inside the step: forces jump at breaks."""
    first, last = np.nextafter(t, math.inf), np.nextafter(end, -math.inf)
    y, v = state_of(motion)
    q, u, minimal = motion.at_q[: y.shape[0]], motion.at_u[: v.shape[0]], motion.counts[SPEEDS] > 0
    for i in range(1, rules.nodes.shape[0]):
        add_rates(y, motion.of_q, rules.stages[i], i, h, q)
        add_rates(v, motion.of_u, rules.stages[i], i, h, u)
        motion.counts[alpha.FORCES] += 1
        if not evaluate_stage(
            model, min(max(t + rules.nodes[i] * h, first), last), q, u, motion.of_q[i], motion.of_u[i], motion.of_energy[i],
            motion.all_pairs, motion.drives, minimal, rules.weights[i] != 0.0, True,
        ):  # fmt: skip
            return False
    return True


@kernel
def sum_rates(start: np.ndarray, rates: np.ndarray, weights: np.ndarray, h: float) -> np.ndarray:
    """Start plus h times the weighted sum of rates (m, n)."""
    out = np.empty(start.shape[0])
    add_rates(start, rates, weights, weights.shape[0], h, out)
    return out


@kernel
def add_rates(start: np.ndarray, rates: np.ndarray, weights: np.ndarray, count: int, h: float, out: np.ndarray) -> None:
    """Write start plus h times the weighted sum of the first rates (m, n)."""
    for k in range(out.shape[0]):
        out[k] = start[k]
    for i in range(count):
        if weights[i] != 0.0:
            factor = h * weights[i]
            for k in range(out.shape[0]):
                out[k] += factor * rates[i, k]
