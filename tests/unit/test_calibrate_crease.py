"""Crease families: fits and their intervals, loops, and the file that a case names."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from fsm.calibrate.crease import calibrate_crease
from fsm.calibrate.report import Options
from fsm.calibrate.smoothing import bin_points, fit_curve
from fsm.case.loading.crease_family import CreaseFamily, FamilyCurve, family_curve, read_family, write_family
from fsm.case.loading.load_case import load_case
from fsm.case.models.materials import SplineCrease
from fsm.cli.command_line import cli
from fsm.errors import CaseError

DEG = math.pi / 180
ANGLE = np.linspace(0.0, 90.0, 31)
CASE = """
[strip]
length = 0.48
width = 0.04
thickness = 3e-4
panels = 6
fold_angle = "80 deg"

[material]
young = 3e9
density = 800

[[drive]]
crease = 3
speed = 0.01
travel = 0.01

[crease]
file = "crease.h5"
"""


def stiffness(press_time: float, opening: int) -> float:
    """Moments of the synthetic family, N mm."""
    return (2.0 + 0.5 * math.log10(press_time / 600.0)) * (1.15 if opening == 1 else 1.0)


def branches(press_time: float, opening: int) -> tuple[np.ndarray, np.ndarray]:
    """Loading and unloading at ANGLE, N mm; the loop has 0.2 x 4/5 x pi/2 mJ."""
    loading = stiffness(press_time, opening) * np.sin(ANGLE * DEG)
    return loading, loading - 0.2 * (1.0 - (ANGLE / 90.0) ** 4)


LOOP = 0.2 * 0.8 * math.pi / 2 * 1e-3


def write_tests(file: Path, repeats: int = 3, noise: float = 0.01, scatter: float = 0.02, seed: int = 0) -> None:
    """Tests of all curves of the family, with repeats that differ by a factor and rows that differ by noise."""
    rng = np.random.default_rng(seed)
    lines = ["angle [deg], moment [N mm], press_time [min], opening, repeat"]
    for press_time in (600.0, 3600.0):
        for opening in (1, 2):
            loading, unloading = branches(press_time, opening)
            for repeat in range(1, repeats + 1):
                factor = 1.0 + scatter * rng.normal()
                angle = np.concatenate([ANGLE, ANGLE[-2::-1]])
                moment = np.concatenate([factor * loading, (factor * loading - loading + unloading)[-2::-1]])
                moment = moment + noise * rng.normal(size=len(moment))
                end = f"{press_time / 60:g}, {opening}, {repeat}"
                lines += [f"{a:.4f}, {m:.5f}, {end}" for a, m in zip(angle, moment, strict=True)]
    file.write_text("\n".join(lines) + "\n")


def run(*arguments: str) -> Result:
    return CliRunner().invoke(cli, ["calibrate", *arguments])


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a calibrated family, the case that names it, and calibration.json."""
    folder = tmp_path_factory.mktemp("family")
    write_tests(folder / "tests.csv")
    result = run("crease", str(folder / "tests.csv"), "--out", str(folder / "out"))
    assert result.exit_code == 0, result.output
    (folder / "out" / "case.toml").write_text(CASE)
    return folder / "out"


@pytest.fixture
def family(calibrated: Path, tmp_path: Path) -> Path:
    """The same folder, for tests that change it."""
    return Path(shutil.copytree(calibrated, tmp_path / "out"))


# curves --------------------------------------------------------------------------------------------------------------


def test_smoothing_finds_the_curve_and_its_scatter() -> None:
    """Cross-validation: the estimated scatter is the given scatter, and bands contain the curve about as often as stated."""
    rng = np.random.default_rng(1)
    x = np.linspace(0.0, 1.0, 60)
    scatters, inside = [], []
    for _ in range(60):
        fit = fit_curve(x, np.sin(3 * x) + 0.02 * rng.normal(size=60), "smooth")
        scatters.append(fit.scatter)
        inside.append(np.mean(np.abs(fit.y - np.sin(3 * fit.x)) < 2.0 * fit.error))
    assert np.mean(scatters) == pytest.approx(0.02, rel=0.05)
    assert 0.85 < np.mean(inside) < 0.99  # 0.91 over 200 curves: cross-validation does not know lambda more accurately


