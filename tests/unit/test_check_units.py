"""Units of `fsm check` for structures of any size."""

from __future__ import annotations

import re
from typing import Any

import pytest

from fsm.case.models.case import Case
from fsm.check.report import describe

MATERIAL = {"young": "3 GPa", "poisson": 0.3, "density": 1000.0}
CREASE = {"stiffness_per_length": 1e-3}


def strip(size: float) -> dict[str, Any]:
    drive = [{"crease": 2, "direction": [0, 0, 1], "speed": 0.01 * size, "travel": 0.2 * size}]
    outline = {"length": size, "width": 0.1 * size, "thickness": 1e-3 * size, "panels": 4, "fold_angle": "70 deg"}
    friction = {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": 0.001 * size, "v_dynamic": 0.01 * size}
    return {"strip": outline, "material": MATERIAL, "crease": {"law": "linear", "stiffness": 1e-3}, "drive": drive,
            "contact": {"stiffness": 1e9}, "friction": friction, "save": {"every": 0.01 * size}}  # fmt: skip


def sheet(size: float, **keys: Any) -> dict[str, Any]:
    sides = {"kind": "miura", "columns": 2, "rows": 2, "a": size, "b": size, "sector_angle": "60 deg"}
    supports = [{"at": "edge left", "fixed": ["x", "y", "z"]}]
    sheet = {**sides, "fold_angle": "40 deg", "thickness": 1e-3 * size, "support": supports, **keys}
    drive = [{"at": "edge right", "direction": [1, 0, 0], "speed": 0.01 * size, "travel": 0.1 * size}]
    return {"sheet": sheet, "material": MATERIAL, "crease": CREASE, "drive": drive}


def boom(size: float) -> dict[str, Any]:
    section = {"kind": "tape-spring", "length": 5 * size, "radius": size, "subtended_angle": "100 deg", "mesh": [4, 2]}
    sheet = {**section, "thickness": 0.01 * size, "facets": "flexible"}
    sheet["support"] = [{"at": "edge left", "fixed": ["x", "y", "z"]}]
    drive = [{"at": "edge right", "direction": [0, 0, 1], "speed": 0.01 * size, "travel": 0.1 * size}]
    return {"sheet": sheet, "material": MATERIAL, "drive": drive}


def scene(size: float) -> dict[str, Any]:
    plate = {"length": size, "width": size, "thickness": 0.01 * size}
    bodies = [
        {"name": f"plate {k}", "plate": plate, "mass": 1e3 * size**3, "position": [0, 0, k * size],
         "inertia": [size**5] * 3, "velocity": [0.1 * size, 0, 0]}
        for k in (1, 2)
    ]  # fmt: skip
    film = {"name": "film", "length": size, "width": size, "thickness": 1e-4 * size, "mesh": [2, 2], "young": "3 GPa",
            "density": 1e3, "strain": [1e-3, 1e-3], "position": [0, 0, 0], "held": ["left"]}  # fmt: skip
    return {"scene": {"bodies": bodies, "films": [film]}, "solve": {"end_time": 1.0}}


CASES = {
    "strip": strip, "sheet": sheet, "bars": lambda size: sheet(size, facets="bars"),
    "flexible": lambda size: sheet(size, facets="flexible", mesh_size=size), "boom": boom, "scene": scene,
}  # fmt: skip


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
@pytest.mark.parametrize("kind", CASES)
def test_lengths_have_units_of_their_size(kind: str, size: float) -> None:
    text = "\n".join(describe(Case.model_validate(CASES[kind](size))))
    numbers = [float(number) for number, _ in re.findall(r"(?<![\w.^])([\d.]+(?:e[+-]\d+)?) (km|m|mm|um|nm)(?![\w^])", text)]
    assert len(numbers) > 3, text
    assert all(number == 0.0 or 5e-3 <= number < 2e4 for number in numbers), text
