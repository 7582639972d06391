"""Common style of all figures: sizes, colours for colour-blind readers, units and rounding of labels.

`fsm.views.plots.drawing` selects the style and the file format.

Legends that name all curves and fit the width of the figure.

Marks of stages and events, common to all figures over travel.
"""

from __future__ import annotations

import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, NamedTuple

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Patch
from matplotlib.textpath import text_to_path
from matplotlib.ticker import LogFormatter
from numpy.typing import ArrayLike

from fsm.io.atomic_write import atomic_write
from fsm.results.film import Floats
from fsm.results.quantities import STAGES, bent_energy, summarise
from fsm.results.solution import Solution
from fsm.text.shown_units import ShownUnit, shown_unit
from fsm.views.plots.drawing import line_width, points, selected
from fsm.views.plots.png import write_png

# palette of Okabe and Ito (2008), for all common kinds of colour blindness
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442")
DASHES = ("-", "--", "-.", ":")
"""Line styles for curves of the same colour."""
GREY = "#666666"
_RESTS = 0.2
"""Part of the records in which the first drive rests, above which the time is the abscissa."""

SINGLE = (4.8, 3.4)
WIDE = (7.2, 4.6)
"""Figure sizes in inches, for a column and for the width of a page: 122 mm and 183 mm."""

STYLE: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.0,
    "text.parse_math": False,  # names may contain a $ character, which Matplotlib would read as a formula
    "text.hinting": "none",  # this effect is not visible at 200 dpi, and takes a twentieth of the drawing time
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "axes.titley": 1.0,  # Matplotlib would search for ticks above the axes, which takes a third of the drawing time
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": False,
    "axes.prop_cycle": matplotlib.cycler(color=COLOURS),
    "savefig.dpi": 200,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}
_LETTERS = ("font.size", "axes.labelsize", "axes.titlesize", "xtick.labelsize", "ytick.labelsize", "legend.fontsize")
_LINES = ("lines.linewidth", "axes.linewidth")


def styled() -> dict[str, Any]:
    """Settings of Matplotlib for the selected style."""
    factors = dict.fromkeys(_LETTERS, points(1.0)) | dict.fromkeys(_LINES, line_width(1.0))
    return {name: value * factors[name] if name in factors else value for name, value in STYLE.items()}


class _Plain(LogFormatter):
    """Axis labels as plain numbers at Matplotlib's positions; Matplotlib's own labels are formulas, which are not parsed
    here.
    """

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x:g}" if super().__call__(x, pos) else ""


def label_decades(axis: Axis) -> None:
    """Label a logarithmic axis in plain numbers."""
    axis.set_major_formatter(_Plain())
    axis.set_minor_formatter(_Plain(minor_thresholds=(1.0, 0.4)))


class Grid(NamedTuple):
    """Axes of a figure.

    Attributes
    ----------
    rows, columns : int
    shared : str
        Coordinates that all axes have in common: "", "x" or "xy".
    heights : tuple of float
        Relative heights of the rows; equal if empty.
    """

    rows: int = 1
    columns: int = 1
    shared: str = ""
    heights: tuple[float, ...] = ()


_TICKS = 9
"""Number of ticks of each prepared axis; further ones are made when they are needed."""
_prepared: dict[tuple[tuple[str, str], Grid], list[Figure]] = {}
"""Figures by style, format and grid."""


def prepare(*grids: Grid) -> None:
    """Make figures with empty axes and their ticks for later calls of `figure`, a third of the time of a figure."""
    with matplotlib.rc_context(styled()):
        for grid in grids:
            fig = _with_axes(grid)
            for ax in fig.axes:
                for axis in (ax.xaxis, ax.yaxis):
                    axis.get_major_ticks(_TICKS)
            _prepared.setdefault((selected(), grid), []).append(fig)


def _with_axes(grid: Grid | None) -> Figure:
    fig = Figure(layout="constrained")
    FigureCanvasAgg(fig)
    if grid is not None:
        shared, heights = {f"share{name}": True for name in grid.shared}, grid.heights or None
        fig.subplots(grid.rows, grid.columns, height_ratios=heights, **shared)
    return fig


@contextmanager
def figure(path: str | Path, size: tuple[float, float] = SINGLE, grid: Grid | None = None) -> Iterator[Figure]:
    """Figure in the common style, saved to `path` (png, pdf, svg) if the block ends without an error.

    Parameters
    ----------
    path : path of the file; its folder is created
    size : (width, height), inches
    grid : axes of the figure, row by row; none if omitted
    """
    path = Path(path)
    with matplotlib.rc_context(styled()):
        made = _prepared.get((selected(), grid)) if grid is not None else None
        fig = made.pop() if made else _with_axes(grid)
        fig.set_size_inches(size)
        yield fig
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as part, warnings.catch_warnings():
            warnings.filterwarnings("ignore", r"Glyph \d+ .* missing", UserWarning)  # these entries are drawn as boxes
            _save(fig, part)


