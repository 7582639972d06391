"""Peak force of the pulled strip (`folding_cases/strip_pull`) by segments and by flexible facets, for its four conditions.

python -m validation.sheets.four_conditions [--segments 20 40] [--cells 8] [--conditions 0 2] [--middle]
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

import fsm

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_pull" / "case.toml"
CONDITIONS = (
    ("80 deg", "3 GPa", "25.5 mm"),
    ("80 deg", "6 GPa", "25.5 mm"),
    ("83 deg", "3 GPa", "17.9 mm"),
    ("83 deg", "6 GPa", "18.6 mm"),
)
"""Fold angle and Young's modulus of the four conditions, and a travel past the peak of flexible facets. If faces touch at
the thickness, flexible facets take many small steps beyond this travel."""
FAR = "30 mm"
"""Travel of all other runs."""
PANELS = 6


def strip(angle: str, young: str, count: int, travel: str, middle: bool) -> dict[str, Any]:
    """Shipped case of segments, `count` a panel; `middle` lets faces touch at their middle surfaces."""
    data = tomllib.loads(CASE.read_text(encoding="utf-8"))
    data["strip"] |= {"fold_angle": angle, "segments_per_panel": count}
    data["material"] |= {"young": young, "poisson": 0.0}
    data["crease"]["data"] = str(CASE.parent / "crease.csv")
    data["contact"]["thickness_in_gap"] = not middle
    data["drive"][0]["travel"] = travel
    return data


def sheet(angle: str, young: str, count: int, travel: str, middle: bool) -> dict[str, Any]:
    """The same strip of flexible facets, `count` cells along a panel."""
    data = strip(angle, young, 1, travel, middle)
    x = 0.5 * PANELS * 0.08 * math.cos(math.radians(float(angle.split()[0])))
    del data["strip"], data["drive"][0]["crease"]
    data["sheet"] = {
        "kind": "zigzag", "columns": PANELS, "a": "80 mm", "b": "40 mm", "fold_angle": angle, "thickness": "0.3 mm",
        "facets": "flexible", "mesh_size": 0.08 / count, "support": [{"at": "facet 1"}, {"at": f"facet {PANELS}"}],
    }  # fmt: skip
    data["crease"]["width"] = "40 mm"
    data["drive"][0]["at"] = [[x - 1e-6, -1.0, -1.0], [x + 1e-6, 1.0, 1.0]]
    return data


def main() -> None:
    """Print a row of a table for each form and condition as soon as it is solved."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--segments", type=int, nargs="*", default=[20, 40])
    parser.add_argument("--cells", type=int, nargs="*", default=[8])
    parser.add_argument("--conditions", type=int, nargs="*", default=range(len(CONDITIONS)))
    parser.add_argument("--middle", action="store_true", help="faces touch at their middle surfaces")
    given = parser.parse_args()
    forms = [("segments a panel", strip, n) for n in given.segments] + [("cells", sheet, n) for n in given.cells]
    print("| fold angle, E | form | peak force, N | at, mm | steps | processor time, s |\n|---|---|---|---|---|---|")
    for number in given.conditions:
        for what, form, count in forms:
            begun = time.process_time()
            angle, young, past_peak = CONDITIONS[number]
            data = form(angle, young, count, FAR if form is strip or given.middle else past_peak, given.middle)
            with tempfile.TemporaryDirectory() as folder:
                summary = fsm.load(data, folder=Path(folder)).run(Path(folder) / "run", figures=False).summary
            numbers = f"{summary['peak_force']:.4f} | {1e3 * summary['peak_travel']:.2f} | {summary['steps']}"
            print(f"| {angle}, {young} | {count} {what} | {numbers} | {time.process_time() - begun:.0f} |", flush=True)


if __name__ == "__main__":
    main()
