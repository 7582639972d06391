"""Contact of films, cables and beams: stiffness per area, tangents against differences, and refused cases."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.case.derived.contact_points import contact_points, penetration_between, points_along
from fsm.case.models.contact import Contact, Friction
from fsm.case.models.flexible import SceneBeam, SceneCable, SceneFilm, SceneFrame
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, ForceElement, Plate, Scene
from fsm.errors import CaseError
from fsm.model.compile.compile_joined import compile_model
from fsm.model.joined.system import JoinedSystem
from tests.tangents import differences

STIFFNESS, THICKNESS = 1e6, 1e-4


def film(mesh: tuple[int, int] = (4, 3), side: float = 0.1) -> SceneFilm:
    return SceneFilm(
        name="film", length=side, width=0.8 * side, thickness=THICKNESS, young=3e9, density=1400.0, mesh=mesh,
        strain=(1e-3, 1e-3), held=("left", "right"),
    )  # fmt: skip


def plate(depth: float, length: float, width: float, turned: float = 0.0) -> Body:
    """A plate above the film; its lower face penetrates the upper face of the film by this depth."""
    height = 0.5 * (1e-3 + THICKNESS) - depth
    return Body(
        name="plate", mass=0.01, inertia=(1e-5, 1e-5, 2e-5), position=(0.003, 0.002, height),
        orientation=(np.cos(turned), 0.0, np.sin(turned), 0.0), plate=Plate(length=length, width=width, thickness=1e-3),
    )  # fmt: skip


def scene(other: Body, part: SceneFilm | SceneCable | SceneBeam, friction: bool = False) -> Scene:
    contact = Contact(law="hertz", stiffness=STIFFNESS, damping=20.0 if friction else 0.0, ramp=1e-5)
    kind = {SceneFilm: "films", SceneCable: "cables", SceneBeam: "beams"}[type(part)]
    rubbing = Friction(law="tanh", mu_dynamic=0.3, v_static=0.1) if friction else None
    pair = ContactPair(first=part.name, second=other.name)
    return Scene(bodies=(other,), pairs=(pair,), contact=contact, friction=rubbing, **{kind: (part,)})


def force_on_plate(model: Scene) -> float:
    system = compile_model(model)
    return float(system.force(0.0, system.initial()[0], None)[2])


@pytest.mark.parametrize("mesh", [(2, 2), (4, 3), (9, 7)])
def test_the_stiffness_is_that_of_the_smaller_face_for_any_mesh(mesh: tuple[int, int]) -> None:
    depth = 2e-5
    assert force_on_plate(scene(plate(depth, 0.3, 0.3), film(mesh))) == pytest.approx(STIFFNESS * depth**1.5, rel=1e-6)


def test_the_stiffness_of_a_smaller_plate_is_that_of_its_face() -> None:
    """Each point represents an area, so the force of a plate within the film is accurate to the area of one row of
    points."""
    depth = 2e-5
    force = force_on_plate(scene(plate(depth, 0.04, 0.03), film((20, 20))))
    assert force == pytest.approx(STIFFNESS * depth**1.5, rel=0.15)


@pytest.mark.parametrize(
    "part",
    [
        SceneCable(name="rope", start=(-0.1, 0.0, 0.0), end=(0.1, 0.0, 0.0), diameter=THICKNESS, young=1e9, density=900.0),
        SceneBeam(
            name="beam", start=(-0.1, 0.0, 0.0), end=(0.1, 0.0, 0.0), width=0.01, thickness=THICKNESS, young=1e9,
            density=900.0,
        ),
    ],
)  # fmt: skip
def test_cables_and_beams_have_the_area_of_width_times_length(part: SceneCable | SceneBeam) -> None:
    depth = 2e-5
    assert force_on_plate(scene(plate(depth, 0.3, 0.3), part)) == pytest.approx(STIFFNESS * depth**1.5, rel=1e-6)


def in_contact() -> tuple[JoinedSystem, np.ndarray, np.ndarray]:
    system = compile_model(scene(plate(1e-4, 0.06, 0.05, turned=0.002), film(), friction=True))
    assert isinstance(system, JoinedSystem)
    generator = np.random.default_rng(3)
    free = ~system._fixed.ravel()
    q, u = system.initial()
    q = system.retract(q, 1e-5 * generator.standard_normal(system.nu) * free)
    u = u + 0.05 * generator.standard_normal(system.nu) * free
    system.commit(0.0, q, u)
    return system, q, u


def test_tangents_of_contact_are_those_of_the_force() -> None:
    system, q, u = in_contact()
    free = ~system._fixed.ravel()
    linear = system.linearise(0.0, q, u)
    assert system.observe(0.0, q, u).pairs.force[0] > 0.0

    def slopes(moved, size: float) -> np.ndarray:
        return -differences(moved, np.full(system.nu, size))[np.ix_(free, free)]

    # rows of points of the plate: the rows of the film have the stiffness of the film, which is far larger
    stiffness = slopes(lambda d: system.force(0.0, system.retract(q, d), u), 1e-9)[:6]
    damping = slopes(lambda d: system.force(0.0, q, u + d), 1e-6)[:6]
    found = linear.stiffness.bsr().toarray()[np.ix_(free, free)][:6], linear.damping.bsr().toarray()[np.ix_(free, free)][:6]
    for one, other in zip(found, (stiffness, damping), strict=True):
        size = np.abs(other).max(axis=1, keepdims=True)
        assert size.min() > 0.0
        assert np.all(np.abs(one - other) <= 1e-4 * size)


def test_action_and_reaction_of_a_film() -> None:
    system, q, u = in_contact()
    forces = np.zeros(system.place(0.0, q, u)[1].shape)
    for group in system.contacts:
        group.add_force(system.state(0.0, q, u), forces)
    assert np.abs(forces[:, 2]).max() > 0.1
    assert np.allclose(forces[:, :3].sum(axis=0), 0.0, atol=1e-12)


def test_films_that_should_touch_each_other_are_refused() -> None:
    two = film(), film().model_copy(update={"name": "other", "position": (0.0, 0.0, 0.1)})
    model = scene(plate(0.0, 0.1, 0.1), two[0]).model_copy(
        update={"films": two, "pairs": (ContactPair(first="film", second="other"),)}
    )
    with pytest.raises(CaseError, match="films, cables and beams do not touch each other"):
        compile_model(model)


def test_a_film_touches_a_sphere_on_the_ground() -> None:
    """The section of the sphere is the smaller face; the film lies on the sphere, and the radius of the dent follows from
    its depth."""
    ball = Obstacle(name="ball", shape="sphere", radius=0.02, position=(0.0, 0.0, -0.02 - 0.5 * THICKNESS + 1e-3))
    model = scene(plate(-1.0, 0.1, 0.1), film((20, 20))).model_copy(
        update={"obstacles": (ball,), "pairs": (ContactPair(first="film", second="ball"),)}
    )
    system = compile_model(model)
    # depth d - r^2/(2 R) up to r = sqrt(2 R d), over pi R^2: int 2 r (d - r^2/2R)^1.5 dr/R^2 = 0.8 d^2.5/R
    expected = STIFFNESS * 0.8 * 1e-3**2.5 / 0.02
    q, u = system.initial()
    assert system.observe(0.0, q, u).pairs.force[0] == pytest.approx(expected, rel=0.15)


def test_round_obstacles_have_more_points() -> None:
    """A ball of 20 mm on elements of 25 mm needs five points along a side instead of two; under a plate two points are
    enough."""
    ball = Obstacle(name="ball", shape="sphere", radius=0.02, position=(0.0, 0.0, -0.05))
    flat = scene(plate(-1.0, 0.1, 0.1), film((4, 4)))
    model = flat.model_copy(update={"obstacles": (ball,), "pairs": (ContactPair(first="film", second="ball"),)})
    part = model.films[0]
    assert (points_along(flat, part), points_along(model, part)) == (2, 5)
    assert len(contact_points(model)["film"]) == 16 * 25
    assert penetration_between(part, 5, 0.02) < 0.25 * penetration_between(part, 2, 0.02)


def test_joints_at_frames_have_no_moment_as_assembled() -> None:
    """The axes of a cable and of a body differ at the start; a spring between them has no moment there."""
    cable = SceneCable(name="rope", start=(0.0, 0.0, 0.0), end=(0.0, 0.0, 0.1), diameter=1e-3, young=1e9, density=900.0)
    frame = SceneFrame(name="end", on="rope", at=(0.1,), normal=(1.0, 0.0, 0.0))
    body = Body(name="weight", mass=0.01, inertia=(1e-6, 1e-6, 1e-6), position=(0.0, 0.0, 0.1))
    weld = ForceElement(name="weld", inner="weight", outer="end", translation=(1e4, 1e4, 1e4), rotation=(1.0, 1.0, 1.0))
    system = compile_model(Scene(bodies=(body,), cables=(cable,), frames=(frame,), elements=(weld,)))
    assert np.abs(system.force(0.0, system.initial()[0], None)).max() < 1e-9
    turned = weld.model_copy(update={"rest_angle": 0.5})
    system = compile_model(Scene(bodies=(body,), cables=(cable,), frames=(frame,), elements=(turned,)))
    assert np.abs(system.force(0.0, system.initial()[0], None)).max() > 0.1
