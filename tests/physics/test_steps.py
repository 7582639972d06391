"""Steps of a run: each begins with the end of the previous step; comparison with closed forms, and continuation of a stopped
run."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import fsm.run.recorder
from fsm.case.loading.load_case import load_case
from fsm.errors import NotConverged
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.run.run_case import run_case
from tests.runs import run
from tests.scene_text import BLOCK_AND_HAND, ROPE, spring

BLOCK = BLOCK_AND_HAND + spring("wall", "block", "ground", 300.0) + ROPE
PULL = """
[[step]]
name = "pull"
kind = "static"
[[step.drive]]
body = "hand"
direction = [1, 0, 0]
travel = "30 mm"
speed = "10 mm/s"
"""


def place(solution: Solution, body: str) -> np.ndarray:
    """(x, z, phi) of a body at all records of a planar scene."""
    k = solution.layout.body_names.index(body)
    return solution.q[:, 3 * k : 3 * k + 3]


@pytest.mark.parametrize("spatial", [False, True])
def test_pull_then_let_go_gives_the_free_vibration_of_two_masses(tmp_path: Path, spatial: bool) -> None:
    """Both masses start from rest at 20 and 30 mm, and move as the sum of both natural modes."""
    text = BLOCK + PULL + '[[step]]\nname = "go"\nkind = "dynamic"\nduration = "0.6 s"\nrelease = ["hand"]\n'
    text += '[solve]\nrtol = 1e-8\n'
    solution, summary = run(tmp_path, text, f"solve.spatial={str(spatial).lower()}")
    size = 7 if spatial else 3
    x = np.array([solution.q[:, size * solution.layout.body_names.index(name)] for name in ("block", "hand")]).T
    mass, stiffness = np.diag([2.0, 1.0]), np.array([[900.0, -600.0], [-600.0, 600.0]])
    squared, modes = np.linalg.eigh(np.diag(np.diag(mass) ** -0.5) @ stiffness @ np.diag(np.diag(mass) ** -0.5))
    modes = np.diag(np.diag(mass) ** -0.5) @ modes
    start = np.array([0.02, 0.03])
    moving = solution.step == 2
    t = solution.time[moving] - summary["step"][1]["start_time"]
    parts = modes.T @ mass @ start
    exact = (modes * parts) @ np.cos(np.sqrt(squared)[:, None] * t)
    np.testing.assert_allclose(x[moving].T, exact, atol=3e-5)
    assert summary["step"][0]["peak_force"] == pytest.approx(200.0 * 0.03, rel=1e-6)
    assert summary["step"][1]["peak_force"] == 0.0
    assert summary["peak_force"] == pytest.approx(6.0, rel=1e-6)
    assert summary["energy_error"] < 1e-5
    assert solution.layout.step_names == ("pull", "go")
    assert list(np.unique(solution.step)) == [1, 2]


def test_load_latch_unload_and_reverse(tmp_path: Path) -> None:
    """A load that ramps, a body that is held, the end of the load, and a drive that returns."""
    text = BLOCK + PULL + """
