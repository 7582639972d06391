"""Random folded sheets and tubes of all kinds of facets, with contact and friction, or filled by gas."""

from __future__ import annotations

import math

from validation.stress.dice import Dice, Tables, laws_of_contact

__all__ = ["draw_sheet"]


def draw_sheet(dice: Dice) -> Tables:
    """A sheet that is pushed or pulled, with or without contact, or a tube with gas; in statics and in motion.

    A pushed sheet keeps three thicknesses for each panel. A pulled sheet ends before it is flat. The pressure of a gas is at
    most that which turns a crease by about one radian.
    """
    size = dice.decades(1e-3, 10.0)
    thickness = size / dice.decades(20.0, 3000.0)
    young, poisson, density = dice.decades(1e5, 1e12), dice.between(-0.3, 0.49), dice.decades(10.0, 2e4)
    plate = young * thickness**3 / (12.0 * (1.0 - poisson**2))
    period = size**2 * math.sqrt(density * thickness / plate)
    crease = plate / size * dice.decades(1e-3, 10.0)
    gas = dice.chance(0.35)
    sheet, length, flat = dice.one_of((_kresling, _miura_tube) if gas else (_zigzag, _miura_tube))(dice, size)
    sheet["thickness"] = thickness
    columns = sheet.get("columns", 1)
    kinds = ("bars", "flexible") if sheet["kind"] != "zigzag" else ("rigid", "bars", "flexible")
    sheet["facets"] = dice.one_of(kinds)
    if sheet["facets"] == "flexible":
        sheet["mesh_size"] = 1.0001 * size / dice.count(1, 2)
    static = dice.chance(0.6)
    material: Tables = {"young": young, "poisson": poisson, "density": density}
    material["damping"] = period * dice.decades(1e-2 if static else 1e-6, 1.0)
    tables: Tables = {"sheet": sheet, "material": material, "crease": {"stiffness_per_length": crease}}
    if gas:
        end = period * (dice.decades(1.0, 100.0) if static else dice.decades(0.1, 3.0))
        tables |= _filled(dice, sheet["kind"], dice.decades(1e-2, 1.0) * crease / size**2, end)
    else:
        speed = size / period * (dice.decades(1e-6, 1e-2) if static else dice.decades(0.03, 3.0))
        room = 6.0 * columns * thickness
        push = length > 2.0 * room and dice.chance(0.6)
        way = (length - room) if push else 0.9 * (flat - length)
        travel = way * dice.between(0.05, 1.0) * (1.0 if static else 0.3)
        tables["drive"] = [{"edge": "right", "direction": [-1 if push else 1, 0, 0], "speed": speed, "travel": travel}]
        # without a guide, a zigzag on a hinged edge is a mechanism that swings into the line of the drive
        tables["drive"][0]["guide"] = sheet["kind"] == "zigzag" or dice.chance(0.5)
        end = travel / speed
        if dice.chance(0.7):
            force = math.pi * crease * dice.decades(1e2, 1e5)
            tables |= laws_of_contact(dice, force / (0.5 * thickness) ** 1.5, 0.5 * thickness, speed)
            del tables["contact"]["resolve_overlap"]
        tables["save"] = {"every": travel / dice.count(5, 40)}
    return tables | {"solve": _solve(dice, static, end) | ({"end_time": end} if gas else {})}


def _solve(dice: Dice, static: bool, end: float) -> Tables:
    """[solve] by statics, or by a method for motions with error control or a fixed step."""
    solve: Tables = {"rtol": dice.decades(1e-7, 1e-2)}
    solve["method"] = "static" if static else dice.one_of(("generalized-alpha", "mean-force", "auto"))
    if solve["method"] == "generalized-alpha" and dice.chance(0.5):
        solve["rho_inf"] = dice.between(0.0, 1.0)
    if solve["method"] != "auto" and not static and dice.chance(0.3):
        solve["step"] = end * dice.decades(1e-3, 1e-2)
    return solve


def _zigzag(dice: Dice, size: float) -> tuple[Tables, float, float]:
    """[sheet] of panels between two clamped edges, its length, and its length when it is flat (m)."""
    columns, fold = dice.count(2, 5), math.radians(dice.between(20.0, 88.0))
    sheet: Tables = {
        "kind": "zigzag", "columns": columns, "a": size, "b": size * dice.decades(0.3, 3.0), "fold_angle": fold,
        "support": [{"at": "edge left"}],
    }  # fmt: skip
    return sheet, columns * size * math.cos(fold), columns * size


def _miura_tube(dice: Dice, size: float) -> tuple[Tables, float, float]:
    """[sheet] of a tube whose left end can change its section, its length, and the length of the flat tube (m)."""
    columns, fold, b = dice.count(2, 3), math.radians(dice.between(20.0, 85.0)), size * dice.between(1.0, 1.6)
    sheet: Tables = {
        "kind": "miura-tube", "columns": columns, "a": size, "b": b, "fold_angle": fold,
        "sector_angle": math.radians(dice.between(50.0, 80.0)),
        "support": [
            {"at": "edge left", "fixed": ["x"]}, {"at": "vertices 1, 3", "fixed": ["z"]}, {"at": "vertex 1", "fixed": ["y"]},
        ],
    }  # fmt: skip
    return sheet, columns * b * math.cos(fold), columns * b


def _kresling(dice: Dice, size: float) -> tuple[Tables, float, float]:
    """[sheet] of a twisted tube on a clamped end, and its height twice (m)."""
    height = size * dice.between(0.6, 1.5)
    sheet: Tables = {
        "kind": "kresling", "sides": dice.count(4, 6), "rows": dice.count(1, 2), "radius": size, "height": height,
        "twist": math.radians(dice.between(15.0, 60.0)), "support": [{"at": "edge bottom"}],
    }  # fmt: skip
    return sheet, height, height


def _filled(dice: Dice, kind: str, excess: float, end: float) -> Tables:
    """[[gas]] between lids at both ends of a tube, with an excess of pressure, Pa, until the time `end`, s."""
    first, last = ("left", "right") if kind == "miura-tube" else ("bottom", "top")
    gas: Tables = {"closed_by": [{"cap": f"edge {first}"}, {"cap": f"edge {last}"}]}
    outside = dice.decades(1e-1, 1e3) * excess if dice.chance(0.5) else 0.0
    if outside:
        gas["outside_pressure"] = outside
    gas["supply_pressure"] = outside + excess
    return {"gas": [gas], "save": {"interval": end / dice.count(5, 40)}}
