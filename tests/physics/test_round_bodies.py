"""Spheres on plates, planes and one another, at random sizes and places, against Hertz and against rigid bodies."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fsm.case.models.contact import Contact, Friction
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, Plate, Scene
from fsm.model.compile.compile import compile_scene
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.time.generalized_alpha import GeneralizedAlpha

DIMENSIONS = pytest.mark.parametrize("spatial", [False, True], ids=["plane", "space"])
G = 9.81
Triple = tuple[float, float, float]


def ball(name: str, radius: float, position: Triple, velocity: Triple = (0.0, 0.0, 0.0)) -> tuple[Body, Obstacle]:
    """A steel ball with its shape, which is called by its name and "'s shape"."""
    mass = 7800.0 * 4.0 / 3.0 * math.pi * radius**3
    inertia = 0.4 * mass * radius**2
    body = Body(name=name, mass=mass, inertia=(inertia,) * 3, position=position, velocity=velocity)
    return body, Obstacle(name=f"{name}'s shape", shape="sphere", radius=radius, body=name)


def steel(radius: float, young: float = 200e9) -> Contact:
    """Of two balls of that size."""
    return Contact.model_validate({"young": young, "poisson": 0.3, "radius": [radius, radius]})


def scene_of(balls: list[tuple[Body, Obstacle]], contact: Contact, **more: object) -> Scene:
    """Every ball with every other."""
    names = [shape.name for _, shape in balls]
    pairs = tuple(ContactPair(first=a, second=b) for i, a in enumerate(names) for b in names[i + 1 :])
    scene = Scene(
        bodies=tuple(body for body, _ in balls), obstacles=tuple(shape for _, shape in balls), pairs=pairs, contact=contact
    )
    return scene.model_copy(update=more)


# Hertz ------------------------------------------------------------------------------------------------------------


def impact(scene: Scene, spatial: bool) -> tuple[float, float, float]:
    """Largest depth (m) and force (N), and duration (s) of the first impact."""
    system = compile_scene(scene, spatial)
    q, u = system.initial()
    system.commit(0.0, q, u)
    solver, rows = GeneralizedAlpha(system, 0.0, q, u, 1e-6), [(0.0, 1e-7, 0.0)]
    while len(rows) < 3 or rows[-1][1] < 0.0 or rows[-2][1] >= 0.0:
        solver.step(1.0)
        pairs = system.observe(solver.t, solver.q, solver.u).pairs
        rows.append((solver.t, float(pairs.gap.min()), float(pairs.force.max())))
        assert len(rows) < 2000
    times, gaps, forces = np.array(rows).T
    inside = np.flatnonzero(gaps < 0.0)
    ends = [
        times[k] - gaps[k] * (times[k + 1] - times[k]) / (gaps[k + 1] - gaps[k]) for k in (inside[0] - 1, inside[-1])
    ]
    return -float(gaps.min()), float(forces.max()), float(ends[1] - ends[0])


@DIMENSIONS
@pytest.mark.parametrize("target", ["plate", "grid point", "plane", "ball"])
@pytest.mark.parametrize("seed", range(3))
def test_hertz_impact_of_a_sphere_wherever_it_lands(target: str, seed: int, spatial: bool) -> None:
    """K = 4/3 E* sqrt(R) acts once: depth, force and duration 2.943275 d/v agree within 0.5 %."""
    rng = np.random.default_rng([seed, 7])
    radius, speed = rng.uniform(3e-3, 0.1), rng.uniform(0.1, 2.0)
    other = radius * rng.uniform(0.5, 3.0)
    radii = [radius, other] if target == "ball" else radius
    contact = Contact.model_validate({"young": [200e9, 70e9], "poisson": [0.3, 0.33], "radius": radii})
    effective = 1.0 / ((1 - 0.3**2) / 200e9 + (1 - 0.33**2) / 70e9)
    curvature = 1 / radius + (1 / other if target == "ball" else 0.0)
    stiffness = 4.0 / 3.0 * effective / math.sqrt(curvature)
    at = rng.uniform(-1.5, 1.5, 2) * radius * [1.0, float(spatial)]
    if target in ("grid point", "ball"):
        at = np.zeros(2)
    mover = ball("mover", radius, (at[0], at[1], radius + 1e-7), (0.0, 0.0, -speed))
    mass = mover[0].mass
    if target == "ball":
        below = ball("below", other, (0.0, 0.0, -other))
        scene = scene_of([mover, below], contact)
        mass = mass * below[0].mass / (mass + below[0].mass)
    elif target == "plane":
        shapes = (mover[1], Obstacle(name="floor", shape="plane"))
        scene = Scene(
            bodies=(mover[0],), obstacles=shapes, pairs=(ContactPair(first="floor", second=mover[1].name),), contact=contact
        )
    else:
        outline = Plate(length=4 * radius, width=5 * radius, thickness=0.5 * radius)
        floor = Body(
            name="floor", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, -0.25 * radius), held=True, plate=outline
        )
        scene = Scene(
            bodies=(mover[0], floor), obstacles=(mover[1],), contact=contact,
            pairs=(ContactPair(first="floor", second=mover[1].name),),
        )  # fmt: skip
    deepest = (1.25 * mass * speed**2 / stiffness) ** 0.4
    depth, force, duration = impact(scene, spatial)
    assert depth == pytest.approx(deepest, rel=5e-3)
    assert force == pytest.approx(stiffness * deepest**1.5, rel=5e-3)
    assert duration == pytest.approx(2.943275 * deepest / speed, rel=5e-3)


# many balls -------------------------------------------------------------------------------------------------------


def motion(scene: Scene, spatial: bool, end: float, records: int = 3) -> tuple[list[SavedState], list[np.ndarray], float]:
    """Saved states, rates of all bodies at each, and the relative error of the energy balance."""
    system = compile_scene(scene, spatial)
    saved: list[SavedState] = []
    statistics, energy_balance = simulate(
        system, Settings("generalized-alpha", 1e-6, end), np.linspace(0.0, end, records).tolist(), saved.append
    )
    assert max(float(point.pair_force.max()) for point in statistics.points) > 0.0
    return saved, [state.u.reshape(-1, system.size) for state in saved], energy_balance.relative_error


@DIMENSIONS
def test_a_chain_of_beads_hands_the_motion_on(spatial: bool) -> None:
    """Newton's cradle of balls with gaps between them: equal masses exchange their speeds one after the other."""
    radius, speed, room = 0.01, 0.7, 1e-4
    balls = [ball(f"bead {k}", radius, (k * (2 * radius + room), 0.0, 0.0)) for k in range(5)]
    first = balls[0][0].model_copy(update={"velocity": (speed, 0.0, 0.0)})
    scene = scene_of([(first, balls[0][1]), *balls[1:]], steel(radius))
    _, rates, error = motion(scene, spatial, 2e-3)
    speeds = rates[-1][:, 0] / speed
    np.testing.assert_allclose(speeds, [0.0, 0.0, 0.0, 0.0, 1.0], atol=2e-3)
    assert speeds.sum() == pytest.approx(1.0, abs=1e-9)
    assert (speeds**2).sum() == pytest.approx(1.0, abs=2e-3)
    assert error < 2e-3


