"""Free plates that collide and a plate that slides, in the plane, compared with rigid bodies of pymunk and closed forms.

A plate seen from the side is a line with rounded ends, in both programs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pymunk

from fsm.case.models.contact import Contact, Friction
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, Plate, Scene
from fsm.model.compile.compile import compile_scene
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

__all__ = ["Case", "collision", "corner", "slide"]

LENGTH, WIDTH, THICKNESS, GRAVITY = 0.1, 0.05, 4e-3, 9.81
PYMUNK_STEP = 1e-5


@dataclass(frozen=True)
class Case:
    """Results of fsm, of pymunk and of the closed form; each is a row of the same quantities."""

    fsm: np.ndarray
    pymunk: np.ndarray
    exact: np.ndarray


def _inertia(mass: float) -> float:
    return mass * (LENGTH**2 + THICKNESS**2) / 12


def _body(name: str, mass: float, at: tuple[float, float], angle: float, speed: tuple[float, float]) -> Body:
    turn = _inertia(mass)
    return Body(
        name=name, mass=mass, inertia=(turn, turn, turn), plate=Plate(length=LENGTH, width=WIDTH, thickness=THICKNESS),
        position=(at[0], 0.0, at[1]), velocity=(speed[0], 0.0, speed[1]),
        orientation=(math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0),
    )  # fmt: skip


def _solved(scene: Scene, end: float, rtol: float) -> SavedState:
    saved: list[SavedState] = []
    simulate(compile_scene(scene), Settings("generalized-alpha", rtol, end), [end], saved.append)
    return saved[-1]


def _space(gravity: float) -> pymunk.Space:
    space = pymunk.Space()
    space.gravity = (0.0, -gravity)
    space.iterations = 50
    space.collision_slop = 1e-6
    return space


def _rod(space: pymunk.Space, body: Body, restitution: float, friction: float = 0.0) -> pymunk.Body:
    rod = pymunk.Body(body.mass, body.inertia[1])
    rod.position = (body.position[0], body.position[2])
    rod.velocity = (body.velocity[0], body.velocity[2])
    rod.angle = -2.0 * math.atan2(body.orientation[2], body.orientation[0])
    shape = pymunk.Segment(rod, (-LENGTH / 2, 0.0), (LENGTH / 2, 0.0), THICKNESS / 2)
    # pymunk uses the product of the values of both bodies
    shape.elasticity, shape.friction = math.sqrt(restitution), math.sqrt(friction)
    space.add(rod, shape)
    return rod


def _floor(space: pymunk.Space, restitution: float, friction: float = 0.0) -> None:
    shape = pymunk.Segment(space.static_body, (-10.0, -0.1), (10.0, -0.1), 0.1)
    shape.elasticity, shape.friction = math.sqrt(restitution), math.sqrt(friction)
    space.add(shape)


def _run(space: pymunk.Space, end: float) -> None:
    for _ in range(round(end / PYMUNK_STEP)):
        space.step(PYMUNK_STEP)


def collision(restitution: float, heavy: float = 3.0, rtol: float = 1e-6) -> Case:
    """Two plates collide face to face at 0.2 m/s; momentum (N s), energy (J) and both speeds (m/s) after the impact."""
    masses = (0.02, 0.02 * heavy)
    bodies = (
        _body("moving", masses[0], (0.0, 0.01), 0.0, (0.0, -0.2)),
        _body("resting", masses[1], (0.0, 0.0), 0.0, (0.0, 0.0)),
    )
    scene = Scene(
        bodies=bodies, pairs=(ContactPair(first="moving", second="resting"),),
        contact=Contact(stiffness=1e7, restitution=restitution),
    )  # fmt: skip
    end = _solved(scene, 0.1, rtol)
    space = _space(0.0)
    rods = [_rod(space, body, restitution) for body in bodies]
    _run(space, 0.1)
    common = -0.2 * masses[0] / sum(masses)
    exact = (common + 0.2 * restitution * masses[1] / sum(masses), common - 0.2 * restitution * masses[0] / sum(masses))

    def row(speeds: tuple[float, float]) -> np.ndarray:
        momentum = sum(m * v for m, v in zip(masses, speeds, strict=True))
        energy = sum(0.5 * m * v * v for m, v in zip(masses, speeds, strict=True))
        return np.array([momentum, energy, *speeds])

    return Case(row((end.u[1], end.u[4])), row((rods[0].velocity.y, rods[1].velocity.y)), row(exact))


def corner(restitution: float, angle: float = math.radians(30.0), rtol: float = 1e-6) -> Case:
    """A tilted plate hits a floor with one end at 0.2 m/s, without gravity and friction: speed (m/s), angular speed (rad/s),
    energy (J)."""
    mass, height = 0.02, LENGTH / 2 * math.sin(angle) + THICKNESS / 2 + 0.005
    body = _body("plate", mass, (0.0, height), angle, (0.0, -0.2))
    scene = Scene(
        bodies=(body,), obstacles=(Obstacle(name="floor", shape="plane"),),
        pairs=(ContactPair(first="plate", second="floor"),), contact=Contact(stiffness=1e7, restitution=restitution),
    )  # fmt: skip
    end = _solved(scene, 0.06, rtol)
    space = _space(0.0)
    rod = _rod(space, body, restitution)
    _floor(space, restitution)
    _run(space, 0.06)
    turn, arm = body.inertia[1], LENGTH / 2 * math.cos(angle)
    impulse = (1.0 + restitution) * 0.2 / (1.0 / mass + arm**2 / turn)

    def row(speed: float, spin: float) -> np.ndarray:
        return np.array([speed, spin, 0.5 * mass * speed**2 + 0.5 * turn * spin**2])

    # for a positive rotation the right end is the lower one; the impact pushes it up, which rotates the plate back
    return Case(
        row(end.u[1], end.u[2]), row(rod.velocity.y, -rod.angular_velocity), row(impulse / mass - 0.2, -impulse * arm / turn)
    )


def slide(friction: float = 0.3, speed: float = 0.3, rtol: float = 1e-5) -> Case:
    """A plate slides on a floor until it rests: displacement (m), loss of height (m), energy dissipated by friction (J)."""
    mass, stiffness = 0.02, 1e7
    rest = (mass * GRAVITY / stiffness) ** (1 / 1.5)
    body = _body("plate", mass, (0.0, THICKNESS / 2 - rest), 0.0, (speed, 0.0))
    scene = Scene(
        bodies=(body,), obstacles=(Obstacle(name="floor", shape="plane"),),
        pairs=(ContactPair(first="plate", second="floor"),), contact=Contact(stiffness=stiffness, damping=5.0),
        friction=Friction(law="tanh", mu_dynamic=friction, v_static=1e-4), gravity=(0.0, 0.0, -GRAVITY),
    )  # fmt: skip
    end = _solved(scene, 1.3 * speed / (friction * GRAVITY), rtol)
    space = _space(GRAVITY)
    rod = _rod(space, body, 0.0, friction)
    _floor(space, 0.0, friction)
    _run(space, 1.3 * speed / (friction * GRAVITY))
    way, energy = speed**2 / (2 * friction * GRAVITY), 0.5 * mass * speed**2
    fsm = np.array([end.q[0], body.position[2] - end.q[1], float(end.pair_energy[0].sum())])
    lost = energy - 0.5 * mass * rod.velocity.length**2
    return Case(fsm, np.array([rod.position.x, body.position[2] - rod.position.y, lost]), np.array([way, 0.0, energy]))
