"""What a run of a mechanism prints, stores and draws."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import fsm
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from fsm.results.solution import JOINT_AXIS, LINK
from fsm.run.summary_text import summary_lines
from fsm.run.table_files import format_table
from fsm.views.report.tables import sections_of

_CRANK, _ROD = 0.1, 0.3
_BEARING = {"kind": "revolute", "axis": [0, 1, 0]}


def crank(end: float = 2.0, **keys: Any) -> dict[str, Any]:
    """Slider-crank without shapes, whose crank turns by 60 degrees a second from its dead centre."""
    places = {"crank": 0.05, "rod": 0.25, "slider": 0.4}
    bodies = [{"name": n, "mass": 0.5, "inertia": [1e-3] * 3, "position": [x, 0, 0]} for n, x in places.items()]
    joints = [
        {"name": "bearing", "first": "ground", "second": "crank", "at": [0, 0, 0], **_BEARING},
        {"name": "pin", "first": "crank", "second": "rod", "at": [_CRANK, 0, 0], **_BEARING},
        {"name": "wrist", "first": "rod", "second": "slider", "at": [0.4, 0, 0], **_BEARING},
        {"name": "guide", "kind": "prismatic", "first": "ground", "second": "slider", "at": [0.4, 0, 0], "axis": [1, 0, 0]},
    ]
    joints[0]["motor"] = {"speed": "60 deg/s"}
    scene = {"bodies": bodies, "joints": joints}
    solve = {"end_time": end, "error_estimates": "off"}
    return {"units": "SI", "gravity": [0, 0, -9.81], "scene": scene, "solve": solve, "save": {"interval": 0.1}, **keys}


def slider(angle: float) -> float:
    """Displacement of the slider, m."""
    return _CRANK * math.cos(angle) + math.sqrt(_ROD**2 - (_CRANK * math.sin(angle)) ** 2) - _CRANK - _ROD


@pytest.mark.figures
def test_results_lead_with_coordinates_and_reactions_of_joints(tmp_path: Path) -> None:
    result = fsm.load(crank()).run(tmp_path, figures=True)
    summary = result.summary
    lines = summary_lines(summary, tmp_path)
    assert lines[0] == "report      bearing.angle 120 deg at the end, from 0 deg at 0 s to 120 deg at 2 s"
    assert lines[3].startswith("report      wrist.angle") and "to 19.47 deg at 1.5 s" in lines[3]
    assert not any("peak" in line or "slower" in line for line in lines)
    (reactions,) = (line for line in lines if "reactions of joints" in line)
    largest = max(summary["reactions"], key=lambda row: row["force"])
    assert f"{largest['force']:.4g} N in {largest['joint']}" in reactions
    assert "largest moment" not in reactions  # all lie in the plane: moments of round-off
    guide = next(row for row in summary["report"] if row["name"] == "joint.guide.displacement")
    assert guide["end"] == pytest.approx(slider(2.0 * math.pi / 3.0), rel=1e-9) and guide["unit"] == "m"
    assert {path.name for path in tmp_path.glob("*.png")} == {"report.png", "motion.png", "energy.png"}
    page = {section["title"]: section for section in sections_of(result.solution)}
    assert page["Motion"]["table"][0] == ["bearing.angle", "deg", "0", "120", "0", "120"]
    assert page["Reactions of joints"]["table"][0][3:] == ["0", ""]


def test_a_motor_that_starts_from_rest_gives_no_velocities(tmp_path: Path) -> None:
    """A smooth ramp has a speed of round-off right after the start, which is no initial velocity and no scale of speeds."""
    case = crank(1.0)
    case["scene"]["joints"][0]["motor"] = {"angle": "60 deg", "time": {"kind": "ramp", "end": 1.0}}
    summary = fsm.load(case).run(tmp_path, figures=False).summary
    assert summary["warnings"] == [] and summary["steps"] < 2000


def test_report_names_what_leads(tmp_path: Path) -> None:
    result = fsm.load(crank(0.5, report=["guide.displacement", "body.slider.position"])).run(tmp_path, figures=False)
    names = [row["name"] for row in result.summary["report"]]
    assert names == ["joint.guide.displacement", *(f"body.slider.position {axis}" for axis in "xyz")]
    table = format_table([result.summary | {"case": "one"}])
    assert table.splitlines()[0].split("  ")[1].strip() == "guide.displacement (mm)"
    assert f"{1e3 * slider(math.pi / 6.0):.4g}" in table
    with pytest.raises(CaseError, match=r'report: no channel matches "joint.hinge.angle"; nearest'):
        fsm.load(crank(report=["hinge.angle"])).run(tmp_path / "wrong")


def test_bodies_without_a_shape_are_lines_between_their_joints(tmp_path: Path) -> None:
    solution = fsm.load(crank(1.5)).run(tmp_path, figures=False).solution
    panel, names = solution.layout.panel, np.array(solution.layout.quad_names)
    ends = solution.shape[-1][(names == "crank") & (panel == LINK)][:, 1]
    assert ends[np.argsort(ends[:, 2])] == pytest.approx(np.array([[0, 0, -_CRANK], [0, 0, 0]]), abs=1e-12)
    block = solution.shape[:, (names == "guide") & (panel == JOINT_AXIS)].mean(axis=(1, 2))
    assert block[-1] == pytest.approx([_CRANK + _ROD + slider(math.pi / 2.0), 0.0, 0.0])
    assert np.count_nonzero((names == "slider") & (panel == LINK)) == 3  # its joints are at its centre of mass: a cross


def test_check_tells_and_draws_joints(tmp_path: Path) -> None:
    case, out = tmp_path / "case.toml", tmp_path / "mechanism.png"
    fsm.load(crank()).write(case)
    done = CliRunner().invoke(cli, ["check", str(case), "--out", str(out)])
    text = "pin: revolute, from crank to rod, at (100, 0, 0) mm, axis (0, 1, 0); a positive angle turns rod from z to x"
    assert done.exit_code == 0 and text in done.output
    assert "0 degrees of freedom at the start, after 21 locked directions" in done.output
    assert out.stat().st_size > 10_000
    refused = CliRunner().invoke(cli, ["check", str(case), "--out", str(tmp_path / "x.gif")])
    assert refused.exit_code == 2 and "FILE.png" in refused.output
