"""Common style of all figures: sizes, colours for colour-blind readers, units and rounding of labels.

`fsm.views.plots.drawing` selects the style and the file format.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter
from numpy.typing import ArrayLike

from fsm.io.atomic_write import atomic_write
from fsm.results.film import Floats
from fsm.results.solution import Solution
from fsm.text.shown_units import ShownUnit, shown_unit
from fsm.views.plots.drawing import line_width, points
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


@contextmanager
def figure(path: str | Path, size: tuple[float, float] = SINGLE) -> Iterator[Figure]:
    """Figure in the common style, saved to `path` (png, pdf, svg) if the block ends without an error.

    Parameters
    ----------
    path : path of the file; its folder is created
    size : (width, height), inches
    """
    path = Path(path)
    with matplotlib.rc_context(styled()):
        fig = Figure(figsize=size, layout="constrained")
        FigureCanvasAgg(fig)
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
