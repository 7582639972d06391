"""Sheets that touch themselves, and tubes with gas, of all kinds of facets."""

from __future__ import annotations

import math

from validation.strangers.drawn import Drawn
from validation.strangers.folded import draw_crease, draw_drive, draw_facets, draw_material
from validation.strangers.typed import deg, mm, nice, pascal
from validation.stress.dice import Dice, Tables

__all__ = ["draw_packed"]

_SLIP = ("1 um/s", "0.01 mm/s", "0.1 mm/s", "1 mm/s")


def draw_packed(dice: Dice) -> Drawn:
    """A folded sheet that is pressed together until its facets touch, or a tube with gas.

    The case has a solution: a pressed sheet keeps at least three thicknesses for each panel, its contact is stiffer than its
    creases (`_contact`), and the pressure of a gas is at most that which turns a crease by about one radian.
    """
    return dice.one_of((_pressed_zigzag, _pressed_tube, _miura_with_gas, _tube_with_gas))(dice)


def _contact(dice: Dice, crease: Tables, thickness: float) -> Tables:
    """[contact] with a law for slow motions, and [friction] in two cases of three.

    A crease that is turned by pi presses its facets together with a force of about pi k, where k is its stiffness per
    length. Under 100 to 10,000 times this force a whole face has a penetration of half the thickness. Softer contact could
    not keep the facets apart, because a point or an edge has only a small part of the stiffness of a face.
    """
    hertz = dice.chance(0.5)
    force = 10.0 ** dice.count(2, 4) * math.pi * float(crease["stiffness_per_length"].split()[0])
    exponent, unit = (1.5, "N/m^1.5") if hertz else (1.0, "N/m")
    stiffness = f"{force / (0.5 * thickness) ** exponent:.0e} {unit}"
    section: Tables = {"law": "hertz" if hertz else "linear", "stiffness": stiffness}
    if dice.chance(0.8):
        section["damping"] = f"{10.0 ** dice.count(1, 3):g} N s/m"
    tables: Tables = {"contact": section}
    if dice.chance(0.67):
        tables["friction"] = {"law": "tanh", "mu_dynamic": round(dice.between(0.05, 1.0), 2), "v_static": dice.one_of(_SLIP)}
    return tables


def _pressed_zigzag(dice: Dice) -> Drawn:
    """Panels between two guided edges, pressed together until faces meet or nearly meet."""
    columns = dice.count(2, 8)
    a = 1e-3 * nice(dice.decades(10.0, 80.0))
    b, fold = nice(a * dice.decades(0.4, 2.0)), math.radians(round(dice.between(60.0, 85.0)))
    of, thickness, plate = draw_material(dice, a)
    sheet: Tables = {
        "kind": "zigzag", "columns": columns, "a": mm(a), "b": mm(b), "fold_angle": deg(fold), "thickness": mm(thickness),
        "support": [{"at": "edge left"}],
    }  # fmt: skip
    draw_facets(dice, sheet, ("rigid", "bars", "flexible"), min(a, b), round(columns * max(a, b) / min(a, b)))
    length, room = columns * a * math.cos(fold), 3.0 * columns * thickness
    travel = max(length - room, 0.1 * length) * dice.between(0.5, 1.0)
    tables: Tables = {"sheet": sheet, "material": of | {"damping": _damping(dice)}, "crease": draw_crease(dice, plate, a)}
    push = draw_drive(dice, "right", [-1, 0, 0], travel, True)
    return Drawn(tables | _contact(dice, tables["crease"], thickness) | {"drive": [push], "solve": {"method": "static"}})


def _pressed_tube(dice: Dice) -> Drawn:
    """A Miura tube that is folded, pressed together, or pulled out, by at most nine tenths of the way until it is flat."""
    kinds = "bars", "bars", "flexible"
    sheet, of, thickness, plate, size, columns, fold = _miura_tube(dice, dice.between(60.0, 86.0), kinds)
    length, room = columns * size * math.cos(fold), 6.0 * columns * thickness
    push = dice.chance(0.6)
    sector = math.radians(float(sheet["sector_angle"].split()[0]))
    along = math.cos(fold) * math.tan(sector)
    full = columns * size * (math.sin(sector) - along / math.hypot(1.0, along))
    travel = max(length - room, 0.1 * length) * dice.between(0.5, 1.0) if push else dice.between(0.3, 0.9) * full
    tables: Tables = {"sheet": sheet, "material": of | {"damping": _damping(dice)}, "crease": draw_crease(dice, plate, size)}
    pull = draw_drive(dice, "right", [-1 if push else 1, 0, 0], travel)
    return Drawn(tables | _contact(dice, tables["crease"], thickness) | {"drive": [pull], "solve": {"method": "static"}})


