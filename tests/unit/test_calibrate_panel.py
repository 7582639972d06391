"""Bending stiffness by inverse simulation, and relaxation of the rest angle."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from fsm.calibrate.bending import calibrate_bending, cantilever_curve, fit_rigidity
from fsm.calibrate.relaxation import calibrate_relaxation, fit_relaxation, relaxed_angle
from fsm.calibrate.report import Calibration, Options

# a = P L^2/EI: w/L, by elliptic functions; validation/references.md, agrees with Mattiasson (1981)
ELASTICA = {1.0: 0.3017207738, 2.0: 0.4934574804, 5.0: 0.7137915236, 10.0: 0.8106090249}
RIGIDITY, LENGTH = 2.7e-4, 0.08


@cache
def curve() -> CubicHermiteSpline:
    return cantilever_curve(0.83)


def value(found: Calibration, name: str) -> float:
    return next(quantity.value for quantity in found.quantities if quantity.name.startswith(name))


# bending -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("loads", [*([a] for a in ELASTICA), list(ELASTICA)], ids=str)
def test_large_deflections_give_the_rigidity_to_a_thousandth(loads: list[float]) -> None:
    """2026-11: 2.2e-5, 2.9e-5, 6.7e-5, 1.7e-4 at 30, 49, 71, 81 % of the length, 4.2e-5 of all four together."""
    force = np.array(loads) * RIGIDITY / LENGTH**2
    deflection = np.array([ELASTICA[a] for a in loads]) * LENGTH
    assert fit_rigidity(force, deflection, LENGTH, curve()) == pytest.approx(RIGIDITY, rel=3e-4)
    # the small-angle formula does not
    assert force[0] * LENGTH**3 / (3 * deflection[0]) > 1.1 * RIGIDITY


def test_the_curve_has_the_slopes_that_differences_have() -> None:
    load = np.linspace(0.05, 9.0, 40)
    step = 1e-4
    difference = (curve()(load + step) - curve()(load - step)) / (2 * step)
    np.testing.assert_allclose(curve()(load, 1), difference, rtol=1e-6)
    # slopes at the knots are exact, so the cubic between them is exact to fourth order
    fine = cantilever_curve(0.6)
    assert float(curve()(1.3)) == pytest.approx(float(fine(1.3)), rel=1e-9)


def bench(tmp_path: Path, seed: int = 0, noise: float = 2e-4, beside: str = "", rows: int = 25) -> Path:
    """A cantilever test to 60 % of its length, N and mm."""
    rng = np.random.default_rng(seed)
    force = np.linspace(0.001, 0.15, rows)
    deflection = LENGTH * curve()(force * LENGTH**2 / RIGIDITY) + noise * rng.normal(size=rows)
    file = tmp_path / f"bend{seed}.csv"
    lines = [f"{f:.6f}, {1e3 * w:.6f}" for f, w in zip(force, deflection, strict=True)]
    file.write_text("force [N], deflection [mm]\n" + "\n".join(lines) + "\n")
    values = beside or 'length = "80 mm", width = "40 mm", thickness = "0.3 mm"'
    file.with_suffix(".toml").write_text(f"values = {{ {values} }}\n")
    return file


def test_bending_report(tmp_path: Path) -> None:
    found = calibrate_bending(bench(tmp_path), Options())
    rigidity = found.quantities[0]
    assert rigidity.low is not None and rigidity.high is not None
    assert rigidity.low < RIGIDITY < rigidity.high
    assert rigidity.value == pytest.approx(RIGIDITY, rel=0.01)
    assert value(found, "K_theta") == pytest.approx(rigidity.value / (LENGTH / 20), rel=1e-12)
    assert value(found, "E = 12") == pytest.approx(12 * rigidity.value / (0.04 * 3e-4**3), rel=1e-12)
    assert value(found, "EI by the small-angle formula") == pytest.approx(RIGIDITY, rel=0.1)
    assert any("error of the small-angle formula at" in text for text in found.warnings)


def test_intervals_hold_the_rigidity_as_often_as_they_say(tmp_path: Path) -> None:
    """95 % intervals of 200 tests: between 90 and 99 % (binomial, three standard deviations)."""
    held = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        force = np.linspace(0.001, 0.15, 12)
        deflection = LENGTH * curve()(force * LENGTH**2 / RIGIDITY) + 2e-4 * rng.normal(size=12)
        file = tmp_path / "bend.csv"
        rows = "".join(f"{f}, {w}\n" for f, w in zip(force, deflection, strict=True))
        file.write_text("force [N], deflection [m]\n" + rows)
        (tmp_path / "bend.toml").write_text('values = { length = "80 mm" }\n')
        quantity = _fast(file)
        held += quantity[0] < RIGIDITY < quantity[1]
    assert 181 <= held <= 198


def _fast(file: Path) -> tuple[float, float]:
    """The interval of a test, with the curve computed once."""
    from unittest.mock import patch

    with patch("fsm.calibrate.bending.cantilever_curve", lambda *_: curve()):
        rigidity = calibrate_bending(file, Options()).quantities[0]
    assert rigidity.low is not None and rigidity.high is not None
    return rigidity.low, rigidity.high


def test_a_gauge_that_is_not_at_zero_is_told_of(tmp_path: Path) -> None:
    file = bench(tmp_path)
    lines = file.read_text().splitlines()
    moved = [f"{line.split(',')[0]}, {float(line.split(',')[1]) + 2.0}" for line in lines[1:]]
    file.write_text("\n".join([lines[0], *moved]) + "\n")
    assert any("mm at zero force; check the zero" in text for text in calibrate_bending(file, Options()).warnings)
    assert not any("no force" in text for text in calibrate_bending(bench(tmp_path, 1), Options()).warnings)


def test_both_directions_and_repeats(tmp_path: Path) -> None:
    """Panels of different stiffness: the interval is that of the differences between panels."""
    lines = ["force [N], deflection [mm], repeat"]
    for repeat, factor in enumerate((0.95, 1.0, 1.02, 1.05)):
        for force in (-0.1, -0.05, 0.05, 0.1):
            load = abs(force) * LENGTH**2 / (factor * RIGIDITY)
            lines.append(f"{force}, {math.copysign(1e3 * LENGTH * float(curve()(load)), force)}, {repeat}")
    file = tmp_path / "bend.csv"
    file.write_text("\n".join(lines) + "\n")
    file.with_suffix(".toml").write_text('values = { length = "80 mm" }\n')
    rigidity = calibrate_bending(file, Options()).quantities[0]
    assert rigidity.value == pytest.approx(1.005 * RIGIDITY, rel=0.01)
    assert rigidity.standard_error == pytest.approx(np.std([0.95, 1.0, 1.02, 1.05], ddof=1) / 2 * RIGIDITY, rel=0.2)


# relaxation ----------------------------------------------------------------------------------------------------------

LAW = np.array([2.4, -0.05, math.log(30.0)])


def test_exact_data_give_the_law_back() -> None:
    time = np.concatenate([[0.0], np.geomspace(1.0, 1e5, 40)])
    assert fit_relaxation(time, relaxed_angle(time, LAW), np.ones(41)) == pytest.approx(LAW, rel=1e-7)


def watch(tmp_path: Path, seed: int, low: float = 1.0, high: float = 1e5, creases: int = 1, spread: float = 0.0) -> Path:
    rng = np.random.default_rng(seed)
    time = np.geomspace(low, high, 40)
    lines = ["time [s], angle [deg]" + (", repeat" if creases > 1 else "")]
    for crease in range(creases):
        own = LAW * (1.0 + np.array([0.0, spread * rng.normal(), 0.0]))
        angle = np.degrees(relaxed_angle(time, own) + 1e-3 * rng.normal(size=40))
        end = f", {crease}" if creases > 1 else ""
        lines += [f"{t:.6g}, {a:.6f}{end}" for t, a in zip(time, angle, strict=True)]
    file = tmp_path / "relax.csv"
    file.write_text("\n".join(lines) + "\n")
    return file


def test_intervals_of_the_law_hold_it(tmp_path: Path) -> None:
    """All three, 95 %, in 100 tests each: between 88 and 100 % (binomial, three standard deviations)."""
    held = np.zeros(3)
    for seed in range(100):
        found = calibrate_relaxation(watch(tmp_path, seed), Options())
        for k, truth in enumerate((2.4, -0.05, 30.0)):
            quantity = found.quantities[k]
            assert quantity.low is not None and quantity.high is not None
            held[k] += quantity.low < truth < quantity.high
    assert np.all(held >= 88)


def test_what_the_times_cannot_tell_is_said(tmp_path: Path) -> None:
    late = calibrate_relaxation(watch(tmp_path, 0, low=1e4, high=1e6), Options()).warnings
    assert any("is much shorter than the first time" in text for text in late)
    early = calibrate_relaxation(watch(tmp_path, 0, low=0.01, high=5.0), Options()).warnings
    assert any("is longer than the test" in text for text in early) or any("explains" in text for text in early)
    assert not calibrate_relaxation(watch(tmp_path, 0), Options()).warnings


def test_several_creases_differ(tmp_path: Path) -> None:
    found = calibrate_relaxation(watch(tmp_path, 3, creases=6, spread=0.1), Options())
    slope = found.quantities[1]
    assert slope.standard_error == pytest.approx(0.1 * 0.05 / math.sqrt(6), rel=0.6)
    assert found.numbers["freedom"] == 5
