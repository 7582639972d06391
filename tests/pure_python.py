"""The tests by which kernels are measured line by line: run by Python itself, a thousand times slower than compiled.

    NUMBA_DISABLE_JIT=1 python -m pytest -p tests.pure_python tests

leaves of every test function a few of its sets of parameters, of the files in `FILES`, without those in `TOO_SLOW`.
"""

from __future__ import annotations

import itertools
import random
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

FILES = {
    "unit": (
        "ancf_elements ancf_reduced ancf_shape ancf_wrinkle beams box_pairs box_tree bristle chord_shortcuts "
        "compile contact_forces contact_surface coupling crease_hysteresis_law drive edge_edge end_taper "
        "friction_laws from_deployed groups increments latch laws ligament linear normal_laws obstacles one_pass "
        "pair_state pattern plate_contacts point_shape pose radau_structured scipy_ivp shape_distance "
        "start_overlap swing_twist time_function"
    ),
    "physics": "tangents momentum",
}
"""Tests of kernels and of what calls them."""

SETS = 4
"""Of parameters, that a test function is run with: always the same ones, drawn by its name."""

MOST = 30.0
"""Seconds of processor time that a test may take, measurement included."""

TOO_SLOW = frozenset(
    {
        "test_contact_forces.py::test_result_does_not_depend_on_when_the_broad_phase_was_renewed",
        "test_crease_hysteresis_law.py::test_work_is_stored_or_lost_on_any_way",
        "test_groups.py::test_a_group_is_all_its_pairs",
        "test_groups.py::test_a_wall_far_away_is_not_searched",
        "test_groups.py::test_what_is_watched_grows_with_the_plates_not_with_their_pairs",
        "test_momentum.py::test_linear_momentum_of_a_run",
        "test_pair_state.py::test_energies_of_the_pairs_are_all_that_was_dissipated",
        "test_radau_structured.py::test_a_strip_pulled_by_it_has_the_peak_of_radau",
        "test_radau_structured.py::test_scipy_takes_it_as_a_method",
        "test_radau_structured.py::test_takes_the_steps_of_scipy_in_contact_and_friction",
        "test_radau_structured.py::test_takes_the_steps_of_scipy_on_a_strip",
        "test_tangents.py::test_everything_together",
        "test_tangents.py::test_first_order_jacobian",
    }
)
"""Test functions that did not end within 40 s by the clock of a busy machine; every run names those beyond `MOST`."""

_seconds: dict[str, float] = {}


def pytest_configure(config: pytest.Config) -> None:
    """Infinity less infinity is a warning in Python and none when compiled."""
    config.addinivalue_line("filterwarnings", "default::RuntimeWarning")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep what is said above."""
    files = {f"{folder}/test_{name}.py" for folder, names in FILES.items() for name in names.split()}
    kept, others = [], []
    for _, group in itertools.groupby(items, key=_function):
        sets = list(group)
        path = Path(sets[0].path)
        wanted = f"{path.parent.name}/{path.name}" in files and _function(sets[0]) not in TOO_SLOW
        some = random.Random(_function(sets[0])).sample(range(len(sets)), min(SETS, len(sets)))
        chosen = [sets[k] for k in sorted(some)] if wanted else []
        kept += chosen
        others += [item for item in sets if item not in chosen]
    items[:] = kept
    config.hook.pytest_deselected(items=others)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Processor time of a test: on a busy machine the clock says little."""
    begun = time.process_time()
    try:
        return (yield)
    finally:
        _seconds[_function(item)] = max(_seconds.get(_function(item), 0.0), time.process_time() - begun)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """What belongs into `TOO_SLOW`."""
    slow = sorted(((seconds, name) for name, seconds in _seconds.items() if seconds > MOST), reverse=True)
    for seconds, name in slow:
        terminalreporter.write_line(f"{seconds:.0f} s of processor time, more than {MOST:.0f}: {name}")


def _function(item: pytest.Item) -> str:
    """Name of a test function, ``file.py::test_name``."""
    return f"{Path(item.path).name}::{item.nodeid.split('::', 1)[-1].split('[')[0]}"
