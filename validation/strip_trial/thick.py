"""Random thick strips with steep fold angles and contact: check that they are solved at every mesh, and that the peaks
agree.

    python -m validation.strip_trial.thick [--segments 10,20,40] [--strips 0,1,2]

Prints a row for each strip: the peak and the error that the summary states for each mesh. Exit code 1 if a run ends early.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from pathlib import Path

from fsm.case.loading.load_case import load_case
from fsm.errors import FsmError
from fsm.run.run_case import run_case
from validation.strangers.drawn import Drawn
from validation.strangers.sheets import Sheet, crease_tables, strip_tables
from validation.strangers.strips import drive_of
from validation.strangers.typed import digits
from validation.stress.dice import Dice

SEED = 2
STRIPS = (0, 1, 2, 5, 6, 7, 8, 9, 10, 11)
"""The first ten that are driven at a crease: the tip segment of the others depends on the mesh."""


def draw(number: int) -> Drawn:
    """4 or 5 panels of 40 to 160 mm at 80 to 88 degrees, 0.3 to 1 mm thick, E 1 to 20 GPa, creases of 0.5 to 5 EI/panel."""
    dice = Dice(SEED, number)
    while True:
        thickness = round(dice.between(3e-4, 1e-3), 5)
        panel = 1e-3 * round(1e3 * min(max(thickness * dice.decades(100.0, 400.0), 0.04), 0.16))
        angle = math.radians(round(dice.between(80.0, 88.0)))
        if 100.0 <= panel / thickness <= 400.0 and panel * math.cos(angle) >= 2.5 * thickness:
            break
    panels, width = dice.count(4, 5), 1e-3 * round(1e3 * panel * dice.decades(0.3, 1.0))
    of = Sheet(panels, panel, width, thickness, angle, digits(dice.decades(1e9, 2e10)), 0.3, 1000.0, 20)
    ratio = dice.decades(0.5, 5.0)
    held, pull = drive_of(dice, of, True)
    contact = {"law": "hertz"} if dice.chance(0.7) else {"law": "hertz", "thickness_in_gap": False}
    tables = strip_tables(of, held) | {"crease": crease_tables(dice, of, ratio, ("linear",))[0]} | pull
    friction = {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": "1 mm/s", "v_dynamic": "10 mm/s"}
    return Drawn(tables | {"contact": contact} | ({"friction": friction} if dice.chance(0.3) else {}))


def solved(number: int, segments: int, folder: Path) -> tuple[str, bool]:
    """Peak and stated error of a strip with a number of segments per panel, and whether it was solved."""
    path = folder / f"{number}_{segments}.toml"
    path.write_text(draw(number).text, encoding="utf-8")
    try:
        loaded = load_case(path, [f"strip.segments_per_panel={segments}"])
        summary = run_case(loaded, folder / path.stem, progress=False)
    except FsmError as error:
        return str(error).splitlines()[0], False
    return f"{summary['peak_force']:.4g} N, {100.0 * (summary['mesh_error'] or math.nan):.2g} %", True


def main() -> int:
    """Run the strips and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--segments", default="10,20,40")
    parser.add_argument("--strips", default=",".join(map(str, STRIPS)))
    asked = parser.parse_args()
    meshes, failed = [int(text) for text in asked.segments.split(",")], 0
    print("| strip | " + " | ".join(f"{count} segments" for count in meshes) + " |")
    print("|---|" + "---|" * len(meshes))
    with tempfile.TemporaryDirectory() as folder:
        for number in map(int, asked.strips.split(",")):
            found = [solved(number, count, Path(folder)) for count in meshes]
            failed += sum(not whole for _, whole in found)
            print(f"| {number} | " + " | ".join(text for text, _ in found) + " |", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
