"""Loading of a mesh: forces and motions as functions of time, gravity, mass-proportional damping."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from fsm.kernels.programs import Program


@dataclass(frozen=True, eq=False)
class Forcing:
    """Dead generalised forces: a constant vector (n,) times a function of time."""

    vector: np.ndarray
    time: Program


@dataclass(frozen=True, eq=False)
class SupportMotion:
    """Prescribed motion of coordinates, relative to their initial values.

    Attributes
    ----------
    coordinates : (k,) int array
    displacement : (k,) array
        Displacement, multiplied by the function of time.
    time : Program
        A smooth function; a jump of its slope acts as a shock.
    """

    coordinates: np.ndarray
    displacement: np.ndarray
    time: Program


@dataclass(frozen=True)
class Loading:
    """All loads, motions and damping of a mesh.

    Attributes
    ----------
    gravity : (x, y, z), m/s^2
        Gravity acts on the mass of elements and points, not on the added mass of air.
    mass_damping : 1/s
        Forces -mass_damping M u, where M includes the air. The damping ratio of a mode is mass_damping/(2 omega).
    """

    forcings: tuple[Forcing, ...] = ()
    motions: tuple[SupportMotion, ...] = ()
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mass_damping: float = 0.0
    breaks: tuple[float, ...] = field(init=False)

    def __post_init__(self) -> None:
        functions = [forcing.time for forcing in self.forcings] + [motion.time for motion in self.motions]
        times = {t for function in functions for t in function.breaks()}
        object.__setattr__(self, "breaks", tuple(sorted(times)))

    @property
    def fastest(self) -> float:
        """Largest speed of a moved coordinate at the ends and in the middle of the pieces of its function of time, m/s."""
        fastest = 0.0
        for motion in self.motions:
            ends = motion.time.breaks()
            times = (*ends, *(0.5 * (begin + end) for begin, end in pairwise(ends)))
            slopes = [abs(motion.time.at(near)[1]) for t in times for near in (t, math.nextafter(t, math.inf))]
            fastest = max(fastest, max(slopes, default=0.0) * float(np.abs(motion.displacement).max(initial=0.0)))
        return fastest


def point_force(count: int, position: int, force: np.ndarray) -> np.ndarray:
    """Vector (count,) of a force (3,), N, at the position with this first coordinate."""
    vector = np.zeros(count)
    vector[position : position + 3] = force
    return vector
