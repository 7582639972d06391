"""Added mass of the air around a vibrating film.

A film of length l in still air has an added mass of 0.68 rho_air l per square metre, for both sides together. The added mass
does not depend on frequency and amplitude, if the film vibrates in its first modes (Minami 1998). Only motion normal to the
film moves air, so the mass matrix is int m S_i S_j dA n n^T with the normal n of the film at rest. Motion in the film's
plane has no added mass. Cables also have no added mass. Many models put the added mass into the whole mass matrix; their
in-plane frequencies are therefore too low. Patches have the same added mass as the film around them.

References
----------
Minami, J. Fluids Struct. 12 (1998) 919-932.
"""

from __future__ import annotations

import numpy as np

from fsm.model.nodes.films.film import film_mass
from fsm.model.nodes.group import MassPart

AIR_DENSITY = 1.204
"""Dry air at 20 degrees Celsius and 101325 Pa, kg/m^3."""
MINAMI = 0.68
"""Height of the moving layer of air relative to the length of the film."""


def air_mass(length: float, density: float = AIR_DENSITY) -> float:
    """Added mass of air per area of a film of this length (m), kg/m^2."""
    return MINAMI * density * length


def added_mass(vectors: np.ndarray, sides: np.ndarray, air: float, normal: np.ndarray) -> MassPart:
    """Mass of `air` (kg/m^2) on membrane elements, for motion along the unit vector `normal` (3,)."""
    return MassPart(vectors, film_mass(sides, np.full(len(sides), air)), np.outer(normal, normal))
