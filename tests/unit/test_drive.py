"""Prescribed motion: speed is the rate of travel, acceleration that of speed, and time_of inverts it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsm.builders.scene import build_scene
from fsm.case.loading.load_case import load_case
from fsm.model.bodies.drive import Travel, run_up


def motion(speed: float = 0.002, travel: float = 0.15, over: float = 0.003) -> Travel:
    return run_up(speed, travel, over)


def test_rates_are_derivatives() -> None:
    m, h = motion(), 1e-4
    for t in np.linspace(0.01, m.end_time - 0.01, 300):
        if abs(t - m.breaks()[1]) < 2 * h:
            continue
        ahead, behind = m.at(t + h), m.at(t - h)
        _, speed, acceleration = m.at(t)
        assert speed == pytest.approx((ahead[0] - behind[0]) / (2 * h), abs=1e-6 * m.speed)
        assert acceleration == pytest.approx((ahead[1] - behind[1]) / (2 * h), abs=1e-6 * m.speed)


def test_run_up_is_smooth() -> None:
    """Travel, speed and acceleration meet at the start and at the end of the run-up."""
    m = motion()
    start = m.breaks()[1]
    assert start == 3.0
    assert m.at(0.0) == (0.0, 0.0, 0.0)
    assert m.at(-1.0) == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(m.at(start * (1 - 1e-10)), m.at(start), atol=1e-11)
    assert m.at(start)[0] == pytest.approx(0.003, rel=1e-14)
    assert m.at(start)[1] == m.speed == 0.002


def test_ends_at_the_travel_and_stays() -> None:
    m = motion()
    assert m.at(m.end_time)[0] == pytest.approx(0.15, rel=1e-14)
    assert m.at(m.end_time + 5.0) == (0.15, 0.0, 0.0)


@given(
    share=st.floats(0, 1), over=st.floats(0, 1), speed=st.floats(1e-4, 1.0), travel=st.floats(1e-4, 1.0)
)
def test_time_of_inverts_travel(share: float, over: float, speed: float, travel: float) -> None:
    m = motion(speed, travel, over * travel)
    wanted = share * travel
    t = m.time_of(wanted)
    assert 0.0 <= t <= m.end_time * (1 + 1e-12)
    assert m.at(t)[0] == pytest.approx(wanted, rel=1e-9, abs=1e-12 * travel)


def test_time_of_more_than_the_travel_is_the_end() -> None:
    m = motion()
    assert m.time_of(2 * m.travel) == m.end_time


def test_without_run_up_the_speed_is_there_at_once() -> None:
    m = motion(over=0.0)
    assert m.at(0.0) == (0.0, m.speed, 0.0)
    assert m.end_time == pytest.approx(m.travel / m.speed)


def test_drives_of_a_strip_stay_in_the_order_of_the_case() -> None:
    """The force curve and the peak are those of the first drive, whichever crease it pulls."""
    drives = [{"crease": 4}, {"bodies": ["panel 3 segment 1"]}, {"crease": 2}, {"body": "panel 5 segment 2"}]
    given = ", ".join(
        f"{{{key} = {value!r}, speed = 1e-3, travel = {0.001 * k}}}".replace("'", '"')
        for k, drive in enumerate(drives, 1)
        for key, value in drive.items()
    )
    case = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
    scene = build_scene(load_case(case, ["expect=none", "strip.segments_per_panel=2", f"drive=[{given}]"]).case)
    assert [drive.moved[0] for drive in scene.drives] == ["crease 4", "panel 3 segment 1", "crease 2", "panel 5 segment 2"]
    assert [drive.travel for drive in scene.drives] == [0.001, 0.002, 0.003, 0.004]
