"""Random motions: errors due to steps in time (facets, impacts of plates, fast pulls of strips), and due to the mesh."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from validation.errors.coverage import Kind, Number
from validation.errors.facets import plate
from validation.errors.runs import numbers

__all__ = ["KINDS"]


def _struck(random: np.random.Generator) -> dict[str, Any]:
    """Plate under a load that grows and ends within a few periods of its first mode."""
    tables = plate(random)
    sheet, material = tables["sheet"], tables["material"]
    sheet["mesh"] = [int(random.integers(2, 5)), int(random.integers(1, 3))]  # references with many steps are expensive
    bending = material["young"] * sheet["thickness"] ** 3 / 12.0
    clamped = sheet["support"][0].get("clamped", False)
    number = 3.516 if clamped else np.pi**2
    period = 2.0 * np.pi * sheet["length"] ** 2 / number * (material["density"] * sheet["thickness"] / bending) ** 0.5
    end = period * float(random.uniform(0.7, 2.5))
    size = bending / sheet["length"] ** 2 * float(10.0 ** random.uniform(-1.0, 0.3))
    pulse = period * float(random.uniform(0.1, 0.6))
    tables["load"] = [{
        "name": "push", "at": "edge right" if clamped else "edge top", "force_per_length": [0.0, 0.0, size],
        "time": {"kind": "table", "time": [0.0, pulse, 2.0 * pulse], "value": [0.0, 1.0, 0.0]},
    }]  # fmt: skip
    tables["solve"] = {"end_time": end, "method": "mean-force"}
    tables["save"] = {"interval": end / 20.0}
    if random.random() < 0.5:
        tables["solve"]["step"] = end / float(20 * random.integers(3, 15))
    else:
        tables["solve"]["rtol"] = float(10.0 ** random.uniform(-6.0, -3.5))
    return tables


def _smaller(tables: dict[str, Any]) -> dict[str, Any]:
    solve = tables["solve"]
    if "step" in solve:
        return {"solve.step": solve["step"] / 5.0}
    return {"solve.rtol": 1e-2 * solve["rtol"]}


def _facet_steps(random: np.random.Generator) -> Iterator[Number]:
    tables = _struck(random)
    yield from numbers(tables, "steps", _smaller(tables))


def _facet_mesh(random: np.random.Generator) -> Iterator[Number]:
    tables = _struck(random)
    yield from numbers(tables, "mesh", {"sheet.mesh": [3 * count for count in tables["sheet"]["mesh"]]})


def _dropped(random: np.random.Generator) -> Iterator[Number]:
    """Plates that fall on a floor, and on each other."""
    bodies, pairs = [], []
    for k in range(int(random.integers(1, 4))):
        tilt, yaw = random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3)
        half = np.array([1.0, 0.0, 0.5 * tilt, 0.5 * yaw])
        name = f"plate {k + 1}"
        bodies.append({
            "name": name, "mass": 0.02, "inertia": [8e-6, 2e-5, 2.7e-5], "position": [0.0, 0.0, 0.03 + 0.05 * k],
            "orientation": (half / np.linalg.norm(half)).tolist(),
            "plate": {"length": 0.1, "width": 0.06, "thickness": 0.004},
        })  # fmt: skip
        pairs.append({"first": name, "second": f"plate {k}" if k else "floor"})
    tables: dict[str, Any] = {
        "gravity": [0.0, 0.0, -9.81],
        "contact": {"stiffness": 1e7, "restitution": float(random.uniform(0.3, 0.9))},
        "solve": {"end_time": float(random.uniform(0.08, 0.2)), "rtol": float(10.0 ** random.uniform(-6.5, -4.0))},
        "scene": {"bodies": bodies, "pairs": pairs},
        "obstacle": [{"name": "floor", "shape": "plane"}],
    }
    yield from numbers(tables, "steps", {"solve.rtol": 1e-2 * tables["solve"]["rtol"]})


def _strip(random: np.random.Generator) -> Iterator[Number]:
    """Strip that is pulled fast."""
    length = float(random.uniform(0.06, 0.15))
    tables: dict[str, Any] = {
        "strip": {
            "length": length, "width": 0.02, "thickness": 2e-4, "panels": 4,
            "fold_angle": f"{random.uniform(60, 80)} deg", "segments_per_panel": int(random.integers(3, 7)),
        },
        "material": {"young": 3e9, "poisson": 0.3, "density": 1200.0, "damping": 1e-3},
        "crease": {"law": "linear", "stiffness": float(10.0 ** random.uniform(-3.5, -2.5))},
        "drive": [{"crease": 2, "direction": [0, 0, 1], "travel": 0.3 * length, "speed": float(random.uniform(0.2, 2.0))}],
        "solve": {"method": "generalized-alpha", "rtol": float(10.0 ** random.uniform(-6.0, -4.0))},
    }  # fmt: skip
    yield from numbers(tables, "steps", {"solve.rtol": 1e-2 * tables["solve"]["rtol"]})


KINDS = {
    "facet steps": Kind("steps in time of plates of flexible facets", _facet_steps),
    "facet motion mesh": Kind("mesh of motions of plates of flexible facets", _facet_mesh),
    "impacts": Kind("steps in time of plates with impacts", _dropped),
    "fast strips": Kind("steps in time of strips that are pulled fast", _strip),
}
