"""What acts on a mesh from outside: forces and motions as functions of time, gravity, damping by mass."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fsm.ancf.pulse import TimeFunction

__all__ = ["Forcing", "Loading", "Motion", "point_force"]


@dataclass(frozen=True, eq=False)
class Forcing:
    """Generalised forces that do not follow the structure: a vector (n,) times a function of time."""

    vector: np.ndarray
    time: TimeFunction


@dataclass(frozen=True, eq=False)
class Motion:
    """Prescribed motion of coordinates, from where they are at the start.

    Attributes
    ----------
    coordinates : (k,) int array
    displacement : (k,) array
        Times the function of time.
    time : TimeFunction
        Smooth, or its jumps in slope are shocks.
    """

    coordinates: np.ndarray
    displacement: np.ndarray
    time: TimeFunction


@dataclass(frozen=True)
class Loading:
    """All of it.

    Attributes
    ----------
    gravity : (x, y, z), m/s^2
        Acts on the mass of elements and points, not on air.
    mass_damping : 1/s
        Forces -mass_damping M u, M with the air: a mode of damping ratio mass_damping/(2 omega).
    """

    forcings: tuple[Forcing, ...] = ()
    motions: tuple[Motion, ...] = ()
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mass_damping: float = 0.0
    breaks: tuple[float, ...] = field(init=False)

    def __post_init__(self) -> None:
        functions = [forcing.time for forcing in self.forcings] + [motion.time for motion in self.motions]
        times = {t for function in functions for t in function.breaks()}
        object.__setattr__(self, "breaks", tuple(sorted(times)))


def point_force(count: int, position: int, force: np.ndarray) -> np.ndarray:
    """Vector (count,) of a force (3,) in N at the position that begins at this coordinate."""
    vector = np.zeros(count)
    vector[position : position + 3] = force
    return vector
