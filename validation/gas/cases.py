"""Cases of the checks of gas: discs, airbag, boxes and tubes of rigid panels."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import fsm

__all__ = ["AIR", "T0", "airbag", "balloon", "boxes", "clamped_disc", "solved", "tube"]

AIR, T0 = 287.06, 293.15
"""Gas constant, J/(kg K), and temperature, K."""
_BOX = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
_WALLS = np.array([(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])


def solved(data: Mapping[str, Any], folder: Path) -> tuple[fsm.Result, str]:
    """Result of a case, and a text on it."""
    begun = time.process_time()
    result = fsm.load(dict(data), folder=folder).run(folder / "run", figures=False)
    summary = result.summary
    return result, f"{summary['dof']} unknowns, {summary['steps']} steps, {time.process_time() - begun:.0f} s"


def clamped_disc(pressure: float, rings: int, thickness: float = 2e-5) -> dict[str, Any]:
    """Disc of radius 0.1 m with a held edge; `pressure` is p a/(E t)."""
    radius, young = 0.1, 2e9
    return {
        "sheet": {
            "kind": "plate", "facets": "flexible", "outer_radius": radius, "mesh_size": radius / rings,
            "thickness": thickness, "support": [{"at": "edge outer"}], "probe": [{"name": "top", "at": "vertex 1"}],
        },
        "material": {"young": young, "poisson": 0.3, "density": 1390.0},
        "load": [{"name": "gas", "at": "all", "pressure": pressure * young * thickness / radius}],
        "solve": {"method": "static", "end_time": 1.0, "rtol": 1e-3}, "save": {"interval": 0.5},
    }  # fmt: skip


def balloon(pressure: float, rings: int, rounding: float) -> dict[str, Any]:
    """Upper half of a balloon of two discs of radius 0.1 m; `pressure` is p a/(E t)."""
    radius, young, thickness = 0.1, 2e9, 5e-5
    rim = [[0.999 * radius, -1e-3, -1.0], [2.0 * radius, 1e-3, 1.0]]
    return {
        "sheet": {
            "kind": "plate", "facets": "flexible", "film": "tension-field", "film_rounding": rounding,
            "thickness": thickness, "outer_radius": radius, "mesh_size": radius / rings,
            "support": [{"at": "edge outer", "fixed": ["z"]}, {"at": "vertex 1", "fixed": ["x", "y"]},
                        {"at": rim, "fixed": ["y"]}],
            "probe": [{"name": "top", "at": "vertex 1"}, {"name": "rim", "at": rim}],
        },
        "material": {"young": young, "poisson": 0.3, "density": 1390.0},
        "gas": [{"closed_by": [{"axis": "z"}], "supply_pressure": pressure * young * thickness / radius}],
        "solve": {"method": "static", "end_time": 1.0}, "save": {"interval": 0.5, "channels": ["gas.*"]},
    }  # fmt: skip


def airbag(cells: int) -> dict[str, Any]:
    """Eighth of a square airbag with a diagonal of 1.2 m, 5 kPa."""
    side = 1.2 / np.sqrt(2.0) / 2.0
    return {
        "sheet": {
            "kind": "plate", "facets": "flexible", "film": "tension-field", "thickness": 0.6e-3, "length": side,
            "width": side, "mesh": [cells, cells],
            "support": [{"at": "edge left", "mirror": "x"}, {"at": "edge bottom", "mirror": "y"},
                        {"at": "edge right", "fixed": ["z"]}, {"at": "edge top", "fixed": ["z"]}],
            "probe": [{"name": "centre", "at": "vertex 1"}],
        },
        "material": {"young": 588e6, "poisson": 0.4, "density": 1000.0},
        "gas": [{"closed_by": [{"axis": axis} for axis in "xyz"], "supply_pressure": 5e3}],
        "solve": {"method": "static", "end_time": 1.0}, "save": {"interval": 0.5, "channels": ["gas.*"]},
    }  # fmt: skip


def boxes(pressures: tuple[float, float], area: float, end: float, steps: int) -> dict[str, Any]:
    """Two closed boxes of rigid panels, 1 litre each, with an orifice between them; adiabatic gas in a vacuum."""
    vertices = np.concatenate([0.1 * _BOX, 0.1 * _BOX + [1.0, 0.0, 0.0]])
    faces = np.concatenate([_WALLS, _WALLS + 8]).tolist()
    edges = sorted({tuple(sorted(pair)) for face in faces for pair in zip(face, (*face[1:], face[0]), strict=True)})
    gas = {"law": "adiabatic", "outside_pressure": 0.0}
    return {
        "sheet": {
            "vertices": vertices.tolist(), "faces": faces, "edges": [list(edge) for edge in edges], "facets": "rigid",
            "assignment": ["M"] * len(edges), "angles": [-np.pi / 2] * len(edges), "thickness": 1e-3,
            "support": [{"at": "facet 1"}, {"at": "facet 7"}],
        },
        "material": {"young": 1e9, "poisson": 0.3, "density": 1000.0},
        "crease": {"law": "linear", "stiffness_per_length": 100.0},
        "gas": [{"name": "full", "at": "facets 1, 2, 3, 4, 5, 6", "pressure": pressures[0]} | gas,
                {"name": "empty", "at": "facets 7, 8, 9, 10, 11, 12", "pressure": pressures[1]} | gas],
        "orifice": [{"between": ["full", "empty"], "area": area}],
        "solve": {"method": "static", "end_time": end, "max_step": end / steps},
        "save": {"interval": end / 20, "channels": ["gas.*"]},
    }  # fmt: skip


def tube(facets: str, gas: Mapping[str, Any], **more: Any) -> dict[str, Any]:
    """Miura tube of three columns with lids; creases of 0.1 N m/rad per m."""
    flexible = {"mesh_size": 0.05} if facets == "flexible" else {}
    return {
        "sheet": {
            "kind": "miura-tube", "columns": 3, "a": 0.05, "b": 0.04, "sector_angle": np.radians(60.0),
            "fold_angle": np.radians(20.0), "thickness": 3e-3, "facets": facets, "support": [{"at": "facet 1"}],
        } | flexible,
        "material": {"young": 1e11, "poisson": 0.3, "density": 1000.0, "damping": 0.0},
        "crease": {"law": "linear", "stiffness_per_length": 0.1},
        "gas": [{"closed_by": [{"cap": "edge left"}, {"cap": "edge right"}], "outside_pressure": 1e5} | gas],
        "solve": {"method": "static", "end_time": 1.0, "max_step": 0.01},
        "save": {"interval": 0.05, "channels": ["gas.*", "energy.*"]},
    } | more  # fmt: skip
