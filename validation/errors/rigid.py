"""Random models without a mesh: errors due to steps of bars, mechanisms, lattices, friction, and of limit points."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from validation.errors.coverage import Kind, Number
from validation.errors.runs import numbers

__all__ = ["KINDS"]


def _kresling(random: np.random.Generator, loads: tuple[float, float]) -> dict[str, Any]:
    """Cylinder of bars whose upper edge is pushed; `loads`: decimal powers of the force over E t R."""
    radius = float(random.uniform(0.02, 0.08))
    thickness = radius * float(10.0 ** random.uniform(-2.3, -1.9))
    young = float(10.0 ** random.uniform(9.0, 10.0))
    size = young * thickness * radius * float(10.0 ** random.uniform(*loads))
    return {
        "sheet": {
            "kind": "kresling", "sides": int(random.integers(5, 8)), "rows": 1, "radius": radius,
            "height": radius * float(random.uniform(0.8, 1.3)), "twist": f"{random.uniform(30.0, 50.0)} deg",
            "facets": "bars", "thickness": thickness, "support": [{"at": "edge bottom"}],
        },
        "material": {"young": young, "density": 1000.0, "damping": float(10.0 ** random.uniform(-4.0, -3.0))},
        "crease": {"stiffness_per_length": young * thickness**3 / 12.0 / radius * float(10.0 ** random.uniform(-1.0, 0.5))},
        "load": [{"name": "push", "at": "edge top", "force": [0.0, 0.0, -size]}],
    }  # fmt: skip


def _bars(random: np.random.Generator) -> Iterator[Number]:
    tables = _kresling(random, (-4.5, -3.2))
    ramp = float(random.uniform(5e-3, 0.02))
    tables["load"][0]["time"] = {"kind": "ramp", "end": ramp}
    tables["solve"] = {"end_time": 2.0 * ramp, "rtol": float(10.0 ** random.uniform(-6.0, -3.5))}
    tables["save"] = {"interval": 0.1 * ramp}
    yield from numbers(tables, "steps", {"solve.rtol": 1e-2 * tables["solve"]["rtol"]})


def _limits(random: np.random.Generator) -> Iterator[Number]:
    tables = _kresling(random, (-3.3, -2.3))
    tables["crease"]["stiffness_per_length"] *= 0.02
    tables["load"][0]["time"] = {"kind": "ramp", "shape": "linear", "end": 1.0}
    tables["solve"] = {"end_time": 1.0, "method": "arc-length"}
    for number in numbers(tables, "steps", {"solve.max_step": 4e-3}):
        if number.name.startswith("limit_points"):
            yield number


def _chain(random: np.random.Generator) -> Iterator[Number]:
    """Chain of hinged links that falls under its weight."""
    bodies: list[dict[str, Any]] = []
    elements: list[dict[str, Any]] = []
    at, reach = np.zeros(3), 0.0
    for k in range(int(random.integers(1, 4))):
        angle, length, mass = random.uniform(-1.5, 1.5), float(random.uniform(0.05, 0.2)), float(random.uniform(0.02, 0.1))
        along = length * np.array([np.cos(angle), 0.0, np.sin(angle)])
        inertia = mass * length**2 / 12.0
        bodies.append({
            "name": f"link {k + 1}", "mass": mass, "inertia": [0.1 * inertia, inertia, inertia],
            "position": (at + 0.5 * along).tolist(), "orientation": [np.cos(0.5 * angle), 0.0, -np.sin(0.5 * angle), 0.0],
        })  # fmt: skip
        elements.append({
            "name": f"pin {k + 1}", "inner": f"link {k + 1}", "outer": f"link {k}" if k else "ground",
            "point_inner": [-0.5 * length, 0.0, 0.0], "point_outer": [0.5 * reach, 0.0, 0.0],
            "translation": [1e5, 1e5, 1e5], "translation_damping": [20.0, 20.0, 20.0],
        })  # fmt: skip
        at, reach = at + along, length
    tables: dict[str, Any] = {
        "gravity": [0.0, 0.0, -9.81],
        "scene": {"bodies": bodies, "elements": elements},
        "solve": {
            "method": "generalized-alpha", "end_time": float(random.uniform(0.1, 0.4)),
            "rtol": float(10.0 ** random.uniform(-6.0, -4.0)),
        },
    }  # fmt: skip
    tables["save"] = {"interval": tables["solve"]["end_time"] / 20.0}
    yield from numbers(tables, "steps", {"solve.rtol": 1e-2 * tables["solve"]["rtol"]})


def _lattice(random: np.random.Generator) -> Iterator[Number]:
    """Rotating squares that are stretched, compressed or sheared, in statics or fast."""
    spacing = float(random.uniform(0.01, 0.02))
    direction = [[0, 0, 1], [0, 0, -1], [1, 0, 0]][int(random.integers(3))]
    static = bool(random.random() < 0.5)
    tables: dict[str, Any] = {
        "lattice": {
            "columns": int(random.integers(2, 5)), "rows": int(random.integers(3, 5)), "spacing": spacing,
            "hinge_length": 0.15 * spacing, "angle": f"{random.uniform(10.0, 30.0)} deg", "axial": 1e5,
            "shear": float(random.uniform(1e3, 5e3)), "rotational": float(10.0 ** random.uniform(-3.5, -2.5)), "depth": 0.01,
            "density": 1240.0, "held": ["bottom"],
        },
        "drive": [{
            "edge": "top", "direction": direction, "travel": spacing * float(random.uniform(0.05, 0.2)),
            "speed": 1e-4 if static else float(10.0 ** random.uniform(-1.5, 0.0)),
        }],
        "solve": {
            "method": "static" if static else "generalized-alpha", "rtol": float(10.0 ** random.uniform(-6.0, -3.5)),
        },
    }  # fmt: skip
    yield from numbers(tables, "steps", {"solve.rtol": 1e-2 * tables["solve"]["rtol"]})


def _friction(random: np.random.Generator) -> Iterator[Number]:
    """Packed strip with friction between its panels, pulled in statics."""
    length = float(random.uniform(0.06, 0.15))
    mu = float(random.uniform(0.1, 0.5))
    tables: dict[str, Any] = {
        "strip": {
            "length": length, "width": 0.02, "thickness": 2e-4, "panels": 4,
            "fold_angle": f"{random.uniform(84, 88)} deg", "segments_per_panel": int(random.integers(2, 4)),
        },
        "material": {"young": 3e9, "poisson": 0.3, "density": 1200.0, "damping": 1e-3},
        "crease": {"law": "linear", "stiffness": float(10.0 ** random.uniform(-3.5, -2.5))},
        "contact": {"damping": 10.0},
        "friction": {"mu_static": mu, "mu_dynamic": 0.7 * mu, "v_static": 1e-3, "v_dynamic": 1e-2},
        "drive": [{"crease": 2, "direction": [0, 0, 1], "travel": 0.3 * length, "speed": 0.01}],
        "solve": {"method": "static", "rtol": float(10.0 ** random.uniform(-4.5, -3.0))},
    }  # fmt: skip
    yield from numbers(tables, "steps", {"solve.rtol": 1e-2 * tables["solve"]["rtol"]})


KINDS = {
    "bars": Kind("steps in time of cylinders of bars", _bars),
    "mechanisms": Kind("steps in time of chains of hinged links", _chain),
    "lattices": Kind("steps of lattices, in statics and in motion", _lattice),
    "static friction": Kind("increments of packed strips with friction", _friction),
    "limit points": Kind("interpolation of limit points of cylinders of bars", _limits),
}