[[step]]
name = "press"
kind = "static"
[[step.load]]
name = "weight"
body = "block"
force = [0, 0, -9]
[[step]]
name = "more"
kind = "static"
[[step.load]]
name = "weight"
body = "block"
force = [0, 0, -18]
[[step]]
name = "latch"
kind = "static"
hold = ["block"]
release = ["weight"]
[[step]]
name = "free"
kind = "static"
release = ["block"]
[[step]]
name = "relax"
kind = "relax"
[[step]]
name = "back"
kind = "static"
[[step.drive]]
body = "hand"
direction = [-1, 0, 0]
travel = "30 mm"
speed = "10 mm/s"
"""
    solution, summary = run(tmp_path, text)
    z, x = place(solution, "block")[:, 1], place(solution, "block")[:, 0]
    last = {number: np.flatnonzero(solution.step == number)[-1] for number in range(1, 8)}
    assert z[last[2]] == pytest.approx(-9.0 / 900.0, rel=1e-6)
    assert z[last[3]] == z[last[4]] == pytest.approx(-18.0 / 900.0, rel=1e-6)
    middle = last[2] + (last[3] - last[2]) // 2
    assert z[middle] == pytest.approx(-13.5 / 900.0, rel=1e-2)  # the load changes linearly from one value to the next
    assert abs(z[last[6]]) < 1e-9 and x[last[6]] == pytest.approx(0.02, rel=1e-6)
    assert np.abs(place(solution, "block")[-1]).max() < 1e-9  # the body is back at its start
    assert solution.travel[-1, 0] == pytest.approx(0.0, abs=1e-12)
    assert solution.travel[:, 0].max() == pytest.approx(0.03)
    # the energy of 18 N on 900 N/m is dissipated where the latch is released; all other steps conserve it
    assert solution.energy["dissipated"][-1] == pytest.approx(0.5 * 18.0**2 / 900.0, rel=1e-5)
    stored = solution.energy["panels"]
    np.testing.assert_allclose(stored[last[1]], 0.5 * 200.0 * 0.03**2, rtol=1e-6)
    assert abs(stored[-1]) < 1e-12
    assert summary["energy_error"] < 1e-6
    assert [step["name"] for step in summary["step"]] == ["pull", "press", "more", "latch", "free", "relax", "back"]


def test_modes_about_the_state_reached(tmp_path: Path) -> None:
    """A lever pinned at its middle under a dead force at its end: k w = F L cos w, and J omega^2 = k + F L sin w."""
    text = """
[[scene.bodies]]
name = "lever"
mass = 0.5
inertia = [1e-3, 1e-3, 1e-3]
[[scene.elements]]
name = "pin"
inner = "lever"
outer = "ground"
translation = [1e5, 1e5, 1e5]
rotation = [0, 0.4, 0]
[[step]]
name = "press"
kind = "static"
[[step.load]]
body = "lever"
point = [0.2, 0, 0]
force = [0, 0, -3]
[[step]]
name = "listen"
kind = "modes"
modes = 1
"""
    solution, summary = run(tmp_path, text)
    angle = place(solution, "lever")[-1, 2]  # about +y, which moves the end down
    assert 0.4 * angle == pytest.approx(3 * 0.2 * math.cos(angle), rel=1e-6)
    (found,) = summary["step"][1]["frequencies_hz"]
    assert found == pytest.approx(math.sqrt((0.4 + 3 * 0.2 * math.sin(angle)) / 1e-3) / (2 * math.pi), rel=1e-6)
    assert solution.modes is not None
    np.testing.assert_allclose(solution.modes.frequency, [found])
    assert list(solution.modes.step) == [2]
    np.testing.assert_allclose(solution.modes.increment, [[0.0, 0.0, 1.0]], atol=1e-9)


CABLE = """
[[scene.cables]]
name = "wire"
start = [0, 0, 0]
end = [1, 0, 0]
diameter = "1 mm"
young = "70 GPa"
density = 2700
elements = 12
held = ["start"]
[[scene.bodies]]
name = "clamp"
mass = 0.1
inertia = [1e-5, 1e-5, 1e-5]
position = [1.01, 0, 0]
[[scene.frames]]
name = "tip"
on = "wire"
at = [1.0]
[[scene.elements]]
name = "grip"
inner = "tip"
outer = "clamp"
point_outer = [-0.01, 0, 0]
translation = [1e7, 1e7, 1e7]
[[step]]
name = "tension"
kind = "static"
[[step.drive]]
body = "clamp"
direction = [1, 0, 0]
travel = "2 mm"
speed = "1 mm/s"
[[step]]
name = "listen"
kind = "modes"
modes = 2
[[step]]
name = "let go"
kind = "dynamic"
duration = "2 ms"
release = ["clamp"]
"""


def test_a_wire_is_tensioned_heard_and_let_go(tmp_path: Path) -> None:
    """Taut string sqrt(T/m)/(2 L), in two steps; after the release, the wire pulls its clamp back with its tension."""
    solution, summary = run(tmp_path, CABLE)
    area = math.pi * 1e-6 / 4
    tension = summary["step"][0]["final_force"]
    assert tension == pytest.approx(70e9 * area * 2e-3, rel=5e-3)
    exact = math.sqrt(tension / (2700 * area / 1.002)) / (2 * 1.002)
    assert summary["step"][1]["frequencies_hz"] == pytest.approx([exact, exact], rel=3e-3)
    moving = solution.step == 3
    t = solution.time[moving] - summary["step"][1]["end_time"]
    x = solution.q[moving, 7 * solution.layout.body_names.index("clamp")]
    early = t < 2e-4  # until the wave returns from the far end, the tension of the wire pulls the clamp
    # m v' = -T + (impedance) v, with the impedance of the wire sqrt(E rho) A
    impedance = math.sqrt(70e9 * 2700) * area
    decay = impedance / 0.1
    away = tension / impedance * (t[early] - (1.0 - np.exp(-decay * t[early])) / decay)
    np.testing.assert_allclose(1.012 - x[early], away, rtol=0.02, atol=2e-7)
    assert summary["energy_error"] < 1e-5


STRIP = """
[strip]
length = "240 mm"
width = "40 mm"
thickness = "0.3 mm"
panels = 4
fold_angle = "60 deg"
segments_per_panel = 4
held = [1]
[material]
young = "3 GPa"
density = "800 kg/m^3"
damping = "2 ms"
[crease]
law = "linear"
stiffness = "9 N mm/rad"
[[drive]]
crease = 3
direction = [1, 0, 0]
speed = "5 mm/s"
travel = "20 mm"
"""


def test_a_released_strip_comes_back(tmp_path: Path) -> None:
    """A pulled crease line that is released swings back; after "relax" the strip is as folded, and a second pull gives the
    same force."""
    text = STRIP + """
