"""Springs, masses, weight and contact probes of a strip's segments, against a strip of elastic material."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fsm.builders.strip import build_strip
from fsm.case.models.case import Case
from fsm.case.models.contact import Contact
from fsm.case.models.scene import Body, ContactPair, Plate, Scene, Surface
from fsm.interactions.quadrature import gauss_lobatto
from fsm.model.compile.compile import compile_scene
from fsm.model.contact.surfaces.panel_points import PanelPoints

LENGTH, WIDTH, THICKNESS, SEGMENTS = 0.08, 0.04, 3e-4, 5
YOUNG, POISSON, DENSITY = 3e9, 0.3, 800.0
AREA = WIDTH * THICKNESS


def scene(plate: bool = False, **sections: Any) -> Scene:
    return build_strip(
        Case.model_validate(
            {
                "strip": {
                    "length": 6 * LENGTH, "width": WIDTH, "thickness": THICKNESS, "panels": 6,
                    "fold_angle": math.radians(80), "segments_per_panel": SEGMENTS,
                },
                "material": {"young": YOUNG, "poisson": POISSON, "density": DENSITY, "plate": plate},
                "crease": {"law": "linear", "stiffness": 9e-3},
                "drive": [{"crease": 3, "speed": "2 mm/s", "travel": "40 mm"}],
            }
            | sections
        )
    )  # fmt: skip


def test_springs_of_a_panel_are_those_of_a_strip() -> None:
    """Stretch EA, shear 5/6 GA, torsion G w t^3/3 (thin), bending E w t^3/12 and, in its plane, E t w^3/12."""
    shear = YOUNG / (2 * (1 + POISSON))
    joints = [e for e in scene().elements if e.kind == "panel"]
    assert len(joints) == 4 * (SEGMENTS - 1)
    for joint in joints:
        springs = LENGTH / SEGMENTS * np.array([*joint.translation, *joint.rotation])
        np.testing.assert_allclose(springs[0], YOUNG * AREA, rtol=1e-12, err_msg="stretch")
        np.testing.assert_allclose(springs[1:3], 5 / 6 * shear * AREA, rtol=1e-12, err_msg="shear")
        np.testing.assert_allclose(springs[3], shear * WIDTH * THICKNESS**3 / 3, rtol=1e-12, err_msg="torsion")
        np.testing.assert_allclose(springs[4], YOUNG * WIDTH * THICKNESS**3 / 12, rtol=1e-12, err_msg="bending")
        np.testing.assert_allclose(springs[5], YOUNG * THICKNESS * WIDTH**3 / 12, rtol=1e-12, err_msg="in its plane")


def test_plates_bend_with_poissons_ratio() -> None:
    bending = [[e.rotation[1] for e in scene(plate).elements if e.kind == "panel"] for plate in (False, True)]
    np.testing.assert_allclose(np.divide(*bending), 1 - POISSON**2, rtol=1e-12)


def test_inertia_of_segments_is_that_of_boxes() -> None:
    """And the stiffness of the segments of a panel, transformed to its middle, is that of the panel."""
    panel = [body for body in scene().bodies if body.panel == 2]
    assert len(panel) == SEGMENTS
    mass = sum(body.mass for body in panel)
    assert mass == pytest.approx(DENSITY * AREA * LENGTH, rel=1e-12)
    middle = np.mean([body.position for body in panel], axis=0)
    carried = sum(body.inertia[1] + body.mass * float(np.sum((body.position - middle) ** 2)) for body in panel)
    assert carried == pytest.approx(mass / 12 * (LENGTH**2 + THICKNESS**2), rel=1e-12)
    assert sum(body.inertia[0] for body in panel) == pytest.approx(mass / 12 * (WIDTH**2 + THICKNESS**2), rel=1e-12)


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("count", [2, 3, 4])
def test_probes_of_a_panel_add_up_to_its_face(count: int, spatial: bool) -> None:
    """Held panels (one long plate) and those of segments, each with its length and area."""
    made = scene()
    for number in (1, 2):
        bodies = [body for body in made.bodies if body.panel == number]
        points = PanelPoints.of(np.arange(len(bodies)), bodies, LENGTH / SEGMENTS, gauss_lobatto(count), spatial)
        assert points.weight.sum() == pytest.approx(LENGTH, rel=1e-12)
        assert points.area.sum() == pytest.approx(LENGTH * WIDTH, rel=1e-12)


@pytest.mark.parametrize("spatial", [False, True])
def test_weight_acts_along_gravity(spatial: bool) -> None:
    """What falls by h along gravity gains m g h and loses it in potential energy."""
    gravity, fall = np.array([0.3, 0.0, -9.0]), 1e-3
    with_weight, without = (compile_scene(scene(**more), spatial) for more in ({"gravity": gravity.tolist()}, {}))
    q, u = with_weight.initial()
    force = with_weight.force(0.0, q, u) - without.force(0.0, q, u)
    step = np.zeros(with_weight.nu).reshape(-1, 6 if spatial else 3)
    along = gravity / np.linalg.norm(gravity)
    step[:, : 3 if spatial else 2] = fall * (along if spatial else along[[0, 2]])
    gained = float(force @ step.ravel())
    mass = 4 * DENSITY * AREA * LENGTH
    assert gained == pytest.approx(mass * float(np.linalg.norm(gravity)) * fall, rel=1e-9)
    energies = [with_weight.energy(0.0, at, u).potential["gravity"] for at in (q, with_weight.retract(q, step.ravel()))]
    assert energies[0] - energies[1] == pytest.approx(gained, rel=1e-9)


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("segments", [2, 3, 5])
def test_panels_that_lie_on_each_other_have_the_stiffness_of_one_face(segments: int, spatial: bool) -> None:
    """K d^1.5 acts once, although both panels have contact points."""
    stiffness, depth, thickness = 1e7, 1e-5, 1e-3

    def row(name: str, count: int, height: float) -> list[Body]:
        plate = Plate(length=LENGTH / count, width=WIDTH, thickness=thickness)
        places = LENGTH * ((np.arange(count) + 0.5) / count - 0.5)
        return [
            Body(name=f"{name} {k}", mass=0.01, inertia=(1e-6,) * 3, position=(float(x), 0.0, height), plate=plate)
            for k, x in enumerate(places)
        ]

    lower, upper = row("lower", segments, 0.0), row("upper", segments, 2 * thickness)
    faces = [Surface(name=part[0].name.split()[0], bodies=tuple(body.name for body in part)) for part in (lower, upper)]
    system = compile_scene(
        Scene(
            bodies=(*lower, *upper), surfaces=tuple(faces), pairs=(ContactPair(first="lower", second="upper"),),
            contact=Contact(stiffness=stiffness),
        ),
        spatial,
    )  # fmt: skip
    q, u = system.initial()
    step = np.zeros(system.nu).reshape(-1, 6 if spatial else 3)
    step[len(lower) :, 2 if spatial else 1] = -thickness - depth
    force = system.observe(0.0, system.retract(q, step.ravel()), u).pairs.force
    assert force == pytest.approx([stiffness * depth**1.5], rel=1e-9)
