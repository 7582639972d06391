"""Angles of elements given in a scene: they are taken from the placed bodies, and refused if they contradict these."""

import math
from typing import Any

import numpy as np
import pytest

from fsm.case.models.scene import Body, ForceElement, Scene
from fsm.errors import CaseError
from fsm.model.compile.compile import compile_scene

CURVE = {"law": "spline", "interpolation": "pchip", "angle": [-4.0, 0.0, 4.0], "moment": [-4.0, 0.0, 12.0]}
LINEAR = {"law": "linear", "stiffness": 2.0}


def moment(turn: float, spatial: bool = False, **changes: Any) -> float:
    """Moment about +y on the inner body, turned by `turn` against the ground."""
    arm = Body(
        name="arm", mass=1.0, inertia=(1.0, 1.0, 1.0), orientation=(math.cos(turn / 2), 0.0, math.sin(turn / 2), 0.0)
    )
    hinge = ForceElement(**{"name": "hinge", "inner": "arm", "outer": "ground", **changes})
    system = compile_scene(Scene(bodies=(arm,), elements=(hinge,)), spatial)
    force = system.force(0.0, *system.initial())
    return float(force[4] if spatial else force[2])


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("turn", [-2.5, -0.4, 0.0, 0.4, 2.5])
def test_the_rest_angle_of_the_crease_counts_on_the_side_of_the_fold(turn: float, spatial: bool) -> None:
    rest = math.copysign(1.0, turn)
    assert moment(turn, spatial, crease=LINEAR | {"rest_angle": 1.0}) == pytest.approx(2.0 * (rest - turn))


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("turn", [-2.5, -0.4, 0.4, 2.5])
def test_without_an_initial_angle_a_curve_opens_towards_flat(turn: float, spatial: bool) -> None:
    """The curve is not odd: its sign must agree with the direction of the fold."""
    given = moment(turn, spatial, crease=CURVE | {"rest_angle": 1.0}, initial_angle=turn)
    assert moment(turn, spatial, crease=CURVE | {"rest_angle": 1.0}) == pytest.approx(given, rel=1e-12)
    mirrored = moment(-turn, spatial, crease=CURVE | {"rest_angle": 1.0})
    assert mirrored == pytest.approx(-given, rel=1e-12)


def test_initial_angles_that_contradict_the_bodies_are_refused() -> None:
    dice = np.random.default_rng(20261123)
    for turn in dice.uniform(-3.0, 3.0, 20):
        assert moment(turn, crease=LINEAR, initial_angle=turn + 1e-5) == pytest.approx(-2.0 * turn)
        for wrong in (-turn, turn + 0.01, turn + math.pi):
            with pytest.raises(CaseError, match="the bodies as placed make it"):
                moment(turn, crease=LINEAR, initial_angle=wrong)
        for turns in (-2, 2):
            with pytest.raises(CaseError, match="more than half a turn"):
                moment(turn, rotation=(0.0, 1.0, 0.0), initial_angle=turn + turns * math.pi)


def test_a_closed_crease_may_say_its_side() -> None:
    for side in (-math.pi, math.pi):
        assert moment(math.pi, crease=LINEAR, initial_angle=side) == pytest.approx(-2.0 * side)


def test_a_wound_spring_is_a_rest_angle() -> None:
    assert moment(0.0, rotation=(0.0, 1.0, 0.0), rest_angle=6 * math.pi) == pytest.approx(6 * math.pi)
    with pytest.raises(CaseError, match="rest_angle: 1080 deg of a crease; it must be between -180 deg and 180 deg"):
        moment(0.0, crease=LINEAR, rest_angle=6 * math.pi)


def test_two_rest_angles_must_be_one() -> None:
    assert moment(-0.4, crease=LINEAR | {"rest_angle": 1.0}, rest_angle=-1.0) == pytest.approx(-1.2)
    with pytest.raises(CaseError, match=r"is a twist of -57\.296 deg .* the element has `rest_angle` 57\.296 deg"):
        moment(-0.4, crease=LINEAR | {"rest_angle": 1.0}, rest_angle=1.0)
