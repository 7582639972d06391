"""Stack of balls that bounces on a fixed ball: one equation for each ball, and the model of fsm.

The balls are on one vertical line and touch by N = K d^(3/2) without damping, so that both programs have the same law.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from fsm.case.models.contact import Contact
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, Scene
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from validation.peers.rigid import GRAVITY

__all__ = [
    "BALLS", "BOUNCE_TIMES", "GROUND_RADIUS", "INERTIA", "MASS", "RADIUS", "STIFFNESS", "bounce_model", "bounce_path",
    "heights",
]  # fmt: skip

BALLS = 4
RADIUS, GROUND_RADIUS = 0.02, 0.5
MASS, INERTIA = 0.2, 3.2e-5
STIFFNESS = 1e6
BOUNCE_TIMES = np.arange(1, 6) * 0.02


def heights() -> np.ndarray:
    """Initial heights of the centres above the top of the fixed ball, m, with gaps of 2 mm."""
    return RADIUS + 0.002 + np.arange(BALLS) * (2.0 * RADIUS + 0.002)


def bounce_path() -> np.ndarray:
    """Height of the highest ball, (times, 1)."""

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        z, v = y[:BALLS], y[BALLS:]
        depth = np.concatenate([[RADIUS - z[0]], 2.0 * RADIUS - np.diff(z)])
        force = STIFFNESS * np.maximum(depth, 0.0) ** 1.5
        return np.concatenate([v, -GRAVITY + (force - np.append(force[1:], 0.0)) / MASS])

    start = np.concatenate([heights(), np.zeros(BALLS)])
    ends = 0.0, float(BOUNCE_TIMES[-1])
    found = solve_ivp(
        rate, ends, start, method="DOP853", rtol=1e-11, atol=1e-13, t_eval=BOUNCE_TIMES, max_step=1e-4
    )
    return found.y[[BALLS - 1]].T


def bounce_model() -> tuple[SegmentSystem, Callable[[np.ndarray], np.ndarray]]:
    """Balls as bodies in space with spheres, each in contact with its neighbours; height of the highest ball."""
    bodies = tuple(
        Body(name=f"{i}", mass=MASS, inertia=(INERTIA,) * 3, position=(0.0, 0.0, float(z)))
        for i, z in enumerate(heights())
    )
    shapes = (
        Obstacle(name="fixed ball", shape="sphere", radius=GROUND_RADIUS, position=(0.0, 0.0, -GROUND_RADIUS)),
        *(Obstacle(name=f"ball {i}", shape="sphere", radius=RADIUS, body=f"{i}") for i in range(BALLS)),
    )
    pairs = tuple(ContactPair(first=a.name, second=b.name) for a, b in pairwise(shapes))
    contact = Contact.model_validate({"stiffness": STIFFNESS, "exponent": 1.5})
    gravity = (0.0, 0.0, -GRAVITY)
    scene = Scene(bodies=bodies, obstacles=shapes, pairs=pairs, contact=contact, gravity=gravity)
    return compile_scene(scene, True), lambda q: q.reshape(BALLS, 7)[-1:, 2]
