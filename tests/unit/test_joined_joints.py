"""Ideal joints, springs and cords on films, beams and cables: tangents and projections against differences."""

from __future__ import annotations

import numpy as np

from fsm.case.models.flexible import SceneBeam, SceneCable, SceneFilm, SceneFrame
from fsm.case.models.joint import SceneJoint
from fsm.case.models.scene import Body, Scene
from fsm.case.models.spring import SceneCord, SceneSpring
from fsm.model.compile.compile_joined import compile_model
from fsm.model.elements.joints import JointGroup
from fsm.model.joined.system import JoinedSystem
from tests.tangents import differences


def scene() -> Scene:
    """A film hinged along an edge to a plate, a cable on its corner, and a beam on another body; a spring and a cord."""
    film = SceneFilm(
        name="sail", length=0.4, width=0.3, thickness=1e-3, young=3e8, density=1400.0, mesh=(2, 2),
        orientation=(np.cos(0.1), np.sin(0.1), 0.0, 0.0),
    )  # fmt: skip
    plate = Body(name="plate", mass=0.05, inertia=(2e-4, 3e-4, 4e-4), position=(-0.35, 0.0, 0.02))
    weight = Body(name="weight", mass=0.02, inertia=(2e-5, 3e-5, 4e-5), position=(0.6, 0.3, -0.2))
    cable = SceneCable(
        name="rope", start=(0.2, 0.147, 0.015), end=(0.55, 0.3, -0.2), diameter=4e-3, young=1e8, density=900.0, elements=2
    )
    beam = SceneBeam(
        name="boom", start=(-0.5, 0.0, 0.0), end=(-0.5, 0.0, 0.5), width=0.02, thickness=0.01, young=1e9, density=1500.0,
        elements=2,
    )  # fmt: skip
    edge = (0.0, np.cos(0.2), np.sin(0.2))
    joints = (
        SceneJoint(name="hinge", kind="revolute", first="plate", second="sail.left", at=(-0.21, 0.0, 0.01), axis=edge),
        SceneJoint(name="ball", kind="spherical", first="corner", second="rope.start", at=(0.2, 0.147, 0.015)),
        SceneJoint(name="grip", kind="fixed", first="rope.end", second="weight", at=(0.55, 0.3, -0.2)),
        SceneJoint(name="pin", kind="revolute", first="boom.start", second="plate", at=(-0.5, 0.0, 0.0), axis=(0, 1, 0)),
        SceneJoint(name="rod", kind="distance", first="boom.end", second="weight", at=(-0.5, 0.0, 0.5), to=(0.6, 0.3, -0.2)),
    )  # fmt: skip
    spring = SceneSpring(
        name="spring", first="boom.end", second="sail.top", at=(-0.5, 0.0, 0.5), to=(0.0, 0.16, 0.02), stiffness=20.0
    )
    cord = SceneCord(name="cord", first="ground", second="corner", at=(0.0, 0.0, 0.5), to=(0.2, 0.15, 0.02), stiffness=30.0)
    return Scene(
        bodies=(plate, weight), films=(film,), cables=(cable,), beams=(beam,),
        joints=joints, springs=(spring,), cords=(cord,),
        frames=(SceneFrame(name="corner", on="sail", at=(0.2, 0.15)),), gravity=(0.0, 0.5, -9.81),
    )  # fmt: skip


def consistent(bent: float, speed: float) -> tuple[JoinedSystem, np.ndarray, np.ndarray, np.ndarray]:
    """System, with a state and an acceleration that fit its joints."""
    system = compile_model(scene())
    assert isinstance(system, JoinedSystem)
    generator, free = np.random.default_rng(3), ~system._fixed.ravel()
    q, u = system.initial()
    q = system.retract(q, bent * generator.standard_normal(system.nu) * free)
    u, rate = speed * generator.standard_normal(system.nu) * free, np.zeros(system.nu)
    for _ in range(4):
        system.consistent(0.0, q, u, rate)
    return system, q, u, rate


def openings(system: JoinedSystem, q: np.ndarray) -> np.ndarray:
    group = next(group for group in system.locking if isinstance(group, JointGroup))
    return group.openings(system.place(0.0, q, None)[0])[0]


def test_projected_states_open_no_joint() -> None:
    """Openings, their rates and their second derivatives vanish, and forces with multipliers are those of inertia."""
    system, q, u, rate = consistent(0.0, 0.3)  # elastic forces would hide the accelerations of turning frames
    assert np.abs(openings(system, q)).max() < 1e-12
    rows, h = system.locked_rows(0.0, q), 1e-4 / np.abs(u).max()
    assert np.abs(rows @ u).max() < 1e-12 * np.abs(u).max()

    def at(t: float) -> np.ndarray:
        return openings(system, system.retract(q, t * u + 0.5 * t * t * rate))

    assert np.abs(at(h) - 2.0 * at(0.0) + at(-h)).max() / h**2 < 1e-4 * np.abs(rate).max()
    left = system.force(0.0, q, u) - system.mass(q) @ rate
    assert np.abs(left).max() < 1e-8 * np.abs(system.force(0.0, q, u)).max()


def test_tangent_with_multipliers_is_that_of_the_force() -> None:
    system, q, u, _ = consistent(3e-3, 0.03)
    free = ~system._fixed.ravel()
    found = system.linearise(0.0, q, u).stiffness.bsr().toarray()
    slopes = differences(lambda x: system.force(0.0, system.retract(q, x), u), np.full(system.nu, 1e-6))
    wanted = -slopes[np.ix_(free, free)]
    rows = np.abs(wanted).max(axis=1, keepdims=True) + 1e-6 * np.abs(wanted).max()
    assert np.all(np.abs(found[np.ix_(free, free)] - wanted) <= 2e-5 * rows)
