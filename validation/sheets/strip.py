"""One pulled strip in three forms: segments, rigid facets and flexible facets; and the elastica as an independent reference.

Six panels of 80 mm by 40 mm zigzag at 80 degrees. The first and the last are held, and the third crease is pulled up.
Creases are linear, and there is no contact.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import fsm
from fsm.results.store import read_solution
from validation.gallery.drawing import beside, convergence
from validation.gallery.record import Check, Place, against

__all__ = [
    "PANEL", "TRAVELS", "WIDTH", "anticlastic", "by_flexible_facets", "by_rigid_facets", "by_segments", "elastica",
    "forces_of", "pulled_strip", "strip_forms",
]  # fmt: skip

TRAVELS = (0.004, 0.01, 0.02, 0.03, 0.04)
"""Travels of the tables, m."""

PANEL, WIDTH, THICKNESS, ANGLE, YOUNG = 0.08, 0.04, 3e-4, math.radians(80.0), 3e9
BENDING = YOUNG * THICKNESS**3 / 12.0
"""EI over the width, N m."""
CREASE = BENDING / 0.03
"""Stiffness of a crease over its length, N."""


def _case(form: dict[str, Any], poisson: float, travel: float, drive: dict[str, Any], **material: Any) -> dict[str, Any]:
    pull = {"direction": [0, 0, 1], "speed": "2 mm/s", "travel": travel}
    return form | {
        "material": {"young": YOUNG, "poisson": poisson, "density": 800.0, "damping": 0.0} | material,
        "drive": [drive | pull],
        "solve": {"method": "static", "rtol": 1e-6}, "save": {"every": 1e-3},
    }  # fmt: skip


def by_segments(segments: int, poisson: float = 0.0, travel: float = 0.04, plate: bool = False) -> dict[str, Any]:
    """Case of the strip by finite segments; `plate` bends it without anticlastic curvature."""
    strip = {
        "length": 6 * PANEL, "width": WIDTH, "thickness": THICKNESS, "panels": 6, "fold_angle": ANGLE,
        "segments_per_panel": segments,
    }  # fmt: skip
    form = {"strip": strip, "crease": {"law": "linear", "stiffness": CREASE * WIDTH}}
    return _case(form, poisson, travel, {"crease": 3}, plate=plate)


def _top() -> list[list[float]]:
    """Box around the third crease."""
    x = 3.0 * PANEL * math.cos(ANGLE)
    return [[x - 1e-6, -1.0, -1.0], [x + 1e-6, 1.0, 1.0]]


def by_flexible_facets(cells: int, poisson: float = 0.0, travel: float = 0.04, width: float = WIDTH) -> dict[str, Any]:
    """Case of the strip by flexible facets, with a number of cells along a panel."""
    sheet = {
        "kind": "zigzag", "columns": 6, "a": PANEL, "b": width, "fold_angle": ANGLE, "thickness": THICKNESS,
        "facets": "flexible", "mesh_size": PANEL / cells, "support": [{"at": "facet 1"}, {"at": "facet 6"}],
    }  # fmt: skip
    form = {"sheet": sheet, "crease": {"stiffness_per_length": CREASE}}
    return _case(form, poisson, travel, {"at": _top()})


def by_rigid_facets(pieces: int, travel: float = 0.04) -> dict[str, Any]:
    """Case of the strip with rigid facets: each panel is a row of facets, joined by springs of its bending stiffness.

    Half of the springs beside a crease are in series with it, as in the strip by segments.
    """
    size = PANEL / pieces
    parts = [1, pieces, pieces, pieces, pieces, 1]
    corners, folds = [np.zeros(2)], []
    for panel, count in enumerate(parts):
        along = PANEL / count * np.array([math.cos(ANGLE), math.sin(ANGLE) * (-1) ** panel])
        corners += [corners[-1] + (k + 1) * along for k in range(count)]
        folds.append(len(corners) - 1)
    lines, creases = len(corners), folds[:-1]
    across = dict(zip(creases, "MVMVM", strict=True)) | {0: "B", lines - 1: "B"}
    edges = [[2 * k, 2 * k + 1] for k in range(lines)]
    edges += [[2 * k + side, 2 * k + 2 + side] for side in (0, 1) for k in range(lines - 1)]
    letters = [across.get(k, "F") for k in range(lines)] + ["B"] * (2 * lines - 2)
    angles = [{"M": -2.0 * ANGLE, "V": 2.0 * ANGLE}.get(letter, 0.0) for letter in letters]
    between = BENDING / size
    own = [
        {"of": f"crease {k}", "stiffness_per_length": 1.0 / (1.0 / CREASE + flexible / between)}
        for k, flexible in zip(creases, (0.5, 1.0, 1.0, 1.0, 0.5), strict=True)
    ]
    sheet = {
        "vertices": [[float(x), y, float(z)] for x, z in corners for y in (0.0, WIDTH)], "edges": edges,
        "assignment": letters, "angles": angles,
        "faces": [[2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1] for k in range(lines - 1)], "thickness": THICKNESS,
        "crease": [{"of": "flat", "stiffness_per_length": between}, *own] if pieces > 1 else own,
        "support": [{"at": "facet 1"}, {"at": f"facet {lines - 1}"}],
    }  # fmt: skip
    form = {"sheet": sheet, "crease": {"stiffness_per_length": CREASE}}
    return _case(form, 0.0, travel, {"at": _top()})


def elastica(travel: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Travels (m) and forces (N) of panels that bend as inextensible beams, by shooting along two panels of a half."""
    bending, crease = BENDING * WIDTH, CREASE * WIDTH

    def panel(angle: float, moment: float, along: float, up: float) -> np.ndarray:
        """Angle, moment, and place relative to the start, at the end of a panel."""

        def rate(_: float, y: np.ndarray) -> list[float]:
            return [y[1] / bending, along * math.sin(y[0]) - up * math.cos(y[0]), math.cos(y[0]), math.sin(y[0])]

        start = [angle, moment, 0.0, 0.0]
        return np.asarray(solve_ivp(rate, (0.0, PANEL), start, rtol=1e-10, atol=1e-12, method="DOP853").y[:, -1])

    def gap(unknown: np.ndarray, risen: float) -> list[float]:
        along, up, angle = unknown
        second = panel(angle, crease * (angle + ANGLE), along, up)
        third = panel(second[0] + 2.0 * ANGLE + second[1] / crease, second[1], along, up)
        x, z = second[2:] + third[2:]
        closed = third[1] / crease - 2.0 * (ANGLE - third[0])
        return [x / PANEL - 2.0 * math.cos(ANGLE), (z - risen) / PANEL, closed]

    unknown, forces = np.array([0.0, 0.0, -ANGLE]), []
    travels = np.linspace(0.0, travel, count)
    for risen in travels:
        unknown, _, found, text = fsolve(gap, unknown, args=(risen,), full_output=True, xtol=1e-12)
        if found != 1:
            raise RuntimeError(f"elastica at {risen:g} m: {text}")
        forces.append(2.0 * unknown[1])
    return travels, np.array(forces)


