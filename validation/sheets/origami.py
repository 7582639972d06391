"""Folded sheets compared with closed forms, and bar-and-hinge models of Liu and Paulino (2017) compared with independent
programs."""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import fsm
from fsm.results.store import read_solution
from validation.gallery.drawing import beside
from validation.gallery.record import Check, Place, against

__all__ = ["kresling", "miura_bending", "miura_force", "miura_pop_through", "miura_push"]

_CASES = Path(__file__).parents[2] / "folding_cases"
_PROGRAM = "independent bar-and-hinge program, model of Liu and Paulino 2017, Proc. R. Soc. A 473, 20170348"


def miura_force(
    shortening: float, columns: int, rows: int, a: float, b: float, sector: float, start: float, stiffness: float
) -> float:
    """Force dU/dX of a Miura sheet with one degree of freedom, from the formulas of Schenk and Guest (2013)."""

    def length(fold: float) -> float:
        tangent = math.cos(fold) * math.tan(sector)
        return columns * b * tangent / math.sqrt(1.0 + tangent * tangent)

    def angles(fold: float) -> tuple[float, float]:
        flat = math.sqrt(1.0 - (math.sin(fold) * math.sin(sector)) ** 2)
        return 2.0 * fold, 2.0 * math.asin(math.sin(fold) * math.cos(sector) / flat)

    def energy(fold: float) -> float:
        lengths = columns * (rows - 1) * b, rows * (columns - 1) * a
        turned = zip(lengths, angles(fold), angles(start), strict=True)
        return 0.5 * stiffness * sum(along * (now - before) ** 2 for along, now, before in turned)

    low, high = start, 0.5 * math.pi
    for _ in range(80):
        fold = 0.5 * (low + high)
        low, high = (fold, high) if length(start) - length(fold) < shortening else (low, fold)
    weights, h = (1.0, -8.0, 8.0, -1.0), 1e-3
    places = [fold + step * h for step in (-2.0, -1.0, 1.0, 2.0)]
    slope = sum(w * energy(place) for w, place in zip(weights, places, strict=True))
    return -slope / sum(w * length(place) for w, place in zip(weights, places, strict=True))


def miura_push(place: Place) -> Iterator[Check]:
    """Pushed Miura sheet of rigid facets against its closed form (Schenk and Guest, 2013)."""
    shape = (10, 10, 2.0, 2.0, math.pi / 3.0, math.radians(15.0), 0.1)
    begun = time.process_time()
    fsm.load(_CASES / "miura_push" / "case.toml").run(place.out / "run", figures=False)
    text = f"{time.process_time() - begun:.1f} s"
    with (place.out / "run" / "force.csv").open(encoding="utf-8") as file:
        way, force = np.array([[float(value) for value in row[:2]] for row in list(csv.reader(file))[1:]]).T
    exact = np.array([miura_force(x, *shape) for x in way])
    known = {0.526119: 0.781116, 1.14675: 0.846382, 4.07405: 0.731824}
    ours, points = {"fsm": (way, force / 11.0)}, {"closed form": (list(known), list(known.values()))}
    picture = beside(place.out / "miura_push.png", ours, points, "shortening (m)", "force per vertex (N)")
    source = "closed form: dU/dX with the lengths and angles of Schenk and Guest 2013, PNAS 110, 3276"
    error = float(np.abs(force - exact).max() / exact.max())
    what = "5 x 5 cells"
    yield against("largest error over the largest force", what, error, 0.0, source, picture, atol=1e-6, detail=text)
    for at, reference in known.items():
        near = np.argsort(np.abs(way - at))[:6]
        value = float(np.polyval(np.polyfit(way[near] - at, force[near], 5), 0.0)) / 11.0
        yield against(
            f"force per vertex at {at:g} m", what, value, reference, source, picture, rtol=2e-6, unit="N", detail=text
        )


class _Path(NamedTuple):
    """Displacement and size of the load, stored energy, negative modes, limit points of a path, and a text on the run."""

    way: np.ndarray
    size: np.ndarray
    energy: np.ndarray
    modes: np.ndarray
    limits: list[dict[str, Any]]
    text: str


def _path(data: dict[str, Any] | Path, folder: Path) -> _Path:
    begun = time.process_time()
    summary = (
        fsm.load(data, **({} if isinstance(data, Path) else {"folder": folder})).run(folder / "run", figures=False).summary
    )
    text = f"{summary['dof']} unknowns, {summary['newton_iterations']} iterations, {time.process_time() - begun:.1f} s"
    solution = read_solution(folder / "run" / "result.h5")
    energy = np.asarray(solution.energy["bars"]) + np.asarray(solution.energy["creases"])
    path = solution.load_path
    assert path is not None
    limits = summary["step"][0]["limit_points"]
    return _Path(path.way[:, 0], path.size[:, 0], energy, path.negative_modes, limits, text)


