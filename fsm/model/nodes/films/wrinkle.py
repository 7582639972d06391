"""Closed form of wrinkles: sheared strip, and film pulled at its corners (Sun et al. 2024, eqs. 28 to 32).

A thin film under tension sigma over a length L wrinkles with the half-wavelength of least energy of bending and tension,

    lambda^4 = pi^2 D L^2/(sigma t),   D = E t^3/(12 (1 - nu^2)),

and an amplitude that absorbs the excess width: the strain e across gives A = 2 lambda sqrt(e)/pi.

Corner: a wedge with a half-angle of 45 degrees under a force T at its tip (Michell) has sigma_r = 4 T cos(theta)/((pi
+ 2) rho t). With the displacement u = int_rho^R sigma_r/E towards the tip,

    e = u/rho - nu sigma_r/E = sigma_r/E (ln(R/rho) - nu),

which ends at R_w = R exp(-nu), the wrinkled radius. (In the paper, the radicand of A is negative, because its integral
starts at R.) The paper also has terms for patches on the diagonal. These terms contain lengths (R_c, alpha, d) that the
paper does not define, so they are omitted here.

References
----------
Wong, Pellegrino, J. Mech. Mater. Struct. 1 (2006) 27-61 (sheared strip).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fsm.model.nodes.films.film import FilmMaterial

_ENVELOPE = 3.0
"""Wrinkles fade as exp(-(3 s/w)^2), where s is the distance from the diagonal and w the half-width of the wedge
there."""


@dataclass(frozen=True)
class StripWrinkles:
    """Half-wavelength (across the wrinkles) and amplitude, m."""

    half_wavelength: float
    amplitude: float


def strip_wrinkles(height: float, thickness: float, poisson: float, shear_angle: float) -> StripWrinkles:
    """Wrinkles of a strip sheared by moving one long edge along itself.

    lambda = sqrt(pi H t)/(3 (1 - nu^2) gamma)^(1/4),  A = sqrt(2 H t/pi) ((1 - nu) gamma/(3 (1 + nu)))^(1/4)

    Parameters
    ----------
    height, thickness : m
    poisson, shear_angle : -
        Poisson's ratio, and the shear angle gamma: shear displacement over the height.
    """
    length = math.sqrt(math.pi * height * thickness) / (3.0 * (1.0 - poisson**2) * shear_angle) ** 0.25
    part = (1.0 - poisson) * shear_angle / (3.0 * (1.0 + poisson))
    return StripWrinkles(length, math.sqrt(2.0 * height * thickness / math.pi) * part**0.25)


@dataclass(frozen=True)
class CornerWrinkles:
    """Wrinkles of a square film pulled at its corners along the diagonals.

    Attributes
    ----------
    side : m
        Side of the film; its corner is at (0, 0) and its centre at (side/2, side/2).
    radius : m
        Wrinkled radius R_w, at which the wrinkles end.
    half_wavelength : m
        Half-wavelength at half the wrinkled radius.
    amplitude : m
        There.
    """

    side: float
    radius: float
    half_wavelength: float
    amplitude: float

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Height at points of the film as the sum of the wrinkles at all four corners, m. Complex x and y give
        slopes.
        """
        total = np.zeros(np.broadcast(x, y).shape, dtype=np.result_type(x, y))
        for across in (x, self.side - x):
            for along in (y, self.side - y):
                total = total + self._corner(across, along)
        return total

    def _corner(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        out = (x + y) / math.sqrt(2.0) + 1e-9 * self.side
        side = (y - x) / math.sqrt(2.0)
        distance = np.sqrt(out**2 + side**2)
        waves = np.cos(math.pi * np.arctan(side / out) * 0.5 * self.radius / self.half_wavelength)
        shape = np.sin(math.pi * distance / self.radius) * waves * np.exp(-((_ENVELOPE * side / out) ** 2))
        return np.where(np.real(distance) < self.radius, self.amplitude * shape, 0.0)


def corner_wrinkles(material: FilmMaterial, side: float, tension: float) -> CornerWrinkles:
    """Wrinkles of a square film under a force T (N) at every corner; see the module docstring.

    R is half the diagonal: two opposite corners meet at the centre.
    """
    nu, t = material.poisson, material.thickness
    wedge = side / math.sqrt(2.0)
    radius = wedge * math.exp(-nu)
    middle = 0.5 * radius
    stress = 4.0 * tension / ((math.pi + 2.0) * middle * t)
    length = (material.bending * math.pi**2 * radius**2 / (stress * t)) ** 0.25
    excess = stress / material.young * (math.log(wedge / middle) - nu)
    return CornerWrinkles(side, radius, length, 2.0 * length * math.sqrt(excess) / math.pi)


def lifted(
    coordinates: np.ndarray, position: np.ndarray, height: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    """Coordinates (n,) with the height and its slopes added at the nodes of a film.

    Parameters
    ----------
    coordinates : (n,) array
        Coordinates of a flat film.
    position : (...,) int array
        First coordinates of its nodes.
    height : function of x and y, m
        It must be analytic, because its slopes are computed by a complex step, exact to round-off.
    """
    q = coordinates.copy()
    first = np.asarray(position).ravel()
    x, y = coordinates[first], coordinates[first + 1]
    step = 1e-30
    q[first + 2] += np.real(height(x, y))
    q[first + 5] += np.imag(height(x + 1j * step, y + 0j)) / step
    q[first + 8] += np.imag(height(x + 0j, y + 1j * step)) / step
    return q
