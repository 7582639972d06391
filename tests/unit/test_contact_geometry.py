"""A contact geometry in one file: of the package, or of a user."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm.model.contact.geometries
from fsm.case.loading.load_case import LoadedCase, load_case
from fsm.errors import CaseError
from fsm.model.compile.compile_case import compile_case
from fsm.registry import GEOMETRIES
from fsm.run.run_case import run_case
from tests.tangents import check_force, check_tangents

PAGE = Path(__file__).parents[2] / "docs" / "extend" / "contact_geometry.md"
BALL = '''
from typing import NamedTuple
import numpy as np
from pydantic import Field
from fsm.extend import (
    ContactArrays, Floats1, Integers2, Length, PairContacts, Section, add_contact_tangent, add_geometry, fill_rotation,
    follows, forces_of, index_of, kernel,
)

class Ball(Section):
    radius: Length = Field(gt=0, description="radius")

class BallArrays(NamedTuple):
    ends: Integers2
    radius: Floats1

balls_of = follows(BallArrays, ContactArrays)

@kernel
def find(g, poses, below):
    count, own = 0, balls_of(g)
    for slot in range(own.radius.shape[0]):
        gap = poses[own.ends[slot, 0], 2] - poses[own.ends[slot, 1], 2] - own.radius[slot]
        if gap < below:
            g.slot[count], g.gap[count] = slot, gap
            count += 1
    return count

@kernel
def measure(g, poses, rates, count):
    """The plane is parallel to z = 0 and moves up and down with the second body, which does not turn."""
    own, turn = balls_of(g), np.empty((3, 3))
    for i in range(count):
        one, two = own.ends[g.slot[i]]
        r, way = own.radius[g.slot[i]], g.gradient[i]
        fill_rotation(poses[one, 3:7], turn)
        way[:] = 0.0
        way[0, 2], way[0, 8], way[1, 0], way[2, 1] = 1.0, -1.0, 1.0, 1.0
        for m in range(3):  # r (omega x -e3) = r (-omega_y, omega_x, 0)
            way[1, 3 + m], way[2, 3 + m] = -r * turn[1, m], r * turn[0, m]
        g.bodies[i, 0], g.bodies[i, 1] = one, two
        for a in range(4):
            g.rate[i, a] = 0.0
            for m in range(12):
                g.rate[i, a] += way[a, m] * rates[one if m < 6 else two, m % 6]

@kernel
def tangent(g, poses, rates, count, stiffness, damping):
    own, turn, second, of_slip = balls_of(g), np.empty((3, 3)), np.zeros((12, 12)), np.zeros((12, 12, 3))
    for i in range(count):
        fill_rotation(poses[own.ends[g.slot[i], 0], 3:7], turn)
        r = own.radius[g.slot[i]]
        of_slip[:] = 0.0
        for m in range(3):  # the derivative of A e_m by a rotation about e_n is A (e_n x e_m), along the third axis
            n, k = (m + 1) % 3, (m + 2) % 3
            for a in range(2):
                row, sign = 1 - a, -r if a == 0 else r
                of_slip[3 + m, 3 + n, a] = -sign * turn[row, k]
                of_slip[3 + n, 3 + m, a] = sign * turn[row, k]
        add_contact_tangent(
            i, rates, g.bodies[:count], g.gradient[:count], second, of_slip, forces_of(g, 0, count), index_of(g), stiffness,
            damping, np.empty((12, 12)), np.empty((12, 12)),
        )

def build(touching):
    radius = np.array([own["radius"] for own in touching.parameters])
    return (PairContacts(touching, BallArrays(touching.ends, radius), 1.0, find, measure, tangent),)

add_geometry("ball-on-plane", build, Ball, "ball on a plane")
'''
CASE = """
gravity = [0, 0, -9.81]

[contact]
law = "hertz"
stiffness = 2e5

[[scene.bodies]]
name = "ball"
mass = 0.2
inertia = [1e-4, 2e-4, 2.5e-4]
position = [0, 0, "20 mm"]

