"""Steps of generalized-alpha with contact in one kernel, against the same steps in Python over the same system."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fsm.builders.strip import build_strip
from fsm.case.models.case import Case
from fsm.case.models.contact import Contact, Friction
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, Drive, Plate, Scene
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.stepping import march as balances
from fsm.solve.stepping.march import march
from fsm.solve.stepping.model import STEADY
from fsm.solve.stepping.outcomes import STEPPED, UNABLE
from fsm.solve.time.generalized_alpha import GeneralizedAlpha
from tests.physics.test_many_steps_joined import check_same_state, opened

FLOOR = Obstacle(name="floor", shape="plane")
DAMPED = {"law": "impact", "stiffness": 1e6, "exponent": 1.5, "damping": 50.0, "ramp": 1e-5}
BOUNCY = {"law": "restitution", "stiffness": 1e6, "exponent": 1.5, "restitution": 0.7}
BRISTLES = {"law": "lugre", "mu_static": 0.4, "mu_dynamic": 0.3, "v_stribeck": 1e-2, "presliding": 1e-5}
SMOOTH = {"law": "tanh", "mu_dynamic": 0.3, "v_static": 1e-2}
SIZE = 0.02
PENTAGON = ((-0.04, -0.03), (0.03, -0.03), (0.04, 0.0), (0.02, 0.03), (-0.03, 0.02))


def heap(
    kind: str, count: int, spatial: bool, normal: dict[str, Any], friction: dict[str, Any] | None = None,
    apart: float = 0.045, **more: Any,
) -> SegmentSystem:  # fmt: skip
    """Bodies of one kind that fall on the floor and on each other, slightly turned and moving sideways."""
    bodies, shapes = [], []
    for i in range(count):
        name, tilt = f"body {i}", 0.0 if kind == "sphere" else 0.05
        outline = PENTAGON if kind == "facet" else None
        flat = kind in ("plate", "facet")
        plate = Plate(length=4 * SIZE, width=3 * SIZE, thickness=SIZE / 5, outline=outline) if flat else None
        height = 0.0045 + 0.0065 * i if plate else 1.05 * SIZE + apart * i
        bodies.append(
            Body(
                name=name, mass=0.2, inertia=(3e-5, 4e-5, 5e-5), position=(0.002 * i, 0.0, height),
                velocity=(0.1 * i + 0.05, 0.0, -0.3), plate=plate,
                orientation=(math.cos(tilt / 2), 0.0, math.sin(tilt / 2), 0.0),
            )
        )  # fmt: skip
        if kind == "sphere":
            shapes.append(Obstacle(name=f"shape {i}", shape="sphere", radius=SIZE, body=name))
        elif kind == "box":
            shapes.append(Obstacle(name=f"shape {i}", shape="box", size=(2 * SIZE,) * 3, body=name))
    names = [shape.name for shape in shapes] or [body.name for body in bodies]
    pairs = [ContactPair(first=name, second="floor") for name in names]
    if kind != "box":
        pairs += [ContactPair(first=a, second=b) for i, a in enumerate(names) for b in names[i + 1 :]]
    scene = Scene(
        bodies=tuple(bodies), obstacles=(*shapes, FLOOR), pairs=tuple(pairs), contact=Contact.model_validate(normal),
        friction=None if friction is None else Friction.model_validate(friction), gravity=(0.0, 0.0, -9.81), **more,
    )  # fmt: skip
    return compile_scene(scene, spatial)


HEAPS: dict[str, tuple[Any, ...]] = {
    "ball with restitution": ("sphere", 1, BOUNCY),
    "balls with friction": ("sphere", 3, DAMPED, BRISTLES),
    "boxes with friction": ("box", 2, DAMPED, SMOOTH),
    "plates": ("plate", 2, DAMPED),
    "plates with friction": ("plate", 3, DAMPED, BRISTLES),
    "facets with friction": ("facet", 3, DAMPED, BRISTLES),
    "plates with friction across": ("plate", 3, DAMPED, BRISTLES | {"across": 2.0}),
}


def strip(spatial: bool) -> SegmentSystem:
    """Panels in segments, folded so far that they touch soon, with friction and a drive."""
    data: dict[str, Any] = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 1e-4, "panels": 6, "fold_angle": 1.4, "segments_per_panel": 4,
        },
        "material": {"young": 3e9, "density": 800.0, "damping": 1e-4},
        "crease": {"law": "linear", "stiffness": 0.02},
        "contact": {"stiffness": 1e6, "damping": 1.0},
        "friction": {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": 0.01, "v_dynamic": 0.02},
        "drive": [{"crease": 3, "speed": 0.4, "travel": 0.04}],
    }  # fmt: skip
    return compile_scene(build_strip(Case.model_validate(data)), spatial)


def made(name: str, spatial: bool, **more: Any) -> SegmentSystem:
    """A system in its initial state."""
    kind, count, *laws = HEAPS[name]
    return heap(kind, count, spatial, *laws, **more)


def started(system: SegmentSystem, fixed_step: float | None) -> tuple[GeneralizedAlpha, np.ndarray]:
    """A solver at the start, and the array `balance` of `march` without a bound on the energy error."""
    q, u = system.initial()
    system.commit(0.0, q, u)
    solver = GeneralizedAlpha(system, 0.0, q, u, 1e-4, fixed_step=fixed_step, first=system.observe(0.0, q, u))
    return solver, opened(solver)


@pytest.mark.parametrize("fixed_step", [None, 1e-4], ids=["controlled", "fixed"])
@pytest.mark.parametrize("spatial", [False, True], ids=["plane", "space"])
@pytest.mark.parametrize("name", HEAPS)
def test_same_steps(name: str, spatial: bool, fixed_step: float | None) -> None:
    """States, counts, energies, forces of pairs and memory agree after an impact, and all steps before it."""
    (compiled, balance), (python, others) = (started(made(name, spatial), fixed_step) for _ in range(2))
    assert compiled.marches
    count = 80
    records, expected = compiled.march(balance, 1.0, count, every=True), python.records(count)
    assert march(python.model, python.motion, python.rules, others, 1.0, count, expected) == STEPPED
    check_same_state(compiled, python, count)
    turnover = others[balances.TURNOVER]
    assert np.abs(balance[:9] - others[:9]).max() < 1e-6 * turnover
    known = np.arange(records.shape[1]) != STEADY
    assert np.abs(records - expected)[:, known].max() < 1e-5 * np.abs(expected).max()
    assert np.abs(compiled.pair_energy - python.motion.all_pairs).max() < 1e-6 * turnover
    assert balance[balances.DISSIPATED] > 1e-3 * turnover
    memory = python.system.memory()
    assert compiled.system.memory() == pytest.approx(memory, rel=1e-4, abs=1e-6 * np.abs(memory).max())


@pytest.mark.parametrize("name", ["balls with friction", "plates with friction"])
def test_a_run_saves_the_same_states(name: str) -> None:
    """Saved states, contact forces at all steps, and energies of pairs of a whole run."""
    found = []
    for arrays in (True, False):
        system, saved = made(name, False), list[Any]()
        if not arrays:
            system.__dict__["arrays"] = lambda ready: None
        statistics, balance = simulate(system, Settings("generalized-alpha", 1e-4, 0.03), [0.0, 0.01, 0.03], saved.append)
        found.append((statistics, balance, saved))
    (statistics, balance, saved), (others, other, expected) = found
    assert statistics.steps == pytest.approx(others.steps, rel=0.05)  # restart points differ
    peaks = [max(float(point.pair_force.max()) for point in run.points) for run in (statistics, others)]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-3)
    assert np.abs(balance.pair_energy - other.pair_energy).max() < 1e-3 * other.turnover
    for one, two in zip(saved, expected, strict=True):
        assert np.abs(one.q - two.q).max() < 1e-3 * SIZE
        assert np.abs(one.observation.pairs.force - two.observation.pairs.force).max() < 1e-2 * peaks[1]


def test_bodies_that_meet_later() -> None:
    """Two bodies that come near each other in a step get a block in the tangent, and the kernel continues."""
    system = made("balls with friction", False, apart=0.1)
    solver, balance = started(system, None)
    assert solver.marches
    before = solver._arrays
    solver.march(balance, 0.15, 2000)
    assert solver.t == 0.15
    assert system.observe(0.15, solver.q, solver.u).pairs.force.shape == (6,)
    assert solver._arrays is not before
    assert balance[balances.WORST] < 1e-2 * balance[balances.TURNOVER]


def test_a_step_whose_iterations_always_reach_other_bodies(monkeypatch: pytest.MonkeyPatch) -> None:
    """Iterations that diverge reach bodies without a block each time; such a step is shortened like other failed steps."""
    system = made("balls with friction", False, apart=0.1)
    solver, balance = started(system, None)
    solver.march(balance, 0.15, 3)
    begun, tried = solver.t, []

    def lacks(solver: GeneralizedAlpha, *_: Any) -> int:
        assert len(tried) < 100
        tried.append(solver.motion.sizes[solver.following])
        return UNABLE

    monkeypatch.setattr(GeneralizedAlpha, "_march", lacks)
    monkeypatch.setattr(type(system), "lacks_arrays", lambda system: True)
    solver.march(balance, 0.15, 2000)
    assert tried[:3] == [tried[0], tried[0], 0.25 * tried[0]]
    assert solver.steps == 4 and begun < solver.t < begun + tried[0]


@pytest.mark.parametrize("spatial", [False, True], ids=["plane", "space"])
def test_panels_in_segments_touch(spatial: bool) -> None:
    """The same steps as in Python while panels of a strip come into contact; forces of drive and contact at each step."""
    (compiled, balance), (python, others) = (started(strip(spatial), None) for _ in range(2))
    assert compiled.marches
    count = 90
    records, expected = compiled.march(balance, 1.0, count, every=True), python.records(count)
    march(python.model, python.motion, python.rules, others, 1.0, count, expected)
    assert compiled.steps == python.steps == count
    assert compiled.rejected == python.rejected
    assert compiled.t == pytest.approx(python.t, rel=1e-6)
    assert np.abs(compiled.q - python.q).max() < 1e-6
    assert expected[:, 8:-1].max() > 0.0
    assert np.abs(records[:, 6:13] - expected[:, 6:13]).max() < 1e-4 * np.abs(expected[:, 6:13]).max()
    assert np.abs(balance[:9] - others[:9]).max() < 1e-5 * others[balances.TURNOVER]
    pairs = python.system.observe(python.t, python.q, python.u).pairs
    assert compiled.system.observe(compiled.t, compiled.q, compiled.u).pairs.gap == pytest.approx(pairs.gap, abs=1e-6)


def test_a_drive_presses_a_ball_on_the_floor() -> None:
    """Forces of the drive include those of the contact."""
    drive = Drive(body="body 0", direction=(0.0, 0.0, -1.0), travel=1.1e-3, speed=0.05)
    (compiled, balance), (python, others) = (
        started(made("balls with friction", False, drives=(drive,)), None) for _ in range(2)
    )
    records, expected = compiled.march(balance, 0.02, 60, every=True), python.records(60)
    march(python.model, python.motion, python.rules, others, 0.02, 60, expected)
    assert compiled.steps == python.steps
    assert np.abs(expected[: len(records), 7]).max() > 1.0
    assert records[:, 6:8] == pytest.approx(expected[: len(records), 6:8], rel=1e-5, abs=1e-9)
