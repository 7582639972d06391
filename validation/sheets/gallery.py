"""Flexible facets against published shells and plates, on regular and random meshes.

python -m validation.sheets.gallery [--parts slit_annulus plates ...] [--out out/validation/sheets] [--full]
"""

from __future__ import annotations

import csv
import math
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import eigh

import fsm
from validation.gallery.command import command
from validation.gallery.drawing import beside, convergence
from validation.gallery.record import Check, Part, Place, against
from validation.peers.shells import REFERENCE
from validation.sheets.strip import anticlastic, pulled_strip, strip_forms

TITLE = "Flexible facets"
SZE = "Sze, Liu and Lo 2004, Finite Elements in Analysis and Design 40, 1551"
_ANNULUS = {0.025: (1.305, 1.789), 0.1: (4.277, 5.876), 0.2: (6.725, 9.160), 0.5: (10.468, 13.768), 1.0: (13.891, 17.528)}
"""Rise of the inner and the outer end over the load, relative to the largest."""


def _case(sheet: Mapping[str, Any], material: Mapping[str, float], load: Mapping[str, Any], **more: Any) -> dict[str, Any]:
    """Case of a plate whose load grows to its full size."""
    return {
        "sheet": {"kind": "plate", "facets": "flexible", **sheet},
        "material": {"density": 1.0, **material},
        "load": [load],
        "solve": {"method": "static", "end_time": 1.0, "rtol": 1e-3},
        "save": {"interval": 0.025, "channels": ["point.*.displacement"]},
        **more,
    }


def _solved(data: dict[str, Any], folder: Path) -> tuple[np.ndarray, dict[str, np.ndarray], str]:
    """Loads relative to the largest, displacements (n, 3) of the probes, and a text on the run."""
    begun = time.process_time()
    result = fsm.load(data, folder=folder).run(folder / "run", figures=False)
    names = [probe["name"] for probe in data["sheet"]["probe"]]
    found = {name: np.asarray(result[f"point.{name}.displacement"].values) for name in names}
    summary = result.summary
    text = (
        f"{summary['dof']} unknowns, {summary['steps']} steps, {summary['newton_iterations']} iterations, "
        f"{time.process_time() - begun:.1f} s"
    )
    return np.asarray(result.time), found, text


def _annulus(mesh: tuple[int, int], shift: float = 0.0, grading: float = 1.0) -> dict[str, Any]:
    sheet = {
        "inner_radius": 6.0, "outer_radius": 10.0, "slit": True, "mesh": list(mesh), "mesh_shift": shift,
        "mesh_grading": [grading, 0.0], "thickness": 0.03, "support": [{"at": "edge slit-start", "clamped": True}],
        "probe": [{"name": "inner", "at": "vertex 4"}, {"name": "outer", "at": "vertex 3"}],
    }  # fmt: skip
    load = {"at": "edge slit-end", "force_per_length": [0.0, 0.0, 0.8]}
    return _case(sheet, {"young": 21e6, "poisson": 0.0}, load)


def slit_annulus(place: Place) -> Iterator[Check]:
    """Annular plate with a slit, one edge of the slit clamped, the other lifted by more than the outer diameter."""
    kinds = {"equal cells": (0.0, 0.0), "graded cells": (0.0, 1.0), "random graded cells": (0.3, 1.0)}
    meshes = [(5, 40), (10, 80)] if not place.full else [(5, 40), (7, 56), (10, 80), (14, 112)]
    curves, checks, errors, texts = {}, [], dict[str, list[float]](), dict[str, str]()
    for kind, (shift, grading) in kinds.items():
        for mesh in meshes:
            name = f"{mesh[0]} x {mesh[1]} {kind}"
            at, found, texts[kind] = _solved(_annulus(mesh, shift, grading), place.out)
            rise = {end: found[end][:, 2] for end in ("inner", "outer")}
            apart = [abs(float(rise[end][-1]) / limit - 1.0) for end, limit in zip(rise, REFERENCE, strict=True)]
            errors.setdefault(kind, []).append(max(apart))
            if mesh != meshes[-1] or not grading:
                continue
            for k, (end, way) in enumerate(rise.items()):
                curves[f"{end}, {name}"] = (way, at)
                for part, values in _ANNULUS.items():
                    what = f"rise of the {end} end at {part:g} of the load"
                    checks.append((what, name, float(np.interp(part, at, way)), values[k], texts[kind]))
    points = {
        f"{end}, Sze": ([w[k] for w in _ANNULUS.values()], list(_ANNULUS)) for k, end in enumerate(("inner", "outer"))
    }
    picture = beside(place.out / "slit_annulus.png", curves, points, "rise (m)", "load over the largest")
    for name, what, value, reference, text in checks:
        yield against(name, what, value, reference, SZE, picture, rtol=5e-3, unit="m", detail=text)
    picture = convergence(place.out / "slit_annulus_error.png", [n for n, _ in meshes], errors, 2, x="cells of a radius")
    source = f"limits {REFERENCE[0]} and {REFERENCE[1]} m of fine meshes of this program, CalculiX and Kratos"
    for kind, off in errors.items():
        name = f"{kind}: difference from the limit at full load"
        bound = 1e-3 if kind != "equal cells" else 5e-3
        what = f"{meshes[-1][0]} x {meshes[-1][1]}"
        yield against(name, what, off[-1], 0.0, source, picture, atol=bound, detail=texts[kind])


