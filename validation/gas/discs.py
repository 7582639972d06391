"""Inflated discs by shooting: the clamped membrane and the balloon of two discs, elastic, of any deflection.

A point at the radius s of the flat disc moves to the radius r and the height z. With the stretches l1 (along the meridian)
and l2 = r/s and the membrane forces P1 = l1 S1, P2 = l2 S2 over lengths of the flat disc, the equilibrium under a pressure p
is

    s P1 sin(phi) = p r^2/2,    (s P1 cos(phi))' = P2 - p r l1 sin(phi),    r' = l1 cos(phi),    z' = -l1 sin(phi)

S1 and S2 belong to the Green strains e = (l^2 - 1)/2, as in `fsm`: plane stress, or E t e1 without hoop stress where the
plane stress would be compressive. Limits: Hencky (1915) for small slopes, Fichter (1997) for small strains;
Paulsen (1994) without strain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

__all__ = ["HENCKY", "PAULSEN", "Disc"]

HENCKY = 0.65344
"""Height over a (p a/(E t))^(1/3), Poisson's ratio 0.3."""
PAULSEN = (0.762760, 0.456947, 1.218524)
"""Radius and half of the height over a, and volume over a^3, of a balloon that does not stretch."""
_FIRST = 1e-6
"""Radius from which the integration begins, over the radius of the disc."""


@dataclass(frozen=True)
class Disc:
    """Disc of radius 1 m of a film with E t = 1 N/m.

    Attributes
    ----------
    pressure : p a/(E t)
    poisson : Poisson's ratio
    """

    pressure: float
    poisson: float = 0.3

    def clamped(self) -> tuple[float, float]:
        """Height of the centre, m, and volume, m^3, if the edge is held."""
        grow = (self.pressure / 8.0) ** (2.0 / 3.0)  # of the size of the strain
        start = brentq(lambda e: self._shape(e)[0] - 1.0, 1e-3 * grow, 20.0 * grow, xtol=1e-15, rtol=1e-12)
        return self._shape(start)[2:]

    def balloon(self) -> tuple[float, float, float]:
        """Radius, half of the height, m, and volume, m^3, of two discs that are joined along their edges."""
        high = 1.0  # the edge rises before the equator; the strain decreases to the first disc that reaches it
        while self._shape(high / 1.5)[1] > 0.0:
            high /= 1.5
        start = brentq(lambda e: self._shape(e)[1], high / 1.5, high, xtol=1e-15, rtol=1e-12)
        radius, _, height, volume = self._shape(start)
        return radius, height, 2.0 * volume

    def _stress(self, along: float, around: float) -> tuple[float, float]:
        """S1 and S2 of two stretches, N/m."""
        first, second = 0.5 * (along**2 - 1.0), 0.5 * (around**2 - 1.0)
        across = second + self.poisson * first
        if across > 0.0:
            return (first + self.poisson * second) / (1.0 - self.poisson**2), across / (1.0 - self.poisson**2)
        return max(first, 0.0), 0.0

    def _along(self, force: float, around: float) -> float:
        """Stretch along the meridian under a force P1, N/m, by Newton's method."""
        way = 1.0 + force
        for _ in range(20):
            across = 0.5 * (around**2 - 1.0) + self.poisson * 0.5 * (way**2 - 1.0)
            slope = way**2 / (1.0 - self.poisson**2) if across > 0.0 else way**2
            stress = self._stress(way, around)[0]
            change = (way * stress - force) / (stress + slope)
            way -= change
            if abs(change) < 1e-15:
                break
        return way

    def _shape(self, strain: float) -> tuple[float, float, float, float]:
        """Radius and s P1 cos(phi) at the edge, height of the centre and volume, from the strain at the centre."""
        stretch = 1.0 + strain

        def rates(s: float, y: np.ndarray) -> list[float]:
            r, level, _, _ = y
            rise = 0.5 * self.pressure * r * r
            force = math.hypot(level, rise) / s
            along = self._along(force, r / s)
            sine, cosine = rise / (s * force), level / (s * force)
            hoop = r / s * self._stress(along, r / s)[1]
            return [along * cosine, hoop - self.pressure * r * along * sine, along * sine, math.pi * r * r * along * sine]

        first = [stretch * _FIRST, _FIRST * stretch * self._stress(stretch, stretch)[0], 0.0, 0.0]
        found = solve_ivp(rates, (_FIRST, 1.0), first, rtol=1e-9, atol=1e-12, method="LSODA")
        r, level, height, volume = found.y[:, -1]
        return float(r), float(level), float(height), float(volume)
