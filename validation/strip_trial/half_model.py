"""The trial strip as two elastic curves with rigid contact: an independent solution without code of `fsm`.

    python -m validation.strip_trial.half_model [--angle 80] [--travel 32]

The strip is symmetric about the plane through crease 3, so only panels 2 and 3 are modelled: inextensible elastic curves, EI
theta'' = Fx sin(theta) - Fz cos(theta), integrated from crease 1 to crease 3. Contacts are rigid:

* the bottom, crease 2, touches the mirror plane, which is crease 4 (force `mirror`);
* one point of panel 2 touches the held panel 1, to which it is tangent (force `wall`, at the arc length `at`).

The unknowns are the angle and the force at crease 1, and the forces of the closed contacts; the conditions are the position
and the moment at crease 3, and the closed contacts. All unknowns are found together by shooting, along the travel.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

__all__ = ["HalfModel", "Path"]

YOUNG, WIDTH, THICKNESS, PANEL = 3e9, 0.04, 3e-4, 0.08
BENDING = YOUNG * WIDTH * THICKNESS**3 / 12
CREASE = BENDING / 0.03
STEPS = 100


class Shot(NamedTuple):
    """Residuals of the conditions, pull force (N), and position of the bottom crease along the strip, over a."""

    left: np.ndarray
    pull: np.ndarray
    bottom: np.ndarray


class NoSolution(RuntimeError):
    """No solution was found from an initial guess."""


_Point = tuple[float, np.ndarray]
"""Travel (m) and unknowns."""


@dataclass(frozen=True)
class Path:
    """Travel (m), force (N); travels at which the bottoms, and then panels 1 and 2, touch, m; travel and force of the
    peak."""

    travel: np.ndarray
    force: np.ndarray
    bottoms_touch: float
    panels_touch: float
    peak: tuple[float, float]

    def force_at(self, travel: np.ndarray | float) -> np.ndarray:
        """Force interpolated linearly between the points, N."""
        return np.asarray(np.interp(travel, self.travel, self.force))


class HalfModel:
    """Panels 2 and 3 of the trial strip at a fold angle (degrees).

    Lengths are relative to the length of a panel, forces to EI/a^2, moments to EI/a.
    """

    def __init__(self, angle: float) -> None:
        self.fold = math.radians(angle)
        self.crease = CREASE * PANEL / BENDING
        self.plane = 2.0 * math.cos(self.fold)  # position of the mirror plane, from crease 1

    def _panel(self, y: np.ndarray, force: np.ndarray, length: np.ndarray | float) -> np.ndarray:
        """Ends (x, z, theta, moment) of curves, one for each column, by the fourth-order Runge-Kutta method."""
        fx, fz = force
        step = length / STEPS

        def slope(y: np.ndarray) -> np.ndarray:
            cosine, sine = np.cos(y[2]), np.sin(y[2])
            return np.array([cosine, sine, y[3], fx * sine - fz * cosine])

        for _ in range(STEPS):
            k1 = slope(y)
            k2 = slope(y + 0.5 * step * k1)
            k3 = slope(y + 0.5 * step * k2)
            y = y + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + slope(y + step * k3))
        return y

    def shoot(self, x: np.ndarray, travel: float) -> Shot:
        """Quantities that follow from the unknowns (theta, fx, fz[, mirror[, wall, at]]) at crease 1, with one set for each
        column.

        (fx, fz) is the force that the part after crease 1 exerts on the part before it.
        """
        theta, force = x[0], x[1:3]
        # the direction is away from panel 1, whose line starts at zero
        normal = np.array([[math.sin(self.fold)], [-math.cos(self.fold)]])
        nothing = np.zeros_like(theta)
        y = np.array([nothing, nothing, theta, self.crease * (theta + self.fold)])
        left, rest = [], 1.0
        if len(x) > 4:
            wall, at = x[4:]
            y = self._panel(y, force, at)
            left += [np.sum(normal * y[:2], axis=0), np.sin(y[2] - (self.fold - math.pi))]
            force, rest = force - wall * normal, 1.0 - at
        y = self._panel(y, force, rest)
        bottom = y[0]
        if len(x) > 3:
            left.append(bottom - self.plane)
            force = force + np.array([x[3], nothing])
        # moment of the crease: M = k (rotation of panel 3 minus rotation of panel 2)
        turned = self.fold + (y[2] + self.fold) + y[3] / self.crease
        y = self._panel(np.array([y[0], y[1], turned, y[3]]), force, 1.0)
        left += [y[0] - self.plane, y[1] - travel / PANEL, y[3] + 2.0 * self.crease * (y[2] - self.fold)]
        return Shot(np.array(left), 2.0 * BENDING / PANEL**2 * force[1], bottom)

    def solve(self, guess: np.ndarray, travel: float) -> np.ndarray:
        """The unknowns at a travel (m), by Newton's method with derivatives by complex steps."""
        x = guess
        for _ in range(12):
            shot = self.shoot(x[:, None] + 1e-30j * np.eye(len(x)), travel)
            change = np.linalg.solve(shot.left.imag / 1e-30, -shot.left[:, 0].real)
            x = x + change
            if not np.abs(change).max() < 10.0:
                break
            if np.abs(change).max() < 1e-9 * max(1.0, np.abs(x).max()):
                return x
        raise NoSolution(f"no solution at {1e3 * travel:.3f} mm")

    def pull(self, x: np.ndarray, travel: float) -> float:
        """Force at crease 3 of the whole strip, N."""
        return float(self.shoot(x[:, None], travel).pull[0])

    def height(self, x: np.ndarray) -> tuple[float, float]:
        """Smallest height of panel 2 over panel 1, over a, and its arc length; points beside the crease itself are
        excluded."""
        normal = np.array([math.sin(self.fold), -math.cos(self.fold)])
        start = np.array([0.0, 0.0, x[0], self.crease * (x[0] + self.fold)])

        def over(place: float) -> float:
            return float(normal @ self._panel(start, x[1:3], place)[:2])

        places = np.linspace(0.05, 1.0, 20)
        k = int(np.argmin([over(place) for place in places]))
        if k == 0:
            return over(places[0]), places[0]
        around = places[k - 1], places[min(k + 1, len(places) - 1)]
        best = minimize_scalar(over, bounds=around, method="bounded", options={"xatol": 1e-9})
        return float(best.fun), float(best.x)

    def follow(self, travel: float, step: float) -> Path:
        """Solve from rest to a travel (m), in steps (m)."""
        points: list[_Point] = [(0.0, np.array([-self.fold, 0.0, 0.0]))]
        touched: list[float] = []
        size = step
        while points[-1][0] < travel - 1e-12:
            now = min(points[-1][0] + size, travel)
            try:
                x = self._next(points, now)
            except NoSolution:
                size *= 0.25
                if size < 1e-6 * step:
                    raise
                continue
            size = min(2.0 * size, step)
            if len(touched) < 2 and self._gap(x, now, touched) <= 0.0:
                before = points

                def gap(t: float, before: list[_Point] = before) -> float:
                    return self._gap(self._next(before, t), t, touched)

                now = brentq(gap, points[-1][0] + 1e-9, now, xtol=1e-9)
                x = self._next(points, now)
                x = np.append(x, 0.0) if not touched else np.append(x, [0.0, self.height(x)[1]])
                touched.append(now)
            points.append((now, x))
        return Path(*np.array([(t, self.pull(x, t)) for t, x in points]).T, *touched[:2], self._peak(points))

    def _next(self, points: list[_Point], travel: float) -> np.ndarray:
        """Solution at a travel, predicted from the last two solutions with the same number of unknowns."""
        (t1, x1), x0 = points[-1], None
        if len(points) > 1 and len(points[-2][1]) == len(x1):
            t0, x0 = points[-2]
        guess = x1 if x0 is None else x1 + (travel - t1) / (t1 - t0) * (x1 - x0)
        return self.solve(guess, travel)

    def _gap(self, x: np.ndarray, travel: float, touched: list[float]) -> float:
        """Gap of the next contact, over a: first between the bottoms, then between panels 1 and 2."""
        if touched:
            return self.height(x)[0]
        return self.plane - float(self.shoot(x[:, None], travel).bottom[0])

    def _peak(self, points: list[_Point]) -> tuple[float, float]:
        """Travel (m) and force (N) of the largest force."""
        forces = [self.pull(x, t) for t, x in points]
        k = min(max(int(np.argmax(forces)), 2), len(points) - 2)
        beside = points[k - 2 : k]
        best = minimize_scalar(
            lambda t: -self.pull(self._next(beside, t), t), bounds=(points[k - 1][0] + 1e-9, points[k + 1][0]),
            method="bounded", options={"xatol": 1e-8},
        )  # fmt: skip
        return float(best.x), -float(best.fun)


def main() -> None:
    """Print the path."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--angle", type=float, default=80.0, help="fold angle, degrees")
    parser.add_argument("--travel", type=float, default=32.0, help="mm")
    parser.add_argument("--step", type=float, default=0.25, help="mm")
    options = parser.parse_args()
    path = HalfModel(options.angle).follow(1e-3 * options.travel, 1e-3 * options.step)
    print(f"bottoms touch at {1e3 * path.bottoms_touch:.4f} mm, {path.force_at(path.bottoms_touch):.5f} N")
    print(f"panels 1 and 2 touch at {1e3 * path.panels_touch:.4f} mm, {path.force_at(path.panels_touch):.5f} N")
    print(f"force at 4 mm: {path.force_at(4e-3):.6f} N")
    print(f"peak {path.peak[1]:.5f} N at {1e3 * path.peak[0]:.3f} mm")


if __name__ == "__main__":
    main()