def test_interpolation_goes_through_all_points_and_smoothing_does_not() -> None:
    x = np.linspace(0.0, 1.0, 20)
    y = np.sin(3 * x) + 0.05 * np.random.default_rng(0).normal(size=20)
    assert fit_curve(x, y, "interpolate").y == pytest.approx(y)
    assert np.abs(fit_curve(x, y, "smooth", grid=x).y - y).max() > 0.01


def test_a_monotone_curve_never_turns() -> None:
    rng = np.random.default_rng(2)
    x = np.linspace(0.0, 1.0, 80)
    y = np.minimum(x, 0.5) + 0.05 * np.sin(25 * x) + 0.005 * rng.normal(size=80)
    assert np.diff(fit_curve(x, y, "smooth").y).min() < 0.0
    assert np.diff(fit_curve(x, y, "monotone").y).min() >= 0.0
    assert np.diff(fit_curve(x, -y, "monotone").y).max() <= 0.0


def test_points_of_one_abscissa_are_gathered() -> None:
    x, y, count = bin_points(np.array([1.0, 0.0, 1.0, 2.0]), np.array([2.0, 0.0, 4.0, 5.0]), None)
    np.testing.assert_array_equal([x, y, count], [[0, 1, 2], [0, 3, 5], [1, 2, 1]])
    x, y, count = bin_points(np.repeat(np.arange(1000.0), 3), np.zeros(3000), 200)
    assert len(x) <= 202
    assert (x[0], x[-1]) == (0.0, 999.0)  # the curve reaches the ends of the data
    assert count.sum() == 3000
    assert np.all(np.diff(x) > 0)


# families ------------------------------------------------------------------------------------------------------------


def test_a_family_with_its_loops(family: Path) -> None:
    told = json.loads((family / "calibration.json").read_text())
    assert [curve["name"] for curve in told["curves"]] == [
        f"pressed {time}, opening {opening}" for time in ("10 min", "1 h") for opening in (1, 2)
    ]
    areas = [q for q in told["quantities"] if q["name"].endswith("loop area")]
    assert len(areas) == 4
    for area in areas:
        assert area["value"] == pytest.approx(LOOP, rel=0.05)
        assert area["low"] < area["value"] < area["high"]
    factors = [q for q in told["quantities"] if q["name"].endswith("crease.scale")]
    assert [factor["value"] for factor in factors] == pytest.approx([1.0] * 4)
    # 2 % between samples, three of each
    assert np.mean([factor["standard_error"] ** 2 for factor in factors]) ** 0.5 == pytest.approx(0.02 / 3**0.5, rel=0.6)
    for curve, (press_time, opening) in zip(told["curves"], [(600, 1), (600, 2), (3600, 1), (3600, 2)], strict=True):
        loading = stiffness(press_time, opening) * 1e-3 * np.sin(np.array(curve["angle_rad"]))
        assert curve["loading"]["moment_Nm"] == pytest.approx(loading, rel=0.04, abs=3e-5)
        assert curve["tests"] == 3
    assert {path.name for path in family.iterdir()} == {
        "calibration.json", "crease.h5", "curves.png", "loops.png", "residuals.png", "case.toml",
    }  # fmt: skip


