"""Changes at the beginning of a step: latches, loads, contacts, releases, and states far from equilibrium."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.analyses.deploy import Deployment
from fsm.case.loading.load_case import load_case
from fsm.case.models.loads import Drive
from fsm.errors import CaseError, NotConverged
from fsm.model.compile.compile_case import compile_case
from fsm.model.plan.plan import plan_of
from fsm.results.solution import Solution
from fsm.solve.settings import PathSettings
from tests.runs import run

BLOCK = """
[[scene.bodies]]
name = "block"
mass = 2.0
inertia = [0.1, 0.1, 0.1]
[[scene.elements]]
name = "spring"
inner = "ground"
outer = "block"
translation = [300, 300, 300]
rotation = [1, 1, 1]
[save]
channels = ["body.block.position", "energy.*"]
"""
LOCK = """
[[scene.elements]]
name = "lock"
inner = "ground"
outer = "block"
point_inner = ["30 mm", 0, 0]
translation = [700, 700, 700]
rotation = [1e6, 1e6, 1e6]
latch = true
"""
PUSH = '[[step.load]]\nname = "push"\nbody = "block"\nforce = [0, 0, {force}]\n'
ROD = """
gravity = [0, 0, -9.81]
[[scene.bodies]]
name = "block"
mass = 1.0
inertia = [1e-2, 1e-2, 1e-2]
[[scene.bodies]]
name = "rod"
position = ["100 mm", 0, 0]
mass = 0.1
inertia = [1e-4, 1e-4, 1e-4]
[[scene.elements]]
name = "hinge"
inner = "block"
outer = "rod"
point_outer = ["-100 mm", 0, 0]
translation = [1e5, 1e5, 1e5]
rotation = [10, 1, 10]
[[scene.elements]]
name = "spring"
inner = "ground"
outer = "block"
translation = [1e3, 1e3, 1e3]
rotation = [1, 1, 1]
[[step]]
name = "hold"
kind = "static"
hold = ["block"]
"""


def place(solution: Solution, body: str) -> np.ndarray:
    """(x, z, phi) of a body at all records of a planar scene."""
    k = solution.layout.body_names.index(body)
    return solution.q[:, 3 * k : 3 * k + 3]


@pytest.mark.parametrize("first", [True, False])
def test_a_latch_closes_without_force_also_in_the_first_step(tmp_path: Path, first: bool) -> None:
    """Two springs act in parallel from the position at which the latch closes: statics, and natural frequencies in the next
    step."""
    steps = ['[[step]]\nname = "before"\nkind = "static"\n' + PUSH.format(force=6)]
    steps += ['[[step]]\nname = "latched"\nkind = "static"\n' + PUSH.format(force=12)]
    steps += ['[[step]]\nname = "modes"\nkind = "modes"\nmodes = 3\n']
    acts = ["latched", "modes"]
    if first:
        steps, acts = steps[1:], ["latched", "modes"]
    solution, summary = run(tmp_path, BLOCK + LOCK + f"steps = {acts}\n".replace("'", '"') + "".join(steps))
    z = place(solution, "block")[:, 1]
    start = 0.0 if first else 6.0 / 300.0
    assert z[-1] == pytest.approx(start + (12.0 - 300.0 * start) / 1000.0, rel=1e-5)
    assert abs(place(solution, "block")[:, 0]).max() < 1e-6
    frequency = math.sqrt(1000.0 / 2.0) / (2.0 * math.pi)
    found = summary["step"][-1]["frequencies_hz"]
    assert min(abs(one / frequency - 1.0) for one in found) < 1e-6


def test_two_loads_with_one_name_have_two_columns(tmp_path: Path) -> None:
    steps = '[[step]]\nkind = "static"\nsolve = { method = "arc-length" }\n'
    steps += '[[step.load]]\nbody = "block"\nforce = [0, 0, 3]\n[[step.load]]\nbody = "block"\nforce = [6, 0, 0]\n'
    run(tmp_path, BLOCK + steps)
    with (tmp_path / "out" / "load.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert len(rows[0]) == 8
    assert [float(cell) for cell in rows[-1][4:]] == pytest.approx([3.0, 0.01, 6.0, 0.02])


def test_a_load_that_takes_the_place_of_another_is_said(tmp_path: Path) -> None:
    steps = '[[step]]\nkind = "static"\n[[step.load]]\nbody = "block"\nforce = [0, 0, 3]\n'
    path = tmp_path / "case.toml"
    path.write_text(BLOCK + 2 * steps, encoding="utf-8")
    case = load_case(path).case
    assert plan_of(case, compile_case(case)[0]).steps[1].described == ("loads block in place of 'load on block'",)


PLATE = """
[sheet]
kind = "plate"
length = "100 mm"
width = "20 mm"
thickness = "0.5 mm"
facets = "flexible"
mesh = [3, 1]
[[sheet.support]]
at = "edge left"
clamped = true
[material]
young = "3 GPa"
density = "1000 kg/m^3"
[save]
interval = "0.5 s"
"""


@pytest.mark.parametrize("later", ["", "follower = true\n"])
def test_a_load_of_a_later_step_replaces_a_load_on_a_sheet(tmp_path: Path, later: str) -> None:
    """The sheet ends in the equilibrium under the later load alone."""
    ends, forces = [], ('force = [0, 0, "10 mN"]', f'{later}force = [0, 0, "5 mN"]')
    for name, loads in (("both", forces), ("later", forces[1:])):
        steps = [f'[[step]]\nkind = "static"\n[[step.load]]\nname = "pull"\nat = "edge right"\n{load}\n' for load in loads]
        (tmp_path / name).mkdir()
        solution, _ = run(tmp_path / name, PLATE + "".join(steps))
        ends.append(solution.shape[-1])
        bent = np.abs(solution.shape[-1] - solution.shape[0]).max()
    assert bent > 1e-3
    np.testing.assert_allclose(*ends, atol=1e-5 * bent)


@pytest.mark.parametrize(
    ("time", "message"),
    [
        ({"kind": "table", "time": [0, 1], "travel": [0.01, 0.03]}, "begins with 0.01 m"),
        ({"kind": "table", "time": [-1, 1], "travel": [0.0, 0.03]}, "begins at -1 s"),
        ({"kind": "table", "time": [1, 2], "travel": [0.01, 0.03]}, "begins with 0.01 m"),
    ],
)
def test_a_drive_begins_where_its_bodies_are(time: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Drive.model_validate({"body": "block", "time": time})


PLATES = """
[contact]
stiffness = 1e7
[[scene.bodies]]
name = "low"
mass = 1.0
inertia = [1e-2, 1e-2, 1e-2]
plate = { length = "20 mm", width = "20 mm", thickness = "3 mm" }
[[scene.bodies]]
name = "high"
position = [0, 0, "5 mm"]
mass = 1.0
inertia = [1e-2, 1e-2, 1e-2]
plate = { length = "20 mm", width = "20 mm", thickness = "3 mm" }
[[scene.surfaces]]
name = "a"
bodies = ["low"]
[[scene.surfaces]]
name = "b"
bodies = ["high"]
[[scene.pairs]]
first = "a"
second = "b"
[[scene.elements]]
name = "one"
inner = "ground"
outer = "low"
translation = [1e4, 1e4, 1e4]
rotation = [100, 100, 100]
[[scene.elements]]
name = "two"
inner = "ground"
outer = "high"
point_inner = [0, 0, "5 mm"]
translation = [1e4, 1e4, 1e4]
rotation = [100, 100, 100]
[[step]]
name = "through"
kind = "static"
contact = false
[[step.load]]
body = "high"
force = [0, 0, -30]
[[step]]
name = "touch"
"""


@pytest.mark.parametrize("kind", ['"static"', '"dynamic"\nduration = "10 ms"'])
def test_bodies_that_overlap_where_their_contact_begins_are_refused(tmp_path: Path, kind: str) -> None:
    with pytest.raises(NotConverged, match=r"step 'touch' .*a - b overlap by 1 mm when their contact begins"):
        run(tmp_path, PLATES + f"kind = {kind}\n")


def test_a_relax_step_pushes_them_apart(tmp_path: Path) -> None:
    """Both springs and the contact are in series."""
    solution, _ = run(tmp_path, PLATES + 'kind = "relax"\n')
    low, high = place(solution, "low")[-1, 1], place(solution, "high")[-1, 1]
    assert high - low == pytest.approx(0.003, abs=1e-4)
    assert 1e4 * (0.005 - high) + 1e4 * (0.0 - low) == pytest.approx(30.0, rel=1e-9)


def test_a_frame_cannot_be_held(tmp_path: Path) -> None:
    text = """
