"""Gears, racks and synchronising cables between ideal joints, against closed forms.

Wheels turn about y on the ground; panels are slender bars in the plane x, z.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fsm
from tests.physics.test_explicit import chosen

FIRST, SECOND, MASS = 0.02, 0.05, 0.4
METHODS = "generalized-alpha", "explicit"


def run(case: dict[str, Any], folder: Path) -> fsm.Result:
    return fsm.load(case).run(folder / "out", figures=False)


def body(name: str, place: list[float], inertia: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "mass": MASS, "inertia": [inertia] * 3, "position": place} | more


def hinge(name: str, first: str, second: str, at: list[float], **more: Any) -> dict[str, Any]:
    return {"name": name, "kind": "revolute", "first": first, "second": second, "at": at, "axis": [0.0, 1.0, 0.0]} | more


def mechanism(
    bodies: list[dict[str, Any]],
    joints: list[dict[str, Any]],
    kind: str,
    parameters: dict[str, Any],
    end: float,
    rtol: float = 1e-8,
    **more: Any,
) -> dict[str, Any]:
    coupling = {"name": "link", "kind": kind, "joints": [one["name"] for one in joints[:2]], "parameters": parameters}
    return {
        "scene": {"bodies": bodies, "joints": joints, "couplings": [coupling]},
        "solve": {"method": "generalized-alpha", "end_time": end, "rtol": rtol},
        "save": {"interval": end / 50.0, "channels": ["joint.*", "coupling.*", "energy.*", "body.*"]},
    } | more


def wheels(parameters: dict[str, Any], end: float, spin: float = 0.0, moment: float = 0.0, **more: Any) -> dict[str, Any]:
    bodies = [
        body("wheel", [0.0, 0.0, 0.0], FIRST, angular_velocity=[0.0, spin, 0.0]), body("other", [0.3, 0.0, 0.0], SECOND)
    ]  # fmt: skip
    driven = {"spring": {"moment": -moment}} if moment else {}
    joints = [hinge("a", "ground", "wheel", [0, 0, 0], **driven), hinge("b", "ground", "other", [0.3, 0, 0])]
    return mechanism(bodies, joints, "gear", parameters, end, **more)


def of(result: fsm.Result, name: str) -> np.ndarray:
    return np.asarray(result[name].values)


@pytest.mark.parametrize("method", METHODS)
def test_a_gear_accelerates_two_wheels_over_many_turns(method: str, tmp_path: Path) -> None:
    """A constant moment M on the first wheel: M = (J_1 + J_2/n^2) a_1; the teeth carry M - J_1 a_1."""
    ratio, moment = -2.5, 3.0
    case = wheels({"ratio": ratio}, 1.0, moment=moment)
    result = run(case | {"solve": case["solve"] | {"method": method}}, tmp_path)
    pace = moment / (FIRST + SECOND / ratio**2)
    angle, teeth = of(result, "coupling.link.angle"), of(result, "coupling.link.moment")
    assert angle[-1, 0] > 4.0 * math.pi
    np.testing.assert_allclose(angle[:, 0], 0.5 * pace * result.time**2, atol=1e-6 * angle[-1, 0])
    assert np.abs(of(result, "coupling.link.opening")).max() < 1e-9
    np.testing.assert_allclose(teeth[:, 0], moment - FIRST * pace, rtol=1e-6)
    np.testing.assert_allclose(teeth[:, 1], -SECOND * pace / ratio, rtol=1e-6)
    assert result.summary["steps_compiled"] and result.summary["energy_error"] < 1e-6
    assert "1 degree of freedom at the start" in str(fsm.load(wheels({"ratio": ratio}, 1.0)).check())


def test_a_rack_falls_with_its_pinion(tmp_path: Path) -> None:
    """A mass on a rack of radius r accelerates with m g/(m + J/r^2)."""
    radius, weight = 0.1, 9.81
    slide = {"name": "rail", "kind": "prismatic", "first": "ground", "second": "rack", "at": [0, 0, 0], "axis": [0, 0, -1]}
    bodies = [body("rack", [0.0, 0.0, 0.0], FIRST), body("pinion", [radius, 0.0, 0.0], SECOND)]
    joints = [slide, hinge("pin", "ground", "pinion", [radius, 0, 0])]
    result = run(mechanism(bodies, joints, "rack", {"ratio": radius}, 0.5, gravity=[0.0, 0.0, -weight]), tmp_path)
    pace = weight * MASS / (MASS + SECOND / radius**2)
    np.testing.assert_allclose(of(result, "joint.rail.displacement"), 0.5 * pace * result.time**2, atol=1e-8)
    np.testing.assert_allclose(of(result, "coupling.link.effort"), MASS * (weight - pace), rtol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_synchronised_panels_unfold_as_one_degree_of_freedom(method: str, tmp_path: Path) -> None:
    """Two bars of length L, folded as an accordion: the second hinge turns by -2 times the first.

    T = (m L^2/2) (1/3 + 9/4 sin^2 + 1/4 cos^2 + 1/12) theta'^2 with theta of the first bar, V = k/2 (theta - rest)^2.
    """
    length, start, rest, stiffness = 0.8, 1.4, 0.2, 2.0
    inertia = MASS * length**2 / 12.0
    tip = np.array([length * math.cos(start), 0.0, length * math.sin(start)])

    def bar(name: str, middle: np.ndarray, turn: float) -> dict[str, Any]:  # about -y from x to z
        return body(name, middle.tolist(), inertia, orientation=[math.cos(turn / 2), 0.0, -math.sin(turn / 2), 0.0])

    bodies = [bar("inner", 0.5 * tip, start), bar("outer", tip * [1.5, 1.0, 0.5], -start)]
    spring = {"stiffness": stiffness, "rest": rest - start}
    axis = [0.0, -1.0, 0.0]
    root = hinge("root", "ground", "inner", [0, 0, 0], axis=axis, spring=spring)
    joints = [hinge("fold", "inner", "outer", tip.tolist(), axis=axis), root]
    case = mechanism(bodies, joints, "gear", {"ratio": -2.0}, 0.6, rtol=1e-9)
    result = run(case | {"solve": case["solve"] | {"method": method}}, tmp_path)

    def mass(angle: float) -> tuple[float, float]:
        sine, cosine = math.sin(angle), math.cos(angle)
        size = MASS * length**2
        return size * (5.0 / 12.0 + 2.25 * sine**2 + 0.25 * cosine**2), 4.0 * size * sine * cosine

    def rates(t: float, y: np.ndarray) -> list[float]:
        m, slope = mass(y[0])
        return [y[1], (-stiffness * (y[0] - rest) - 0.5 * slope * y[1] ** 2) / m]

    known = solve_ivp(rates, (0.0, 0.6), [start, 0.0], rtol=1e-11, atol=1e-12, t_eval=result.time)
    np.testing.assert_allclose(start + of(result, "joint.root.angle"), known.y[0], atol=1e-6)
    np.testing.assert_allclose(of(result, "joint.fold.angle"), -2.0 * of(result, "joint.root.angle"), atol=1e-9)


@pytest.mark.parametrize("damping", [0.0, 2.0])
def test_backlash_ends_in_an_impact(damping: float, tmp_path: Path) -> None:
    """Wheels meet after half the play. Without a damper the impact is elastic and takes pi sqrt(J/k); the momentum stays."""
    play, stiffness, spin = 0.02, 2e4, 5.0
    reduced = FIRST * SECOND / (FIRST + SECOND)
    contact = math.pi * math.sqrt(reduced / stiffness)
    end = 0.5 * play / spin + 1.2 * contact
    given = {"ratio": 1.0, "stiffness": stiffness, "damping": damping, "backlash": play}
    result = run(wheels(given, end, spin=spin), tmp_path)
    one, other = of(result, "joint.a.rate"), of(result, "joint.b.rate")
    free = result.time < 0.5 * play / spin
    np.testing.assert_allclose(one[free], spin, atol=1e-9)
    np.testing.assert_allclose(FIRST * one + SECOND * other, FIRST * spin, rtol=1e-7)
    assert (of(result, "coupling.link.effort") >= 0.0).all()
    assert result.summary["energy_error"] < (2e-3 if damping else 1e-4)  # the force of the damper begins with a jump
    ratio = (other[-1] - one[-1]) / spin
    if damping:
        decay = 0.5 * damping / reduced
        swing = math.sqrt(stiffness / reduced - decay**2)
        # the bodies part where the effort is zero, before the spring is back: tan(w t) = 2 d w/(d^2 - w^2)
        parts = math.atan2(2.0 * decay * swing, decay**2 - swing**2) / swing
        expected = -math.exp(-decay * parts) * (math.cos(swing * parts) - decay / swing * math.sin(swing * parts))
        assert ratio == pytest.approx(expected, rel=2e-3)
    else:
        assert ratio == pytest.approx(1.0, rel=1e-4)


@pytest.mark.parametrize(("slack", "sign"), [("below", 1.0), ("above", -1.0)])
def test_a_cable_pulls_and_does_not_push(slack: str, sign: float, tmp_path: Path) -> None:
    """A wheel that turns ahead is pulled back; one that turns back makes the cable slack."""
    preload, stiffness = 0.5, 50.0
    given = {"ratio": 1.0, "stiffness": stiffness, "preload": sign * preload, "slack": slack}
    result = run(wheels(given, 0.4, spin=-2.0 * sign), tmp_path)
    opening, effort = sign * of(result, "coupling.link.opening"), sign * of(result, "coupling.link.effort")
    np.testing.assert_allclose(effort, np.maximum(0.0, preload + stiffness * opening), atol=1e-9)
    assert effort[0] == pytest.approx(preload) and (effort == 0.0).any() and result.summary["energy_error"] < 1e-5
    given = {"ratio": 1.0, "stiffness": stiffness, "slack": slack, "lag": sign * 0.1}
    lagging = run(wheels(given, 0.2, spin=2.0 * sign), tmp_path / "lag")
    other, before = sign * of(lagging, "joint.b.rate"), lagging.time < 0.1 / 2.0
    assert np.abs(other[before]).max() < 1e-12
    assert other[-1] == pytest.approx(2.0 * FIRST * 2.0 / (FIRST + SECOND), rel=1e-5)  # an elastic impact


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"joints": ["a", "c"]}, "no joint or element is called 'c'"),
        ({"joints": ["a", "a"]}, "'a' is coupled with itself"),
        ({"kind": "rack"}, 'turns, which is kind "gear"'),
        ({"parameters": {"ratio": 1.0, "backlash": 0.1}}, "`backlash` needs `stiffness`"),
        (
            {"parameters": {"ratio": 1.0, "stiffness": 1.0, "slack": "below", "backlash": 0.1}},
            "`slack` or `backlash`, not both",
        ),
        ({"parameters": {"ratio": 1.0, "stiffness": 1.0, "slack": "above", "preload": 0.1}}, 'slack "above" is negative'),
        ({"parameters": {"ratio": 1.0, "stiffness": "3 N/m"}}, "N m/rad"),
        ({"parameters": {}}, "ratio"),
    ],
)
def test_mistakes(change: dict[str, Any], text: str) -> None:
    case = wheels({"ratio": 1.0}, 0.1)
    case["scene"]["couplings"][0] |= change
    with pytest.raises(fsm.CaseError) as failure:
        fsm.load(case).check()
    assert text in str(failure.value)


def test_stiff_gears_take_implicit_steps() -> None:
    """The rate of a gear is sqrt(k (1/J_1 + n^2/J_2)); an ideal one has none."""
    def found(stiffness: float, end: float) -> tuple[float, str, str]:
        case = wheels({"ratio": -3.0, "stiffness": stiffness}, end)
        case["solve"]["method"] = "auto"
        return chosen(case)

    rate, method, _ = found(1e3, 0.1)
    assert rate == pytest.approx(math.sqrt(1e3 * (1.0 / FIRST + 9.0 / SECOND)))
    assert method == "explicit"
    assert found(1e13, 10.0)[1] == "generalized-alpha"
