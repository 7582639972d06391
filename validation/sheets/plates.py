"""Plates: natural frequencies, a patch test, and rigid motions."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import eigh

import fsm
from validation.gallery.drawing import convergence
from validation.gallery.record import Check, Place, against
from validation.sheets.shells import order

__all__ = ["plates"]


def plates(place: Place) -> Iterator[Check]:
    """Natural frequencies of square plates: one edge clamped, all simply supported, and free."""
    edges = ("left", "right", "bottom", "top")
    clamped = [{"at": "edge left", "clamped": True}]
    simple = [{"at": f"edge {edge}"} for edge in edges]
    pi2 = math.pi**2
    known = {
        "clamped at one edge": (clamped, _cantilever_plate(5), "Ritz's method with 144 polynomials"),
        "simply supported": (simple, [2 * pi2, 5 * pi2, 5 * pi2, 8 * pi2], "closed form"),
    }
    plate = 70e9 * 0.01**3 / (12.0 * 0.91)
    unit = math.sqrt(plate / 27.0) / (2.0 * math.pi)
    meshes = ((10, 0.0), (20, 0.0), (40, 0.0), (40, 0.3))
    errors: dict[str, list[float]] = {}
    rows = []
    for name, (support, reference, source) in known.items():
        for cells, shift in meshes:
            begun = time.process_time()
            found = _frequencies(support, cells, shift, place.out) / unit
            off = [float(found[k] / exact - 1.0) for k, exact in enumerate(reference)]
            if not shift:
                errors.setdefault(name, []).append(max(map(abs, off)))
            if cells == 40:
                what = f"{name}, {cells} x {cells}{', random' if shift else ''}"
                text = f"{order((10, 20, 40), errors[name])} of the largest error, {time.process_time() - begun:.1f} s"
                rows += [(k, what, float(found[k]), exact, source, text) for k, exact in enumerate(reference)]
    picture = convergence(place.out / "plates.png", (10, 20, 40), errors, 2, x="cells a side")
    for k, what, value, exact, source, text in rows:
        yield against(f"mode {k + 1}, omega a^2 sqrt(m/D)", what, value, exact, source, picture, rtol=1e-3, detail=text)
    free = _frequencies([], 16, 0.3, place.out) / unit
    rigid = float(np.abs(free[:6]).max())
    yield against("six modes of a free plate", "16 x 16, random", rigid, 0.0, "rigid motions", picture, atol=1e-3)
    for kind, value in _patches(place.out).items():
        what = "6 x 4 cells, inner nodes moved by up to 40 % of a cell"
        yield against(
            f"patch test, {kind}: displacement over the exact one", what, value, 1.0, "closed form", picture, rtol=1e-5
        )


def _patches(folder: Path) -> dict[str, float]:
    """End displacement over the exact one of a random mesh, under uniform tension and under uniform bending."""
    length, width, thickness, young = 1.5, 1.0, 0.01, 70e9
    strain, turn = 1e-6, 1e-4
    section = width * thickness
    tension = {"at": "edge right", "force": [young * section * strain, 0.0, 0.0]}
    bending = {"at": "edge right", "moment": [0.0, -young * section * thickness**2 / 12.0 * turn / length, 0.0]}
    free = [{"at": "edge left", "fixed": ["x"]}, {"at": "vertex 1"}, {"at": "vertex 4", "fixed": ["z"]}]
    free += [{"at": "vertex 2", "fixed": ["z"]}]
    found = {}
    for name, poisson, support, load, axis, exact in (
        ("uniform tension", 0.3, free, tension, 0, strain * length),
        ("uniform bending", 0.0, [{"at": "edge left", "clamped": True}], bending, 2, 0.5 * turn * length),
    ):
        sheet = {
            "kind": "plate", "facets": "flexible", "length": length, "width": width, "mesh": [6, 4], "mesh_shift": 0.4,
            "thickness": thickness, "support": support, "probe": [{"name": "end", "at": "vertex 2"}],
        }  # fmt: skip
        data = {
            "sheet": sheet, "material": {"young": young, "poisson": poisson, "density": 2700.0}, "load": [load],
            "solve": {"method": "static", "end_time": 1.0, "rtol": 1e-9},
        }  # fmt: skip
        result = fsm.load(data, folder=folder).run(folder / "patch", figures=False)
        found[name] = float(result.summary["probe_displacement"]["end"][axis]) / exact
    return found


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
