"""Travel at which a folded sheet is taut, against closed forms of its unfolded length."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from fsm.builders.sheet.reach import taut_travels
from fsm.case.loading.load_case import load_tables

WITHIN = 3e-3
"""Relative error of the shortest way, which has corners at a few points of each edge."""


def _case(sheet: dict[str, Any], travel: float, **drive: Any) -> Any:
    tables = {
        "sheet": {"thickness": 1e-4, "support": [{"at": "edge left", "fixed": ["x", "z"]}, {"at": "vertex 1"}], **sheet},
        "material": {"young": 3e9, "poisson": 0.3, "density": 1400.0},
        "crease": {"stiffness_per_length": 0.1},
        "drive": [{"edge": "right", "direction": [1, 0, 0], "speed": 1e-3, "travel": travel, "guide": False} | drive],
        "solve": {"method": "static"},
    }
    return load_tables(tables, (), Path("case.toml")).case


def _miura_tube(columns: int, b: float, sector: float, fold: float) -> tuple[float, float]:
    """Length at the start and unfolded, m."""
    along = math.cos(fold) * math.tan(sector)
    return columns * b * along / math.hypot(1.0, along), columns * b * math.sin(sector)


@pytest.mark.parametrize("facets", ["rigid", "bars", "flexible"])
def test_a_zigzag_is_taut_when_its_panels_are_in_line(facets: str) -> None:
    sheet = {"kind": "zigzag", "columns": 5, "a": 0.03, "b": 0.04, "fold_angle": math.radians(70.0), "facets": facets}
    mesh = {"mesh_size": 0.01} if facets == "flexible" else {}
    ((_, travel),) = taut_travels(_case(sheet | mesh, 0.05))
    assert travel == pytest.approx(0.15 * (1.0 - math.cos(math.radians(70.0))), rel=1e-12)


@pytest.mark.parametrize(("columns", "sector", "fold"), [(2, 73.0, 66.0), (3, 65.0, 68.0), (5, 50.0, 40.0)])
def test_a_miura_tube_is_taut_when_it_is_flat(columns: int, sector: float, fold: float) -> None:
    sheet = {
        "kind": "miura-tube", "columns": columns, "a": 0.021, "b": 0.027, "fold_angle": math.radians(fold),
        "sector_angle": math.radians(sector), "facets": "bars",
    }  # fmt: skip
    start, flat = _miura_tube(columns, 0.027, math.radians(sector), math.radians(fold))
    ((_, travel),) = taut_travels(_case(sheet, 0.05))
    assert -1e-12 <= travel - (flat - start) <= WITHIN * flat


def test_drives_that_cannot_stretch_a_sheet_have_no_such_travel() -> None:
    sheet = {"kind": "zigzag", "columns": 4, "a": 0.03, "b": 0.04, "fold_angle": math.radians(60.0)}
    support = [{"at": "edge left", "fixed": ["x", "z"]}]
    assert taut_travels(_case(sheet | {"support": support}, 0.02, direction=[0, 1, 0])) == []  # free along y
    ((_, pushed),) = taut_travels(_case(sheet, 0.02, direction=[-1, 0, 0]))
    assert pushed == pytest.approx(0.12 * (1.0 + math.cos(math.radians(60.0))), rel=1e-12)  # on the other side


def test_a_longer_travel_is_a_warning() -> None:
    from fsm.model.compile.compile_case import compile_planned

    sheet = {"kind": "zigzag", "columns": 5, "a": 0.03, "b": 0.04, "fold_angle": math.radians(70.0)}
    for travel, stretched in ((0.09, False), (0.11, True)):
        warnings: list[str] = []
        compile_planned(_case(sheet, travel), "case.toml", warnings)
        assert any("taut from 98.7 mm of travel on" in text for text in warnings) == stretched, warnings
