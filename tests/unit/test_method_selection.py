"""Method that `auto` selects, and the reason that it gives."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

import fsm
from fsm.builders.scene import build_scene
from fsm.case.loading.load_case import read_case
from fsm.case.models.loads import Drive, Load
from fsm.case.models.materials import LinearCrease, SplineCrease
from fsm.case.models.scene import Body, ForceElement, Scene
from fsm.case.models.time_program import Constant, Ramp, Table
from fsm.case.plan.method_selection import MAX_STATIC_PACE, automatic_method, pace

MASS, STIFFNESS = 0.5, 2.0
SLOW_SPEED = (0.5 * MAX_STATIC_PACE * STIFFNESS / MASS) ** 0.5
"""m/s; half the pace limit of statics."""
FAST_SPEED = 2.0 * SLOW_SPEED


def hinge(name: str = "hinge", **keys: Any) -> ForceElement:
    given: dict[str, Any] = {"inner": "ground", "outer": "arm", "rotation": (0.0, STIFFNESS, 0.0)}
    return ForceElement(name=name, **(given | keys))


def scene(speed: float | None = SLOW_SPEED, **keys: Any) -> Scene:
    """An arm on a hinge, another body that is driven, and one that is held."""
    bodies = (
        Body(name="arm", mass=MASS, inertia=(1.0, 1.0, 1.0), **keys.pop("arm", {})),
        Body(name="hand", mass=0.0, inertia=(0.0, 0.0, 0.0)),
        Body(name="wall", mass=1e9, inertia=(1.0, 1.0, 1.0), held=True),
    )
    drives = () if speed is None else (Drive(body="hand", speed=speed, travel=0.1),)
    return Scene(**({"bodies": bodies, "elements": (hinge(),), "drives": drives} | keys))


def test_pace_is_the_mass_that_is_free_at_the_drives_speed_over_the_softest_hinge() -> None:
    assert pace(scene()) == pytest.approx(0.5 * MAX_STATIC_PACE)
    assert pace(scene(FAST_SPEED)) == pytest.approx(2.0 * MAX_STATIC_PACE)
    stiffer = hinge("second", rotation=(0.0, 10.0 * STIFFNESS, 0.0))
    idle = hinge("idle", rotation=(STIFFNESS, 0.0, 0.0))  # no stiffness about its crease axis
    assert pace(scene(elements=(stiffer, hinge(), idle))) == pace(scene())


@pytest.mark.parametrize(
    "crease",
    [
        LinearCrease(law="linear", stiffness=STIFFNESS),
        SplineCrease(law="spline", angle=(0.0, 1.0, 2.0), moment=(0.0, 0.5, 2.0), scale=2.0, interpolation="pchip"),
        SplineCrease(law="spline", angle=(0.0, 1.0, 2.0), moment=(0.0, -0.5, -4.0), interpolation="pchip"),
    ],
    ids=["linear", "scaled", "falling"],
)
def test_pace_with_creases(crease: LinearCrease | SplineCrease) -> None:
    """A tabulated crease counts with the slope from one end of its curve to the other."""
    assert pace(scene(elements=(hinge(crease=crease),))) == pytest.approx(0.5 * MAX_STATIC_PACE)


def test_slow_drive() -> None:
    method, reason = automatic_method(scene())
    assert method == "static"
    assert reason == "the drive is slow: kinetic over elastic energy is 5e-06, below 1e-05"


def test_fast_drive() -> None:
    method, reason = automatic_method(scene(FAST_SPEED))
    assert method == "generalized-alpha"
    assert reason == "the drive is fast: kinetic over elastic energy is 2e-05, above 1e-05"


def test_no_hinge_is_stiff() -> None:
    assert automatic_method(scene(elements=()))[0] == "generalized-alpha"
    assert pace(scene(elements=())) == float("inf")


def folded(facets: str, speed: str, more: dict[str, Any]) -> Scene:
    """A Miura sheet with facets of this kind, whose right edge is driven."""
    sheet = {
        "kind": "miura", "columns": 2, "rows": 2, "a": 0.03, "b": 0.03, "sector_angle": "60 deg", "fold_angle": "40 deg",
        "facets": facets, "thickness": "0.2 mm", "support": [{"at": "edge left"}],
    }  # fmt: skip
    data = {
        "sheet": sheet | more, "material": {"young": "3 GPa", "density": 1200.0}, "crease": {"stiffness_per_length": 0.05},
        "drive": [{"edge": "right", "direction": [-1, 0, 0], "guide": False, "speed": speed, "travel": "5 mm"}],
    }  # fmt: skip
    case, _ = read_case(data, Path())
    assert case is not None
    return build_scene(case)


@pytest.mark.parametrize(("facets", "more"), [("bars", {}), ("flexible", {"mesh_size": "30 mm"})])
def test_sheets_of_bars_and_of_flexible_facets(facets: str, more: dict[str, Any]) -> None:
    """Their mass, over the stiffness of their softest crease; without dampers, statics goes further."""
    area = 4 * 0.03 * 0.03 * math.sin(math.radians(60.0))
    expected = 1200.0 * 2e-4 * area * 1e-6 / (0.05 * 0.03)
    slow = folded(facets, "1 mm/s", more)
    assert pace(slow) == pytest.approx(expected, rel=1e-9)
    assert automatic_method(slow)[0] == "static"
    assert automatic_method(folded(facets, "10 mm/s", more))[0] == "static"
    assert automatic_method(folded(facets, "5 m/s", more))[0] == "mean-force"


def test_free_motion() -> None:
    assert automatic_method(scene(None)) == ("generalized-alpha", "there is no drive, so the motion is free")


@pytest.mark.parametrize("key", ["velocity", "angular_velocity"])
def test_moving_start(key: str) -> None:
    moving = scene(arm={key: (0.0, 1e-3, 0.0)})
    assert automatic_method(moving) == ("generalized-alpha", "bodies have initial velocities")


@pytest.mark.parametrize("time", [Ramp(kind="ramp", end=1.0), Table(kind="table", time=(0.0, 1.0), value=(0.0, 1.0))])
def test_changing_loads(time: Ramp | Table) -> None:
    changing = scene(loads=(Load(body="arm", force=(0.0, 0.0, 1.0)), Load(body="arm", force=(1.0, 0.0, 0.0), time=time)))
    assert automatic_method(changing) == ("generalized-alpha", "loads depend on time")


def test_constant_loads_are_statics() -> None:
    assert automatic_method(scene(loads=(Load(body="arm", force=(0.0, 0.0, 1.0), time=Constant()),)))[0] == "static"


def pulled(speed: str = "1 mm/s", bent: float = 0.6, **keys: Any) -> dict[str, Any]:
    """Two panels of 1 m, hinged to the ground and to each other, and a hand on a hinge at the end, which moves along x."""
    spring = {"stiffness": 2.0, "rest": 0.2}
    places = [[0.0, 0.0, 0.0], [0.8, 0.0, bent], [1.6, 0.0, 0.0]]
    names = ["ground", "one", "two", "hand"]
    joints: list[dict[str, Any]] = [
        {"name": f"hinge {k}", "kind": "revolute", "first": names[k], "second": names[k + 1], "at": places[k],
         "axis": [0.0, 1.0, 0.0]} | ({"spring": spring} if k < 2 else {}) for k in range(3)
    ]  # fmt: skip
    joints[1] |= keys.pop("middle", {})
    bodies = [
        {"name": name, "mass": 1.0, "inertia": [0.01, 0.1, 0.1], "position": [x, 0.0, z]}
        for name, x, z in (("one", 0.4, 0.5 * bent), ("two", 1.2, 0.5 * bent), ("hand", 1.6, 0.0))
    ]
    drives = [{"body": "hand", "direction": [-1.0, 0.0, 0.0], "travel": 0.3, "speed": speed}]
    scene = {"bodies": bodies, "joints": joints, "drives": drives} | keys.pop("scene", {})
    return {"units": "SI", "gravity": [0.0, 0.0, 0.0], "scene": scene} | keys


@pytest.mark.parametrize(
    ("case", "method", "reason"),
    [
        (pulled(), "static", "the drive is slow: kinetic over elastic energy is 2e-06, below 1e-05"),
        (pulled("1 m/s"), "explicit", "the drive is fast: kinetic over elastic energy is 2, above 1e-05"),
        (pulled(scene={"drives": []}, solve={"end_time": 1.0}), "explicit", "there is no drive, so the motion is free"),
        (pulled(middle={"motor": {"torque": 1.0}}), "explicit", "motors of joints are computed in motions"),
        (pulled(event=[{"when": "time > 1", "do": "release hinge 2"}]), "explicit", "events happen in motions"),
        (pulled(middle={"kind": "planar", "spring": None}), "explicit",
         "neither joints nor springs hold 1 motion of the bodies"),
    ],
)  # fmt: skip
def test_of_slow_pulls_with_joints(case: dict[str, Any], method: str, reason: str) -> None:
    """The velocities that a drive gives to bodies on joints at the start are no initial velocities."""
    joints = case["scene"]["joints"]
    case["scene"]["joints"] = [{key: value for key, value in joint.items() if value is not None} for joint in joints]
    lines = str(fsm.load(case).check()).splitlines()
    (line,) = [line for line in lines if line.startswith("method ")]
    assert line.startswith(f"method        {method}, selected by auto: {reason}")
    assert ("explicit steps" in line) == (method == "explicit")
