"""Quick pulled strips drawn at random, solved as rows of one table."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fsm.table import run_table
from validation.strangers.strips import draw_strip
from validation.stress.dice import Dice, Tables

__all__ = ["SEED", "draw_strips", "solve"]

SEED = 21
_SECTIONS = ("strip", "material", "crease", "contact", "friction", "gravity", "drive")


def draw_strips(count: int, seed: int = SEED, plain: bool = False) -> list[Tables]:
    """Strips of the campaign of strangers, up to 6 panels, with linear creases and a driven crease line, made quick.

    They have 4 to 6 segments a panel, and travel by half a panel at most. `plain`: with creases at rest as folded and
    without gravity.
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
        if plain:
            tables.pop("gravity", None)
            tables["crease"].pop("rest_angle", None)
        found.append(tables)
    return found


def _millimetres(text: str) -> float:
    match = re.fullmatch(r"([0-9.e+-]+) mm", text)
    assert match is not None, text
    return float(match[1])


def _inline(value: Any) -> str:
    """A value as TOML has it in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_inline(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return json.dumps(value)


def solve(strips: list[Tables], folder: Path, workers: int | None = None) -> Iterator[tuple[Tables, Path, dict[str, Any]]]:
    """Run the strips as a table; those that are solved with the folder of their results and their rows."""
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
