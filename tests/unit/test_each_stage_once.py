"""One run reads, builds, plans and compiles its case once, opens no results file, and returns what it has written."""

from __future__ import annotations

import importlib
import sys
from collections import Counter
from dataclasses import fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm.run.recorder
from fsm.case.loading.load_case import load_case
from fsm.case.loading.table import load_table
from fsm.errors import NotConverged
from fsm.io import atomic_write
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.results.writer import ResultWriter
from fsm.run.rows import Job, solve_row
from fsm.run.run_case import run_case
from tests.unit.test_results import LAYOUT, record

CASES = Path(__file__).parents[2] / "folding_cases"
STRIP = """[strip]
length = 0.24
width = 0.04
thickness = 3e-4
panels = 4
fold_angle = 1.2
segments_per_panel = 3
[material]
young = 3e9
density = 800
[crease]
law = "linear"
stiffness = 9e-3
"""
DRIVE = """[[drive]]
crease = 2
speed = 1e-3
travel = 1e-3
"""
STEPS = """[[step]]
name = "pull"
kind = "static"
[[step.drive]]
crease = 2
speed = 1e-3
travel = 1e-3
[[step]]
name = "modes"
kind = "modes"
modes = 2
[[step]]
name = "pressed"
kind = "static"
[[step.load]]
body = "panel 2 segment 1"
force = [0, 0, 1e-3]
"""
SAVE = """[save]
every = 5e-4
channels = ["crease.*.angle", "support.*"]
[solve]
error_estimates = "off"  # the strip snaps, so runs with other segments would follow
"""
STAGES = {
    "read_case": "fsm.case.loading.load_case", "build_scene": "fsm.builders.scene", "plan_of": "fsm.model.plan.plan",
    "compile_whole": "fsm.model.compile.compile_case", "open_hdf5": "fsm.results.store",
}  # fmt: skip


@pytest.fixture
def stages(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Numbers of calls of the stages of a run."""
    counts: Counter[str] = Counter()

    def counted(name: str, function: Any) -> Any:
        @wraps(function)
        def call(*arguments: Any, **options: Any) -> Any:
            counts[name] += 1
            return function(*arguments, **options)

        return call

    importlib.import_module("fsm.channels.sample")
    for name, home in STAGES.items():
        function = getattr(importlib.import_module(home), name)
        for module in [module for key, module in sys.modules.items() if key.startswith("fsm.")]:
            if getattr(module, name, None) is function:
                monkeypatch.setattr(module, name, counted(name, function))
    monkeypatch.setattr(fsm.run.recorder, "CHECKPOINT_EVERY", 1e9)  # a busy machine would write one
    monkeypatch.setattr(atomic_write, "_flush_entries", counted("to the disk", atomic_write._flush_entries))
    return counts


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


def assert_equal(one: Any, two: Any, name: str = "solution") -> None:
    """Equality of two values, to the last bit."""
    if is_dataclass(one):
        assert type(one) is type(two), name
        for field in fields(one):
            assert_equal(getattr(one, field.name), getattr(two, field.name), f"{name}.{field.name}")
    elif isinstance(one, dict):
        assert list(one) == list(two), name
        for key, value in one.items():
            assert_equal(value, two[key], f"{name}[{key}]")
    elif isinstance(one, np.ndarray):
        assert one.dtype == two.dtype, name
        np.testing.assert_array_equal(one, two, err_msg=name)
    else:
        assert one == two, name


@pytest.fixture
def returned(monkeypatch: pytest.MonkeyPatch) -> list[Solution]:
    """Results that runs have written."""
    found: list[Solution] = []
    finish = ResultWriter.finish

    def kept(writer: ResultWriter, solution: Solution) -> None:
        finish(writer, solution)
        found.append(solution)

    monkeypatch.setattr(ResultWriter, "finish", kept)
    return found


ONCE = {name: 1 for name in STAGES if name != "open_hdf5"}


@pytest.mark.parametrize("text", [STRIP + DRIVE + SAVE, STRIP + STEPS + SAVE], ids=["one drive", "steps"])
def test_a_strip(tmp_path: Path, stages: Counter[str], returned: list[Solution], text: str) -> None:
    run_case(load_case(written(tmp_path, text)), tmp_path / "out", progress=False, figures=False)
    assert stages.pop("to the disk") == 2  # the results file and the summary
    assert dict(stages) == ONCE
    assert_equal(returned[0], read_solution(tmp_path / "out" / "result.h5"))
    before = stages.copy()
    run_case(load_case(tmp_path / "case.toml"), tmp_path / "out", progress=False, figures=False, resume=True)
    assert stages["open_hdf5"] - before["open_hdf5"] == 1  # the solved case, read once
    assert all(stages[name] == before[name] + 1 for name in ONCE)


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("miura_push", ["sheet.columns=4", "sheet.rows=2", "drive.0.travel=0.1", "solve.error_estimates=off"]),
        ("sail_on_cables", ["solve.end_time=1 ms", "solve.error_estimates=off"]),
        ("scissor_array", ["solve.end_time=0.02"]),
    ],
)
def test_other_cases(
    tmp_path: Path, stages: Counter[str], returned: list[Solution], name: str, overrides: list[str]
) -> None:
    loaded = load_case(CASES / name / "case.toml", [*overrides, "expect=none"])
    run_case(loaded, tmp_path, progress=False, figures=False)
    del stages["to the disk"]
    assert dict(stages) == (ONCE if name != "scissor_array" else {"read_case": 1})
    assert_equal(returned[-1], read_solution(tmp_path / "result.h5"))


def test_rows_of_a_table(tmp_path: Path, stages: Counter[str]) -> None:
    written(tmp_path, STRIP + DRIVE + SAVE)
    (tmp_path / "table.csv").write_text("case,strip.thickness\na,3e-4\nb,2e-4\n", encoding="utf-8")
    for case in load_table(tmp_path / "table.csv"):
        loaded = case.loaded  # the one who sends the row reads its case
        stages.clear()
        summary, _, _ = solve_row(Job(loaded, tmp_path / case.name))
        assert stages.pop("to the disk") == 2
        assert dict(stages) == {name: 1 for name in ONCE if name != "read_case"}
        stages.clear()
        files = set(tmp_path.rglob("*"))
        light, curves, _ = solve_row(Job(loaded, curves=("force", "crease.2.angle", "no such")))
        assert dict(stages) == {name: 1 for name in ONCE if name != "read_case"}  # nothing is written
        assert set(tmp_path.rglob("*")) == files
        timeless = [key for key in summary if not key.endswith("_s")]
        assert {key: light[key] for key in timeless} == {key: summary[key] for key in timeless}
        stored = read_solution(tmp_path / case.name / "result.h5")
        assert set(curves) == {"force", "crease.2.angle"}
        np.testing.assert_array_equal(curves["force"][1], stored.force_curve.force[:, 0])
        angle = stored.channels["crease.2.angle"].values
        np.testing.assert_array_equal(curves["crease.2.angle"], [stored.travel[:, 0], angle])


def test_a_record_that_is_not_finite_is_no_result(tmp_path: Path) -> None:
    """The reader refuses such a file, so a run must not write one."""
    writer = ResultWriter(tmp_path / "result.h5", LAYOUT)
    bad = record(1)
    bad.q[2] = np.nan
    writer.append(record(0))
    writer.append(bad)
    with writer, pytest.raises(NotConverged, match="q that are not finite"):
        writer.solution()
