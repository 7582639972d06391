"""Check that the summary, the table, the CSV files and the figures give the same peak.

`python -m validation.quasi_static.check` runs this check with the other parts: 100 random pulled strips.
"""

from __future__ import annotations

import csv
import json
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from matplotlib.figure import Figure

from fsm.results.store import read_solution
from fsm.views.plots.force import plot_force
from validation.gallery.drawing import beside
from validation.gallery.record import Check, Place, below
from validation.quasi_static.drawn_strips import draw_strips, solve

__all__ = ["Peaks", "one_peak", "peaks_of"]

COUNT = 100
EXACT, POINTS = 1e-9, 5e-3
"""Peaks that are the same number; and a peak between the points of a curve against the highest point."""
START_UP = 0.02
"""Part of the travel whose dynamic forces are the jerk of the start."""


@dataclass(frozen=True)
class Peaks:
    """Peaks of one strip according to its files, N; dynamic peaks are NaN if there is none."""

    summary: float
    row: float
    drawn: float
    curve: float
    csv: float
    dynamic: float
    dynamic_csv: float


def peaks_of(folder: Path, row: Mapping[str, Any]) -> Peaks:
    """The peaks in a folder of results and in its row of the table."""
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    lines = _drawn(folder).axes[0].lines
    (marker,) = (line for line in lines if line.get_marker() == "o" and line.get_fillstyle() == "full")
    dynamic = folder / "dynamic_force.csv"
    forces = _column(dynamic, START_UP * summary["final_travel"]) if dynamic.exists() else []
    return Peaks(
        summary["peak_force"], float(row["peak_force"]), float(np.asarray(marker.get_ydata())[0]),
        float(np.nanmax(np.asarray(lines[0].get_ydata(), dtype=float))), max(_column(folder / "force.csv")),
        float("nan") if summary["dynamic_peak_force"] is None else summary["dynamic_peak_force"],
        max(forces, default=float("nan")),
    )  # fmt: skip


def _drawn(folder: Path) -> Figure:
    """Figure that becomes force.png; it is written as SVG, because PNG files are not written by `savefig`."""
    kept: list[Figure] = []
    with mock.patch.object(Figure, "savefig", lambda fig, part: (kept.append(fig), part.touch())):
        plot_force(read_solution(folder / "result.h5"), folder / "drawn.svg")
    (fig,) = kept
    return fig


def _column(path: Path, start: float = 0.0) -> list[float]:
    """Forces of a CSV file from a travel on, N."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = [(float(row["travel (m)"]), float(row["force (N)"])) for row in csv.DictReader(file)]
    return [force for travel, force in rows if travel >= start]


def differences(found: Peaks) -> tuple[float, float, float]:
    """Relative differences from the summary: of numbers that must be equal, of curves, and of dynamic peaks."""
    exact = max(_off(value, found.summary) for value in (found.row, found.drawn))
    curves = max(_off(value, found.summary) for value in (found.curve, found.csv))
    if np.isnan(found.dynamic) and np.isnan(found.dynamic_csv):
        return exact, curves, 0.0
    return exact, curves, _off(found.dynamic_csv, found.dynamic)


def _off(value: float, reference: float) -> float:
    """Relative difference; 1 if only one of both values exists."""
    off = abs(value - reference) / abs(reference)
    return off if np.isfinite(off) else 1.0


def one_peak(place: Place) -> Iterator[Check]:
    """The peak of random strips in summary, table, CSV and picture."""
    with tempfile.TemporaryDirectory() as folder:
        found = [peaks_of(out, row) for _, out, row in solve(draw_strips(COUNT), Path(folder))]
    worst = np.max([differences(peaks) for peaks in found], axis=0)
    summary = [peaks.summary for peaks in found]
    moving = [peaks for peaks in found if not np.isnan(peaks.dynamic)]
    picture = beside(
        place.out / "one_peak.png",
        {"the same": (sorted(summary), sorted(summary))},
        {
            "table": (summary, [peaks.row for peaks in found]),
            "force.csv": (summary, [peaks.csv for peaks in found]),
            "force.png": (summary, [peaks.drawn for peaks in found]),
        },
        "peak force in the summary (N)", "peak force elsewhere (N)", log=True,
    )  # fmt: skip
    what = f"{len(found)} strips of {COUNT} drawn at random that are solved, {len(moving)} with a dynamic peak"
    names = "table and mark in force.png", "force.csv and curve in force.png", "dynamic_force.csv"
    for name, off, allowed in zip(names, worst, (EXACT, POINTS, POINTS), strict=True):
        yield below(f"{name}: peak, off the summary's by", what, off, allowed, "one run has one peak", picture)
    unsolved = (COUNT - len(found)) / COUNT
    yield below("random strips without an answer", f"{COUNT} strips", unsolved, 0.05, "they are feasible", picture)
