"""Thin plates at any speed and with any step: no plate passes through another, or the run reports that it did."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fsm.case.models.contact import Contact
from fsm.case.models.loads import Drive
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, ForceElement, Plate, Scene, Surface
from fsm.errors import NotConverged
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.simulate import simulate
from fsm.solve.statics.static import follow

LENGTH, THICK, HEIGHT = 0.02, 1e-4, 5e-3
MASS = LENGTH**2 * THICK * 1000
ACROSS = MASS * LENGTH**2 / 12
INERTIA = (ACROSS, ACROSS, 2 * ACROSS)
DIMENSIONS = pytest.mark.parametrize("spatial", [False, True], ids=["plane", "space"])
TARGETS = pytest.mark.parametrize("target", ["surface", "plate", "plane"])
LOOSE = 1e-2


def bouncing(speed: float, part: float = 1.0, **keys: float) -> Contact:
    """Contact stiff enough to stop a plate within a quarter of its thickness, or a part of the plate within as much."""
    return Contact(stiffness=1.25 * part * MASS * speed**2 / (THICK / 4) ** 2.5, **keys)


def shot(target: str, speed: float, tilt: float, contact: Contact) -> Scene:
    """A thin plate that moves towards a held panel, a held plate or a half-space, whose middle surfaces are at z = 0."""
    outline = Plate(length=LENGTH, width=LENGTH, thickness=THICK)
    high = Body(
        name="high", mass=MASS, inertia=INERTIA, plate=outline, position=(0.0, 0.0, HEIGHT), velocity=(0.0, 0.0, -speed),
        orientation=(math.cos(tilt / 2), 0.0, math.sin(tilt / 2), 0.0),
    )  # fmt: skip
    if target == "plane":
        floor = (Obstacle(name="low", shape="plane", position=(0.0, 0.0, THICK / 2)),)
        return Scene(bodies=(high,), obstacles=floor, pairs=(ContactPair(first="high", second="low"),), contact=contact)
    wide = Plate(length=0.08, width=0.08, thickness=THICK)
    low = Body(name="low", mass=MASS, inertia=INERTIA, held=True, plate=wide)
    faces = (Surface(name="below", bodies=("low",)), Surface(name="above", bodies=("high",)))
    names = ("above", "below") if target == "surface" else ("high", "low")
    pair = ContactPair(first=names[0], second=names[1])
    return Scene(bodies=(low, high), surfaces=faces, pairs=(pair,), contact=contact)


def crossing(speed: float, contact: Contact) -> Scene:
    """Two plates on edge, like an X seen from above: only their edges can touch, far from any corner."""
    outline = Plate(length=0.04, width=0.005, thickness=THICK)
    half = math.sqrt(0.5)
    inertia = (MASS * 0.005**2 / 12, MASS * 0.04**2 / 12, MASS * (0.04**2 + 0.005**2) / 12)
    low = Body(name="low", mass=MASS, inertia=inertia, held=True, plate=outline, orientation=(half, half, 0.0, 0.0))
    high = low.model_copy(
        update={
            "name": "high", "held": False, "orientation": (0.5, 0.5, 0.5, 0.5),
            "position": (0.001, 0.0015, HEIGHT + 0.005), "velocity": (0.0, 0.0, -speed),
        }
    )  # fmt: skip
    return Scene(bodies=(low, high), pairs=(ContactPair(first="low", second="high"),), contact=contact)


def fly(system: SegmentSystem, speed: float, method: str) -> list[SavedState]:
    seen: list[SavedState] = []
    end = 3.0 * HEIGHT / speed
    settings = Settings(method, LOOSE, end, max_steps=20_000)
    simulate(system, settings, list(np.linspace(0.0, end, 61)), seen.append)
    return seen


def lowest(system: SegmentSystem, seen: list[SavedState]) -> float:
    """Largest downward displacement of any corner of the moving plate, m."""
    return min(float(system.shape(saved.time, saved.q)[-1, :, 2].min()) for saved in seen)


def parting(system: SegmentSystem, seen: list[SavedState]) -> float:
    return float(seen[-1].u[2 if system.spatial else 1])


@DIMENSIONS
@TARGETS
@pytest.mark.parametrize("tilt", [0.0, 0.3], ids=["flat", "on an edge"])
@pytest.mark.parametrize("keys", [{}, {"restitution": 0.7}], ids=["elastic", "c = .7"])
@pytest.mark.parametrize("speed", [pytest.param(50.0, marks=pytest.mark.nightly), 500.0])
def test_a_thin_fast_plate_comes_back(speed: float, keys: dict[str, float], tilt: float, target: str, spatial: bool) -> None:
    # an end that lands throws the other end down at twice the speed, which would cause a penetration of half a thickness
    contact = bouncing(speed, 4.0 if tilt else 1.0, **keys)
    system = compile_scene(shot(target, speed, tilt, contact), spatial)
    seen = fly(system, speed, "generalized-alpha")
    assert lowest(system, seen) > 0.0
    assert parting(system, seen) > 0.0
    if keys and not tilt:
        assert parting(system, seen) == pytest.approx(0.7 * speed, rel=0.01)


@pytest.mark.parametrize("keys", [{}, {"restitution": 0.7}], ids=["elastic", "c = .7"])
@pytest.mark.parametrize("speed", [50.0, 500.0])
def test_edge_on_edge(speed: float, keys: dict[str, float]) -> None:
    system = compile_scene(crossing(speed, bouncing(speed, 4.0, **keys)), True)
    seen = fly(system, speed, "generalized-alpha")
    assert lowest(system, seen) > 0.0025
    assert parting(system, seen) > 0.3 * speed


@DIMENSIONS
@pytest.mark.parametrize(
    ("target", "tilt"),
    [("plane", 0.0), ("plane", 0.3), ("plane", 0.5 * math.pi), ("box", 0.5 * math.pi)],
    ids=["flat", "on an edge", "upright", "upright on a box"],
)
def test_a_soft_floor_throws_a_thin_plate_back(target: str, tilt: float, spatial: bool) -> None:
    """A floor has one side only, whatever the thickness of the landing plate is; a soft floor allows a penetration of more
    than half of it."""
    speed, part = 50.0, 0.125**2.5
    scene = shot("plane", speed, tilt, bouncing(speed, part))
    high = scene.bodies[0].model_copy(update={"position": (0.0013, 0.0, HEIGHT + 0.5 * LENGTH * math.sin(tilt))})
    scene = scene.model_copy(update={"bodies": (high,)})
    if target == "box":
        box = Obstacle(name="low", shape="box", size=(0.08, 0.08, 0.08), position=(0.0, 0.0, THICK / 2 - 0.04))
        scene = scene.model_copy(update={"obstacles": (box,)})
    system = compile_scene(scene, spatial)
    seen = fly(system, speed, "generalized-alpha")
    deepest = min(float(system.observe(saved.time, saved.q, saved.u).pairs.gap.min()) for saved in seen)
    assert -0.25 * LENGTH < deepest < -0.6 * THICK
    if tilt != 0.3:
        assert parting(system, seen) == pytest.approx(speed, rel=1e-2)
    assert lowest(system, seen[-1:]) > THICK


@DIMENSIONS
@TARGETS
@pytest.mark.parametrize("tilt", [0.0, 0.3], ids=["flat", "on an edge"])
def test_radau_gets_it_right_or_says_so(tilt: float, target: str, spatial: bool) -> None:
    """SciPy's method cannot repeat a step."""
    for speed in (50.0, 500.0):
        system = compile_scene(shot(target, speed, tilt, bouncing(speed)), spatial)
        said = ""
        try:
            seen = fly(system, speed, "Radau")
        except NotConverged as error:
            said = str(error)
        if said:
            assert "pass through each other" in said
        else:
            assert lowest(system, seen) > 0.0
            assert parting(system, seen) > 0.0