[[step]]
name = "pull"
kind = "static"
[[step]]
name = "swing"
kind = "dynamic"
duration = "50 ms"
release = ["crease 3"]
[[step]]
name = "rest"
kind = "relax"
"""
    solution, summary = run(tmp_path, text)
    start, end = solution.shape[0], solution.shape[-1]
    np.testing.assert_allclose(end, start, atol=2e-6)
    pulled = solution.shape[np.flatnonzero(solution.step == summary["step"].index(summary["step"][1]) + 1)[-1]]
    assert np.abs(pulled - start).max() > 0.01
    assert abs(solution.energy["creases"][-1]) < 1e-9
    assert summary["energy_error"] < 1e-4


def test_a_run_that_was_cut_goes_on_in_its_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run is stopped in the second dynamic step and resumed; the results agree to the last bit."""
    text = BLOCK + PULL + """
[[step]]
name = "go"
kind = "dynamic"
duration = "0.3 s"
release = ["hand"]
[[step]]
name = "stop"
kind = "dynamic"
duration = "0.3 s"
hold = ["block"]
"""
    whole, summary = run(tmp_path, text)
    monkeypatch.setattr(fsm.run.recorder, "CHECKPOINT_EVERY", 0.0)
    stopped = tmp_path / "stopped"

    def stop(fraction: float) -> None:
        if fraction * 3.63 > 3.5:
            raise KeyboardInterrupt

    loaded = load_case(tmp_path / "case.toml")
    with pytest.raises(KeyboardInterrupt):
        run_case(loaded, stopped, progress=stop)
    again = run_case(loaded, stopped, progress=False, resume=True)
    resumed = read_solution(stopped / "result.h5")
    np.testing.assert_array_equal(resumed.q, whole.q)
    np.testing.assert_array_equal(resumed.step, whole.step)
    np.testing.assert_array_equal(resumed.energy["dissipated"], whole.energy["dissipated"])
    same = ("name", "kind", "steps", "newton_iterations", "records")
    for one, other in zip(again["step"], summary["step"], strict=True):
        assert [one[key] for key in same] == [other[key] for key in same]


def test_a_latch_closes_where_it_is(tmp_path: Path) -> None:
    """A body is pulled by 30 mm, latched to the ground with 700 N/m, and released: both springs share the remaining
    displacement."""
    text = BLOCK + """
[[scene.elements]]
name = "latch"
inner = "block"
outer = "ground"
translation = [700.0, 700.0, 700.0]
steps = ["let go", "rest"]
latch = true
""" + PULL + """
[[step]]
name = "let go"
kind = "static"
release = ["hand"]
[[step]]
name = "rest"
kind = "relax"
"""
    solution, _ = run(tmp_path, text)
    x = place(solution, "block")[:, 0]
    assert x[np.flatnonzero(solution.step == 1)[-1]] == pytest.approx(0.02, rel=1e-6)
    assert x[-1] == pytest.approx(0.02 * 700.0 / 1000.0, rel=1e-6)