def _strip(length: float, mesh: tuple[int, int], shift: float, load: Mapping[str, Any]) -> dict[str, Any]:
    sheet = {
        "length": length, "width": 1.0, "thickness": 0.1, "mesh": list(mesh), "mesh_shift": shift,
        "support": [{"at": "edge left", "clamped": True}], "probe": [{"name": "tip", "at": "vertex 2"}],
    }  # fmt: skip
    return _case(sheet, {"young": 1.2e6, "poisson": 0.0}, {"at": "edge right", **load})


def cantilever(place: Place) -> Iterator[Check]:
    """Cantilever under an end shear force."""
    curves, checks = {}, []
    for mesh, shift in (((16, 2), 0.0), ((24, 3), 0.3)):
        name = f"{mesh[0]} x {mesh[1]}{', random' if shift else ''}"
        at, found, text = _solved(_strip(10.0, mesh, shift, {"force": [0.0, 0.0, 4.0]}), place.out)
        tip = found["tip"]
        curves[f"along, {name}"], curves[f"across, {name}"] = (-tip[:, 0], at), (tip[:, 2], at)
        checks.append(("end shear, along", name, -tip[-1, 0], 3.286, text))
        checks.append(("end shear, across", name, tip[-1, 2], 6.698, text))
    points = {"along, Sze": ([3.286], [1.0]), "across, Sze": ([6.698], [1.0])}
    picture = beside(place.out / "cantilever.png", curves, points, "displacement (m)", "force over the largest")
    for name, what, value, reference, text in checks:
        yield against(name, what, float(value), reference, SZE, picture, rtol=2e-3, unit="m", detail=text)


