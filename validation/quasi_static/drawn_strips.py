"""Random pulled strips with short solve times, solved as rows of one table."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fsm.run.table import run_table
from validation.strangers.sheets import Sheet, crease_tables, strip_tables
from validation.strangers.strips import draw_strip, drive_of
from validation.strangers.typed import digits, nice
from validation.stress.dice import Dice, Tables

__all__ = ["SEED", "draw_geometries", "draw_strips", "solve"]

SEED = 21
_SECTIONS = ("strip", "material", "crease", "contact", "friction", "gravity", "drive")


def draw_strips(count: int, seed: int = SEED) -> list[Tables]:
    """Strips of the campaign `validation.strangers`, up to 6 panels, with linear creases and a driven crease line; their
    solve times are short.

    They have 4 to 6 segments per panel, and travel by half a panel at most.
    """
    found: list[Tables] = []
    number = 0
    while len(found) < count:
        dice = Dice(seed, number)
        tables, number = draw_strip(dice).tables, number + 1
        driven = "crease" in tables.get("drive", [{}])[0]
        if not driven or tables["crease"].get("law") != "linear" or tables["strip"]["panels"] > 6:
            continue
        tables["strip"]["segments_per_panel"] = dice.count(4, 6)
        drive = tables["drive"][0]
        panel = _millimetres(tables["strip"]["length"]) / tables["strip"]["panels"]
        drive["travel"] = f"{min(_millimetres(drive['travel']), 0.5 * panel):.4g} mm"
        found.append(tables)
    return found


def draw_geometries(count: int, seed: int = SEED, panels: int = 12, part: float = 1.0) -> list[Tables]:
    """Strips without gravity and friction, with linear creases at rest as folded.

    2 to `panels` panels at 60 to 88 degrees, 0.05 to 0.6 mm thick, 1 to 100 GPa, creases of 0.1 to 10 EI/panel, six of ten
    with contact. The drive pulls a crease line or the tip by `part` of a feasible travel.
    """
    return [_geometry(Dice(seed, number), panels, part) for number in range(count)]


def _geometry(dice: Dice, panels: int, part: float) -> Tables:
    while True:
        thickness = nice(dice.decades(5e-5, 6e-4))
        panel = 1e-3 * round(1e3 * min(max(thickness * dice.decades(150.0, 1500.0), 0.015), 0.25))
        angle = math.radians(round(dice.between(60.0, 88.0)))
        if 150.0 <= panel / thickness <= 2000.0 and panel * math.cos(angle) >= 2.5 * thickness:
            break
    width = 1e-3 * round(1e3 * panel * dice.decades(0.2, 2.0))
    young = digits(dice.decades(1e9, 1e11))
    of = Sheet(dice.count(2, panels), panel, width, thickness, angle, young, 0.3, 1000.0, dice.one_of((5, 6, 8)))
    crease = crease_tables(dice, of, dice.decades(0.1, 10.0), ("linear",))[0]
    touches = dice.chance(0.6)
    held, pull = drive_of(dice, of, touches) if of.panels > 2 else ([1], _pressed_tip(dice, of))
    drive = pull["drive"][0]
    drive["travel"] = f"{part * _millimetres(drive['travel']):.4g} mm"
    contact = {"contact": {"law": "hertz", "thickness_in_gap": dice.chance(0.5)}} if touches else {}
    return strip_tables(of, held) | {"crease": crease} | contact | pull


def _pressed_tip(dice: Dice, of: Sheet) -> Tables:
    """Drive that shortens the second of two panels."""
    drive = {"body": f"panel 2 segment {of.segments}", "direction": [0, 0, 1], "speed": "2 mm/s"}
    return {"drive": [drive | {"travel": f"{1e3 * of.panel * dice.between(0.1, 0.5):.4g} mm"}]}


def _millimetres(text: str) -> float:
    match = re.fullmatch(r"([0-9.e+-]+) mm", text)
    assert match is not None, text
    return float(match[1])


def _inline(value: Any) -> str:
    """Value as TOML text in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_inline(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return json.dumps(value)


def solve(strips: list[Tables], folder: Path, workers: int | None = None) -> Iterator[tuple[Tables, Path, dict[str, Any]]]:
    """Run the strips as a table; return the solved strips with the folder of their results and their rows."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "case.toml").write_text('title = "drawn at random"\n', encoding="utf-8")
    lines = [",".join(("case", *_SECTIONS))]
    for number, tables in enumerate(strips):
        cells = [_inline(tables[name]) if name in tables else "none" for name in _SECTIONS]
        lines.append(",".join((f"strip {number}", *('"' + cell.replace('"', '""') + '"' for cell in cells))))
    (folder / "table.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    rows = run_table(folder / "table.csv", folder / "out", progress=False, workers=workers)
    for tables, row in zip(strips, rows, strict=True):
        if not row.get("error"):
            yield tables, folder / "out" / str(row["case"]), row
