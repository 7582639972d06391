"""The law of a crease with hysteresis: work equals stored energy plus loss, on any path."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fsm.case.models.materials import SplineCrease
from fsm.errors import CaseError
from fsm.laws.crease import join_curves
from fsm.laws.crease_hysteresis import hysteresis_stiffness, slip_energy, slip_moment, slip_power, strength_curve
from fsm.model.elements.crease_curves import curve_of, hysteresis_of

POINTS = np.linspace(0.0, 1.5, 16)
STRENGTH = 1e-3 * np.array([2, 2, 2.2, 2.5, 2.4, 1.0, 0.9, 0.8, 0.8, 1.2, 1.4, 1.0, 0.6, 0.4, 0.1, 0.0])
CURVE = strength_curve(POINTS, STRENGTH)
TABLE = join_curves([CURVE])
STIFFNESS = hysteresis_stiffness(CURVE, 0.05)
LAW = (
    np.array([STIFFNESS]), np.array([0]), TABLE.bounds, TABLE.knots, TABLE.coefficients, TABLE.energies,
)  # fmt: skip


def one(value: float) -> np.ndarray:
    return np.array([value])


def test_the_strength_is_constant_outside_and_never_negative() -> None:
    for opening in np.linspace(-1.0, 3.0, 401):
        assert CURVE(opening)[1] >= -1e-18
    assert CURVE(-1.0)[1:] == pytest.approx((2e-3, 0.0))
    assert CURVE(3.0)[1:] == pytest.approx((0.0, 0.0), abs=1e-15)


def test_the_spring_is_stiffer_than_the_strength_is_steep() -> None:
    steepest = max(abs(CURVE(opening)[2]) for opening in np.linspace(0.0, 1.5, 2001))
    assert steepest < STIFFNESS / 1.2
    assert hysteresis_stiffness(CURVE, 1e-3) == pytest.approx(2 * 2.5e-3 / 1e-3)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(-0.4, 2.0), min_size=1, max_size=8))
def test_work_is_stored_or_lost_on_any_way(turns: list[float]) -> None:
    """The moment integrated along the path against the closed form, with reversals within one step."""
    at, slider = 0.2, 0.2 - CURVE(0.2)[1] / STIFFNESS
    stored = slip_energy(one(at), one(at), one(slider), LAW)[0][0]
    for turn in turns:
        way = np.linspace(at, turn, 20001)
        count = len(way)
        many = (np.full(count, STIFFNESS), np.zeros(count, dtype=np.int64), *LAW[2:])
        moment, _, _ = slip_moment(way, np.full(count, slider), many)
        work = float(np.trapezoid(moment, way))
        energy, lost = (array[0] for array in slip_energy(one(at), one(turn), one(slider), LAW))
        assert lost >= -1e-15
        assert abs(moment[-1]) <= CURVE(turn)[1] + 1e-15
        assert work == pytest.approx(energy - stored + lost, abs=1e-9)
        slider, at, stored = slip_moment(one(turn), one(slider), LAW)[2][0], turn, energy


@settings(deadline=None, max_examples=60)
@given(st.floats(-0.3, 1.8), st.floats(-0.3, 1.8), st.floats(0.0, 1.0))
def test_a_step_taken_in_two_is_the_same_step(begin: float, end: float, part: float) -> None:
    slider = begin - CURVE(begin)[1] / STIFFNESS
    whole = slip_energy(one(begin), one(end), one(slider), LAW)
    middle = begin + part * (end - begin)
    first = slip_energy(one(begin), one(middle), one(slider), LAW)
    moved = slip_moment(one(middle), one(slider), LAW)[2]
    second = slip_energy(one(middle), one(end), moved, LAW)
    assert second[0] == pytest.approx(whole[0], abs=1e-15)
    assert first[1] + second[1] == pytest.approx(whole[1], abs=1e-13)


def test_power_is_the_rate_of_what_is_lost() -> None:
    begin, slider, step = 0.1, 0.1 - CURVE(0.1)[1] / STIFFNESS, 1e-6
    for opening, rate in ((0.37, 2.0), (0.9, 0.5), (-0.2, -1.0)):
        after = slip_energy(one(begin), one(opening + rate * step), one(slider), LAW)[1]
        before = slip_energy(one(begin), one(opening - rate * step), one(slider), LAW)[1]
        power = slip_power(one(opening), one(rate), one(slider), LAW)
        assert power == pytest.approx((after - before) / (2 * step), rel=1e-5)
        assert power[0] > 0.0
        assert slip_power(one(opening), one(-rate), one(slider), LAW)[0] == 0.0


def test_the_slope_is_the_derivative_of_the_moment() -> None:
    slider, step = 0.3, 1e-7
    for opening in (-0.2, 0.29, 0.302, 0.37, 1.2):
        slope = slip_moment(one(opening), one(slider), LAW)[1]
        ahead, behind = (slip_moment(one(opening + s), one(slider), LAW)[0] for s in (step, -step))
        assert slope == pytest.approx((ahead - behind) / (2 * step), rel=1e-5, abs=1e-9)


def crease(**more: object) -> SplineCrease:
    angle = tuple(np.linspace(0.0, 1.5, 31))
    moment = tuple(4e-3 * np.sin(a) for a in angle)
    return SplineCrease.model_validate({"law": "spline", "angle": angle, "moment": moment} | more)


def test_both_branches_in_series_with_half_segments_are_exact() -> None:
    back = tuple(4e-3 * math.sin(a) - 5e-4 * (1.5 - a) for a in np.linspace(0.0, 1.5, 31))
    both = crease(unloading=back), 20.0
    strength = hysteresis_of(*both)
    assert strength is not None
    for opening in (0.3, 0.8, 1.2):
        for sign, moment in ((1.0, 4e-3 * math.sin(opening)), (-1.0, 4e-3 * math.sin(opening) - 5e-4 * (1.5 - opening))):
            total = opening + 20.0 * moment
            assert curve_of(*both)(total)[1] + sign * strength.strength(total)[1] == pytest.approx(moment, rel=1e-4)


def test_what_has_no_second_curve_has_no_slider_and_what_gives_energy_is_refused() -> None:
    assert hysteresis_of(crease(), 20.0) is None
    moment = tuple(4e-3 * math.sin(a) for a in np.linspace(0.0, 1.5, 31))
    assert hysteresis_of(crease(unloading=moment), 20.0) is None
    above = tuple(m + (1e-3 if 10 < k < 15 else -1e-3) for k, m in enumerate(moment))
    with pytest.raises(CaseError, match=r"unloading branch lies above .* at .* deg; a crease cannot give energy"):
        hysteresis_of(crease(unloading=above), 20.0)