def test_radau_says_when_something_passed() -> None:
    """A contact that is too soft to stop the plate."""
    for target in ("surface", "plate", "plane"):
        system = compile_scene(shot(target, 50.0, 0.0, Contact(stiffness=1.0)), False)
        with pytest.raises(NotConverged, match=r"a body passed through a face; .*raise contact\.stiffness"):
            fly(system, 50.0, "Radau")
        with pytest.raises(NotConverged, match=r"raise contact\.stiffness.* pass through each other"):
            fly(system, 50.0, "generalized-alpha")


# statics ----------------------------------------------------------------------------------------------------------


def pushed(yielding: bool, target: str, **keys: Any) -> Scene:
    """A plate that is driven down by 10 mm, with another plate after 5 mm, which is on springs or held."""
    scene = shot(target, 0.0, 0.0, Contact(stiffness=1e8, **keys))
    bodies = {body.name: body for body in scene.bodies}
    low = bodies["low"].model_copy(update={"held": not yielding})
    springs = ForceElement(
        name="springs", inner="ground", outer="low", translation=(1e3, 1e3, 100.0), rotation=(1.0, 1.0, 1.0)
    )
    spare = Body(name="spare", mass=MASS, inertia=INERTIA, position=(1.0, 0.0, 0.0))
    hung = springs.model_copy(update={"name": "hung", "outer": "spare", "point_inner": (1.0, 0.0, 0.0)})
    return scene.model_copy(
        update={
            "bodies": (low, bodies["high"], spare),
            "elements": (hung, springs) if yielding else (hung,),
            "drives": (Drive(body="high", direction=(0.0, 0.0, -1.0), speed=0.01, travel=2 * HEIGHT),),
        }
    )


@DIMENSIONS
@pytest.mark.parametrize("target", ["surface", "plate"])
@pytest.mark.parametrize("first", [1.0, 0.3], ids=["one increment", "few"])
def test_a_plate_on_springs_is_pushed_along(first: float, target: str, spatial: bool) -> None:
    system = compile_scene(pushed(True, target), spatial)
    end = float(system.end_time() or 0.0)
    seen: list[SavedState] = []
    follow(system, PathSettings(end, first * end), [end], seen.append)
    at = seen[-1].q[2 if spatial else 1]
    # 100 N/m times the displacement of the driven plate after first contact
    assert at == pytest.approx(HEIGHT - 2 * HEIGHT - THICK, abs=2e-5)
    assert abs(seen[-1].observation.drive.force[0]) == pytest.approx(-100.0 * at, rel=1e-3)


@DIMENSIONS
@pytest.mark.parametrize("target", ["surface", "plate"])
@pytest.mark.parametrize("first", [1.0, 0.3], ids=["one increment", "few"])
@pytest.mark.parametrize("damping", [0.0, 10.0], ids=["elastic", "damped"])
def test_a_plate_is_not_driven_through_another(damping: float, first: float, target: str, spatial: bool) -> None:
    """Both plates are held in their places, so there is no solution."""
    system = compile_scene(pushed(False, target, damping=damping), spatial)
    end = float(system.end_time() or 0.0)
    with pytest.raises(NotConverged, match="pass through each other"):
        follow(system, PathSettings(end, first * end), [end], lambda saved: None)
