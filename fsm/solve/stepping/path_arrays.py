"""Paths of compiled models: the functions of `fsm.solve.stepping.path` for a `StaticModel`, and their entry points."""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.kernels.jit import compiled_as, kernel
from fsm.kernels.pointers import borrowed
from fsm.kernels.vector import largest_ratio
from fsm.solve.stepping import path as quasi_path
from fsm.solve.stepping import path_state as row
from fsm.solve.stepping import quasi_static
from fsm.solve.stepping.accuracy import ACCURATE
from fsm.solve.stepping.path_state import Path, PathRules
from fsm.solve.stepping.quasi_static import NewtonRules, StaticModel
from fsm.solve.stepping.vectors import copy_into


@kernel
def follow_arrays(model: Any, path: Path, rules: PathRules, stops: np.ndarray, rows: np.ndarray) -> int:
    """Compiled `follow` for a `StaticModel`."""
    outcome: int = quasi_path.follow(borrowed(model), borrowed(path), borrowed(rules), borrowed(stops), borrowed(rows))
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
    return row.UNABLE


def _equilibrium(model: StaticModel, path: Path, rules: PathRules, t: float, guess: np.ndarray) -> int:
    calls, arrays, numbers, counts = model.calls, model.arrays, path.numbers, path.counts
    if counts[row.JUDGED] != 0 and numbers[row.FOUND_AT] == t:
        return row.ACCEPTED
    counts[row.JUDGED] = 0
    reaction = numbers[row.REACTION]
    calls.begin(arrays, t, numbers[row.TIME], path.q, path.next_efforts, rules.rate_dependent, reaction)
    newton = NewtonRules(
        rules.tolerance * reaction, reaction, rules.reach, rules.max_iterations, rules.mixed, rules.span, rules.force_scale
    )
    found = quasi_static.settle_arrays(model, guess, newton)
    if calls.lacks(arrays):
        return row.LACKS
    counts[row.ITERATIONS] += found.counts[quasi_static.SOLVED]
    counts[row.EVALUATIONS] += found.counts[quasi_static.EVALUATED]
    counts[row.FACTORISATIONS] += found.counts[quasi_static.FACTORISED]
    counts[row.LAST_ITERATIONS], numbers[row.FORCE_ROUND_OFF] = found.counts[quasi_static.ITERATION], found.round_off
    if found.ending != quasi_static.FOUND:
        return row.NEWTON if found.ending == quasi_static.TOO_MANY else row.UNABLE
    copy_into(found.q, path.found)
    calls.efforts(arrays, path.found_efforts)
    numbers[row.FOUND_AT] = t
    return row.ACCEPTED


def _look(model: StaticModel, path: Path, rules: PathRules, t: float, record: np.ndarray) -> int:
    if path.counts[row.JUDGED] != 0:
        judgement = path.counts[row.JUDGED] - 1
        return row.UNSTABLE if judgement == row.UNSTABLE else row.ACCEPTED
    model.calls.end_of_step(model.arrays, path.found, rules.trial, ACCURATE, rules.rate_dependent, record)
    if model.calls.lacks(model.arrays):
        return row.LACKS
    if record[row.PASSED] > 0.0:
        return row.CROSSED
    if record[row.NEGATIVE] == row.UNKNOWN:
        return row.DOUBTFUL
    return row.UNSTABLE if record[row.NEGATIVE] > 0.0 else row.ACCEPTED


def _stability(model: StaticModel, path: Path, rules: PathRules, t: float) -> int:
    if path.counts[row.JUDGED] != 0:
        judgement = path.counts[row.JUDGED] - 1
        return row.UNSTABLE if judgement == row.RELEASED else judgement
    negative = path.next_record[row.NEGATIVE_AT_REST]
    if not rules.rate_dependent or negative == 0.0:
        return row.ACCEPTED
    held = row.UNKNOWN
    if negative != row.UNKNOWN:
        held = model.calls.sticks(model.arrays, path.found, rules.trial, ACCURATE, rules.sticking)
    if held != 0.0:
        return row.DOUBTFUL if held == row.UNKNOWN else row.ACCEPTED
    if path.counts[row.RESTING] == 0:
        model.calls.balance_at_rest(model.arrays, t, path.found, path.next_resting, path.next_resting_drives)
    rests = largest_ratio(path.next_resting, rules.force_scale) < quasi_path.RESTS * path.numbers[row.REACTION]
    return row.UNSTABLE if rests else row.SLOWED


def _accept(model: StaticModel, path: Path, t: float) -> None:
    model.calls.accept(model.arrays, path.found)


for _asked, _instead in (
    (quasi_path.progress_at, _progress_at), (quasi_path.difference, _difference), (quasi_path.retracted, _retracted),
    (quasi_path.contact_force, _contact_force),
    (quasi_path.balance_at_rest, _balance_at_rest), (quasi_path.power_before, _power_before),
    (quasi_path.tangent_guess, _tangent_guess),
    (quasi_path.equilibrium, _equilibrium), (quasi_path.look, _look), (quasi_path.stability, _stability),
    (quasi_path.accept, _accept),
):  # fmt: skip
    compiled_as(_asked, StaticModel, _instead)
