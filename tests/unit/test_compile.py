"""The compiled scene omits parts that it does not need, and one message lists all mistakes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fsm.builders.strip import build_strip
from fsm.case.models.case import Case
from fsm.case.models.loads import Drive, Load
from fsm.case.models.scene import Body, ContactPair, ForceElement, Plate, Scene, Surface
from fsm.errors import CaseError
from fsm.model.bodies.loads import GravityGroup, LoadGroup
from fsm.model.compile.compile import compile_scene
from fsm.model.compile.compile_case import compile_case
from fsm.model.contact.contacts import ContactGroup
from fsm.model.elements.creases import CreaseGroup
from fsm.model.elements.elements import BushingGroup
from fsm.model.system.system import SegmentSystem

CONTACT = {"stiffness": 1e6}
FRICTION = {"law": "tanh", "mu_dynamic": 0.2, "v_static": 1e-3}
SPLINE = {"law": "spline", "angle": [0.0, 1.0, 2.0], "moment": [0.0, 5e-3, 8e-3]}


def strip_case(**sections: Any) -> Case:
    strip = {
        "length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": "80 deg", "segments_per_panel": 4,
    }  # fmt: skip
    data: dict[str, Any] = {
        "strip": strip | sections.pop("strip", {}),
        "material": {"young": 3e9, "density": 800} | sections.pop("material", {}),
        "crease": {"law": "linear", "stiffness": 9e-3},
        "drive": [{"crease": 3, "speed": "2 mm/s", "travel": "40 mm"} | sections.pop("pull", {})],
    }
    return Case.model_validate(data | sections)


def compiled(spatial: bool = False, **sections: Any) -> SegmentSystem:
    return compile_scene(build_strip(strip_case(**sections)), spatial)


def kinds(system: SegmentSystem) -> list[type]:
    return [type(group) for group in system.groups]


# left out -----------------------------------------------------------------------------------------------------


def test_a_plain_strip_is_springs_only() -> None:
    system = compiled()
    assert kinds(system) == [BushingGroup]
    assert not system.contacts
    assert system.pair_names == ()


def test_linear_creases_bring_no_spline() -> None:
    assert CreaseGroup not in kinds(compiled())
    assert kinds(compiled(crease=SPLINE)) == [BushingGroup, CreaseGroup]


def test_equal_creases_share_a_curve() -> None:
    (creases,) = (group for group in compiled(crease=SPLINE).groups if isinstance(group, CreaseGroup))
    # creases 1 and 5 have a half segment on one side, creases 2 to 4 on both
    assert creases.curve.tolist() == [0, 1, 1, 1, 0]
    assert len(creases.table.bounds) == 3


def test_contact_only_where_something_can_meet() -> None:
    system = compiled(contact=CONTACT)
    assert kinds(system) == [BushingGroup, ContactGroup]
    assert system.contacts[0].friction is None
    assert compiled(contact=CONTACT | {"pairs": []}).contacts == ()
    # both panels are held, so there are no unknowns
    assert compiled(contact=CONTACT | {"pairs": [[1, 6]]}).contacts == ()
    assert compiled(contact=CONTACT | {"pairs": [[1, 6], [3, 4]]}).pair_names == ("panel 3 - panel 4",)


def test_friction_when_asked_for() -> None:
    system = compiled(contact=CONTACT, friction=FRICTION)
    assert system.contacts[0].friction is not None


def test_loads_and_gravity() -> None:
    load = {"body": "panel 3 segment 1", "force": [0.0, 0.0, 1.0]}
    assert kinds(compiled(load=[load], gravity=[0.0, 0.0, -9.81])) == [BushingGroup, LoadGroup, GravityGroup]


def test_degrees_of_freedom() -> None:
    planar, spatial = compiled(), compiled(spatial=True)
    # 4 panels of 4 segments; panels 1 and 6 are held, the crease line is driven
    assert (planar.nq, planar.nu) == (16 * 3, 16 * 3)
    assert (spatial.nq, spatial.nu) == (16 * 7, 16 * 6)
    free = [planar.bodies.names[i] for i in planar.bodies.free]
    assert not {"ground", "panel 1", "panel 6", "crease 3"} & set(free)
    assert compiled(strip={"held": [1]}).nu == 20 * 3


@pytest.mark.parametrize(
    "sections",
    [
        {"pull": {"guide": False}},
        {"pull": {"direction": [0.0, 0.1, 1.0]}},
        {"gravity": [0.0, 1.0, 0.0]},
        {"load": [{"body": "panel 3 segment 1", "force": [0.0, 1.0, 0.0]}]},
        {"load": [{"body": "panel 3 segment 1", "moment": [1.0, 0.0, 0.0]}]},
    ],
    ids=["unguided", "drive", "gravity", "force", "moment"],
)
def test_what_leaves_the_plane_gets_six(sections: dict[str, Any]) -> None:
    assert compiled(**sections).size == 6


def test_starts_at_rest_and_in_the_same_place_in_both_dimensions() -> None:
    for sections in ({}, {"crease": SPLINE}, {"contact": CONTACT}):
        planar, spatial = compiled(**sections), compiled(spatial=True, **sections)
        for system in (planar, spatial):
            assert np.abs(system.force(0.0, *system.initial())).max() < 1e-8
        np.testing.assert_allclose(
            planar.shape(0.0, planar.initial()[0]), spatial.shape(0.0, spatial.initial()[0]), atol=1e-15
        )


def test_planar_and_spatial_agree_on_a_bent_strip() -> None:
    """The same deformed strip, built in two ways: forces, energy and reaction."""
    planar, spatial = (
        compiled(dimension, crease=SPLINE, contact=CONTACT | {"damping": 1.0}, friction=FRICTION)
        for dimension in (False, True)
    )
    rng = np.random.default_rng(4)
    step = rng.normal(size=(planar.n_free, 3)) * [1e-5, 1e-5, 1e-2]
    speed = rng.normal(size=(planar.n_free, 3)) * [1e-2, 1e-2, 1.0]
    lifted = [np.zeros((planar.n_free, 6)) for _ in range(2)]
    for flat, full in zip((step, speed), lifted, strict=True):
        full[:, [0, 2, 4]] = flat
    q = planar.retract(planar.initial()[0], step.ravel())
    p = spatial.retract(spatial.initial()[0], lifted[0].ravel())
    force = planar.force(2.0, q, speed.ravel()).reshape(-1, 3)
    full = spatial.force(2.0, p, lifted[1].ravel()).reshape(-1, 6)
    np.testing.assert_allclose(full[:, [0, 2, 4]], force, rtol=1e-9, atol=1e-9 * np.abs(force).max())
    np.testing.assert_allclose(full[:, [1, 3, 5]], 0.0, atol=1e-9 * np.abs(force).max())
    seen = planar.observe(2.0, q, speed.ravel()), spatial.observe(2.0, p, lifted[1].ravel())
    assert seen[0].drive.force == pytest.approx(seen[1].drive.force, rel=1e-9)
    assert seen[0].energy.stored == pytest.approx(seen[1].energy.stored, rel=1e-9)
    assert seen[0].energy.dissipated_power == pytest.approx(seen[1].energy.dissipated_power, rel=1e-9)


# faults -------------------------------------------------------------------------------------------------------


def faults_of(scene: Scene) -> list[str]:
    with pytest.raises(CaseError) as caught:
        compile_scene(scene)
    return [str(fault) for fault in caught.value.faults]


def body(name: str, **changes: Any) -> Body:
    return Body(**({"name": name, "mass": 1.0, "inertia": (1.0, 1.0, 1.0)} | changes))


def test_all_faults_at_once() -> None:
    scene = Scene(
        bodies=(
            body("arm"),
            body("arm"),
            body("leg", orientation=(1.0, 0.1, 0.0, 0.0)),
            body("post", held=True, mass=0.0),
            body("head", mass=0.0),
            body("tail", inertia=(0.0, 1.0, 1.0)),
            body("wing", inertia=(1.0, 1.0, 5.0)),
            body("ground"),
        ),
        elements=(
            ForceElement(name="j", inner="arn", outer="leg"),
            ForceElement(name="k", inner="leg", outer="leg"),
        ),
        surfaces=(Surface(name="top", bodies=("leg",)), Surface(name="none", bodies=())),
        pairs=(ContactPair(first="top", second="topp"),),
        loads=(Load(body="haed", force=(1.0, 0.0, 0.0)),),
        drives=(
            Drive(body="post", speed=1.0, travel=1.0),
            Drive(body="arm", speed=1.0, travel=1.0),
            Drive(body="arm", speed=1.0, travel=1.0),
            Drive(crease=2, speed=1.0, travel=1.0),
        ),
    )
    faults = faults_of(scene)
    for wanted in (
        "scene.bodies: the name 'arm' is used 2 times",
        "scene.bodies.2.orientation: the quaternion has norm 1.00499; the norm must be 1 within 1e-6",
        "scene.bodies.4.mass: 0 kg of a body that can move ('head')",
        "scene.bodies.5.inertia: (0.0, 1.0, 1.0) kg m^2 of 'tail'; all three must be positive",
        "scene.bodies.6.inertia: (1.0, 1.0, 5.0) kg m^2: one moment exceeds the sum of the others",
        "scene.bodies.7.name: 'ground' is the fixed body",
        "scene.elements.0.inner: no body is called 'arn'; did you mean 'arm'?",
        "scene.elements.1: joins 'leg' to itself",
        "scene.surfaces.0.bodies: body 'leg' has no plate",
        "scene.surfaces.1.bodies: the list is empty; give at least one body",
        "scene.pairs.0.second: no body, surface or obstacle is called 'topp'; did you mean 'top'?",
        "load.0.body: no body is called 'haed'; did you mean 'head'?",
        "drive.0.body: 'post' is held; a held body cannot be driven",
        "drive: 'arm' is driven 2 times",
        "drive.3.crease: a scene without a strip has no numbered creases",
    ):
        assert any(fault.startswith(wanted) for fault in faults), (wanted, faults)
    assert not any("'post'" in fault and "mass" in fault for fault in faults)  # held: it needs none


def test_an_empty_scene_is_refused() -> None:
    assert faults_of(Scene()) == ["scene.bodies: the scene has no bodies; give at least one"]


def test_a_faultless_scene_has_no_faults() -> None:
    plate = Plate(length=0.1, width=0.1, thickness=1e-3)
    scene = Scene(bodies=(body("arm", plate=plate), body("post", held=True)))
    assert compile_scene(scene).nu == 3


def test_a_crease_that_would_snap_is_a_fault_of_the_case() -> None:
    """The half segments beside a crease cannot follow it if it softens too fast; a message names the crease."""
    steep = {"law": "spline", "angle": [0.0, 0.5, 0.6], "moment": [0.0, 0.5, 0.0]}
    with pytest.raises(CaseError) as caught:
        compiled(crease=steep, strip={"segments_per_panel": 1})
    (fault,) = caught.value.faults
    assert fault.path == "crease.data"
    assert "deg the tangent stiffness of the crease is -" in fault.message
    assert "half_cell = false" in fault.message
    assert compiled(crease=steep, strip={"segments_per_panel": 1, "half_cell": False}).nu > 0


def test_initial_overlap_is_refused() -> None:
    case = strip_case(contact=CONTACT, strip={"fold_angle": "89.9 deg"})
    with pytest.raises(CaseError, match=r"panel 1 and panel 2 overlap at the start by 0\.2302 mm"):
        compile_case(case, "case.toml")
    thin = CONTACT | {"thickness_in_gap": False}
    assert compile_case(strip_case(contact=thin, strip={"fold_angle": "89.9 deg"}))[1].nu > 0
    assert compile_case(strip_case(strip={"fold_angle": "89.9 deg"}))[1].nu > 0


# known faults: the docstrings of the scene describe this, and the compiler does not do it yet --------------------


def test_a_crease_law_on_a_hand_made_element() -> None:
    """Moment M = 2 psi about a hinge turned by 0.5 rad."""
    assert turned_body_force() == pytest.approx([0.0, 0.0, -1.0])


def test_a_crease_law_stands_instead_of_the_twist_spring() -> None:
    with pytest.raises(CaseError, match=r"elements\.0\.rotation\.1: 3 N m/rad is not used beside `crease`"):
        turned_body_force(rotation=(0.0, 3.0, 0.0))


def turned_body_force(**changes: Any) -> np.ndarray:
    turned = body("arm", orientation=(np.cos(0.25), 0.0, np.sin(0.25), 0.0))
    law = {"law": "linear", "stiffness": 2.0}
    hinge = ForceElement(name="hinge", inner="arm", outer="ground", crease=law, initial_angle=0.5, **changes)
    system = compile_scene(Scene(bodies=(turned,), elements=(hinge,)))
    return system.force(0.0, *system.initial())


def test_a_damper_without_a_spring_damps() -> None:
    damper = ForceElement(name="damper", inner="arm", outer="ground", translation_damping=(5.0, 5.0, 5.0))
    system = compile_scene(Scene(bodies=(body("arm", velocity=(1.0, 0.0, 0.0)),), elements=(damper,)))
    assert system.force(0.0, *system.initial()) == pytest.approx([-5.0, 0.0, 0.0])


@pytest.mark.parametrize(
    "rest",
    [
        0.5,
        0.0,
        -0.1,
    ],
)
def test_moment_of_a_folded_crease_is_that_of_its_curve(rest: float) -> None:
    """At an opening of rest - 160 deg the curve is continued linearly; the linear law with this slope and offset agrees."""
    curve = {"law": "spline", "angle": [-1.0, 0.0, 1.0], "moment": [-8e-3, 0.0, 2e-3], "rest_angle": rest}
    system = compiled(crease=curve, strip={"half_cell": False})
    (creases,) = (group for group in system.groups if isinstance(group, CreaseGroup))
    # not-a-knot through three points is a parabola: slope -3e-3 * 2 o + 5e-3 at o, 11e-3 at -1
    opening = rest - np.radians(160)
    moment = -8e-3 + 11e-3 * (opening + 1.0)
    force = system.force(0.0, *system.initial()).reshape(-1, 3)
    # the first free segment is joined to crease 1, whose fold is a rotation by -160 degrees
    assert creases.bodies[0].tolist() == [1, int(system.bodies.free[0])]
    assert abs(force[0, 2]) == pytest.approx(abs(moment), rel=1e-9)
