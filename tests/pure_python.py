"""Tests by which kernels are measured line by line: they run in pure Python, a thousand times slower than compiled.

    NUMBA_DISABLE_JIT=1 python -m pytest -p tests.pure_python tests

The plug-in keeps a few parameter sets of every test function in the `FILES`, and stops each test after a few seconds. The
lines reached by then count; the verdict is that of the compiled run, so the test is skipped here.
"""

from __future__ import annotations

import itertools
import os
import random
import signal
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

import pytest
from hypothesis import HealthCheck, settings

FILES = {
    "unit": (
        "ancf_elements ancf_reduced ancf_shape ancf_wrinkle beams box_pairs box_tree bristle chord_shortcuts "
        "compile contact_forces contact_surface coupling crease_hysteresis_law drive edge_edge end_taper even_dampers "
        "facets friction_laws from_deployed groups increments keys latch laws ligament linear normal_laws obstacles "
        "one_pass pair_state pattern plate_contacts point_shape pose pressed radau_structured scipy_ivp shape_distance "
        "start_overlap swing_twist time_function"
    ),
    "physics": "tangents momentum",
}
"""Tests of kernels and of what calls them."""

SETS = 3
"""Of parameters, that a test function is run with: always the same ones, drawn by its name."""

MOST = 3.0
"""Seconds of processor time after which a test is stopped."""

_AGAIN = 0.01
"""Seconds of processor time until the next look whether it can be."""
_OURS = tuple(f"{Path(__file__).parents[1] / folder}{os.sep}" for folder in ("fsm", "tests"))


def pytest_configure(config: pytest.Config) -> None:
    """Infinity minus infinity gives a warning in Python but not in compiled code; no example is too slow for hypothesis."""
    config.addinivalue_line("filterwarnings", "default::RuntimeWarning")
    settings.register_profile("pure Python", deadline=None, suppress_health_check=list(HealthCheck))
    settings.load_profile("pure Python")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Apply the selection described above."""
    files = {f"{folder}/test_{name}.py" for folder, names in FILES.items() for name in names.split()}
    kept, others = [], []
    for _, group in itertools.groupby(items, key=_function):
        sets = list(group)
        path = Path(sets[0].path)
        wanted = f"{path.parent.name}/{path.name}" in files
        some = random.Random(_function(sets[0])).sample(range(len(sets)), min(SETS, len(sets)))
        chosen = [sets[k] for k in sorted(some)] if wanted else []
        kept += chosen
        others += [item for item in sets if item not in chosen]
    items[:] = kept
    config.hook.pytest_deselected(items=others)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Iterator[None]:
    """Stop a test that runs too long."""
    signal.signal(signal.SIGPROF, _stop)
    signal.setitimer(signal.ITIMER_PROF, MOST)
    try:
        return (yield)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def _stop(number: int, frame: FrameType | None) -> None:
    """Stop only in code of this project: a stop inside coverage would keep its lock, and coverage would then wait for it
    forever."""
    if frame is None or not frame.f_code.co_filename.startswith(_OURS):
        signal.setitimer(signal.ITIMER_PROF, _AGAIN)
        return
    pytest.skip(f"stopped after {MOST:g} s of processor time")


def _function(item: pytest.Item) -> str:
    """Name of a test function, ``file.py::test_name``."""
    return f"{Path(item.path).name}::{item.nodeid.split('::', 1)[-1].split('[')[0]}"