def test_a_case_names_a_curve_of_the_family(family: Path) -> None:
    loaded = load_case(family / "case.toml", ["crease.press_time=1 h", "crease.opening=2", "crease.scale=1.5"])
    crease = loaded.case.crease
    assert isinstance(crease, SplineCrease)
    assert crease.angle is not None and crease.moment is not None
    measured = stiffness(3600, 2) * 1e-3 * math.sin(45 * DEG)
    assert np.interp(45 * DEG, crease.angle, crease.moment) == pytest.approx(measured, rel=0.05)
    assert crease.scale == 1.5
    assert crease.unloading is None
    # the copy that a result keeps needs no other file
    (family / "crease.h5").unlink()
    (family / "copy.toml").write_text(loaded.text)
    assert load_case(family / "copy.toml").case == loaded.case


def test_between_measured_curves(family: Path) -> None:
    """The moment is linear in log t and in the number of the opening, at every angle."""
    source = read_family(family / "crease.h5")
    between = family_curve(source, math.sqrt(600.0 * 3600.0), 1.5)
    corners = [family_curve(source, t, n) for t in (600.0, 3600.0) for n in (1.0, 2.0)]
    at = between.angle[50]
    assert between.loading[50] == pytest.approx(np.mean([np.interp(at, c.angle, c.loading) for c in corners]), rel=1e-9)
    assert between.unloading is not None
    error = between.loading_error[50]
    assert 0.0 < error < max(np.interp(at, c.angle, c.loading_error) for c in corners)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("crease.press_time=none", "crease.press_time: missing; the measured values are 10 min, 1 h"),
        ("crease.press_time=2 h", "crease.press_time: must be between 10 min and 1 h, as measured; it is 2 h"),
        ("crease.opening=3", "crease.opening: must be between 1 and 2, as measured; it is 3"),
        ("crease.opening=0.5", "crease.opening: must be at least 1"),
        ("crease.file=no.h5", "crease.file: cannot read .*no.h5: no such file; create the file by `fsm calibrate crease`"),
        ("crease.file=case.toml", "crease.file: .*case.toml is not a crease family"),
        ("crease.reversal=1 deg", "`reversal` is used with `hysteresis = true` only"),
        ("crease.presstime=1 h", "did you mean `crease.press_time`"),
    ],
)
def test_what_cannot_be_had(family: Path, override: str, message: str) -> None:
    with pytest.raises(CaseError, match=message):
        load_case(family / "case.toml", ["crease.press_time=10 min", "crease.opening=1", override])


def test_hysteresis_of_a_family(family: Path) -> None:
    chosen = ["crease.press_time=10 min", "crease.opening=1", "crease.hysteresis=true"]
    crease = load_case(family / "case.toml", chosen).case.crease
    assert isinstance(crease, SplineCrease)
    assert crease.unloading is not None and crease.moment is not None and crease.angle is not None
    gap = np.array(crease.moment) - np.array(crease.unloading)
    assert gap.min() >= 0.0
    assert np.trapezoid(gap, crease.angle) == pytest.approx(LOOP, rel=0.06)


def test_a_family_without_unloading_has_no_hysteresis(tmp_path: Path) -> None:
    curve = FamilyCurve(ANGLE * DEG, 1e-3 * np.sin(ANGLE * DEG), np.zeros(31))
    write_family(CreaseFamily((curve,), "pchip"), tmp_path / "crease.h5")
    (tmp_path / "case.toml").write_text(CASE)
    crease = load_case(tmp_path / "case.toml").case.crease
    assert isinstance(crease, SplineCrease)
    assert crease.interpolation == "pchip"
    with pytest.raises(CaseError, match=r"crease.hysteresis: is true, but curve of crease.h5 has no unloading branch"):
        load_case(tmp_path / "case.toml", ["crease.hysteresis=true"])
    with pytest.raises(CaseError, match=r"crease.opening: is 2, but the tests in the file do not state it"):
        load_case(tmp_path / "case.toml", ["crease.opening=2"])


