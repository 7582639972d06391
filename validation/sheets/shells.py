"""Popular benchmark problems of geometrically nonlinear shells (Sze, Liu and Lo, 2004), on regular and random meshes."""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import fsm
from validation.gallery.drawing import beside, convergence
from validation.gallery.record import Check, Place, Reason, against
from validation.peers.shells import REFERENCE

__all__ = ["cantilever", "hinged_roof", "open_cylinder", "order", "pinched_cylinder", "roll_up", "slit_annulus"]

SZE = "Sze, Liu and Lo 2004, Finite Elements in Analysis and Design 40, 1551"
_ANNULUS = {0.025: (1.305, 1.789), 0.1: (4.277, 5.876), 0.2: (6.725, 9.160), 0.5: (10.468, 13.768), 1.0: (13.891, 17.528)}
"""Rise of the inner and the outer end over the load, relative to the largest."""
_EIGHTH = [{"at": f"edge {edge}", "mirror": axis} for edge, axis in (("left", "x"), ("right", "z"), ("bottom", "y"))]
"""Supports of an eighth of a cylinder with planes of symmetry; the edge "top" is its end."""


def order(cells: Sequence[float], errors: Sequence[float]) -> str:
    """Text with the order of convergence between the first and the last mesh."""
    rate = math.log(abs(errors[0]) / abs(errors[-1])) / math.log(cells[-1] / cells[0])
    return f"order {rate:.1f} ({' to '.join(f'{n:g}' for n in (cells[0], cells[-1]))} cells)"


def order_of_values(cells: Sequence[float], values: Sequence[float]) -> str:
    """Text with the order at which the values of three meshes converge to their own limit."""
    (h0, h1, h2), (v0, v1, v2) = (1.0 / np.array(cells[-3:])), values[-3:]
    ratio = (v1 - v0) / (v2 - v1) if v2 != v1 else math.nan

    def off(p: float) -> float:
        return float((h1**p - h0**p) / (h2**p - h1**p)) - ratio

    if not math.isfinite(ratio) or off(0.1) * off(8.0) > 0.0:
        return "no single order"
    return f"order {brentq(off, 0.1, 8.0):.1f} (own limit)"


def case_of(sheet: Mapping[str, Any], material: Mapping[str, float], load: Mapping[str, Any], **more: Any) -> dict[str, Any]:
    """Case of a plate whose load grows to its full size."""
    return {
        "sheet": {"kind": "plate", "facets": "flexible", **sheet},
        "material": {"density": 1.0, **material},
        "load": [load],
        "solve": {"method": "static", "end_time": 1.0, "rtol": 1e-3},
        "save": {"interval": 0.025, "channels": ["point.*.displacement"]},
        **more,
    }


def solved(data: dict[str, Any], folder: Path) -> tuple[np.ndarray, dict[str, np.ndarray], str]:
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
    return case_of(sheet, {"young": 21e6, "poisson": 0.0}, load)


def slit_annulus(place: Place) -> Iterator[Check]:
    """Annular plate with a slit, one edge of the slit clamped, the other lifted by more than the outer diameter."""
    kinds = {"equal cells": (0.0, 0.0), "graded cells": (0.0, 1.0), "random graded cells": (0.3, 1.0)}
    meshes = [(5, 40), (10, 80)] if not place.full else [(5, 40), (7, 56), (10, 80), (14, 112)]
    curves, checks, errors, texts = {}, [], dict[str, list[float]](), dict[str, str]()
    for kind, (shift, grading) in kinds.items():
        for mesh in meshes:
            name = f"{mesh[0]} x {mesh[1]} {kind}"
            at, found, texts[kind] = solved(_annulus(mesh, shift, grading), place.out)
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
    points = {f"{end}, Sze": ([w[k] for w in _ANNULUS.values()], list(_ANNULUS)) for k, end in enumerate(("inner", "outer"))}
    picture = beside(place.out / "slit_annulus.png", curves, points, "rise (m)", "load over the largest")
    for name, what, value, reference, text in checks:
        yield against(name, what, value, reference, SZE, picture, rtol=5e-3, unit="m", detail=text)
    picture = convergence(place.out / "slit_annulus_error.png", [n for n, _ in meshes], errors, 2, x="cells of a radius")
    source = f"limits {REFERENCE[0]} and {REFERENCE[1]} m of fine meshes of this program, CalculiX and Kratos"
    for kind, off in errors.items():
        name = f"{kind}: difference from the limit at full load"
        bound = 1e-3 if kind != "equal cells" else 5e-3
        what = f"{meshes[-1][0]} x {meshes[-1][1]}"
        rate = order([n for n, _ in meshes], off)
        yield against(name, what, off[-1], 0.0, source, picture, atol=bound, detail=f"{rate}, {texts[kind]}")