def test_contact_begins_and_ends_with_a_step(tmp_path: Path) -> None:
    """A ball on a soft spring rests on the floor, moves through it without contact, and is raised and dropped on it."""
    text = """
[scene.contact]
law = "linear"
stiffness = 1e6
damping = 1000
[[scene.obstacles]]
name = "floor"
shape = "plane"
[[scene.obstacles]]
name = "ball"
shape = "sphere"
radius = 0.05
body = "core"
[[scene.pairs]]
first = "ball"
second = "floor"
[[scene.bodies]]
name = "core"
mass = 1.0
inertia = [1e-3, 1e-3, 1e-3]
position = [0, 0, 0.0501]
[[scene.elements]]
name = "spring"
inner = "core"
outer = "ground"
point_outer = [0, 0, 0.0501]
translation = [200, 200, 200]
rotation = [1, 1, 1]
translation_damping = [0.2, 0.2, 0.2]
[[step]]
name = "press"
kind = "static"
[[step.load]]
name = "weight"
body = "core"
force = [0, 0, -2]
[[step]]
name = "sink"
kind = "relax"
contact = false
[[step]]
name = "lift"
kind = "static"
contact = false
release = ["weight"]
[[step]]
name = "drop"
kind = "dynamic"
duration = "0.05 s"
[[step.load]]
name = "weight"
body = "core"
force = [0, 0, -2]
"""
    solution, summary = run(tmp_path, text)
    z = place(solution, "core")[:, 1] - 0.0501
    last = {number: np.flatnonzero(solution.step == number)[-1] for number in range(1, 5)}
    assert z[last[1]] == pytest.approx(-1e-4, rel=0.3)
    assert z[last[2]] == pytest.approx(-2.0 / 200.0, rel=1e-6)
    assert abs(z[last[3]]) < 1.01 * 0.2 * 0.01 / 200.0  # displacement that the damper holds back at 10 mm/s
    assert solution.pair_force[last[1], 0] == pytest.approx(2.0 + 200.0 * z[last[1]], rel=1e-3)
    assert solution.pair_force[last[2], 0] == 0.0
    again = solution.step == 4  # the floor stops the ball, a tenth of a millimetre below
    assert z[again].min() > -2e-4
    assert solution.pair_force[again].max() > 2.0
    assert summary["energy_error"] < 1e-3


def test_a_failed_step_names_itself(tmp_path: Path) -> None:
    text = BLOCK + PULL + '[[step]]\nname = "quick"\nkind = "dynamic"\nduration = "9 s"\nsolve = { max_steps = 5 }\n'
    text += 'release = ["hand"]\n'
    with pytest.raises(NotConverged, match=r"^step 'quick' \(dynamic\): "):
        run(tmp_path, text)


def test_the_summary_on_disk_has_the_steps(tmp_path: Path) -> None:
    run(tmp_path, BLOCK + PULL)
    written = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    (step,) = written["step"]
    assert (step["name"], step["kind"], step["start_time"]) == ("pull", "static", 0.0)
    assert step["peak_force"] == written["peak_force"] == pytest.approx(6.0, rel=1e-6)


STRUT = """
[strip]
length = "400 mm"
width = "50 mm"
thickness = "0.2 mm"
panels = 4
fold_angle = "75 deg"
segments_per_panel = 4
[material]
young = "4 GPa"
density = "1400 kg/m^3"
damping = "0.5 ms"
[crease]
law = "linear"
stiffness = "0.02 N m/rad"
[[step]]
name = "pull"
kind = "static"
[[step.drive]]
crease = 2
direction = [0, 0, 1]
speed = "20 mm/s"
travel = "3 mm"
"""


def test_a_step_and_the_whole_run_state_one_peak(tmp_path: Path) -> None:
    """Panels that buckle at the start cause a spike of the dynamic force, which is no peak of the step either."""
    solution, summary = run(tmp_path, STRUT)
    (pull,) = (step for step in summary["step"] if step["name"] == "pull")
    assert solution.curve is not None
    assert solution.curve.force.max() > 2.0 * summary["peak_force"]
    assert pull["peak_force"] == summary["peak_force"]
    assert pull["peak_travel"] == summary["peak_travel"]
    assert pull["peak_kind"] == summary["peak_kind"] == "quasi-static"
