"""Work and precision: alternate runs of two programs, the time that each needs for an error, and tables and figures of these
times."""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path

from fsm.errors import FsmError
from fsm.views.plots.style import COLOURS, GREY, figure

__all__ = [
    "FSM", "PEER", "PLAIN", "TARGETS", "PeerCase", "Point", "Run", "measure", "plot", "ratio", "table", "time_to_error",
    "timed", "write_csv",
]  # fmt: skip

FSM, PEER, PLAIN = "fsm", "Exudyn", "Exudyn as it comes"
"""Exudyn tuned for the problem, and in its default settings."""
TARGETS = (1e-2, 1e-3)
LONG = 0.3
"""Runs of more seconds are measured once."""
ENOUGH, MOST = 0.02, 20
"""Shorter runs are repeated until this time has passed (s), at most this number of times."""
GIVEN_UP = 0.5
"""A run with a larger error has lost its problem; it is no point of a sweep."""


@dataclass(frozen=True)
class Run:
    """One program with one setting.

    Attributes
    ----------
    tool, method, setting : names of the program, method and setting, for display
    solve : function that returns the processor time (s) of the solver alone, with model built and kernels compiled, and the
    error (-)
    """

    tool: str
    method: str
    setting: str
    solve: Callable[[], tuple[float, float]]


@dataclass(frozen=True)
class Point:
    """Result of several equal runs: the shortest processor time, s, and the error."""

    tool: str
    method: str
    setting: str
    seconds: float
    error: float
    runs: int = 1


@dataclass(frozen=True)
class PeerCase:
    """A problem that two programs solve.

    Attributes
    ----------
    name, title : name for files, and title for display
    reference : description of the reference of the errors
    settings : for each program, the settings that all its runs have in common
    runs : function that makes the runs
    impossible : reason why fsm cannot solve the problem, or only a part of it
    """

    name: str
    title: str
    reference: str
    settings: dict[str, str]
    runs: Callable[[], list[Run]]
    impossible: str = ""
    points: list[Point] = field(default_factory=list)


def timed(solve: Callable[[], object]) -> tuple[float, object]:
    """Processor time, s, and the return value."""
    begun = time.process_time()
    result = solve()
    return time.process_time() - begun, result


def _solved(run: Run) -> tuple[list[float], float]:
    """Processor times, s, of one solve or of several short ones, and the error, which is equal in all."""
    first, error = run.solve()
    taken = [first]
    while sum(taken) < ENOUGH and len(taken) < MOST:
        taken.append(run.solve()[0])
    return taken, error


def measure(runs: Sequence[Run], repeat: int, say: Callable[[str], None] = print) -> list[Point]:
    """Each run is made once as a warm-up, and then in turns, alternately with each program; failed runs are omitted."""
    own = [run for run in runs if run.tool == FSM]
    others = [run for run in runs if run.tool != FSM]
    turns = [run for pair in zip_longest(own, others) for run in pair if run is not None]
    seconds: dict[int, list[float]] = {}
    errors: dict[int, float] = {}
    for number in range(repeat):
        for k, run in enumerate(turns):
            if number and (k not in errors or min(seconds[k]) > LONG):
                continue
            try:
                if number == 0:
                    run.solve()  # this run compiles kernels and computes the reference
                taken, error = _solved(run)
            except (FsmError, RuntimeError, ValueError) as problem:
                errors.pop(k, None)
                say(f"    {run.tool}, {run.method}, {run.setting}: {str(problem).splitlines()[0][:90]}")
                continue
            if not error <= GIVEN_UP:
                say(f"    {run.tool}, {run.method}, {run.setting}: lost, error {error:.2g}")
                continue
            seconds.setdefault(k, []).extend(taken)
            errors[k] = error
    return [
        Point(run.tool, run.method, run.setting, min(seconds[k]), errors[k], len(seconds[k]))
        for k, run in enumerate(turns)
        if k in errors
    ]


@dataclass(frozen=True)
class Reached:
    """Time to an error, s, and the first run with a smaller error; `bound`: the fastest run already has a smaller error."""

    seconds: float
    point: Point
    bound: bool


def front(points: Iterable[Point]) -> list[Point]:
    """Points that no other point exceeds in both time and error; the fastest comes first."""
    found: list[Point] = []
    for point in sorted(points, key=lambda p: (p.seconds, p.error)):
        if not found or point.error < found[-1].error:
            found.append(point)
    return found


def time_to_error(points: Iterable[Point], target: float) -> Reached | None:
    """Time at which one method reaches an error; None if it does not.

    The time is interpolated logarithmically on the front of points, of which none is both faster and more accurate.
    """
    best_first = front(points)
    for before, point in zip([None, *best_first], best_first, strict=False):
        if point.error > target:
            continue
        if before is None:
            return Reached(point.seconds, point, True)
        part = math.log(before.error / target) / math.log(before.error / max(point.error, 1e-300))
        return Reached(before.seconds * (point.seconds / before.seconds) ** part, point, False)
    return None


