"""Cantilever of finite segments compared with the elastica, in the plane and in space (validation/references.md).

N equal segments, joints EI/l, and half a cell at the clamp, 2EI/l. With L = EI = 1. The exact values are for an inextensible
beam; here EA = GA = 1e8, which is a strain of 1e-7 at the largest load.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from fsm.model.compile.compile import compile_scene
from fsm.solve.equations.newton import equilibrium
from validation.closed_forms.beams import ELASTICA
from validation.closed_forms.chains import cantilever, tip

COUNTS = (10, 20, 40, 80)


@cache
def deflection(count: int, load: float, spatial: bool = False) -> tuple[float, float, float]:
    x, z, angle = tip(cantilever(count, force=load), spatial)
    return z, 1.0 - x, angle


@pytest.mark.parametrize("load", ELASTICA)
def test_second_order_under_a_tip_force(load: float) -> None:
    errors = np.abs([np.array(deflection(count, load)) - ELASTICA[load] for count in COUNTS])
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.1)
    # the values converge to the exact values
    fine, coarse = np.array(deflection(80, load)), np.array(deflection(40, load))
    assert fine + (fine - coarse) / 3 == pytest.approx(ELASTICA[load], abs=3e-7)


@pytest.mark.parametrize("load", ELASTICA)
def test_spatial_under_a_tip_force(load: float) -> None:
    assert deflection(20, load, spatial=True) == pytest.approx(deflection(20, load), abs=1e-8)


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("count", [5, 20])
def test_end_moment_rolls_into_a_circle(count: int, spatial: bool) -> None:
    # 2 pi EI/L: every joint rotates by 2 pi/N, and the joint at the clamp by half of this; the result is a closed polygon
    # for any N
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
    # the energy M^2/(2 k), k = 2, differs from that of a rotation by 90 degrees in the other direction
    energy = system.energy(1.0, q, np.zeros(system.nu)).stored
    assert energy == pytest.approx((3 * math.pi) ** 2 / 4, rel=1e-9)
