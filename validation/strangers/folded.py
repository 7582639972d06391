"""Folded sheets in space: Miura, zigzag and waterbomb sheets, tubes, cones and plates, of all kinds of facets."""

from __future__ import annotations

import math

from validation.strangers.drawn import Drawn
from validation.strangers.sheets import MATERIALS
from validation.strangers.typed import deg, digits, gpa, mm, newton, nice
from validation.stress.dice import Dice, Tables

__all__ = ["draw_crease", "draw_drive", "draw_facets", "draw_folded", "draw_material"]

_MOST_CELLS = 900
"""Largest number of cells of flexible facets."""


def draw_folded(dice: Dice) -> Drawn:
    """A sheet that is pushed, pulled, loaded, folded from flat, or whose natural modes are computed.

    The case has a solution: drives of folded sheets move by up to a quarter of the length, and pulls by up to half of the
    way to the flat sheet. Tubes stretch while they fold, so they have bars or flexible facets; their drives move by up to a
    fifth of the height.
    Plates bend by up to their length. Sheets that fold themselves have linear creases and patterns that can fold.
    """
    return dice.one_of((_miura, _miura, _miura, _zigzag, _zigzag, _tube, _tube, _folding, _plate, _plate))(dice)


def draw_material(dice: Dice, size: float) -> tuple[Tables, float, float]:
    """[material], the thickness (m) of panels of a size, and the bending stiffness of the sheet over its width (N m)."""
    soft, stiff, poisson, density, thin, thick = dice.one_of(MATERIALS)
    thickness = nice(min(max(size / dice.decades(40.0, 400.0), thin), thick))
    young = digits(dice.between(soft, stiff))
    material = {"young": gpa(young), "poisson": poisson, "density": f"{density:g} kg/m^3"}
    return material, thickness, young * thickness**3 / (12.0 * (1.0 - poisson**2))


def draw_crease(dice: Dice, plate: float, size: float) -> Tables:
    """[crease] whose stiffness is a part of the stiffness of a panel."""
    return {"stiffness_per_length": f"{digits(dice.decades(0.02, 1.0) * plate / size):.12g} N m/rad/m"}


