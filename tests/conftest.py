"""Settings of all tests."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

import fsm.run
from fsm.plots.figures import remove_figures
from fsm.results.solution import Solution

# a shell that starts tests in the background ignores interrupts, and so would all processes that the tests interrupt
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("fsm", deadline=None)  # the first call may compile kernels, and processors differ in speed
settings.load_profile("fsm")

_draw = fsm.run.draw


def _no_figures(solution: Solution, out: Path, alone: bool = False) -> None:
    """Leave what `figures=False` leaves."""
    remove_figures(out)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    """Runs of a test draw figures only if the test or its module has the mark `figures`; also runs in fixtures."""
    fsm.run.draw = _draw if item.get_closest_marker("figures") else _no_figures
    return (yield)
