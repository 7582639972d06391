"""Linear benchmarks of curved shells that are given as flat facets: a grid of points on the shell, and no curved shape."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

import fsm
from validation.gallery.drawing import convergence
from validation.gallery.record import Check, Place, against
from validation.sheets.shells import order_of_values

__all__ = ["curved_shells"]

_PART = 1e-3
"""Part of the loads that is applied, so that the shell is linear."""


class _Shell(NamedTuple):
    """Points (m, n, 3), material and supports; loads as pairs of a vertex and a force, or the weight per area; probe; its
    displacement along an axis.
    """

    points: np.ndarray
    young: float
    poisson: float
    thickness: float
    supports: list[dict[str, Any]]
    loads: list[tuple[int, list[float]]] | float
    probe: int
    axis: int
    reference: float
    source: str


def _grid(m: int, n: int, across: float, along: float) -> list[np.ndarray]:
    return list(np.meshgrid(np.linspace(0.0, across, m + 1), np.linspace(0.0, along, n + 1), indexing="ij"))


def _hemisphere(n: int) -> _Shell:
    turn, up = _grid(n, n, 0.5 * math.pi, math.radians(72.0))
    points = 10.0 * np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], axis=-1)
    supports = [{"at": "edge left", "mirror": "x"}, {"at": "edge bottom", "mirror": "y"}, {"at": "vertex 1", "fixed": ["z"]}]
    loads = [(1, [1.0, 0.0, 0.0]), (n * (n + 1) + 1, [0.0, -1.0, 0.0])]
    source = "0.0935 m: limit of this program; MacNeal and Harder 1985 0.094, Simo, Fox and Rifai 1989 0.093"
    return _Shell(points, 6.825e7, 0.3, 0.04, supports, loads, 1, 0, 0.0935, source)


def _roof(n: int) -> _Shell:
    x, turn = _grid(n, n, 25.0, math.radians(40.0))
    points = np.stack([x, 25.0 * np.sin(turn), 25.0 * (np.cos(turn) - 1.0)], axis=-1)
    supports = [
        {"at": "edge right", "mirror": "x"}, {"at": "edge bottom", "mirror": "y"}, {"at": "edge left", "fixed": ["y", "z"]},
    ]  # fmt: skip
    return _Shell(points, 4.32e8, 0.0, 0.25, supports, 90.0, (n + 1) ** 2, 2, -0.3006, "Scordelis and Lo: deep thin shell")


def _cylinder(n: int) -> _Shell:
    x, turn = _grid(n, n, 300.0, 0.5 * math.pi)
    points = np.stack([x, 300.0 * np.sin(turn), 300.0 * np.cos(turn)], axis=-1)
    mirrors = [{"at": f"edge {edge}", "mirror": axis} for edge, axis in (("left", "x"), ("bottom", "y"), ("top", "z"))]
    supports = [*mirrors, {"at": "edge right", "fixed": ["y", "z"]}]
    source = "series of Flügge and of Lindberg, Olson and Cowper: pinched cylinder on diaphragms"
    return _Shell(points, 3e6, 0.3, 3.0, supports, [(1, [0.0, 0.0, -0.25])], 1, 2, -1.8248e-5, source)


def _saddle(n: int) -> _Shell:
    x, y = _grid(2 * n, n, 1.0, 0.5)
    points = np.stack([x - 0.5, y, (x - 0.5) ** 2 - y**2], axis=-1)
    supports = [{"at": "edge bottom", "mirror": "y"}, {"at": "edge left", "clamped": True}]
    source = "Bathe, Iosilevich and Chapelle 2000: partly clamped hyperbolic paraboloid, t/L = 1/1000"
    return _Shell(points, 2e11, 0.3, 1e-3, supports, 8.0, 2 * n * (n + 1) + 1, 2, -6.3941e-3, source)


_SHELLS = {"pinched hemisphere": _hemisphere, "Scordelis-Lo roof": _roof, "pinched cylinder": _cylinder, "saddle": _saddle}


def _case(shell: _Shell) -> dict[str, Any]:
    """Case of a shell of two triangles for each cell of its grid, with diagonals in turn."""
    m, n, _ = shell.points.shape
    number, faces = np.arange(m * n).reshape(m, n), []
    for i in range(m - 1):
        for j in range(n - 1):
            a, b, c, d = number[[i, i + 1, i + 1, i], [j, j, j + 1, j + 1]].tolist()
            faces += [(a, b, c), (a, c, d)] if (i + j) % 2 == 0 else [(a, b, d), (b, c, d)]
    edges = Counter((min(pair), max(pair)) for a, b, c in faces for pair in ((a, b), (b, c), (c, a)))
    at = np.where(np.abs(shell.points) < 1e-12 * np.ptp(shell.points), 0.0, shell.points).reshape(-1, 3)
    if isinstance(shell.loads, float):
        p, q, r = (at[[face[k] for face in faces]] for k in range(3))
        weight = np.zeros(len(at))
        np.add.at(weight, np.array(faces), shell.loads / 6.0 * np.linalg.norm(np.cross(q - p, r - p), axis=1)[:, None])
        loads = [(k + 1, [0.0, 0.0, -w]) for k, w in enumerate(weight.tolist())]
    else:
        loads = shell.loads
    return {
        "sheet": {
            "vertices": at.tolist(), "faces": faces, "edges": list(edges), "angles": [0.0] * len(edges),
            "assignment": ["B" if count == 1 else "F" for count in edges.values()], "facets": "flexible",
            "mesh_size": 10.0 * float(np.ptp(at)), "thickness": shell.thickness, "support": shell.supports,
            "probe": [{"name": "p", "at": f"vertex {shell.probe}"}],
        },
        "material": {"young": shell.young, "poisson": shell.poisson, "density": 1.0},
        "crease": {"stiffness_per_length": 1.0},
        "load": [{"at": f"vertex {v}", "force": [_PART * f for f in force]} for v, force in loads],
        "solve": {"method": "static", "end_time": 1.0, "rtol": 1e-3, "error_estimates": "off"}, "save": {"interval": 1.0},
    }  # fmt: skip


def curved_shells(place: Place) -> Iterator[Check]:
    """Shells of flat triangles under small loads."""
    sizes = (8, 16, 32) if place.full else (4, 8, 16)
    errors, checks = dict[str, list[float]](), []
    for name, build in _SHELLS.items():
        values = []
        for cells in sizes:
            shell = build(cells)
            result = fsm.load(_case(shell), folder=place.out).run(place.out / "run", figures=False)
            values.append(result.summary["probe_displacement"]["p"][shell.axis] / _PART)
        errors[name] = [abs(value / shell.reference - 1.0) for value in values]
        parts = ", ".join(f"{value / shell.reference:.4f}" for value in values)
        detail = f"over the reference {parts}, {order_of_values(sizes, values)}"
        checks.append((name, values[-1], shell.reference, shell.source, detail))
    picture = convergence(place.out / "curved_shells.png", sizes, errors, 2, x="cells of a side")
    for name, value, reference, source, detail in checks:
        what = f"{sizes[-1]} cells, flat triangles"
        rtol = 0.015 if place.full else 0.025
        yield against(name, what, value, reference, source, picture, rtol=rtol, unit="m", detail=detail)
