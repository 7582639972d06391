"""Faces that are pressed on each other have the force K times their overlap over the smaller face, in the plane and in
space."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fsm.case.models.contact import Contact, Friction
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, Plate, Scene
from fsm.model.compile.compile import compile_scene

STIFFNESS = 3e7
DIMENSIONS = pytest.mark.parametrize("spatial", [False, True], ids=["plane", "space"])
SEEDS = pytest.mark.parametrize("seed", range(6))


def held(name: str, length: float, width: float, thickness: float, top: float = 0.0, x: float = 0.0, y: float = 0.0) -> Body:
    """A plate whose upper face is at a height."""
    outline = Plate(length=length, width=width, thickness=thickness)
    return Body(
        name=name, mass=1.0, inertia=(1.0, 1.0, 1.0), held=True, position=(x, y, top - thickness / 2), plate=outline
    )


def pressed(upper: Body, others: dict[str, Any], second: str, spatial: bool, **more: Any) -> tuple[float, np.ndarray]:
    """Force on a body that is at rest, over K d^1.5 with the depth that it finds, and the force as it is (6,) or (3,)."""
    scene = Scene(pairs=(ContactPair(first=upper.name, second=second),), contact=Contact(stiffness=STIFFNESS))
    scene = scene.model_copy(update={"bodies": (*others.pop("bodies", ()), upper), **others, **more})
    system = compile_scene(scene, spatial)
    q, u = system.initial()
    system.commit(0.0, q, u)
    force = system.force(0.0, q, u)[-(6 if spatial else 3) :]
    depth = -float(system.observe(0.0, q, u).pairs.gap.min())
    return float(force[2 if spatial else 1]) / (STIFFNESS * depth**1.5), force


def upper_plate(length: float, width: float, thickness: float, x: float, y: float, turn: float = 0.0) -> Body:
    depth = 0.01 * thickness
    return Body(
        name="upper", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(x, y, thickness / 2 - depth),
        orientation=(math.cos(turn / 2), 0.0, 0.0, math.sin(turn / 2)),
        plate=Plate(length=length, width=width, thickness=thickness),
    )  # fmt: skip


def sizes(seed: int) -> tuple[np.random.Generator, float, float, float]:
    """Chance, length, width, thickness."""
    rng = np.random.default_rng([seed, 23])
    length = rng.uniform(0.01, 0.5)
    return rng, length, length * rng.uniform(0.2, 1.5), length * rng.uniform(0.005, 0.05)


@DIMENSIONS
@SEEDS
def test_equal_plates(seed: int, spatial: bool) -> None:
    _, length, width, thickness = sizes(seed)
    lower = held("lower", length, width, thickness)
    share, _ = pressed(upper_plate(length, width, thickness, 0.0, 0.0), {"bodies": (lower,)}, "lower", spatial)
    assert share == pytest.approx(1.0, rel=0.01)


@DIMENSIONS
@SEEDS
def test_a_plate_on_a_larger_one(seed: int, spatial: bool) -> None:
    rng, length, width, thickness = sizes(seed)
    factor = 2.0 if seed == 0 else rng.uniform(1.2, 6.0)
    x, y = 0.45 * (factor - 1.0) * rng.uniform(-1.0, 1.0, 2) * [length, width * spatial] * (seed > 0)
    lower = held("lower", factor * length, factor * width, thickness)
    for turn in (0.0, math.pi * spatial):
        upper = upper_plate(length, width, thickness, x, y, turn)
        share, force = pressed(upper, {"bodies": (lower,)}, "lower", spatial)
        assert share == pytest.approx(1.0, rel=0.01)
        # the pressure is uniform, so there is no moment
        assert np.abs(force[[3, 4]] if spatial else force[2]).max() < 1e-3 * length * np.abs(force).max()


@DIMENSIONS
@SEEDS
def test_plates_that_overlap_in_part(seed: int, spatial: bool) -> None:
    rng, length, width, thickness = sizes(seed)
    other = length * rng.uniform(0.6, 1.8), width * rng.uniform(0.6, 1.8)
    if not spatial:
        other = other[0], width
    shift = [rng.uniform(0.1, 0.9) * 0.5 * (length + other[0]), spatial * rng.uniform(0.0, 0.9) * 0.5 * (width + other[1])]
    overlap = math.prod(
        min(a / 2, b / 2 + s) - max(-a / 2, s - b / 2)
        for a, b, s in zip(other, (length, width), shift, strict=True)
    )
    lower = held("lower", *other, thickness)
    share, _ = pressed(upper_plate(length, width, thickness, *shift), {"bodies": (lower,)}, "lower", spatial)
    assert share == pytest.approx(overlap / min(length * width, other[0] * other[1]), rel=0.01)


@pytest.mark.parametrize("turn", [0.1, 0.4, math.pi / 4, 1.2])
def test_turned_square_plates(turn: float) -> None:
    """The overlap of two squares of side a is an octagon, a^2 2/(1 + sin t + cos t)."""
    side, thickness = 0.1, 1e-3
    lower = held("lower", side, side, thickness)
    share, _ = pressed(upper_plate(side, side, thickness, 0.0, 0.0, turn), {"bodies": (lower,)}, "lower", True)
    octagon = 2.0 / (1.0 + math.sin(turn) + math.cos(turn))
    assert share == pytest.approx(octagon, rel=0.01)


@SEEDS
def test_long_plates_that_cross(seed: int) -> None:
    rng, length, _, thickness = sizes(seed)
    width, other = length * rng.uniform(0.03, 0.2), length * rng.uniform(0.03, 0.2)
    lower = held("lower", length, width, thickness)
    upper = upper_plate(length, other, thickness, *(0.4 * length * rng.uniform(-1, 1, 2)), math.pi / 2)
    share, _ = pressed(upper, {"bodies": (lower,)}, "lower", True)
    assert share == pytest.approx(width * other / (length * min(width, other)), rel=0.01)


@DIMENSIONS
@SEEDS
def test_a_box_under_a_plate_and_in_the_middle_of_one(seed: int, spatial: bool) -> None:
    rng, length, width, thickness = sizes(seed)
    small = seed % 2 == 0
    factor = rng.uniform(0.1, 0.8) if small else rng.uniform(1.2, 4.0)
    box = Obstacle(
        name="box", shape="box", size=(factor * length, factor * width, length), position=(0.0, 0.0, -length / 2)
    )
    x = 0.4 * length * abs(1.0 - factor) * rng.uniform(-1, 1)
    share, _ = pressed(upper_plate(length, width, thickness, x, 0.0), {"obstacles": (box,)}, "box", spatial)
    assert share == pytest.approx(1.0, rel=0.01)


@SEEDS
def test_a_cylinder_under_a_plate(seed: int) -> None:
    """A cylinder on its side has contact along its line, and an upright cylinder at its cap."""
    rng, length, _, thickness = sizes(seed)
    radius = length * rng.uniform(0.02, 0.2)
    roll = Obstacle(
        name="roll", shape="cylinder", radius=radius, length=length * rng.uniform(0.45, 0.9), position=(0.0, 0.0, -radius)
    )
    upper = upper_plate(length, 1.1 * length, thickness, 0.3 * length * rng.uniform(-1, 1), 0.0)
    for spatial in (False, True):
        assert pressed(upper, {"obstacles": (roll,)}, "roll", spatial)[0] == pytest.approx(1.0, rel=0.01)
    half = math.sqrt(0.5)
    post = roll.model_copy(update={"orientation": (half, half, 0.0, 0.0), "position": (0.0, 0.0, -roll.length / 2)})  # type: ignore[operator]
    assert pressed(upper, {"obstacles": (post,)}, "roll", True)[0] == pytest.approx(1.0, rel=0.01)


@DIMENSIONS
def test_solids_on_a_plane(spatial: bool) -> None:
    """A box, a cylinder on its side, and one on its cap, fixed to a body."""
    floor = Obstacle(name="floor", shape="plane")
    half = math.sqrt(0.5)
    shapes = {
        "box": Obstacle(name="solid", shape="box", size=(0.1, 0.07, 0.05), body="upper"),
        "side": Obstacle(name="solid", shape="cylinder", radius=0.025, length=0.1, body="upper"),
        "cap": Obstacle(
            name="solid", shape="cylinder", radius=0.04, length=0.05, body="upper", orientation=(half, half, 0.0, 0.0)
        ),
    }
    for kind, shape in shapes.items():
        if kind == "cap" and not spatial:
            continue
        upper = Body(name="upper", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.025 - 1e-5))
        scene = {"obstacles": (shape, floor), "pairs": (ContactPair(first="floor", second="solid"),)}
        assert pressed(upper, scene, "floor", spatial)[0] == pytest.approx(1.0, rel=0.01), kind


# friction ---------------------------------------------------------------------------------------------------------


def mean_arm(length: float, width: float) -> float:
    """Mean distance of a rectangle from its middle, m."""
    x, y = length / 2, width / 2
    r = math.hypot(x, y)
    return (2 * x * y * r + x**3 * math.asinh(y / x) + y**3 * math.asinh(x / y)) / (6 * x * y)


@pytest.mark.parametrize("target", ["plane", "plate", "equal plate", "box"])
@pytest.mark.parametrize("seed", range(3))
def test_friction_torque_of_a_spinning_square_plate(target: str, seed: int) -> None:
    """The friction torque is mu N times the mean arm, 0.3826 sides, within 2 % with the default points."""
    rng, side, _, thickness = sizes(seed)
    mu, factor = 0.3, rng.uniform(1.5, 4.0)
    assert mean_arm(1.0, 1.0) == pytest.approx(0.382598, abs=1e-6)
    upper = upper_plate(side, side, thickness, 0.0, 0.0)
    spinning = upper.model_copy(update={"angular_velocity": (0.0, 0.0, 3.0)})
    friction = Friction(law="tanh", mu_dynamic=mu, v_static=1e-6)
    others: dict[str, Any] = {"obstacles": (Obstacle(name="floor", shape="plane"),)}
    if target == "box":
        size = (factor * side, factor * side, side)
        others = {"obstacles": (Obstacle(name="floor", shape="box", size=size, position=(0.0, 0.0, -side / 2)),)}
    elif target != "plane":
        factor = 1.0 if target == "equal plate" else factor
        others = {"bodies": (held("floor", factor * side, factor * side, thickness),)}
    _, force = pressed(spinning, others, "floor", True, friction=friction)
    assert -force[5] == pytest.approx(mu * force[2] * mean_arm(side, side), rel=0.02)
