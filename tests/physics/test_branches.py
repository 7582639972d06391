"""Branches of paths by arc length after a bifurcation."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import fsm
from fsm.errors import CaseError

LENGTH, WIDTH, THICK, YOUNG = 0.2, 0.01, 1e-3, 70e9
CRITICAL = math.pi**2 * YOUNG * WIDTH * THICK**3 / 12.0 / (4.0 * LENGTH**2)


def strut(branch: int | None, method: str = "arc-length") -> dict[str, Any]:
    """Strip of flexible facets, clamped at one end and pressed at the other by 1.2 times Euler's load."""
    solve: dict[str, Any] = {"method": method, "end_time": 1.0}
    return {
        "sheet": {
            "kind": "plate", "length": LENGTH, "width": WIDTH, "thickness": THICK, "facets": "flexible", "mesh": [16, 1],
            "support": [{"at": "edge left", "clamped": True}], "probe": [{"name": "tip", "at": "vertex 2"}],
        },
        "material": {"young": YOUNG, "poisson": 0.0, "density": 2700.0},
        "load": [{"name": "end", "at": "edge right", "force": [-1.2 * CRITICAL, 0.0, 0.0]}],
        "solve": solve if branch is None else solve | {"branch": branch}, "save": {"interval": 0.5},
    }  # fmt: skip


def tip(branch: int | None, folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacement of the tip; load over Euler's load and displacement of the load along the path."""
    summary = fsm.load(strut(branch), folder=folder).run(folder / "out", figures=False).summary
    with (folder / "out" / "load.csv").open(encoding="utf-8") as file:
        rows = np.array([[float(value) for value in row] for row in list(csv.reader(file))[1:]])
    assert summary["energy_error"] < 1e-3
    return np.array(summary["probe_displacement"]["tip"]), rows[:, -2] / CRITICAL, rows[:, -1]


def test_strut_follows_either_branch(tmp_path: Path) -> None:
    """Buckling at Euler's load, then the elastica: P/P_cr = (2 K/pi)^2, w/L = 2 k/K, u/L = 2 (E/K - 1)."""
    modulus = brentq(lambda k: (2.0 * ellipk(k * k) / math.pi) ** 2 - 1.2, 0.01, 0.9)
    first, second = ellipk(modulus**2), ellipe(modulus**2)
    exact = 2.0 * LENGTH * np.array([second / first - 1.0, 0.0, modulus / first])
    one, load, way = tip(1, tmp_path)
    other = tip(-1, tmp_path)[0]
    np.testing.assert_allclose(np.abs(one), np.abs(exact), rtol=5e-3, atol=1e-4)
    assert one[2] * other[2] < 0.0
    np.testing.assert_allclose(np.abs(other), np.abs(one), rtol=1e-3, atol=1e-5)
    left = int(np.argmax(way > 1e-4 * LENGTH))
    assert load[left] == pytest.approx(1.0, rel=5e-3)


def test_primary_path_goes_straight_on(tmp_path: Path) -> None:
    found, load, way = tip(None, tmp_path)
    assert abs(found[2]) < 1e-9
    assert load[-1] == pytest.approx(1.2)
    assert way[-1] < 1e-5 * LENGTH


def test_other_methods_have_no_branch() -> None:
    with pytest.raises(CaseError, match='is used by method = "arc-length" only'):
        fsm.load(strut(1, "static"), folder=Path.cwd()).check()