[[scene.cables]]
name = "rope"
start = [0, 0, 0]
end = [0.3, 0, 0]
diameter = "1 mm"
young = "1 GPa"
density = 1000
elements = 2
held = ["start"]
[[scene.frames]]
name = "tip"
on = "rope"
at = [0.3]
[[step]]
kind = "dynamic"
duration = "1 ms"
hold = ["tip"]
"""
    with pytest.raises(CaseError, match=r"step\.0\.hold\.0: 'tip' is a frame"):
        run(tmp_path, text)


def test_statics_begin_beside_the_equilibrium_without_an_energy_error(tmp_path: Path) -> None:
    """A rod on a torsional spring takes its equilibrium k phi = m g l cos(phi) immediately; its energy is dissipated."""
    solution, summary = run(tmp_path, ROD)
    phi = place(solution, "rod")[-1, 2]
    assert phi == pytest.approx(0.1 * 9.81 * 0.1 * math.cos(phi), rel=1e-9)
    sag = 0.1 * 9.81 * 0.1 * math.sin(phi) - 0.5 * phi**2
    assert solution.energy["dissipated"][-1] == pytest.approx(sag, rel=1e-2)
    assert summary["energy_error"] < 1e-9


def test_a_path_by_arc_length_begins_in_equilibrium_and_returns(tmp_path: Path) -> None:
    """A block is released where it is not in equilibrium, loaded and unloaded: it hangs on its spring."""
    steps = '[[step]]\nname = "up"\nkind = "static"\nrelease = ["block"]\nsolve = { method = "arc-length" }\n'
    steps += '[[step.load]]\nname = "f"\nbody = "rod"\npoint = ["100 mm", 0, 0]\nforce = [0, 0, 2]\n'
    steps += '[[step]]\nname = "down"\nkind = "static"\nrelease = ["f"]\nsolve = { method = "arc-length" }\n'
    solution, summary = run(tmp_path, ROD + steps)
    z = place(solution, "block")[:, 1]
    second, third = np.flatnonzero(solution.step == 2), np.flatnonzero(solution.step == 3)
    hanging = -1.1 * 9.81 / 1000.0
    assert z[second[-1]] == pytest.approx(hanging + 2e-3, rel=1e-9)
    assert z[third[-1]] == pytest.approx(hanging, rel=1e-9)
    # near the first point the block already hangs on its spring
    assert z[second[0]] == pytest.approx(hanging, abs=1e-5)
    assert summary["energy_error"] < 1e-4
    assert summary["events"] == []


def test_the_work_of_a_dead_load_moves_a_body_far_without_dampers(tmp_path: Path) -> None:
    """The lock opens in the second step, and the load alone moves the block to its new place."""
    text = BLOCK + LOCK.replace("700", "1e6") + 'steps = ["one"]\n'
    text += '[[step]]\nname = "one"\nkind = "static"\n' + PUSH.format(force=3)
    text += '[[step]]\nname = "two"\nkind = "static"\nduration = "1 s"\n'
    solution, summary = run(tmp_path, text)
    last = solution.step == 2
    np.testing.assert_allclose(place(solution, "block")[last, 1], 0.01, rtol=1e-6)
    assert summary["energy_error"] < 1e-6
    assert solution.energy["dissipated"][-1] == pytest.approx(0.5 * 300.0 * 0.01**2, rel=1e-2)


SWING = BLOCK.replace("[[scene.bodies]]", "gravity = [0, 0, -9.81]\n[[scene.bodies]]", 1)
DYNAMIC = '[[step]]\nkind = "dynamic"\nduration = "0.1 s"\n'


def test_natural_modes_do_not_stop_a_motion(tmp_path: Path) -> None:
    text = SWING + DYNAMIC + '[[step]]\nkind = "modes"\nmodes = 1\n' + DYNAMIC
    solution, _ = run(tmp_path, text)
    w = math.sqrt(300.0 / 2.0)
    np.testing.assert_allclose(place(solution, "block")[:, 1], -9.81 / w**2 * (1.0 - np.cos(w * solution.time)), atol=2e-6)
    assert solution.energy["dissipated"][-1] < 1e-6


def test_a_run_of_modes_alone(tmp_path: Path) -> None:
    solution, summary = run(tmp_path, SWING + '[[step]]\nkind = "modes"\nmodes = 3\n')
    assert len(solution.time) == 1
    assert min(summary["step"][0]["frequencies_hz"], key=lambda f: abs(f - 1.95)) == pytest.approx(
        math.sqrt(150.0) / (2.0 * math.pi), rel=1e-9
    )


def test_a_static_step_that_ends_in_a_motion_has_no_energy_error_in_the_next(tmp_path: Path) -> None:
    """The first step is too short for the motion to decay; the kinetic energy is dissipated at the beginning of the second
    step."""
    text = ROD.replace("rotation = [10, 1, 10]", "rotation = [10, 0.01, 10]\nrotation_damping = [0, 1e-4, 0]")
    text = text.replace('hold = ["block"]', 'hold = ["block"]\nduration = "0.1 s"')
    text += '[[step]]\nname = "next"\nkind = "static"\nduration = "1 s"\n'
    solution, summary = run(tmp_path, text)
    last = np.flatnonzero(solution.step == 1)[-1]
    assert solution.energy["kinetic"][last] > 0.02 * solution.energy["dissipated"][last]
    assert summary["energy_error"] < 5e-3


def test_what_is_released_can_be_held_in_the_same_step(tmp_path: Path) -> None:
    """The drive ends, and the block is held where it is."""
    pull = '[[step]]\nkind = "static"\n[[step.drive]]\nbody = "block"\ndirection = [1, 0, 0]\n'
    pull += 'travel = "10 mm"\nspeed = "10 mm/s"\n'
    held = DYNAMIC + 'release = ["block"]\nhold = ["block"]\n'
    solution, _ = run(tmp_path, BLOCK + pull + held + DYNAMIC + 'release = ["all"]\n')
    x = place(solution, "block")[:, 0]
    np.testing.assert_allclose(x[solution.step == 2], 0.01, rtol=1e-12)
    assert x[-1] < 0.009


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ('[[step]]\nkind = "modes"\nhold = ["all"]\n' + DYNAMIC + 'release = ["all"]\n', r"step\.0\.kind: no body is free"),
        (DYNAMIC + 'save = { channels = ["energy.*"] }\n', r"step\.0\.save\.channels: belongs to the whole case"),
        (DYNAMIC + 'hold = ["block"]\nrelease = ["block"]\n', r"step\.0\.release\.0: no held body and no acting drive"),
        (
            '[[step]]\nkind = "static"\nsolve = { method = "arc-length", rho_inf = 0.8 }\n' + PUSH.format(force=1),
            r'step\.0\.solve\.rho_inf: applies to method = "generalized-alpha", not to "arc-length"',
        ),
        (
            '[[drive]]\nstep = "m"\nbody = "block"\nspeed = 1.0\ntravel = 1.0\n[[step]]\nname = "m"\nkind = "modes"\n',
            r"drive\.0\.step: 'm' has kind = \"modes\" and takes no time",
        ),
    ],
)
def test_mistakes(tmp_path: Path, steps: str, message: str) -> None:
    with pytest.raises(CaseError, match=message):
        run(tmp_path, BLOCK + steps)


def test_a_path_by_arc_length_says_that_it_has_no_friction(tmp_path: Path) -> None:
    text = PLATES.split("[[step]]")[0] + '[friction]\nlaw = "tanh"\nmu_dynamic = 0.3\nv_static = 1e-3\n'
    text += '[[step]]\nname = "push"\nkind = "static"\nsolve = { method = "arc-length" }\n'
    text += '[[step.load]]\nbody = "high"\nforce = [0, 0, -1]\n'
    _, summary = run(tmp_path, text)
    assert any("no friction" in line and "'push'" in line for line in summary["warnings"])


def test_the_first_increment_of_a_static_step_is_that_of_its_settings(tmp_path: Path) -> None:
    steps = '[[step]]\nkind = "static"\nhold = ["block"]\n'
    steps += '[[step]]\nkind = "static"\nrelease = ["block"]\nsolve = { increment = "2 mm" }\n'
    steps += '[[step.drive]]\nbody = "block"\ndirection = [1, 0, 0]\ntravel = "20 mm"\nspeed = "10 mm/s"\n'
    steps += DYNAMIC + 'release = ["block"]\n'
    (tmp_path / "case.toml").write_text(BLOCK + steps, encoding="utf-8")
    settings = Deployment(load_case(tmp_path / "case.toml").case, "", None).steps()[1].settings
    assert isinstance(settings, PathSettings)
    # the run-up over 1 % of the travel takes twice the time of this travel at full speed
    assert settings.first_step == pytest.approx(0.2 + 0.02, rel=1e-3)
