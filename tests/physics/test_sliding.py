"""Friction computed by the complete program: blocks that stop, creep, stick and slide, and layers that are dragged past each
other."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fsm.case.models.contact import Contact, Friction
from fsm.case.models.loads import Drive, Load
from fsm.case.models.scene import Body, ContactPair, ForceElement, Plate, Scene, Surface
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.simulate import simulate
from fsm.solve.statics.static import follow

G, MU, V_STATIC = 9.81, 0.3, 1e-4
LENGTH, WIDTH, THICK = 0.02, 0.02, 1e-3
MASS = LENGTH * WIDTH * THICK * 8000
INERTIA = (MASS * WIDTH**2 / 12, MASS * LENGTH**2 / 12, MASS * LENGTH**2 / 6)
STIFFNESS = 1e7
DIMENSIONS = pytest.mark.parametrize("spatial", [False, True], ids=["plane", "space"])

TANH = Friction(law="tanh", mu_dynamic=MU, v_static=V_STATIC)
LAWS = {
    "tanh": TANH,
    "step": Friction(law="step", mu_static=MU, mu_dynamic=MU, v_static=V_STATIC, v_dynamic=1e-3),
    "stribeck": Friction(law="stribeck", mu_static=MU, mu_dynamic=MU, v_static=V_STATIC, v_stribeck=1e-2),
    "lugre": Friction(law="lugre", mu_static=MU, mu_dynamic=MU, v_stribeck=1e-2, presliding=1e-6),
}


def plate(name: str, length: float = LENGTH, **keys: Any) -> Body:
    outline = Plate(length=length, width=WIDTH, thickness=THICK)
    return Body(**({"name": name, "mass": MASS, "inertia": INERTIA, "plate": outline} | keys))


def block(friction: Friction, slope: float = 0.0, speed: float = 0.0, start: float = 0.0, row: int = 1) -> Scene:
    """A plate at rest on a row of held plates, with the penetration due to its weight; the gravity is rotated, not the
    floor."""
    each = 0.08 / row
    floor = [plate(f"floor {k}", each, held=True, position=((k + 0.5) * each - 0.04, 0.0, 0.0)) for k in range(row)]
    angle = math.atan(slope)
    depth = (MASS * G * math.cos(angle) / STIFFNESS) ** (2 / 3)
    slider = plate("block", position=(start, 0.0, THICK - depth), velocity=(speed, 0.0, 0.0))
    return Scene(
        bodies=(*floor, slider),
        surfaces=(Surface(name="floor", bodies=tuple(b.name for b in floor)), Surface(name="top", bodies=("block",))),
        pairs=(ContactPair(first="floor", second="top"),),
        contact=Contact(stiffness=STIFFNESS, damping=5.0),
        friction=friction,
        gravity=(G * math.sin(angle), 0.0, -G * math.cos(angle)),
    )


def run(
    system: SegmentSystem, end: float, times: np.ndarray, **keys: Any
) -> tuple[list[SavedState], np.ndarray, np.ndarray]:
    """States, and travel and speed of the moving body."""
    seen: list[SavedState] = []
    simulate(system, Settings("generalized-alpha", keys.pop("rtol", 1e-5), end, **keys), list(times), seen.append)
    return seen, np.array([s.q[0] for s in seen]), np.array([s.u[0] for s in seen])


@DIMENSIONS
@pytest.mark.parametrize("law", LAWS)
def test_a_sliding_block_stops(law: str, spatial: bool) -> None:
    """The block stops after the displacement v^2/(2 mu g) and the time v/(mu g)."""
    speed = 0.3
    stop, way = speed / (MU * G), speed**2 / (2 * MU * G)
    system = compile_scene(block(LAWS[law], speed=speed, start=-0.02), spatial)
    _, x, u = run(system, 1.5 * stop, np.linspace(0.0, 1.5 * stop, 61))
    assert x[-1] - x[0] == pytest.approx(way, rel=0.01)
    assert abs(u[-1]) < 1e-4 * speed
    # the deceleration is uniform: the time to stop follows from the speed half way
    half = int(np.argmax(u < 0.5 * speed))
    assert 1.5 * stop * half / 60 + u[half] / (MU * G) == pytest.approx(stop, rel=0.01)


CREEP = V_STATIC * math.atanh(0.2 / MU)


@DIMENSIONS
def test_tanh_creeps_on_an_incline(spatial: bool) -> None:
    _, x, _ = run(compile_scene(block(TANH, 0.2), spatial), 2.0, np.array([1.0, 2.0]))
    assert x[1] - x[0] == pytest.approx(CREEP, rel=0.01)


@DIMENSIONS
@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("presliding", [1e-5, 1e-6, 1e-7, 1e-8])
def test_bristles_hold_on_an_incline(presliding: float, rtol: float, spatial: bool) -> None:
    """After settling, the block moves less than a millionth of the creep with tanh, at any tolerance and with steps of any
    length."""
    bristles = Friction(law="lugre", mu_static=MU, mu_dynamic=MU, v_stribeck=1e-2, presliding=presliding)
    system = compile_scene(block(bristles, 0.2), spatial)
    _, x, _ = run(system, 3.0, np.array([2.0, 3.0]), rtol=rtol)
    assert abs(x[1] - x[0]) < 1e-6 * CREEP


@DIMENSIONS
@pytest.mark.parametrize("law", ["tanh", "lugre"])
def test_a_block_slides_above_the_coefficient(law: str, spatial: bool) -> None:
    _, _, u = run(compile_scene(block(LAWS[law], 0.4), spatial), 0.1, np.array([0.05, 0.1]))
    angle = math.atan(0.4)
    assert (u[1] - u[0]) / 0.05 == pytest.approx(G * (math.sin(angle) - MU * math.cos(angle)), rel=0.01)


def test_friction_across_a_plate() -> None:
    """Friction is mu N along the plate and twice as much across it; in between it follows the ellipse of the slip:
    comparison with A^2 v."""
    friction = TANH.model_copy(update={"across": 2.0})
    system = compile_scene(block(friction), spatial=True)
    q, u = system.initial()
    for direction in np.radians([0.0, 30.0, 60.0, 90.0]):
        v = np.array([math.cos(direction), math.sin(direction)])
        u[:2] = 0.1 * v
        force, normal = system.force(0.0, q, u)[:2], system.observe(0.0, q, u).pairs.force.sum()
        seen = np.array([v[0], 2.0 * v[1]])
        np.testing.assert_allclose(force, -MU * normal * np.array([1.0, 2.0]) * seen / np.hypot(*seen), rtol=1e-6)


@pytest.mark.parametrize("law", ["tanh", "lugre"])
@pytest.mark.parametrize(("turned", "part"), [(0.0, 1.0), (0.5 * math.pi, 1.5)], ids=["along", "across"])
def test_a_plate_stops_sooner_across(law: str, turned: float, part: float) -> None:
    """The plate stops after v^2/(2 a mu g); with both plates rotated, the displacement is the same."""
    speed = 0.2
    scene = block(LAWS[law].model_copy(update={"across": 1.5}))
    axes = {"orientation": (math.cos(turned / 2), 0.0, 0.0, math.sin(turned / 2))}
    floor = plate("floor", 0.08, held=True, **axes)
    floor = floor.model_copy(update={"plate": Plate(length=0.08, width=0.08, thickness=THICK)})
    slider = scene.bodies[-1].model_copy(update={"velocity": (speed, 0.0, 0.0), **axes})
    pair = ContactPair(first="floor", second="block")
    scene = scene.model_copy(update={"bodies": (floor, slider), "surfaces": (), "pairs": (pair,)})
    stop, way = speed / (part * MU * G), speed**2 / (2 * part * MU * G)
    _, x, _ = run(compile_scene(scene, spatial=True), 1.5 * stop, np.array([0.0, 1.5 * stop]))
    assert x[1] - x[0] == pytest.approx(way, rel=0.01)


def test_a_coefficient_across_means_nothing_in_the_plane() -> None:
    alike, other = (
        compile_scene(block(TANH.model_copy(update={"across": across}), speed=0.1), spatial=False) for across in (1.0, 3.0)
    )
    q, u = alike.initial()
    np.testing.assert_array_equal(alike.force(0.0, q, u), other.force(0.0, q, u))


# over joints ------------------------------------------------------------------------------------------------------


@DIMENSIONS
@pytest.mark.parametrize("length", [0.02, 0.021, 0.0232])
def test_joints_of_a_row_are_not_felt(length: float, spatial: bool) -> None:
    """The penetration is 10 um at every position: joints pass under the plate, and points of the row enter and leave at its
    ends."""
    scene = block(LAWS["tanh"], row=20)
    bodies = (*scene.bodies[:-1], plate("block", length, position=(0.0, 0.0, THICK)))
    system = compile_scene(scene.model_copy(update={"bodies": bodies}), spatial)
    q, u = system.initial()
    up = 2 if spatial else 1
    u[0], q[up] = 0.1, THICK - 1e-5
    found = []
    for x in np.linspace(-4e-3, 4e-3, 161):
        q[0] = x
        pairs, force = system.observe(0.0, q.copy(), u).pairs, system.force(0.0, q.copy(), u)
        found.append((pairs.force.sum(), pairs.friction.sum(), -force[0], pairs.area.sum()))
    normal, friction, drag, area = np.array(found).T
    np.testing.assert_allclose(normal, STIFFNESS * 1e-5**1.5, rtol=1e-9)
    np.testing.assert_allclose(area, length * WIDTH, rtol=1e-9)
    np.testing.assert_allclose(friction, MU * normal, rtol=1e-9)
    np.testing.assert_allclose(drag, friction, rtol=1e-9)  # the forces at both ends are opposite


def on_a_row(spatial: bool, speed: float) -> SegmentSystem:
    """A plate that a spring pulls over 20 coplanar held segments; it cannot rotate."""
    scene = block(TANH, row=20, start=-0.01)
    dragged = ForceElement(
        name="spring", inner="pull", outer="block", translation=(2.0, 2.0, 0.0), rotation=(1.0, 1.0, 1.0),
        translation_damping=(0.2, 0.2, 0.0), rotation_damping=(1e-3, 1e-3, 1e-3),
    )  # fmt: skip
    pull = Body(name="pull", mass=MASS, inertia=INERTIA, position=(-0.01, 0.0, THICK))
    return compile_scene(
        scene.model_copy(
            update={
                "bodies": (*scene.bodies, pull),
                "elements": (dragged,),
                "contact": Contact(stiffness=STIFFNESS, damping=50.0, ramp=1e-6),
                "drives": (Drive(body="pull", direction=(1.0, 0.0, 0.0), speed=speed, travel=0.02),),
            }
        ),
        spatial,
    )


@DIMENSIONS
@pytest.mark.parametrize("speed", [0.01, 0.5])
def test_a_plate_slides_evenly_over_a_row(speed: float, spatial: bool) -> None:
    """At a given load the forces vary by less than 1 % as points appear and disappear at the ends, at any speed."""
    system = on_a_row(spatial, speed)
    seen, x, _ = run(system, 0.018 / speed, np.linspace(0.006, 0.018, 301) / speed)
    assert x[-1] - x[0] > 0.008  # two segments
    normal = np.array([s.observation.pairs.force.sum() for s in seen])
    friction = np.array([s.observation.pairs.friction.sum() for s in seen])
    np.testing.assert_allclose(normal, MASS * G, rtol=0.01)
    np.testing.assert_allclose(friction, MU * MASS * G, rtol=0.01)


# layers -----------------------------------------------------------------------------------------------------------


def layers(load: float, surfaces: bool, spatial: bool) -> SegmentSystem:
    """A plate is dragged between a held plate and a plate that a load presses on it and springs hold back."""
    speed, travel = 0.01, 0.005
    # the overlap itself causes a force, the energy of the contact over the length, which decreases with the depth
    stiffness = 100.0 * STIFFNESS
    depth = (load / stiffness) ** (2 / 3)
    low = plate("low", held=True)
    middle = plate("middle", position=(0.0, 0.0, THICK - depth))
    top = plate("top", position=(0.0, 0.0, 2 * (THICK - depth)))
    held = ForceElement(
        name="held", inner="ground", outer="top", point_inner=(0.0, 0.0, 2 * (THICK - depth)),
        translation=(1e5, 1e5, 0.0), rotation=(10.0, 10.0, 10.0),
        translation_damping=(10.0, 10.0, 0.0), rotation_damping=(1e-3, 1e-3, 1e-3),
    )  # fmt: skip
    names = ("low", "middle", "top")
    faces = tuple(Surface(name=f"face of {name}", bodies=(name,)) for name in names) if surfaces else ()
    ends = [face.name for face in faces] or list(names)
    scene = Scene(
        bodies=(low, middle, top),
        elements=(held,),
        surfaces=faces,
        pairs=(ContactPair(first=ends[0], second=ends[1]), ContactPair(first=ends[1], second=ends[2])),
        contact=Contact(stiffness=stiffness, damping=20.0),
        friction=TANH,
        loads=(Load(body="top", force=(0.0, 0.0, -load)),),
        drives=(Drive(body="middle", direction=(1.0, 0.0, 0.0), speed=speed, travel=travel),),
    )
    return compile_scene(scene, spatial)


@DIMENSIONS
@pytest.mark.parametrize("surfaces", [False, True], ids=["plates", "surfaces"])
@pytest.mark.parametrize("method", ["static", "generalized-alpha"])
def test_layers_dragged_past_each_other(method: str, surfaces: bool, spatial: bool) -> None:
    """The drive pulls with mu times the normal forces on both faces; the upper one is the load."""
    load = 2.0
    system = layers(load, surfaces, spatial)
    seen: list[SavedState] = []
    end = 0.9 * float(system.end_time() or 0.0)
    times = [end / 2, end]
    if method == "static":
        follow(system, PathSettings(end, end / 20), times, seen.append)
    else:
        simulate(system, Settings(method, 1e-5, end), times, seen.append)
    for saved in seen:
        normal = saved.observation.pairs.force
        assert normal[1] == pytest.approx(load, rel=1e-3)
        assert saved.observation.drive.force[0] == pytest.approx(MU * normal.sum(), rel=1e-3)
