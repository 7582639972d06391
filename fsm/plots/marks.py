"""Stages and events of a pull, marked alike in every figure over travel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from fsm.plots.style import STAGE_COLOURS, rounded
from fsm.results.quantities import STAGES, Curve, summarise
from fsm.results.solution import Solution

__all__ = ["EVENTS", "shade_stages", "summary_with_stages"]

EVENTS = {"snap": ("v", "snap"), "motion": ("v", "snap"), "bifurcation": ("D", "bifurcation")}
"""Marker and name of every kind of event."""


def summary_with_stages(solution: Solution) -> dict[str, Any]:
    """The summary of a solution with a drive; of one that has none, that of its records."""
    if "stages" in solution.summary:
        return solution.summary
    return summarise(Curve.of(solution), solution.layout.pair_names)


def shade_stages(ax: Axes, stages: Sequence[dict[str, Any]], last: float) -> list[Patch]:
    """Bands over the travels of the stages, up to `last` (mm), behind all else; gives back what names them."""
    begins = [1e3 * stage["travel"] for stage in stages]
    patches: list[Patch] = []
    for stage, begin, end in zip(stages, begins, [*begins[1:], last], strict=True):
        colour = STAGE_COLOURS[STAGES.index(stage["name"]) if stage["name"] in STAGES else 0]
        ax.axvspan(begin, max(begin, end), color=colour, alpha=0.2, linewidth=0)
        name = stage["name"] if not patches else f"{stage['name']} from {rounded(begin)} mm"
        patches.append(Patch(facecolor=colour, alpha=0.35, label=name))
    return patches