def _save(fig: Figure, path: Path) -> None:
    """Save a figure. For a PNG file `savefig` would draw twice, and also store that all pixels are opaque."""
    if path.suffix != ".png":
        fig.savefig(path)
        return
    dpi = matplotlib.rcParams["savefig.dpi"]
    fig.set_dpi(dpi)
    engine = fig.get_layout_engine()
    if engine is not None:
        engine.execute(fig)
        fig.set_layout_engine(None)
    canvas = FigureCanvasAgg(fig)
    canvas.draw()
    write_png(path, np.asarray(canvas.buffer_rgba())[..., :3], dpi)


def abscissa(solution: Solution) -> tuple[Floats, str]:
    """Abscissa of curves with its label: travel or turn of the first drive, or time without a drive."""
    if not solution.travel.shape[1]:
        return solution.time, "time (s)"
    unit = drive_units(solution)[1]
    return unit.factor * solution.travel[:, 0], travel_label(solution.layout.turns(), unit)


def travel_label(turning: bool, unit: ShownUnit) -> str:
    """Label of travels or turns of a drive."""
    return "turns" if unit.name == "turns" else f"{'turn' if turning else 'travel'} ({unit.name})"


def travels_over(label: str) -> bool:
    """Whether the label of an abscissa is that of a drive."""
    return label.startswith(("travel", "turn"))


def drive_units(solution: Solution, drives: Sequence[int] = (0,)) -> tuple[ShownUnit, ShownUnit]:
    """Units of force and travel of drives of one kind in figures; of moment and turn, if they turn; SI without a drive."""
    curve, turns = solution.force_curve, solution.layout.turns(drives[0])
    own = [drive for drive in drives if drive < len(solution.layout.drive_names)]
    force = curve.force[~curve.dynamic] if curve.has_quasi_static else curve.force
    travel = solution.travel if len(solution) else curve.travel
    return (
        figure_unit("N m" if turns else "N", force[:, own]),
        figure_unit("rad" if turns else "m", travel[:, own]),
    )


def figure_unit(si: str, values: ArrayLike) -> ShownUnit:
    """Unit of values (SI) in figures, by the largest magnitude."""
    finite = np.abs(np.asarray(values, dtype=float))
    factor, name = shown_unit(si, float(np.max(finite, where=np.isfinite(finite), initial=0.0)))
    return ShownUnit(factor, f"µ{name[1:]}" if name.startswith("u") else name.replace("^3", "³"))


def evolution(solution: Solution) -> tuple[Floats, str]:
    """As `abscissa`, but the time if the first drive rests in more than a fifth of the records, as before an impact.

    If the run has several steps, each step then has the same width, so that a slow pull and a short impact are both visible.
    """
    x, label = abscissa(solution)
    if not solution.travel.shape[1] or not len(solution):
        return x, label
    if np.count_nonzero(np.diff(solution.travel[:, 0]) == 0.0) <= _RESTS * len(x):
        return x, label
    parts = steps_of(solution)
    if len(parts) < 2:
        return solution.time, "time (s)"
    times = [_relative(solution, rows) for _, rows in parts]
    x = np.concatenate([k + part for k, (_, part) in enumerate(times)])
    named = [f"{name} ({rounded(length)} s)" for (name, _), (length, _) in zip(parts, times, strict=True)]
    return x, "step: " + ", ".join(named)


def steps_of(solution: Solution) -> list[tuple[str, slice]]:
    """Names and records of the steps of a run; no steps in older files."""
    if len(solution.step) != len(solution) or not solution.layout.step_names:
        return []
    ends = np.flatnonzero(np.diff(solution.step)) + 1
    bounds = [0, *ends.tolist(), len(solution)]
    return [
        (solution.layout.step_names[int(solution.step[a]) - 1], slice(a, b)) for a, b in pairwise(bounds)
    ]


def _relative(solution: Solution, rows: slice) -> tuple[float, Floats]:
    """Length of a step, s, and times of its records since its start, relative to this length."""
    time = solution.time[rows] - start_of_step(solution, rows)
    length = float(time[-1])
    return length, time / (length or 1.0)


def start_of_step(solution: Solution, rows: slice) -> float:
    """Time of the last record before a step, s."""
    return float(solution.time[max(rows.start - 1, 0)])


def shortened(name: str) -> str:
    """Shorten a name to at most 40 letters."""
    return name if len(name) <= 40 else f"{name[:25]}...{name[-12:]}"


def rounded(value: float) -> str:
    """Text of a number with three significant digits, including trailing zeros: 2.00, 27.1, 150, 4200."""
    if 999.5 <= abs(value) < 99950.0:
        return f"{float(f'{value:.3g}'):.0f}"
    return f"{value:#.3g}".rstrip(".") if value else "0"


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
