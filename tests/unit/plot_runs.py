"""Runs for tests of figures, and the contents of saved figures."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import matplotlib
import matplotlib.legend
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from fsm.results.quantities import summarise
from fsm.results.solution import PAIRS, Layout, Record, Solution

PANEL, HALF_WIDTH, FOLD, CELLS = 0.08, 0.02, np.radians(80), 8


def panel_line(start: np.ndarray, end: np.ndarray, side: float) -> np.ndarray:
    """Joints of a panel between two points; the panel bends to one side if the points are nearer than its length."""
    chord = end - start
    reach = float(np.hypot(*chord))
    bow = np.sqrt(max(0.0, 3 * reach * (PANEL - reach) / 8)) if reach < PANEL else 0.0
    s = np.linspace(0, 1, CELLS + 1)[:, None]
    normal = side * np.array([-chord[1], chord[0]]) / max(reach, 1e-9)
    return start + s * chord + 4 * bow * s * (1 - s) * normal


def strip_shape(rise: float, out: float = 0.0) -> np.ndarray:
    """Quads of a pulled strip of six panels; the shapes are plausible but not solved."""
    dx, dz = PANEL * np.cos(FOLD), PANEL * np.sin(FOLD)
    knots = np.array([[i * dx, dz * (i % 2)] for i in range(7)])
    knots[3, 1] += rise
    share = rise / 0.157
    for side, k in ((1, 2), (-1, 4)):
        knots[k] += [side * dx * min(1, 6 * share) * 0.9 * (1 - share), rise * share**0.5]
    quads = []
    for i in range(6):
        points = panel_line(knots[i], knots[i + 1], 1.0 if i < 3 else -1.0)
        for a, b in pairwise(points):
            near, far = -HALF_WIDTH + out * share, HALF_WIDTH + out * share
            quads.append([[a[0], near, a[1]], [b[0], near, b[1]], [b[0], far, b[1]], [a[0], far, a[1]]])
    return np.array(quads)


def contact(s: float) -> dict[str, np.ndarray]:
    """The first pair never touches; the second pair touches from 13 mm on, with growing area."""
    force = 20 * max(0.0, s - 0.013)
    return {
        "pair_force": np.array([0.0, force]),
        "pair_gap": np.array([1e-3, 0.013 - s]),
        "pair_area": np.array([0.0, 1e-4 * force]),
    }


def strip_run(n: int = 151, drives: int = 1, peak: float = 2.0, out: float = 0.0) -> Solution:
    """A run with the three stages: contact at 13 mm, the peak near 27 mm."""
    travel = np.linspace(0, 0.15, n)
    force = peak * (travel / 0.027) * np.exp(1 - travel / 0.027) + 0.3 * peak * (travel / 0.15) ** 4
    work = np.concatenate([[0.0], np.cumsum(np.diff(travel) * (force[1:] + force[:-1]) / 2)])
    share = np.clip((travel - 0.013) / 0.05, 0, 0.8)
    records = [
        Record(
            time=s / 0.002, q=np.zeros(3), u=np.zeros(3), travel=np.full(drives, s), force=np.full(drives, f),
            energy={
                "panels": w * h, "creases": w * (0.95 - h), "contact": 0.02 * w, "gravity": -0.05 * w,
                "dissipated": 0.08 * w, "work": w, "error": 1e-7 * w * np.sin(300 * s),
            },
            **(dict.fromkeys(PAIRS, np.zeros(2)) | contact(s)), shape=strip_shape(s, out),
        )
        for s, f, w, h in zip(travel, force, work, share, strict=True)
    ]  # fmt: skip
    layout = Layout(
        panel=np.repeat(np.arange(1, 7), CELLS), pair_names=("1-2", "3-4"), thickness=3e-4,
        drive_names=tuple(f"crease {3 + k}" for k in range(drives)), dimension="spatial" if out else "planar",
    )  # fmt: skip
    run = Solution.from_records(records, layout)
    run.summary = summarise(run.force_curve, run.layout.pair_names, bent=2e-3 * peak)
    return run


def undriven(run: Solution) -> Solution:
    """The same run with its drives taken away."""
    none = np.zeros((len(run), 0))
    layout = Layout(panel=run.layout.panel, pair_names=run.layout.pair_names)
    return Solution(**{**vars(run), "travel": none, "force": none, "layout": layout, "summary": {}})


def words(fig: Figure) -> str:
    """All texts of a figure."""
    texts = [text.get_text() for text in fig.findobj(matplotlib.text.Text)]
    return "\n".join(text for text in texts if text)


def ink(path: Path) -> float:
    """Share of pixels that are not white."""
    with Image.open(path) as picture:
        return float((np.asarray(picture.convert("L")) < 250).mean())


def labels(fig: Figure) -> list[str]:
    return [ax.get_xlabel() for ax in fig.axes if ax.get_xlabel()] + [
        ax.get_ylabel() for ax in fig.axes if ax.get_ylabel()
    ]
