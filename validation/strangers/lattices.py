"""Rotating squares on ligaments, pulled, compressed or sheared at an edge."""

from __future__ import annotations

import math

from validation.strangers.drawn import Drawn
from validation.strangers.typed import deg, digits, mm, nice
from validation.stress.dice import Dice, Tables

__all__ = ["draw_lattice"]

MATERIALS = ((1e6, 5e6, 1100.0), (20e6, 100e6, 1150.0), (1.5e9, 3.5e9, 1240.0))
"""Silicone, thermoplastic polyurethane, printed polymers: Young's modulus from, to (Pa), density (kg/m^3)."""


def draw_lattice(dice: Dice) -> Drawn:
    """A lattice whose hinges are ligaments of its own material, or have measured stiffness with similar ratios.

    The case has a solution: ligaments of length l and width h have an axial stiffness EA/l, a shear stiffness of 4 to 12
    EI/l^3 and a bending stiffness EI/l. Tension and compression end at 60 % of the travel that rotates the squares fully
    (angle 0, or 45 deg) and at 6 % of the height, shear at 5 %. The weight of the lattice is at most 2 % of the force that
    rotates the squares. Squares do not touch in the model.
    """
    soft, stiff, density = dice.one_of(MATERIALS)
    young = digits(dice.between(soft, stiff))
    columns, rows = dice.count(2, 10), dice.count(3, 10)
    spacing = 1e-3 * nice(dice.decades(5.0, 50.0))
    ligament = digits(spacing * dice.between(0.06, 0.25), 3)
    thin = ligament * dice.between(0.1, 0.5)
    depth = 1e-3 * nice(dice.decades(1.0, 20.0))
    angle = math.radians(round(dice.between(5.0, 40.0)))
    inertia = depth * thin**3 / 12.0
    axial, shear = young * depth * thin / ligament, young * inertia / ligament**3 * dice.between(4.0, 12.0)
    turning = young * inertia / ligament
    direction = dice.one_of(([0, 0, 1], [0, 0, -1], [0, 0, -1], [1, 0, 0]))
    side = (spacing - ligament) / math.cos(angle)
    if direction[0]:
        part = 0.05 * dice.between(0.2, 1.0)
    elif direction[2] > 0:
        part = min(0.06, 0.6 * (side - side * math.cos(angle)) / spacing) * dice.between(0.2, 1.0)
    else:
        part = min(0.06, 0.6 * side * (math.cos(angle) - math.cos(math.pi / 4)) / spacing) * dice.between(0.2, 1.0)
    travel = digits(part * spacing * (rows - 1), 3)
    lattice: Tables = {
        "columns": columns, "rows": rows, "spacing": mm(spacing), "hinge_length": mm(ligament), "angle": deg(angle),
        "axial": f"{1e-3 * digits(axial):.12g} N/mm", "shear": f"{1e-3 * digits(shear):.12g} N/mm",
        "rotational": f"{1e3 * digits(turning):.12g} N mm/rad", "depth": mm(depth), "density": f"{density:g} kg/m^3",
    }  # fmt: skip
    if dice.chance(0.3):
        lattice["damping"] = dice.one_of(("1 ms", "10 ms"))
    speed = dice.one_of(("0.1 mm/s", "0.5 mm/s", "1 mm/s"))
    drive: Tables = {"edge": "top", "direction": direction, "travel": mm(travel), "speed": speed}
    tables: Tables = {"lattice": lattice, "drive": [drive]}
    if dice.chance(0.3) and density * 9.81 * rows * spacing <= 0.02 * turning / (spacing**2 * depth):
        tables["gravity"] = [0, 0, "-9.81 m/s^2"]
    return Drawn(tables, {})
