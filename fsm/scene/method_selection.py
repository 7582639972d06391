"""Which method `auto` takes, and why: equilibria for slow drives, dynamics for all else.

Measured (validation/benchmarks): on the pulled strip the quasi-static curve is that of the dynamics to 0.01 % of the peak
at a pace of 1e-6, and takes a fifth of the time; at 1e-4 the dynamics shows spikes at first touch of twice the peak.
"""

from __future__ import annotations

import numpy as np

from fsm.scene.loads import Constant
from fsm.scene.materials import LinearCrease, SplineCrease
from fsm.scene.scene import ForceElement, Scene

__all__ = ["SLOW", "automatic_method", "pace"]

SLOW = 1e-5
"""Pace up to which inertia is dropped."""


def automatic_method(scene: Scene, comes_to_rest: bool = False) -> tuple[str, str]:
    """Method for `method = "auto"`.

    Parameters
    ----------
    scene : Scene
    comes_to_rest : bool
        What comes after begins at rest, so that inertia on the way there does not matter.

    Returns
    -------
    method, reason : str
    """
    dynamics = "generalized-alpha"
    if not scene.drives:
        return dynamics, "nothing is driven: the motion is free"
    if any(any(body.velocity) or any(body.angular_velocity) for body in scene.bodies):
        return dynamics, "bodies move at the start"
    if not all(isinstance(load.time, Constant) for load in scene.loads):
        return dynamics, "loads change with time"
    if comes_to_rest:
        return "static", "the strip comes to rest before it vibrates: inertia on the way there does not matter"
    number = pace(scene)
    if number > SLOW:
        return dynamics, f"the drive is fast: kinetic over elastic energy is {number:.1g}, above {SLOW:g}"
    return "static", f"the drive is slow: kinetic over elastic energy is {number:.1g}, below {SLOW:g}"


def pace(scene: Scene) -> float:
    """Kinetic energy of all free bodies at the drive's speed over the energy of the softest hinge turned by a radian.

    Infinite where no hinge has stiffness.
    """
    speed = max((drive.speed for drive in scene.drives), default=0.0)
    mass = sum(body.mass for body in scene.bodies if not body.held)
    hinges = [k for element in scene.elements if (k := _hinge_stiffness(element)) > 0.0]
    return mass * speed * speed / min(hinges) if hinges else float("inf")


def _hinge_stiffness(element: ForceElement) -> float:
    """Stiffness about the crease axis, N m/rad; of a tabulated crease the slope between the ends of its curve."""
    crease = element.crease
    if crease is None:
        return element.rotation[1]
    if isinstance(crease, LinearCrease):
        return crease.stiffness
    if not isinstance(crease, SplineCrease) or crease.angle is None or crease.moment is None:
        return 0.0
    return crease.scale * abs(float(np.ptp(crease.moment) / np.ptp(crease.angle)))