def best(points: Sequence[Point], tool: str, target: float) -> Reached | None:
    """Fastest method of a program."""
    methods = dict.fromkeys(point.method for point in points if point.tool == tool)
    found = [time_to_error([p for p in points if (p.tool, p.method) == (tool, name)], target) for name in methods]
    reached = [one for one in found if one is not None]
    return min(reached, key=lambda one: one.seconds) if reached else None


def ratio(points: Sequence[Point], target: float, peer: str = PEER) -> float:
    """Time of Exudyn over time of fsm; NaN if one of them does not reach the error."""
    own, other = (best(points, tool, target) for tool in (FSM, peer))
    return other.seconds / own.seconds if own and other else math.nan


def verdict(points: Sequence[Point], target: float, peer: str = PEER) -> str:
    """Name of the faster program, in words."""
    own, other = (best(points, tool, target) for tool in (FSM, peer))
    if own is None and other is None:
        return "neither gets there"
    if own is None or other is None:
        return f"only {FSM if other is None else peer} gets there"
    part = other.seconds / own.seconds
    return f"{FSM} {_plain(part, 2)} times faster" if part >= 1.0 else f"**{peer} {_plain(1.0 / part, 2)} times faster**"


def _plain(value: float, digits: int) -> str:
    """Text of a number with some digits; large numbers are rounded to integers."""
    return f"{value:.0f}" if value >= 10.0**digits else f"{value:.{digits}g}"


def _milliseconds(reached: Reached | None, named: bool = True) -> str:
    if reached is None:
        return "not reached"
    point = reached.point
    run = f" ({point.method}, {point.setting})" if named else ""
    return f"{'≤ ' if reached.bound else ''}{_plain(1e3 * reached.seconds, 3)} ms{run}"


def _beside(points: Sequence[Point], target: float, peer: str) -> str:
    """Time of Exudyn, and the faster program; empty if this was not run."""
    if not any(point.tool == peer for point in points):
        return " | "
    return f"{_milliseconds(best(points, peer, target))} | {verdict(points, target, peer)}"


def table(cases: Sequence[PeerCase]) -> str:
    """Times to the errors and the faster program; the same for every method; references and settings. Markdown."""
    lines = [f"| case | error | {FSM} | {PEER}, tuned | | {PLAIN} | |", "|---" * 7 + "|"]
    for case in cases:
        own = case.impossible or "not run"
        for target in TARGETS:
            if case.points:
                own = _milliseconds(best(case.points, FSM, target))
            others = " | ".join(_beside(case.points, target, peer) for peer in (PEER, PLAIN))
            lines.append(f"| {case.title} | {100 * target:g} % | {own} | {others} |")
    lines += ["", "| case | program, method | to 1 % | to 0.1 % |", "|---|---|---|---|"]
    for case in cases:
        for tool, method in dict.fromkeys((point.tool, point.method) for point in case.points):
            own = [point for point in case.points if (point.tool, point.method) == (tool, method)]
            times = " | ".join(_milliseconds(time_to_error(own, target), named=False) for target in TARGETS)
            lines.append(f"| {case.title} | {tool}, {method} | {times} |")
    tools = (FSM, PEER, PLAIN)
    head = " | ".join(f"settings of {tool}" for tool in tools)
    lines += ["", f"| case | reference and error | {head} |", "|---" * 5 + "|"]
    for case in cases:
        settings = " | ".join(case.settings.get(tool, "") for tool in tools)
        reference = case.reference + (f" {case.impossible}" if case.impossible else "")
        lines.append(f"| {case.title} | {reference} | {settings} |")
    return "\n".join(lines) + "\n"


def write_csv(case: PeerCase, about: dict[str, str], path: Path) -> None:
    """All points of a case, each row with the machine."""
    path.parent.mkdir(parents=True, exist_ok=True)
    names = ("case", "tool", "method", "setting", "processor_s", "error", "runs")
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*about, *names])
        for p in case.points:
            writer.writerow([*about.values(), case.name, p.tool, p.method, p.setting, p.seconds, p.error, p.runs])


def _drawn(points: Sequence[Point]) -> tuple[list[float], list[float]]:
    return [max(p.error, 1e-9) for p in points], [1e3 * p.seconds for p in points]


def plot(case: PeerCase, path: Path) -> Path:
    """Processor time against error; the front of every method has filled markers and a line, which is solid for fsm and
    dashed for Exudyn."""
    path.parent.mkdir(parents=True, exist_ok=True)
    methods = list(dict.fromkeys((point.tool, point.method) for point in case.points))
    with figure(path, (6.4, 4.0)) as fig:
        ax = fig.subplots()
        for (tool, method), colour in zip(methods, COLOURS * 3, strict=False):
            own = [p for p in case.points if (p.tool, p.method) == (tool, method)]
            mark, line = ("o", "-") if tool == FSM else ("s", "--")
            ax.loglog(*_drawn(own), mark, ms=4, mfc="white", color=colour)
            ax.loglog(*_drawn(front(own)), mark + line, ms=4, lw=1, color=colour, label=f"{tool}, {method}")
        for target in TARGETS:
            ax.axvline(target, color=GREY, lw=0.8)
        ax.set(xlabel="error (-)", ylabel="processor time (ms)")
        ax.set_title(case.title, loc="left")
        ax.legend(fontsize=7)
    return path