def test_force_and_lever_arm(tmp_path: Path) -> None:
    """M = F L; a file beside the data gives the arm."""
    moment = 2e-3 * np.sin(ANGLE * DEG)
    rows = "".join(f"{a:.3f}; {m / 0.035:.6f}\n" for a, m in zip(ANGLE, moment, strict=True))
    (tmp_path / "force.csv").write_text("angle [deg]; force [N]\n" + rows)
    (tmp_path / "force.toml").write_text('values = { lever_arm = "35 mm", width = "40 mm" }\n')
    found = calibrate_crease(tmp_path / "force.csv", Options())
    found.files[0][1](tmp_path / "crease.h5")
    family = read_family(tmp_path / "crease.h5")
    assert family.width == pytest.approx(0.04)
    curve = family.curves[0]
    # smoothing splines are straight at their ends: the error is 2.5e-7 near 90 degrees, where the sine is curved most
    assert curve.loading == pytest.approx(2e-3 * np.sin(curve.angle), abs=5e-7)


def test_outliers_are_told_of_and_left_out_on_demand(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    moment = 2.0 * np.sin(ANGLE * DEG) + 0.005 * rng.normal(size=31)
    moment[12] += 1.0
    file = tmp_path / "test.csv"
    file.write_text("angle [deg], moment [N mm]\n" + "".join(f"{a}, {m}\n" for a, m in zip(ANGLE, moment, strict=True)))
    kept = calibrate_crease(file, Options())
    assert any("row 14: outlier" in text and "used; --without-flagged excludes it" in text for text in kept.warnings)
    left = calibrate_crease(file, Options(without_flagged=True))
    assert any("row 14: outlier" in text and "(excluded)" in text for text in left.warnings)
    off = [c.numbers["curves"][0]["loading"]["scatter_Nm"] for c in (kept, left)]
    assert off[1] < 0.1 * off[0]


def test_a_folder_of_files_is_one_family(tmp_path: Path) -> None:
    for opening in (1, 2):
        for repeat in range(3):
            loading, _ = branches(600.0, opening)
            rows = "".join(f"{a}, {m * (1 + 0.01 * repeat)}\n" for a, m in zip(ANGLE, loading, strict=True))
            file = tmp_path / f"opening{opening}-{repeat}.csv"
            file.write_text("angle [deg], moment [N mm]\n" + rows)
            file.with_suffix(".toml").write_text(f"values = {{ opening = {opening} }}\n")
    found = calibrate_crease(tmp_path, Options())
    assert [(curve["opening"], curve["tests"]) for curve in found.numbers["curves"]] == [(1.0, 3), (2.0, 3)]
    (tmp_path / "opening1-0.toml").unlink()
    with pytest.raises(CaseError, match=r"opening1-0.csv: has no column `opening`, but other files have it"):
        calibrate_crease(tmp_path, Options())


def test_the_same_seed_gives_the_same_numbers(tmp_path: Path) -> None:
    write_tests(tmp_path / "tests.csv")
    first, second, other = (calibrate_crease(tmp_path / "tests.csv", Options(seed=seed)) for seed in (1, 1, 2))
    assert first.quantities == second.quantities
    assert first.quantities != other.quantities


def test_scatter_may_put_unloading_above_loading_a_little(tmp_path: Path) -> None:
    write_tests(tmp_path / "tests.csv", repeats=1, noise=0.02)
    found = calibrate_crease(tmp_path / "tests.csv", Options())
    found.files[0][1](tmp_path / "crease.h5")
    for curve in read_family(tmp_path / "crease.h5").curves:
        assert curve.unloading is not None
        assert np.all(curve.unloading <= curve.loading)
    assert not any("unloading lies above" in text for text in found.warnings)


def test_relaxation_is_kept_with_the_curves(tmp_path: Path) -> None:
    """A folder with a file of angle against time; a case gives the time since the release of the crease."""
    data = tmp_path / "data"
    data.mkdir()
    loading, _ = branches(600.0, 2)
    rows = "".join(f"{a}, {m}\n" for a, m in zip(ANGLE, loading, strict=True))
    (data / "curve.csv").write_text("angle [deg], moment [N mm]\n" + rows)
    times = np.geomspace(1.0, 1e5, 30)
    creep = "".join(f"{t:.8g}, {140.0 - 3.0 * math.log1p(t / 20.0):.10g}\n" for t in times)
    (data / "creep.csv").write_text("time [s], angle [deg]\n" + creep)
    result = run("crease", str(data), "--out", str(tmp_path / "out"))
    assert result.exit_code == 0, result.output
    assert "theta_r0" in result.output
    assert (tmp_path / "out" / "relaxation.png").exists()
    (tmp_path / "out" / "case.toml").write_text(CASE)
    crease = load_case(tmp_path / "out" / "case.toml", ["crease.since_release=1 h"]).case.crease
    assert isinstance(crease, SplineCrease)
    assert crease.rest_angle == pytest.approx((140.0 - 3.0 * math.log1p(180.0)) * DEG, rel=1e-6)
    with pytest.raises(CaseError, match=r"crease.since_release: must be at most 1.157 day, the longest measured time"):
        load_case(tmp_path / "out" / "case.toml", ["crease.since_release=2 day"])
    with pytest.raises(CaseError, match="give `since_release` or `rest_angle`, not both"):
        load_case(tmp_path / "out" / "case.toml", ["crease.since_release=1 h", "crease.rest_angle=2"])
    (data / "curve.csv").rename(tmp_path / "curve.csv")
    with pytest.raises(CaseError, match=r"data: holds angles against time only; a family needs moments"):
        calibrate_crease(data, Options())
    calibrate_crease(tmp_path / "curve.csv", Options()).files[0][1](tmp_path / "out" / "crease.h5")
    with pytest.raises(CaseError, match=r"crease.since_release: is 1 h, but the file has no relaxation"):
        load_case(tmp_path / "out" / "case.toml", ["crease.since_release=1 h"])


def test_signs_and_branches_that_cannot_be_are_told_of(tmp_path: Path) -> None:
    file = tmp_path / "test.csv"
    loading, unloading = branches(600.0, 2)
    both = zip([*ANGLE, *ANGLE[-2::-1]], [*unloading, *loading[-2::-1]], strict=True)
    file.write_text("angle [deg], moment [N mm]\n" + "".join(f"{a}, {m}\n" for a, m in both))
    (text,) = calibrate_crease(file, Options()).warnings
    assert "unloading lies above loading" in text and "the branches look exchanged" in text
    file.write_text("angle [deg], moment [N mm]\n" + "".join(f"{a}, {-m}\n" for a, m in zip(ANGLE, loading, strict=True)))
    (text,) = calibrate_crease(file, Options()).warnings
    assert "the moment falls as the angle grows" in text


@pytest.mark.nightly
def test_intervals_hold_the_family_as_often_as_they_say(tmp_path: Path) -> None:
    """Known family, 2 % between 5 repeats: 200 curves (2026-11: 94.5, 95.0 and 96.0 %)."""
    grid = np.linspace(0.0, 90.0 * DEG, 201)
    held = np.zeros(3)
    for seed in range(50):
        write_tests(tmp_path / "tests.csv", repeats=5, seed=seed)
        quantities = iter(calibrate_crease(tmp_path / "tests.csv", Options()).quantities)
        for press_time in (600.0, 3600.0):
            for opening in (1, 2):
                moment = stiffness(press_time, opening) * 1e-3 * np.sin(grid)
                truth = np.polyfit(grid, moment, 1)[0], moment[-1], None, LOOP
                found = [next(quantities) for _ in truth]
                k = 0
                for true, quantity in zip(truth, found, strict=True):
                    assert quantity.low is not None and quantity.high is not None
                    if true is not None:
                        held[k] += quantity.low < true < quantity.high
                        k += 1
    assert np.all((held >= 186) & (held <= 194))
