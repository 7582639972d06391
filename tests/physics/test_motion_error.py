"""The error of a motion with impacts that the summary states, compared with the same motion at a small tolerance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fsm.results.store import read_solution
from fsm.run import run_case
from fsm.scene.load_case import load_case
from fsm.summary import state_errors

CASE = """
gravity = [0, 0, "-9.81 m/s^2"]
contact = { stiffness = "1e7 N/m^1.5", restitution = 0.6 }
solve = { end_time = "0.12 s", rtol = RTOL }

[[scene.bodies]]
name = "plate"
mass = "20 g"
inertia = [8e-6, 2e-5, 2.7e-5]
position = [0, 0, "30 mm"]
orientation = [0.995, 0, 0.0998749, 0]
plate = { length = "100 mm", width = "60 mm", thickness = "4 mm" }

[[scene.pairs]]
first = "plate"
second = "floor"

[[obstacle]]
name = "floor"
shape = "plane"
"""


def dropped(folder: Path, rtol: float) -> tuple[dict[str, Any], np.ndarray]:
    """Summary, and positions at the records over the largest displacement."""
    folder.mkdir()
    case = folder / "case.toml"
    case.write_text(CASE.replace("RTOL", f"{rtol:g}"), encoding="utf-8")
    summary = run_case(load_case(case), folder / "out", progress=False)
    shape = read_solution(folder / "out" / "result.h5").shape
    return summary, shape / np.abs(shape - shape[0]).max()


def test_the_stated_error_contains_the_difference(tmp_path: Path) -> None:
    summary, positions = dropped(tmp_path / "case", 1e-5)
    _, exact = dropped(tmp_path / "exact", 1e-8)
    off = float(np.abs(positions - exact).max())
    assert 0.0 < off < summary["motion_error"] < 0.02
    assert not any("positions have an error" in line for line in summary["warnings"])


def test_a_large_error_is_a_warning() -> None:
    summary: dict[str, Any] = {"warnings": []}
    state_errors(summary, {"steps": {"by": "comparison", "positions": 0.019}})
    assert summary["warnings"] == [] and summary["motion_error"] == 0.019
    state_errors(summary, {"steps": {"by": "comparison", "positions": 0.043, "positions_since": 0.2}})
    (line,) = summary["warnings"]
    assert "error of about 4.3 % of the largest displacement (above 2 % from t = 0.2 s on), due to the steps" in line
