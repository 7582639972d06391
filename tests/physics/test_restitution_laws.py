"""Impacts and sliding of one mass under the laws alone: results compared with closed forms and tables."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fsm.case.models.contact import Contact, Friction
from fsm.laws.friction import FRICTION_LAWS
from fsm.laws.normal import NORMAL_LAWS
from fsm.laws.normal.flores import damping_factor as flores
from fsm.laws.normal.hunt_crossley import damping_factor as hunt_crossley
from fsm.laws.normal.lankarani_nikravesh import damping_factor as lankarani_nikravesh
from validation.closed_forms.impacts import delivered, impact

FACTORS = {"hunt-crossley": hunt_crossley, "lankarani-nikravesh": lankarani_nikravesh, "flores": flores}


@pytest.mark.parametrize("c", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_delivered_restitution(c: float) -> None:
    """The exact law gives the requested restitution; the other laws give the restitution that follows from their h. Any
    exponent, mass and speed."""
    for mass, speed, exponent in ((0.1, 1.0, 1.5), (2.0, 0.3, 1.0), (0.05, 5.0, 2.2)):
        contact = Contact(stiffness=1e6, restitution=c, exponent=exponent, speed_floor=1e-6)
        assert contact.law == "restitution"
        assert impact(contact, mass, speed)[0] == pytest.approx(c, rel=1e-7)
    for name, factor in FACTORS.items():
        contact = Contact(law=name, stiffness=1e6, restitution=c, speed_floor=1e-6)
        assert impact(contact, 0.1, 1.0)[0] == pytest.approx(delivered(factor(c)), rel=1e-7)


def test_delivered_restitution_of_a_half() -> None:
    """The table of docs/theory.md."""
    table = {"hunt-crossley": 0.663, "lankarani-nikravesh": 0.725, "flores": 0.470, "restitution": 0.500}
    for name, e in table.items():
        contact = Contact(law=name, stiffness=1e8, restitution=0.5)
        assert impact(contact, 1.0, 1.0)[0] == pytest.approx(e, abs=5.1e-4)


@pytest.mark.parametrize("speed", [1e-4, 1e-3, 1e-2, 1e-1])
def test_restitution_rises_below_the_floor(speed: float) -> None:
    """An impact slower than the floor (1 mm/s here) has the smaller h v0/sqrt(v0^2 + floor^2), and rebounds faster."""
    contact = Contact(stiffness=1e6, restitution=0.5)
    h = NORMAL_LAWS["restitution"].params(contact)[2] * speed / math.hypot(speed, 1e-3)
    assert impact(contact, 0.1, speed)[0] == pytest.approx(delivered(h), rel=1e-6)


@pytest.mark.parametrize(
    ("mass", "speed", "e"),
    [(0.1, 0.1, 0.5544), (0.1, 1, 0.1103), (1, 0.1, 0.5184), (1, 1, 0.4166), (10, 0.1, 0.7057), (10, 1, 0.7736)],
)
def test_impact_has_no_restitution_of_its_own(mass: float, speed: float, e: float) -> None:
    """The table of docs/theory.md: K = 1e8 N/m^1.5, C = 1e3 N s/m, ramp 0.1 mm."""
    contact = Contact(law="impact", stiffness=1e8, damping=1e3, ramp=1e-4)
    assert impact(contact, mass, speed)[0] == pytest.approx(e, abs=6e-5)


def test_kelvin_voigt() -> None:
    """Damping ratio 0.1, with separation where the force is zero; a damper with tension until d = 0 would leave exp(-pi
    z/wd)."""
    stiffness, mass = 1e6, 1.0
    contact = Contact(law="linear", stiffness=stiffness, damping=0.2 * math.sqrt(stiffness * mass), ramp=1e-9)
    z = 0.1
    wd = math.sqrt(1 - z * z)
    closed = math.exp(-z / wd * (math.pi - math.atan2(2 * z * wd, 1 - 2 * z * z)))
    assert closed > math.exp(-math.pi * z / wd) == pytest.approx(0.729248, abs=5e-7)
    assert closed == pytest.approx(0.744079, abs=5e-7)
    assert impact(contact, mass, 1.0)[0] == pytest.approx(closed, rel=1e-5)


def test_duration_of_a_hertz_impact() -> None:
    for mass, speed in ((0.1, 1.0), (3.0, 0.02)):
        e, duration, deepest = impact(Contact(stiffness=2e5), mass, speed)
        assert e == pytest.approx(1.0, rel=1e-8)
        assert deepest == pytest.approx((1.25 * mass * speed**2 / 2e5) ** 0.4, rel=1e-8)
        assert duration * speed / deepest == pytest.approx(2.943275, rel=1e-6)


# a block on an incline ----------------------------------------------------------------------------------------

MASS, G = 1.0, 9.81
TANH = Friction(law="tanh", mu_dynamic=0.2, v_static=1e-3)
LUGRE = Friction(law="lugre", mu_static=0.3, mu_dynamic=0.2, v_stribeck=5e-3, presliding=1e-5)


def creep(slope: float) -> float:
    """Steady speed of the block with tanh friction, by SciPy."""
    law = FRICTION_LAWS["tanh"]
    params, normal = law.params(TANH), np.array([MASS * G * math.cos(math.atan(slope))])

    def rate(t: float, u: np.ndarray) -> list[float]:
        effort, _, _ = law.effort(u[None].copy(), normal, params)
        return [G * math.sin(math.atan(slope)) - effort[0, 0] / MASS]

    return float(solve_ivp(rate, (0, 0.5), [0.0], method="Radau", rtol=1e-8, atol=1e-12).y[0, -1])


def slide(slope: float, end: float, step: float, tilting: float = 0.6) -> tuple[np.ndarray, np.ndarray]:
    """Travel and speed of the block with bristles: trapezoidal rule, Newton with the law's own derivative.

    The component of the weight along the slope grows from zero while the plane is tilted.
    """
    law = FRICTION_LAWS["lugre"]
    params, normal = law.params(LUGRE), np.array([MASS * G * math.cos(math.atan(slope))])
    z, u, force, travel = np.zeros((1, 1)), np.zeros((1, 1)), 0.0, 0.0
    travels, speeds = [0.0], [0.0]
    for i in range(round(end / step)):
        pull = min(1.0, (i + 1) * step / tilting) * normal[0] * slope
        new = u.copy()
        for _ in range(50):
            effort, by_slip, by_mean, _, bent = law.effort(new, 0.5 * (u + new), normal, z, step, params)
            by_slip = by_slip + 0.5 * by_mean
            residual = MASS * (new - u)[0, 0] - 0.5 * step * (force + pull - effort[0, 0])
            change = residual / (MASS + 0.5 * step * by_slip[0, 0, 0])
            new = new - change
            if abs(change) < 1e-15:
                break
        else:
            pytest.fail("Newton does not converge with the derivative of the law")
        effort, _, _, _, bent = law.effort(new, 0.5 * (u + new), normal, z, step, params)
        travel += 0.5 * step * float((u + new)[0, 0])
        u, z, force = new, bent, pull - effort[0, 0]
        travels.append(travel)
        speeds.append(float(u[0, 0]))
    return np.array(travels), np.array(speeds)


@pytest.mark.parametrize("slope", [0.05, 0.15, 0.195])
def test_tanh_creeps_as_it_says(slope: float) -> None:
    assert creep(slope) == pytest.approx(1e-3 * math.atanh(slope / 0.2), rel=1e-6)


@pytest.mark.parametrize("slope", [0.05, 0.15, 0.195, 0.29])
def test_bristles_hold_the_block(slope: float) -> None:
    """After loading, the block with bristles moves less than a millionth of the creep with tanh (at 0.29, tanh does not hold
    it at all)."""
    travel, _ = slide(slope, 2.0, 5e-4)
    crept = abs(travel[-1] - travel[2000])  # displacement in the last second
    assert crept < 1e-6 * creep(min(slope, 0.195))
    # bristles are springs up to 0.8 of their limit
    if slope < 0.24:
        assert travel[-1] == pytest.approx(1e-5 * slope / 0.3, rel=1e-6)


def test_bristles_give_way_beyond_the_static_coefficient() -> None:
    """The block ends with the dynamic coefficient: the acceleration is that of sliding."""
    travel, speed = slide(0.31, 1.5, 5e-4)
    angle = math.atan(0.31)
    assert travel[-1] > 0.1
    assert (speed[-1] - speed[-201]) / 0.1 == pytest.approx(G * (math.sin(angle) - 0.2 * math.cos(angle)), rel=1e-6)


def test_bristles_follow_their_rate_equation() -> None:
    """The steps above compared with SciPy, with the deflection as a state."""
    slope, end, tilting = 0.25, 0.02, 0.02
    normal = MASS * G * math.cos(math.atan(slope))

    def rate(t: float, state: np.ndarray) -> tuple[float, float, float]:
        _, u, z = state
        pull = min(1.0, t / tilting) * normal * slope
        fade = math.exp(-((u / 5e-3) ** 2))
        g = 0.2 + 0.1 * fade
        x = min(1.0, max(0.0, (3e4 * abs(z) / g - 0.8) / 0.2)) if u * z > 0.0 else 0.0
        z_rate = u - x * x * (3.0 - 2.0 * x) * 3e4 * abs(u) / g * z
        return u, (pull - normal * (3e4 * z + 40.0 * fade * z_rate)) / MASS, z_rate

    wanted = solve_ivp(rate, (0, end), [0.0, 0.0, 0.0], method="DOP853", rtol=1e-11, atol=1e-16).y[:, -1]
    errors = [abs(slide(slope, end, h, tilting)[0][-1] - wanted[0]) for h in (1e-4, 5e-5, 2.5e-5)]
    assert errors[-1] < 1e-4 * wanted[0]
    assert errors[0] / errors[2] > 12