def draw_facets(dice: Dice, sheet: Tables, kinds: tuple[str, ...], size: float, panels: int) -> None:
    """Facets of the sheet; flexible facets have a mesh."""
    kind = dice.one_of(kinds)
    if kind == "flexible":
        cells = max(1, min(dice.count(2, 6), math.isqrt(_MOST_CELLS // panels)))
        sheet["mesh_size"] = mm(1.0001 * size / cells, 3)
    if kind != "rigid" or dice.chance(0.5):
        sheet["facets"] = kind


def _solved(dice: Dice, tables: Tables) -> Drawn:
    """The case; half of the cases select the method."""
    if dice.chance(0.5):
        tables["solve"] = {"method": "static"} | tables.get("solve", {})
    return Drawn(tables)


def draw_drive(dice: Dice, edge: str, direction: list[int], travel: float, guide: bool = False) -> Tables:
    drive: Tables = {
        "edge": edge, "direction": direction, "speed": dice.one_of(("0.5 mm/s", "1 mm/s", "5 mm/s")),
        "travel": mm(travel, 3),
    }  # fmt: skip
    return drive if guide else drive | {"guide": False}


def _miura(dice: Dice) -> Drawn:
    columns, rows = dice.count(2, 8), dice.count(2, 8)
    a = 1e-3 * nice(dice.decades(8.0, 60.0))
    b = nice(a * dice.between(0.7, 1.4))
    sector, fold = math.radians(round(dice.between(45.0, 80.0))), math.radians(round(dice.between(15.0, 65.0)))
    size = min(a, b)
    material, thickness, plate = draw_material(dice, size)
    sheet: Tables = {
        "kind": "miura", "columns": columns, "rows": rows, "a": mm(a), "b": mm(b), "sector_angle": deg(sector),
        "fold_angle": deg(fold), "thickness": mm(thickness),
        "support": [
            {"at": "edge left", "fixed": ["x"]}, {"at": "vertex 1", "fixed": ["y", "z"]}, {"at": "vertex 3", "fixed": ["z"]},
        ],
    }  # fmt: skip
    draw_facets(dice, sheet, ("rigid", "rigid", "bend-lines", "bars", "flexible"), size, columns * rows)

    def length(angle: float) -> float:
        along = math.cos(angle) * math.sin(sector)
        return columns * b * along / math.hypot(math.cos(sector), along)

    push = dice.chance(0.6)
    way = dice.between(0.05, 0.25) * length(fold) if push else dice.between(0.1, 0.5) * (length(0.0) - length(fold))
    tables: Tables = {"sheet": sheet, "material": material, "crease": draw_crease(dice, plate, size)}
    if dice.chance(0.8):
        return _solved(dice, tables | {"drive": [draw_drive(dice, "right", [-1 if push else 1, 0, 0], way)]})
    stiffness = float(tables["crease"]["stiffness_per_length"].split()[0])
    force = dice.between(0.02, 0.2) * stiffness * rows * (-1 if push else 1)
    tables["load"] = [{"at": "edge right", "force": [newton(force), "0 N", "0 N"]}]
    tables["load"][0]["time"] = {"kind": "ramp", "end": "1 s", "shape": "linear"}
    return Drawn(tables | {"solve": {"method": "static", "end_time": "1 s"}})


def _zigzag(dice: Dice) -> Drawn:
    columns = dice.count(2, 10)
    a = 1e-3 * nice(dice.decades(10.0, 80.0))
    b, fold = nice(a * dice.decades(0.3, 3.0)), math.radians(round(dice.between(20.0, 80.0)))
    material, thickness, plate = draw_material(dice, a)
    sheet: Tables = {
        "kind": "zigzag", "columns": columns, "a": mm(a), "b": mm(b), "fold_angle": deg(fold), "thickness": mm(thickness),
        "support": [{"at": "facet 1" if dice.chance(0.5) else "edge left"}],
    }  # fmt: skip
    small = min(a, b)
    kinds = ("rigid", "rigid", "bend-lines", "bars", "flexible", "flexible")
    draw_facets(dice, sheet, kinds, small, round(columns * max(a, b) / small))
    length = columns * a * math.cos(fold)
    travel = dice.between(0.1, 0.5) * (columns * a - length)
    tables: Tables = {"sheet": sheet, "material": material, "crease": draw_crease(dice, plate, a)}
    return _solved(dice, tables | {"drive": [draw_drive(dice, "right", [1, 0, 0], travel, dice.chance(0.5))]})


def _tube(dice: Dice) -> Drawn:
    kresling = dice.chance(0.6)
    sides, rows = dice.count(4, 8), dice.count(1, 3)
    radius = 1e-3 * nice(dice.decades(10.0, 80.0))
    height = nice(radius * dice.between(0.6, 1.5))
    material, thickness, plate = draw_material(dice, radius)
    sheet: Tables = {
        "kind": "kresling" if kresling else "yoshimura", "sides": sides, "rows": rows, "radius": mm(radius),
        "height": mm(height), "thickness": mm(thickness), "support": [{"at": "edge bottom"}],
    }  # fmt: skip
    if kresling:
        sheet["twist"] = deg(math.radians(round(dice.between(15.0, 60.0))))
    draw_facets(dice, sheet, ("bars", "bars", "flexible"), radius, 2 * sides * rows)
    travel = dice.between(0.02, 0.2 if kresling else 0.06) * height * rows
    tables: Tables = {"sheet": sheet, "material": material, "crease": draw_crease(dice, plate, radius)}
    push = draw_drive(dice, "top", [0, 0, -1], travel, not kresling and dice.chance(0.5))
    return _solved(dice, tables | {"drive": [push]})


def _folding(dice: Dice) -> Drawn:
    kind = dice.one_of(("waterbomb", "cone", "tube"))
    size = 1e-3 * nice(dice.decades(15.0, 100.0))
    if kind == "waterbomb":
        sheet: Tables = {"columns": dice.count(2, 4), "rows": dice.count(1, 3), "a": mm(size)}
    elif kind == "cone":
        sheet = {"sides": dice.count(4, 12), "inner_radius": mm(nice(0.3 * size)), "outer_radius": mm(size)}
    else:
        sheet = {"rows": dice.count(2, 6), "radius": mm(nice(0.5 * size)), "height": mm(size)}
    material, thickness, plate = draw_material(dice, size)
    sheet = {"kind": kind} | sheet | {
        "thickness": mm(thickness), "fold_to": round(dice.between(0.2, 0.9), 2), "support": [{"at": "facet 1"}],
    }  # fmt: skip
    draw_facets(dice, sheet, ("rigid", "bend-lines"), size, 1)
    tables: Tables = {"sheet": sheet, "material": material, "crease": draw_crease(dice, plate, size)}
    return Drawn(tables | {"solve": {"method": "static", "end_time": "100 s"}})


def _plate(dice: Dice) -> Drawn:
    ring = dice.chance(0.3)
    length = 1e-3 * nice(dice.decades(20.0, 500.0))
    width = nice(length * dice.decades(0.2, 2.0))
    material, thickness, plate = draw_material(dice, length)
    sheet: Tables = {"kind": "plate", "facets": "flexible", "thickness": mm(thickness)}
    if ring:
        inner = nice(length * dice.between(0.3, 0.7))
        sheet |= {"inner_radius": mm(inner), "outer_radius": mm(length), "slit": True, "mesh": [4, 32]}
        held, moved, place, arm, width = "slit-start", "slit-end", "vertex 3", 3.0 * length, length - inner
    else:
        sheet |= {"length": mm(length), "width": mm(width), "mesh": [dice.count(8, 24), dice.count(3, 10)]}
        held, moved, place, arm = "left", "right", "vertex 2", length
    sheet["support"] = [{"at": f"edge {held}", "clamped": True}]
    sheet["probe"] = [{"name": "end", "at": place}]
    tables: Tables = {"sheet": sheet, "material": material}
    task = dice.one_of(("load", "load", "drive", "modes"))
    if task == "modes":
        return Drawn(tables | {"step": [{"kind": "modes", "modes": 6}]})
    if task == "drive":
        return _solved(dice, tables | {"drive": [draw_drive(dice, moved, [0, 0, 1], dice.between(0.05, 0.4) * length)]})
    force = dice.between(0.1, 3.0) * plate * width / arm**2
    tables["load"] = [{"at": f"edge {moved}", "force": ["0 N", "0 N", newton(force)]}]
    return Drawn(tables | {"solve": {"method": "static", "end_time": "1 s"}})