def _miura_with_gas(dice: Dice) -> Drawn:
    sheet, of, _, plate, size, _, _ = _miura_tube(dice, dice.between(20.0, 80.0), ("rigid", "bars", "flexible"))
    tables: Tables = {"sheet": sheet, "material": of, "crease": draw_crease(dice, plate, size)}
    return _filled(dice, tables, "left", "right", size)


def _tube_with_gas(dice: Dice) -> Drawn:
    """A Kresling or Yoshimura tube between lids; it opens a little, because its facets stretch."""
    kresling = dice.chance(0.6)
    sides, rows = dice.count(4, 8), dice.count(1, 3)
    radius = 1e-3 * nice(dice.decades(10.0, 80.0))
    height = nice(radius * dice.between(0.6, 1.5))
    of, thickness, plate = draw_material(dice, radius)
    sheet: Tables = {
        "kind": "kresling" if kresling else "yoshimura", "sides": sides, "rows": rows, "radius": mm(radius),
        "height": mm(height), "thickness": mm(thickness), "support": [{"at": "edge bottom"}],
    }  # fmt: skip
    if kresling:
        sheet["twist"] = deg(math.radians(round(dice.between(15.0, 60.0))))
    draw_facets(dice, sheet, ("bars", "bars", "flexible"), radius, 2 * sides * rows)
    tables: Tables = {"sheet": sheet, "material": of, "crease": draw_crease(dice, plate, radius)}
    return _filled(dice, tables, "bottom", "top", radius)


def _miura_tube(dice: Dice, fold: float, kinds: tuple[str, ...]) -> tuple[Tables, Tables, float, float, float, int, float]:
    """[sheet] and [material] of a tube with a fold angle (deg), and its thickness, bending stiffness, length of a column,
    number of columns, and fold angle (rad).
    """
    columns = dice.count(2, 6)
    a = 1e-3 * nice(dice.decades(10.0, 60.0))
    b, angle = nice(a * dice.between(0.8, 1.6)), math.radians(round(fold))
    of, thickness, plate = draw_material(dice, min(a, b))
    sheet: Tables = {
        "kind": "miura-tube", "columns": columns, "a": mm(a), "b": mm(b), "fold_angle": deg(angle),
        "sector_angle": deg(math.radians(round(dice.between(50.0, 80.0)))), "thickness": mm(thickness),
        "support": [
            {"at": "edge left", "fixed": ["x"]}, {"at": "vertices 1, 3", "fixed": ["z"]}, {"at": "vertex 1", "fixed": ["y"]},
        ],
    }  # fmt: skip
    draw_facets(dice, sheet, kinds, min(a, b), 4 * columns)
    return sheet, of, thickness, plate, b, columns, angle


def _filled(dice: Dice, tables: Tables, first: str, last: str, size: float) -> Drawn:
    """Case with gas between lids at two edges, by a supply of pressure or of mass."""
    stiffness = float(tables["crease"]["stiffness_per_length"].split()[0])
    excess = dice.decades(0.02, 1.0) * stiffness / size**2
    gas: Tables = {"closed_by": [{"cap": f"edge {first}"}, {"cap": f"edge {last}"}]}
    if dice.chance(0.5):
        gas["outside_pressure"] = "100 kPa"
        gas["supply_pressure"] = pascal(1e5 + excess)
    else:
        gas["supply_pressure"] = pascal(excess)
    return Drawn(tables | {"gas": [gas], "solve": {"method": "static", "end_time": "1 s"}, "save": {"channels": ["gas.*"]}})


def _damping(dice: Dice) -> str:
    return dice.one_of(("1 ms", "10 ms", "50 ms"))
