"""Rotating squares: forces against another program, the study's sections, and the prediction that is kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fsm.calibrate.force import read_tests
from fsm.calibrate.identify import identify
from fsm.calibrate.response import force_response
from fsm.calibrate.study import read_study, with_values
from fsm.case.loading.load_case import load_case
from validation.rotating_squares.check import LOADINGS, MODELS, moved
from validation.rotating_squares.dense import Squares, beams

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "folding_cases" / "rotating_squares"


@pytest.mark.parametrize("name", LOADINGS)
@pytest.mark.parametrize("model", MODELS)
def test_forces_are_those_of_another_program(model: str, name: str) -> None:
    (file, values, law, clamp), (direction, travel) = MODELS[model], LOADINGS[name]
    expected = Squares(law, clamp).forces((direction[0], direction[2]), travel)
    case = moved(file, values, direction, travel[-1])
    np.testing.assert_allclose(force_response(case, 1e-3 * np.array(travel)).force, expected, rtol=1e-7)


def test_the_dense_program_with_springs_of_the_source_gives_the_forces_of_an_older_one() -> None:
    """Computed on 21 November 2026 from the energies of 38 ligaments, differentiated by complex steps."""
    older = {"tension": 4.36050354, "compression": 2.94385189, "shear": 1.41642901}
    _, _, law, clamp = MODELS["springs"]
    for name, (direction, travel) in LOADINGS.items():
        assert Squares(law, clamp).forces((direction[0], direction[2]), travel)[-1] == pytest.approx(older[name], rel=1e-7)


def test_a_further_shape_of_the_bent_hinges_hardly_changes_the_forces() -> None:
    """The cubic deflection is accurate to 0.5 % in tension, the largest force, and to 0.01 % in shear."""
    for (direction, travel), error in zip(LOADINGS.values(), (0.005, 0.003, 1e-4), strict=True):
        way = (direction[0], direction[2])
        shims = 3200.0, 0.127, 8.1, 0.64
        one, two = (Squares(beams(*shims, terms=terms), 0.64).forces(way, travel)[-1] for terms in (1, 2))
        assert 0.0 < one / two - 1.0 < error


def test_shear_to_either_side_is_the_same() -> None:
    ends = []
    for x in (1, -1):
        ends.append(force_response(moved("shims.toml", {}, (x, 0, 0), 3.75), np.array([3.75e-3])).force[0])
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
    values = dict(zip(found.estimate.names[:2], found.estimate.values[:2].tolist(), strict=True))
    case = with_values(load_case(FOLDER / "shims.toml", study.predict.set).case, values)
    kept = np.genfromtxt(ROOT / "validation" / "rotating_squares" / "shear_prediction.csv", delimiter=",", names=True)
    assert kept.dtype.names == ("displacement_mm", "force_N", "low_N", "high_N")
    assert kept["displacement_mm"][[0, -1]].tolist() == [0.0, 3.75]
    force = force_response(case, 1e-3 * kept["displacement_mm"]).force
    np.testing.assert_allclose(kept["force_N"], force, rtol=1e-4, atol=1e-6)
    assert np.all(kept["low_N"][1:] < kept["force_N"][1:]) and np.all(kept["force_N"][1:] < kept["high_N"][1:])
