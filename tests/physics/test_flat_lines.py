"""Lines of a pattern that do not fold: the sheet bends there as it does inside a facet."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm

YOUNG = 70e9


def sheet(points: np.ndarray, letter: str = "F", **more: Any) -> dict[str, Any]:
    """Sheet of flexible facets, one for each cell of a grid of points (m, n, 3); all inner edges have one letter."""
    number = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    corners = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)
    faces = corners.reshape(-1, 4).tolist()
    uses: dict[tuple[int, int], int] = {}
    for face in faces:
        for a, b in zip(face, [*face[1:], face[0]], strict=True):
            uses[min(a, b), max(a, b)] = uses.get((min(a, b), max(a, b)), 0) + 1
    return {
        "vertices": points.reshape(-1, 3).tolist(), "edges": [list(edge) for edge in uses], "faces": faces,
        "assignment": ["B" if use == 1 else letter for use in uses.values()], "angles": [0.0] * len(uses),
        "facets": "flexible", "mesh_size": 10.0 * float(np.ptp(points)),
    } | more  # fmt: skip


def moved(sheet: dict[str, Any], poisson: float, loads: list[dict[str, Any]], folder: Path) -> np.ndarray:
    """Displacement of the probe "p" in a static run, m."""
    data = {
        "sheet": sheet, "material": {"young": YOUNG, "poisson": poisson, "density": 2700.0},
        "crease": {"stiffness_per_length": 1.0}, "load": loads, "save": {"interval": 1.0},
        "solve": {"method": "static", "end_time": 1.0, "rtol": 1e-6},
    }  # fmt: skip
    result = fsm.load(data, folder=folder).run(folder / "out", figures=False)
    return np.array(result.summary["probe_displacement"]["p"])


def grid(sides: tuple[float, float], cells: tuple[int, int], shift: float) -> np.ndarray:
    """Grid of points in a rectangle; inner points are shifted at random by a part of a cell."""
    x, y = np.meshgrid(*(np.linspace(0.0, side, n + 1) for side, n in zip(sides, cells, strict=True)), indexing="ij")
    points = np.stack([x, y, np.zeros_like(x)], axis=-1)
    random = np.random.default_rng(7).uniform(-shift, shift, points.shape) * [sides[0] / cells[0], sides[1] / cells[1], 0.0]
    random[[0, -1]] = random[:, [0, -1]] = 0.0
    return points + random


@pytest.mark.parametrize("letter", ["F", "J"])
@pytest.mark.parametrize(
    ("cells", "shift", "length", "slender", "poisson"),
    [
        ((12, 1), 0.0, 0.3, 3e-3, 0.0), ((1, 7), 0.0, 0.3, 3e-2, 0.3), ((5, 4), 0.4, 1e-6, 1e-2, 0.45),
        ((5, 4), 0.4, 1e3, 3e-4, -0.3),
    ],
)  # fmt: skip
def test_cylindrical_bending(
    cells: tuple[int, int], shift: float, length: float, slender: float, poisson: float, letter: str, tmp_path: Path
) -> None:
    """A moment M per length at the ends, and nu M at the sides, bend a plate to a cylinder: w = M L^2/(2 D).

    Facets of one cell, of any shape, represent this state exactly. The joints of separate slopes were 3.7 to 9 % soft.
    """
    width = 0.7 * length
    plate = YOUNG * (slender * length) ** 3 / (12.0 * (1.0 - poisson**2))
    moment = 1e-5 * plate / length
    held = [{"at": "edge left", "clamped": True}]
    data = sheet(
        grid((length, width), cells, shift), letter, thickness=slender * length, support=held,
        probe=[{"name": "p", "at": f"vertex {(cells[0] + 1) * (cells[1] + 1)}"}],
    )  # fmt: skip
    loads = [
        {"at": "edge right", "moment_per_length": [0.0, -moment, 0.0]},
        {"at": "edge top", "moment_per_length": [poisson * moment, 0.0, 0.0]},
        {"at": "edge bottom", "moment_per_length": [-poisson * moment, 0.0, 0.0]},
    ]
    found = moved(data, poisson, loads if poisson else loads[:1], tmp_path)
    assert found[2] == pytest.approx(0.5e-5 * length, rel=1e-4, abs=0.0)


def test_twisting(tmp_path: Path) -> None:
    """Forces P at two opposite corners twist a plate that stands on the other corners: w = P a b/(2 D (1 - nu))."""
    a, b, thickness, poisson, force = 0.3, 0.2, 1e-3, 0.3, 1e-3
    plate = YOUNG * thickness**3 / (12.0 * (1.0 - poisson**2))
    points = grid((a, b), (4, 3), 0.4)
    held = [{"at": "vertex 1"}, {"at": "vertex 4", "fixed": ["x", "z"]}, {"at": "vertex 17", "fixed": ["z"]}]
    data = sheet(points, thickness=thickness, support=held, probe=[{"name": "p", "at": "vertex 20"}])
    found = moved(data, poisson, [{"at": "vertex 20", "force": [0.0, 0.0, force]}], tmp_path)
    assert found[2] == pytest.approx(force * a * b / (2.0 * plate * (1.0 - poisson)), rel=1e-4)


def test_ring_of_flat_strips(tmp_path: Path) -> None:
    """Quarter of a ring of flat strips, pulled at its top: w = P R^3 (pi/4 - 2/pi)/(E I), of second order in the strips."""
    radius, width, thickness = 1.0, 0.1, 1e-3
    section = YOUNG * width * thickness**3 / 12.0
    errors = []
    for strips in (8, 32):
        angle = np.linspace(0.0, 0.5 * math.pi, strips + 1)
        section_line = radius * np.column_stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)])
        section_line[np.abs(section_line) < 1e-12] = 0.0
        points = np.stack([section_line, section_line + [0.0, width, 0.0]], axis=1)
        support = [{"at": "edge left", "mirror": "x"}, {"at": "edge right", "fixed": ["y", "z"], "clamped": True}]
        data = sheet(points, thickness=thickness, support=support, probe=[{"name": "p", "at": f"vertex {2 * strips + 1}"}])
        force = 1e-4 * section / radius**2
        found = moved(data, 0.0, [{"at": "edge left", "force": [0.0, 0.0, force]}], tmp_path)
        errors.append(found[2] / (force * radius**3 / section * (math.pi / 4.0 - 2.0 / math.pi)) - 1.0)
    assert abs(errors[0]) < 1e-2
    assert abs(errors[1]) < 1e-3