def roll_up(place: Place) -> Iterator[Check]:
    """Strip that an end moment bends to a circle: exact."""
    gaps, sizes, checks = [], (12, 24, 48), []
    for cells in sizes:
        data = _strip(12.0, (cells, max(1, cells // 12)), 0.0, {"moment": [0.0, -50.0 * math.pi / 3.0, 0.0]})
        at, found, text = _solved(data, place.out)
        x, _, z = found["tip"][-1]
        gaps.append(math.hypot(12.0 + x, z) / 12.0)
        half = found["tip"][int(np.argmin(np.abs(at - 0.5)))]
        checks.append((cells, half, text))
    errors = {"gap of the circle / length": gaps}
    picture = convergence(place.out / "roll_up.png", sizes, errors, 2, x="cells along the strip")
    cells, half, text = checks[-1]
    source = "closed form: a circle of length 12"
    yield against("gap of the closed circle", f"{cells} cells, over the length", gaps[-1], 0.0, source, picture, atol=2e-3)
    for name, value, exact in (("along", -half[0], 12.0), ("across", half[2], 24.0 / math.pi)):
        what = f"{cells} cells, half of the moment"
        yield against(f"half circle, {name}", what, float(value), exact, source, picture, rtol=2e-3, unit="m", detail=text)


def plates(place: Place) -> Iterator[Check]:
    """Natural frequencies of square plates: one edge clamped, all simply supported, and free."""
    edges = ("left", "right", "bottom", "top")
    clamped = [{"at": "edge left", "clamped": True}]
    simple = [{"at": f"edge {edge}"} for edge in edges]
    pi2 = math.pi**2
    known = {
        "clamped at one edge": (clamped, _cantilever_plate(5), "Ritz's method with 144 polynomials", 1.5e-3),
        "simply supported": (simple, [2 * pi2, 5 * pi2, 5 * pi2, 8 * pi2], "closed form", 1.5e-3),
    }
    plate = 70e9 * 0.01**3 / (12.0 * 0.91)
    unit = math.sqrt(plate / 27.0) / (2.0 * math.pi)
    meshes = ((16, 0.0), (32, 0.0), (32, 0.3))
    errors: dict[str, list[float]] = {}
    rows = []
    for name, (support, reference, source, tolerance) in known.items():
        for cells, shift in meshes:
            found = _frequencies(support, cells, shift, place.out) / unit
            off = [float(found[k] / exact - 1.0) for k, exact in enumerate(reference)]
            if not shift:
                errors.setdefault(name, []).append(max(map(abs, off)))
            if cells == 32:
                what = f"{name}, {cells} x {cells}{', random' if shift else ''}"
                rows += [(k, what, float(found[k]), exact, source, tolerance) for k, exact in enumerate(reference)]
    picture = convergence(place.out / "plates.png", (16, 32), errors, 2, x="cells per side")
    for k, what, value, exact, source, tolerance in rows:
        yield against(f"mode {k + 1}, omega a^2 sqrt(m/D)", what, value, exact, source, picture, rtol=tolerance)
    free = _frequencies([], 16, 0.3, place.out) / unit
    rigid = float(np.abs(free[:6]).max())
    yield against("six modes of a free plate", "16 x 16, random", rigid, 0.0, "rigid motions", picture, atol=1e-3)


def _cantilever_plate(count: int) -> list[float]:
    """omega a^2 sqrt(m/D) of a square plate clamped at x = 0, Poisson's ratio 0.3, with x^2 times Legendre polynomials."""
    terms, nu = 12, 0.3
    points, weights = np.polynomial.legendre.leggauss(24)
    place, weights = 0.5 * (points + 1.0), 0.5 * weights
    along, across = [], []
    for i in range(terms):
        legendre = np.polynomial.Legendre.basis(i, domain=[0.0, 1.0]).convert(kind=np.polynomial.Polynomial)
        clamped = np.polynomial.Polynomial([0.0, 0.0, 1.0]) * legendre
        along.append([clamped.deriv(d)(place) if d else clamped(place) for d in range(3)])
        across.append([legendre.deriv(d)(place) if d else legendre(place) for d in range(3)])
    x, y = np.array(along), np.array(across)

    def integral(f: np.ndarray, a: int, b: int) -> np.ndarray:
        return np.asarray(np.einsum("ip,jp,p->ij", f[:, a], f[:, b], weights))

    def both(a: int, b: int, c: int, d: int) -> np.ndarray:
        """Integral of the derivatives (a, c) of one function by x and y, times those (b, d) of another."""
        return np.asarray(np.kron(integral(x, a, b), integral(y, c, d)))

    mixed = both(2, 0, 0, 2)
    stiffness = both(2, 2, 0, 0) + both(0, 0, 2, 2) + nu * (mixed + mixed.T) + 2.0 * (1.0 - nu) * both(1, 1, 1, 1)
    values = eigh(stiffness, both(0, 0, 0, 0), eigvals_only=True)
    return [float(value) for value in np.sqrt(values[:count])]


def _frequencies(support: list[dict[str, Any]], cells: int, shift: float, folder: Path) -> np.ndarray:
    sheet = {
        "kind": "plate", "facets": "flexible", "length": 1.0, "width": 1.0, "mesh": [cells, cells], "mesh_shift": shift,
        "thickness": 0.01, "support": support,
    }  # fmt: skip
    data = {
        "sheet": sheet, "material": {"young": 70e9, "poisson": 0.3, "density": 2700.0},
        "step": [{"kind": "modes", "modes": 8}],
    }  # fmt: skip
    result = fsm.load(data, folder=folder).run(folder / "modes", figures=False)
    return np.array(result.summary["step"][0]["frequencies_hz"])


def open_cylinder(place: Place) -> Iterator[Check]:
    """Cylinder with open ends, pulled out by two opposite forces; an eighth of it, with planes of symmetry."""
    radius, length = 4.953, 10.35
    support = [{"at": f"edge {edge}", "mirror": axis} for edge, axis in (("left", "x"), ("right", "z"), ("bottom", "y"))]
    mesh = (36, 24) if place.full else (24, 16)
    sheet = {
        "length": 0.5 * math.pi * radius, "width": 0.5 * length, "radius": radius, "mesh": list(mesh), "thickness": 0.094,
        "support": support, "probe": [{"name": name, "at": f"vertex {k}"} for k, name in enumerate("ABC", 1)],
    }  # fmt: skip
    data = _case(sheet, {"young": 10.5e6, "poisson": 0.3125}, {"at": "vertex 1", "force": [0.0, 0.0, 10_000.0]})
    at, found, text = _solved(data, place.out)
    sides = {"A": found["A"][:, 2], "B": -found["B"][:, 0], "C": -found["C"][:, 0]}
    known = {0.5: {"A": 2.473, "B": 3.653, "C": 3.718}, 1.0: {"A": 2.768, "B": 4.551, "C": 3.269}}
    curves = {name: (value, at) for name, value in sides.items()}
    points = {f"{name}, Sze": ([part[name] for part in known.values()], list(known)) for name in "ABC"}
    picture = beside(place.out / "open_cylinder.png", curves, points, "displacement (m)", "force over the largest")
    what = f"{mesh[0]} x {mesh[1]}"
    for part, values in known.items():
        for name, reference in values.items():
            value = float(np.interp(part, at, sides[name]))
            yield against(
                f"point {name} at {part:g} of the force", what, value, reference, SZE, picture, rtol=1.5e-2,
                unit="m", detail=text,
            )  # fmt: skip


def hinged_roof(place: Place) -> Iterator[Check]:
    """Cylindrical roof on hinges with a force at its crown: through limit points by arc length; a quarter of it."""
    known = {12.7: [("highest force", 0.7421)], 6.35: [("highest force", 0.1953), ("lowest force", -0.1288)]}
    curves, points, checks = {}, {}, []
    for thickness, values in known.items():
        begun = time.process_time()
        force, way = _roof(thickness, (12, 12), place.out)
        text = f"{len(force)} points, {time.process_time() - begun:.1f} s"
        curves[f"{thickness:g} m"] = (way, force)
        change = np.diff(force)
        turns = np.flatnonzero(change[:-1] * change[1:] < 0.0) + 1
        for k, (name, reference) in enumerate(values):
            at = int(turns[k])
            fit = np.polyfit(way[at - 1 : at + 2], force[at - 1 : at + 2], 2)
            value = float(fit[2] - fit[1] ** 2 / (4.0 * fit[0]))
            checks.append((name, f"thickness {thickness:g}, 12 x 12", value, reference, text))
        where = {12.7: [11.293], 6.35: [12.892, 15.778]}[thickness]
        points[f"{thickness:g} m, Sze"] = (where, [reference for _, reference in values])
    picture = beside(place.out / "hinged_roof.png", curves, points, "displacement of the crown (m)", "force over 3000 N")
    for name, what, value, reference, text in checks:
        yield against(name, what, value, reference, SZE, picture, rtol=1e-2, detail=text)


def _roof(thickness: float, mesh: tuple[int, int], folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Force over its largest and displacement of the crown along the path."""
    support = [
        {"at": "edge left", "mirror": "x"}, {"at": "edge bottom", "mirror": "y"}, {"at": "edge right"},
    ]  # fmt: skip
    sheet = {
        "length": 254.0, "width": 254.0, "radius": 2540.0, "mesh": list(mesh), "thickness": thickness, "support": support,
    }  # fmt: skip
    load = {"name": "force", "at": "vertex 1", "force": [0.0, 0.0, -750.0]}
    solve = {"method": "arc-length", "end_time": 1.0}
    data = _case(sheet, {"young": 3102.75, "poisson": 0.3}, load, solve=solve, save={"interval": 0.1})
    fsm.load(data, folder=folder).run(folder / f"roof_{thickness:g}", figures=False)
    with (folder / f"roof_{thickness:g}" / "load.csv").open(encoding="utf-8") as file:
        rows = np.array([[float(value) for value in row] for row in list(csv.reader(file))[1:]])
    return rows[:, -2] / 750.0, rows[:, -1]


PARTS: dict[str, Part] = {
    "slit_annulus": slit_annulus,
    "cantilever": cantilever,
    "roll_up": roll_up,
    "plates": plates,
    "open_cylinder": open_cylinder,
    "hinged_roof": hinged_roof,
    "pulled_strip": pulled_strip,
    "strip_forms": strip_forms,
    "anticlastic": anticlastic,
}

if __name__ == "__main__":
    sys.exit(command(PARTS, "sheets", __doc__))
