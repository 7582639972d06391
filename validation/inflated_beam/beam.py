"""Inflated cantilever of fabric with a force at its tip: fits of Breukels to his tests, runs of the case, closed forms."""

from __future__ import annotations

import csv
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import fsm
from validation.gas.beam import moments

LENGTH = 1.0
POISSON = 0.3
THICKNESS = 2e-4
"""Thickness of the fabric in the case, m; only the product with Young's modulus matters."""
CASE = Path(__file__).parents[2] / "folding_cases" / "inflated_beam" / "case.toml"
BAR = 1e5


@dataclass(frozen=True)
class Fit:
    """Fit of Breukels to the tip force (N) over the deflection (m) of beams of 1 m; radius in m, pressure in bar."""

    radius: float
    pressure: float

    @property
    def limit(self) -> float:
        """Force at a large deflection, N."""
        r, p = self.radius, self.pressure
        return (6582.82 * r - 272.43) * p**2 + 40852.38 * r**3 + 14.31

    @property
    def slope(self) -> float:
        """Initial slope, N/m."""
        r, p = self.radius, self.pressure
        return (271865251.42 * r**5 + 215.93) * p + 14021.79 * r - 589.05

    @property
    def collapse(self) -> float:
        """Deflection of collapse, m."""
        r, p = self.radius, self.pressure
        return (322.55 * r**4 + 0.0239) * p + 5.3833 * r**2 + 0.0461

    def force(self, deflection: np.ndarray | float) -> np.ndarray:
        """Tip force, N."""
        return np.asarray(self.limit * -np.expm1(-self.slope * np.asarray(deflection) / self.limit))


def collapse_force(radius: float, pressure: float) -> float:
    """pi p r^3/L (N), the force at which the moment at the root reaches pi p r^3 (Comer and Levy 1963); pressure in bar."""
    return np.pi * BAR * pressure * radius**3 / LENGTH


def slender(stiffness: float, radius: float, pressure: float, share: np.ndarray) -> np.ndarray:
    """Deflections (m) at tip forces that are shares of `collapse_force`: wrinkled Bernoulli beam, small rotations.

    The curvature is that of Comer and Levy (1963) for the moment F (L - y) and the stiffness E t (N/m). A force along the
    beam and the shear of the wall are neglected.
    """
    size = BAR * pressure / (2.0 * stiffness)  # curvature at which wrinkles begin
    curvature = np.concatenate([np.linspace(0.0, 1.0, 50), np.geomspace(1.001, 300.0, 2000)])
    moment = moments(curvature) / np.pi
    arm = np.linspace(0.0, 1.0, 2001)
    bent = np.array([size * np.interp(one * arm, moment, curvature) for one in share])
    return np.asarray(np.trapezoid(bent * arm, arm * LENGTH, axis=1) * LENGTH)


def timoshenko(stiffness: float, shear: float, radius: float, pressure: float) -> float:
    """Initial slope (N/m) of Le van and Wielgosz (2005): L^3/(3 (E I + P I/S)) + L/(P + G S/2), P = p pi r^2, S = 2 pi r t.

    E t (N/m) and G t (N/m) are those of the fabric; the shear coefficient of a thin tube is 1/2.
    """
    push, around = BAR * pressure * np.pi * radius**2, 2.0 * np.pi * radius
    second = 0.5 * radius**2
    bending = (stiffness * around + push) * second
    return float(1.0 / (LENGTH**3 / (3.0 * bending) + LENGTH / (push + 0.5 * shear * around)))


@dataclass(frozen=True)
class Run:
    """Result of a run: deflection (m) and force (N) of the whole tube, and a text on its cost."""

    deflection: np.ndarray
    force: np.ndarray
    text: str

    def at(self, deflection: float) -> float:
        """Force at a deflection, N."""
        return float(np.interp(deflection, self.deflection, self.force))

    @property
    def slope(self) -> float:
        """Initial slope, N/m: mean over the first two saved points."""
        return float(self.force[1] / self.deflection[1])


def run(
    folder: Path, fit: Fit, stiffness: float, *, cells: tuple[int, int] = (12, 16), most: float = 1.1, steps: int = 20
) -> Run:
    """Run of `folding_cases/inflated_beam` with the radius and pressure of a fit.

    Parameters
    ----------
    folder : of the run
    fit : Fit
    stiffness : E t, N/m
    cells : around half of the section and along the beam
    most : largest deflection over that of the measured collapse
    steps : number of saved points over the deflection
    """
    begun = time.process_time()
    changes = {
        "sheet.length": np.pi * fit.radius, "sheet.radius": fit.radius, "sheet.mesh": list(cells),
        "material.young": stiffness / THICKNESS, "gas.0.supply_pressure": BAR * fit.pressure,
        "drive.0.time.travel": [0.0, 0.0, most * fit.collapse],
        "solve.max_step": 1.0 / steps, "save.interval": 1.0 / steps,
    }  # fmt: skip
    result = fsm.load(CASE).set(changes).run(folder, figures=False)
    with (folder / "force.csv").open(encoding="utf-8") as file:
        rows = np.array([[float(value) for value in row] for row in list(csv.reader(file))[1:]])
    start = int(np.flatnonzero(rows[:, 0] > 0.0)[0]) - 1
    summary = result.summary
    text = f"{summary['dof']} unknowns, {summary['steps']} steps, {time.process_time() - begun:.0f} s"
    return Run(rows[start:, 0], 2.0 * (rows[start:, 1] - rows[start, 1]), text)
