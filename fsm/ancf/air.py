"""The air that a vibrating film moves with it.

A film of length l in still air carries 0.68 rho_air l of air on every square metre, both sides together, whatever
frequency and amplitude are, as long as it vibrates in its first modes (Minami 1998). Air is pushed by the normal
motion only, so its mass matrix is int m S_i S_j dA n n^T with the normal n of the film at rest; motion within the
film and cables carry none. (Adding it to the whole mass matrix, as is often done, slows in-plane vibrations too.)
Patches push air as the film around them does.

References
----------
Minami, J. Fluids Struct. 12 (1998) 919-932.
"""

from __future__ import annotations

import numpy as np

from fsm.ancf.film import film_mass
from fsm.ancf.group import MassPart

__all__ = ["AIR_DENSITY", "MINAMI", "added_mass", "air_mass"]

AIR_DENSITY = 1.204
"""Dry air at 20 degrees Celsius and 101325 Pa, kg/m^3."""
MINAMI = 0.68
"""Height of the air that moves along, over the length of the film."""


def air_mass(length: float, density: float = AIR_DENSITY) -> float:
    """Mass of air on a square metre of film of this length (m), kg/m^2."""
    return MINAMI * density * length


def added_mass(vectors: np.ndarray, sides: np.ndarray, air: float, normal: np.ndarray) -> MassPart:
    """Mass of `air` (kg/m^2) on membrane elements, moved by what is along the unit `normal` (3,)."""
    return MassPart(vectors, film_mass(sides, np.full(len(sides), air)), np.outer(normal, normal))
