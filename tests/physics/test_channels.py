"""Output channels against closed forms: reactions, moments, energies and work."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from fsm.cli.command_line import cli
from fsm.results.solution import Solution
from tests.runs import run

STIFFNESS = 9e-3
STRIP = f"""
[strip]
length = "480 mm"
width = "40 mm"
thickness = "0.3 mm"
panels = 6
fold_angle = "80 deg"
segments_per_panel = 6
[material]
young = "3 GPa"
poisson = 0.3
density = "800 kg/m^3"
damping = "0 s"
[crease]
law = "linear"
stiffness = {STIFFNESS}
[[drive]]
crease = 3
direction = [0, 0, 1]
speed = "2 mm/s"
travel = "20 mm"
[save]
every = "0.5 mm"
channels = ["crease.*.angle", "crease.*.moment", "crease.2.*", "support.*.force", "energy.*", "drive.*", "panel.*"]
"""


def solved(text: str, folder: Path, **more: Any) -> Solution:
    """Run a case and read its results."""
    return run(folder, text, *(f"{key}={value}" for key, value in more.items()))[0]


def value(solution: Solution, name: str) -> np.ndarray:
    return solution.channels[name].values


@pytest.fixture(scope="module", params=[False, True], ids=["plane", "space"])
def strip(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Solution:
    return solved(STRIP, tmp_path_factory.mktemp("strip"), **{"solve.spatial": str(request.param).lower()})


def test_the_moment_of_a_crease_is_its_stiffness_times_its_angle(strip: Solution) -> None:
    """The angle is that of the crease alone, without the half segments beside it, so the stiffness is that of the case."""
    rest = math.radians(160.0)
    for k in range(1, 6):
        moment, angle = value(strip, f"crease.{k}.moment"), value(strip, f"crease.{k}.angle")
        assert np.abs(angle - rest).max() > 0.05
        np.testing.assert_allclose(moment, STIFFNESS * (angle - rest), atol=1e-9 * STIFFNESS)


def test_the_moment_vector_is_the_moment_about_the_crease(strip: Solution) -> None:
    """Two independent computations: the law, and the wrench on the inner body."""
    vector, moment = value(strip, "crease.2.moment_vector"), value(strip, "crease.2.moment")
    np.testing.assert_allclose(np.abs(vector[:, 1]), np.abs(moment), atol=1e-9 * np.abs(moment).max())


def test_reactions_and_drive_force_are_in_equilibrium(strip: Solution) -> None:
    forces = [channel.values for name, channel in strip.channels.items() if name.startswith("support.")]
    assert len(forces) == 4
    drive = value(strip, "drive.1.force")
    assert drive.max() > 0.1
    np.testing.assert_allclose(sum(forces), 0.0, atol=1e-6 * drive.max())
    np.testing.assert_allclose(value(strip, "support.crease 3.force")[:, 2], drive, atol=1e-9)


def test_energies_are_balanced_and_the_work_is_that_of_the_drive(strip: Solution) -> None:
    energy = {name: value(strip, f"energy.{name}") for name in ("potential", "dissipated", "numerical", "work", "error")}
    stored = energy["potential"] - energy["potential"][0]
    lost = energy["dissipated"] + energy["numerical"]
    np.testing.assert_allclose(stored + lost - energy["work"], energy["error"], atol=1e-15)
    np.testing.assert_allclose(value(strip, "energy.panels") + value(strip, "energy.creases"), energy["potential"])
    work = np.trapezoid(value(strip, "drive.1.force"), value(strip, "drive.1.travel"))
    assert energy["work"][-1] == pytest.approx(work, rel=2e-3)  # trapezoidal rule over 0.5 mm; half of this over 0.35 mm


def test_panels_bend_by_their_moments(strip: Solution) -> None:
    """M = EI kappa, and the moment at the crease continues the moments along the panel."""
    bending = 3e9 * 0.04 * 0.3e-3**3 / 12.0
    moment, curvature = value(strip, "panel.3.moment"), value(strip, "panel.3.curvature")
    ratio = moment[-1] / curvature[-1]
    assert ratio == pytest.approx(np.full(5, bending))
    # no load acts along the panel, so the moment is linear in the undeformed arc length to first order
    slope = np.diff(moment[-1])
    expected = moment[-1, 0] - slope[0]
    at_crease = -value(strip, "crease.2.moment")[-1]
    assert min(abs(expected - at_crease), abs(expected + at_crease)) < 0.1 * abs(moment[-1]).max()


def test_extremes_in_the_summary_and_columns_in_the_table(strip: Solution) -> None:
    found = strip.summary["channels"]["drive.1.force"]
    force = value(strip, "drive.1.force")
    assert found["max"] == force.max() and found["max_travel"] == strip.travel[np.argmax(force), 0] and found["unit"] == "N"
    assert "support.panel 1.force z" in strip.summary["channels"]


CHAIN = """
start = "equilibrium"
gravity = [0, 0, -9.81]
[save]
channels = ["support.ground.*", "joint.*.force", "body.bob.position"]
[solve]
end_time = "2 ms"
spatial = {spatial}
"""
LINK = """
[[scene.bodies]]
name = "{name}"
mass = {mass}
inertia = [1e-5, 1e-5, 1e-5]
position = [{x}, 0, {z}]
[[scene.elements]]
name = "{name}"
inner = "{name}"
outer = "{outer}"
point_inner = [0, 0, 0.05]
point_outer = [{px}, 0, {pz}]
translation = [1e6, 1e6, 1e6]
rotation = [1.0, 1.0, 1.0]
"""


@pytest.mark.parametrize("spatial", ["false", "true"])
def test_reactions_of_a_hanging_chain(spatial: str, tmp_path: Path) -> None:
    """The support carries the weight of all links, and each joint carries the weight of the links below it; y of the chain
    is zero."""
    masses = {"top": 0.3, "middle": 0.2, "bob": 0.1}
    text, outer, place, point = CHAIN.format(spatial=spatial), "ground", -0.05, (0.2, 0.0)
    for name, mass in masses.items():
        text += LINK.format(name=name, mass=mass, x=0.2, z=place, outer=outer, px=point[0], pz=point[1])
        outer, place, point = name, place - 0.1, (0.0, -0.05)
    found = solved(text, tmp_path)
    force, moment = value(found, "support.ground.force"), value(found, "support.ground.moment")
    np.testing.assert_allclose(force, [[0.0, 0.0, 9.81 * 0.6]] * len(found), atol=2e-5)
    np.testing.assert_allclose(moment, [[0.0, -9.81 * 0.6 * 0.2, 0.0]] * len(found), atol=1e-5)  # about the origin
    below = 0.0
    for name in reversed(masses):
        below += masses[name]
        np.testing.assert_allclose(value(found, f"joint.{name}.force")[:, 2], 9.81 * below, rtol=1e-5)


def test_reactions_of_a_held_cable_with_a_weight(tmp_path: Path) -> None:
    """The held end of a cable carries the weight of cable and body; the top element carries all except half of its own
    weight."""
    text = """
