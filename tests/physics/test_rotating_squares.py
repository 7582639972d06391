"""Rotating squares: forces against another program, the study's sections, and the prediction that is kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fsm.calibrate.force import read_tests
from fsm.calibrate.identify import identify
from fsm.calibrate.parameters import with_values
from fsm.calibrate.response import force_response
from fsm.calibrate.study import read_study
from fsm.case.loading.load_case import load_case
from validation.rotating_squares.check import REFERENCE
from validation.rotating_squares.check import SOURCE as STIFFNESS

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "folding_cases" / "rotating_squares"

@pytest.mark.parametrize("name", REFERENCE)
def test_forces_are_those_of_another_program(name: str) -> None:
    direction, travel, force = REFERENCE[name]
    changes = [f"drive.0.direction={list(direction)}", f"drive.0.travel={travel[-1]}"]
    case = with_values(load_case(FOLDER / "case.toml", changes).case, STIFFNESS)
    np.testing.assert_allclose(force_response(case, 1e-3 * np.array(travel)).force, force, rtol=1e-7)


def test_shear_to_either_side_is_the_same() -> None:
    ends = []
    for x in (1, -1):
        case = load_case(FOLDER / "case.toml", [f"drive.0.direction=[{x}, 0, 0]", "drive.0.travel=3.75"]).case
        ends.append(force_response(with_values(case, STIFFNESS), np.array([3.75e-3])).force[0])
    # the mirror image of four columns requires a rotation of all squares, so both are not quite equal
    assert ends[0] == pytest.approx(ends[1], rel=2e-3)


def test_the_fit_lies_in_the_band_of_both_tests_and_the_prediction_kept_is_that_of_the_fit() -> None:
    path = FOLDER / "calibration.toml"
    study = read_study(path)
    tests, parameters, priors = read_tests(study, path)
    found = identify(tests, parameters, priors)
    for test, response, added in zip(tests, found.responses, found.added, strict=True):
        half_band = test.deviation  # the band is plus and minus one standard deviation in this study
        assert np.all(np.abs(response.force + added - test.force) < half_band), test.name
    assert study.predict is not None
    values = dict(zip(found.estimate.names[:3], found.estimate.values[:3].tolist(), strict=True))
    case = with_values(load_case(FOLDER / "case.toml", study.predict.set).case, values)
    kept = np.genfromtxt(ROOT / "validation" / "rotating_squares" / "shear_prediction.csv", delimiter=",", names=True)
    assert kept.dtype.names == ("displacement_mm", "force_N", "low_N", "high_N")
    assert kept["displacement_mm"][[0, -1]].tolist() == [0.0, 3.75]
    force = force_response(case, 1e-3 * kept["displacement_mm"]).force
    np.testing.assert_allclose(kept["force_N"], force, rtol=1e-4, atol=1e-6)
    assert np.all(kept["low_N"][1:] < kept["force_N"][1:]) and np.all(kept["force_N"][1:] < kept["high_N"][1:])
