"""Cables along the edges of a film compared with a Ritz solution: strings with bending stiffness, in tension and slack."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.linalg import eigh

from fsm.analyses.choose import analysis_of
from fsm.analyses.vibrate import VibrationAnalysis
from fsm.case.loading.load_case import load_case

LENGTH, WIDTH, THICKNESS, YOUNG, DENSITY = 0.3, 0.2, 50e-6, 3e9, 1400.0
DIAMETER, STIFF, HEAVY = 1e-3, 7e10, 2000.0
CASE = f"""
analysis = "vibrate"
[membrane]
length = {LENGTH}
width = {WIDTH}
thickness = {THICKNESS}
mesh = [12, 8]
[material]
young = {YOUNG}
poisson = 0
density = {DENSITY}
[[cable]]
place = "edges"
diameter = {DIAMETER}
young = {STIFF}
density = {HEAVY}
[tension]
strain = STRAIN
film = "FILM"
[[support]]
at = "left"
[[support]]
at = "right"
[[support]]
at = "top"
[[support]]
at = "bottom"
fixed = "xy"
[vibration]
modes = 4
"""


def ritz(strain: tuple[float, float]) -> np.ndarray:
    """The lowest four frequencies, Hz: sines along the length, polynomials that vanish at the top across it.

    1/2 int N_x w_x^2 + N_y w_y^2 + D (w_xx^2 + w_yy^2 + 2 w_xy^2) dA + 1/2 int T w'^2 + EI w''^2 dx along the free edge.
    """
    force = [YOUNG * THICKNESS * (e + 0.5 * e**2) for e in strain]
    bending, areal = YOUNG * THICKNESS**3 / 12.0, DENSITY * THICKNESS
    area, second = math.pi * DIAMETER**2 / 4.0, math.pi * DIAMETER**4 / 64.0
    tension = STIFF * area * (strain[0] + 0.5 * strain[0] ** 2)
    shapes = [Polynomial([1.0, -1.0]) * Polynomial.basis(k)(Polynomial([-1.0, 2.0])) for k in range(9)]

    def products(derivative: int) -> np.ndarray:
        parts = [shape.deriv(derivative) if derivative else shape for shape in shapes]
        whole = [[(a * b).integ() for b in parts] for a in parts]
        return np.array([[line(1.0) - line(0.0) for line in row] for row in whole]) * WIDTH ** (1 - 2 * derivative)

    edge = np.array([shape(0.0) for shape in shapes])
    flat, sloped, bent = (products(derivative) for derivative in range(3))
    found: list[float] = []
    for waves in range(1, 5):
        k2 = (math.pi * waves / LENGTH) ** 2
        stiffness = (force[0] * k2 + bending * k2**2) * flat + (force[1] + 2.0 * bending * k2) * sloped + bending * bent
        stiffness = stiffness + (tension * k2 + STIFF * second * k2**2) * np.outer(edge, edge)
        mass = areal * flat + HEAVY * area * np.outer(edge, edge)
        found += list(np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2.0 * math.pi))
    return np.sort(found)[:4]


@pytest.mark.parametrize("film", ["plain", "tension-field"])
@pytest.mark.parametrize("strain", [(1e-3, 1e-3), (0.0, 1e-3)])
def test_edge_cables_vibrate_as_ritz_says(tmp_path: Path, strain: tuple[float, float], film: str) -> None:
    """The cables are in tension, or slack; slack cables have only their bending stiffness."""
    case = tmp_path / "case.toml"
    case.write_text(CASE.replace("STRAIN", str(list(strain))).replace("FILM", film), encoding="utf-8")
    analysis = analysis_of(load_case(case).case, str(case), [])
    assert isinstance(analysis, VibrationAnalysis)
    analysis.initialise([])
    np.testing.assert_allclose(analysis.modes.frequencies, ritz(strain), rtol=2e-3)