def forces_of(data: dict[str, Any], folder: Path) -> np.ndarray:
    """Force at each of `TRAVELS`, and the peak, N."""
    peak = fsm.load(data, folder=folder).run(folder / "strip", figures=False).summary["peak_force"]
    solution = read_solution(folder / "strip" / "result.h5")
    records = [int(np.argmin(np.abs(solution.travel[:, 0] - travel))) for travel in TRAVELS]
    return np.array([*solution.force[records, 0], peak])


def _of_elastica() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Forces as in `forces_of`, and the curve: travels and forces."""
    travels, force = elastica(TRAVELS[-1], 81)
    top = int(np.argmax(force))
    fit = np.polynomial.Polynomial.fit(travels[top - 2 : top + 3], force[top - 2 : top + 3], 4)
    near = np.linspace(travels[top - 1], travels[top + 1], 1001)
    at = [int(np.argmin(np.abs(travels - travel))) for travel in TRAVELS]
    return np.array([*force[at], fit(near).max()]), travels, force


def pulled_strip(place: Place) -> Iterator[Check]:
    """Pulled strip without contact: flexible facets and segments compared with the elastica, with Poisson's ratio zero."""
    exact, travels, curve = _of_elastica()
    cells, segments = (4, 8, 16, 32) if place.full else (4, 8, 16), (10, 20, 40, 80)
    facets = {n: forces_of(by_flexible_facets(n), place.out) for n in cells}
    chains = {n: forces_of(by_segments(n), place.out) for n in segments}
    fine = cells[-1]
    found = {f"facets, {fine} cells": (1e3 * np.array(TRAVELS), facets[fine][:-1])}
    curves = {"elastica": (1e3 * travels, curve)}
    picture = beside(place.out / "pulled_strip.png", curves, found, "travel (mm)", "force (N)")
    names = [*(f"force at {1e3 * travel:g} mm" for travel in TRAVELS), "peak force"]
    source = "elastica of inextensible panels, solved by shooting (SciPy)"
    for name, value, reference in zip(names, facets[fine], exact, strict=True):
        yield against(name, f"{fine} cells per panel", value, reference, source, picture, rtol=2e-3, unit="N")
    errors = {
        "facets, cells": [abs(facets[n][-1] / exact[-1] - 1.0) for n in cells[:3]],
        "segments": [abs(chains[n][-1] / exact[-1] - 1.0) for n in segments[:3]],
    }
    picture = convergence(place.out / "pulled_strip_order.png", (1, 2, 4), errors, 2, x="cells over 4, segments over 10")
    limit = facets[cells[-1]][-1] + (facets[cells[-1]][-1] - facets[cells[-2]][-1]) / 3.0
    beams = chains[80][-1] + (chains[80][-1] - chains[40][-1]) / 3.0
    what = "extrapolated with order 2"
    yield against("peak force, limit of facets", what, limit, beams, "limit of segments", picture, rtol=2e-4, unit="N")
    yield against("peak force, limit of segments", what, beams, exact[-1], source, picture, rtol=2e-4, unit="N")


