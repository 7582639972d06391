"""Figure of motorisation margins: available and required moment of joints over their angles."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fsm.results.solution import Solution
from fsm.views.plots.channels import line_of, name_lines
from fsm.views.plots.drawing import line_width, points
from fsm.views.plots.style import GREY, WIDE, figure, figure_unit, rounded, shortened


def plot_margin(solution: Solution, path: str | Path) -> None:
    """Draw the available moment of every joint over its angle, dashed the required one, and a dot at the smallest margin."""
    rows = solution.summary["margins"]
    unit = figure_unit("N m", [max(max(row["curve"]["available"]), max(row["curve"]["required"])) for row in rows])
    turn = figure_unit("rad", [max(map(abs, row["curve"]["angle"])) for row in rows])
    with figure(path, (WIDE[0], 3.2)) as fig:
        ax = fig.add_subplot()
        for k, row in enumerate(rows):
            curve = {key: np.array(values) for key, values in row["curve"].items()}
            colour, _ = line_of(k, len(rows))
            angle, text = turn.factor * curve["angle"], "none required" if row["margin"] is None else rounded(row["margin"])
            style = {"color": colour, "linewidth": line_width(1.2)}
            ax.plot(angle, unit.factor * curve["available"], label=f"{shortened(row['joint'])}: margin {text}", **style)
            ax.plot(angle, unit.factor * curve["required"], "--", label="_", **style)
            ax.plot(turn.factor * row["angle"], unit.factor * row["available"], "o", color=colour, markersize=points(4.0))
        ax.plot([], [], color=GREY, label="available")
        ax.plot([], [], "--", color=GREY, label="required")
        ax.set_xlabel(f"angle ({turn.name})")
        ax.set_ylabel(f"moment ({unit.name})")
        ax.set_ylim(bottom=0.0)
        if rows[0]["curve"]["angle"][0] > rows[0]["curve"]["angle"][-1]:
            ax.invert_xaxis()  # the motion is to the right
        name_lines(fig, ax)
