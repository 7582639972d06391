"""Value of a number of a case for which a response has a given value: bracketing by Alefeld, Potra and Shi (TOMS 748)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import toms748

from fsm.case.schema.units import to_si
from fsm.errors import CaseError, Fault, NotConverged, fault_at
from fsm.io.folder_lock import ENDING, locked_folder
from fsm.studies.problem import case_problem, si_value
from fsm.studies.search import EnoughRuns, Journal, Search
from fsm.studies.sensitivity import response_named

TOLERANCE = 1e-4
"""Relative difference between the response and its target at which the search ends."""


class _Reached(Exception):
    """The response is near enough to its target."""


def solve_for(
    tables: Mapping[str, Any],
    file: Path,
    reach: str,
    by: str,
    between: tuple[float | str, float | str],
    out: Path,
    changes: Sequence[str] = (),
    tolerance: float = TOLERANCE,
    most: int = 40,
    resume: bool = False,
    progress: bool = True,
) -> tuple[float, Search]:
    """Find the value of a number for which a response has a given value.

    Parameters
    ----------
    tables : tables of the case as read from TOML
    file : case file
    reach : ``"peak_force=5 N"``; a plain number is in SI
    by : path of the number
    between : two values of the number, on either side of the solution
    out : folder for the history and the solved case
    changes : ``"path=value"`` texts
    tolerance : relative difference from the target at which the search ends
    most : largest number of runs
    resume : whether to use finished runs in `out`
    progress : whether to print a line for each run on standard error

    Returns
    -------
    float
        Value, SI.
    Search
        All runs.

    Raises
    ------
    CaseError
        The arguments are faulty, or the target is not between the responses at both ends.
    NotConverged
        A run failed, the response jumps over the target, or the number of runs is too small.
    """
    name, sign, wanted = reach.partition("=")
    if not sign or not wanted.strip():
        raise CaseError(f'--reach "{reach}": write response=value, for example "peak_force=5 N"', str(file))
    problem, base = case_problem(tables, file, changes, [by], (response_named(name.strip()),), str(file))
    if by in problem.whole:
        raise CaseError(Fault(by, "has whole numbers; only continuous numbers can be solved for"), str(file))
    low, high = (si_value(value, by, problem, f"--between {value}") for value in between)
    if not low < high:
        raise CaseError(f"--between {between[0]} {between[1]}: the first value must be below the second", str(file))
    key = problem.responses[0].key
    with locked_folder(out, wait=ENDING if resume else 0.0):
        search = Search(problem, (by,), Journal(out, problem, base.text, resume), most, progress)
        target, found = np.nan, None
        try:
            ends = [_response(search, key, value) for value in (low, high)]
            target = _target(wanted.strip(), search.units()[key], str(file))
            if not min(ends) <= target <= max(ends):
                unit = search.units()[key]
                raise CaseError(
                    f"{key} is {ends[0]:.6g} {unit} at {by} = {between[0]} and {ends[1]:.6g} {unit} at {between[1]}; "
                    f"{target:.6g} {unit} is not between them: give other ends",
                    str(file),
                )
            found = _root(search, key, target, low, high, tolerance)
        finally:
            if search.points:
                near = np.abs(search.response(key) - target) <= tolerance * abs(target)
                best = None if found is None else search.points.index({by: found})
                search.write(out, key, target if np.isfinite(target) else None, near, best)
    return found, search


def _target(text: str, unit: str, source: str) -> float:
    with fault_at("--reach", source):
        return to_si(text, unit)


def _response(search: Search, key: str, value: float) -> float:
    run = search.run([value])
    if run is None:
        (path,) = search.paths
        raise NotConverged(f"the run with {search.text({path: value})} failed: {search.errors[-1]}; give other ends")
    return run.responses[key]


def _root(search: Search, key: str, target: float, low: float, high: float, tolerance: float) -> float:
    """Value at which the response is near its target."""
    reached: list[float] = []

    def difference(value: float) -> float:
        found = _response(search, key, float(value)) - target
        if abs(found) <= tolerance * abs(target):
            reached.append(float(value))
            raise _Reached
        return found

    try:
        at = float(toms748(difference, low, high, xtol=1e-9 * abs(high - low), rtol=1e-12, k=1))
    except _Reached:
        return reached[-1]
    except EnoughRuns:
        nearest = int(np.nanargmin(np.abs(search.response(key) - target)))
        text = f"{search.text(search.points[nearest])}: {key} = {search.response(key)[nearest]:.6g} {search.units()[key]}"
        raise NotConverged(
            f"{search.most} runs were not enough; the nearest was {text}; continue with --runs and --resume"
        ) from None
    (path,) = search.paths
    jump = _response(search, key, at)
    raise NotConverged(
        f"{key} jumps over {target:.6g} {search.units()[key]} at {search.text({path: at})}, to {jump:.6g}: a snap, or a "
        f"kink of the response; there is no such value"
    )
