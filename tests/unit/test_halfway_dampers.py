"""Dampers of flexible elements in a step of the mean-force method: rotations, work and loss, tangents, order."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

import fsm
from fsm.model.compile.compile_case import compile_case
from fsm.model.nodes.beams.bars import BarMaterial, BarMesh
from fsm.model.nodes.beams.hinge import HingeGroup
from fsm.model.nodes.cable import CableGroup
from fsm.model.nodes.mesh import Mesh, node_pattern
from fsm.model.nodes.system.array_kernels import KERNELS
from fsm.model.nodes.system.build import MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.time.mean_force import MeanForce
from tests.physics.test_flexible_joints import film as film_of
from tests.physics.test_frames_on_sheets import zigzag
from tests.unit.test_ancf_elements import FILM, STEEL, builder

_GAUSS = 0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0)
_TAU = 1e-3


def films(tau: float = _TAU) -> AncfSystem:
    """Film with a patch, and a cable."""
    return AncfSystem(builder(tau)[0].build())


def cable(tau: float = _TAU) -> AncfSystem:
    made = MeshBuilder()
    made.cable(np.zeros(3), np.array([1.0, 0.2, 0.0]), STEEL, 3, viscosity=tau)
    return AncfSystem(made.build())


def film(tau: float) -> AncfSystem:
    made, x = MeshBuilder(), np.array([0.0, 0.1, 0.2])
    made.film(x, x, (FILM,), np.zeros((2, 2), dtype=np.int64), False, tau)
    return AncfSystem(made.build())


def sheet(facets: str, tau: float = _TAU) -> AncfSystem:
    """Free folded sheet with damped creases."""
    data = zigzag(facets, {}, gravity=[0.0, 0.0, 0.0])
    data["material"]["damping"] = tau
    system: Any = compile_case(fsm.load(data).model)[1]
    return system if isinstance(system, AncfSystem) else system.elements


def beams(element: str, tau: float = _TAU) -> AncfSystem:
    """Two bars in a plane with a damped hinge between them, at its stop."""
    mesh = BarMesh(element, BarMaterial(2e11, 0.3, 7850.0, 0.02, 0.01, damping=tau))
    a, h, b = (mesh.position(at, name) for name, at in (("a", (0.0, 0.0)), ("h", (0.4, 0.0)), ("b", (0.6, 0.2))))
    one, two = mesh.bar("one", [a, h], (2,)), mesh.bar("two", [h, b], (1,))
    law = np.array([[0.1, 2.0, 0.03, 0.02, 0.5, -0.2, 40.0, 0.01]])
    vectors, angle = np.array([[one.slopes[-1], two.slopes[0]]]), np.array([0.25 * math.pi])
    hinge = HingeGroup(vectors, angle, np.array([1.0]), law)
    groups, values = (mesh.group(), hinge), np.array(mesh.values)
    pattern = node_pattern(len(values), 2, groups, ())
    quads, held = np.zeros((0, 4), dtype=np.int64), np.zeros(values.size, dtype=bool)
    names, places = tuple(mesh.names), np.array(mesh.positions)
    return AncfSystem(Mesh(values.ravel(), held, groups, (), quads, names, pattern, 2, places))


KINDS: dict[str, Callable[..., AncfSystem]] = {
    "film and cable": films, "facets": partial(sheet, "flexible"), "bars": partial(sheet, "bars"),
    "section": partial(beams, "section"), "green": partial(beams, "green"), "thin": partial(beams, "cable"),
}  # fmt: skip


def deformed(system: AncfSystem, seed: int, size: float = 0.03) -> tuple[np.ndarray, np.ndarray]:
    """Deformed coordinates, and a further change of them."""
    rng, free = np.random.default_rng(seed), ~system.fixed
    scale = size * np.where(system.mesh.is_position, 0.1, 1.0) * free
    return system.initial()[0] + scale * rng.normal(size=system.nq), scale * rng.normal(size=system.nq)


def rotated(system: AncfSystem, q: np.ndarray, seed: int) -> np.ndarray:
    """Increment of a rigid motion by a random angle of 0.5 to 2 rad."""
    rng, width = np.random.default_rng(seed), system.mesh.dimension
    angle = rng.uniform(0.5, 2.0)
    if width == 2:
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    else:
        turn = Rotation.from_rotvec(angle * np.array(unit(rng.normal(size=3)))).as_matrix()
    x = (q.reshape(-1, width) @ turn.T).ravel() - q + system._translation(np.append(rng.normal(size=2), 0.0))
    return np.where(system.fixed, 0.0, x)


def unit(vector: np.ndarray) -> np.ndarray:
    return np.asarray(vector / np.linalg.norm(vector))


def mean_force(system: AncfSystem, h: float, q: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, float]:
    """Mean force of a step, and the energy that the dampers dissipate."""
    system.halfway(0.0, h, q, x)
    force = sum(0.5 * system.force(part * h, q + part * x, x / h) for part in _GAUSS)
    lost = sum(0.5 * h * system.energy(part * h, q + part * x, x / h).dissipated_power for part in _GAUSS)
    system.halfway(0.0, 0.0, q, x)
    return np.asarray(force), float(lost)


def elastic_force(system: AncfSystem, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    return np.asarray(sum(0.5 * system.force(0.0, q + part * x, None) for part in _GAUSS))


@pytest.mark.parametrize("kind", KINDS)
def test_a_rigid_rotation_loses_no_energy(kind: str) -> None:
    system, h = KINDS[kind](), 1e-3
    for seed in range(3):
        q = deformed(system, seed)[0]
        x = rotated(system, q, seed)
        force, lost = mean_force(system, h, q, x)
        dampers = force - elastic_force(system, q, x)
        wrong = np.abs(system.force(0.0, q + _GAUSS[0] * x, x / h) - system.force(0.0, q + _GAUSS[0] * x, None)).max()
        assert np.abs(dampers).max() < 1e-11 * wrong
        assert 0.0 <= lost < 1e-12 * 0.5 * float(x @ system.momentum(q, x)) / h**2
        assert not system.halfway(0.0, 0.0, q, x)


@pytest.mark.parametrize(
    ("first", "damping"), [("left", ["rotation_damping"]), ("right", ["translation_damping", "rotation_damping"])]
)
def test_dampers_of_hinges_lose_no_energy_in_a_rotation(first: str, damping: list[str]) -> None:
    """Dampers against turns between any two frames of a film, and all dampers between frames at one place."""
    frames = [{"name": "one", "on": "film", "edge": first}, {"name": "two", "on": "film", "at": [0.5, 0.0]}]
    element = {"name": "damper", "inner": "one", "outer": "two"} | {name: [1.0, 1.0, 1.0] for name in damping}
    scene = {"films": [film_of(mesh=[4, 1])], "frames": frames, "elements": [element]}
    system: Any = compile_case(fsm.load({"units": "SI", "scene": scene, "solve": {"end_time": 1.0}}).model)[1]
    q, _ = system.initial()
    x = rotated(system.elements, q, 8)
    lost = sum(0.5e-3 * system.energy(0.0, q + part * x, 1e3 * x).dissipated_power for part in _GAUSS)
    assert 0.0 <= lost < 1e-20 * 0.5e6 * float(x @ system.momentum(q, x))


@pytest.mark.parametrize("kind", KINDS)
def test_the_loss_of_a_step_is_the_work_of_its_dampers(kind: str) -> None:
    system, h = KINDS[kind](), 1e-3
    for seed in range(3):
        q, x = deformed(system, seed)
        x += rotated(system, q, seed)
        force, lost = mean_force(system, h, q, x)
        elastic = elastic_force(system, q, x)
        assert lost == pytest.approx((elastic - force) @ x, rel=1e-9)
        assert lost > 0.0


def test_the_loss_of_a_cable_follows_from_the_change_of_its_strain() -> None:
    """eta EA integral (E_1 - E_0)^2/h; Green's strain is quadratic, so this holds for steps of any size."""
    system, h = cable(), 2e-3
    arrays = next(group for group in system.groups if isinstance(group, CableGroup)).arrays
    q, x = deformed(system, 4, 0.3)
    x += rotated(system, q, 5)

    def strain(state: np.ndarray) -> np.ndarray:
        vectors = state[arrays.vectors[:, :, None] + np.arange(3)] * arrays.scale[:, :, None]
        slopes = np.einsum("pi,eia->epa", arrays.stretch_rows[:, 0], vectors) / arrays.length[:, None, None]
        return np.asarray(0.5 * (np.sum(slopes**2, axis=-1) - 1.0))

    rate = (strain(q + x) - strain(q)) / h
    wanted = _TAU * h * np.einsum("e,e,p,ep->", arrays.stiffness[:, 0], arrays.length, arrays.stretch_weights, rate**2)
    assert mean_force(system, h, q, x)[1] == pytest.approx(wanted, rel=1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_the_tangent_of_a_step_is_the_derivative_of_its_mean_force(kind: str) -> None:
    system, h = KINDS[kind](), 1e-2
    q, x = deformed(system, 6)
    x += 0.1 * rotated(system, q, 6)
    system.halfway(0.0, h, q, x)
    tangent = np.zeros((system.nu, system.nu))
    for part in _GAUSS:
        linear = system.linearise(part * h, q + part * x, x / h)
        tangent += 0.5 * part * linear.stiffness.bsr().toarray() + 0.5 / h * linear.damping.bsr().toarray()
    system.halfway(0.0, 0.0, q, x)
    rng = np.random.default_rng(7)
    for _ in range(3):
        change = 1e-6 * rng.normal(size=system.nu) * np.where(system.mesh.is_position, 0.1, 1.0) * ~system.fixed
        one, two = (mean_force(system, h, q, x + side * change)[0] for side in (0.5, -0.5))
        wanted = tangent @ change
        assert one - two == pytest.approx(-wanted, abs=2e-7 * np.abs(wanted).max())


@pytest.mark.parametrize("kind", KINDS)
def test_compiled_tangents_at_both_points_have_the_dampers_of_their_step(kind: str) -> None:
    """Kernels compute the tangents of dampers once in a step."""
    system, h = KINDS[kind](), 1e-2
    model = system.arrays(LinearSolver().ready)
    assert model is not None
    arrays, vector = model.arrays, np.random.default_rng(8).normal(size=system.nu)
    for seed in (6, 7):
        q, x = deformed(system, seed)
        system.halfway(0.0, h, q, x)
        assert KERNELS.halfway(arrays, 0.0, h, q, x)
        for part in _GAUSS:
            state = part * h, q + part * x, x / h
            force, expected = KERNELS.renewed_force(arrays, *state), system.linearise(*state)
            assert np.abs(force - expected.force).max() < 1e-11 * np.abs(expected.force).max()
            for times, matrix in ((KERNELS.stiffness_times, expected.stiffness), (KERNELS.damping_times, expected.damping)):
                exact = matrix.bsr() @ vector
                assert np.abs(times(arrays, vector) - exact).max() < 1e-11 * np.abs(exact).max()
        system.halfway(0.0, 0.0, q, x)
        KERNELS.halfway(arrays, 0.0, 0.0, q, x)


@pytest.mark.parametrize("build", [cable, film, KINDS["bars"]], ids=["cable", "film", "bars"])
def test_a_mode_decays_as_its_closed_form(build: Callable[..., AncfSystem]) -> None:
    """Slowest mode with D = tau K: exp(-a t) (cos(b t) + a/b sin(b t)) with a = tau w^2/2 and b^2 = w^2 - a^2; the error is
    of order h^2.
    """
    system = build(0.0)
    start, free = system.initial()[0], ~system.fixed
    stiffness = system.linearise(0.0, start, None).stiffness.bsr().toarray()[np.ix_(free, free)]
    mass, damping = (matrix.toarray()[np.ix_(free, free)] for matrix in (
        system.mass(start), build(1.0).linearise(0.0, start, np.zeros(system.nu)).damping.bsr()
    ))  # fmt: skip
    squares, modes = eigh(stiffness, mass)
    even = np.linalg.norm(damping @ modes - stiffness @ modes, axis=0) < 1e-6 * np.linalg.norm(stiffness @ modes, axis=0)
    number = int(np.argmax((squares > 1e-9 * squares[-1]) & even))
    omega, shape = math.sqrt(squares[number]), np.zeros(system.nu)
    shape[free] = modes[:, number] * 1e-6 / np.abs(modes[:, number]).max()
    system, decay = build(0.1 / omega), 0.05 * omega
    fast, time, of_shape = math.sqrt(omega**2 - decay**2), 2.5 * math.pi / omega, system.momentum(start, shape)
    wanted = math.exp(-decay * time) * (math.cos(fast * time) + decay / fast * math.sin(fast * time))
    errors, of_phase = [], math.exp(-decay * time) * omega * time * (omega * time / 50) ** 2 / 12.0
    for steps in (25, 50):
        method = MeanForce(system, 0.0, start + shape, np.zeros(system.nu), 1e-10, time / steps)
        while method.t < 0.999 * time:
            method.step(time)
        errors.append(abs(float((method.q - start) @ of_shape) / float(shape @ of_shape) - wanted))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] == pytest.approx(of_phase, rel=0.05)
