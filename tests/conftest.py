"""Settings of all tests."""

from __future__ import annotations

import resource
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

import fsm.run.run_case
from fsm.results.solution import Solution
from fsm.views.plots.figures import remove_figures

# a shell that starts tests in the background ignores interrupts, and so would all processes that the tests interrupt
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("fsm", deadline=None)  # the first call may compile kernels, and processors differ in speed
settings.load_profile("fsm")

_draw = fsm.run.run_case.begin_drawing


def _no_figures(solution: Solution, out: Path, alone: bool = False) -> Callable[[], list[Path]]:
    """Leave what `figures=False` leaves."""
    remove_figures(out)
    return list


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    """Runs of a test draw figures only if the test or its module has the mark `figures`; also runs in fixtures."""
    fsm.run.run_case.begin_drawing = _draw if item.get_closest_marker("figures") else _no_figures
    return (yield)


_memory: list[float] = []
"""Largest memory of each process with tests, GB."""


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A worker tells the first process how much memory it took."""
    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0) / 1e9
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["memory"] = largest
    elif not _memory:
        _memory.append(largest)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """The memory of a worker that ended."""
    _memory.append(getattr(node, "workeroutput", {}).get("memory", 0.0))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """The bound is 1.5 GB, so that two workers fit on a machine with 4 GB."""
    terminalreporter.write_line(f"memory of processes with tests, at most: {max(_memory):.2f} GB")
