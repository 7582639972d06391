"""Energies over travel, and the energy balance residual."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from fsm.results.film import Floats
from fsm.results.solution import Solution
from fsm.views.plots.drawing import line_width
from fsm.views.plots.style import COLOURS, GREY, WIDE, Grid, evolution, figure, figure_unit

STACK = {
    "creases": ("creases", COLOURS[0]),
    "panels": ("panels", COLOURS[1]),
    "bars": ("bars", "#332288"),
    "hinges": ("hinges", COLOURS[2]),
    "film": ("film", "#88CCEE"),
    "patch": ("patches", "#AA4499"),
    "cable": ("cables", "#117733"),
    "beam": ("beams", "#882255"),
    "gas": ("gas", "#661100"),
    "contact": ("contact", COLOURS[3]),
    "drives": ("drives", COLOURS[7]),
    "gravity": ("gravity", "#A6761D"),
    "kinetic": ("kinetic", COLOURS[4]),
    "dissipated": ("dissipated", "#999999"),
    "numerical": ("numerical dissipation", "#666666"),
}
"""Label and colour of the stacked energies, from below: all of `ENERGIES` except work and error."""
GRID = Grid(2, 1, "x", (2.6, 1.0))
"""Axes of the energies, and of the energy balance residual."""
_VISIBLE = 2e-3
"""Largest value of an energy, relative to the height of the stack, below which the energy is too thin to be seen."""


def plot_energy(solution: Solution, path: str | Path) -> None:
    """Draw the stacked energy changes since the start with the work done, and the energy balance residual below.

    An energy that has fallen since the start is stacked below zero, and its decrease is added to the work.
    If the energy is balanced, the dashed line is the top of the stack. Energies that stay zero are not drawn.
    """
    x, label = evolution(solution)
    changes = {name: solution.energy[name] - solution.energy[name][0] for name in STACK}
    work = solution.energy["work"] - solution.energy["work"][0]
    factor, unit = figure_unit("J", [work, *changes.values()])
    with figure(path, (WIDE[0], 5.0), GRID) as fig:
        top, bottom = fig.axes
        thin = _draw_stack(top, x, {name: values * factor for name, values in changes.items()})
        released = -sum(np.minimum(values, 0.0) for values in changes.values())
        visible = np.any(released > 1e-3 * np.max(np.abs(work)))
        name = "work done and\nenergy released" if visible else "work done"
        top.plot(x, (work + released) * factor, "--", color="black", linewidth=line_width(1.2), label=name)
        top.axhline(0, color=GREY, linewidth=line_width(0.6))
        top.set_ylabel(f"energy since the start ({unit})")
        top.margins(x=0)
        handles = top.get_legend_handles_labels()[0][::-1]
        if thin:
            text = f"each below {100 * _VISIBLE:g} %:\n" + ",\n".join(thin)
            handles.append(Line2D([], [], linestyle="none", label=text))
        fig.legend(handles=handles, loc="outside right upper")
        _draw_error(bottom, x, solution.energy["error"])
        bottom.set_xlabel(label)


def _draw_stack(ax: Axes, x: Floats, changes: dict[str, Floats]) -> list[str]:
    """Draw the stack; return the names of energies that are drawn, but too thin to be seen."""
    largest = max(float(np.max(np.abs(values), initial=0.0)) for values in changes.values())
    thin = []
    above, below = np.zeros_like(x), np.zeros_like(x)
    for name, values in changes.items():
        if not np.any(np.abs(values) > 1e-9 * largest):
            continue
        text, colour = STACK[name]
        high, low = above + np.maximum(values, 0.0), below + np.minimum(values, 0.0)
        visible = np.any(np.abs(values) > _VISIBLE * largest)
        ax.fill_between(x, above, high, color=colour, linewidth=0, label=text if visible else None)
        thin += [] if visible else [text]
        ax.fill_between(x, below, low, color=colour, linewidth=0)
        above, below = high, low
    return thin


def _draw_error(ax: Axes, x: Floats, error: Floats) -> None:
    factor, unit = figure_unit("J", error)
    ax.axhline(0, color=GREY, linewidth=line_width(0.6))
    ax.plot(x, error * factor, color=COLOURS[6], linewidth=line_width(1.0))
    ax.set_ylabel(f"balance residual ({unit})")
