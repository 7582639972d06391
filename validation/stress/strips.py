"""Random folded strips that are pulled, and random lattices."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from validation.stress.dice import Dice, Tables, laws_of_contact, solve_section
from validation.stress.reach import crease_at, reach

__all__ = ["draw_lattice", "draw_strip"]


def draw_strip(dice: Dice) -> Tables:
    """A strip of 1 to 2000 segments per panel, with any fold angle, and creases up to 1e5 times softer or stiffer than its
    panels."""
    panels = dice.one_of((2, 3, 4, 5, 6, 8, 20), (0.3, 3, 4, 4, 6, 2, 1))
    segments = dice.count(1, 12) if dice.chance(0.96) else dice.count(20, 2000)
    thickness = dice.decades(1e-6, 1e-2)
    panel = thickness * dice.decades(20.0, 3000.0)
    width = panel * dice.decades(0.05, 5.0)
    young, density = dice.decades(1e5, 1e12), dice.decades(1.0, 2e4)
    bending = young * width * thickness**3 / 12.0
    period = math.sqrt(density * width * thickness * panel**4 / bending)
    held = [1, panels] if dice.chance(0.7) and panels > 3 else [1]
    free = [crease for crease in range(1, panels) if not {crease, crease + 1} & set(held)]
    travel = panel * dice.decades(1e-3, 1.0)
    speed = panel / period * dice.decades(1e-6, 1e2)
    if dice.chance(0.6):
        travel = min(travel, speed * period * dice.decades(0.01, 10.0))  # the duration of a run of a few periods
    material: Tables = {"young": young, "poisson": dice.between(-0.9, 0.49), "density": density, "plate": dice.chance(0.3)}
    material["damping"] = 0.0 if dice.chance(0.2) else period * dice.decades(1e-5, 10.0)
    tables: Tables = {
        "strip": {
            "length": panels * panel, "width": width, "thickness": thickness, "panels": panels,
            "fold_angle": math.radians(dice.between(1.0, 89.0)), "segments_per_panel": segments,
            "half_cell": dice.chance(0.8), "held": held,
        },
        "material": material,
        "crease": _crease(dice, bending / panel),
        "drive": [
            {
                "crease": dice.one_of(free or [1]), "direction": dice.one_of(([0, 0, 1], [0, 0, -1], [1, 0, 0], [1, 0, 1])),
                "speed": speed, "travel": travel, "guide": dice.chance(0.8),
            }
        ],
        "save": {"every": travel / dice.count(5, 40)},
    }  # fmt: skip
    if dice.chance(0.2):
        tables["gravity"] = dice.vector(panel / period**2 * dice.decades(1e-4, 1.0))
    if dice.chance(0.5):
        press = bending / panel**2  # moment that bends a panel to a full circle
        tables |= laws_of_contact(dice, press / thickness**1.5 * dice.decades(1e-2, 1e8), thickness, speed)
    tables["solve"] = solve_section(dice, static=True) | ({"spatial": True} if dice.chance(0.15) else {})
    _damped(tables["material"], tables["solve"], period)
    _within_reach(tables, panel)
    return tables


def _damped(section: Tables, solve: Tables, period: float) -> None:
    """Damping for scenes that statics may solve; without it the motion of a snap does not decay, and no equilibrium
    follows."""
    if solve["method"] in ("auto", "static"):
        section["damping"] = max(section["damping"], 0.01 * period)


def _within_reach(tables: Tables, panel: float) -> None:
    """Reverse a drive that would stretch a panel at the start, and end it before any panel is taut."""
    strip, drive = tables["strip"], tables["drive"][0]
    panels, crease, held = strip["panels"], drive["crease"], strip["held"]
    place = partial(crease_at, panel=panel, angle=strip["fold_angle"])
    anchors = [(place(1), (crease - 1) * panel)] if crease > 1 else []
    if panels in held and crease < panels - 1:
        anchors.append((place(panels - 1), (panels - 1 - crease) * panel))
    ends = []
    ways = [drive["direction"], [-x for x in drive["direction"]], [0, 0, 1], [0, 0, -1]]
    for direction in ways:
        way = np.array(direction[::2]) / np.linalg.norm(direction)
        ends.append(reach(panel, drive["travel"], place(crease), way, anchors))
        if ends[-1] >= min(0.1 * panel, drive["travel"]):
            break
    best = int(np.argmax(ends))
    drive["direction"] = ways[best]
    if ends[best] < drive["travel"]:
        drive["travel"] = ends[best]
        tables["save"]["every"] = drive["travel"] / 20.0


def _crease(dice: Dice, stiffness: float) -> Tables:
    """A linear crease, or a crease with a curve that may decrease; N m/rad."""
    stiffness *= dice.decades(1e-5, 1e5)
    rest: Tables = {} if dice.chance(0.5) else {"rest_angle": dice.between(0.0, math.pi)}
    if dice.chance(0.7):
        return {"law": "linear", "stiffness": stiffness, **rest}
    angle = [0.0]
    moment = [0.0]
    for _ in range(dice.count(3, 10)):
        angle.append(angle[-1] + dice.decades(1e-2, 1.0))
        moment.append(moment[-1] + (angle[-1] - angle[-2]) * stiffness * dice.between(-0.2, 1.5))
    crease: Tables = {"law": "spline", "angle": angle, "moment": moment, "interpolation": dice.one_of(("cubic", "pchip"))}
    if dice.chance(0.3):
        crease["unloading"] = [m - abs(m) * dice.between(0.1, 0.4) for m in moment]
    return crease | rest


def draw_lattice(dice: Dice) -> Tables:
    """Rotating squares, pulled, compressed or sheared at an edge."""
    columns, rows = dice.count(1, 6), dice.count(2, 3) if dice.chance(0.1) else dice.count(3, 7)
    if dice.chance(0.03):
        columns = rows = 20
    spacing, density, depth = dice.decades(1e-4, 1.0), dice.decades(1.0, 2e4), dice.decades(1e-4, 1.0)
    axial = dice.decades(1.0, 1e8)
    mass = density * depth * spacing**2 / 2.0
    slowest = axial * dice.decades(1e-6, 1.0)  # stiffness along the softest direction
    period = math.sqrt(mass / slowest)
    speed, travel = spacing / period * dice.decades(1e-6, 1e2), spacing * rows * dice.decades(1e-4, 0.3)
    if dice.chance(0.6):
        travel = min(travel, speed * period * dice.decades(0.01, 10.0))
    tables: Tables = {
        "lattice": {
            "columns": columns, "rows": rows, "spacing": spacing, "hinge_length": spacing * dice.decades(1e-3, 0.3),
            "angle": math.radians(dice.between(0.0, 44.0)), "axial": axial, "shear": axial * dice.decades(1e-4, 1.0),
            "rotational": slowest * spacing**2, "depth": depth, "density": density,
            "damping": 0.0 if dice.chance(0.2) else period * dice.decades(1e-4, 1.0),
        },
        "drive": [
            {
                "edge": "top", "direction": dice.one_of(([0, 0, 1], [0, 0, -1], [1, 0, 0], [1, 0, -1])),
                "speed": speed, "travel": travel,
            }
        ],
        "save": {"every": travel / dice.count(5, 40)},
        "solve": solve_section(dice, static=True),
    }  # fmt: skip
    _damped(tables["lattice"], tables["solve"], period)
    return tables
