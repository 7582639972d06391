"""Paths of compiled models: the functions of `fsm.solve.stepping.path` for a `StaticModel`, and their entry points."""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.kernels.jit import compiled_as, kernel
from fsm.kernels.pointers import borrowed
from fsm.solve.stepping.accuracy import ACCURATE
from fsm.solve.stepping.path import (
    accept,
    balance_at_rest,
    contact_force,
    difference,
    equilibrium,
    follow,
    look,
    power_before,
    progress_at,
    retracted,
    stability,
    tangent_guess,
)
from fsm.solve.stepping.path_state import (
    ACCEPTED,
    CROSSED,
    DOUBTFUL,
    EVALUATIONS,
    FACTORISATIONS,
    FORCE_ROUND_OFF,
    FOUND_AT,
    ITERATIONS,
    JUDGED,
    LACKS,
    LAST_ITERATIONS,
    NEGATIVE,
    NEGATIVE_AT_REST,
    NEWTON,
    PASSED,
    REACTION,
    RELEASED,
    TIME,
    UNABLE,
    UNKNOWN,
    UNSTABLE,
    Path,
    PathRules,
)
from fsm.solve.stepping.quasi_static import (
    EVALUATED,
    FACTORISED,
    FOUND,
    ITERATION,
    SOLVED,
    TOO_MANY,
    NewtonRules,
    StaticModel,
    settle_arrays,
)
from fsm.solve.stepping.vectors import copy_into


@kernel
def follow_arrays(model: Any, path: Path, rules: PathRules, stops: np.ndarray, rows: np.ndarray) -> int:
    """Compiled `follow` for a `StaticModel`."""
    outcome: int = follow(borrowed(model), borrowed(path), borrowed(rules), borrowed(stops), borrowed(rows))
    return outcome


@kernel
def begin_step(
    model: StaticModel, t: float, before: float, q: np.ndarray, efforts: np.ndarray, rate_dependent: bool, most: float
) -> None:
    """See `StaticCalls.begin`."""
    model.calls.begin(model.arrays, t, before, q, efforts, rate_dependent, most)


def _progress_at(model: StaticModel, t: float) -> Any:
    return model.calls.progress(model.arrays, t)


def _difference(model: StaticModel, start: np.ndarray, end: np.ndarray) -> Any:
    return model.calls.difference(model.arrays, start, end)


def _retracted(model: StaticModel, q: np.ndarray, dx: np.ndarray) -> Any:
    return model.calls.retract(model.arrays, q, dx)


def _contact_force(model: StaticModel, t: float, q: np.ndarray) -> Any:
    return model.calls.contact_force(model.arrays, t, q)


def _balance_at_rest(model: StaticModel, t: float, q: np.ndarray, force: np.ndarray, drives: np.ndarray) -> None:
    model.calls.balance_at_rest(model.arrays, t, q, force, drives)


def _power_before(model: StaticModel, t: float, q: np.ndarray, end: float, found: np.ndarray) -> Any:
    return model.calls.power_before(model.arrays, t, q)


def _tangent_guess(model: StaticModel, path: Path, t: float) -> int:
    return UNABLE


def _equilibrium(model: StaticModel, path: Path, rules: PathRules, t: float, guess: np.ndarray) -> int:
    calls, arrays, numbers, counts = model.calls, model.arrays, path.numbers, path.counts
    if counts[JUDGED] != 0 and numbers[FOUND_AT] == t:
        return ACCEPTED
    counts[JUDGED] = 0
    reaction = numbers[REACTION]
    calls.begin(arrays, t, numbers[TIME], path.q, path.next_efforts, rules.rate_dependent, reaction)
    newton = NewtonRules(
        rules.tolerance * reaction, reaction, rules.reach, rules.max_iterations, rules.mixed, rules.span, rules.force_scale
    )
    found = settle_arrays(model, guess, newton)
    if calls.lacks(arrays):
        return LACKS
    counts[ITERATIONS] += found.counts[SOLVED]
    counts[EVALUATIONS] += found.counts[EVALUATED]
    counts[FACTORISATIONS] += found.counts[FACTORISED]
    counts[LAST_ITERATIONS], numbers[FORCE_ROUND_OFF] = found.counts[ITERATION], found.round_off
    if found.ending != FOUND:
        return NEWTON if found.ending == TOO_MANY else UNABLE
    copy_into(found.q, path.found)
    calls.efforts(arrays, path.found_efforts)
    numbers[FOUND_AT] = t
    return ACCEPTED


def _look(model: StaticModel, path: Path, rules: PathRules, t: float, record: np.ndarray) -> int:
    if path.counts[JUDGED] != 0:
        judgement = path.counts[JUDGED] - 1
        return UNSTABLE if judgement == UNSTABLE else ACCEPTED
    model.calls.end_of_step(model.arrays, path.found, rules.trial, ACCURATE, rules.rate_dependent, record)
    if model.calls.lacks(model.arrays):
        return LACKS
    if record[PASSED] > 0.0:
        return CROSSED
    if record[NEGATIVE] == UNKNOWN:
        return DOUBTFUL
    return UNSTABLE if record[NEGATIVE] > 0.0 else ACCEPTED


def _stability(model: StaticModel, path: Path, rules: PathRules, t: float) -> int:
    if path.counts[JUDGED] != 0:
        judgement = path.counts[JUDGED] - 1
        return UNSTABLE if judgement == RELEASED else judgement
    if not rules.rate_dependent or path.next_record[NEGATIVE_AT_REST] == 0.0:
        return ACCEPTED
    return DOUBTFUL


def _accept(model: StaticModel, path: Path, t: float) -> None:
    model.calls.accept(model.arrays, path.found)


for _asked, _instead in (
    (progress_at, _progress_at), (difference, _difference), (retracted, _retracted), (contact_force, _contact_force),
    (balance_at_rest, _balance_at_rest), (power_before, _power_before), (tangent_guess, _tangent_guess),
    (equilibrium, _equilibrium), (look, _look), (stability, _stability), (accept, _accept),
):  # fmt: skip
    compiled_as(_asked, StaticModel, _instead)
