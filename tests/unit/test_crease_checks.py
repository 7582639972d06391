"""Measured crease curves with scatter, or too steep for the half segment: `fsm check` refuses them, and its advice works."""

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from fsm.case.loading.load_case import load_case
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from fsm.model.compile.compile_case import compile_case

CASE = """
[strip]
length = "600 mm"
width = "55 mm"
thickness = "0.125 mm"
panels = 5
fold_angle = "72 deg"
segments_per_panel = 4
[material]
young = "2.5 GPa"
density = "1420 kg/m^3"
[crease]
law = "spline"
data = "bench.csv"
[[drive]]
crease = 2
speed = "2 mm/s"
travel = "60 mm"
"""
SNAPPING = "angle (deg), moment (N mm)\n0, 0\n20, 6\n40, 8\n60, {low}\n80, 6\n100, 12\n"


def bench(folder: Path, seed: int, scatter: float, rows: int = 46) -> Path:
    """A smooth curve up to 16 N mm with scatter, as a file beside a case."""
    dice = np.random.default_rng(seed)
    angle = np.linspace(0.2, 90.0, rows)
    moment = 16.0 * (1.0 - np.exp(-angle / 40.0)) + 2e-4 * angle**2 + dice.normal(0.0, 16.0 * scatter, rows)
    lines = [f"{a:.3f},{m:.4f}" for a, m in zip(angle, moment, strict=True)]
    (folder / "bench.csv").write_text("angle (deg),moment (N mm)\n" + "\n".join(lines) + "\n")
    return write(folder)


def write(folder: Path) -> Path:
    case = folder / "case.toml"
    case.write_text(CASE)
    return case


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(cli, [str(argument) for argument in arguments])


@pytest.mark.parametrize("seed", range(6))
def test_check_refuses_scatter_and_its_advice_works(seed: int, tmp_path: Path) -> None:
    scatter = (0.005, 0.01, 0.02, 0.03, 0.05, 0.02)[seed]
    case = bench(tmp_path, seed, scatter, rows=300 if seed == 5 else 46)
    refused = invoke("check", case, "--set", "strip.segments_per_panel=2")
    assert refused.exit_code == 2, refused.output
    assert re.search(r"crease: at an opening of .* scatter of the data: smooth it by `fsm calibrate crease", refused.stderr)
    calibrated = invoke("calibrate", "crease", tmp_path / "bench.csv", "--out", tmp_path / "DIR", "--quiet")
    assert calibrated.exit_code == 0, calibrated.output
    checked = invoke("check", case, "--set", 'crease={ file = "DIR/crease.h5" }')
    assert checked.exit_code == 0, checked.output
    assert "warning" not in checked.output


def test_a_run_refuses_what_check_refuses_and_warns_without_the_half_cell(tmp_path: Path) -> None:
    case = bench(tmp_path, 2, 0.02)
    with pytest.raises(CaseError, match="scatter of the data"):
        compile_case(load_case(case, ["strip.segments_per_panel=2"]).case)
    rigid = ["strip.half_cell=false"]
    warnings: list[str] = []
    compile_case(load_case(case, rigid).case, warnings=warnings)
    assert len(warnings) == 1 and re.match(r"crease: the moment changes \d+ times between rising and falling", warnings[0])
    assert warnings[0] in invoke("check", case, "--set", rigid[0]).stdout


def test_a_crease_that_snaps_is_no_scatter_and_shorter_segments_help(tmp_path: Path) -> None:
    (tmp_path / "bench.csv").write_text(SNAPPING.format(low=3))
    case = write(tmp_path)
    refused = invoke("check", case, "--set", "strip.segments_per_panel=1")
    assert refused.exit_code == 2 and "scatter" not in refused.stderr, refused.output
    found = re.search(r"use segments (\d+) times shorter", refused.stderr)
    assert found is not None
    checked = invoke("check", case, "--set", f"strip.segments_per_panel={found[1]}")
    assert checked.exit_code == 0 and "warning" not in checked.stdout, checked.output


def test_a_spline_that_overshoots_monotone_data_is_told(tmp_path: Path) -> None:
    (tmp_path / "bench.csv").write_text("angle (deg), moment (N mm)\n0, 0\n10, 0.1\n20, 0.2\n21, 8\n60, 8.1\n100, 8.2\n")
    case = write(tmp_path)
    soft = ["--set", "strip.half_cell=false"]
    assert 'write interpolation = "pchip"' in invoke("check", case, *soft).stdout
    assert "warning" not in invoke("check", case, *soft, "--set", "crease.interpolation=pchip").stdout


def test_a_rest_angle_must_put_data_where_creases_are(tmp_path: Path) -> None:
    case = bench(tmp_path, 0, 0.0)
    assert invoke("check", case, "--set", "crease.rest_angle=200 deg").exit_code == 0
    refused = invoke("check", case, "--set", "crease.rest_angle=300 deg")
    assert refused.exit_code == 2
    assert "crease.rest_angle: 300 deg places the data at crease angles of 210 to 299.8 deg" in refused.stderr