def _bars(fold_angle: str, support: list[dict[str, Any]], loaded: tuple[int, ...]) -> dict[str, Any]:
    """Miura sheet of bars and hinges with a unit force on some vertices."""
    ramp = {"kind": "ramp", "end": "1 s", "shape": "unbounded"}
    return {
        "sheet": {
            "kind": "miura", "columns": 10, "rows": 10, "a": 2.0, "b": 2.0, "sector_angle": "60 deg", "facets": "bars",
            "bars": {"young": 1e4, "area": 0.1, "law": "ogden"}, "bend_stiffness_per_length": 1.0, "thickness": "1 mm",
            "fold_angle": fold_angle, "support": support,
        },
        "material": {"young": 1e4, "density": 1000}, "crease": {"stiffness_per_length": 0.1},
        "solve": {"method": "arc-length", "end_time": "6 s"},
        "load": [{"at": f"vertex {k}", "force": [0, 0, -1], "time": ramp} for k in loaded],
    }  # fmt: skip


def miura_bending(place: Place) -> Iterator[Check]:
    """Miura sheet of bars and hinges, bent by forces at two corners."""
    support = [{"at": "vertex 56", "fixed": ["x"]}, {"at": "vertex 57"}, {"at": "vertex 65", "fixed": ["x", "z"]}]
    path = _path(_bars("54.7356 deg", support, (56, 66)), place.out)
    known = {0.1: 0.2645, 0.2: 0.6591, 0.3: 1.3043, 0.4: 2.5431, 0.5: 5.816}
    points = {"independent program": (list(known), list(known.values()))}
    picture = beside(
        place.out / "miura_bending.png", {"fsm": (path.way, path.size)}, points, "displacement (m)", "load factor"
    )
    for at, reference in known.items():
        near = np.argsort(np.abs(path.way - at))[:4]
        value = float(np.polyval(np.polyfit(path.way[near] - at, path.size[near], 3), 0.0))
        yield against(f"load factor at {at:g} m", "", value, reference, _PROGRAM, picture, rtol=1e-3, detail=path.text)


def miura_pop_through(place: Place) -> Iterator[Check]:
    """Miura sheet of bars and hinges, pushed through at its middle: limit point and snap-back."""
    support = [
        {"at": "vertex 1"}, {"at": "vertices 3, 5, 7, 9, 11", "fixed": ["x", "z"]},
        {"at": "vertex 111", "fixed": ["y", "z"]}, {"at": "vertices 113, 115, 117, 119, 121", "fixed": ["z"]},
    ]  # fmt: skip
    path = _path(_bars("30 deg", support, (61,)), place.out)
    back = int(np.flatnonzero(np.diff(path.way) < 0.0)[0])
    near = slice(back - 2, back + 3)
    turn = np.polyfit(path.size[near] - path.size[back], path.way[near], 4)
    roots = np.roots(np.polyder(turn))
    load = float(roots[np.argmin(np.abs(roots))].real)
    first = path.limits[0]
    found = {
        "limit load": (first["program_time"], 2.312),
        "displacement at the limit": (next(iter(first["loads"].values()))["displacement"], 0.941),
        "largest displacement before the snap-back": (float(np.polyval(turn, load)), 1.373),
        "load there": (float(path.size[back] + load), 0.781),
    }
    points = {"independent program": ([0.941, 1.373], [2.312, 0.781])}
    curves = {"fsm": (path.way, path.size)}
    picture = beside(place.out / "miura_pop_through.png", curves, points, "displacement (m)", "load factor")
    for name, (value, reference) in found.items():
        yield against(name, "", float(value), reference, _PROGRAM, picture, rtol=1e-3, detail=path.text)


def kresling(place: Place) -> Iterator[Check]:
    """Kresling tube of bars and hinges: limit point, barrier, minimum and second stable state."""
    path = _path(_CASES / "kresling" / "case.toml", place.out)
    way, energy = path.way, path.energy
    top = int(np.argmax(np.where(way < 0.6, energy, 0.0)))
    barrier = np.polyfit(way[top - 1 : top + 2] - way[top], energy[top - 1 : top + 2], 2)
    off = -0.5 * barrier[1] / barrier[0]
    second = int(np.flatnonzero((way > 0.7) & (path.size > 0.0))[0])
    pair = slice(second - 1, second + 1)
    well = float(np.interp(0.0, path.size[pair], way[pair]))
    high, low = (next(iter(limit["loads"].values())) for limit in path.limits[:2])
    found = {
        "limit load of a vertex": (high["size"] / 8.0, 0.43230),
        "displacement at the limit": (high["displacement"], 0.12376),
        "energy of the barrier": (float(np.polyval(barrier, off)), 0.86199),
        "displacement at the barrier": (way[top] + off, 0.42884),
        "smallest load of a vertex": (low["size"] / 8.0, -0.10213),
        "displacement at the smallest load": (low["displacement"], 0.6406),
        "displacement of the second stable state": (well, 0.9525),
        "energy of the second stable state": (float(np.interp(well, way[pair], energy[pair])), 0.57946),
        "negative modes at the barrier": (path.modes[top], 4.0),
    }
    points = {"independent program": ([0.12376, 0.42884, 0.6406, 0.9525], [0.43230, 0.0, -0.10213, 0.0])}
    ours = {"fsm": (way, path.size / 8.0)}
    picture = beside(place.out / "kresling.png", ours, points, "displacement (m)", "load of a vertex (N)")
    for name, (value, reference) in found.items():
        yield against(name, "", float(value), reference, _PROGRAM, picture, rtol=1e-3, detail=path.text)
