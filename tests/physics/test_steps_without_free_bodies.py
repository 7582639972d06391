"""Steps in which every body is held or driven, and steps that begin late or with a first touch."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from fsm.case.models.time_program import Cycle, Ramp
from fsm.model.bodies.drive import Travel, parts, run_up, time_function
from fsm.results.solution import Solution
from tests.runs import run

MASS, STIFFNESS = 2.0, 300.0
BLOCK = f"""
gravity = [0, 0, -9.81]
[[scene.bodies]]
name = "block"
mass = {MASS}
inertia = [0.1, 0.1, 0.1]
[[scene.elements]]
name = "spring"
inner = "ground"
outer = "block"
translation = [{STIFFNESS}, {STIFFNESS}, {STIFFNESS}]
rotation = [1.0, 1.0, 1.0]
[save]
channels = ["support.block.force", "body.block.velocity"]
"""
GO = '[[step]]\nname = "go"\nkind = "dynamic"\nduration = "0.3 s"\nrelease = ["block"]\n'


def channel(solution: Solution, name: str) -> np.ndarray:
    return solution.channels[name].values


def test_a_body_is_pulled_alone_and_let_go(tmp_path: Path) -> None:
    """The force of the drive is k x at each record; the body then swings with the amplitude of the pull."""
    pull = '[[step]]\nname = "pull"\nkind = "static"\n[[step.drive]]\nbody = "block"\n'
    pull += 'direction = [1, 0, 0]\ntravel = "30 mm"\nspeed = "10 mm/s"\n'
    solution, summary = run(tmp_path, BLOCK.replace("gravity", "# gravity") + pull + GO)
    pulled = solution.step == 1
    assert pulled.sum() > 100
    assert np.ptp(solution.travel[pulled, 0]) == pytest.approx(0.03)
    np.testing.assert_allclose(solution.force[pulled, 0], STIFFNESS * solution.travel[pulled, 0], atol=1e-9)
    np.testing.assert_allclose(solution.energy["work"][pulled][-1], 0.5 * STIFFNESS * 0.03**2, rtol=1e-9)
    free = solution.step == 2
    t = solution.time[free] - summary["step"][1]["start_time"]
    np.testing.assert_allclose(solution.q[free, 0], 0.03 * np.cos(math.sqrt(STIFFNESS / MASS) * t), atol=1e-4)
    assert summary["energy_error"] < 1e-4


def test_a_held_body_has_its_weight_as_reaction(tmp_path: Path) -> None:
    hold = '[[step]]\nname = "hold"\nkind = "dynamic"\nduration = "0.1 s"\nhold = ["all"]\n'
    solution, _ = run(tmp_path, BLOCK + hold + GO.replace("block", "all"))
    force, held = channel(solution, "support.block.force"), solution.step == 1
    np.testing.assert_allclose(force[held], np.tile([0.0, 0.0, 9.81 * MASS], (int(held.sum()), 1)), rtol=1e-12)
    assert not force[~held].any()


@pytest.mark.parametrize("method", ["generalized-alpha", "BDF"])
def test_a_body_that_is_shaken_alone(tmp_path: Path, method: str) -> None:
    """m x'' + k x is the force, also where the velocity is zero; the start of the cycle is no quasi-static peak."""
    shake = '[[step]]\nname = "shake"\nkind = "dynamic"\nsave = { interval = "1 ms" }\n'
    shake += f'solve = {{ method = "{method}" }}\n[[step.drive]]\nbody = "block"\ndirection = [1, 0, 0]\n'
    shake += 'travel = "10 mm"\ntime = { kind = "cycle", period = "0.1 s", cycles = 2 }\n'
    solution, summary = run(tmp_path, BLOCK + shake + GO)
    now = (solution.step == 1) & (solution.time < 0.2)
    w, t = 20.0 * math.pi, solution.time[now]
    x, speed = 0.005 * (1.0 - np.cos(w * t)), 0.005 * w * np.sin(w * t)
    exact = MASS * 0.005 * w**2 * np.cos(w * t) + STIFFNESS * x
    assert now.sum() == 200
    np.testing.assert_allclose(solution.force[now, 0], exact, atol=1e-9)
    np.testing.assert_allclose(channel(solution, "support.block.force")[now, 0], exact, atol=1e-9)
    np.testing.assert_allclose(channel(solution, "body.block.velocity")[now, 0], speed, atol=1e-12)
    assert summary["peak_kind"] == "dynamic"


WALL = """
[contact]
stiffness = 1e7
[[obstacle]]
name = "wall"
shape = "plane"
position = ["100 mm", 0, 0]
orientation = [0.7071067811865476, 0, -0.7071067811865476, 0]
[[scene.bodies]]
name = "hand"
mass = "1 kg"
inertia = [1e-2, 1e-2, 1e-2]
plate = { length = "20 mm", width = "20 mm", thickness = "3 mm" }
[[scene.bodies]]
name = "head"
position = ["50 mm", 0, 0]
mass = "0.5 kg"
inertia = [1e-2, 1e-2, 1e-2]
plate = { length = "20 mm", width = "20 mm", thickness = "3 mm" }
[[scene.elements]]
name = "spring"
inner = "hand"
outer = "head"
point_inner = ["25 mm", 0, 0]
point_outer = ["-25 mm", 0, 0]
translation = [100, 100, 100]
rotation = [1, 1, 1]
[[scene.surfaces]]
name = "head side"
bodies = ["head"]
[[scene.pairs]]
first = "head side"
second = "wall"
"""
DRIVE = 'body = "hand"\ndirection = [1, 0, 0]\ntravel = "60 mm"\nspeed = "1 m/s"\n'


@pytest.mark.parametrize("wait", [None, "1 s", "1 h"])
def test_a_free_body_is_pushed_to_a_wall(tmp_path: Path, wait: str | None) -> None:
    """No energy is turned over before the first touch, and steps that begin late are as fine as those at the start."""
    if wait is None:
        text = WALL + "[[drive]]\n" + DRIVE + '[solve]\nmethod = "static"\n'
    else:
        text = WALL + f'[[step]]\nname = "wait"\nkind = "static"\nduration = "{wait}"\nhold = ["all"]\n'
        text += '[[step]]\nname = "push"\nkind = "static"\nrelease = ["all"]\n[[step.drive]]\n' + DRIVE
    solution, summary = run(tmp_path, text)
    assert summary["events"] == []
    travel, force = solution.travel[:, 0], solution.force[:, 0]
    depth = -solution.pair_gap[:, 0]
    touching = travel > 0.039
    np.testing.assert_allclose(force[touching], (100.0 * (travel - 0.0385 - depth))[touching], rtol=1e-6)
    assert force[-1] == pytest.approx(2.13, rel=0.01)


def test_a_late_motion_is_judged_after_a_tenth_of_its_step(tmp_path: Path) -> None:
    """At the release no energy has been turned over, so relative errors are large."""
    hold = '[[step]]\nname = "hold"\nkind = "dynamic"\nduration = "0.1 s"\nhold = ["all"]\n'
    go = GO.replace("block", "all") + 'solve = { method = "BDF" }\n'
    solution, summary = run(tmp_path, BLOCK + hold + go)
    w = math.sqrt(STIFFNESS / MASS)
    free = solution.step == 2
    exact = -9.81 / w**2 * (1.0 - np.cos(w * (solution.time[free] - 0.1)))
    np.testing.assert_allclose(solution.q[free, 1], exact, atol=1e-5)
    assert summary["energy_error"] < 1e-3


def test_the_distance_of_a_short_program_late_in_a_run_is_exact() -> None:
    def timed(function: Cycle | Ramp, amount: float) -> Travel:
        return Travel(time_function(function).scaled(amount).pieces)

    cycle = timed(Cycle(kind="cycle", period=0.01, cycles=5, form="alternating"), 0.002)
    ramp = timed(Ramp(kind="ramp", end=0.05), 0.03)
    whole = parts([(0.0, 1.0, run_up(0.01, 0.02, 0.0002)), (5000.0, 1.0, cycle), (9000.0, -1.0, ramp)])
    assert whole.travel == pytest.approx(0.02 + 5 * 4 * 0.002 + 0.03, rel=1e-9)
    assert whole.gone(5000.025) == pytest.approx(0.02 + 10 * 0.002, rel=1e-9)
    assert whole.speed == pytest.approx(0.002 * 2.0 * math.pi / 0.01, rel=1e-6)
    assert whole.time_of(whole.gone(5000.0) + 0.002) == pytest.approx(5000.0025, abs=1e-9)
    turns = np.array([t for t in whole.reversals() if 5000.0 < t < 5000.05])
    np.testing.assert_allclose(turns, 5000.0025 + 0.005 * np.arange(10), atol=1e-9)
    many = timed(Cycle(kind="cycle", period=0.001, cycles=4000, form="alternating"), 0.002)
    assert many.travel == pytest.approx(4000 * 4 * 0.002, rel=1e-9)
