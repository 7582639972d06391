"""K = -dh/dx, D = -dh/du and the Jacobian of y' = f(t, y) against central differences.

Every entry is judged against the largest of its row and column, group by group, so that a soft spring beside a stiff one
and a moment beside a force count.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fsm.builders.strip import build_strip
from fsm.case.models.case import Case
from fsm.case.models.scene import Body, Scene
from fsm.interactions.surfaces.surface import STRAIGHT, TIP, overshoot
from fsm.model.bodies.loads import LoadGroup
from fsm.model.compile.compile import compile_scene
from fsm.model.contact.contacts import ContactGroup
from fsm.model.contact.surfaces.surface_contacts import SurfaceContacts
from fsm.model.system.system import SegmentSystem
from fsm.solve.time.scipy_ivp import FirstOrder
from tests.tangents import fine_differences

RELATIVE = 1e-6
SPATIAL = pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
LINEAR = {"law": "linear", "stiffness": 3e-4}
SPLINE = {
    "law": "spline",
    "angle": [-1.0, 0.0, 0.7, 1.5, 3.0],
    "moment": [-3e-4, 0.0, 1e-4, 1.5e-4, 4e-4],
}
FRICTION = {
    "none": None,
    "step": {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": 0.1, "v_dynamic": 0.3},
    "tanh": {"law": "tanh", "mu_dynamic": 0.25, "v_static": 0.1},
    "across": {"law": "tanh", "mu_dynamic": 0.25, "v_static": 0.1, "across": 2.5},
    "bristles across": {
        "law": "lugre", "mu_static": 0.3, "mu_dynamic": 0.25, "v_stribeck": 0.1, "presliding": 1e-3, "across": 2.5,
    },
}


def strip_system(
    spatial: bool,
    crease: dict[str, Any] = LINEAR,
    thickness: float = 3e-4,
    contact: dict[str, Any] | None = None,
    **sections: Any,
) -> SegmentSystem:
    """Six soft panels: bending, shear and contact have similar sizes, so no term is hidden in the round-off of another."""
    data: dict[str, Any] = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": thickness, "panels": 6, "fold_angle": "80 deg",
            "segments_per_panel": 3,
        },
        "material": {"young": 3e3, "density": 800, "damping": 1e-2},
        "crease": crease,
        "drive": [{"crease": 3, "speed": "2 mm/s", "travel": "150 mm"}],
    }  # fmt: skip
    if contact is not None:
        data["contact"] = contact
    data |= {name: value for name, value in sections.items() if value is not None}
    return compile_scene(build_strip(Case.model_validate(data)), spatial)


def only(system: SegmentSystem, kind: type) -> SegmentSystem:
    """The same bodies with groups of one kind only, so that other groups do not hide their terms."""
    groups = tuple(group for group in system.groups if isinstance(group, kind))
    assert groups
    return SegmentSystem(system.bodies, system.motions, groups, system.pair_names)


def surfaces_of(system: SegmentSystem) -> SurfaceContacts:
    (contacts,) = system.contacts
    assert isinstance(contacts.geometry, SurfaceContacts)
    return contacts.geometry


def steps(system: SegmentSystem, size: float) -> np.ndarray:
    """A step in every direction: `size` rad, and the corresponding fraction of a segment's length."""
    turns = 1 if system.size == 3 else 3
    length = system.scales().length
    return size * np.tile([length] * (system.size - turns) + [1.0] * turns, system.n_free)


