"""Natural modes and relaxed states of rigid sheets, against the motion of a Miura sheet with its single degree of freedom.

Vertices as functions of the fold angle t (Schenk and Guest 2013), with one facet held. Creases have the energy
sum k L (angle - rest)^2/2, facets the kinetic energy of plates, from
the velocities of their corners and of their normal.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from scipy.optimize import brentq

import fsm

A, B, SECTOR, THICKNESS, DENSITY, STIFFNESS = 0.1, 0.08, math.radians(60.0), 1e-3, 1000.0, 0.1


def vertices(t: float, n: int) -> np.ndarray:
    """Vertices (n + 1, n + 1, 3) of n x n facets; the first facet stays in the plane of x and y."""
    x, shift = width(t), B / math.sqrt(1.0 + (math.cos(t) * math.tan(SECTOR)) ** 2)
    y, z = A * math.sqrt(1.0 - (math.sin(t) * math.sin(SECTOR)) ** 2), A * math.sin(t) * math.sin(SECTOR)
    at = np.array([[[i * x, j * y + shift * (i % 2), z * (j % 2)] for j in range(n + 1)] for i in range(n + 1)])
    along, other = at[1, 0] - at[0, 0], at[0, 1] - at[0, 0]
    first = along / np.linalg.norm(along)
    normal = np.cross(first, other) / np.linalg.norm(np.cross(first, other))
    return (at - at[0, 0]) @ np.array([first, np.cross(normal, first), normal]).T


def normals(at: np.ndarray) -> np.ndarray:
    found = np.cross(at[1:, :-1] - at[:-1, :-1], at[:-1, 1:] - at[:-1, :-1])
    return np.asarray(found / np.linalg.norm(found, axis=2)[..., None])


def angles(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fold angles of the creases of length A, and of length B."""
    n = normals(at)
    return tuple(  # type: ignore[return-value]
        np.arctan2(np.linalg.norm(np.cross(one, two), axis=2), np.sum(one * two, axis=2))
        for one, two in ((n[:-1], n[1:]), (n[:, :-1], n[:, 1:]))
    )


def width(t: float) -> float:
    """Width of a column of facets along x, with the fold lines along y."""
    return B * math.cos(t) * math.tan(SECTOR) / math.sqrt(1.0 + (math.cos(t) * math.tan(SECTOR)) ** 2)


def rate(function: object, t: float) -> np.ndarray:
    """Derivative by central differences, extrapolated."""
    coarse, fine = ((function(t + h) - function(t - h)) / (2.0 * h) for h in (2e-3, 1e-3))  # type: ignore[operator]
    return np.asarray((4.0 * fine - coarse) / 3.0)


def squared(t: float, n: int) -> float:
    """omega^2 of the folding motion, rad^2/s^2."""
    stiffness = sum(
        STIFFNESS * length * np.sum(rate(lambda s, k=k: angles(vertices(s, n))[k], t) ** 2) for k, length in ((0, A), (1, B))
    )
    v, spin = rate(lambda s: vertices(s, n), t), rate(lambda s: normals(vertices(s, n)), t)
    mass = DENSITY * THICKNESS * A * B * math.sin(SECTOR)
    twice = mass * THICKNESS**2 / 12.0 * np.sum(spin**2)
    for i, j in product(range(n), range(n)):
        corners = v[i, j], v[i + 1, j], v[i + 1, j + 1], v[i, j + 1]
        for three in (corners[:3], (corners[0], *corners[2:])):
            twice += 0.5 * mass / 12.0 * (sum(one @ one for one in three) + sum(three) @ sum(three))
    return float(stiffness / twice)


def solved(n: int, fold: float, supports: list[dict[str, object]], step: dict[str, object], **keys: object) -> fsm.Result:
    sheet = {
        "kind": "miura", "columns": n, "rows": n, "a": A, "b": B, "sector_angle": SECTOR, "fold_angle": fold,
        "facets": "rigid", "thickness": THICKNESS, "support": supports,
    }  # fmt: skip
    case = {
        "sheet": sheet, "material": {"young": 3e9, "density": DENSITY}, "crease": {"stiffness_per_length": STIFFNESS},
        "step": [{"name": "step", **step}], **keys,
    }  # fmt: skip
    return fsm.load(case).run(figures=False)


@pytest.mark.parametrize(("n", "fold"), [(2, 35.0), (6, 20.0), (4, 0.5)])
def test_folding_frequency(n: int, fold: float) -> None:
    """The sheet has one mode only, also near the flat state, where springs of joints are much too soft."""
    modes = solved(n, math.radians(fold), [{"at": "facet 1"}], {"kind": "modes", "modes": 4}).solution.modes
    assert modes is not None and len(modes.frequency) == 1
    assert (2.0 * math.pi * modes.frequency[0]) ** 2 == pytest.approx(squared(math.radians(fold), n), rel=1e-8)


def test_a_free_sheet_has_six_rigid_motions_and_the_folding_mode() -> None:
    """Rigid motions have no stiffness, so the shift of the inverse iterations must not be one of them."""
    modes = solved(3, 0.6, [], {"kind": "modes", "modes": 9}).solution.modes
    assert modes is not None and len(modes.frequency) == 7
    assert np.abs(modes.frequency[:6] / modes.frequency[6]).max() ** 2 < 1e-8  # round-off of springs 1e7 times as stiff


def test_a_relaxed_sheet_hangs_in_equilibrium() -> None:
    """The sheet is held along its left edge line, and gravity acts along x: dV/dt = 0 for the fold angle t."""
    n, fold, g = 2, 0.6, 5.0
    mass, rest = DENSITY * THICKNESS * A * B * math.sin(SECTOR), angles(vertices(fold, n))

    def slope(t: float) -> float:
        work = mass * g * n * sum(i + 0.5 for i in range(n)) * rate(width, t)
        now = angles(vertices(t, n))
        moments = sum(
            STIFFNESS * length * np.sum((now[k] - rest[k]) * rate(lambda s, k=k: angles(vertices(s, n))[k], t))
            for k, length in ((0, A), (1, B))
        )
        return float(moments - work)

    supports: list[dict[str, object]] = [
        {"at": "edge left", "fixed": ["x"]}, {"at": "vertex 1", "fixed": ["y", "z"]}, {"at": "vertex 3", "fixed": ["z"]},
    ]  # fmt: skip
    found = solved(n, fold, supports, {"kind": "relax"}, gravity=[g, 0.0, 0.0]).shape[-1][..., 0].max()
    exact = n * width(float(brentq(slope, 0.1, 1.0, xtol=1e-14)))
    assert found == pytest.approx(exact, rel=1e-11)
    assert abs(exact / (n * width(fold)) - 1.0) > 1e-3
