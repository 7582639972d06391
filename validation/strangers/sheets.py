"""Sheets for folded strips: sizes, materials, creases, contact, and the largest travel of a crease line."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from validation.strangers.typed import deg, digits, gpa, mm, nice, stiffness_text
from validation.stress.dice import Dice, Tables
from validation.stress.reach import crease_at

__all__ = ["FAMILY_FILE", "Sheet", "contact_tables", "crease_tables", "gravity", "sheet", "strip_tables"]

MATERIALS: tuple[tuple[float, float, float, float, float, float], ...] = (
    (0.5e9, 1.5e9, 0.4, 950.0, 5e-5, 1e-3),  # polyethylene, polypropylene
    (2.5e9, 5e9, 0.34, 1400.0, 2e-5, 5e-4),  # polyimide, polyester
    (2e9, 6e9, 0.3, 800.0, 5e-5, 5e-4),  # paper and card
    (20e9, 60e9, 0.3, 1600.0, 5e-5, 1e-3),  # glass and carbon laminates
    (69e9, 73e9, 0.33, 2700.0, 3e-5, 1e-3),  # aluminium
    (190e9, 200e9, 0.3, 7850.0, 2e-5, 1e-3),  # steel
)
"""Young's modulus from, to (Pa), Poisson's ratio, density (kg/m^3), thickness from, to (m)."""

FAMILY_FILE = "crease.h5"
"""A calibrated family of creases; `family.py` makes it."""
FAMILY_STIFFNESS = 4.5e-3
"""Stiffness of the creases of this file in the folded state, N m/rad; it is scaled to the wanted stiffness."""


@dataclass(frozen=True)
class Sheet:
    """A strip of equal panels, in SI, with `segments` per panel."""

    panels: int
    panel: float
    width: float
    thickness: float
    angle: float
    young: float
    poisson: float
    density: float
    segments: int

    @property
    def bending(self) -> float:
        """EI of a panel, N m^2."""
        return self.young * self.width * self.thickness**3 / 12.0

    @property
    def period(self) -> float:
        """Slowest period of a clamped panel, s."""
        mass = self.density * self.width * self.thickness
        return 2.0 * math.pi / 3.516 * self.panel**2 * math.sqrt(mass / self.bending)

    def crease_at(self, number: int) -> np.ndarray:
        """Position of a crease line, (x, z), m."""
        return crease_at(number, self.panel, self.angle)


def sheet(dice: Dice, panels: tuple[int, int], angles: tuple[float, float], slender: tuple[float, float]) -> Sheet:
    """A sheet; its panels are `slender` times as long as thick, and their sag under their own weight is at most their
    length.

    Panels are separated at the creases by more than twice their thickness, so that faces do not overlap in the folded state.
    """
    while True:
        soft, stiff, poisson, density, thin, thick = dice.one_of(MATERIALS)
        thickness = nice(dice.decades(thin, thick))
        panel = 1e-3 * round(1e3 * min(max(thickness * dice.decades(*slender), 0.015), 0.25))
        width = 1e-3 * round(1e3 * panel * dice.decades(0.2, 2.0))
        angle = math.radians(round(dice.between(*angles)))
        found = Sheet(
            dice.count(*panels), panel, width, thickness, angle, digits(dice.between(soft, stiff)), poisson, density,
            dice.one_of((6, 8, 10, 12, 16, 20)),
        )  # fmt: skip
        sag = density * 9.81 * width * thickness * panel**3 / found.bending
        slim = slender[0] <= panel / thickness <= slender[1]
        if slim and sag <= 2.0 and panel * math.cos(angle) >= 2.5 * thickness:
            return found


def strip_tables(of: Sheet, held: list[int] | None = None, damping: str | None = None) -> Tables:
    """[strip] and [material]."""
    strip: Tables = {
        "length": mm(of.panels * of.panel), "width": mm(of.width), "thickness": mm(of.thickness), "panels": of.panels,
        "fold_angle": deg(of.angle), "segments_per_panel": of.segments,
    }  # fmt: skip
    if held is not None:
        strip["held"] = held
    material: Tables = {"young": gpa(of.young), "poisson": of.poisson, "density": f"{of.density:g} kg/m^3"}
    if damping:
        material["damping"] = damping
    return {"strip": strip, "material": material}


def crease_tables(dice: Dice, of: Sheet, ratio: float, kinds: tuple[str, ...]) -> tuple[Tables, dict[str, str], float]:
    """[crease], files beside the case, and the stiffness at the folded state, N m/rad.

    `ratio` is the stiffness over EI per length of a panel. Half a segment on each side has a stiffness of 2 n EI/a, with n
    segments per panel; a crease of up to 10 EI/a needs a few segments, and always has them.
    """
    stiffness = digits(ratio * of.bending / of.panel)
    kind = dice.one_of(kinds)
    if kind == "linear":
        return {"law": "linear", "stiffness": stiffness_text(stiffness)}, {}, stiffness
    if kind == "family":
        crease: Tables = {
            "file": FAMILY_FILE, "press_time": dice.one_of(("1 min", "10 min", "1 h")), "opening": dice.count(1, 3),
            "scale": digits(stiffness / FAMILY_STIFFNESS),
        }  # fmt: skip
        return crease, {}, stiffness
    rows, softening = dice.count(9, 30), dice.between(0.4, 2.0)
    angles = np.linspace(0.0, 2.0 * of.angle, rows)
    moments = 1e3 * stiffness * angles / (1.0 + angles / softening)
    lines = [f"{math.degrees(x):.2f}, {m:.4g}" for x, m in zip(angles, moments, strict=True)]
    table = "\n".join(["angle (deg), moment (N mm)", *lines]) + "\n"
    crease = {"law": "spline", "data": "crease.csv"}
    if dice.chance(0.3):
        crease["interpolation"] = "pchip"
    return crease, {"crease.csv": table}, stiffness


def contact_tables(dice: Dice, friction: float = 0.5) -> Tables:
    """[contact] as in the examples of the guide, or from the material of the faces; [friction] in a part of the cases."""
    contact: Tables = {"stiffness": dice.one_of(("1e8 N/m^1.5", "1e9 N/m^1.5", "1e10 N/m^1.5"))}
    if dice.chance(0.5):
        contact |= {"damping": "10 N s/m", "ramp": "10 um"}
    if dice.chance(0.3):
        contact["thickness_in_gap"] = False
    tables: Tables = {"contact": contact}
    if dice.chance(friction):
        static = round(dice.between(0.15, 0.5), 2)
        tables["friction"] = {
            "mu_static": static, "mu_dynamic": round(0.7 * static, 2), "v_static": "1 mm/s", "v_dynamic": "10 mm/s",
        }  # fmt: skip
    return tables


def gravity(dice: Dice) -> Tables:
    """Gravity along an axis or in any direction of the plane; mostly of the earth, rarely of the moon."""
    size = 9.81 if dice.chance(0.85) else 1.62
    turn = dice.one_of((0.0, 90.0, 180.0, 270.0, float(round(dice.between(0.0, 360.0)))))
    x, z = (round(size * part, 3) for part in (math.cos(math.radians(turn)), math.sin(math.radians(turn))))
    return {"gravity": [f"{value:.4g} m/s^2" if value else 0 for value in (x, 0, z)]}
