"""Channels of a result over travel or time, one diagram for each unit; those of `report`, and motorisation margins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from fsm.errors import CaseError
from fsm.results.channel import select_channels
from fsm.results.reported import ROUND_OFF, columns_of, reactions, shown_name
from fsm.results.solution import Solution
from fsm.views.plots import style as look
from fsm.views.plots.drawing import line_width, points

Diagrams = dict[tuple[str, str], dict[str, np.ndarray]]
_MOST = len(look.COLOURS) * len(look.DASHES)
"""Largest number of lines of a diagram with different colours and dashes."""
_HEIGHT = 2.4
"""Height of one diagram, inches."""
QUANTITY = {
    "m": "length", "rad": "angle", "m/s": "velocity", "rad/s": "angular velocity", "1/m": "curvature", "N": "force",
    "N m": "moment", "J": "energy", "Pa": "stress", "m^2": "area", "m/s^2": "acceleration",
    "m^3": "volume", "s": "time", "W": "power", "kg": "mass", "Hz": "frequency", "N/m": "force per length",
    "K": "temperature",
}  # fmt: skip
"""Quantity that a unit measures, for the axis."""


def plot_channels(solution: Solution, patterns: Sequence[str], path: str | Path, over_time: bool = False) -> list[str]:
    """Draw all channels that match any of the patterns.

    Parameters
    ----------
    solution : Solution
    patterns : patterns of names, as in `[save] channels`
    path : file of the figure
    over_time : draw over time also if there is a drive

    Returns
    -------
    list of str
        Names of the channels in the figure.

    Raises
    ------
    CaseError
        A pattern matches no channel of the result.
    """
    names, faults = select_channels(solution.channels, patterns, "--channel")
    if faults and not solution.channels:
        raise CaseError("the result has no channels; list them in the key `channels` of [save], and run the case again")
    if faults:
        raise CaseError(faults)
    diagrams: Diagrams = {}
    for name in names:
        channel = solution.channels[name]
        unit = channel.info.unit
        diagrams.setdefault((unit, QUANTITY.get(unit, "value")), {}).update(channel.columns)
    draw_diagrams(path, *((solution.time, "time (s)") if over_time else look.abscissa(solution)), diagrams)
    return names


def draw_diagrams(
    path: str | Path, x: np.ndarray, label: str, diagrams: Diagrams, marks: Mapping[str, Sequence[float]] | None = None
) -> None:
    """Draw curves over a common abscissa, in diagrams below each other.

    Parameters
    ----------
    path : file of the figure
    x, label : abscissa (n,) and its label
    diagrams : values (n,) in SI units by name, for each diagram by its unit and quantity
    marks : abscissas of vertical lines by their name, in all diagrams
    """
    with look.figure(path, (look.WIDE[0], 0.6 + _HEIGHT * len(diagrams))) as fig:
        axes = fig.subplots(len(diagrams), 1, sharex=True, squeeze=False)[:, 0]
        for ax, ((unit, quantity), columns) in zip(axes, diagrams.items(), strict=True):
            shown = look.figure_unit(unit, [*columns.values()])
            for k, (name, values) in enumerate(columns.items()):
                colour, dashes = line_of(k, len(columns))
                ax.plot(
                    x, shown.factor * values, dashes, color=colour, linewidth=line_width(1.0), label=look.shortened(name)
                )
            ax.set_ylabel(f"{quantity} ({shown.name})" if unit != "1" else quantity)
            ax.margins(x=0)
            for name, places in (marks or {}).items():
                style = {"color": look.GREY, "linewidth": line_width(0.7), "linestyle": ":", "zorder": 1.0}
                for k, place in enumerate(places):
                    ax.axvline(place, label="_" if k else name, **style)
            name_lines(fig, ax)
        axes[-1].set_xlabel(label)


def line_of(k: int, count: int) -> tuple[str, str]:
    """Colour and dashes of a line, different for all lines; many lines have colours of a map in their order."""
    if count <= _MOST:
        return look.COLOURS[k % len(look.COLOURS)], look.DASHES[k // len(look.COLOURS)]
    return to_hex(matplotlib.colormaps["viridis"](0.92 * k / (count - 1))), "-"


def name_lines(fig: Figure, ax: Axes) -> None:
    """Name the lines beside a diagram, or above it if the names are long; if there are many lines, name the first,
    middle and last.
    """
    lines = [line for line in ax.lines if not str(line.get_label()).startswith("_")]
    if len(lines) > _MOST:
        lines = [lines[0], lines[len(lines) // 2], lines[-1]]
    names = [str(line.get_label()) for line in lines]
    size = matplotlib.rcParams["legend.fontsize"]
    widest = max(look.name_width(name, size) for name in names) / 72.0
    if widest < 0.25 * fig.get_figwidth() and len(names) * look.ROW_HEIGHT * size / 72.0 < _HEIGHT:
        ax.legend(lines, names, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
        return
    columns = max(1, int(0.8 * fig.get_figwidth() / (widest + look.HANDLE_WIDTH * size / 72.0)))
    rows = -(-len(names) // columns)
    fig.set_figheight(fig.get_figheight() + rows * look.ROW_HEIGHT * size / 72.0)
    ax.legend(lines, names, loc="lower left", bbox_to_anchor=(0.0, 1.01), borderaxespad=0.0, ncols=columns)


def plot_report(solution: Solution, path: str | Path) -> None:
    """Draw the diagrams of `report_diagrams` over time, with dotted lines where latches close and open."""
    marks: dict[str, list[float]] = {}
    for event in solution.summary.get("joint_events", ()):
        if event["what"].startswith("latch"):
            marks.setdefault(event["what"], []).append(event["time"])
    draw_diagrams(path, solution.time, "time (s)", report_diagrams(solution), marks)


def report_diagrams(solution: Solution) -> Diagrams:
    """Channels of `report`, one diagram for each unit; without `report` in the case, then the sizes of the reactions of all
    ideal joints.
    """
    labels = [str(row["name"]) for row in solution.summary.get("report", ())]
    diagrams: Diagrams = {}
    for label, (unit, values) in columns_of(solution.channels, labels).items():
        diagrams.setdefault((unit, QUANTITY.get(unit, "value")), {})[shown_name(label)] = values
    if not solution.layout.case.get("report"):
        for name, sizes in reactions(solution.channels).items():
            for kind, unit, values in zip(("force", "moment"), ("N", "N m"), sizes, strict=True):
                if values.max(initial=0.0) > ROUND_OFF:
                    diagrams.setdefault((unit, f"{kind} of joints"), {})[name] = values
    return diagrams


def plot_margin(solution: Solution, path: str | Path) -> None:
    """Draw the available moment of every joint over its angle, dashed the required one, and a dot at the smallest margin."""
    rows = solution.summary["margins"]
    unit = look.figure_unit("N m", [max(max(row["curve"]["available"]), max(row["curve"]["required"])) for row in rows])
    turn = look.figure_unit("rad", [max(map(abs, row["curve"]["angle"])) for row in rows])
    with look.figure(path, (look.WIDE[0], 3.2)) as fig:
        ax = fig.add_subplot()
        for k, row in enumerate(rows):
            curve = {key: np.array(values) for key, values in row["curve"].items()}
            colour, _ = line_of(k, len(rows))
            angle = turn.factor * curve["angle"]
            text = "none required" if row["margin"] is None else look.rounded(row["margin"])
            style = {"color": colour, "linewidth": line_width(1.2)}
            ax.plot(angle, unit.factor * curve["available"], label=f"{look.shortened(row['joint'])}: margin {text}", **style)
            ax.plot(angle, unit.factor * curve["required"], "--", label="_", **style)
            ax.plot(turn.factor * row["angle"], unit.factor * row["available"], "o", color=colour, markersize=points(4.0))
        ax.plot([], [], color=look.GREY, label="available")
        ax.plot([], [], "--", color=look.GREY, label="required")
        ax.set_xlabel(f"angle ({turn.name})")
        ax.set_ylabel(f"moment ({unit.name})")
        ax.set_ylim(bottom=0.0)
        if rows[0]["curve"]["angle"][0] > rows[0]["curve"]["angle"][-1]:
            ax.invert_xaxis()  # the motion is to the right
        name_lines(fig, ax)
