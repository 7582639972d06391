"""Random strips that are pulled slowly: errors of peak and last force due to the segments, with and without snaps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from validation.errors.coverage import Kind, Number
from validation.errors.runs import numbers

__all__ = ["KINDS"]

_FINER = 2


def _strip(random: np.random.Generator, panels: int, angle: float, thickness: float, segments: int) -> dict[str, Any]:
    """Strip without contact and without a drive; `angle` in degrees."""
    panel, width = float(random.uniform(0.02, 0.1)), float(random.uniform(0.01, 0.1))
    young = float(10.0 ** random.uniform(8.7, 11.3))
    bending = young * width * thickness**3 / 12.0
    return {
        "strip": {
            "length": panels * panel, "width": width, "thickness": thickness, "panels": panels,
            "fold_angle": f"{angle:.1f} deg", "segments_per_panel": segments,
        },
        "material": {"young": young, "poisson": 0.3, "density": 1200.0 if young < 1e10 else 2700.0},
        "crease": {"law": "linear", "stiffness": bending / panel * float(10.0 ** random.uniform(-0.7, 1.0))},
        "solve": {"method": "static"},
    }  # fmt: skip


def _pull_middle(tables: dict[str, Any], part: float) -> None:
    """Pull the middle crease away from the other creases, over a part of the height of the folds."""
    strip = tables["strip"]
    crease, panel = strip["panels"] // 2, strip["length"] / strip["panels"]
    up = 1.0 if crease % 2 else -1.0
    tables["drive"] = [{"crease": crease, "direction": [0.0, 0.0, up], "travel": part * panel, "speed": 1e-3}]


def _finer(tables: dict[str, Any]) -> dict[str, Any]:
    return {"strip.segments_per_panel": _FINER * tables["strip"]["segments_per_panel"]}


def _any(random: np.random.Generator) -> Iterator[Number]:
    """Strip pulled at its end or its middle crease, with and without contact, friction and gravity."""
    panels, angle = int(random.integers(2, 11)), float(random.uniform(55.0, 88.0))
    tables = _strip(random, panels, angle, float(10.0 ** random.uniform(-4.3, -3.4)), int(random.integers(10, 31)))
    if panels > 5 and random.random() < 0.6:
        _pull_middle(tables, float(random.uniform(0.1, 0.9)))
    else:
        travel = float(random.uniform(0.15, 0.8)) * tables["strip"]["length"] * (1.0 - np.cos(np.radians(angle)))
        tables["drive"] = [{"end": "last", "direction": [1.0, 0.0, 0.0], "travel": travel, "speed": 1e-3}]
    contact, friction, gravity = random.random(3) < (0.7, 0.35, 0.4)
    if contact:
        tables["contact"] = {}
    if contact and friction:
        tables["friction"] = {"mu_static": 0.3, "mu_dynamic": 0.25, "v_static": 1e-4, "v_dynamic": 1e-3}
    if gravity:
        tables["gravity"] = [0.0, 0.0, -9.81]
    yield from numbers(tables, "mesh", _finer(tables))


def _snapping(random: np.random.Generator) -> Iterator[Number]:
    """Steep strip with contact, pulled at its middle crease; only cases with snaps or bifurcations give numbers."""
    angle, thickness = float(random.uniform(83.0, 88.0)), float(random.uniform(1e-4, 3e-4))
    tables = _strip(random, int(random.integers(6, 10)), angle, thickness, int(random.integers(8, 15)))
    tables["contact"] = {}
    _pull_middle(tables, float(random.uniform(0.1, 0.5)))
    yield from numbers(tables, "mesh", _finer(tables), snaps=True)


KINDS = {
    "strips": Kind("segments of strips that are pulled slowly", _any),
    "strips that snap": Kind("segments of strips that snap", _snapping),
}
