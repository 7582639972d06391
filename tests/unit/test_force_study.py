"""The study file of `fsm calibrate force`, its data, and the files that it writes."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fsm.calibrate.data import read_table
from fsm.calibrate.force import QUANTITIES, force_test, read_tests
from fsm.calibrate.identify import identify
from fsm.calibrate.response import force_response
from fsm.calibrate.study import MeasuredCurve, read_study, unit_of
from fsm.case.loading.load_case import load_case
from fsm.cli.command_line import cli
from fsm.errors import CaseError

CASES = Path(__file__).resolve().parents[2] / "folding_cases"
CASE = """
units = "mm-N-s"
[lattice]
columns = 2
rows = 2
spacing = 15
hinge_length = 2.25
angle = "20 deg"
axial = 40
shear = 1.5
rotational = 1.2
depth = 10
density = "1240 kg/m^3"
[[drive]]
edge = "top"
direction = [0.4, 0, 1]
speed = 0.1
travel = 0.4
[solve]
method = "static"
rtol = 1e-5
"""
STUDY = """
case = "case.toml"
starts = 1
[[curve]]
name = "pull"
data = "pull.csv"
zero = "10 mN"
[[parameter]]
path = "lattice.axial"
lower = 10
upper = "200 N/mm"
start = 60
[[parameter]]
path = "lattice.shear"
lower = 0.1
upper = 10
[[prior]]
above = "lattice.shear"
below = "lattice.axial"
lower = 0.00375
upper = 0.375
[predict]
name = "the same again"
points = 5
samples = 0
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    (tmp_path / "case.toml").write_text(CASE)
    (tmp_path / "study.toml").write_text(STUDY)
    travel = np.linspace(0.0, 0.4, 9)
    force = force_response(load_case(tmp_path / "case.toml").case, 1e-3 * travel).force
    rows = np.column_stack([travel, force, np.full(9, 0.005)])
    np.savetxt(tmp_path / "pull.csv", rows, delimiter=",", header="displacement [mm],force [N],half_band [N]", comments="")
    return tmp_path / "study.toml"


def run(study: Path, *options: str) -> tuple[int, str, Path]:
    out = study.parent / "out"
    result = CliRunner().invoke(cli, ["calibrate", "force", str(study), "--out", str(out), *options])
    return result.exit_code, result.output, out


def test_numbers_plots_and_prediction_are_written(study: Path) -> None:
    code, text, out = run(study, "--quiet")
    assert code == 0, text
    assert {path.name for path in out.iterdir()} == {"calibration.json", "fit.png", "prediction.csv", "prediction.png"}
    found = json.loads((out / "calibration.json").read_text())
    by_name = {quantity["name"]: quantity for quantity in found["quantities"]}
    assert by_name["lattice.axial"]["value"] == pytest.approx(4e4, rel=1e-3)
    assert by_name["lattice.shear"]["value"] == pytest.approx(1500.0, rel=1e-3)
    assert by_name["lattice.axial"]["low"] < 4e4 < by_name["lattice.axial"]["high"]
    assert by_name["zero of pull"]["unit"] == "N"
    assert np.shape(found["correlation"]) == (3, 3)
    curve = found["curves"]["pull"]
    np.testing.assert_allclose(curve["fit_N"], curve["measured_N"], atol=1e-4)
    table = np.genfromtxt(out / "prediction.csv", delimiter=",", names=True)
    assert table.dtype.names == ("displacement_mm", "force_N", "low_N", "high_N")
    assert np.all(table["low_N"][1:] < table["force_N"][1:]) and np.all(table["force_N"][1:] < table["high_N"][1:])


def test_units_of_the_case_hold_in_the_study(study: Path) -> None:
    tests, parameters, priors = read_tests(read_study(study), study)
    assert [(one.lower, one.upper, one.start) for one in parameters] == [(1e4, 2e5, 6e4), (100.0, 1e4, 1500.0)]
    assert priors[0].median == pytest.approx(0.0375)
    assert priors[0].deviation == pytest.approx(np.log(100.0) / np.sqrt(12.0))
    assert tests[0].deviation[0] == pytest.approx(0.005 / 1.959964) and tests[0].known


def test_a_prior_of_one_parameter_has_its_units(study: Path) -> None:
    ratio, alone = 'below = "lattice.axial"\nlower = 0.00375\nupper = 0.375', 'lower = 1\nupper = "4 N/mm"'
    study.write_text(study.read_text().replace(ratio, alone))
    tests, parameters, priors = read_tests(read_study(study), study)
    assert (priors[0].below, priors[0].median) == (None, pytest.approx(2000.0))
    sharp = identify(tests, parameters, [replace(priors[0], deviation=1e-4)])
    assert sharp.estimate.values[1] == pytest.approx(2000.0, rel=1e-3)