start = "equilibrium"
gravity = [0, 0, -9.81]
[solve]
end_time = "0.2 ms"
[save]
channels = ["support.nodes.force", "cable.tension", "joint.weld.force"]
[[scene.cables]]
name = "rope"
start = [0, 0, 0]
end = [0, 0, -0.4]
diameter = "2 mm"
young = "2 GPa"
density = "1200 kg/m^3"
elements = 4
held = ["start"]
[[scene.frames]]
name = "tip"
on = "rope"
at = ["400 mm"]
normal = [1, 0, 0]
[[scene.bodies]]
name = "weight"
mass = 0.05
inertia = [1e-6, 1e-6, 1e-6]
position = [0, 0, -0.4]
[[scene.elements]]
name = "weld"
inner = "weight"
outer = "tip"
translation = [1e6, 1e6, 1e6]
rotation = [1, 1, 1]
"""
    found = solved(text, tmp_path)
    rope = 1200.0 * math.pi * 1e-6 * 0.4
    np.testing.assert_allclose(value(found, "support.nodes.force")[:, 2], 9.81 * (0.05 + rope), rtol=1e-4)
    np.testing.assert_allclose(value(found, "joint.weld.force")[:, 2], 9.81 * 0.05, rtol=1e-4)
    expected = 9.81 * (0.05 + rope * (1.0 - (np.arange(4) + 0.5) / 4.0))
    np.testing.assert_allclose(value(found, "cable.tension")[0], expected, rtol=1e-3)


@pytest.mark.parametrize("spatial", ["false", "true"])
def test_points_of_a_body_that_turns_freely(spatial: str, tmp_path: Path) -> None:
    """A rotation of w t about y turns x towards -z; the point moves on a circle about the centre, which moves along a
    straight line."""
    text = f"""
