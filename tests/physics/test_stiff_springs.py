"""Round-off of stiff springs: a warning or a refused run; none of either for ordinary stiffness."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from fsm.cli.command_line import cli
from fsm.errors import NotConverged
from tests.runs import run

STRIP = """
[strip]
length = 0.48
width = 0.04
thickness = 3e-4
panels = 6
fold_angle = "80 deg"
segments_per_panel = 4
[material]
young = {young}
density = 800
[crease]
law = "linear"
stiffness = 0.01
[[drive]]
crease = 3
direction = [0, 0, 1]
speed = "2 mm/s"
travel = "4 mm"
[solve]
method = "{method}"
"""

LINKAGE = """
[[scene.bodies]]
name = "rod"
mass = "100 g"
inertia = [2e-6, "3.33e-4 kg m^2", "3.33e-4 kg m^2"]
position = ["100 mm", 0, 0]
[[scene.elements]]
name = "hinge"
inner = "ground"
outer = "rod"
point_outer = ["-100 mm", 0, 0]
translation = [{stiffness}, {stiffness}, {stiffness}]
translation_damping = [10, 10, 10]
rotation = [10, {spring}, 10]
[[scene.elements]]
name = "other end"
inner = "ground"
outer = "rod"
point_inner = ["200 mm", 0, "{gap} mm"]
point_outer = ["100 mm", 0, 0]
translation = [{stiffness}, {stiffness}, {stiffness}]
[solve]
end_time = "50 ms"
"""


def solved(folder: Path, text: str) -> dict[str, Any]:
    return run(folder, text)[1]


def strip(folder: Path, young: float, method: str = "static") -> dict[str, Any]:
    return solved(folder, STRIP.format(young=young, method=method))


def test_error_of_the_force_is_in_the_stated_one(tmp_path: Path) -> None:
    """The panels are practically rigid from 1e13 Pa on; for stiffer panels, the error of the force is less than the stated
    error."""
    exact = strip(tmp_path, 1e13)
    assert exact["energy_error"] < 1e-4
    assert not [line for line in exact["warnings"] if "known to" in line]
    stiff = strip(tmp_path, 3e15)
    assert abs(stiff["final_force"] / exact["final_force"] - 1.0) < 2.0 * stiff["energy_error"]
    assert 1e-3 < stiff["energy_error"] < 5e-2
    assert any("round-off is about" in line and "N/m" in line for line in stiff["warnings"])


@pytest.mark.parametrize(("young", "method"), [(2e17, "static"), (1e20, "static"), (2e17, "Radau")])
def test_forces_that_cannot_be_resolved_are_refused(tmp_path: Path, young: float, method: str) -> None:
    with pytest.raises(NotConverged, match=r"round-off exceeds 5 % of the forces: the largest stiffness, .* N/m"):
        strip(tmp_path, young, method)


def test_refusal_is_one_line_with_exit_code_3(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(STRIP.format(young=1e19, method="static"))
    ended = CliRunner().invoke(cli, ["run", str(tmp_path / "case.toml"), "--out", str(tmp_path / "out")])
    assert ended.exit_code == 3
    assert "round-off exceeds 5 % of the forces" in ended.output.splitlines()[-1]


@pytest.mark.parametrize("young", [0.5e9, 1e12])
@pytest.mark.parametrize("thickness", [2e-5, 3e-3])
def test_ordinary_strips_are_not_warned_of(tmp_path: Path, young: float, thickness: float) -> None:
    text = STRIP.format(young=young, method="static").replace("3e-4", f"{thickness:g}")
    creased = f"stiffness = {10 * young * 0.04 * thickness**3 / 12 / 0.08:g}"
    summary = solved(tmp_path, text.replace("stiffness = 0.01", creased))
    assert not [line for line in summary["warnings"] if "known to" in line]
    assert summary["energy_error"] < 1e-4


def test_a_linkage_at_rest_ends_well(tmp_path: Path) -> None:
    """The loop closes to the digits with which it is written, and the energy of the remaining gap is negligible."""
    summary = solved(tmp_path, LINKAGE.format(stiffness=1e7, spring=0.0, gap="1e-8"))
    assert summary["energy_error"] < 1e-3
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["warnings"] == []


PENDULUM = """
gravity = [0, 0, "-9.81 m/s^2"]
[[scene.bodies]]
name = "rod"
mass = "100 g"
inertia = [2e-6, "3.33e-4 kg m^2", "3.33e-4 kg m^2"]
position = ["100 mm", 0, 0]
[[scene.elements]]
name = "hinge"
inner = "ground"
outer = "rod"
point_outer = ["-100 mm", 0, 0]
translation = [{stiffness}, {stiffness}, {stiffness}]
translation_damping = [{damping}, {damping}, {damping}]
rotation = [10, 0, 10]
[solve]
end_time = "0.1 s"
"""


@pytest.mark.parametrize(("stiffness", "warned"), [(1e5, False), (1e9, False), (1e15, True)])
def test_stiff_hinges_of_a_falling_rod(tmp_path: Path, stiffness: float, warned: bool) -> None:
    """The same in a motion without a drive: 0.1 N m of weight, and 1e15 N/m at a lever of 0.1 m times 2.2e-16 rad."""
    summary = solved(tmp_path, PENDULUM.format(stiffness=stiffness, damping=1e-3 * stiffness))
    assert any("round-off is about 2" in line for line in summary["warnings"]) == warned
    assert (summary["energy_error"] > 1e-2) == warned


def test_a_falling_rod_on_a_hinge_beyond_all_digits_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NotConverged, match=r"round-off exceeds 5 % of the moments: the largest stiffness, 1e\+14 N m/rad"):
        solved(tmp_path, PENDULUM.format(stiffness=1e16, damping=1e13))
