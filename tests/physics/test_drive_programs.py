"""Programs of drives against closed forms: torsion spring, cycle of a spring, and the moment of a turned body."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from fsm.errors import NotConverged
from fsm.model.bodies.drive import run_up
from tests.physics.test_steps import BLOCK, run

HEAD = """
[[scene.bodies]]
name = "rotor"
mass = 0.2
inertia = [1e-3, 1e-3, 1e-3]
[[scene.bodies]]
name = "handle"
mass = 0.5
inertia = [2e-3, 2e-3, 2e-3]
"""
SPRINGS = """
[[scene.elements]]
name = "bearing"
inner = "rotor"
outer = "ground"
translation = [1e4, 1e4, 1e4]
rotation = [0.0, {first}, 0.0]
[[scene.elements]]
name = "shaft"
inner = "handle"
outer = "rotor"
translation = [1e4, 1e4, 1e4]
rotation = [0.0, {second}, 0.0]
{swing}
"""


@pytest.mark.parametrize("spatial", [False, True])
def test_a_turn_on_two_torsion_springs_in_series(tmp_path: Path, spatial: bool) -> None:
    """Moment k1 k2/(k1 + k2) times the turn, and the energy is half of moment times turn."""
    text = HEAD + SPRINGS.format(first=3.0, second=1.5, swing="")
    text += '[[drive]]\nbody = "handle"\nturn = "100 deg"\nrate = "20 deg/s"\n[solve]\nmethod = "static"\n'
    solution, summary = run(tmp_path, text, f"solve.spatial={str(spatial).lower()}", "scene.elements.0.rotation=[9, 3, 9]")
    turn = solution.travel[:, 0]
    assert turn[-1] == pytest.approx(math.radians(100.0), rel=1e-12)
    np.testing.assert_allclose(solution.force[:, 0], turn, atol=1e-9)  # 3 * 1.5/4.5 = 1 N m/rad
    stored = sum(solution.energy[name] for name in ("panels", "creases", "drives"))
    np.testing.assert_allclose(stored, 0.5 * turn**2, atol=1e-9)
    assert summary["energy_error"] < 1e-6
    assert solution.layout.drive_names == ("handle (turn)",)
    heading = (tmp_path / "out" / "force.csv").read_text(encoding="utf-8").splitlines()[0]
    assert heading.startswith("turn (rad),moment (N m)")


@pytest.mark.parametrize("method", ["static", "generalized-alpha"])
def test_a_failed_step_of_a_turn_states_an_angle(tmp_path: Path, method: str) -> None:
    """The message has the turn in degrees and the travel of another drive in mm."""
    text = HEAD + SPRINGS.format(first=3.0, second=1.5, swing="")
    text += '[[scene.bodies]]\nname = "slide"\nmass = 1.0\ninertia = [1e-3, 1e-3, 1e-3]\n'
    text += '[[drive]]\nbody = "handle"\nturn = "100 deg"\nrate = "1 rad/s"\n'
    text += '[[drive]]\nbody = "slide"\ntravel = "1 m"\nspeed = "0.5 m/s"\ndirection = [1, 0, 0]\n'
    with pytest.raises(NotConverged) as caught:
        run(tmp_path, text, f"solve.method={method}", "solve.max_steps=8")
    found = re.match(r"at t = ([\d.e-]+) s \(turn ([\d.e-]+) deg, travel ([\d.e-]+) (mm|nm)\)", str(caught.value))
    assert found is not None, caught.value
    t, turn, travel = map(float, found.groups()[:3])
    end = math.radians(100.0)
    assert math.radians(turn) == pytest.approx(run_up(1.0, end, 0.01 * end).at(t)[0], rel=1e-3)
    assert travel * {"mm": 1e-3, "nm": 1e-9}[found[4]] == pytest.approx(run_up(0.5, 1.0, 0.01).at(t)[0], rel=1e-3)


def test_a_cycle_of_a_linear_spring_returns_to_zero_energy(tmp_path: Path) -> None:
    """A drive goes to a position, back beyond the start, and to the start, by a table: the force is k x, and no energy is
    left."""
    text = BLOCK + """
[[drive]]
body = "hand"
direction = [1, 0, 0]
time = { kind = "table", time = [0, 1, 3, 4], travel = ["0 mm", "20 mm", "-10 mm", "0 mm"] }
[solve]
method = "static"
"""
    solution, summary = run(tmp_path, text)
    travel = solution.travel[:, 0]
    assert travel.max() == pytest.approx(0.02) and travel.min() == pytest.approx(-0.01)
    np.testing.assert_allclose(solution.force[:, 0], 200.0 * travel, atol=1e-7)
    stored = solution.energy["panels"]
    np.testing.assert_allclose(stored, 100.0 * travel**2, atol=1e-9)
    assert abs(stored[-1]) < 1e-12 and abs(solution.energy["work"][-1]) < 1e-6 * stored.max()
    assert summary["peak_force"] == pytest.approx(4.0, rel=1e-6)


@pytest.mark.parametrize("spatial", [False, True])
def test_the_moment_that_accelerates_a_turned_body(tmp_path: Path, spatial: bool) -> None:
    """A body on an arm about an axis: J + m r^2 times the angular acceleration, and the centripetal force does no work."""
    text = """
[[scene.bodies]]
name = "rider"
mass = 0.1
inertia = [1e-4, 1e-4, 1e-4]
position = [5.0, 0.0, 0.0]
[[scene.bodies]]
name = "arm"
mass = 2.0
inertia = [0.1, 0.3, 0.3]
position = [0.6, 0.0, 0.2]
[[drive]]
body = "arm"
turn = "2 rev"
point = [0.1, 0.0, 0.2]
time = { kind = "ramp", end = "2 s" }
[solve]
method = "generalized-alpha"
rtol = 1e-8
"""
    solution, summary = run(tmp_path, text, f"solve.spatial={str(spatial).lower()}")
    t = solution.time
    x = t / 2.0
    acceleration = 4 * math.pi * 6.0 * (1.0 - 2.0 * x) / 4.0
    inside = (t > 0.0) & (t < 2.0)
    np.testing.assert_allclose(solution.force[inside, 0], (0.3 + 2.0 * 0.25) * acceleration[inside], rtol=1e-9, atol=1e-9)
    speed = 4 * math.pi * 6.0 * x * (1.0 - x) / 2.0
    np.testing.assert_allclose(solution.energy["kinetic"], 0.5 * 0.8 * speed**2, atol=1e-9)
    assert summary["energy_error"] < 1e-6