[[scene.bodies]]
name = "rotor"
mass = 1.0
inertia = [0.01, 0.02, 0.01]
velocity = [0.1, 0, 0]
angular_velocity = [0, 3, 0]
[solve]
end_time = "2.5 s"
spatial = {spatial}
rtol = 1e-8
[save]
interval = "0.1 s"
channels = ["point.*", "body.rotor.rotation", "body.rotor.angular_velocity"]
[save.points]
tip = {{ body = "rotor", at = ["200 mm", 0, 0] }}
"""
    found = solved(text, tmp_path)
    t = found.time
    x, z = 0.2 * np.cos(3.0 * t), -0.2 * np.sin(3.0 * t)
    place = np.stack([x + 0.1 * t, 0.0 * t, z], axis=1)
    np.testing.assert_allclose(value(found, "point.tip.position"), place, atol=1e-5)
    np.testing.assert_allclose(value(found, "point.tip.displacement"), place - [0.2, 0.0, 0.0], atol=1e-5)
    speed = np.stack([3.0 * z + 0.1, 0.0 * t, -3.0 * x], axis=1)
    np.testing.assert_allclose(value(found, "point.tip.velocity"), speed, atol=1e-4)
    np.testing.assert_allclose(value(found, "body.rotor.angular_velocity"), [[0.0, 3.0, 0.0]] * len(t), atol=1e-6)
    turn = 3.0 * t if spatial == "false" else np.remainder(3.0 * t + np.pi, 2.0 * np.pi) - np.pi
    np.testing.assert_allclose(value(found, "body.rotor.rotation")[:, 1], turn, atol=1e-4)
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(text.replace('body = "rotor"', 'body = "roter"'), encoding="utf-8")
    refused = CliRunner().invoke(cli, ["check", str(wrong)])
    assert refused.exit_code == 2 and "save.points.tip.body: no body is called 'roter'" in refused.output


def test_angular_velocity_of_bodies_that_tumble_is_in_inertial_axes(tmp_path: Path) -> None:
    """The angular momentum of each free body is constant, and its point moves at the rate of its position."""
    bodies, inertia = "", {"brick": [1e-3, 2e-3, 2.5e-3], "plank": [3e-3, 1e-3, 3.5e-3]}
    for name, spin in (("brick", [1.0, 8.0, 2.0]), ("plank", [6.0, -3.0, 1.0])):
        bodies += f"""
[[scene.bodies]]
name = "{name}"
mass = 1.0
inertia = {inertia[name]}
orientation = [0.8, 0.0, 0.6, 0.0]
angular_velocity = {spin}
"""
    text = bodies + """
[solve]
end_time = "1 s"
rtol = 1e-8
[save]
interval = "0.01 s"
channels = ["point.*", "body.*.orientation", "body.*.angular_velocity"]
[save.points]
tip = { body = "plank", at = ["100 mm", "50 mm", 0] }
"""
    found = solved(text, tmp_path)
    for name, of_body in inertia.items():
        w, x, y, z = value(found, f"body.{name}.orientation").T
        turn = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        spin = value(found, f"body.{name}.angular_velocity")
        momentum = np.einsum("abt,b,cbt,tc->ta", turn, of_body, turn, spin)
        assert np.ptp(spin, axis=0).max() > 1.0
        np.testing.assert_allclose(momentum, momentum[:1].repeat(len(momentum), axis=0), atol=1e-5 * np.abs(momentum).max())
    place, speed = value(found, "point.tip.position"), value(found, "point.tip.velocity")
    between = (place[2:] - place[:-2]) / 0.02
    np.testing.assert_allclose(speed[1:-1], between, atol=2e-3 * np.abs(speed).max())


def test_a_crease_with_hysteresis_knows_its_memory_at_each_record(tmp_path: Path) -> None:
    """The moment by the law equals the moment on the inner body; both need the sliders of that record, not of the end."""
    curve = """
