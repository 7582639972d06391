"""Obstacles and pairs of plates in a scene and in a case: accepted input, and the contacts that follow from it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from fsm.builders.scene import build_scene
from fsm.builders.strip import build_strip
from fsm.case.derived.contact_points import pairs_by_geometry
from fsm.case.derived.planar import out_of_plane
from fsm.case.loading.load_case import read_case
from fsm.case.models.case import Case
from fsm.case.models.contact import Contact
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, ForceElement, Plate, Scene, Surface
from fsm.interactions.shapes.shape_distance import BOX, CYLINDER, HALF_SPACE, SPHERE
from fsm.model.compile.compile_shapes import compile_shapes
from fsm.model.contact.touching import Touching
from fsm.model.faults.check_scene import check_scene

CONTACT = Contact(stiffness=1e6)
STRIP: dict[str, Any] = {
    "strip": {
        "length": 0.24, "width": 0.04, "thickness": 3e-4, "panels": 4, "fold_angle": "80 deg", "segments_per_panel": 2,
        "held": [1],
    },
    "material": {"young": 3e9, "density": 800},
    "crease": {"law": "linear", "stiffness": 9e-3},
    "contact": {"stiffness": 1e6},
    "obstacle": [{"name": "floor", "shape": "plane", "position": [0, 0, "-1 mm"]}],
    "solve": {"end_time": 1.0},
}  # fmt: skip


def plate(name: str, x: float = 0.0, z: float = 0.0, **more: Any) -> Body:
    outline = Plate(length=0.1, width=0.05, thickness=1e-3)
    return Body(name=name, mass=1.0, inertia=(1.0, 1.0, 1.0), position=(x, 0.0, z), plate=outline, **more)


def placed(scene: Scene, spatial: bool) -> tuple[tuple[Body, ...], np.ndarray]:
    """All bodies with the ground, and their poses; none is turned."""
    bodies = (Body(name="ground", mass=0.0, inertia=(0.0, 0.0, 0.0), held=True), *scene.bodies)
    if spatial:
        return bodies, np.array([[*body.position, *body.orientation] for body in bodies])
    return bodies, np.array([[body.position[0], body.position[2], 0.0] for body in bodies])


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"shape": "box"}, "a box requires `size`"),
        ({"shape": "box", "size": [1, 1, 1], "radius": 2}, "a box has no `radius`"),
        ({"shape": "cylinder", "radius": 1}, "a cylinder requires `length`"),
        ({"shape": "sphere", "radius": 1, "length": 1}, "a sphere has no `length`"),
        ({"shape": "plane", "size": [1, 1, 1]}, "a plane has no `size`"),
        ({"shape": "sphere", "radius": -1}, "greater than 0"),
    ],
)
def test_sizes_must_fit_the_shape(keys: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        Obstacle.model_validate({"name": "x", **keys})


def test_faults_of_a_scene_name_what_is_wrong() -> None:
    scene = Scene(
        bodies=(plate("a"), plate("b", z=1.0), Body(name="bare", mass=1.0, inertia=(1.0, 1.0, 1.0))),
        surfaces=(Surface(name="face", bodies=("a",)),),
        obstacles=(
            Obstacle(name="a", shape="plane"),
            Obstacle(name="hub", shape="sphere", radius=1.0, body="bb"),
            Obstacle(name="hub", shape="plane", orientation=(1.0, 1.0, 0.0, 0.0)),
            Obstacle(name="cap", shape="plane", body="b"),
        ),
        pairs=(
            ContactPair(first="face", second="hb"),
            ContactPair(first="bare", second="b"),
            ContactPair(first="hub", second="cap"),
            ContactPair(first="b", second="cap"),
            ContactPair(first="face", second="a"),
            ContactPair(first="a", second="b", shared="end-start"),
        ),
        contact=CONTACT,
    )
    faults = {fault.path: fault.message for fault in check_scene(scene)}
    assert faults["scene.obstacles.0.name"].startswith("'a' is a body or a surface already")
    assert faults["scene.obstacles.1.body"] == "no body is called 'bb'; did you mean 'b'?"
    assert faults["scene.obstacles.1.name"] == "'hub' is used 2 times; names must differ"
    assert faults["scene.obstacles.2.orientation"] == "the quaternion has norm 1.41421; the norm must be 1 within 1e-6"
    assert faults["scene.pairs.0.second"] == "no body, surface or obstacle is called 'hb'; did you mean 'hub'?"
    assert faults["scene.pairs.1.first"] == "body 'bare' has no plate, so it has no face to touch"
    assert faults["scene.pairs.2"].startswith("obstacles 'hub' and 'cap': a plane and a plane do not touch")
    assert faults["scene.pairs.3"] == "'b' and 'cap' are both part of body 'b': they cannot touch"
    assert faults["scene.pairs.4"] == "'face' and 'a' are both part of body 'a': they cannot touch"
    assert faults["scene.pairs.5.shared"] == "only two surfaces share a crease or a chain; remove this key"
    good = scene.model_copy(
        update={"obstacles": (Obstacle(name="floor", shape="plane"),), "pairs": (ContactPair(first="face", second="floor"),)}
    )
    assert not check_scene(good)


def test_an_obstacle_can_lie_out_of_the_plane() -> None:
    def reasons(**keys: Any) -> list[str]:
        return out_of_plane(Scene(bodies=(plate("a"),), obstacles=(Obstacle(name="o", **keys),)))

    assert not reasons(shape="cylinder", radius=1.0, length=1.0)
    assert not reasons(shape="plane", position=(0.0, 3.0, 0.0))
    assert not reasons(shape="sphere", radius=1.0, orientation=(0.0, 1.0, 0.0, 0.0))
    assert "not centred" in reasons(shape="sphere", radius=1.0, position=(0.0, 0.1, 0.0))[0]
    assert "rotated" in reasons(shape="plane", orientation=(0.8, 0.6, 0.0, 0.0))[0]


def test_a_strip_watches_every_panel_that_moves_against_an_obstacle() -> None:
    scene = build_strip(Case.model_validate(STRIP))
    assert not check_scene(scene)
    watched = [pair.first for pair in scene.pairs if pair.second == "floor"]
    assert watched == ["panel 2", "panel 3", "panel 4"]
    case, faults = read_case(STRIP, None)  # type: ignore[arg-type]
    assert not faults
    assert case is not None
    assert case.obstacle[0].position == (0.0, 0.0, -1e-3)


def test_an_obstacle_needs_contact() -> None:
    data = {name: value for name, value in STRIP.items() if name != "contact"}
    _, faults = read_case(data, None)  # type: ignore[arg-type]
    assert [fault.path for fault in faults] == ["obstacle"]


def test_obstacles_of_a_case_go_to_its_scene() -> None:
    scene = {"bodies": [plate("a").model_dump()]}
    case = Case.model_validate({"scene": scene, "obstacle": [{"name": "ball", "shape": "sphere", "radius": "2 mm"}]})
    assert build_scene(case).obstacles[0].radius == 2e-3


@pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
def test_pairs_become_geometries(spatial: bool) -> None:
    """Plates with plates, and the segments of a surface with obstacles, each with its part of the load."""
    scene = Scene(
        bodies=(plate("a"), plate("b", z=0.9e-3), plate("c", x=0.1), plate("d", x=0.5, held=True)),
        elements=(ForceElement(name="hinge", inner="a", outer="c"),),
        surfaces=(Surface(name="row", bodies=("a", "c")), Surface(name="other", bodies=("b",))),
        obstacles=(
            Obstacle(name="floor", shape="plane", position=(0.0, 0.0, -0.4e-3)),
            Obstacle(name="box", shape="box", size=(0.2, 0.4, 0.6), position=(3.0, 0.0, 0.0)),
            Obstacle(name="roll", shape="cylinder", radius=0.3, length=0.8, position=(6.0, 0.0, 0.0)),
            Obstacle(name="ball", shape="sphere", radius=0.2, position=(9.0, 0.0, 0.0)),
        ),
        pairs=(
            ContactPair(first="row", second="other", shared="none"),
            ContactPair(first="a", second="b"),
            ContactPair(first="floor", second="row"),
            ContactPair(first="a", second="c"),
            ContactPair(first="d", second="box"),
        ),
        contact=CONTACT,
    )
    assert not check_scene(scene)
    bodies, poses = placed(scene, spatial)
    given = Touching(scene, bodies, poses, spatial, tuple(pairs_by_geometry(scene)["shapes"]))
    plates, obstacles = compile_shapes(given)
    touching = plates.find(poses, 0.0)
    # a and c overlap at their hinge, but have no contact there
    points = touching.slot < len(plates.tables.points.body)
    assert set(plates.pair[touching.slot]) == {1}
    assert plates.share[touching.slot].sum() == pytest.approx(1.0)
    np.testing.assert_allclose(touching.gap[points], -1e-4, atol=1e-15)
    floor = obstacles.find(poses, 0.0)
    assert set(obstacles.pair[floor.slot]) == {2}
    assert obstacles.share[floor.slot].sum() == pytest.approx(1.0)
    np.testing.assert_allclose(floor.gap, -1e-4, atol=1e-15)
    assert set(obstacles.pair) == {2}  # no body of the last pair can move
    kinds, sizes = obstacles.tables.shapes.kind[-4:], obstacles.tables.shapes.size[-4:]
    np.testing.assert_array_equal(kinds, [HALF_SPACE, BOX, CYLINDER, SPHERE])
    across = [0.2, 0.4] if spatial else [np.inf, np.inf]
    np.testing.assert_allclose(sizes[1:], [[0.1, across[0], 0.3], [0.3, across[1], 0.3], [0.2, 0.2, 0.2]])