def test_a_break_of_billiards_keeps_momentum_and_energy() -> None:
    """Six balls in a triangle without a table, hit off the axis; without friction no ball rotates."""
    radius = 0.0286
    pitch = 1.01 * radius
    places = [(row * math.sqrt(3) * pitch, (2 * k - row) * pitch) for row in (0, 1, 2) for k in range(row + 1)]
    balls = [ball(f"ball {k}", radius, (x, y, 0.0)) for k, (x, y) in enumerate(places)]
    cue = ball("cue", radius, (-2.5 * radius, 0.3 * radius, 0.0), (2.0, 0.0, 0.0))
    contact = steel(radius, 5e9)
    saved, rates, error = motion(scene_of([*balls, cue], contact), True, 0.03)
    start, end = rates[0], rates[-1]
    np.testing.assert_allclose(end[:, :3].sum(axis=0), start[:, :3].sum(axis=0), atol=1e-9)
    assert (end[:, :3] ** 2).sum() == pytest.approx((start[:, :3] ** 2).sum(), rel=2e-3)
    assert error < 2e-3
    np.testing.assert_allclose(end[:, 3:], 0.0, atol=1e-9)
    assert (np.linalg.norm(end[:, :2], axis=1) > 0.01).sum() >= 5
    x_start, x_end = (state.q.reshape(-1, 7)[:, :2] for state in (saved[0], saved[-1]))
    spin = [(x[:, 0] * u[:, 1] - x[:, 1] * u[:, 0]).sum() for x, u in ((x_start, start), (x_end, end))]
    assert spin[1] == pytest.approx(spin[0], abs=1e-6)


