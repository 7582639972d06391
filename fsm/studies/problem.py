"""A case or a function whose parameters vary: one run at given values, and its responses.

Runs of a study on all cores or on a cluster: the one place that knows where rows run.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fsm.calibrate.study import value_at
from fsm.case.loading.load_case import LoadedCase, load_tables
from fsm.case.loading.overrides import Given, apply_overrides, check_path, place_at, split_override
from fsm.case.models.case import Case
from fsm.case.models.study import StudyResponse, Value
from fsm.case.schema.units import did_you_mean, to_si, with_unit
from fsm.errors import CaseError, Fault, FsmError, fault_at
from fsm.registry import load_extensions
from fsm.results.summary_file import heading
from fsm.run.rows import FORCE, curves_of, ready
from fsm.run.table_files import flat_numbers
from fsm.run.workers import run_jobs
from fsm.text.shown_units import turns
from fsm.views.plots.beside import can_copy
from fsm.views.plots.drawing import in_two_processes

if TYPE_CHECKING:
    from fsm.run.recorder import OnState

CURVE = 101
"""Number of points of the force curve that is kept of a run, equally spaced over the travel."""
_REACTIONS = {"force": "N", "moment": "N m"}
"""Largest reactions of a joint with their units; as responses they are "force at JOINT" and "moment at JOINT"."""
_OF_STEPS = frozenset({
    "peak_force", "peak_travel", "final_force", "final_travel", "dynamic_peak_force", "dynamic_peak_travel", "mass",
})  # fmt: skip
"""Responses from all steps of a pull, for which no states need to be saved between its ends."""
_FEW = 10
"""Number of intervals between the saved states of a run with such responses."""
LATCH_TIME = "latch_time"
"""Response of a mechanism: time at which its first latch closes, s."""
MASS = "mass"
"""Response that is known without a run: mass of all bodies of the model, kg."""


@dataclass(frozen=True)
class Problem:
    """What every run of a study has in common; workers receive it.

    Attributes
    ----------
    source : Path
        Case file or file of the function, for messages.
    tables : dict or None
        Tables of the case with the changes of the study; None for a function.
    function : str
        Name of the function in the file `source`; empty for a case.
    units : dict
        SI unit of each varied path.
    whole : tuple of str
        Paths whose values are whole numbers.
    responses : tuple of StudyResponse
    """

    source: Path
    tables: dict[str, Any] | None
    function: str
    units: dict[str, str]
    whole: tuple[str, ...]
    responses: tuple[StudyResponse, ...]

    def case(self, values: Mapping[str, float]) -> LoadedCase:
        """Case with other values (SI) at some paths.

        Raises
        ------
        CaseError
            The values do not fit into the case.
        """
        assert self.tables is not None
        return load_tables(
            self.tables, [(path, self._given(path, value)) for path, value in values.items()], self.source, (), ""
        )

    def _given(self, path: str, value: float) -> Given:
        unit = self.units[path]
        return Given(round(value) if path in self.whole else f"{value!r} {unit}" if unit else value)


@dataclass(frozen=True)
class Run:
    """Result of one run.

    Attributes
    ----------
    responses : dict of float
        By the keys of the responses.
    units : dict of str
        SI units of the responses.
    travel : m
        Travel at the end of the force curve; 0 without a curve.
    curve : tuple of float, N
        Force of the first drive at `CURVE` equally spaced travels; empty without a drive, or if the travel goes back.
    snaps : int
        Number of snaps of the run.
    """

    responses: dict[str, float]
    units: dict[str, str]
    travel: float = 0.0
    curve: tuple[float, ...] = ()
    snaps: int = 0


def case_problem(
    tables: Mapping[str, Any],
    file: Path,
    changes: Sequence[str],
    paths: Sequence[str],
    responses: Sequence[StudyResponse],
    source: str,
    few_states: bool = False,
) -> tuple[Problem, LoadedCase]:
    """Problem of a case, and the case at its own values; output for other purposes is left out.

    Parameters
    ----------
    tables : tables of the case as read from TOML
    file : case file
    changes : ``"path=value"`` texts
    paths : varied paths
    responses : numbers of each run
    source : name of the study in messages
    few_states : whether only few states are saved if no response needs more, so that the steps of a pull may be longer

    Raises
    ------
    CaseError
        A path is impossible, or the case has faults.
    """
    split = [split_override(text) for text in changes]
    faults = [item for item in split if isinstance(item, Fault)]
    faults += [Fault(path, problem) for path in paths if (problem := check_path(path))]
    if faults:
        raise CaseError(faults, source)
    kept = {key: value for key, value in tables.items() if key != "expect"}  # bounds of results of the case itself
    channels = [one.channel for one in responses if one.channel is not None]
    if channels:
        save = dict(kept.get("save", {}))
        kept["save"] = save | {"channels": list(dict.fromkeys([*save.get("channels", ()), *channels]))}
    changed, wrong = apply_overrides(kept, [item for item in split if not isinstance(item, Fault)], "set ")
    if wrong:
        raise CaseError(wrong, source)
    base = load_tables(changed, (), file)
    saves = any(item[0].startswith("save.") for item in split if not isinstance(item, Fault))
    if few_states and not saves and _needs_few_states(base.case, responses):
        changed["save"] = {"intervals": _FEW}
        base = load_tables(changed, (), file)
    places = {path: place for path in paths if (place := place_at(changed, path)) is not None}
    texts = [path for path, place in places.items() if int not in place.variants() and float not in place.variants()]
    if texts:
        raise CaseError([Fault(path, "is not a number of the case; only numbers can be varied") for path in texts], source)
    whole = tuple(path for path, place in places.items() if int in place.variants() and float not in place.variants())
    return Problem(file, changed, "", {path: place.unit() for path, place in places.items()}, whole, tuple(responses)), base


def _needs_few_states(case: Case, responses: Sequence[StudyResponse]) -> bool:
    """Whether all responses follow from the steps of a single pull."""
    driven = case.drive or (case.scene is not None and case.scene.drives)
    alone = not (case.step or case.stages or case.event)
    return bool(driven) and alone and all(one.channel is None and one.name in _OF_STEPS for one in responses)


def function_problem(
    function: str, folder: Path, units: Mapping[str, str], responses: Sequence[StudyResponse], source: str
) -> Problem:
    """Problem of a Python function, ``"model.py:peak"`` with a file in `folder`; the file is executed.

    Raises
    ------
    CaseError
        The file cannot be read or executed, or it has no such function.
    """
    file, _, name = function.partition(":")
    if not name:
        raise CaseError(Fault("function", f'"{function}" names no function; write "FILE.py:NAME"'), source)
    path = (folder / file).resolve()
    _function(path, name)
    return Problem(path, None, name, dict(units), (), tuple(responses))


def _function(path: Path, name: str) -> Any:
    files, faults = load_extensions([str(path)], path.parent)
    if faults:
        raise CaseError([Fault("function", fault.message) for fault in faults], str(path))
    module = sys.modules[f"fsm_extension_{files[0].rpartition(':')[2]}"]
    found = getattr(module, name, None)
    if not callable(found):
        known = [key for key, value in vars(module).items() if callable(value)]
        raise CaseError(Fault("function", f"has no function {name}{did_you_mean(name, known)}"), str(path))
    return found


def nominal_value(problem: Problem, base: LoadedCase, path: str) -> float | None:
    """Value (SI) of the case at a path; None if it has none.

    Raises
    ------
    CaseError
        The case has something else than a number there.
    """
    assert problem.tables is not None
    place = place_at(problem.tables, path)
    written = None if place is None else place.value
    if written is None:
        try:
            return value_at(base.case, path)
        except CaseError:
            return None
    if isinstance(written, bool | list | dict):
        raise CaseError(Fault(path, f"is {with_unit(written, None)}; only numbers can be varied"), str(problem.source))
    return si_value(written, path, problem, path)


def si_value(value: Value, path: str, problem: Problem, where: str) -> float:
    """Number of a study in SI; it has the unit of the key of the case.

    Raises
    ------
    CaseError
        The value is no number, or has another unit.
    """
    system = "SI" if problem.tables is None else str(problem.tables.get("units", "SI"))
    with fault_at(where):
        return to_si(value, problem.units[path], system)


def evaluate(
    problem: Problem,
    values: Mapping[str, float],
    loaded: LoadedCase | None = None,
    on_state: OnState | None = None,
    on_summary: Callable[[Mapping[str, Any]], None] | None = None,
) -> Run:
    """Run the case, or call the function, at values (SI) of the varied paths; `loaded` is the case with these values.
    `on_state` receives the states of its equilibrium path, and `on_summary` its summary.

    Raises
    ------
    CaseError
        The values do not fit into the case, or it has no such response.
    NotConverged, EnergyAbort
        The solve stopped.
    """
    if problem.tables is None:
        return _call(problem, values)
    loaded = loaded or problem.case(values)
    done = ready(False)(loaded, None, progress=False, figures=False, on_state=on_state)
    if on_summary is not None:
        on_summary(done.summary)
    return _run_of(problem, loaded, done.summary, curves_of(done.solution, (FORCE,)).get(FORCE))


def _run_of(problem: Problem, loaded: LoadedCase, summary: Mapping[str, Any], force: np.ndarray | None) -> Run:
    """Responses and force curve of a solved case; `force` are rows of travels and forces."""
    known = numbers_of(summary)
    responses, units = {}, {}
    for one in problem.responses:
        value, unit = (mass_of(loaded), "kg") if one.name == MASS and MASS not in known else _response(one, known, summary)
        if value is None or not math.isfinite(value):
            raise FsmError(f"{one.key} is not a number in this run")
        responses[one.key], units[one.key] = float(value), unit
    travel, curve = _curve(force)
    snaps = sum(1 for event in summary.get("events", ()) if "snap" in str(event.get("kind", "")))
    return Run(responses, units, travel, curve, snaps)


def _call(problem: Problem, values: Mapping[str, float]) -> Run:
    try:
        found = _function(problem.source, problem.function)(
            **{key.replace(".", "_"): value for key, value in values.items()}
        )
    except (ArithmeticError, ValueError) as error:
        raise FsmError(f"{problem.function}: {error}") from None
    except TypeError as error:
        raise CaseError(Fault("function", f"{problem.function}: {error}"), str(problem.source)) from None
    results = dict(found) if isinstance(found, Mapping) else {problem.responses[0].key: found}
    responses = {}
    for one in problem.responses:
        if one.key not in results:
            text = (
                f"{problem.function} returns no {one.key}{did_you_mean(one.key, results)}; it returns {', '.join(results)}"
            )
            raise CaseError(Fault("response", text), str(problem.source))
        responses[one.key] = float(results[one.key])
        if not math.isfinite(responses[one.key]):
            raise FsmError(f"{one.key} is not a number in this run")
    return Run(responses, {one.key: one.unit for one in problem.responses})


def numbers_of(summary: Mapping[str, Any]) -> dict[str, tuple[Any, str]]:
    """Numbers of a summary with their units, by the names of summary.csv and by their keys, reactions of joints, latches."""
    turning, found = turns(summary), {}
    for key, value in flat_numbers(summary).items():
        if isinstance(value, int | float) and not isinstance(value, bool):
            name, _, unit = heading(key, turning).partition(" (")
            found[key] = found[name] = (value, unit.rstrip(")"))
    for entry in summary.get("reactions", ()):
        found |= {f"{key} at {entry['joint']}": (entry[key], unit) for key, unit in _REACTIONS.items() if key in entry}
    closed = [event for event in summary.get("joint_events", ()) if event.get("what") == "latch closes"]
    impulses = [event["impulse"] for event in closed]
    found |= {"latch_impulse": (max(impulses), "N m s")} if impulses else {}
    times = [event["time"] for event in closed if "time" in event]
    return found | ({LATCH_TIME: (times[0], "s")} if times else {})


def _response(one: StudyResponse, known: Mapping[str, tuple[Any, str]], summary: Mapping[str, Any]) -> tuple[Any, str]:
    if one.channel is not None:
        channels = summary.get("channels", {})
        if one.channel not in channels:
            near = did_you_mean(one.channel, channels) or f"; recorded are {', '.join(list(channels)[:5]) or 'none'}"
            raise CaseError(Fault("response", f"no channel {one.channel}{near}"))
        return channels[one.channel].get(one.of), channels[one.channel]["unit"]
    assert one.name is not None
    if one.name not in known:
        near = did_you_mean(one.name, known) or f"; its numbers are {', '.join(list(known)[:12])}, ..."
        raise CaseError(Fault("response", f"the summary has no number {one.name}{near}"))
    return known[one.name]


def mass_of(loaded: LoadedCase) -> float:
    """Mass of all bodies of a model, kg.

    Raises
    ------
    CaseError
        The model has flexible parts, whose mass is not known before the run.
    """
    from fsm.builders.scene import build_scene

    scene = build_scene(loaded.case)
    if scene.flexible:
        raise CaseError(Fault("response", "mass is known for rigid bodies only; this case has flexible parts"))
    return float(sum(body.mass for body in scene.bodies))


def _curve(force: np.ndarray | None) -> tuple[float, tuple[float, ...]]:
    """Travel at the end and force at equally spaced travels; empty without a drive or if the travel goes back."""
    if force is None or not force.size:
        return 0.0, ()
    travel, force = force
    if np.any(np.diff(travel) < 0.0) or not np.isfinite(force).all() or travel[-1] <= 0.0:
        return 0.0, ()
    points = np.linspace(0.0, travel[-1], CURVE)
    return float(travel[-1]), tuple(np.interp(points, travel, force).tolist())


class _Job(NamedTuple):
    """A problem and the values (SI) of its paths; for other machines also the case, because they may not have its files."""

    problem: Problem
    point: dict[str, float]
    loaded: LoadedCase | None


def run_all(
    problem: Problem, points: Sequence[dict[str, float]], workers: int | None, on: str | None = None
) -> Iterator[tuple[int, Run | None, str]]:
    """Number, result and error of each run in the order of completion; a run that fails has no result.

    Parameters
    ----------
    problem : Problem
    points : values (SI) of each run
    workers : number of processes; 1: this process alone
    on : cluster, see `fsm.run.workers.run_jobs`
    """
    if workers == 1 and on is None:
        yield from _in_this_process(problem, points)
        return
    jobs = [_Job(problem, point, None) for point in points] if on is None else (_with_case(problem, one) for one in points)
    copies = on is None and in_two_processes() and can_copy()
    with closing(run_jobs(_solve, jobs, workers, copies, on)) as outcomes:
        for outcome in outcomes:
            yield outcome.job, outcome.value, " ".join(outcome.error or ())


def _with_case(problem: Problem, point: dict[str, float]) -> _Job:
    """Job with its case; a faulty case is reported by the worker, as all others."""
    loaded = None
    if problem.tables is not None:
        with suppress(CaseError):
            loaded = problem.case(point)
    return _Job(problem, point, loaded)


def _in_this_process(problem: Problem, points: Sequence[dict[str, float]]) -> Iterator[tuple[int, Run | None, str]]:
    for number, point in enumerate(points):
        try:
            run, error = evaluate(problem, point), ""
        except FsmError as failure:
            run, error = None, " ".join(str(failure).splitlines())
        yield number, run, error


def _solve(job: _Job) -> Run:
    return evaluate(*job)