def random_state(system: SegmentSystem, size: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    q, _ = system.initial()
    q = system.retract(q, steps(system, size) * rng.standard_normal(system.nu))
    return q, rng.standard_normal(system.nu) * steps(system, 5.0)


def pressed_state(system: SegmentSystem, size: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Panels 3 and 4 upright with a penetration of 1.5 mm, all slightly displaced."""
    pose, middle = system.bodies.pose, 3 * 0.08 * np.cos(np.radians(80))
    move = np.zeros((system.n_free, system.size))
    for row, body in enumerate(system.bodies.free):
        panel = int(system.bodies.names[body].split()[1])
        if panel in (3, 4):
            side = 1.0 if panel == 3 else -1.0
            move[row, 0] = middle + side * 7.5e-4 - pose[body, 0]
            move[row, 2 if system.size == 3 else 4] = -side * np.radians(10)
    rng = np.random.default_rng(seed)
    q = system.retract(system.initial()[0], move.ravel())
    q = system.retract(q, steps(system, size) * rng.standard_normal(system.nu))
    return q, rng.standard_normal(system.nu) * 0.1


def tip_state(
    system: SegmentSystem, angle: float, straight: float, past: float, size: float, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Panels 3 and 4 are upright, and one is moved along the other until a contact point lies on the disc of a tip.

    Parameters
    ----------
    angle : position on the disc, rad from the normal of the face
    straight : fraction of the tip that is straight for the probe: `STRAIGHT` for the end of a panel, 0 for the middle of its
    last segment
    past : +1 or -1
        panel : probe over the beginning of panel 3 or the end of panel 4
    size : size of the random displacements, as in `random_state`
    """
    pose, crease, radius = system.bodies.pose, 3 * 0.08 * np.cos(np.radians(80)), 0.5 * TIP * 0.08
    probe = 0.0 if straight else 0.04 / 3
    # 0.7 radii from the middle of the disc
    slide = past * (probe + 2 * straight * radius + 0.7 * radius * np.sin(angle))
    away = (0.7 * np.cos(angle) - 1.0) * radius + float(surfaces_of(system).probes.clearance.max())
    move = np.zeros((system.n_free, system.size))
    height = 1 if system.size == 3 else 2
    for row, body in enumerate(system.bodies.free):
        panel = int(system.bodies.names[body].split()[1])
        if panel in (3, 4):
            side = 1.0 if panel == 3 else -1.0
            move[row, 0] = crease - side * away / 2 - pose[body, 0]
            move[row, height] = pose[body, height] / np.sin(np.radians(80)) + side * slide / 2 - pose[body, height]
            move[row, 2 if system.size == 3 else 4] = -side * np.radians(10)
    rng = np.random.default_rng(seed)
    q = system.retract(system.initial()[0], move.ravel())
    q = system.retract(q, steps(system, size) * rng.standard_normal(system.nu))
    return q, rng.standard_normal(system.nu) * 0.1


def on_tips(system: SegmentSystem, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (m) of the found contacts beyond the straight parts of tips, and the fractions of the tips that are straight
    for them."""
    contacts = surfaces_of(system)
    found = contacts.find(system.place(1.0, q, u)[0], 0.0)
    piece, s = contacts.own.found_piece[: len(found.slot)], contacts.own.found_at[: len(found.slot), 0]
    stations, straight = contacts.surfaces.stations[piece], contacts.probes.straight[found.slot]
    # an end piece is straight, and its length is three times the distance of its first two control points
    length = 3 * (stations[:, 1] - stations[:, 0])
    return np.array([overshoot(*row, 0.0)[0] for row in zip(s, stations, length, straight, strict=True)]), straight


def assert_same(exact: np.ndarray, found: np.ndarray, noise: float = 0.0) -> None:
    rows, columns = np.abs(found).max(axis=1), np.abs(found).max(axis=0)
    scale = np.sqrt(np.outer(rows, columns))
    error = np.abs(exact - found) - noise
    worst = np.unravel_index(np.argmax(error - RELATIVE * scale), error.shape)
    assert np.all(error <= RELATIVE * scale), (
        f"entry {worst}: {exact[worst]:.9g} against {found[worst]:.9g}, scale {scale[worst]:.3g}"
    )


def check(
    system: SegmentSystem, q: np.ndarray, u: np.ndarray, t: float = 1.0, size: float = 1e-4
) -> tuple[np.ndarray, np.ndarray]:
    exact_k, exact_d = (matrix.toarray() for matrix in system.tangent(t, q, u))
    rounding = 1e-13 * np.abs(system.force(t, q, u)).max()
    found = -fine_differences(lambda dx: system.force(t, system.retract(q, dx), u), steps(system, size))
    assert_same(exact_k, found, rounding / steps(system, size).min())
    # small enough that no contact opens within a step
    found = -fine_differences(lambda v: system.force(t, q, u + v), steps(system, 1e-3))
    assert_same(exact_d, found, rounding / steps(system, 1e-3).min())
    return exact_k, exact_d


@SPATIAL
@pytest.mark.parametrize("crease", [LINEAR, SPLINE], ids=["linear", "spline"])
@pytest.mark.parametrize("guide", [True, False], ids=["guided", "unguided"])
def test_springs_and_creases(spatial: bool, crease: dict[str, Any], guide: bool) -> None:
    drive = [{"crease": 3, "speed": "2 mm/s", "travel": "150 mm", "guide": guide}]
    # segments are as thick as long, so bending is as stiff as stretching
    system = strip_system(spatial, crease, thickness=0.02, drive=drive)
    check(system, *random_state(system, 0.2, seed=3), size=1e-3)


@SPATIAL
@pytest.mark.parametrize("crease", [LINEAR, SPLINE], ids=["linear", "spline"])
def test_creases_alone(spatial: bool, crease: dict[str, Any]) -> None:
    system = strip_system(spatial, crease, thickness=3e-4)
    group = type(system.groups[-1])
    check(only(system, group), *random_state(system, 0.1, seed=5), size=1e-3)


@SPATIAL
@pytest.mark.parametrize("friction", [name for name in FRICTION if "bristles" not in name])
@pytest.mark.parametrize("thick", [False, True], ids=["middle", "thickness"])
@pytest.mark.parametrize("seed", [3, 4])
def test_contact_alone(spatial: bool, friction: str, thick: bool, seed: int) -> None:
    contact = {"stiffness": 1e4, "damping": 10.0, "ramp": 1e-3, "thickness_in_gap": thick}
    system = only(strip_system(spatial, contact=contact, friction=FRICTION[friction]), ContactGroup)
    q, u = pressed_state(system, 0.02, seed)
    poses, rates = system.place(1.0, q, u)
    found = surfaces_of(system).find(poses, 0.0)
    assert len(found.slot) >= 5
    assert np.unique(surfaces_of(system).measure(poses, rates, 0.0).bodies).size >= 6
    stiffness, damping = check(system, q, u, size=1e-6)
    # friction makes the tangent unsymmetric; without friction, only damping does
    assert (np.abs(damping - damping.T).max() > 1e-3 * np.abs(damping).max()) == (friction != "none")
    assert np.abs(stiffness).max() > 0


TIPS = pytest.mark.parametrize("past", [1.0, -1.0], ids=["beginning", "end"])
PROBES = pytest.mark.parametrize("straight", [0.0, STRAIGHT], ids=["interior", "end probe"])


@SPATIAL
@TIPS
@PROBES
@pytest.mark.parametrize("friction", [name for name in FRICTION if "bristles" not in name])
@pytest.mark.parametrize(("angle", "thick"), [(0.5, True), (1.4, False)], ids=["thickness", "middle, nearly round"])
def test_contact_on_a_rounded_tip(
    spatial: bool, past: float, straight: float, friction: str, angle: float, thick: bool
) -> None:
    contact = {"stiffness": 1e4, "damping": 10.0, "ramp": 1e-3, "thickness_in_gap": thick}
    system = only(strip_system(spatial, contact=contact, friction=FRICTION[friction]), ContactGroup)
    q, u = tip_state(system, angle, straight, past, 2e-3, seed=12)
    over, part = on_tips(system, q, u)
    # at an end the piece starts at its station 4, and at the beginning it ends at its station 5
    assert np.any((over * past < 0.0) & (part == straight))
    stiffness, damping = check(system, q, u, size=1e-6)
    assert np.abs(stiffness).max() > 0
    assert (np.abs(damping - damping.T).max() > 1e-3 * np.abs(damping).max()) == (friction != "none")


@SPATIAL
@TIPS
@PROBES
def test_stiffness_at_rest_on_a_rounded_tip_is_symmetric(spatial: bool, past: float, straight: float) -> None:
    """The matrix is the second derivative of an energy; in space, rotations do not commute, and the force adds its
    moments."""
    contact = {"stiffness": 1e4, "damping": 0.0, "ramp": 1e-3}
    system = only(strip_system(spatial, contact=contact), ContactGroup)
    q, u = tip_state(system, 0.9, straight, past, 2e-3, seed=13)
    assert np.any((on_tips(system, q, u)[0] != 0.0) & (on_tips(system, q, u)[1] == straight))
    stiffness = system.tangent(1.0, q, 0 * u)[0].toarray()
    if spatial:
        moments = system.force(1.0, q, 0 * u).reshape(-1, 6)[:, 3:]
        for body, (x, y, z) in enumerate(moments):
            turns = slice(6 * body + 3, 6 * body + 6)
            stiffness[turns, turns] += 0.5 * np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-12 * np.abs(stiffness).max())


@SPATIAL
@pytest.mark.parametrize("follower", [False, True], ids=["dead", "follower"])
def test_loads_alone(spatial: bool, follower: bool) -> None:
    load = {
        "body": "panel 3 segment 2", "point": [0.01, 0.0, 2e-3], "force": [0.3, 0.0, -0.7], "follower": follower,
        "moment": [0.0, 1e-3, 0.0], "time": {"kind": "ramp", "end": 3.0},
    }  # fmt: skip
    if spatial:
        load |= {"point": [0.01, 5e-3, 2e-3], "force": [0.3, 0.2, -0.7], "moment": [2e-4, 1e-3, -3e-4]}
    system = only(strip_system(spatial, load=[load]), LoadGroup)
    stiffness, _ = check(system, *random_state(system, 0.3, seed=6), size=1e-3)
    assert np.count_nonzero(stiffness) >= (2 if follower and not spatial else 1)


@SPATIAL
@pytest.mark.parametrize("thick", [False, True], ids=["middle", "thickness"])
def test_everything_together(spatial: bool, thick: bool) -> None:
    load = {"body": "panel 3 segment 2", "point": [0.01, 0.0, 0.0], "force": [1e-3, 0.0, -2e-3], "follower": True}
    contact = {"stiffness": 1e4, "damping": 10.0, "ramp": 1e-3, "thickness_in_gap": thick}
    system = strip_system(
        spatial, SPLINE, contact=contact, friction=FRICTION["step"], load=[load], gravity=[0.0, 0.0, -9.81]
    )
    check(system, *pressed_state(system, 0.02, seed=8), size=1e-6)


@SPATIAL
@pytest.mark.parametrize("friction", ["none", "step", "across", "bristles across"])
def test_whole_tangent_of_a_quasi_static_step(spatial: bool, friction: str) -> None:
    """K + D/dt, where velocities are increments since the last state over dt, after large rotations since then."""
    contact = {"stiffness": 1e4, "damping": 10.0, "ramp": 1e-3}
    system = strip_system(spatial, SPLINE, contact=contact, friction=FRICTION[friction], thickness=5e-3)
    q, _ = pressed_state(system, 0.02, seed=8)
    rng = np.random.default_rng(9)
    past = system.retract(q, steps(system, 1.0) * rng.uniform(-0.3, 0.3, system.nu))
    t, duration = 1.0, 0.2
    before = (t - duration, past)

    def force(dx: np.ndarray) -> np.ndarray:
        there = system.retract(q, dx)
        return system.force(t, there, system.difference(past, there) / duration, before)

    linear = system.linearise(t, q, system.difference(past, q) / duration, before)
    exact = linear.stiffness.bsr().toarray() + linear.damping.bsr().toarray() / duration
    rounding = 1e-13 * np.abs(force(np.zeros(system.nu))).max()
    step = steps(system, 1e-6)
    assert_same(exact, -fine_differences(force, step), rounding / step.min())


def test_gyroscopic_moments() -> None:
    body = Body(name="top", mass=1.0, inertia=(1.0, 2.0, 2.5), position=(0.0, 1.0, 0.0))
    system = compile_scene(Scene(bodies=(body,)), spatial=True)
    q, _ = system.initial()
    u = np.array([0.1, 0.2, 0.3, 1.0, -2.0, 3.0])
    _, damping = check(system, q, u)
    assert np.abs(damping[3:, 3:]).max() > 0.5


@pytest.mark.parametrize(
    ("spatial", "off"), [(False, 0.0), (True, 0.0), (True, 1e-3)], ids=["planar", "unit", "drifted"]
)
def test_first_order_jacobian(spatial: bool, off: float) -> None:
    contact = {"stiffness": 1e4, "damping": 10.0, "ramp": 1e-3, "thickness_in_gap": False}
    system = strip_system(spatial, SPLINE, contact=contact, friction=FRICTION["tanh"])
    q, u = pressed_state(system, 0.02, seed=9)
    if spatial:  # as in a run, in which the solver keeps the norm only to its tolerance
        q = q.copy()
        q.reshape(-1, 7)[:, 3:] *= 1.0 + off
    equations = FirstOrder(system)
    y = np.concatenate([q, u])
    scales = system.scales()
    step = np.concatenate([1e-6 * scales.configuration, np.full(system.nu, 1e-3) * steps(system, 1.0)])
    found = fine_differences(lambda change: equations.rate(1.0, y + change), step)
    exact = equations.jacobian(1.0, y).toarray()
    nq = system.nq
    rate = np.abs(equations.rate(1.0, y))
    for rows in (slice(0, nq), slice(nq, None)):
        for columns in (slice(0, nq), slice(nq, None)):
            noise = 1e-13 * rate[rows].max() / step[columns].min()
            assert_same(exact[rows, columns], found[rows, columns], noise)