def test_the_error_of_a_test_predicted_from_another_widens_the_band(study: Path) -> None:
    """The second test is made 1.2 times as stiff, so each is predicted from the other with an error of 20 or 17 %."""
    rows = np.loadtxt(study.parent / "pull.csv", delimiter=",", skiprows=1)
    heading = "displacement [mm],force [N],half_band [N]"
    np.savetxt(study.parent / "other.csv", rows * [1.0, 1.2, 1.0], delimiter=",", header=heading, comments="")
    text = study.read_text().replace("[[parameter]]", '[[curve]]\nname = "other"\ndata = "other.csv"\n[[parameter]]', 1)
    text = text.replace('zero = "10 mN"\n', "").split("[[prior]]")[0]
    text += '[predict]\nname = "again"\npoints = 5\nsamples = 0\n'
    bands = []
    for key in ("", "leave_out = true\n"):
        study.write_text(text + key)
        code, told, out = run(study, "--quiet")
        assert code == 0, told
        table = np.genfromtxt(out / "prediction.csv", delimiter=",", names=True)
        bands.append((table["high_N"] - table["force_N"])[-1] / table["force_N"][-1])
    left_out = json.loads((out / "calibration.json").read_text())["prediction"]["left_out"]
    assert left_out == {"pull": pytest.approx(0.2, abs=0.003), "other": pytest.approx(1.0 - 1.0 / 1.2, abs=0.003)}
    transfer = 1.96 * np.sqrt((0.2**2 + (1.0 - 1.0 / 1.2) ** 2) / 2.0)
    assert bands[1] == pytest.approx(np.hypot(bands[0], transfer), rel=0.02)


def test_units_are_those_of_the_variant_that_the_case_has() -> None:
    """Where a section has variants, and where a unit depends on an exponent beside it."""
    changes = ["contact.exponent=2", "contact.stiffness=1e12", 'crease={law="linear",stiffness=0.009}']
    case = load_case(CASES / "strip_pull" / "case.toml", changes).case
    units = {
        "crease.stiffness": "N m/rad",
        "crease.rest_angle": "rad",
        "contact.stiffness": "N/m^2",
        "friction.mu_static": "",
        "friction.v_static": "m/s",
        "drive.0.travel": "m",
        "material.young": "Pa",
        "drive.0.direction.1": "",
        "nowhere.at.all": "",
    }
    assert {path: unit_of(case, path) for path in units} == units


