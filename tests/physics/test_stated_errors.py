"""Errors that runs of flexible facets state, against runs with much smaller cells or steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.analyses.comparison import Comparison, compared, not_compared
from fsm.case.loading.load_case import load_case
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.run.run_case import run_case
from tests.case_texts import kresling_of_bars

PLATE = """
[sheet]
kind = "plate"
length = 0.3
width = 0.2
thickness = 1e-3
mesh = [4, 4]
facets = "flexible"
probe = [{ name = "tip", at = "vertex 3" }]
[[sheet.support]]
at = "edge left"
clamped = true
[material]
young = 70e9
poisson = 0.3
density = 2700
damping = 0
"""
LOADED = (
    'load=[{ name = "push", at = "edge right", force_per_length = [0, 0, 80] }]', "solve.method=static", "solve.end_time=1",
    "save.interval=0.25",
)  # fmt: skip
STRUCK = (
    'load=[{ at = "edge right", force_per_length = [0, 0, 20], time = { kind = "table", time = [0, 0.01, 0.02], '
    "value = [0, 1, 0] } }]",
    "solve.method=mean-force", "solve.end_time=0.2", "solve.step=4e-3", "save.interval=8e-3", "sheet.mesh=[2, 1]",
)  # fmt: skip


SHEET = """
[sheet]
kind = "miura"
columns = 2
rows = 2
a = 0.04
b = 0.035
sector_angle = "51 deg"
fold_angle = "56 deg"
facets = "flexible"
mesh_size = 0.015
thickness = 3e-4
[[sheet.support]]
at = "edge left"
[material]
young = 3e9
poisson = 0.3
density = 1200
[crease]
stiffness_per_length = 0.15
[[drive]]
edge = "right"
direction = [-1, 0, 0]
guide = false
speed = 0.04
travel = 0.004
[solve]
method = "static"
[save]
every = 0.002
"""


def run(folder: Path, *overrides: str, text: str = PLATE) -> tuple[dict[str, Any], Solution]:
    folder.mkdir()
    (folder / "case.toml").write_text(text, encoding="utf-8")
    summary = run_case(load_case(folder / "case.toml", overrides), folder / "out", progress=False, figures=False)
    return summary, read_solution(folder / "out" / "result.h5")


def true_errors(own: tuple[dict[str, Any], Solution], reference: Solution) -> dict[str, Any]:
    return compared(Comparison("", (), safety=1.0), (own[1], own[0]), [reference])


def test_the_error_of_the_mesh_of_facets_contains_the_real_one(tmp_path: Path) -> None:
    own = run(tmp_path / "own", *LOADED)
    _, fine = run(tmp_path / "fine", *LOADED, "sheet.mesh=[12, 12]", "solve.error_estimates=off")
    stated, true = own[0]["errors"]["mesh"], true_errors(own, fine)
    pairs = [(found["positions"], found["probes"]["tip"], found["loads"]["push"]) for found in (stated, true)]
    for one, other in zip(*pairs, strict=True):
        assert 1e-3 < other < one < 12.0 * other
    assert own[0]["errors"]["steps"] == {"by": "none: all records are equilibria"}
    assert "motion_error" not in own[0] and fine.summary["errors"]["mesh"]["by"].startswith("not estimated")


def test_the_error_of_few_cells_follows_from_their_numbers(tmp_path: Path) -> None:
    """Three cells along a facet become two with twice the size of cells: the real error is twice the difference."""
    own = run(tmp_path / "own", text=SHEET)
    _, fine = run(tmp_path / "fine", "sheet.mesh_size=0.005", "solve.error_estimates=off", text=SHEET)
    stated, true = own[0]["errors"]["mesh"], true_errors(own, fine)
    for name in ("peak_force", "positions"):
        assert 5e-3 < true[name] < stated[name] < 20.0 * true[name]


def test_the_error_of_frequencies_of_facets_contains_the_real_one(tmp_path: Path) -> None:
    modes = ('step=[{ name = "free", kind = "modes", modes = 4 }]',)
    own, fine = run(tmp_path / "own", *modes), run(tmp_path / "fine", *modes, "sheet.mesh=[12, 12]")
    stated, true = own[0]["errors"]["mesh"]["frequencies"]["free"], true_errors(own, fine[1])["frequencies"]["free"]
    assert np.all(np.array(true) < stated) and max(true) > 5e-3


def test_the_error_of_the_steps_of_a_motion_of_facets_contains_the_real_one(tmp_path: Path) -> None:
    own = run(tmp_path / "own", *STRUCK)
    _, fine = run(tmp_path / "fine", *STRUCK, "solve.step=5e-4", "solve.error_estimates=off")
    true = true_errors(own, fine)["positions"]
    assert 0.02 < true < own[0]["motion_error"] < 12.0 * true
    assert any("due to the steps in time: reduce solve.step" in line for line in own[0]["warnings"])


@pytest.mark.parametrize(
    ("differences", "error"),
    [
        ((1.0,), 1.0),
        ((1.0, 4.0), 1.0),  # second order: three times the error
        ((1.0, 1.5), 2.0),  # slower than first order
        ((1.0, 1.0), 3.0),  # no convergence
        ((0.1, 4.0), 0.5),  # small by coincidence
    ],
)
def test_no_order_is_assumed(differences: tuple[float, ...], error: float) -> None:
    assert Comparison("", (), safety=1.0).error(differences) == pytest.approx(error)


def test_a_long_run_is_compared_only_if_asked() -> None:
    assert not not_compared("auto", 1000, 1000)
    assert 'solve.error_estimates = "all"' in not_compared("auto", 100_000, 1000)
    assert not not_compared("all", 100_000, 1000)
    assert not_compared("off", 1, 1) == 'not estimated: solve.error_estimates = "off"'


def test_steps_that_end_at_records_have_an_error() -> None:
    """With all of its records, a run with a larger tolerance has the same steps of at most a half interval."""
    text = kresling_of_bars("-10 N", "20 ms", "1 ms").replace('"0.2 s"', '"10 ms"')
    case = fsm.load(text).set("solve.rtol", 3e-4)
    own, finer = case.run(), case.set({"solve.rtol": 3e-6, "solve.error_estimates": "off"}).run()
    a, b = own.solution.shape, finer.solution.shape
    true = np.abs(a - b).max() / np.abs(a - a[0]).max()
    assert own.summary["errors"]["mesh"]["by"] == "none: rigid bodies and bars have no mesh"
    assert 1e-4 < true < own.summary["errors"]["steps"]["positions"]
