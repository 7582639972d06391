"""The error of a motion with impacts that the summary states, compared with the same motion at a small tolerance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import fsm
from fsm.run.summary import state_errors
from tests.runs import run

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
    solution, summary = run(folder, CASE.replace("RTOL", f"{rtol:g}"))
    shape = solution.shape
    return summary, shape / np.abs(shape - shape[0]).max()


def test_the_stated_error_contains_the_difference(tmp_path: Path) -> None:
    summary, positions = dropped(tmp_path / "case", 1e-5)
    _, exact = dropped(tmp_path / "exact", 1e-8)
    off = float(np.abs(positions - exact).max())
    assert 0.0 < off < summary["motion_error"] < 0.02
    assert not any("positions have an error" in line for line in summary["warnings"])


def test_the_error_of_a_body_that_turns_in_place_is_that_of_its_rotation() -> None:
    """The centre moves by 0.2 mm without error; the body turns ten times about an unstable axis."""
    case = fsm.load("""
[[scene.bodies]]
name = "body"
mass = 1.0
inertia = [0.01, 0.02, 0.025]
velocity = [1e-4, 0, 0]
angular_velocity = [0.2, 9.0, 0.1]
[solve]
method = "generalized-alpha"
end_time = 2.0
step = 0.01
[save]
interval = 0.1
""")
    coarse, fine = (case.set("solve.step", step).run() for step in (0.01, 0.001))
    axes = [Rotation.from_quat(run.solution.q[:, 3:7], scalar_first=True).as_matrix() for run in (coarse, fine)]
    off = np.abs(axes[0] - axes[1]).max() / np.abs(axes[1] - axes[1][0]).max()
    assert 1e-3 < off < coarse.summary["motion_error"] < 15.0 * off


def test_motions_that_part_have_no_error() -> None:
    summary: dict[str, Any] = {"warnings": []}
    state_errors(summary, {"steps": {"by": "none stated: motions part", "positions_since": 0.2}})
    assert "motion_error" not in summary
    (line,) = summary["warnings"]
    assert line.startswith("positions depend on the steps in time, and their error is unknown (above 2 % from t = 0.2 s on)")


def test_a_large_error_is_a_warning() -> None:
    summary: dict[str, Any] = {"warnings": []}
    state_errors(summary, {"steps": {"by": "comparison", "positions": 0.019}})
    assert summary["warnings"] == [] and summary["motion_error"] == 0.019
    state_errors(summary, {"steps": {"by": "comparison", "positions": 0.043, "positions_since": 0.2}})
    (line,) = summary["warnings"]
    assert "error of about 4.3 % of the largest displacement (above 2 % from t = 0.2 s on), due to the steps" in line
