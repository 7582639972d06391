"""Closed forms of a strip of film on a hub: moment, unrolling against a brake, modes under tension, despin of the hub."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

__all__ = ["Despin", "Strip"]


class Strip(NamedTuple):
    """Strip of film on a hub, in SI units.

    Attributes
    ----------
    length, width, thickness : m
    young, density : Pa, kg/m^3
        Poisson's ratio is zero.
    drum : m
        Radius of the drum.
    """

    length: float
    width: float
    thickness: float
    young: float
    density: float
    drum: float

    @property
    def radius(self) -> float:
        """Radius of the middle surface on the drum, m."""
        return self.drum + 0.5 * self.thickness

    @property
    def line_mass(self) -> float:
        """Mass per length, kg/m."""
        return self.density * self.width * self.thickness

    @property
    def bending(self) -> float:
        """Bending stiffness E I, N m^2."""
        return self.young * self.width * self.thickness**3 / 12.0

    def moment(self, tension: float) -> float:
        """Moment about the hub that wraps the strip under a tension (N), without friction, N m: T R + E I/(2 R)."""
        return tension * self.radius + 0.5 * self.bending / self.radius

    def unrolled(self, time: np.ndarray, moment: float, brake: float, inertia: float, rate: float) -> np.ndarray:
        """Turn (rad) of a hub that starts with `rate` (rad/s) against a constant moment (N m) and a brake (N m s/rad).

        J w' = -M - c w, with the inertia J of the hub and of the whole strip at the radius R.
        """
        whole = inertia + self.line_mass * self.length * self.radius**2
        steady, decay = -moment / brake, brake / whole
        return np.asarray(steady * time + (rate - steady) / decay * (1.0 - np.exp(-decay * time)))

    def frequency(self, tension: float, number: int) -> float:
        """Frequency (Hz) of the strip under a dead load (N) at its free end; the other end is a hinge.

        w = A sin k x + B sinh m x with m^2 = k^2 + T/(E I). The free end carries no moment and no transverse force
        besides that of the tension: tan k L = (m/k)^3 tanh m L.
        """

        def residual(k: float) -> float:
            m = np.sqrt(k * k + tension / self.bending)
            return float(np.sin(k * self.length) - (m / k) ** 3 * np.tanh(m * self.length) * np.cos(k * self.length))

        near = (number - 0.5) * np.pi / self.length
        k = float(brentq(residual, 0.9 * near, 1.1 * near))
        return float(np.sqrt((tension * k * k + self.bending * k**4) / self.line_mass) / (2.0 * np.pi))


class Despin(NamedTuple):
    """Free hub with a strip that unwinds, with a mass at its end (Fedor, 1961); the strip is inextensible and has no
    bending stiffness.

    With the unwound length l, J = I + (m + rho L) R^2 and M = m l^2 + rho l^3/3, the turn theta of the hub and the
    direction psi of the straight part, energy and angular momentum are

        2 T = J theta'^2 + M psi'^2,    H = J theta' + M psi',    l' = R (psi' - theta')

    With T = J w^2/2 and H = J w of a hub that turns with w as a whole: theta' = w (J - M)/(J + M) and l' = R w. Before
    that, a part l0 that is not yet wrapped moves straight on, and is wrapped at theta' = w.
    """

    strip: Strip
    hub: float
    tip: float
    rate: float

    def lengths(self, time: np.ndarray, start: float) -> np.ndarray:
        """Unwound length (m) at times (s) after the release, with `start` (m) at the release."""
        return np.asarray(np.abs(self.strip.radius * self.rate * time - start))

    def turn(self, time: np.ndarray, start: float) -> np.ndarray:
        """Turn (rad) of the hub since the release."""
        fine = np.linspace(0.0, float(time[-1]), 20001)
        length, strip = self.lengths(fine, start), self.strip
        own = self.hub + (self.tip + strip.line_mass * strip.length) * strip.radius**2
        other = self.tip * length**2 + strip.line_mass * length**3 / 3.0
        wound = strip.radius * self.rate * fine < start
        rate = self.rate * np.where(wound, 1.0, (own - other) / (own + other))
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(fine))])
        return np.asarray(np.interp(time, fine, turned))
