"""Comparison of several results: numbers that differ between their cases, named results, and overlaid curves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fsm.results.solution import Solution
from fsm.views.report.packing import pack_doubles, pack_floats
from fsm.views.report.plots import decimated, travel_scale
from fsm.views.report.tables import key_results

_UNIT_ENDINGS = {
    "travel": ("mm", 1e3),
    "length": ("mm", 1e3),
    "width": ("mm", 1e3),
    "thickness": ("mm", 1e3),
    "angle": ("deg", 180.0 / math.pi),
}
_SKIPPED = ("save", "expect", "title")
_OVERLAY_POINTS = 1200


def comparison(solutions: Mapping[str, Solution]) -> dict[str, Any] | None:
    """Table of the results by name, and their curves over travel; None for a single result."""
    if len(solutions) < 2:
        return None
    inputs = _differences([solution.layout.case for solution in solutions.values()])
    outputs = [key_results(solution.summary) for solution in solutions.values()]
    names = list(dict.fromkeys(name for row in outputs for name in row))
    columns = [{"name": name, "unit": unit, "values": values, "input": True} for name, unit, values in inputs]
    for name in names:
        unit = next(row[name][1] for row in outputs if name in row)
        columns.append(
            {
                "name": name,
                "counter": name in ("degrees of freedom", "steps of the solver"),
                "unit": unit,
                "values": [row[name][0] if name in row else None for row in outputs],
                "input": False,
            }
        )
    return {"names": list(solutions), "columns": columns, "overlay": _overlay(solutions)}


def _differences(cases: Sequence[dict[str, Any]]) -> list[tuple[str, str, list[Any]]]:
    """Keys of the cases with values that differ: dotted path, unit and values."""
    flat = [_flat(case) for case in cases]
    found = []
    for path in dict.fromkeys(path for one in flat for path in one):
        values = [one.get(path) for one in flat]
        if path.partition(".")[0] in _SKIPPED or all(value == values[0] for value in values):
            continue
        numbers = all(
            isinstance(value, int | float) and not isinstance(value, bool) for value in values if value is not None
        )
        unit, factor = _unit(path) if numbers else ("", 1.0)
        found.append((path, unit, [_shown(value, factor) for value in values]))
    return found


def _shown(value: Any, factor: float) -> Any:
    if value is None or isinstance(value, bool):
        return None if value is None else str(value)
    return factor * value if isinstance(value, int | float) else str(value)


def _flat(item: Any, path: str = "") -> dict[str, Any]:
    """Values of a nested case by dotted path; long lists of numbers are left out."""
    if isinstance(item, dict):
        return {
            key: value
            for name, inner in item.items()
            for key, value in _flat(inner, f"{path}.{name}" if path else name).items()
        }
    if isinstance(item, list):
        if len(item) > 12:
            return {path: f"list of {len(item)}, {hash(str(item)) & 0xFFFF:04x}"}
        return {key: value for k, inner in enumerate(item) for key, value in _flat(inner, f"{path}.{k}").items()}
    return {path: item}


def _unit(path: str) -> tuple[str, float]:
    """Unit of a key by its last word, as far as it is certain; other values are in SI units."""
    last = path.rpartition(".")[2].rpartition("_")[2]
    return _UNIT_ENDINGS.get(last, ("SI", 1.0))


def _overlay(solutions: Mapping[str, Solution]) -> list[dict[str, Any]]:
    """Force curves of all results with a drive, over travel and over time."""
    found = []
    for number, (name, solution) in enumerate(solutions.items()):
        if not solution.travel.shape[1]:
            continue
        curve = solution.force_curve
        label, factor = travel_scale(solution)
        force = np.where(curve.dynamic, np.nan, curve.force[:, 0]) if curve.has_quasi_static else curve.force[:, 0]
        rows = decimated([force], _OVERLAY_POINTS)
        found.append({
            "name": name, "result": number, "travel_label": label, "travel": pack_floats(factor * curve.travel[rows, 0]),
            "time": pack_doubles(curve.time[rows]), "y": pack_floats(force[rows]), "turns": solution.layout.turns(),
        })  # fmt: skip
    return found
