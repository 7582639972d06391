"""Random flexible facets: errors due to the mesh, of loaded plates, booms, natural frequencies and driven sheets."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from validation.errors.coverage import Kind, Number
from validation.errors.runs import numbers

__all__ = ["KINDS", "plate"]

_FINER = 3


def plate(random: np.random.Generator, bent: bool = False) -> dict[str, Any]:
    """Plate on one clamped edge, or on simple supports, flat or bent to a cylinder."""
    length = float(random.uniform(0.1, 0.4))
    width = length * float(random.uniform(0.4, 1.0))
    thickness = length * float(10.0 ** random.uniform(-3.0, -2.0))
    sheet: dict[str, Any] = {
        "kind": "plate", "length": length, "width": width, "thickness": thickness, "facets": "flexible",
        "mesh": [int(random.integers(4, 11)), int(random.integers(3, 8))],
        "probe": [{"name": "tip", "at": "vertex 3"}],
    }  # fmt: skip
    if bent:
        sheet["radius"] = width * float(random.uniform(0.4, 1.5))
    if random.random() < 0.6:
        sheet["support"] = [{"at": "edge left", "clamped": True}]
    else:
        sheet["support"] = [{"at": "edge left"}, {"at": "edge right", "fixed": ["z"]}]
    return {
        "sheet": sheet,
        "material": {"young": 70e9, "poisson": float(random.uniform(0.0, 0.45)), "density": 2700.0, "damping": 0.0},
    }


def _bending(tables: dict[str, Any]) -> float:
    sheet, material = tables["sheet"], tables["material"]
    return float(material["young"] * sheet["thickness"] ** 3 / 12.0)


def _finer(tables: dict[str, Any]) -> dict[str, Any]:
    return {"sheet.mesh": [_FINER * count for count in tables["sheet"]["mesh"]]}


def _loaded(random: np.random.Generator, bent: bool) -> Iterator[Number]:
    tables = plate(random, bent)
    length = tables["sheet"]["length"]
    size = _bending(tables) / length**2 * float(10.0 ** random.uniform(-1.0, 0.7))
    edge = "edge right" if tables["sheet"]["support"][0].get("clamped") else "edge top"
    tables["load"] = [{"name": "push", "at": edge, "force_per_length": [0.0, 0.0, size]}]
    tables["solve"] = {"method": "static", "end_time": 1.0}
    tables["save"] = {"interval": 0.1}
    yield from numbers(tables, "mesh", _finer(tables))


def _flat(random: np.random.Generator) -> Iterator[Number]:
    yield from _loaded(random, False)


def _bent(random: np.random.Generator) -> Iterator[Number]:
    yield from _loaded(random, True)


def _frequencies(random: np.random.Generator) -> Iterator[Number]:
    tables = plate(random, bool(random.random() < 0.3))
    tables["step"] = [{"name": "modes", "kind": "modes", "modes": 6}]
    yield from numbers(tables, "mesh", _finer(tables))


def _folded(random: np.random.Generator) -> Iterator[Number]:
    a = float(random.uniform(0.02, 0.05))
    thickness = a * float(10.0 ** random.uniform(-2.3, -1.7))
    tables: dict[str, Any] = {
        "sheet": {
            "kind": "miura", "columns": 2, "rows": 2, "a": a, "b": a * float(random.uniform(0.8, 1.3)),
            "sector_angle": f"{random.uniform(50.0, 75.0)} deg", "fold_angle": f"{random.uniform(35.0, 60.0)} deg",
            "facets": "flexible", "mesh_size": a / float(random.uniform(1.5, 3.2)), "thickness": thickness,
            "support": [{"at": "edge left"}],
        },
        "material": {"young": 3e9, "poisson": 0.3, "density": 1200.0},
        "crease": {"stiffness_per_length": 3e9 * thickness**3 / 12.0 / a * float(10.0 ** random.uniform(-1.0, 0.5))},
        "drive": [{"edge": "right", "direction": [-1, 0, 0], "guide": False, "speed": a, "travel": 0.1 * a}],
        "solve": {"method": "static"},
        "save": {"every": 0.01 * a},
    }  # fmt: skip
    yield from numbers(tables, "mesh", {"sheet.mesh_size": tables["sheet"]["mesh_size"] / _FINER})


KINDS = {
    "flat plates": Kind("mesh of loaded plates", _flat),
    "bent plates": Kind("mesh of loaded cylindrical panels", _bent),
    "plate modes": Kind("mesh of natural frequencies of plates", _frequencies),
    "folded sheets": Kind("mesh of compressed Miura sheets of flexible facets", _folded),
}
