"""Overlap at the start is refused, or removed on request."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.case.models.case import Case
from fsm.case.models.contact import Contact
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, Plate, Scene, Surface
from fsm.errors import CaseError
from fsm.model.compile.compile import compile_scene
from fsm.model.compile.compile_case import compile_case
from fsm.model.faults.overlap import find_pierced
from fsm.model.faults.separate import overlaps
from tests.runs import run

OUTLINE = Plate(length=0.02, width=0.015, thickness=1e-3)
MASS = 0.02 * 0.015 * 1e-3 * 1000
INERTIA = (MASS / 12 * 0.015**2, MASS / 12 * 0.02**2, MASS / 12 * (0.015**2 + 0.02**2))
FLOOR = Obstacle(name="floor", shape="plane")


def plate(name: str, **keys: Any) -> Body:
    return Body(**({"name": name, "mass": MASS, "inertia": INERTIA, "plate": OUTLINE} | keys))


def case(scene: Scene, resolve: bool = False, **keys: Any) -> Case:
    contact = Contact(stiffness=1e7, resolve_overlap=resolve)
    return Case.model_validate({"scene": scene.model_copy(update={"contact": contact}), "solve": {"end_time": 1e-3, **keys}})


def refused(given: Case) -> list[str]:
    with pytest.raises(CaseError) as error:
        compile_case(given, "x.toml")
    return error.value.lines()


def stacked(gap: float, side: float = 0.0, held: bool = True) -> Scene:
    """Two plates over each other, `side` apart across the plane."""
    bodies = (plate("low", held=held), plate("high", position=(1e-3, side, OUTLINE.thickness + gap)))
    return Scene(bodies=bodies, pairs=(ContactPair(first="low", second="high"),))


@pytest.mark.parametrize("side", [0.0, 2e-3], ids=["plane", "space"])
def test_plates_that_overlap_are_refused(side: float) -> None:
    lines = refused(case(stacked(-0.2e-3, side)))
    assert len(lines) == 1
    assert lines[0].startswith("x.toml: scene: low and high overlap at the start by 0.2 mm; ")
    compile_case(case(stacked(0.01e-3, side)))
    compile_case(case(stacked(0.0, side)))


@pytest.mark.parametrize("side", [0.0, 2e-3], ids=["plane", "space"])
def test_a_plate_in_an_obstacle_is_refused(side: float) -> None:
    bodies = (plate("a", position=(0.0, side, 0.3e-3)), plate("b", position=(0.1, side, 0.5e-3)))
    pairs = tuple(ContactPair(first=name, second="floor") for name in ("a", "b"))
    lines = refused(case(Scene(bodies=bodies, obstacles=(FLOOR,), pairs=pairs)))
    hint = "move them apart, or set contact.resolve_overlap"
    assert lines == [f"x.toml: scene: a and floor overlap at the start by 0.2 mm; {hint}"]


def test_surfaces_in_space_are_refused() -> None:
    scene = stacked(-0.2e-3, 2e-3).model_copy(
        update={
            "surfaces": (Surface(name="one", bodies=("low",)), Surface(name="two", bodies=("high",))),
            "pairs": (ContactPair(first="one", second="two"),),
        }
    )
    lines = [line.split(";")[0] for line in refused(case(scene))]
    assert lines == ["x.toml: scene: one and two overlap at the start by 0.2 mm"]


def test_a_plate_stuck_in_another_is_refused() -> None:
    """All points and edges of each plate are far from the other plate."""
    upright = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)
    bodies = (plate("flat"), plate("upright", position=(0.004, 0.004, 0.004), orientation=upright))
    scene = Scene(bodies=bodies, pairs=(ContactPair(first="flat", second="upright"),))
    assert find_pierced(scene) == [("flat", "upright")]
    text = "flat and upright pass through each other at the start; move these bodies apart"
    assert refused(case(scene)) == [f"x.toml: scene: {text}"]
    beside = bodies[1].model_copy(update={"position": (0.011, 0.004, 0.004)})
    compile_case(case(scene.model_copy(update={"bodies": (bodies[0], beside)})))


@pytest.mark.parametrize("spatial", [False, True], ids=["plane", "space"])
def test_strips_as_folded_do_not_overlap(spatial: bool) -> None:
    """Layers beside a crease overlap, in space as in the plane, and this is not refused."""
    strip = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": "83 deg", "segments_per_panel": 4,
        },
        "material": {"young": 3e9, "density": 800},
        "crease": {"law": "linear", "stiffness": 9e-3},
        "contact": {"stiffness": 1e8},
        "obstacle": [{"name": "floor", "shape": "plane", "position": [0, 0, -1e-3]}],
        "solve": {"end_time": 1.0, "spatial": spatial},
    }  # fmt: skip
    compile_case(Case.model_validate(strip))
    sunk = strip | {"obstacle": [{"name": "floor", "shape": "sphere", "radius": 1.0, "position": [0, 0.1, -0.9]}]}
    assert all("overlap at the start" in line for line in refused(Case.model_validate(sunk)))


# moved apart ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", [0.0, 2e-3], ids=["plane", "space"])
def test_two_plates_are_moved_apart(side: float) -> None:
    """The held plate remains; two free plates move by half each."""
    warnings: list[str] = []
    scene, system = compile_case(case(stacked(-0.2e-3, side), True), "", warnings)
    assert overlaps(system) == []
    assert scene.bodies[0].position == (0.0, 0.0, 0.0)
    # a plate that protrudes to one side rotates a little
    assert 1e-3 < scene.bodies[1].position[2] < 1.05e-3
    assert len(warnings) == 1
    assert warnings[0].startswith("1 pair overlapped at the start and were moved apart; the largest displacement is 0.2")
    scene, _ = compile_case(case(stacked(-0.2e-3, side, held=False), True))
    moves = [scene.bodies[0].position[2], scene.bodies[1].position[2] - 0.8e-3]
    assert -moves[0] == pytest.approx(moves[1], rel=0.05) == pytest.approx(1e-4, rel=0.1)


def test_nothing_is_moved_without_need() -> None:
    warnings: list[str] = []
    scene, _ = compile_case(case(stacked(1e-5), True), "", warnings)
    assert scene.bodies == stacked(1e-5).bodies
    assert not warnings


def test_what_cannot_be_moved_apart_is_refused() -> None:
    """A plate between two floors whose distance is less than its thickness."""
    ceiling = Obstacle(name="ceiling", shape="plane", position=(0.0, 0.0, 0.9e-3), orientation=(0.0, 1.0, 0.0, 0.0))
    scene = Scene(
        bodies=(plate("a", position=(0.0, 0.0, 0.45e-3)),),
        obstacles=(FLOOR, ceiling),
        pairs=(ContactPair(first="a", second="floor"), ContactPair(first="a", second="ceiling")),
    )
    assert len(refused(case(scene, True))) >= 1


def thrown(seed: int, count: int, spatial: bool) -> Scene:
    """Plates in a box so small that many overlap, over a floor; afterwards none overlap."""
    rng = np.random.default_rng(seed)
    bodies = []
    for k in range(count):
        if spatial:
            small = 0.01 * rng.normal(size=3)
            turned = np.array([1.0, *small]) / np.sqrt(1.0 + small @ small)
            at = (*rng.uniform(-0.01, 0.01, 2), 0.4e-3 + 0.9e-3 * k)
        else:
            angle = 0.01 * rng.normal()
            turned = np.array([np.cos(angle), 0.0, np.sin(angle), 0.0])
            at = (rng.uniform(-0.01, 0.01), 0.0, 0.4e-3 + 0.9e-3 * k)
        bodies.append(plate(f"p{k}", position=tuple(at), orientation=tuple(turned)))
    names = [body.name for body in bodies]
    pairs = [ContactPair(first=a, second=b) for a, b in combinations(names, 2)]
    pairs += [ContactPair(first=name, second="floor") for name in names]
    return Scene(bodies=tuple(bodies), obstacles=(FLOOR,), pairs=tuple(pairs))


@pytest.mark.parametrize("spatial", [False, True], ids=["plane", "space"])
@pytest.mark.parametrize("seed", range(4))
def test_thrown_plates_are_moved_apart(seed: int, spatial: bool) -> None:
    scene = thrown(seed, 8, spatial)
    length = compile_scene(scene.model_copy(update={"contact": Contact(stiffness=1e7)})).scales().length
    assert refused(case(scene))
    _, system = compile_case(case(scene, True))
    deepest = max((depth for _, depth in overlaps(system)), default=0.0)
    assert deepest < 1e-6 * length


def test_the_warning_is_in_the_summary(tmp_path: Path) -> None:
    _, summary = run(
        tmp_path,
        """
gravity = [0, 0, -9.81]
[[scene.bodies]]
name = "a"
mass = 3e-4
inertia = [6e-9, 1e-8, 1.6e-8]
position = [0, 0, "0.4 mm"]
plate = { length = "20 mm", width = "15 mm", thickness = "1 mm" }
[[scene.pairs]]
first = "a"
second = "floor"
[[obstacle]]
name = "floor"
shape = "plane"
[contact]
stiffness = 1e7
resolve_overlap = true
[solve]
end_time = 1e-3
""",
    )
    assert any("moved apart; the largest displacement is 0.1 mm, of a" in text for text in summary["warnings"])
