"""Every law: derivatives against central differences, energy against effort, and smoothness where it is required."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from fsm.laws.crease import (
    CreaseLaws,
    MomentCurve,
    add_flexibility,
    crease_moment,
    curve_from_data,
    elastic_effort,
    join_curves,
)

ANGLE = np.array([-0.4, 0.1, 0.5, 1.2, 2.0, 2.6])
MOMENT = np.array([-2e-3, 1e-3, 4e-3, 5e-3, 9e-3, 8e-3])


def slope(function: Callable[[float], float], at: float, h: float) -> float:
    return (8 * (function(at + h) - function(at - h)) - (function(at + 2 * h) - function(at - 2 * h))) / (12 * h)


# crease curves ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("interpolation", ["cubic", "pchip"])
def test_curve_goes_through_the_data_and_straight_on(interpolation: str) -> None:
    curve = curve_from_data(ANGLE, MOMENT, interpolation)
    for angle, moment in zip(ANGLE, MOMENT, strict=True):
        assert curve(angle)[1] == pytest.approx(moment, abs=1e-17)
    for end, outwards in ((ANGLE[0], -1.0), (ANGLE[-1], 1.0)):
        _, moment, gradient = curve(end)
        _, inside, _ = curve(end - 1e-7 * outwards)
        assert gradient == pytest.approx((moment - inside) / 1e-7 * outwards, rel=1e-5)
        for far in (0.1, 1.0, 50.0):
            _, value, there = curve(end + far * outwards)
            assert value == pytest.approx(moment + gradient * far * outwards, rel=1e-12)
            assert there == pytest.approx(gradient, rel=1e-12)


@pytest.mark.parametrize("interpolation", ["cubic", "pchip"])
@pytest.mark.parametrize("opening", [-3.0, -0.2, 0.0, 0.3, 1.9, 2.6, 4.0])
def test_curve_energy_is_the_integral_from_zero(interpolation: str, opening: float) -> None:
    curve = curve_from_data(ANGLE, MOMENT, interpolation)
    breaks = [a for a in ANGLE if min(0, opening) < a < max(0, opening)]
    # Gauss rules between the knots are exact
    edges = np.sort([0.0, opening, *breaks])
    total = sum(quad(lambda o: curve(o)[1], a, b)[0] for a, b in pairwise(edges))
    assert curve(opening)[0] == pytest.approx(total if opening >= 0 else -total, abs=1e-15)


@pytest.mark.parametrize("interpolation", ["cubic", "pchip"])
def test_curve_slope(interpolation: str) -> None:
    curve = curve_from_data(ANGLE, MOMENT, interpolation)
    for opening in (-2.0, -0.31, 0.22, 0.77, 1.6, 2.3, 3.0):
        assert curve(opening)[2] == pytest.approx(slope(lambda o: curve(o)[1], opening, 1e-3), rel=1e-9)
        assert curve(opening)[1] == pytest.approx(slope(lambda o: curve(o)[0], opening, 1e-3), rel=1e-9)


def test_pchip_keeps_monotone_data_monotone_where_the_spline_does_not() -> None:
    angle, moment = np.array([0.0, 1.0, 1.1, 2.0, 3.0]), np.array([0.0, 0.0, 1.0, 1.0, 1.0])
    grid = np.linspace(0, 3, 601)
    monotone, spline = (
        np.array([curve_from_data(angle, moment, kind)(o)[1] for o in grid]) for kind in ("pchip", "cubic")
    )
    assert np.diff(monotone).min() >= -1e-15
    assert np.diff(spline).min() < -1e-3


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_crease_moment_is_the_slope_of_its_energy(side: float) -> None:
    """Both directions of folding, with two curves in one table; the moment resists opening."""
    curves = [curve_from_data(ANGLE, MOMENT), curve_from_data(np.array([0.0, 1.0]), np.array([0.0, 3e-3]), "pchip")]
    table = join_curves(curves)
    which = np.array([0, 1, 0])
    rest, sides, damping = np.array([2.8, 2.8, 2.5]), np.full(3, side), np.array([0.0, 0.0, 2e-3])
    law = CreaseLaws(rest, sides, damping, which, table.bounds, table.knots, table.coefficients, table.energies)
    angle, rate = side * np.array([2.0, 1.0, 0.2]), np.array([0.3, 0.3, 0.3])

    def energies(x: np.ndarray) -> np.ndarray:
        return np.array([elastic_effort(law, i, angle)[0] for i, angle in enumerate(x)])

    effort, stiffness = crease_moment(angle, rate, law)
    quiet, _ = crease_moment(angle, 0 * rate, law)
    np.testing.assert_allclose((effort - quiet)[:, 0], damping * rate, rtol=1e-12, atol=1e-18)
    h = 1e-3
    found = (8 * (energies(angle + h) - energies(angle - h)) - energies(angle + 2 * h) + energies(angle - 2 * h)) / (
        12 * h
    )
    np.testing.assert_allclose(quiet[:, 0], found, rtol=1e-9)
    up, _ = crease_moment(angle + h, 0 * rate, law)
    down, _ = crease_moment(angle - h, 0 * rate, law)
    np.testing.assert_allclose(stiffness[:, 0], (up - down)[:, 0] / (2 * h), rtol=1e-4)
    opening = rest - side * angle
    for i in range(3):
        assert energies(angle)[i] == pytest.approx(curves[which[i]](opening[i])[0], rel=1e-13)
        assert quiet[i, 0] == pytest.approx(-side * curves[which[i]](opening[i])[1], rel=1e-13)


# half cell ----------------------------------------------------------------------------------------------------


def series_moment(curve: MomentCurve, flexibility: float, total: float) -> float:
    """Moment at a total angle, found by solving o + M(o) f = total independently."""
    opening = brentq(lambda o: o + curve(o)[1] * flexibility - total, -20, 20, xtol=1e-14, rtol=1e-15)
    return curve(opening)[1]


@pytest.mark.parametrize("interpolation", ["cubic", "pchip"])
@pytest.mark.parametrize("flexibility", [1.0, 20.0, 80.0])
def test_series_flexibility(interpolation: str, flexibility: float) -> None:
    """Exact at its knots and outside, fourth order between them, 1e-9 when they are close."""
    curve = curve_from_data(ANGLE, MOMENT, interpolation)
    size = MOMENT.max()

    def errors(series: MomentCurve, totals: np.ndarray) -> np.ndarray:
        return np.array([abs(series(t)[1] - series_moment(curve, flexibility, t)) for t in totals]) / size

    series = add_flexibility(curve, flexibility)
    assert len(series.knots) == 32 * (len(ANGLE) - 1) + 1
    ends = np.array([series.knots[0], series.knots[-1]])
    assert errors(series, series.knots[::5]).max() < 1e-9
    assert errors(series, np.concatenate([ends - 1.0, ends, ends + 1.0])[[0, 2, 3, 5]]).max() < 1e-9
    totals = np.linspace(*ends, 301)
    coarse, fine = (errors(add_flexibility(curve, flexibility, n), totals).max() for n in (32, 256))
    assert coarse < 1e-6
    assert fine < 1e-9
    assert fine < coarse / 8**3.3
    assert series(0.0)[0] == pytest.approx(0.0, abs=1e-18)


def test_series_flexibility_of_a_linear_crease_is_two_springs_in_series() -> None:
    k, f = 9e-3, 37.0
    series = add_flexibility(curve_from_data(np.array([0.0, 1.0]), np.array([0.0, k]), "pchip"), f)
    for total in (-1.0, 0.0, 0.4, 3.0):
        _, moment, gradient = series(total)
        assert moment == pytest.approx(k / (1 + k * f) * total, rel=1e-12, abs=1e-18)
        assert gradient == pytest.approx(k / (1 + k * f), rel=1e-12)


def test_no_flexibility_is_the_curve_itself() -> None:
    curve = curve_from_data(ANGLE, MOMENT)
    assert add_flexibility(curve, 0.0) is curve


def test_snap_through_is_refused() -> None:
    """If a crease softens faster than the flexibility beside it can follow, the series curve is not single-valued."""
    curve = curve_from_data(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.2]), "pchip")
    worst = min(curve(o)[2] for o in np.linspace(0, 2, 201))
    assert worst < 0
    assert add_flexibility(curve, 0.9 / -worst)(1.5)[1] > 0
    with pytest.raises(ValueError, match=r"at an opening of \d.* deg the tangent stiffness .* is -.*half_cell = false"):
        add_flexibility(curve, 1.1 / -worst)
