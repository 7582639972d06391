"""Random rigid plates that fall into a box of five planes."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from fsm.case.models.contact import Contact, Friction
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, Plate, PlateGroup, Scene
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import AcceptedStep, SavedState, Statistics
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

__all__ = ["CONTACT", "FRICTION", "Fall", "box_scene", "deepest_allowed", "drop", "half_width", "outside"]

PLATE = Plate(length=0.02, width=0.015, thickness=1e-3)
DENSITY, GRAVITY = 1000.0, 9.81
SPACING = 0.027
"""Between the middles of plates as they are let go: more than a diagonal, so that none touches another."""
MASS = DENSITY * PLATE.length * PLATE.width * PLATE.thickness
CONTACT = Contact(stiffness=5e6, restitution=0.5)
FRICTION = Friction(law="tanh", mu_dynamic=0.2, v_static=0.02)
CORNER = 1.0 / 72.0
"""Least share of a face that a point stands for: a corner of a grid of 3 x 3, which plates have from both sides."""


@dataclass(frozen=True)
class Fall:
    """Result of the run.

    Attributes
    ----------
    system : SegmentSystem
    saved : states
    statistics, energy_balance
    deepest : largest penetration in all steps, m
    fastest : largest kinetic energy of one plate, J
    rise : largest increase of the total energy, which no input can explain, J
    time : processor time, s
    """

    system: SegmentSystem
    saved: list[SavedState]
    statistics: Statistics
    energy_balance: EnergyBalance
    deepest: float
    fastest: float
    rise: float
    time: float


def half_width(columns: int) -> float:
    """Distance from the middle of the box to a side, m."""
    return 0.5 * SPACING * columns + 1.5e-3


def box_scene(
    count: int, columns: int, seed: int = 1, contact: Contact = CONTACT, friction: Friction | None = FRICTION
) -> Scene:
    """Plates in layers of `columns` by `columns` over the floor of the box, with random orientations and angular velocities.

    Parameters
    ----------
    count : int
    columns : int
    """
    rng = np.random.default_rng(seed)
    squares = np.array([PLATE.length, PLATE.width, PLATE.thickness]) ** 2
    inertia = tuple((MASS / 12 * (squares.sum() - squares)).tolist())
    bodies = []
    for number in range(count):
        layer, place = divmod(number, columns**2)
        row, column = divmod(place, columns)
        turn = rng.normal(size=4)
        bodies.append(
            Body(
                name=f"plate {number + 1}",
                mass=MASS,
                inertia=inertia,
                plate=PLATE,
                position=(
                    SPACING * (row - 0.5 * (columns - 1)),
                    SPACING * (column - 0.5 * (columns - 1)),
                    0.015 + SPACING * layer,
                ),
                orientation=tuple((turn / np.linalg.norm(turn)).tolist()),
                velocity=tuple((0.05 * rng.normal(size=3)).tolist()),
                angular_velocity=tuple((2.0 * rng.normal(size=3)).tolist()),
            )
        )
    walls = _walls(half_width(columns))
    pile = PlateGroup(name="plates", bodies=tuple(body.name for body in bodies))
    pairs = [ContactPair(first="plates", second=name) for name in ("plates", *(wall.name for wall in walls))]
    return Scene(
        bodies=tuple(bodies), groups=(pile,), obstacles=walls, pairs=tuple(pairs), contact=contact, friction=friction,
        gravity=(0.0, 0.0, -GRAVITY),
    )  # fmt: skip


def _walls(half: float) -> tuple[Obstacle, ...]:
    """Floor and four sides, each a plane whose normal points inwards."""
    c = math.sqrt(0.5)
    return (
        Obstacle(name="floor", shape="plane"),
        Obstacle(name="left", shape="plane", position=(-half, 0.0, 0.0), orientation=(c, 0.0, c, 0.0)),
        Obstacle(name="right", shape="plane", position=(half, 0.0, 0.0), orientation=(c, 0.0, -c, 0.0)),
        Obstacle(name="front", shape="plane", position=(0.0, -half, 0.0), orientation=(c, -c, 0.0, 0.0)),
        Obstacle(name="back", shape="plane", position=(0.0, half, 0.0), orientation=(c, c, 0.0, 0.0)),
    )


def deepest_allowed(contact: Contact, energy: float, weight: float) -> float:
    """Depth of one corner of a plate that absorbs an energy (J), and depth of a corner under a weight (N), m.

    The depth is elastic: K d^(e+1)/(e+1) = energy + weight d, with the part of K of a corner.
    """
    power, depth = contact.exponent + 1.0, 0.0
    for _ in range(50):
        depth = float((power * (energy + weight * depth) / (CORNER * contact.stiffness)) ** (1.0 / power))
    return depth


def outside(system: SegmentSystem, state: SavedState, half: float) -> float:
    """Largest distance of a corner beyond the walls or below the floor, m; negative if all corners are inside."""
    corners = system.shape(state.time, state.q)
    return float(max((np.abs(corners[..., :2]) - half).max(), (-corners[..., 2]).max()))


def drop(scene: Scene, end: float, rtol: float, interval: float = 1e-3, progress: bool = False) -> Fall:
    """Compute the fall until `end`, s, with a state every `interval`, s."""
    system = compile_scene(scene, True)
    saved: list[SavedState] = []
    deepest = fastest = 0.0
    inertia = system.bodies.inertia[system.bodies.free]

    def look(state: AcceptedStep) -> None:
        nonlocal deepest, fastest
        poses, _ = system.place(state.time, state.q, None)
        for group in system.contacts:
            deepest = max(deepest, -float(group.geometry.find(poses, 0.0).gap.min(initial=0.0)))
        fastest = max(fastest, float((0.5 * inertia * state.u.reshape(inertia.shape) ** 2).sum(axis=1).max()))

    def keep(state: SavedState) -> None:
        saved.append(state)
        if progress:
            kinetic, error = state.observation.energy.kinetic, state.error
            print(f"{1e3 * state.time:.0f} ms, kinetic {1e3 * kinetic:.3g} mJ, error {1e6 * error:.3g} uJ", flush=True)

    times = np.arange(0.0, end + 0.5 * interval, interval)
    begun = time.process_time()
    statistics, energy_balance = simulate(system, Settings("generalized-alpha", rtol, end), times.tolist(), keep, look)
    stored = np.array([state.observation.energy.stored for state in saved])
    rise = float((stored - np.minimum.accumulate(stored)).max())
    return Fall(system, saved, statistics, energy_balance, deepest, fastest, rise, time.process_time() - begun)