def strip_forms(place: Place) -> Iterator[Check]:
    """The same strip by segments, and by rigid facets with springs of the bending stiffness between them."""
    curves, points, rows = {}, {}, []
    for pieces in (1, 10):
        rigid, segments = (forces_of(data(pieces), place.out) for data in (by_rigid_facets, by_segments))
        curves[f"segments, {pieces}"] = (1e3 * np.array(TRAVELS), segments[:-1])
        points[f"rigid facets, {pieces}"] = (1e3 * np.array(TRAVELS), rigid[:-1])
        rows.append((pieces, rigid[-1], segments[-1]))
    picture = beside(place.out / "strip_forms.png", curves, points, "travel (mm)", "force (N)")
    for pieces, value, reference in rows:
        what = f"{pieces} rigid facets a panel"  # segments can stretch, but rigid facets cannot
        yield against("peak force", what, value, reference, "strip by segments", picture, rtol=1e-4, unit="N")


def anticlastic(place: Place) -> Iterator[Check]:
    """Poisson's ratio 0.3: wide panels bend without anticlastic curvature, and narrow panels bend as beams."""
    cells = 16 if place.full else 8
    widths = (0.01, 0.02, 0.04, 0.08)
    alone = forces_of(by_flexible_facets(cells), place.out)[-1] / WIDTH
    at_least = [max(cells, round(4.0 * PANEL / width)) for width in widths]  # four cells across
    meshes = [by_flexible_facets(n, 0.3, width=w) for n, w in zip(at_least, widths, strict=True)]
    gains = [forces_of(mesh, place.out)[-1] / (w * alone) for mesh, w in zip(meshes, widths, strict=True)]
    beam, plate = (forces_of(by_segments(40, 0.3, plate=plate), place.out)[-1] for plate in (False, True))
    ends = {"beam": ([0.0, 80.0], [1.0, 1.0]), "plate strip": ([0.0, 80.0], [plate / beam] * 2)}
    picture = beside(
        place.out / "anticlastic.png", {"flexible facets": (1e3 * np.array(widths), gains)} | ends, {}, "width (mm)",
        "peak force over that of Poisson's ratio 0",
    )  # fmt: skip
    what = "80 mm wide, Poisson's ratio 0.3"
    source = "segments with EI/(1 - nu^2): no anticlastic curvature"
    yield against("rise of the peak force", what, gains[-1] - 1.0, plate / beam - 1.0, source, picture, rtol=0.1)
