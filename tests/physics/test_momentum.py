"""Momentum of free chains: two chains of plates, joined by internal springs and dampers, that touch and slide.

Inner forces come in pairs that act at one point, so their sum and the sum of their moments vanish to round-off in any state.
Over a run, linear momentum is a linear invariant, which Radau and BDF keep to round-off, and so do their Newton iterations,
since the Jacobian has the same invariant. Angular momentum is quadratic; Radau IIA keeps it to its tolerance only.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fsm.case.models.contact import Contact, Friction
from fsm.case.models.scene import Body, ContactPair, ForceElement, Plate, Scene, Surface
from fsm.kernels.rotation import rotation_matrix
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

COUNT, LENGTH, WIDTH, THICKNESS = 5, 0.02, 0.03, 1e-3


def chain(name: str, x: float, z: float, rng: np.random.Generator, spatial: bool) -> tuple[list[Body], list[ForceElement]]:
    """A straight chain of plates with uneven masses and random velocities; uneven springs and dampers everywhere."""
    keep = np.array([1.0, 1.0 if spatial else 0.0, 1.0])
    bodies = []
    for i in range(COUNT):
        velocity, rate = 0.1 * rng.standard_normal(3) * keep, 2.0 * rng.standard_normal(3) * (1.0 if spatial else 1.0 - keep)
        bodies.append(
            Body(
                name=f"{name}{i}",
                mass=1e-3 * (1.0 + rng.random()),
                inertia=(8e-8, 4e-8, 1e-7),
                position=(x + (i + 0.5) * LENGTH, 0.0, z),
                velocity=tuple(velocity),
                angular_velocity=tuple(rate),
                plate=Plate(length=LENGTH, width=WIDTH, thickness=THICKNESS),
            )
        )
    elements = [
        ForceElement(
            name=f"{name} joint {i}",
            inner=f"{name}{i}",
            outer=f"{name}{i + 1}",
            point_inner=(LENGTH / 2, 0.002 if spatial else 0.0, 1e-3),
            point_outer=(-LENGTH / 2, 0.002 if spatial else 0.0, 1e-3),
            translation=(3e3, 1e3, 2e3),
            rotation=(0.03, 0.02, 0.1),
            translation_damping=(0.3, 0.2, 0.1),
            rotation_damping=(3e-5, 2e-5, 1e-4),
        )
        for i in range(COUNT - 1)
    ]
    return bodies, elements


def two_chains(spatial: bool) -> SegmentSystem:
    """One chain above the other, shifted by a third of a plate, with a penetration of 0.1 mm."""
    rng = np.random.default_rng(7)
    lower = chain("a", 0.0, 0.0, rng, spatial)
    upper = chain("b", LENGTH / 3, THICKNESS - 1e-4, rng, spatial)
    scene = Scene(
        bodies=(*lower[0], *upper[0]),
        elements=(*lower[1], *upper[1]),
        surfaces=tuple(Surface(name=n, bodies=tuple(b.name for b in c[0])) for n, c in (("a", lower), ("b", upper))),
        pairs=(ContactPair(first="a", second="b"),),
        contact=Contact(stiffness=1e7, damping=20.0, ramp=1e-4),
        friction=Friction(mu_static=0.4, mu_dynamic=0.3, v_static=0.01, v_dynamic=0.05),
    )
    system = compile_scene(scene, spatial)
    assert system.spatial == spatial
    return system


def parts(system: SegmentSystem, q: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Position and rotation matrix, mass and moments of inertia of each body, all in space."""
    found = []
    for pose, inertia in zip(q.reshape(system.n_free, -1), system.bodies.inertia[system.bodies.free], strict=True):
        if system.spatial:
            found.append((pose[:3], rotation_matrix(pose[3:]), inertia[:3], inertia[3:]))
        else:
            place, inertia_y = np.array([pose[0], 0.0, pose[1]]), np.array([0.0, inertia[2], 0.0])
            found.append((place, np.eye(3), inertia[[0, 0, 1]], inertia_y))
    return found