def _strip(length: float, mesh: tuple[int, int], shift: float, load: Mapping[str, Any]) -> dict[str, Any]:
    sheet = {
        "length": length, "width": 1.0, "thickness": 0.1, "mesh": list(mesh), "mesh_shift": shift,
        "support": [{"at": "edge left", "clamped": True}], "probe": [{"name": "tip", "at": "vertex 2"}],
    }  # fmt: skip
    return case_of(sheet, {"young": 1.2e6, "poisson": 0.0}, {"at": "edge right", **load})


def _elastica(force: float) -> tuple[float, float]:
    """Shortening and deflection over the length of an inextensible cantilever under an end force, force L^2/(E I)."""

    def shape(curvature: float) -> np.ndarray:
        def rate(_: float, y: np.ndarray) -> list[float]:
            return [y[1], -force * math.cos(y[0]), math.cos(y[0]), math.sin(y[0])]

        return np.asarray(solve_ivp(rate, (0.0, 1.0), [0.0, curvature, 0.0, 0.0], rtol=1e-10, atol=1e-12).y[:, -1])

    end = shape(brentq(lambda curvature: float(shape(curvature)[1]), 0.0, force))
    return 1.0 - float(end[2]), float(end[3])


def cantilever(place: Place) -> Iterator[Check]:
    """Cantilever under an end shear force."""
    curves, checks, errors = {}, [], dict[str, list[float]]()
    sizes, (short, up) = (6, 12, 24), _elastica(4.0)
    for kind, shift in (("regular", 0.0), ("random", 0.3)):
        for cells in sizes:
            data = _strip(10.0, (cells, max(1, cells // 8)), shift, {"force": [0.0, 0.0, 4.0]})
            at, found, text = solved(data, place.out)
            tip = found["tip"]
            errors.setdefault(kind, []).append(max(abs(-0.1 * tip[-1, 0] / short - 1.0), abs(0.1 * tip[-1, 2] / up - 1.0)))
        name, text = f"{sizes[-1]} x {sizes[-1] // 8}, {kind}", f"{order(sizes, errors[kind])}, {text}"
        curves[f"along, {name}"], curves[f"across, {name}"] = (-tip[:, 0], at), (tip[:, 2], at)
        checks.append(("end shear, along", name, -tip[-1, 0], 3.286, text))
        checks.append(("end shear, across", name, tip[-1, 2], 6.698, text))
    points = {"along, Sze": ([3.286], [1.0]), "across, Sze": ([6.698], [1.0])}
    picture = beside(place.out / "cantilever.png", curves, points, "displacement (m)", "force over the largest")
    for name, what, value, reference, text in checks:
        yield against(name, what, float(value), reference, SZE, picture, rtol=2e-3, unit="m", detail=text)
    picture = convergence(place.out / "cantilever_error.png", sizes, errors, 2, x="cells along the strip")
    source = "elastica of an inextensible cantilever, by shooting (SciPy)"
    for kind, off in errors.items():
        name = f"end shear, {kind} cells: difference from the elastica"
        yield against(name, f"{sizes[-1]} cells", off[-1], 0.0, source, picture, atol=1e-3, detail=order(sizes, off))


def roll_up(place: Place) -> Iterator[Check]:
    """Strip that an end moment bends to a circle: exact."""
    sizes, checks, gaps = (12, 24, 48), [], dict[str, list[float]]()
    for kind, shift in (("regular", 0.0), ("random", 0.3)):
        for cells in sizes:
            data = _strip(12.0, (cells, max(1, cells // 12)), shift, {"moment": [0.0, -50.0 * math.pi / 3.0, 0.0]})
            at, found, text = solved(data, place.out)
            x, _, z = found["tip"][-1]
            gaps.setdefault(kind, []).append(math.hypot(12.0 + x, z) / 12.0)
            half = found["tip"][int(np.argmin(np.abs(at - 0.5)))]
        checks.append((kind, half, f"{order(sizes, gaps[kind])}, {text}"))
    errors = {f"gap of the circle / length, {kind}": gap for kind, gap in gaps.items()}
    picture = convergence(place.out / "roll_up.png", sizes, errors, 2, x="cells along the strip")
    source = "closed form: a circle of length 12"
    for kind, half, text in checks:
        what = f"{sizes[-1]} cells, {kind}"
        gap = gaps[kind][-1]
        yield against("gap of the closed circle / length", what, gap, 0.0, source, picture, atol=2e-3, detail=text)
        for way, value, exact in (("along", -half[0], 12.0), ("across", half[2], 24.0 / math.pi)):
            where = f"{what}, half of the moment"
            yield against(
                f"half circle, {way}", where, float(value), exact, source, picture, rtol=2e-3, unit="m", detail=text
            )


def open_cylinder(place: Place) -> Iterator[Check]:
    """Cylinder with open ends, pulled out by two opposite forces; an eighth of it, with planes of symmetry."""
    known = {0.5: {"A": 2.473, "B": 3.653, "C": 3.718}, 1.0: {"A": 2.768, "B": 4.551, "C": 3.269}}
    curves, rows = {}, []
    kinds = {"regular": (0.0, ((18, 12), (24, 16), (36, 24))), "random": (0.3, ((18, 12), (24, 16), (36, 24)))}
    for kind, (shift, meshes) in kinds.items():
        chosen = meshes if place.full or not shift else meshes[1:2]
        found = [_pulled_cylinder(mesh, shift, place.out) for mesh in chosen]
        at, sides, text = found[-1]
        mesh, cells = chosen[-1], [n for n, _ in chosen]
        if not shift:
            curves = {name: (value, at) for name, value in sides.items()}
        for part, values in known.items():
            for name, reference in values.items():
                ways = [float(np.interp(part, loads, way[name])) for loads, way, _ in found]
                rate = f"{order_of_values(cells, ways)}, " if len(ways) > 2 else ""
                what = f"{mesh[0]} x {mesh[1]}, {kind}"
                rows.append((name, part, what, ways[-1], reference, rate + text))
    points = {f"{name}, Sze": ([part[name] for part in known.values()], list(known)) for name in "ABC"}
    picture = beside(place.out / "open_cylinder.png", curves, points, "displacement (m)", "force over the largest")
    for name, part, what, value, reference, text in rows:
        finest = what.startswith("36")
        reason = Reason(_NO_SHEAR, _THIN[part], 3e-3) if finest and name == "A" else None
        yield against(
            f"point {name} at {part:g} of the force", what, value, reference, SZE, picture, rtol=5e-3 if finest else 1.5e-2,
            unit="m", detail=text, reason=reason,
        )  # fmt: skip


_THIN = {0.5: 2.460, 1.0: 2.738}
"""Displacement of point A of 36 x 24 thin shells over the load, m."""
_NO_SHEAR = (
    "the reference has transverse shear, which adds about P/(2 pi k G t) = 0.020 m, times the logarithm of the size of a "
    "cell, under a point force; thin shells have none"
)


def _pulled_cylinder(mesh: tuple[int, int], shift: float, folder: Path) -> tuple[np.ndarray, dict[str, np.ndarray], str]:
    """Loads over the largest, displacements of the points A, B and C, and a text on the run."""
    radius, length = 4.953, 10.35
    sheet = {
        "length": 0.5 * math.pi * radius, "width": 0.5 * length, "radius": radius, "mesh": list(mesh), "thickness": 0.094,
        "mesh_shift": shift, "mesh_grading": [0.0, 1.0], "support": _EIGHTH,
        "probe": [{"name": name, "at": f"vertex {k}"} for k, name in enumerate("ABC", 1)],
    }  # fmt: skip
    data = case_of(sheet, {"young": 10.5e6, "poisson": 0.3125}, {"at": "vertex 1", "force": [0.0, 0.0, 10_000.0]})
    at, found, text = solved(data, folder)
    return at, {"A": found["A"][:, 2], "B": -found["B"][:, 0], "C": -found["C"][:, 0]}, text


def pinched_cylinder(place: Place) -> Iterator[Check]:
    """Cylinder between rigid diaphragms, pinched by two opposite forces: by arc length; an eighth of it."""
    kinds = {"regular": [(64, 0.0)], "random": [(64, 0.3)] if place.full else []}
    kinds["regular"] += [(40, 0.0)] if place.full else []
    curves, rows = {}, []
    for kind, meshes in kinds.items():
        for cells, shift in meshes:
            force, sides, text = _pinched(cells, shift, place.out)
            name = f"{cells} x {cells}, {kind}"
            curves |= {f"{point}, {name}": (way, force) for point, way in sides.items()}
            compared = [] if cells < 64 else [part for part in _THIN_PINCHED if part == 1.0 or not shift]
            for point, part in product("AB", compared):
                rows.append((point, part, name, _at_load(force, sides[point], part), text))
    points = {}
    for source, table in (("Sze", _PINCHED), ("Kratos", _THIN_PINCHED)):
        points |= {f"{point}, {source}": ([way[k] for way in table.values()], list(table)) for k, point in enumerate("AB")}
    picture = beside(place.out / "pinched_cylinder.png", curves, points, "displacement (m)", "force over the largest")
    for point, part, what, value, text in rows:
        name, k = f"point {point} at {part:g} of the force", "AB".index(point)
        reason = Reason(_COARSE_TABLE, _FINE_PINCHED[part][k], 3e-3)
        published, thin = _PINCHED[part][k], _THIN_PINCHED[part][k]
        yield against(name, what, value, published, SZE, picture, rtol=5e-3, unit="m", detail=text, reason=reason)
        reason = Reason(_KRATOS_TOO, _FINE_PINCHED[part][k], 3e-3) if part == 1.0 and point == "B" else None
        yield against(name, what, value, thin, _KRATOS, picture, rtol=5e-3, unit="m", detail=text, reason=reason)


_PINCHED = {
    0.05: (9.561, -0.233), 0.1: (23.164, -2.391), 0.15: (36.208, -2.154), 0.2: (56.373, 10.448), 0.3: (65.498, 17.979),
    0.5: (73.790, 25.381), 0.75: (79.339, 30.604), 1.0: (83.102, 34.272),
}  # fmt: skip
"""Displacements of the points A (inwards, under the force) and B (outwards) over the force, m (Sze, Liu and Lo, 2004)."""
_THIN_PINCHED = {0.5: (74.793, 26.603), 1.0: (84.092, 35.603)}
"""The same of thin shells of Kratos on 48 x 48 cells."""
_FINE_PINCHED = {0.5: (74.509, 26.510), 1.0: (83.786, 35.764)}
"""The same of this program on 64 x 64 cells."""
_KRATOS = "Kratos 10.4.4, thin shells with four nodes, 48 x 48 cells (python -m validation.peers.kratos_cylinder)"
_KRATOS_TOO = "cells of the reference, too, have an error of this size: 35.72 m with 24 x 24 cells, 35.60 m with 48 x 48"
_COARSE_TABLE = (
    "the table is of 40 x 40 shells, which are too coarse for the folds; thin shells of Kratos on 48 x 48 cells and of this "
    "program agree to 0.5 %"
)


def _pinched(cells: int, shift: float, folder: Path) -> tuple[np.ndarray, dict[str, np.ndarray], str]:
    """Forces over the largest, displacements of the points A and B, and a text on the run."""
    radius = 100.0
    sheet = {
        "length": 0.5 * math.pi * radius, "width": 100.0, "radius": radius, "mesh": [cells, cells], "mesh_shift": shift,
        "thickness": 1.0, "support": [*_EIGHTH, {"at": "edge top", "fixed": ["x", "z"]}],
        "probe": [{"name": name, "at": f"vertex {k}"} for k, name in enumerate("AB", 1)],
    }  # fmt: skip
    load = {"name": "force", "at": "vertex 1", "force": [0.0, 0.0, -3000.0]}
    solve = {"method": "arc-length", "end_time": 1.0}
    save = {"interval": 0.1, "channels": ["point.*.displacement"]}
    _, found, text = solved(case_of(sheet, {"young": 30e3, "poisson": 0.3}, load, solve=solve, save=save), folder)
    return _loads(folder / "run")[0] / 3000.0, {"A": -found["A"][:, 2], "B": found["B"][:, 0]}, text


def _loads(folder: Path) -> np.ndarray:
    """Size and displacement of the load along the path."""
    with (folder / "load.csv").open(encoding="utf-8") as file:
        rows = np.array([[float(value) for value in row] for row in list(csv.reader(file))[1:]])
    return rows[:, -2:].T


def _at_load(force: np.ndarray, way: np.ndarray, part: float) -> float:
    """Displacement where the force last rises above a part of the largest."""
    k = int(np.flatnonzero(force[:-1] < part)[-1])
    return float(np.interp(part, force[k : k + 2], way[k : k + 2]))


def hinged_roof(place: Place) -> Iterator[Check]:
    """Cylindrical roof on hinges with a force at its crown: through limit points by arc length; a quarter of it."""
    known = {12.7: [("highest force", 11.293, 0.7421)]}
    known[6.35] = [("highest force", 12.892, 0.1953), ("lowest force", 15.778, -0.1288)]
    curves, points, rows, sizes = {}, {}, [], (6, 9, 12)
    for thickness, values in known.items():
        begun = time.process_time()
        found = [_roof(thickness, (cells, cells), place.out) for cells in sizes]
        text = f"{len(found[-1][0])} points, {time.process_time() - begun:.1f} s for three meshes"
        curves[f"{thickness:g} m"] = found[-1][::-1]
        points[f"{thickness:g} m, Sze"] = ([at for _, at, _ in values], [reference for *_, reference in values])
        turns = np.array([_turns(*path)[: len(values)] for path in found])
        for k, (name, _, reference) in enumerate(values):
            rate = order_of_values(sizes, turns[:, k].tolist())
            rows.append((name, f"thickness {thickness:g}, 12 x 12", float(turns[-1, k]), reference, f"{rate}, {text}"))
    picture = beside(place.out / "hinged_roof.png", curves, points, "displacement of the crown (m)", "force over 3000 N")
    for name, what, value, reference, text in rows:
        yield against(name, what, value, reference, SZE, picture, rtol=5e-3, detail=text)


def _turns(force: np.ndarray, way: np.ndarray) -> list[float]:
    """Forces at the limit points of a path."""
    change = np.diff(force)
    found = []
    for at in (np.flatnonzero(change[:-1] * change[1:] < 0.0) + 1).tolist():
        fit = np.polyfit(way[at - 1 : at + 2], force[at - 1 : at + 2], 2)
        found.append(float(fit[2] - fit[1] ** 2 / (4.0 * fit[0])))
    return found


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
    data = case_of(sheet, {"young": 3102.75, "poisson": 0.3}, load, solve=solve, save={"interval": 0.1})
    fsm.load(data, folder=folder).run(folder / f"roof_{thickness:g}", figures=False)
    force, way = _loads(folder / f"roof_{thickness:g}")
    return force / 750.0, way
