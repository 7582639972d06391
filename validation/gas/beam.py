"""Inflated beam: a cylinder of film with lids, bent by its rigid ends.

With the half-angle a of the wrinkled part of the section, and lengths of the undeformed section (Stein and Hedgepeth, 1961;
Comer and Levy, 1963),

    M = pi p r^3 ((pi - a)/2 + sin(2 a)/4)/b,    curvature = pi p/(2 E t b),    b = (pi - a) cos(a) + sin(a)

Wrinkles begin at M = pi p r^3/2, with the curvature p/(2 E t). The moment of collapse, pi p r^3, is the limit for a = pi.
"""

from __future__ import annotations

import csv
import time
from pathlib import Path
from typing import Any

import numpy as np

import fsm

__all__ = ["bent_beam", "moments"]

RADIUS, PRESSURE = 0.1, 1e4


def moments(curvature: np.ndarray | float) -> np.ndarray:
    """M/(p r^3) of curvatures over p/(2 E t)."""
    angle = np.linspace(0.0, np.pi - 0.01, 40000)
    down = (np.pi - angle) * np.cos(angle) + np.sin(angle)
    wrinkled = np.pi * (0.5 * (np.pi - angle) + 0.25 * np.sin(2.0 * angle)) / down
    at = np.asarray(curvature, dtype=float)
    return np.where(at < 1.0, 0.5 * np.pi * at, np.interp(at, np.pi / down, wrinkled))


def bent_beam(
    folder: Path, cells: tuple[int, int], strain: float, rounding: float, most: float
) -> tuple[np.ndarray, np.ndarray, dict[str, Any], str]:
    """Curvature over p/(2 E t) and M/(p r^3) of a run, its summary, and a text on it.

    Parameters
    ----------
    folder : of the run
    cells : around half of the section and along half of the beam
    strain : p r/(E t)
    rounding : `sheet.film_rounding`
    most : largest curvature over p/(2 E t)
    """
    length, thickness = 2.0 * RADIUS, 1e-4
    young = PRESSURE * RADIUS / (thickness * strain)
    turn = most * PRESSURE / (2.0 * young * thickness) * length
    lowest = [[-1e-6, -1e-6, -1e-6], [1e-6, 1e-6, 1e-6]]
    data = {
        "sheet": {
            "kind": "plate", "length": np.pi * RADIUS, "width": length, "radius": RADIUS, "mesh": list(cells),
            "facets": "flexible", "film": "tension-field", "film_rounding": rounding, "thickness": thickness,
            "support": [{"at": "edge left", "mirror": "x"}, {"at": "edge right", "mirror": "x"},
                        {"at": "edge bottom", "mirror": "y"}, {"at": lowest, "fixed": ["z"]}],
        },
        "material": {"young": young, "poisson": 0.3, "density": 1000.0},
        "gas": [{
            "closed_by": [{"axis": "x"}, {"axis": "y"}, {"cap": "edge top"}], "supply_pressure": PRESSURE,
            "time": {"kind": "table", "time": [0.0, 1.0, 2.0], "value": [0.0, 1.0, 1.0]},
        }],
        "drive": [{
            "edge": "top", "axis": [-1.0, 0.0, 0.0], "guide": False,
            "time": {"kind": "table", "time": [0.0, 1.0, 2.0], "turn": [0.0, 0.0, turn]},
        }],
        "solve": {"method": "static", "end_time": 2.0, "rtol": 1e-4, "max_step": 0.02}, "save": {"interval": 0.02},
    }  # fmt: skip
    begun = time.process_time()
    result = fsm.load(data, folder=folder).run(folder / "run", figures=False)
    with (folder / "run" / "force.csv").open(encoding="utf-8") as file:
        rows = np.array([[float(value) for value in row] for row in list(csv.reader(file))[1:]])
    rows = rows[rows[:, 0] > 0.0]
    summary = result.summary
    text = f"{summary['dof']} unknowns, {summary['steps']} steps, {time.process_time() - begun:.0f} s"
    return rows[:, 0] / turn * most, 2.0 * rows[:, 1] / (PRESSURE * RADIUS**3), summary, text