def test_a_cut_shot_with_friction_keeps_both_momenta() -> None:
    """Two balls in a grazing impact: friction rotates both, and its dissipation equals the loss of energy."""
    radius, mu = 0.03, 0.1
    contact = steel(radius)
    offset = 1.2 * radius
    cue = ball("cue", radius, (-2.2 * radius, offset, 0.0), (1.0, 0.0, 0.0))
    target = ball("target", radius, (0.0, 0.0, 0.0))
    friction = Friction(law="tanh", mu_dynamic=mu, v_static=1e-4)
    saved, rates, error = motion(scene_of([cue, target], contact, friction=friction), True, 0.08)
    start, end = rates[0], rates[-1]
    np.testing.assert_allclose(end[:, :3].sum(axis=0), start[:, :3].sum(axis=0), atol=1e-9)
    # line of centres at first contact; the impulse along it is that of an elastic impact, and the impulse across it is mu
    # times that
    sine = offset / (2 * radius)
    along = np.array([math.sqrt(1 - sine**2), -sine, 0.0])
    across = np.array([sine, math.sqrt(1 - sine**2), 0.0])
    np.testing.assert_allclose(end[1, :3], along[0] * along + mu * along[0] * across, atol=2e-3)
    # both balls get the same rotation: r mu J/(2/5 m r^2)
    turn = -2.5 * mu * along[0] / radius
    np.testing.assert_allclose(end[:, 5], [turn, turn], rtol=3e-3)
    angular = [
        (x[:, 0] * u[:, 1] - x[:, 1] * u[:, 0]).sum() + 0.4 * radius**2 * u[:, 5].sum()
        for x, u in ((saved[0].q.reshape(-1, 7), start), (saved[-1].q.reshape(-1, 7), end))
    ]
    assert angular[1] == pytest.approx(angular[0], abs=1e-6)
    assert error < 2e-3


@DIMENSIONS
def test_a_ball_that_slides_begins_to_roll(spatial: bool) -> None:
    """For any friction, the ball finally rolls with 5/7 of its speed, after 2 v/(7 mu g)."""
    radius, speed, mu = 0.02, 0.5, 0.3
    contact = Contact.model_validate({"young": 2e9, "poisson": 0.3, "radius": radius, "damping": 20.0})
    mover = ball("mover", radius, (0.0, 0.0, radius), (speed, 0.0, 0.0))
    deep = (mover[0].mass * G / contact.stiffness) ** (2.0 / 3.0)
    mover = ball("mover", radius, (0.0, 0.0, radius - deep), (speed, 0.0, 0.0))
    scene = Scene(
        bodies=(mover[0],),
        obstacles=(mover[1], Obstacle(name="floor", shape="plane")),
        pairs=(ContactPair(first=mover[1].name, second="floor"),),
        contact=contact,
        friction=Friction(law="tanh", mu_dynamic=mu, v_static=1e-4),
        gravity=(0.0, 0.0, -G),
    )
    stop = 2.0 * speed / (7.0 * mu * G)
    _, rates, error = motion(scene, spatial, 1.5 * stop, 4)
    turning = 4 if spatial else 2
    half, end = rates[1][0], rates[-1][0]
    assert half[0] == pytest.approx(speed - mu * G * 0.5 * stop, rel=1e-3)
    assert end[0] == pytest.approx(5.0 / 7.0 * speed, rel=2e-3)
    assert end[turning] * radius == pytest.approx(end[0], rel=2e-3)
    assert error < 1e-3