[[scene.pairs]]
first = "ball"
second = "ground"
geometry = "ball-on-plane"
parameters = { radius = "20 mm" }
"""
FALL = CASE.replace("2e5", "2e4\nexponent = 1.0") + """
[solve]
method = "generalized-alpha"
end_time = "10 ms"
rtol = 1e-8
[save]
interval = "0.5 ms"
channels = ["body.ball.position", "contact.*", "energy.*"]
"""
PRESS = CASE + """
[[scene.elements]]
name = "rod"
inner = "piston"
outer = "ball"
translation = [1e3, 1e3, 1e4]
rotation = [1, 1, 1]
[[scene.bodies]]
name = "piston"
mass = 0.1
inertia = [1e-4, 1e-4, 1e-4]
position = [0, 0, "20 mm"]
[[drive]]
body = "piston"
travel = "5 mm"
direction = [0, 0, -1]
speed = "1 mm/s"
run_up = 0
[solve]
method = "static"
[save]
channels = ["drive.*", "contact.*", "energy.*"]
"""


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """One more file in the folder of geometries."""
    folder = tmp_path_factory.mktemp("geometries")
    (folder / "ball_on_plane.py").write_text(BALL, encoding="utf-8")
    fsm.model.contact.geometries.__path__.append(str(folder))
    yield
    fsm.model.contact.geometries.__path__.remove(str(folder))
    GEOMETRIES.pop("ball-on-plane", None)


def loaded(folder: Path, text: str) -> LoadedCase:
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return load_case(folder / "case.toml", [])


def solved(folder: Path, text: str) -> tuple[dict[str, Any], fsm.Solution]:
    summary = run_case(loaded(folder, text), folder / "out", progress=False)
    assert summary["steps_compiled"], summary["steps_in_python_because"]
    return summary, fsm.read_solution(folder / "out" / "result.h5")


@pytest.mark.usefixtures("house")
def test_a_ball_falls_on_a_spring(tmp_path: Path) -> None:
    """The file alone gives compiled steps, a memory, energies and channels: z = -g/w^2 (1 - cos w t)."""
    summary, solution = solved(tmp_path, FALL)
    omega = np.sqrt(2e4 / 0.2)
    depth = 9.81 / omega**2 * (1.0 - np.cos(omega * solution.time))
    values = {name: channel.values for name, channel in solution.channels.items()}
    np.testing.assert_allclose(20e-3 - values["body.ball.position"][:, 2], depth, rtol=0.0, atol=1e-4 * depth.max())
    np.testing.assert_allclose(values["contact.ball - ground.normal_force"], 2e4 * depth, rtol=0.0, atol=2.0 * depth.max())
    np.testing.assert_allclose(-values["contact.ball - ground.gap"][1:], depth[1:], rtol=0.0, atol=1e-4 * depth.max())
    assert summary["energy_error"] < 1e-5


@pytest.mark.usefixtures("house")
def test_a_ball_is_pressed_on_a_plane(tmp_path: Path) -> None:
    """Statics linearises the law at depths of the same contacts: N = K d^1.5 and U = K d^2.5/2.5."""
    _, solution = solved(tmp_path, PRESS)
    values = {name: channel.values.ravel() for name, channel in solution.channels.items()}
    depth, force = -values["contact.ball - ground.gap"], values["contact.ball - ground.normal_force"]
    pushed = force - 0.2 * 9.81
    assert force[-1] > 10.0
    np.testing.assert_allclose(force, 2e5 * depth**1.5, rtol=1e-12)
    np.testing.assert_allclose(pushed[1:], 1e4 * (solution.time * 1e-3 - depth)[1:], atol=1e-6 * force[-1])


def agree(system: Any, drop: float, tilt: float) -> None:
    """Forces are minus the gradient of the energy, and K and D minus the derivatives of the forces."""
    q, _ = system.initial()
    random = np.random.default_rng(3)
    q = system.retract(q, np.concatenate([[0.0, 0.0, drop], tilt * random.normal(size=3)]))
    u = random.normal(size=system.nu)
    check_force(system, q, 1e-7, 1e-6)
    check_tangents(system, q, u, (1e-7, 1e-6), 1e-5)
    stiffness = system.tangent(0.0, q, u)[0].toarray()
    assert np.abs(stiffness[3:, 3:]).max() > 1e-6 * np.abs(stiffness).max()


FRICTION = '[friction]\nlaw = "tanh"\nmu_dynamic = 0.4\nv_static = 2.0\n'


@pytest.mark.usefixtures("house")
def test_the_tangent_of_a_ball(tmp_path: Path) -> None:
    agree(compile_case(loaded(tmp_path, FALL + FRICTION).case)[1], -1e-3, 0.5)


@pytest.mark.nightly  # its kernels take long to compile
def test_the_tangent_of_the_ring_of_the_page(tmp_path: Path) -> None:
    blocks = dict(re.findall(r"^```\{executed\} \w+ (\S+)\n(.*?)^```$", PAGE.read_text("utf-8"), re.MULTILINE | re.DOTALL))
    (tmp_path / "ring.py").write_text(blocks["ring.py"], encoding="utf-8")
    case = blocks["case.toml"].replace('v_static = "0.1 mm/s"', "v_static = 2.0")
    agree(compile_case(loaded(tmp_path, case).case)[1], -60e-3, 0.3)


@pytest.mark.usefixtures("house")
@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('"ball-on-plane"', '"balls"', r'pairs\.0\.geometry: must be .*it is "balls"'),
        ('second = "ground"', 'second = "grund"', r"pairs\.0\.second: no body is called 'grund'; did you mean 'ground'"),
        ('second = "ground"', 'second = "ball"', r"pairs\.0: both sides are 'ball'"),
        ('radius = "20 mm"', "", r"pairs\.0\.parameters.*radius: missing"),
        ('geometry = "ball-on-plane"', "", r"pairs\.0\.parameters"),
    ],
)
def test_faults_of_a_pair(tmp_path: Path, old: str, new: str, fault: str) -> None:
    with pytest.raises(CaseError, match=fault):
        compile_case(loaded(tmp_path, FALL.replace(old, new)).case)
