"""Every law: slopes against central differences, energy against effort, smooth where it must be."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

from fsm.laws.bushing import bushing, bushing_energy
from fsm.laws.crease import (
    Curve,
    add_flexibility,
    crease_energy,
    crease_moment,
    curve_from_data,
    join_curves,
)
from fsm.laws.friction import LAW_STEP, LAW_TANH, friction
from fsm.laws.normal_contact import hertz, hertz_energy

K, E, C, RAMP = 2e5, 1.5, 40.0, 1e-4
STEP = (LAW_STEP, 0.3, 0.2, 1e-3, 1e-2)
TANH = (LAW_TANH, 0.3, 0.2, 1e-3, 1e-2)
ANGLE = np.array([-0.4, 0.1, 0.5, 1.2, 2.0, 2.6])
MOMENT = np.array([-2e-3, 1e-3, 4e-3, 5e-3, 9e-3, 8e-3])


def slope(function: Callable[[float], float], at: float, h: float) -> float:
    return (8 * (function(at + h) - function(at - h)) - (function(at + 2 * h) - function(at - 2 * h))) / (12 * h)


# bushing ------------------------------------------------------------------------------------------------------


def test_bushing_effort_is_the_slope_of_the_energy_plus_damping() -> None:
    rng = np.random.default_rng(1)
    value, rate, rest, k, c = rng.normal(size=(5, 3, 2))
    effort = bushing(value, rate, rest, k, c)
    for i in range(3):
        for j in range(2):

            def energy(x: float, i: int = i, j: int = j) -> float:
                moved = value.copy()
                moved[i, j] = x
                return float(bushing_energy(moved, rate, rest, k, c)[0][i])

            assert effort[i, j] - c[i, j] * rate[i, j] == pytest.approx(slope(energy, value[i, j], 1e-3), abs=1e-10)
    power = bushing_energy(value, rate, rest, k, c)[1]
    assert power == pytest.approx(np.sum((effort - bushing(value, 0 * rate, rest, k, c)) * rate))


# normal contact -----------------------------------------------------------------------------------------------


def normal(depth: float, closing: float, share: float = 0.3, exponent: float = E) -> tuple[float, float, float]:
    force, slopes = hertz(np.array([depth]), np.array([closing]), np.array([share]), K, exponent, C, RAMP)
    return float(force[0]), float(slopes[0, 0]), float(slopes[0, 1])


@pytest.mark.parametrize("depth", [1e-6, 3e-5, 9.9e-5, 1.01e-4, 1e-3])
@pytest.mark.parametrize("closing", [-1e-4, 0.0, 0.2])
def test_hertz_slopes(depth: float, closing: float) -> None:
    force, by_depth, by_rate = normal(depth, closing)
    assert force > 0
    assert by_depth == pytest.approx(slope(lambda d: normal(d, closing)[0], depth, 1e-3 * depth), rel=1e-8)
    assert by_rate == pytest.approx(slope(lambda v: normal(depth, v)[0], closing, 1e-4), rel=1e-8, abs=1e-9)


@given(depth=st.floats(1e-9, 1e-2), closing=st.floats(-1e3, 1e3), exponent=st.sampled_from([1.0, 1.5, 2.2]))
def test_hertz_never_pulls_and_is_shared_by_length(depth: float, closing: float, exponent: float) -> None:
    force, by_depth, by_rate = normal(depth, closing, 1.0, exponent)
    step = min(1.0, depth / RAMP)
    wanted = max(0.0, K * depth**exponent + C * step * step * (3 - 2 * step) * closing)
    assert force >= 0.0
    assert force == pytest.approx(wanted, rel=1e-12, abs=1e-12 * C * abs(closing))
    assert by_rate >= 0.0
    if force == 0.0:
        assert (by_depth, by_rate) == (0.0, 0.0)
    halves = [normal(depth, closing, share, exponent)[0] for share in (0.25, 0.75)]
    assert sum(halves) == pytest.approx(force)


@pytest.mark.parametrize("closing", [-1.0, 0.0, 1.0])
def test_hertz_starts_smoothly(closing: float) -> None:
    """At d = 0 force and slope are zero (C1), damping included."""
    assert normal(0.0, closing)[0] == 0.0
    for depth in (1e-8, 1e-10, 1e-12):
        force, by_depth, _ = normal(depth, closing)
        # K d^1.5, its slope, and what damping adds: 6 C v d/ramp^2 at most
        assert force <= K * depth**1.5 + 3 * C * depth**2 / RAMP**2
        assert abs(by_depth) <= 1.5 * K * depth**0.5 + 6 * C * depth / RAMP**2


def test_hertz_energy_is_the_integral_of_the_force() -> None:
    for exponent in (1.0, 1.5, 2.2):
        energy = hertz_energy(np.array([2e-3]), np.array([0.3]), K, exponent)[0]
        work = quad(lambda d, e=exponent: normal(d, 0.0, 0.3, e)[0], 0.0, 2e-3, epsabs=0, epsrel=1e-11)[0]
        assert energy == pytest.approx(work, rel=1e-9)


def test_hertz_impact_lasts_as_long_as_hertz_says() -> None:
    """2.943275 d_max/v0 without damping (docs/theory.md)."""
    mass, v0 = 0.1, 1.0
    deepest = (2.5 * 0.5 * mass * v0**2 / K) ** 0.4
    # t = 2 int dd/v, with d = d_max sin(a)^0.8 to take the root out of the end
    def integrand(a: float) -> float:
        d = deepest * np.sin(a) ** 0.8
        rate = np.sqrt(v0**2 - 2 * hertz_energy(np.array([d]), np.array([1.0]), K, E)[0] / mass)
        return deepest * 0.8 * np.sin(a) ** -0.2 * np.cos(a) / rate

    assert 2 * quad(integrand, 0, np.pi / 2)[0] == pytest.approx(2.943275 * deepest / v0, rel=1e-6)


# friction -----------------------------------------------------------------------------------------------------


def coefficient(speed: float, law: tuple[int, float, float, float, float] = STEP) -> float:
    """Friction over normal force, signed as the slip."""
    effort, _ = friction(np.array([[speed]]), np.array([5.0]), *law)
    return float(effort[0, 0]) / 5.0


def test_step_friction_values() -> None:
    assert coefficient(0.0) == 0.0
    assert coefficient(1e-3) == pytest.approx(0.3, rel=1e-12)
    assert coefficient(5.5e-3) == pytest.approx(0.25, rel=1e-12)
    assert coefficient(1e-2) == pytest.approx(0.2, rel=1e-12)
    assert coefficient(1.0) == pytest.approx(0.2, rel=1e-12)
    # half way up: STEP(v, -v_s, -mu_s, v_s, mu_s) at x = 3/4
    assert coefficient(0.5e-3) == pytest.approx(0.3 * (2 * 0.75**2 * (3 - 1.5) - 1), rel=1e-12)


def test_tanh_friction_values() -> None:
    assert coefficient(5e-4, TANH) == pytest.approx(0.2 * np.tanh(0.5))
    assert coefficient(1.0, TANH) == pytest.approx(0.2)


@pytest.mark.parametrize("law", [STEP, TANH], ids=["step", "tanh"])
def test_friction_is_odd_smooth_and_bounded(law: tuple[int, float, float, float, float]) -> None:
    speeds = np.linspace(-2e-2, 2e-2, 4001)
    values = np.array([coefficient(v, law) for v in speeds])
    np.testing.assert_allclose(values, -values[::-1], atol=1e-15)
    assert np.all(values * speeds >= 0)
    assert np.abs(values).max() <= law[1] + 1e-15
    slopes = np.diff(values) / np.diff(speeds)
    steepest = {LAW_STEP: 1.5 * 0.3, LAW_TANH: 0.2}[law[0]] / 1e-3
    assert np.abs(slopes).max() <= steepest * (1 + 1e-6)
    # C1: the slope changes by no more than curvature times the step
    assert np.abs(np.diff(slopes)).max() <= 4 * steepest / 1e-3 * 1e-5


@pytest.mark.parametrize("law", [STEP, TANH], ids=["step", "tanh"])
@pytest.mark.parametrize("speed", [1e-8, 3e-4, 9e-4, 2e-3, 7e-3, 0.05])
def test_friction_slopes(law: tuple[int, float, float, float, float], speed: float) -> None:
    direction = np.array([0.6, 0.0, 0.8])
    effort, slopes = friction((speed * direction)[None], np.array([5.0]), *law)
    mu, derivative = coefficient(speed, law), slope(lambda v: coefficient(v, law), speed, 1e-3 * speed)
    np.testing.assert_allclose(effort[0], 5.0 * mu * direction, rtol=1e-12)
    assert slopes[0, 0] == pytest.approx(mu / speed, rel=1e-9)
    assert slopes[0, 1] == pytest.approx(derivative, rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("law", [STEP, TANH], ids=["step", "tanh"])
def test_friction_at_rest_has_the_limit_of_its_ratio(law: tuple[int, float, float, float, float]) -> None:
    effort, slopes = friction(np.zeros((1, 3)), np.array([5.0]), *law)
    assert not effort.any()
    assert slopes[0, 0] == slopes[0, 1] == pytest.approx(coefficient(1e-9, law) / 1e-9, rel=1e-5)


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
    """Both hands of fold, two curves in one table; the moment resists opening."""
    curves = [curve_from_data(ANGLE, MOMENT), curve_from_data(np.array([0.0, 1.0]), np.array([0.0, 3e-3]), "pchip")]
    table = join_curves(curves)
    arrays = (table.bounds, table.knots, table.coefficients, table.energies)
    which = np.array([0, 1, 0])
    rest, sides, damping = np.array([2.8, 2.8, 2.5]), np.full(3, side), np.array([0.0, 0.0, 2e-3])
    angle, rate = side * np.array([2.0, 1.0, 0.2]), np.array([0.3, 0.3, 0.3])

    def energies(x: np.ndarray) -> np.ndarray:
        return crease_energy(x, rest, sides, which, *arrays)

    effort, stiffness = crease_moment(angle, rate, rest, sides, damping, which, *arrays)
    quiet, _ = crease_moment(angle, 0 * rate, rest, sides, damping, which, *arrays)
    np.testing.assert_allclose((effort - quiet)[:, 0], damping * rate, rtol=1e-12, atol=1e-18)
    h = 1e-3
    found = (8 * (energies(angle + h) - energies(angle - h)) - energies(angle + 2 * h) + energies(angle - 2 * h)) / (
        12 * h
    )
    np.testing.assert_allclose(quiet[:, 0], found, rtol=1e-9)
    up, _ = crease_moment(angle + h, 0 * rate, rest, sides, damping, which, *arrays)
    down, _ = crease_moment(angle - h, 0 * rate, rest, sides, damping, which, *arrays)
    np.testing.assert_allclose(stiffness[:, 0], (up - down)[:, 0] / (2 * h), rtol=1e-4)
    opening = rest - side * angle
    for i in range(3):
        assert energies(angle)[i] == pytest.approx(curves[which[i]](opening[i])[0], rel=1e-13)
        assert quiet[i, 0] == pytest.approx(-side * curves[which[i]](opening[i])[1], rel=1e-13)


# half cell ----------------------------------------------------------------------------------------------------


def series_moment(curve: Curve, flexibility: float, total: float) -> float:
    """Moment at a total angle, by solving o + M(o) f = total on its own."""
    opening = brentq(lambda o: o + curve(o)[1] * flexibility - total, -20, 20, xtol=1e-14, rtol=1e-15)
    return curve(opening)[1]


@pytest.mark.parametrize("interpolation", ["cubic", "pchip"])
@pytest.mark.parametrize("flexibility", [1.0, 20.0, 80.0])
def test_series_flexibility(interpolation: str, flexibility: float) -> None:
    """Exact at its knots and outside, fourth order between them, 1e-9 when they are close."""
    curve = curve_from_data(ANGLE, MOMENT, interpolation)
    size = MOMENT.max()

    def errors(series: Curve, totals: np.ndarray) -> np.ndarray:
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
    """A crease that softens by more than the flexibility beside it can follow has no single-valued series curve."""
    curve = curve_from_data(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.2]), "pchip")
    worst = min(curve(o)[2] for o in np.linspace(0, 2, 201))
    assert worst < 0
    assert add_flexibility(curve, 0.9 / -worst)(1.5)[1] > 0
    with pytest.raises(ValueError, match=r"at an opening of \d.* deg the crease softens by -.*half_cell = false"):
        add_flexibility(curve, 1.1 / -worst)
