"""Run time against error of rigid facets, bend lines, bars and flexible facets, on three sheets that bend.

python -m validation.sheets.ladder [--out out/validation/sheets/ladder]

The reference is the value of flexible facets, extrapolated from the two finest meshes with order 2.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import fsm
from fsm.errors import NotConverged
from fsm.views.plots.style import COLOURS, GREY, figure, label_decades
from validation.sheets.strip import PANEL, by_flexible_facets

__all__ = ["Rung", "ladder", "main", "square_twist", "table"]

_FORMS = {"rigid": "rigid", "bend-lines": "bend lines", "bars": "bars", "flexible": "flexible"}


class Rung(NamedTuple):
    """One run: the sheet, the kind of facets, cells along a panel (0: none), unknowns, processor time (s), value, error."""

    sheet: str
    facets: str
    cells: int
    unknowns: int
    seconds: float
    value: float
    error: float = math.nan


def square_twist(side: float = 0.04, half: float = 0.08) -> dict[str, Any]:
    """FOLD data of a square twist: its pleats turn the square in the middle. Rigid facets cannot fold it."""
    directions = np.array([(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])
    corners = 0.5 * math.sqrt(2.0) * side * np.array([(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])
    places = [*corners]

    def add(place: np.ndarray) -> int:
        places.append(place)
        return len(places) - 1

    def at_side(place: np.ndarray, along: np.ndarray) -> np.ndarray:
        return np.asarray(place + along * (half - float(place @ along)))

    first = [add(at_side(corners[k], directions[k])) for k in range(4)]
    second = [add(at_side(corners[(k + 1) % 4], directions[k])) for k in range(4)]
    outer = [add(half * (directions[k] + directions[(k + 1) % 4])) for k in range(4)]
    edges, letters = [], ""
    for k in range(4):
        after = (k + 1) % 4
        edges += [[k, after], [k, first[k]], [after, second[k]]]
        edges += [[first[k], second[k]], [second[k], outer[k]], [outer[k], first[after]]]
        letters += "VMVBBB"
    return {
        "file_spec": 1.2, "frame_unit": "m", "vertices_coords": [place.tolist() for place in places],
        "edges_vertices": edges, "edges_assignment": [*letters],
    }  # fmt: skip


def _strip(facets: str, cells: int, folder: Path) -> dict[str, Any]:
    data = by_flexible_facets(max(cells, 1), 0.3, travel=0.004)
    if facets != "flexible":  # bend lines divide facets, and each part has a separate number
        data["sheet"]["support"] = [{"at": "vertices 1, 2, 3, 4"}, {"at": "vertices 11, 12, 13, 14"}]
    return _with_facets(data, facets, PANEL / max(cells, 1))


def _miura(facets: str, cells: int, folder: Path) -> dict[str, Any]:
    """Miura sheet whose creases are as stiff as its facets, pushed in its plane."""
    side, thickness, young, poisson = 0.03, 2e-4, 3e9, 0.3
    stiffness = young * thickness**3 / (12.0 * (1.0 - poisson**2)) / side
    sheet = {
        "kind": "miura", "columns": 4, "rows": 4, "a": side, "b": side, "sector_angle": "60 deg", "fold_angle": "40 deg",
        "thickness": thickness, "support": [
            {"at": "edge left", "fixed": ["x"]}, {"at": "vertex 1", "fixed": ["y", "z"]}, {"at": "vertex 3", "fixed": ["z"]},
        ],
    }  # fmt: skip
    data = {
        "sheet": sheet, "material": {"young": young, "poisson": poisson, "density": 1200.0},
        "crease": {"stiffness_per_length": stiffness},
        "drive": [{"edge": "right", "direction": [-1, 0, 0], "guide": False, "speed": "1 mm/s", "travel": "15 mm"}],
        "solve": {"method": "static", "rtol": 1e-4}, "save": {"every": "5 mm"},
    }  # fmt: skip
    return _with_facets(data, facets, side / max(cells, 1))


def _twist(facets: str, cells: int, folder: Path) -> dict[str, Any]:
    """Square twist whose creases are folded to half of 180 degrees from flat."""
    side = 0.04
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "twist.fold").write_text(json.dumps(square_twist(side)), encoding="utf-8")
    sheet = {
        "pattern": "twist.fold", "thickness": 2e-4, "fold_to": 0.5, "support": [{"at": "facet 1"}],
    }  # fmt: skip
    data = {
        "sheet": sheet, "material": {"young": 3e9, "poisson": 0.3, "density": 1000.0},
        "crease": {"stiffness_per_length": 0.05}, "solve": {"method": "static", "end_time": 100.0},
        "save": {"interval": 5.0},
    }  # fmt: skip
    return _with_facets(data, facets, side / max(cells, 1))


def _with_facets(data: dict[str, Any], facets: str, size: float) -> dict[str, Any]:
    sheet = {key: value for key, value in data["sheet"].items() if key not in ("facets", "mesh_size")}
    data["sheet"] = sheet | {"facets": facets} | ({"mesh_size": 1.0001 * size} if facets == "flexible" else {})
    return data


def _last_force(summary: dict[str, Any]) -> float:
    return float(summary["final_force"])


def _strain_energy(summary: dict[str, Any]) -> float:
    return float(sum(summary["folded"]["strain_energy"].values()))


SHEETS: dict[str, tuple[Callable[[str, int, Path], dict[str, Any]], Callable[[dict[str, Any]], float], str, int]] = {
    "pulled strip": (_strip, _last_force, "force at 4 mm (N)", 8),
    "Miura sheet, pushed": (_miura, _last_force, "force at 15 mm (N)", 8),
    "square twist": (_twist, _strain_energy, "strain energy (J)", 4),
}
"""Cases, with the number that is compared, and the cells along a panel of the finest mesh, a power of two."""


def ladder(name: str, folder: Path) -> list[Rung]:
    """All runs of a sheet."""
    case, value_of, _, finest = SHEETS[name]
    meshes = [2**k for k in range(int(math.log2(finest)) + 1)]
    found = []
    for facets, cells in [(facets, 0) for facets in ("rigid", "bend-lines", "bars")] + [("flexible", n) for n in meshes]:
        model = fsm.load(case(facets, cells, folder), folder=folder)
        try:
            if cells <= 1:
                model.run(folder / "run", figures=False)  # compiles kernels
            begun = time.process_time()
            summary = model.run(folder / "run", figures=False).summary
        except NotConverged as error:
            print(f"{name}, {facets}: {error}", file=sys.stderr)
            found.append(Rung(name, _FORMS[facets], cells, 0, math.nan, math.nan))
            continue
        found.append(Rung(name, _FORMS[facets], cells, summary["dof"], time.process_time() - begun, value_of(summary)))
        print(found[-1], file=sys.stderr, flush=True)
    fine = [rung.value for rung in found[-2:]]
    limit = fine[1] + (fine[1] - fine[0]) / 3.0
    return [rung._replace(error=rung.value / limit - 1.0) for rung in found]


def table(rungs: Sequence[Rung]) -> str:
    """Table of all runs in Markdown."""
    lines = ["| sheet | facets | unknowns | time (s) | value | error |", "|---|---|---|---|---|---|"]
    for rung in rungs:
        facets = f"{rung.facets}, {rung.cells} a panel" if rung.cells else rung.facets
        what = f"{rung.value:.4g} {SHEETS[rung.sheet][2].rpartition('(')[2].rstrip(')')}"
        error = f"{100.0 * rung.error:+.3g} %" if math.isfinite(rung.error) else "no equilibrium found"
        lines.append(f"| {rung.sheet} | {facets} | {rung.unknowns} | {rung.seconds:.2g} | {what} | {error} |")
    return "\n".join(lines)


def draw(rungs: Sequence[Rung], path: Path) -> None:
    """Error over run time, one plot for each sheet."""
    names = list(dict.fromkeys(rung.sheet for rung in rungs))
    with figure(path, (3.0 * len(names), 3.0)) as fig:
        axes = np.atleast_1d(fig.subplots(1, len(names), sharey=True))
        for ax, name in zip(axes, names, strict=True):
            for (facets, label), marker, colour in zip(_FORMS.items(), "os^D", COLOURS, strict=False):
                own = [rung for rung in rungs if rung.sheet == name and rung.facets == label]
                seconds, errors = [rung.seconds for rung in own], [100.0 * abs(rung.error) for rung in own]
                ax.loglog(seconds, errors, marker + ("-" if facets == "flexible" else ""), color=colour, ms=5, label=label)
                for rung, x, y in zip(own, seconds, errors, strict=True):
                    if rung.cells:
                        near = {"textcoords": "offset points", "fontsize": "small", "color": GREY}
                        ax.annotate(f"{rung.cells}", (x, y), (4, 4), **near)
            ax.set_title(name, loc="left")
            ax.set_xlabel("processor time (s)")
            ax.margins(0.15)
            label_decades(ax.xaxis)
            label_decades(ax.yaxis)
        axes[0].set_ylabel("error (%)")
        axes[-1].legend(loc="best")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all sheets, print the table, and write table and picture."""
    parser = argparse.ArgumentParser(prog="python -m validation.sheets.ladder", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/validation/sheets/ladder"))
    chosen = parser.parse_args(arguments)
    chosen.out.mkdir(parents=True, exist_ok=True)
    rungs = [rung for name in SHEETS for rung in ladder(name, chosen.out / "work")]
    with (chosen.out / "ladder.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([Rung._fields, *rungs])
    draw(rungs, chosen.out / "ladder.png")
    print(table(rungs))
    return 0


if __name__ == "__main__":
    sys.exit(main())