def test_what_the_data_know_nothing_of_is_told(study: Path) -> None:
    """Inertia has no influence in statics: the density is known only to its given interval."""
    study.write_text(study.read_text().replace('path = "lattice.shear"', 'path = "lattice.density"').split("[[prior]]")[0])
    text = study.read_text().replace("lower = 0.1\nupper = 10", 'lower = "100 kg/m^3"\nupper = "9000 kg/m^3"')
    study.write_text(text)
    code, told, out = run(study)
    assert code == 0, told
    assert "lattice.density is poorly identifiable" in told
    (row,) = [line for line in told.splitlines() if line.startswith("lattice.density")]
    assert row.split()[2] == "kg/m^3" and row.endswith("0 to inf")
    found = {one["name"]: one for one in json.loads((out / "calibration.json").read_text())["quantities"]}
    assert (found["lattice.density"]["low"], found["lattice.density"]["high"]) == (0.0, None)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("starts = 1", "start = 1", "start: unknown key; did you mean `starts`?"),
        ("zero =", "zeros =", "curve.0.zeros: unknown key; did you mean `zero`?"),
        ('name = "pull"', "", "curve.0.name: missing; this key is required"),
        ("lower = 10\n", 'lower = "10 N"\n', 'parameter.0.lower: "10 N" has the wrong unit'),
        ("lower = 10\n", "lower = 500\n", "parameter.0: lower = 500.0 is not below"),
        ('"lattice.axial"', '"lattice.axil"', "no number there"),
        ('"lattice.axial"', '"lattice.rows"', "whole number"),
        ('above = "lattice.shear"', 'above = "lattice.angle"', "'lattice.angle', which is not the path of a [[parameter]]"),
        ("upper = 0.375", "upper = 1e-4", "prior.0: lower = 0.00375 is not below upper = 0.0001"),
        ("upper = 0.375", 'upper = "1 N"', "bounds a ratio; give a number"),
        ("points = 5\n", "leave_out = true\n", "predicts every test from the others; add a [[curve]]"),
        ('data = "pull.csv"', 'data = "push.csv"', "push.csv"),
        ('case = "case.toml"', 'case = "cast.toml"', "cast.toml"),
        ("points = 5\n", 'set = { "lattice.axial" = 20 }\n', "predict.set: must be a list, [a, b, ...]"),
        ("[[prior]]", "[prior]", "prior: must be a list of sections; write its name in two brackets"),
    ],
)
def test_faults_name_the_place_and_write_nothing(study: Path, old: str, new: str, said: str) -> None:
    text = study.read_text()
    assert old in text
    study.write_text(text.replace(old, new))
    code, told, out = run(study, "--quiet")
    assert code == 2, told
    assert said in told
    assert not out.exists()


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("displacement [mm],force [N]\n0.1,1\n", "has 1 row; a curve needs at least 2"),
        ("displacement [mm],force [N]\n0.1,1\n0.1,2\n", "row 3: the displacement does not increase"),
        ("displacement [mm],force [N]\n0.1,1\n0.3,2\n0.2,3\n", "row 4: the displacement does not increase"),
        ("displacement [mm],force [N],half_band [N]\n0.1,1,0.1\n0.2,2,0\n", "row 3: half_band is 0 N"),
        ("displacement [mm],force [N],repeat\n0.1,1,1\n0.2,2,1\n", "`repeat` has a single number"),
        ("displacement [mm],force [N],repeat\n0.1,1,1\n0.2,2,1\n0.1,1,2\n0.3,2,2\n", "have different displacements"),
        ("displacement [mm],force [N],repeat\n0.1,1,1\n0.2,2,1\n0.1,1,2\n0.2,2,2\n", "do not differ"),
        ("displacement [mm],force [N]\n0.1,1\n0.9,2\n", "the drive ends at 0.4 mm"),
        ("displacement [mm],force [N]\n0.1,1\n0.2,nan\n", "row 3"),
        ("displacement [mm],force [mm]\n0.1,1\n0.2,1\n", "force"),
        ("displacement [mm],force [N]\n" + "".join(f"{1e-4 * k},1\n" for k in range(3000)), "at most 2000 are"),
    ],
)
def test_bad_data_are_refused_and_nothing_is_written(study: Path, rows: str, said: str) -> None:
    (study.parent / "pull.csv").write_text(rows)
    code, told, out = run(study, "--quiet")
    assert code == 2, told
    assert said in told
    assert not out.exists()


def test_weights_follow_the_scatter_of_repeats(study: Path, tmp_path: Path) -> None:
    generator = np.random.default_rng(4)
    travel, force = np.linspace(0.05, 0.4, 30), np.linspace(0.1, 2.0, 30)
    rows = [
        f"{x:.6f},{y * (1 + 0.02 * generator.normal()) + 0.005 * generator.normal():.6f},{k}"
        for k in range(1, 41) for x, y in zip(travel, force, strict=True)
    ]  # fmt: skip
    (tmp_path / "many.csv").write_text("displacement [mm],force [N],repeat\n" + "\n".join(rows))
    table = read_table(tmp_path / "many.csv", QUANTITIES, ("displacement", "force"))
    test = force_test(MeasuredCurve(name="many", data=Path("many.csv")), load_case(tmp_path / "case.toml").case, table)
    wanted = np.sqrt((0.005**2 + (0.02 * force) ** 2) / 40)
    # the constant part is known from the few points where it counts, to some 10 % at one standard deviation
    np.testing.assert_allclose(test.deviation, wanted, rtol=0.3)
    np.testing.assert_allclose(test.force, force, atol=5.0 * wanted.max())
    assert len(test.travel) == 30


def test_flexible_parts_are_refused_not_left_out(tmp_path: Path) -> None:
    case = tmp_path / "tube.toml"
    case.write_text(
        """
[sheet]
kind = "kresling"
sides = 6
rows = 1
radius = "30 mm"
height = "40 mm"
twist = "30 deg"
facets = "bars"
thickness = "1 mm"
[[sheet.support]]
at = "edge bottom"
[material]
young = "50 MPa"
density = 1200
[crease]
stiffness_per_length = 0.5
[[drive]]
edge = "top"
direction = [0, 0, -1]
guide = false
speed = "1 mm/s"
travel = "2 mm"
[solve]
method = "static"
end_time = "2 s"
""",
        encoding="utf-8",
    )
    with pytest.raises(CaseError, match=r"sheet\.facets: has films, cables, beams or bars"):
        force_response(load_case(case).case, np.array([0.0, 1e-3]))
