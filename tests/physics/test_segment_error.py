"""The error of a strip that its segments cause is stated, and it is correct within a small factor."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.analyses.comparison import Comparison, compared
from fsm.analyses.segment_error import SegmentError
from fsm.case.loading.load_case import load_case
from fsm.model.compile.compile_case import compile_case
from fsm.run.recorder import RecordedSolve
from fsm.run.run_case import run_case

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


TAUT = """
[strip]
length = "372 mm"
width = "109 mm"
thickness = "0.1 mm"
panels = 4
fold_angle = "68 deg"
segments_per_panel = 20
held = [1]

[material]
young = "47 GPa"
poisson = 0.3
density = "1600 kg/m^3"

[crease]
law = "linear"
stiffness = "11.5 N mm/rad"

[[drive]]
crease = 3
direction = [1, 0, 0]
speed = "2 mm/s"
travel = "116.2 mm"
"""


def test_stated_errors_of_a_strip_that_is_drawn_nearly_taut(tmp_path: Path) -> None:
    """The force with many segments lies within the error that fewer segments state, and this error is at most five times the
    difference."""
    (tmp_path / "case.toml").write_text(TAUT)
    found = {}
    for count in (10, 20, 60):
        case = load_case(tmp_path / "case.toml", [f"strip.segments_per_panel={count}"])
        found[count] = run_case(case, tmp_path / str(count), progress=False)
    for count in (10, 20):
        one = found[count]
        actual = abs(found[60]["final_force"] - one["final_force"]) / max(abs(one["peak_force"]), abs(one["final_force"]))
        assert actual < one["mesh_error_final"] < 5.0 * actual
    assert any("the segments are coarse: peak force: error about" in warning for warning in found[10]["warnings"])


@pytest.mark.parametrize("spatial", [False, True])
def test_unresolved_energy_of_a_linear_curvature(spatial: bool) -> None:
    """Curvature c x along a panel of n segments, without normal force: every change of the curvature counts, including those
    at both ends."""
    count, rate = 10, 0.1
    more = ["strip.panels=2", f"strip.segments_per_panel={count}", "strip.held=[1]", f"solve.spatial={str(spatial).lower()}"]
    case = load_case(TRIAL, [*more, "drive=none", "save=none", "solve.end_time=1 s", "expect=none", "contact=none"]).case
    _, system = compile_case(case)
    q, _ = system.initial()
    assert case.strip is not None and case.material is not None
    length = case.strip.length / case.strip.panels / count
    joints = length * np.arange(1, count)
    angle = 0.3 + np.concatenate([[0.0], np.cumsum(rate * joints * length)])
    along = np.column_stack([np.cos(angle), -np.sin(angle)])
    ends = np.concatenate([[[0.0, 0.0]], np.cumsum(length * along, axis=0)])
    place = 0.5 * (ends[1:] + ends[:-1])
    poses = q.reshape(count, -1)
    if spatial:
        half, zero = 0.5 * angle, 0.0 * angle
        poses[:, :3] = np.column_stack([place[:, 0], zero, place[:, 1]])
        poses[:, 3:] = np.column_stack([np.cos(half), zero, np.sin(half), zero])
    else:
        poses[:, :2], poses[:, 2] = place, angle
    bending = case.material.bending(case.strip.width, case.strip.thickness)
    unresolved = SegmentError(system, case.strip, case.material).unresolved(poses.ravel())
    assert unresolved.left_out == pytest.approx(bending * count * (rate * length) ** 2 * length / 12.0, rel=1e-6)
    whole = np.sum(joints**2) + 0.5 * (0.0 + (count * length) ** 2)
    assert unresolved.bending == pytest.approx(0.5 * bending * rate**2 * whole * length, rel=1e-6)


SNAPPING = """
[strip]
length = "310 mm"
width = "80 mm"
thickness = "0.18 mm"
panels = 8
fold_angle = "85.8 deg"
segments_per_panel = 8

