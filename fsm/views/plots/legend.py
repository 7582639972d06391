"""Legends that name all curves and fit the width of the figure."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Literal

import matplotlib
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

from fsm.views.plots.drawing import points

HANDLE_WIDTH = 4.8
"""Width of the line sample and the gaps of a legend entry, in font sizes."""
ROW_HEIGHT = 1.6
"""Height of a text line in a legend entry, in font sizes."""
_AXIS_WIDTH = 70.0
"""Width of the axis with its label and the margins, in points."""


def add_legend(fig: Figure, ax: Axes) -> None:
    """Add a legend inside the axes, beside them, or below them, depending on the room.

    A legend below the axes increases the height of the figure. Long names are wrapped.
    """
    size = matplotlib.rcParams["legend.fontsize"]
    room = 72.0 * fig.get_figwidth() - points(_AXIS_WIDTH)
    handles, names = ax.get_legend_handles_labels()
    names = [_wrapped(name, size, room - HANDLE_WIDTH * size) for name in names]
    column = HANDLE_WIDTH * size + max(name_width(name, size) for name in names)
    inside, beside = min(2, len(names)), 1 + (len(names) - 1) // 20
    if len(names) <= 8 and inside * column <= room:
        ax.set_ylim(top=ax.get_ylim()[1] + 0.04 * (len(names) + 1) * (ax.get_ylim()[1] - ax.get_ylim()[0]))
        ax.legend(handles, names, loc="upper right", ncols=inside)
    elif len(names) > 8 and beside * column <= 0.5 * room:
        fig.legend(handles, names, loc="outside right upper", ncols=beside)
    else:
        columns = min(len(names), max(1, int(room / column)))
        lines = sum(name.count("\n") + 1 for name in names)
        fig.set_figheight(fig.get_figheight() + ROW_HEIGHT * size * -(-lines // columns) / 72.0)
        fig.legend(handles, names, loc="outside lower left", ncols=columns)


def add_legend_across(fig: Figure, handles: Sequence[Artist], side: Literal["upper", "lower"], columns: int = 3) -> None:
    """Add a legend above or below all axes, with at most `columns` columns that fit the width of the figure.

    The height of the legend is added to the figure, so the axes keep their size.
    """
    for ncols in range(min(columns, len(handles)), 0, -1):
        place = {"loc": f"outside {side} center", "ncols": ncols}
        legend = fig.legend(handles=handles, **place, columnspacing=1.2, handlelength=1.4)
        box = legend.get_window_extent()
        if box.width <= fig.bbox.width or ncols == 1:
            fig.set_figheight(fig.get_figheight() + box.height / fig.dpi)
            return
        legend.remove()


def _wrapped(name: str, size: float, width: float) -> str:
    """Wrap a name into lines of at most `width` points."""
    letters = len(name)
    lines = [name]
    while letters > 1 and max(name_width(line, size) for line in lines) > width:
        letters = min(letters - 1, int(letters * width / max(name_width(line, size) for line in lines)))
        lines = textwrap.wrap(name, max(1, letters))
    return "\n".join(lines)


def name_width(name: str, size: float) -> float:
    """Width of the widest line of a name, points."""
    font = FontProperties(size=size)
    return max(float(text_to_path.get_text_width_height_descent(line, font, False)[0]) for line in name.split("\n"))