def split(system: SegmentSystem, vector: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Linear and angular part of a (nu,) vector, for each body, in three dimensions."""
    rows = vector.reshape(system.n_free, -1)
    if system.spatial:
        return [(row[:3], row[3:]) for row in rows]
    return [(np.array([row[0], 0.0, row[1]]), np.array([0.0, row[2], 0.0])) for row in rows]


def momentum(system: SegmentSystem, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear momentum, and angular momentum about the origin."""
    linear, angular = np.zeros(3), np.zeros(3)
    for (place, turn, mass, inertia), (velocity, rate) in zip(parts(system, q), split(system, u), strict=True):
        linear += mass * velocity
        angular += np.cross(place, mass * velocity) + turn @ (inertia * rate)
    return linear, angular


def imbalance(system: SegmentSystem, q: np.ndarray, u: np.ndarray) -> tuple[float, float]:
    """Total force and total moment about the origin, over the sums of the magnitudes of their terms."""
    force, moment = np.zeros(3), np.zeros(3)
    forces, moments = 0.0, 0.0
    terms = zip(parts(system, q), split(system, system.force(0.0, q, u)), split(system, u), strict=True)
    for (place, turn, _, inertia), (push, couple), (_, rate) in terms:
        # h contains -w x J w, which is the rate of the body axes and not a force
        arm, own = np.cross(place, push), turn @ (couple + np.cross(rate, inertia * rate))
        force, moment = force + push, moment + arm + own
        forces, moments = forces + np.linalg.norm(push), moments + np.linalg.norm(arm) + np.linalg.norm(own)
    return float(np.linalg.norm(force) / forces), float(np.linalg.norm(moment) / moments)


def disturbed(system: SegmentSystem, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A random state near the first one, in which the chains touch, all springs are loaded and all contacts slip."""
    rng = np.random.default_rng(seed)
    q, u = system.initial()
    step = rng.standard_normal((system.n_free, system.size)) * 1e-4
    step[:, system.size // 2 :] *= 100.0 if system.spatial else 1.0
    if not system.spatial:
        step[:, 2] *= 100.0
    return system.retract(q, step.ravel()), u * rng.standard_normal(system.nu)


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_inner_forces_and_moments_cancel(seed: int, spatial: bool) -> None:
    system = two_chains(spatial)
    q, u = disturbed(system, seed)
    assert system.observe(0.0, q, u).pairs.force[0] > 1.0
    force, moment = imbalance(system, q, u)
    assert force < 1e-12
    assert moment < 1e-12


@cache
def run(spatial: bool, method: str, rtol: float) -> tuple[SegmentSystem, SavedState]:
    """State after 20 ms, at which the chains have separated."""
    system = two_chains(spatial)
    saved: list[SavedState] = []
    simulate(system, Settings(method, rtol, 0.02), [0.0, 0.02], saved.append)
    assert saved[0].observation.pairs.force[0] > 1.0
    return system, saved[-1]


def drift(spatial: bool, method: str, rtol: float) -> tuple[float, float]:
    """Change of linear and angular momentum over the run, over the sums of the magnitudes at its start."""
    system, last = run(spatial, method, rtol)
    before, after = momentum(system, *system.initial()), momentum(system, last.q, last.u)
    linear, angular = 0.0, 0.0
    q, u = system.initial()
    for (place, turn, mass, inertia), (velocity, rate) in zip(parts(system, q), split(system, u), strict=True):
        linear += np.linalg.norm(mass * velocity)
        angular += np.linalg.norm(np.cross(place, mass * velocity)) + np.linalg.norm(turn @ (inertia * rate))
    changes = [np.linalg.norm(a - b) for a, b in zip(after, before, strict=True)]
    return float(changes[0] / linear), float(changes[1] / angular)


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("method", ["Radau", "BDF"])
def test_linear_momentum_of_a_run(method: str, spatial: bool) -> None:
    assert drift(spatial, method, 1e-4)[0] < 1e-12


@pytest.mark.parametrize("spatial", [False, True])
def test_angular_momentum_of_a_run(spatial: bool) -> None:
    loose, tight = drift(spatial, "Radau", 1e-4)[1], drift(spatial, "Radau", 1e-8)[1]
    assert tight < 1e-11
    assert tight < 1e-2 * loose
