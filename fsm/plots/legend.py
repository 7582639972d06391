"""A legend that names every curve and is never wider than its figure."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Literal

import matplotlib
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.textpath import TextPath

__all__ = ["add_legend", "add_legend_across"]

_BESIDE = 4.8
"""What stands beside a name in its column, in font sizes: the piece of line, and gaps."""
_ROW = 1.6
"""Height of a line of a name, in font sizes."""
_AXIS = 70.0
"""Width that the axis, its label and the margins take, points."""


def add_legend(fig: Figure, ax: Axes) -> None:
    """Name the curves of the axes: in them, beside them, or below them in a figure made taller, whichever has the room.

    Names too long for a line go on in the next one.
    """
    size = matplotlib.rcParams["legend.fontsize"]
    room = 72.0 * fig.get_figwidth() - _AXIS
    handles, names = ax.get_legend_handles_labels()
    names = [_wrapped(name, size, room - _BESIDE * size) for name in names]
    column = _BESIDE * size + max(_width(name, size) for name in names)
    inside, beside = min(2, len(names)), 1 + (len(names) - 1) // 20
    if len(names) <= 8 and inside * column <= room:
        ax.set_ylim(top=ax.get_ylim()[1] + 0.04 * (len(names) + 1) * (ax.get_ylim()[1] - ax.get_ylim()[0]))
        ax.legend(handles, names, loc="upper right", ncols=inside)
    elif len(names) > 8 and beside * column <= 0.5 * room:
        fig.legend(handles, names, loc="outside right upper", ncols=beside)
    else:
        columns = min(len(names), max(1, int(room / column)))
        lines = sum(name.count("\n") + 1 for name in names)
        fig.set_figheight(fig.get_figheight() + _ROW * size * -(-lines // columns) / 72.0)
        fig.legend(handles, names, loc="outside lower left", ncols=columns)


def add_legend_across(fig: Figure, handles: Sequence[Artist], side: Literal["upper", "lower"], columns: int = 3) -> None:
    """Name handles above or below all axes, in as many columns, up to `columns`, as the figure is wide.

    The figure is made taller by the legend, so that the axes keep their room.
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
    """The name in lines of at most this width, points."""
    letters = len(name)
    lines = [name]
    while letters > 1 and max(_width(line, size) for line in lines) > width:
        letters = min(letters - 1, int(letters * width / max(_width(line, size) for line in lines)))
        lines = textwrap.wrap(name, max(1, letters))
    return "\n".join(lines)


def _width(name: str, size: float) -> float:
    """Of the widest line, points."""
    return max(float(TextPath((0.0, 0.0), line, size=size).get_extents().width) for line in name.split("\n"))
