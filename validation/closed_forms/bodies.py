"""Single rigid bodies held by stiff springs: heavy top in space, rotational spring pendulum in the plane and in space."""

from __future__ import annotations

import numpy as np

from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.model.compile.compile import compile_scene
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

__all__ = ["exact_pendulum", "heavy_top", "pendulum", "top_scene"]


def top_scene(stiffness: float = 1e9, damping: float = 1e4) -> Scene:
    """The heavy top of Arnold, Bruls and Cardona; its fixed point is a spring with a damper, N/m and N s/m.

    With the given numbers the spring deflects by 0.3 um under its load of 320 N, and its vibration decays within 10 us.
    """
    top = Body(
        name="top",
        mass=15.0,
        inertia=(0.234375, 0.46875, 0.234375),
        position=(0.0, 1.0, 0.0),
        velocity=(4.61538, 0.0, 0.0),
        angular_velocity=(0.0, 150.0, -4.61538),
    )
    fixed = ForceElement(
        name="fixed point",
        inner=GROUND,
        outer="top",
        point_outer=(0.0, -1.0, 0.0),
        translation=(stiffness,) * 3,
        translation_damping=(damping,) * 3,
    )
    return Scene(bodies=(top,), elements=(fixed,), gravity=(0.0, 0.0, -9.81))


def heavy_top(times: list[float], rtol: float = 1e-7) -> list[SavedState]:
    """States of the top at these times, s."""
    system = compile_scene(top_scene())
    saved: list[SavedState] = []
    simulate(system, Settings("Radau", rtol, times[-1]), times, saved.append)
    return saved


def pendulum(spatial: bool, times: list[float]) -> np.ndarray:
    """Height z of the centre, m: 1 kg, at 2 m from a hinge of 200 N m/rad and 10 N m s/rad, released from rest in the
    horizontal position."""
    arm = Body(name="arm", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(2.0, 0.0, 0.0))
    hinge = ForceElement(
        name="hinge",
        inner=GROUND,
        outer="arm",
        point_outer=(-2.0, 0.0, 0.0),
        translation=(1e7,) * 3,
        translation_damping=(1e3,) * 3,
        rotation=(0.0, 200.0, 0.0),
        rotation_damping=(0.0, 10.0, 0.0),
    )
    system = compile_scene(Scene(bodies=(arm,), elements=(hinge,), gravity=(0.0, 0.0, -9.80665)), spatial)
    height: list[float] = []
    settings = Settings("Radau", 1e-8, times[-1])
    simulate(system, settings, times, lambda saved: height.append(saved.q[2 if spatial else 1]))
    return np.array(height)


def exact_pendulum(times: list[float]) -> np.ndarray:
    """The same pendulum with one degree of freedom and a rigid hinge, (m L^2 + I) a'' = m g L cos a - k a - c a'."""
    from scipy.integrate import solve_ivp

    solution = solve_ivp(
        lambda t, y: [y[1], (9.80665 * 2.0 * np.cos(y[0]) - 200.0 * y[0] - 10.0 * y[1]) / 4.1],
        (0.0, times[-1]), [0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13, t_eval=times,
    )  # fmt: skip
    return np.asarray(-2.0 * np.sin(solution.y[0]))
