"""Cantilever of finite segments against the elastica, planar and spatial (validation/references.md).

N equal segments, joints EI/l, and half a cell at the clamp, 2EI/l. With L = EI = 1. The exact values are for an inextensible
beam; here EA = GA = 1e8, which is a strain of 1e-7 at the largest load.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from fsm.scene.loads import Load, Ramp
from fsm.scene.scene import GROUND, Body, ForceElement, Scene
from fsm.segments.compile import compile_scene
from fsm.solve.newton import equilibrium

STIFF = 1e8

# a = P L^2/EI: (w/L, u/L, tip angle), by elliptic functions; references.md, agrees with Mattiasson (1981), Int. J. Numer.
# Methods Eng. 17, 145-153
ELASTICA = {
    1.0: (0.3017207738, 0.0564332363, 0.4613519497),
    2.0: (0.4934574804, 0.1606417208, 0.7817498316),
    5.0: (0.7137915236, 0.3876283607, 1.2153681176),
    10.0: (0.8106090249, 0.5549955978, 1.4302855388),
}
COUNTS = (10, 20, 40, 80)


def cantilever(count: int, force: float = 0.0, moment: float = 0.0) -> Scene:
    """Unit cantilever along x with a dead force in z and a moment about y (taking x towards z) at its tip."""
    length = 1.0 / count
    bodies = [
        Body(name=f"{i}", mass=1.0, inertia=(1.0, 1.0, 1.0), position=((i + 0.5) * length, 0.0, 0.0)) for i in range(count)
    ]
    elements = []
    for i in range(count):
        flexible = length if i else length / 2
        elements.append(
            ForceElement(
                name=f"joint {i}",
                inner=f"{i - 1}" if i else GROUND,
                outer=f"{i}",
                point_inner=(length / 2 if i else 0.0, 0.0, 0.0),
                point_outer=(-length / 2, 0.0, 0.0),
                translation=(STIFF / flexible,) * 3,
                rotation=(1 / flexible,) * 3,
            )
        )
    load = Load(
        body=f"{count - 1}",
        point=(length / 2, 0.0, 0.0),
        force=(0.0, 0.0, force),
        moment=(0.0, -moment, 0.0),
        time=Ramp(kind="ramp", end=1.0),
    )
    return Scene(bodies=tuple(bodies), elements=tuple(elements), loads=(load,))


def tip(scene: Scene, spatial: bool, steps: int = 10) -> np.ndarray:
    """x, z and angle (from x towards z, of the last segment) of the tip under the full load."""
    system = compile_scene(scene, spatial)
    assert system.spatial == spatial
    length = 1.0 / len(scene.bodies)
    q = equilibrium(system, system.initial()[0], np.linspace(0.0, 1.0, steps + 1)).reshape(len(scene.bodies), -1)[-1]
    angle = 2 * math.atan2(-q[5], q[3]) if spatial else -q[2]
    z = q[2] if spatial else q[1]
    return np.array([q[0] + length / 2 * math.cos(angle), z + length / 2 * math.sin(angle), angle])


@cache
def deflection(count: int, load: float, spatial: bool = False) -> tuple[float, float, float]:
    x, z, angle = tip(cantilever(count, force=load), spatial)
    return z, 1.0 - x, angle


@pytest.mark.parametrize("load", ELASTICA)
def test_second_order_under_a_tip_force(load: float) -> None:
    errors = np.abs([np.array(deflection(count, load)) - ELASTICA[load] for count in COUNTS])
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.1)
    # and it is the exact values that they go to
    fine, coarse = np.array(deflection(80, load)), np.array(deflection(40, load))
    assert fine + (fine - coarse) / 3 == pytest.approx(ELASTICA[load], abs=3e-7)


@pytest.mark.parametrize("load", ELASTICA)
def test_spatial_under_a_tip_force(load: float) -> None:
    assert deflection(20, load, spatial=True) == pytest.approx(deflection(20, load), abs=1e-8)


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("count", [5, 20])
def test_end_moment_rolls_into_a_circle(count: int, spatial: bool) -> None:
    # 2 pi EI/L: every joint turns by 2 pi/N, the one at the clamp by half of it: a closed polygon for any N
    x, z, angle = tip(cantilever(count, moment=2 * math.pi), spatial, steps=40)
    assert (x, z) == pytest.approx((0.0, 0.0), abs=1e-9)
    exact = 2 * math.pi - math.pi / count
    assert math.remainder(angle - exact, 2 * math.pi) == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize("spatial", [False, True])
def test_one_hinge_turns_past_half_a_turn(spatial: bool) -> None:
    # one segment, half a cell: angle = M l/(2 EI) = 270 degrees
    system = compile_scene(cantilever(1, moment=3 * math.pi), spatial)
    q = equilibrium(system, system.initial()[0], np.linspace(0.0, 1.0, 21))
    assert q[0] == pytest.approx(0.0, abs=1e-9)
    assert q[2 if spatial else 1] == pytest.approx(-0.5, abs=1e-9)
    # M^2/(2 k), k = 2: not that of the 90 degrees the other way round
    energy = system.energy(1.0, q, np.zeros(system.nu)).stored
    assert energy == pytest.approx((3 * math.pi) ** 2 / 4, rel=1e-9)