[material]
young = "36 GPa"
density = "2700 kg/m^3"

[crease]
law = "linear"
stiffness = "29 N mm/rad"

[contact]

[[drive]]
crease = 4
direction = [0, 0, -1]
speed = "1 mm/s"
travel = "2.4 mm"
"""


def test_a_strip_that_snaps_before_its_peak_is_compared_with_other_segments() -> None:
    """The path snaps near 1.99 mm; without further runs no error is stated."""
    case = fsm.load(SNAPPING)
    own, off = case.run().summary, case.set("solve.error_estimates", "off").run().summary
    assert own["events"][0]["kind"] == "snap" and own["events"][0]["travel"] < own["peak_travel"]
    by = own["errors"]["mesh"]["by"]
    assert by.startswith("comparison with 6 and 12 segments per panel, because the path snaps at 1.99")
    assert own["mesh_error"] > 0.05 and own["mesh_error"] == own["errors"]["mesh"]["peak_force"]
    assert any("snaps depend on the segments" in warning for warning in own["warnings"])
    assert off["peak_force"] == own["peak_force"] and off["mesh_error"] is None and off["mesh_error_final"] is None
    assert off["errors"]["mesh"]["by"].startswith("not estimated: the path snaps at 1.99")
    assert "compare with strip.segments_per_panel = 12" in off["errors"]["mesh"]["by"]


def test_a_strip_without_snaps_has_no_further_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a further run")

    monkeypatch.setattr(RecordedSolve, "_further_run", refuse)
    (tmp_path / "case.toml").write_text(TAUT)
    case = load_case(tmp_path / "case.toml", ["strip.segments_per_panel=10", "solve.error_estimates=all"])
    summary = run_case(case, tmp_path / "out", progress=False, figures=False)
    assert summary["errors"]["mesh"]["by"] == "bending energy that the segments do not resolve"
    assert summary["mesh_error"] == pytest.approx(0.36164, rel=1e-3)


def _pulled(peak: float, *snaps: float, kind: str = "snap") -> Any:
    events = [{"kind": kind, "travel": travel} for travel in snaps]
    forces = {"peak_force": peak, "final_force": 0.5 * peak, "peak_travel": 0.01, "final_travel": 0.02}
    return SimpleNamespace(summary={**forces, "drive": "crease 3", "events": events})


@pytest.mark.parametrize(
    ("own", "other", "words", "peak", "final"),
    [
        (_pulled(10.0, 0.005), _pulled(11.0, 0.00501), "", 0.1, 0.05),
        (_pulled(10.0, 0.005), _pulled(9.0, 0.006), "peak force 9 to 10 N", 0.3, 0.15),
        (_pulled(10.0, 0.005), _pulled(11.0), "peak force 10 to 11 N", 0.3, 0.15),
        (_pulled(10.0), _pulled(11.0, 0.005), "peak force 10 to 11 N", 0.3, 0.15),
        (_pulled(10.0, 0.005), _pulled(10.01, 0.005, kind="bifurcation"), "peak force 10 to 10.01 N", 0.02, 0.02),
        (_pulled(10.0, 0.015), _pulled(11.0, 0.016), "final force 5 to 5.5 N", 0.02, 0.15),
        (_pulled(10.0, 0.005, kind="vibration"), _pulled(11.0), "", 0.02, 0.02),
    ],
)
def test_errors_after_a_snap_are_at_least_the_difference_of_the_runs(
    own: Any, other: Any, words: str, peak: float, final: float
) -> None:
    least = {"peak_force": 0.02, "final_force": 0.02}
    stated = compared(Comparison("runs", (), safety=1.0, least=least), (own, own.summary), [other])
    assert stated["by"] == ("runs" + (f"; other meshes snap at other travels: {words}" if words else ""))
    assert stated["peak_force"] == pytest.approx(peak) and stated["final_force"] == pytest.approx(final)
