"""Derivatives of the motion of mechanisms against closed forms and differences of runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

import fsm

WING = (Path(fsm.__file__).parent / "cli" / "templates" / "wing.toml").read_text()
ONE = {
    "report": None, "margin": None, "wing.stowed": ["90 deg"],
    "wing.panels": 1, "wing.yoke": None, "wing.synchronisation": None, "wing.hinge.damper": None,
    "wing.hinge.stop.stiffness": "20 N m/rad", "wing.hinge.latch.stiffness": "20 N m/rad", "solve.end_time": "6 s",
    "solve.rtol": 1e-8, "solve.error_estimates": "off",
}  # fmt: skip


def test_latch_time_of_one_panel_against_quadrature() -> None:
    """The time of a panel with a spring follows from its energy; its derivatives are those of an integral."""
    case = fsm.load(WING).set(ONE)
    paths = ["wing.hinge.spring.stiffness", "wing.mass", "wing.length", "wing.hinge.spring.rest"]
    found = case.sensitivity("latch_time", paths)
    assert all(one.exact for one in found.derivatives)

    def latch_time(k: float, mass: float, length: float, rest: float) -> float:
        inertia = mass * ((length**2 + 0.022**2) / 12.0 + 0.25 * length**2)
        rise = 0.5 * np.pi - rest  # the panel starts at 90 degrees: c = rest + rise cos(w t)
        return float(quad(lambda c: (k / inertia * (rise**2 - (c - rest) ** 2)) ** -0.5, 0.0, 0.5 * np.pi)[0])

    values = [one.value for one in found.derivatives]
    assert found.value == pytest.approx(latch_time(*values), rel=1e-6)
    for number, one in enumerate(found.derivatives):
        ends = [latch_time(*(v * (1.0 + k * (i == number)) for i, v in enumerate(values))) for k in (-1e-4, 1e-4)]
        assert one.slope == pytest.approx((ends[1] - ends[0]) / (2e-4 * one.value), rel=1e-5)


def test_a_latch_at_a_stop_warns_of_derivatives_to_one_side() -> None:
    """The template latches at its stop; the warning names the joint, and numbers that move neither give none."""
    case = fsm.load(WING).set(ONE)
    assert case.sensitivity("latch_time", ["wing.mass"]).warnings == ()
    (text,) = case.sensitivity("latch_time", ["wing.hinge.latch.at"]).warnings
    assert "the latch of hinge 1 is at a stop" in text
    assert "one side" in text


def test_derivatives_through_a_stop_against_runs() -> None:
    """Rate after the impact on the stop, where the acceleration jumps, and moment of the stop."""
    case = fsm.load(WING).set({**ONE, "save.interval": "0.1 s"})
    paths = ["wing.hinge.spring.stiffness", "wing.hinge.stop.damping", "wing.mass", "wing.hinge.stop.lower"]
    for of in ("max of joint.hinge 1.rate", "min of joint.hinge 1.stop"):
        found = case.sensitivity(of, paths)
        assert all(one.exact for one in found.derivatives)
        for one in found.derivatives:
            # runs end steps within 1e-9 rad of a stop, so steps are long, and extrapolated (Richardson)
            slopes = []
            for step in (3e-4 * (abs(one.value) or 1.0), 9e-4 * (abs(one.value) or 1.0)):
                ends = [case.set({one.path: one.value + k * step, "solve.rtol": 1e-11}) for k in (-1, 1)]
                low, high = (end.sensitivity(of, paths[:1]).value for end in ends)
                slopes.append((high - low) / (2.0 * step))
            expected = (9.0 * slopes[0] - slopes[1]) / 8.0
            assert one.slope == pytest.approx(expected, rel=3e-5, abs=1e-7 * abs(found.value))
