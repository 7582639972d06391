"""Shells of flat facets: benchmarks of curved shells from a grid of points, without a curved shape in the case."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from tests.physics.test_flat_lines import sheet


def moved(sheet: dict[str, Any], young: float, poisson: float, part: float, loads: list[dict[str, Any]], to: Path) -> Any:
    """Displacement of the probe "p" for loads times `part`, over `part`, m: that of the linear shell."""
    forces = [{key: [part * f for f in v] if isinstance(v, list) else v for key, v in load.items()} for load in loads]
    data = {
        "sheet": sheet, "material": {"young": young, "poisson": poisson, "density": 1.0}, "load": forces,
        "crease": {"stiffness_per_length": 1.0}, "save": {"interval": 1.0},
        "solve": {"method": "static", "end_time": 1.0, "rtol": 1e-3, "error_estimates": "off"},
    }  # fmt: skip
    result = fsm.load(data, folder=to).run(to / "out", figures=False)
    return np.array(result.summary["probe_displacement"]["p"]) / part


def triangles(points: np.ndarray, **more: Any) -> dict[str, Any]:
    """Sheet of two facets for each cell of a grid of points (m, n, 3), with diagonals in turn."""
    cells = sheet(points, **more)
    faces = []
    for k, (a, b, c, d) in enumerate(cells["faces"]):
        even = sum(divmod(k, points.shape[1] - 1)) % 2 == 0
        faces += [(a, b, c), (a, c, d)] if even else [(a, b, d), (b, c, d)]
    edges = Counter((min(pair), max(pair)) for a, b, c in faces for pair in ((a, b), (b, c), (c, a)))
    return cells | {
        "faces": faces, "edges": list(edges), "angles": [0.0] * len(edges),
        "assignment": ["B" if count == 1 else "F" for count in edges.values()],
    }  # fmt: skip


def points_of(cells: int, across: float, along: float, shift: float = 0.0) -> np.ndarray:
    """Two coordinates (2, n, n) of a grid from 0 to these sizes; inner points are shifted at random by a part of a cell."""
    points = np.array(np.meshgrid(*2 * [np.linspace(0.0, 1.0, cells + 1)], indexing="ij"))
    moved = np.random.default_rng(3).uniform(-shift, shift, points.shape) / cells
    moved[0, [0, -1]] = moved[1, :, [0, -1]] = 0.0
    return (points + moved) * np.array([across, along])[:, None, None]


def test_pinched_hemisphere(tmp_path: Path) -> None:
    """Hemisphere with a hole of 18 deg, pulled and pushed at its equator by two pairs of forces of 2 N: 0.0935 m.

    MacNeal and Harder give 0.094, Simo, Fox and Rifai 0.093. With hinges in the planes of symmetry it was 0.0843 m.
    """
    cells, radius = 8, 10.0
    turn, up = points_of(cells, 0.5 * math.pi, math.radians(72.0))
    points = radius * np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], axis=-1)
    points[np.abs(points) < 1e-12] = 0.0
    supports = [{"at": "edge left", "mirror": "x"}, {"at": "edge bottom", "mirror": "y"}, {"at": "vertex 1", "fixed": ["z"]}]
    last = f"vertex {cells * (cells + 1) + 1}"
    data = triangles(points, thickness=0.04, support=supports, probe=[{"name": "p", "at": "vertex 1"}])
    loads = [{"at": "vertex 1", "force": [1.0, 0.0, 0.0]}, {"at": last, "force": [0.0, -1.0, 0.0]}]
    assert moved(data, 6.825e7, 0.3, 1e-2, loads, tmp_path)[0] == pytest.approx(0.0935, rel=0.03)


def test_roof_under_its_weight(tmp_path: Path) -> None:
    """Roof of Scordelis and Lo on diaphragms: 0.3006 m at the middle of its free edge, with triangles of any shape.

    With mean normals it was 0.234 m.
    """
    cells = 8
    x, turn = points_of(cells, 25.0, math.radians(40.0), 0.3)
    points = np.stack([x, 25.0 * np.sin(turn), 25.0 * (np.cos(turn) - 1.0)], axis=-1)
    supports = [
        {"at": "edge right", "mirror": "x"}, {"at": "edge bottom", "mirror": "y"}, {"at": "edge left", "fixed": ["y", "z"]},
    ]  # fmt: skip
    corner = (cells + 1) ** 2
    data = triangles(points, thickness=0.25, support=supports, probe=[{"name": "p", "at": f"vertex {corner}"}])
    corners = np.array(data["faces"])
    p, q, r = (points.reshape(-1, 3)[corners[:, k]] for k in range(3))
    weight = np.zeros(corner)
    np.add.at(weight, corners, (90.0 / 6.0) * np.linalg.norm(np.cross(q - p, r - p), axis=1)[:, None])
    loads = [{"at": f"vertex {k + 1}", "force": [0.0, 0.0, -w]} for k, w in enumerate(weight.tolist())]
    assert moved(data, 4.32e8, 0.0, 1e-3, loads, tmp_path)[2] == pytest.approx(-0.3006, rel=0.01)