[crease]
law = "spline"
angle = ["0 deg", "20 deg", "40 deg", "80 deg"]
moment = [0.0, 2e-3, 3e-3, 4e-3]
unloading = [0.0, 1e-3, 2e-3, 4e-3]
"""
    text = STRIP.replace(f'[crease]\nlaw = "linear"\nstiffness = {STIFFNESS}\n', curve)
    back = 'time = { kind = "table", time = [0, 8, 14], travel = ["0 mm", "16 mm", "4 mm"] }'
    text = text.replace('speed = "2 mm/s"\ntravel = "20 mm"', back).replace('every = "0.5 mm"', 'interval = "0.5 s"')
    found = solved(text, tmp_path)
    vector, moment = value(found, "crease.2.moment_vector"), value(found, "crease.2.moment")
    assert np.abs(moment).max() > 1e-4
    angle = value(found, "crease.2.angle")
    way = found.time <= 8.0
    there = np.interp(angle[-1], angle[way][::-1], moment[way][::-1])
    assert abs(moment[-1] - there) > 0.05 * np.abs(moment).max()  # the curve of the return is another branch
    np.testing.assert_allclose(np.abs(vector[:, 1]), np.abs(moment), atol=1e-9 * np.abs(moment).max())
    np.testing.assert_allclose(
        sum(c.values for name, c in found.channels.items() if name.startswith("support.")), 0.0, atol=1e-5
    )


def test_channels_go_on_from_step_to_step(tmp_path: Path) -> None:
    """In the static step reactions are in equilibrium; after the release the drive has no force, and a held body has one."""
    text = STRIP.replace("[[drive]]", '''[[step]]
name = "pull"
kind = "static"
[[step]]
name = "swing"
kind = "dynamic"
duration = "2 ms"
release = ["crease 3"]
hold = ["panel 4 segment 3"]
[[step.drive]]''').replace('kind = "static"\n', 'kind = "static"\nSECTION', 1)
    drive = text[text.index("[[step.drive]]") : text.index("[save]")]
    text = text.replace(drive, "").replace("SECTION", drive)
    found = solved(text, tmp_path)
    force, time = value(found, "drive.1.force"), found.time
    ends = time <= found.time[np.flatnonzero(force)[-1]]
    assert 0 < ends.sum() < len(time) and force[ends].max() > 0.1 and not force[~ends].any()
    held = value(found, "support.panel 4 segment 3.force")
    assert not held[ends][:-1].any() and np.abs(held[~ends][-1]).max() > 1e-3
    sums = sum(channel.values for name, channel in found.channels.items() if name.startswith("support."))
    np.testing.assert_allclose(sums[ends], 0.0, atol=1e-6)
    names = "kinetic", "potential", "dissipated", "numerical", "work", "error"
    energy = {name: value(found, f"energy.{name}") for name in names}
    total = energy["kinetic"] + energy["potential"] + energy["dissipated"] + energy["numerical"] - energy["work"]
    np.testing.assert_allclose(total - total[0], energy["error"], atol=1e-5 * energy["work"].max())


def test_patterns_are_checked_before_the_run(tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(STRIP, encoding="utf-8")
    shown = CliRunner().invoke(cli, ["check", str(path)])
    assert shown.exit_code == 0 and "crease.2.moment (N m)" in shown.output and "other channels" in shown.output
    wrong = ["--set", 'save.channels=["creese.3.angle"]']
    for command in (["check", str(path)], ["run", str(path), "--out", str(tmp_path / "out")]):
        refused = CliRunner().invoke(cli, [*command, *wrong])
        assert refused.exit_code == 2
        assert "save.channels" in refused.output and "crease.3.angle" in refused.output
    assert not (tmp_path / "out" / "result.h5").exists()


def test_channels_are_drawn_and_open_with_xarray(strip: Solution, tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    text = STRIP.replace('travel = "20 mm"', 'travel = "2 mm"')
    found = solved(text, tmp_path)
    result = tmp_path / "out" / "result.h5"
    drawn = CliRunner().invoke(cli, ["plot", str(result), "--channel", "crease.*.angle", "--channel", "panel.2.moment"])
    assert drawn.exit_code == 0 and (tmp_path / "out" / "channels.png").stat().st_size > 10_000
    assert CliRunner().invoke(cli, ["plot", str(result), "--channel", "x"]).exit_code == 2
    with xarray.open_datatree(result, engine="h5netcdf") as tree:
        moment = tree["channels"]["panel.2.moment"]
        assert moment.attrs["units"] == "N m" and moment.dims == ("time", "panel.2.position")
        np.testing.assert_array_equal(moment.coords["time"], found.time)
        assert moment.coords["panel.2.position"].attrs["units"] == "m"
    heading = (tmp_path / "out" / "channels.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert heading[:2] == ["travel (m)", "time (s)"] and "crease.2.moment (N m)" in heading
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["channels"]["crease.2.moment"]["unit"] == "N m"
