"""Impacts of one mass under the laws alone, plates that bounce, and blocks that slide."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fsm.case.models.contact import Contact, Friction
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, Plate, Scene
from fsm.laws.normal import NORMAL_LAWS
from fsm.model.compile.compile import compile_scene
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.time.generalized_alpha import GeneralizedAlpha

__all__ = ["bounces", "delivered", "impact", "kelvin_voigt", "slide"]

G = 9.81


def impact(contact: Contact, mass: float, speed: float) -> tuple[float, float, float]:
    """Coefficient of restitution, duration (s) and greatest depth (m) of one impact, by DOP853."""
    law = NORMAL_LAWS[contact.law]
    params, onset, share = law.params(contact), np.array([speed]), np.ones(1)

    def rate(t: float, state: np.ndarray) -> tuple[float, float]:
        force, _ = law.force(state[:1].copy(), state[1:].copy(), onset, share, params)
        return state[1], -force[0] / mass

    def out(t: float, state: np.ndarray) -> float:
        return float(state[0])

    def turning(t: float, state: np.ndarray) -> float:
        return float(state[1])

    out.terminal, out.direction = True, -1.0  # type: ignore[attr-defined]
    power = contact.exponent + 1.0
    time = (0.5 * power * mass * speed**2 / contact.stiffness) ** (1 / power) / speed
    # small steps are needed: while the force is cut off the motion is free, and a large step would miss the return of the
    # force
    found = solve_ivp(
        rate, (0.0, 1e3 * time), [0.0, speed], method="DOP853", rtol=1e-11, atol=1e-16, events=(out, turning),
        max_step=5e-3 * time,
    )  # fmt: skip
    assert found.status == 1
    return -found.y_events[0][0, 1] / speed, float(found.t_events[0][0]), float(found.y_events[1][0, 0])


def delivered(h: float) -> float:
    """e of h (1 + e) = ln[(1 + h)/(1 - h e)]."""
    most = min(1.0, 1.0 / h) * (1 - 1e-13)
    return float(brentq(lambda e: h * (1 + e) - math.log((1 + h) / (1 - h * e)), 1e-9, most, xtol=1e-14))


def kelvin_voigt(z: float) -> tuple[float, float]:
    """Restitution of a spring and damper with the damping ratio z, with separation where the force is zero, and where the
    depth is zero."""
    wd = math.sqrt(1 - z * z)
    return math.exp(-z / wd * (math.pi - math.atan2(2 * z * wd, 1 - 2 * z * z))), math.exp(-math.pi * z / wd)


def bounces(e: float, count: int, height: float = 10.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (s), heights (m), speeds (m/s) of a plate that falls flat, at every step until its last separation."""
    size, thick, mass = 0.02, 1e-4, 4e-5
    body = Body(
        name="plate", mass=mass, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, height + thick / 2),
        plate=Plate(length=size, width=size, thickness=thick),
    )  # fmt: skip
    scene = Scene(
        bodies=(body,), obstacles=(Obstacle(name="floor", shape="plane"),), gravity=(0.0, 0.0, -G),
        pairs=(ContactPair(first="plate", second="floor"),),
        contact=Contact(stiffness=1e12, restitution=e, speed_floor=1e-6),
    )  # fmt: skip
    system = compile_scene(scene, False)
    q, u = system.initial()
    system.commit(0.0, q, u)
    solver = GeneralizedAlpha(system, 0.0, q, u, 1e-4)
    times, heights, speeds, left, touched = [0.0], [height], [0.0], 0, False
    while left < count:
        solver.step(30.0)
        above = solver.q[1] - thick / 2
        touching = above < 0.0
        left += touched and not touching
        touched = touching
        times.append(solver.t)
        heights.append(above)
        speeds.append(solver.u[1])
    return np.array(times), np.array(heights), np.array(speeds)


def slide(
    friction: Friction, speed: float, mu: float, slope: float = 0.0, end: float | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, displacement and speed of a block that slides on a plane until `end` (s), or 1.5 times the stopping time v/(mu
    g)."""
    length, thick = 0.02, 1e-3
    mass = length * length * thick * 8000
    angle, stiffness = math.atan(slope), 1e7
    depth = (mass * G * math.cos(angle) / stiffness) ** (2 / 3)
    block = Body(
        name="block", mass=mass, inertia=(mass * length**2 / 12, mass * length**2 / 12, mass * length**2 / 6),
        position=(0.0, 0.0, thick / 2 - depth), velocity=(speed, 0.0, 0.0),
        plate=Plate(length=length, width=length, thickness=thick),
    )  # fmt: skip
    scene = Scene(
        bodies=(block,), obstacles=(Obstacle(name="floor", shape="plane"),),
        pairs=(ContactPair(first="block", second="floor"),), contact=Contact(stiffness=stiffness, damping=5.0),
        friction=friction, gravity=(G * math.sin(angle), 0.0, -G * math.cos(angle)),
    )  # fmt: skip
    end = 1.5 * speed / (mu * G) if end is None else end
    times = np.linspace(0.0, end, 121)
    seen: list[SavedState] = []
    simulate(compile_scene(scene, False), Settings("generalized-alpha", 1e-5, end), list(times), seen.append)
    return times, np.array([s.q[0] for s in seen]), np.array([s.u[0] for s in seen])
