"""Crease patterns of files, folded from flat: fold angles reached, strain energy, gaps, and a picture of all final states.

python -m validation.sheets.patterns FOLDER [--facets flexible] [--only NAME ...] [--out out/validation/sheets/patterns]

FOLDER has FOLD and SVG files. Each pattern is scaled to one size and folded to 0.9 of its fold angles; a file with a folded
frame starts there and has no `fold_to`. Every run is a process `fsm run`, so that a crash does not end the others.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from fsm.builders.patterns.of_sheet import pattern_of
from fsm.case.loading.toml_text import tables_text
from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.file import with_pattern
from fsm.results.store import read_solution
from fsm.views.plots.style import figure

__all__ = ["Folded", "case_of_pattern", "draw", "fold", "main", "table"]

PART = 0.9
"""Part of the fold angles to which the rest angles move."""
_SIZES = {"rigid": (0.2, 2e-4, 0.05), "bend-lines": (0.2, 2e-4, 0.05), "flexible": (0.1, 1e-4, 0.01)}
"""Largest side of the pattern (m), thickness (m) and stiffness of the creases (N m/rad per m), by facets."""
_CELLS = 4
"""Cells of flexible facets along the pattern, at least."""


class Folded(NamedTuple):
    """One pattern: how it ended, and parts of the rest angles that creases reached.

    Attributes
    ----------
    name : str
    facets : number of facets
    ended : "folded", "behind" (some creases below half; `text` states the reason), "refused", "no end", "time", "crash"
    least, median : part of the rest angles
    behind : number of creases below half
    energy, gap : strain energy (J), largest gap of joints (m)
    seconds : processor time, s
    text : warning or message
    """

    name: str
    facets: int
    ended: str
    least: float = math.nan
    median: float = math.nan
    behind: int = 0
    energy: float = math.nan
    gap: float = math.nan
    seconds: float = math.nan
    text: str = ""


def case_of_pattern(path: Path, facets: str) -> tuple[dict[str, Any], int]:
    """Case that folds the pattern of a file from flat, and its number of facets.

    Raises
    ------
    ValueError
        The file is faulty.
    """
    size, thickness, stiffness = _SIZES[facets]
    unit, faults = with_pattern(Sheet(pattern=path, scale=1.0, thickness=1.0), Path())
    if faults:
        raise ValueError("; ".join(fault.message for fault in faults))
    pattern = pattern_of(unit)
    sheet: dict[str, Any] = {
        "pattern": str(path.resolve()), "scale": size / float(np.ptp(pattern.vertices, axis=0).max()), "facets": facets,
        "thickness": thickness, "support": [{"at": "facet 1"}],
    }  # fmt: skip
    if facets == "flexible":
        sheet["mesh_size"] = size / _CELLS
    driven = [letter in "MV" and angle != 0.0 for letter, angle in zip(pattern.assignment, pattern.target, strict=True)]
    if pattern.flat is not None and any(driven):
        sheet["fold_to"] = PART
    data = {
        "sheet": sheet, "material": {"young": 3e9, "poisson": 0.3, "density": 1000.0},
        "crease": {"stiffness_per_length": stiffness}, "solve": {"method": "static", "end_time": 100.0},
        "save": {"interval": 10.0},
    }  # fmt: skip
    return data, len(pattern.faces)


def fold(path: Path, facets: str, folder: Path, limit: float) -> Folded:
    """Fold the pattern of a file by `fsm run` in a folder; `limit` on the processor time, s."""
    try:
        data, count = case_of_pattern(path, facets)
    except ValueError as error:
        return Folded(path.stem, 0, "refused", text=str(error))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "case.toml").write_text(tables_text(data), encoding="utf-8")
    command = [sys.executable, "-m", "fsm", "run", str(folder / "case.toml"), "--out", str(folder / "run"), "--quiet"]
    before = _children()

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))

    done = subprocess.run(command, capture_output=True, text=True, check=False, preexec_fn=limited)
    seconds, said = _children() - before, (done.stderr or done.stdout).strip().splitlines()
    if done.returncode:
        ended = {2: "refused", 3: "no end", 5: "no end"}.get(done.returncode, "crash")
        ended = "time" if seconds >= limit - 1.0 else ended
        return Folded(path.stem, count, ended, seconds=seconds, text=said[-1] if said else "")
    summary = json.loads((folder / "run" / "summary.json").read_text(encoding="utf-8"))
    gap, folded = float(summary.get("joint_opening") or 0.0), summary.get("folded") or {}
    energy = float(sum(folded.get("strain_energy", {"none": 0.0}).values()))
    behind = folded.get("creases", {})
    reason = next((text for text in summary["warnings"] if "fold" in text), "")
    ended = "behind" if behind else "folded"
    least, median = folded.get("least", math.nan), folded.get("median", math.nan)
    return Folded(path.stem, count, ended, least, median, len(behind), energy, gap, seconds, reason)


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def table(found: Sequence[Folded]) -> str:
    """Table of all patterns in Markdown, and the counts of their ends."""
    names = "pattern | facets | end | least part | median part | creases below half | strain energy (mJ) | largest gap (mm)"
    lines = [f"| {names} | time (s) |", "|---" * 9 + "|"]
    for one in found:
        part = "- | -" if math.isnan(one.least) else f"{one.least:.2f} | {one.median:.2f}"
        rest = f"{one.behind} | {1e3 * one.energy:.2g} | {1e3 * one.gap:.0e} | {one.seconds:.1f}"
        lines.append(f"| {one.name} | {one.facets} | {one.ended} | {part} | {rest} |")
    ends = [one.ended for one in found]
    lines += ["", ", ".join(f"{ends.count(end)} {end}" for end in dict.fromkeys(ends))]
    lines += [f"* {one.name}: {one.text}" for one in found if one.text]
    return "\n".join(lines)


def draw(found: Sequence[Folded], folder: Path, path: Path) -> None:
    """Figure of the final states of all patterns."""
    done = [one for one in found if (folder / one.name / "run" / "result.h5").is_file()]
    columns = min(6, max(1, len(done)))
    rows = max(1, math.ceil(len(done) / columns))
    with figure(path, (2.1 * columns, 2.2 * rows)) as fig:
        for k, one in enumerate(done):
            ax = fig.add_subplot(rows, columns, k + 1, projection="3d")
            quads = 1e3 * np.asarray(read_solution(folder / one.name / "run" / "result.h5").shape[-1])
            mesh = Poly3DCollection(quads, facecolors="#F4E8C8", edgecolors="#555555", linewidths=0.3, shade=True)
            ax.add_collection3d(mesh)
            low, high = quads.min(axis=(0, 1)), quads.max(axis=(0, 1))
            middle, half = 0.5 * (low + high), 0.5 * float((high - low).max())
            for axis, at in zip("xyz", middle, strict=True):
                getattr(ax, f"set_{axis}lim")(at - half, at + half)
            ax.set_box_aspect((1.0, 1.0, 1.0), zoom=1.3)
            ax.set_axis_off()
            ax.set_title(f"{one.name}\n{one.ended}", fontsize=7)


def main(arguments: Sequence[str] | None = None) -> int:
    """Fold all patterns of a folder, print the table, and write table and picture; 1 after a crash."""
    parser = argparse.ArgumentParser(prog="python -m validation.sheets.patterns", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--facets", choices=list(_SIZES), default="bend-lines")
    parser.add_argument("--only", nargs="+", default=None, help="names of files without suffix")
    parser.add_argument("--limit", type=float, default=600.0, help="processor time of a pattern, s")
    parser.add_argument("--out", type=Path, default=Path("out/validation/sheets/patterns"))
    chosen = parser.parse_args(arguments)
    files = sorted(path for path in chosen.folder.iterdir() if path.suffix in (".fold", ".svg"))
    files = [path for path in files if chosen.only is None or path.stem in chosen.only]
    if not files:
        parser.error(f"{chosen.folder}: no FOLD or SVG file" + (f" with the names {chosen.only}" if chosen.only else ""))
    out, found = chosen.out / chosen.facets, []
    for path in files:
        found.append(fold(path, chosen.facets, out / path.stem, chosen.limit))
        print(f"{path.name}: {found[-1].ended}, {found[-1].seconds:.1f} s", file=sys.stderr, flush=True)
    (chosen.out / f"{chosen.facets}.md").write_text(table(found) + "\n", encoding="utf-8")
    draw(found, out, chosen.out / f"{chosen.facets}.png")
    print(table(found))
    return int(any(one.ended == "crash" for one in found))


if __name__ == "__main__":
    sys.exit(main())
