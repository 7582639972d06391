"""Axes in which elements measure their swing: half-way between both bodies, or, of hinges and creases, the outer one's."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fsm.case.models.loads import Load
from fsm.case.models.materials import LinearCrease
from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.model.compile.compile import compile_scene
from fsm.model.elements.elements import BushingGroup
from fsm.solve.equations.newton import equilibrium

ELASTIC: dict[str, Any] = {"rotation": (3.0, 1.0, 2.0)}
HINGE: dict[str, Any] = {"rotation": (3.0, 0.0, 2.0)}


def compiled(**given: Any) -> BushingGroup:
    body = Body(name="body", mass=1.0, inertia=(1.0, 1.0, 1.0))
    element = ForceElement(name="joint", inner=GROUND, outer="body", **{"translation": (1.0, 1.0, 1.0)} | given)
    groups = compile_scene(Scene(bodies=(body,), elements=(element,)), True).groups
    return next(group for group in groups if isinstance(group, BushingGroup))


@pytest.mark.parametrize(
    ("given", "half_way"),
    [
        (ELASTIC, True),
        (ELASTIC | {"kind": "panel"}, True),
        (ELASTIC | {"swing_axes": "outer"}, False),
        (ELASTIC | {"kind": "crease"}, False),
        (ELASTIC | {"kind": "drive"}, False),
        (HINGE | {"crease": LinearCrease(stiffness=1.0)}, False),
        (HINGE | {"crease": LinearCrease(stiffness=1.0), "swing_axes": "half-way"}, True),
        ({"rotation": (0.0, 0.0, 2.0)}, False),  # a universal joint
        (HINGE, False),
    ],
)
def test_elastic_joints_are_half_way(given: dict[str, Any], half_way: bool) -> None:
    assert compiled(**given).geometry[5].tolist() == [half_way]


def test_a_folded_joint_is_not() -> None:
    """Its half-way axes are far from those of either panel."""
    quarter = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
    folded = compiled(**ELASTIC, initial_angle=0.5 * math.pi, axes_inner=quarter)
    assert folded.geometry[5].tolist() == [False]


@pytest.mark.parametrize(("axes", "along"), [("outer", 1.0), ("half-way", 0.8)])
def test_which_axis_a_universal_joint_is_free_about(axes: str, along: float) -> None:
    """With psi held at 74 degrees and s3 at zero, a moment about the ground's x axis turns the body about the axis of s1."""
    psi, moment = math.acos(0.28), 1e-3
    body = Body(name="body", mass=1.0, inertia=(1.0, 1.0, 1.0))
    joint = ForceElement(
        name="joint", inner="body", outer=GROUND, translation=(1e3,) * 3, rotation=(1.0, 1e6, 1e6), rest_angle=psi,
        swing_axes=axes,  # type: ignore[arg-type]
    )  # fmt: skip
    start = (math.cos(psi / 2), 0.0, math.sin(psi / 2), 0.0)
    turned = body.model_copy(update={"orientation": start})
    # a moment about the ground's x axis, in body axes
    in_body = (moment * math.cos(psi), 0.0, moment * math.sin(psi))
    scene = Scene(bodies=(turned,), elements=(joint,), loads=(Load(body="body", moment=in_body, follower=True),))
    system = compile_scene(scene, True)
    q = equilibrium(system, system.initial()[0], np.array([0.0]))
    x, _, z = q[4:7]
    # vector part of (turned from the start, in axes of the ground)
    c, s = start[0], -start[2]
    swing = 2.0 * np.array([x * c - z * s, 0.0, z * c + x * s])
    # outer: about x; half-way: about the axis at psi/2 from it, which the moment is turned by acos(.8) from
    assert np.linalg.norm(swing) == pytest.approx(moment * along, rel=1e-3)
