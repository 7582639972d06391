"""Marks of stages and events, common to all figures over travel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from fsm.results.quantities import STAGES, bent_energy, summarise
from fsm.results.solution import Solution
from fsm.text.shown_units import ShownUnit
from fsm.views.plots.drawing import line_width
from fsm.views.plots.style import rounded

EVENTS = {
    **dict.fromkeys(("snap", "damped snap", "motion", "unstable"), ("v", "snap")),
    "release": ("s", "release"),
    "bifurcation": ("D", "bifurcation"),
}
"""Marker and name of every kind of event that figures mark; a "vibration" is not marked."""

_GREY = "#7F7F7F"
_SHADES = (0.05, 0.42, 0.2)
"""Opacities of the stages, in the order of `STAGES`."""


def summary_with_stages(solution: Solution) -> dict[str, Any]:
    """Summary of a solution with a drive; computed from its curve if the stored summary has no stages."""
    if "stages" in solution.summary:
        return solution.summary
    return summarise(solution.force_curve, solution.layout.pair_names, bent_energy(solution.layout.case))


def stage_name(stage: dict[str, Any], unit: ShownUnit, first: bool = False) -> str:
    """Name of a stage with the travel at its beginning; the `first` stage has the name alone."""
    return str(stage["name"]) if first else f"{stage['name']} from {rounded(unit.factor * stage['travel'])} {unit.name}"


def stage_shade(stage: dict[str, Any]) -> tuple[str, float]:
    """Grey and opacity of a stage; neighbouring stages differ, and no curve has these greys."""
    return _GREY, _SHADES[STAGES.index(stage["name"]) if stage["name"] in STAGES else 0]


def shade_stages(ax: Axes, stages: Sequence[dict[str, Any]], last: float, unit: ShownUnit) -> list[Patch]:
    """Shade the travels of several stages up to `last` in the background; return the legend entries.

    `last` and the axis are in the unit of travels.
    """
    if len(stages) < 2:
        return []
    begins = [unit.factor * stage["travel"] for stage in stages]
    patches: list[Patch] = []
    for stage, begin, end in zip(stages, begins, [*begins[1:], last], strict=True):
        colour, alpha = stage_shade(stage)
        ax.axvspan(begin, max(begin, end), color=colour, alpha=alpha, linewidth=0)
        name = stage_name(stage, unit, not patches)
        patches.append(Patch(facecolor=(colour, alpha), edgecolor=colour, linewidth=line_width(0.4), label=name))
    return patches
