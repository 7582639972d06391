"""The error of a strip that its segments cause is stated, and true to a small factor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fsm.analyses.segment_error import unresolved_bending
from fsm.compile_case import compile_case
from fsm.run import run_case
from fsm.scene.load_case import load_case

TRIAL = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"


def test_stated_error_of_the_trial_strip(tmp_path: Path) -> None:
    peaks, stated = {}, {}
    for count in (10, 40):
        case = load_case(TRIAL, [f"strip.segments_per_panel={count}", "expect=none"])
        summary = run_case(case, tmp_path / str(count), progress=False)
        peaks[count], stated[count] = summary["peak_force"], summary["mesh_error"]
    actual = abs(peaks[10] / peaks[40] - 1.0)
    assert actual < stated[10] + stated[40] < 2.5 * actual
    assert stated[40] < 0.1 * stated[10]


@pytest.mark.parametrize("spatial", [False, True])
def test_unresolved_part_of_a_linear_curvature(spatial: bool) -> None:
    """Curvature x along a panel of n segments: the part is (1/n)^2/12 over the mean of x^2 at the joints."""
    count = 10
    more = ["strip.panels=2", f"strip.segments_per_panel={count}", "strip.held=[1]", f"solve.spatial={str(spatial).lower()}"]
    case = load_case(TRIAL, [*more, "drive=none", "save=none", "solve.end_time=1 s", "expect=none", "contact=none"]).case
    _, system = compile_case(case)
    q, _ = system.initial()
    size = 0.02
    at = np.arange(count) / count
    angle = size * 0.5 * at * (at - 1.0 / count)  # turns from segment to segment are in proportion to x at the joint
    poses = q.reshape(count, -1)
    if spatial:
        half = 0.5 * (2.0 * np.arctan2(poses[:, 5], poses[:, 3]) + angle)
        poses[:, 3:] = np.column_stack([np.cos(half), 0.0 * half, np.sin(half), 0.0 * half])
    else:
        poses[:, 2] += angle
    joints = np.arange(1, count) / count
    slopes = np.diff(angle) * count
    assert slopes == pytest.approx(size * (joints - 1.0 / count))
    expected = (count - 2) * (1.0 / count) ** 2 / 12.0 / np.sum((joints - 1.0 / count) ** 2)
    assert unresolved_bending(system, poses.ravel()) == pytest.approx(expected, rel=1e-6)
