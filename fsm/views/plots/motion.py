"""Figure of the motion: the shape of the structure at six travels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from fsm.results.film import Floats
from fsm.results.solution import JOINT_AXIS, Solution
from fsm.views.plots import style as look
from fsm.views.plots.drawing import line_width, points
from fsm.views.plots.obstacles import obstacle_outlines
from fsm.views.plots.parts import OBSTACLE, colours_of_parts, handles_of_parts, lattice_squares, panels_of, vertical_axis
from fsm.views.plots.space import arrange_in_space, draw_in_space, height_in_space
from fsm.views.plots.style import add_legend_across, summary_with_stages

GRID = look.Grid(2, 3, "xy")
"""Axes of a motion in the plane with all its pictures."""
_IDLE = 1e-4
"""Largest force of a drive relative to that of another drive, below which it has no force."""
_PAD = 0.05
"""Distance between pictures in the plane and their labels, inches."""
_TITLE = 0.3
"""Height of a title in space, inches."""


def plot_motion(solution: Solution, path: str | Path, views: int = 6) -> None:
    """Draw the shape at up to `views` travels, see `pick_records`. All pictures have the same scale.

    With a drive, the title has the travel, the force, and the stage if there are several. The legend names the panels,
    bodies and other parts.
    A plane motion is drawn in its plane, the x-z plane or for a scissor array the x-y plane. In this plane a plate is a
    line in the colour of its panel, without thickness, and a square of a lattice is a square. Other motions are drawn in
    space, with the outlines of facets. Obstacles are light grey. A body without a shape is drawn by lines from its centre
    of mass to its joints; the axis of a joint is a short line, a dot in the plane of motion.
    """
    chosen = pick_records(solution, views)
    stages = _stages(solution)
    columns = 3 if len(chosen) > 2 else max(len(chosen), 1)
    rows = max(1, -(-len(chosen) // columns))
    space = leaves_plane(solution.shape)
    everything, view = _extent(solution), _view(solution)
    if len(everything) and not space:
        everything = np.array([everything.min(axis=0), everything.max(axis=0)])
    title = points(_TITLE) + (points(0.16) if len(stages) > 1 else 0.0)
    height = _height(everything, columns, rows, title, space)
    handles = handles_of_parts(solution)
    if len(chosen) and obstacle_outlines(solution, chosen[0], *view):
        handles.append(Patch(facecolor=OBSTACLE, label="obstacles"))
    grid = None if space or not chosen else GRID._replace(rows=rows, columns=columns)
    with look.figure(path, (look.WIDE[0], height), grid) as fig:
        fig.set_layout_engine(None)
        for ax in fig.axes[len(chosen) :]:
            ax.remove()
        for k, record in enumerate(chosen):
            text = _title(solution, record, stages)
            if space:
                draw_in_space(fig, solution, record, everything, view, text)
                continue
            ax = fig.axes[k]
            unit = _draw_plane(ax, solution, record, everything, view)
            ax.set_title(text)
            lowest, leftmost = k + columns >= len(chosen), k % columns == 0
            _label(ax.xaxis, f"x ({unit})" if lowest else "")
            _label(ax.yaxis, f"{vertical_axis(solution)} ({unit})" if leftmost else "")
            ax.tick_params(labelbottom=lowest, labelleft=leftmost)
        if len(handles) > 1:
            add_legend_across(fig, handles, "lower", columns=6)
        below = fig.get_figheight() - height
        if space:
            arrange_in_space(fig, columns, rows, below, title)
        else:
            _arrange_plane(fig, columns, rows, below)


def pick_records(solution: Solution, views: int = 6) -> list[int]:
    """Indices of `views` records or fewer: equally spaced, with the first and the last.

    If a drive moves to the end, the records at the peak force and at the beginning of stages replace their nearest
    neighbours.
    """
    x, label = look.evolution(solution)
    if len(x) == 0:
        return []
    chosen = [int(np.argmin(np.abs(x - value))) for value in np.linspace(x[0], x[-1], views)]
    chosen[0], chosen[-1] = 0, len(x) - 1
    if solution.force.shape[1] and views > 2 and look.travels_over(label):
        summary = summary_with_stages(solution)
        marked = [summary["peak_travel"], *(stage["travel"] for stage in summary["stages"][1:])]
        free, factor = list(range(1, len(chosen) - 1)), look.drive_units(solution)[1].factor
        for travel in marked[: len(free)]:
            record = int(np.argmin(np.abs(x - factor * travel)))
            if record in chosen:
                free = [place for place in free if chosen[place] != record]
            elif free:
                nearest = min(free, key=lambda place: abs(x[chosen[place]] - x[record]))
                chosen[nearest] = record
                free.remove(nearest)
    return sorted(set(chosen))


def _stages(solution: Solution) -> list[dict[str, Any]]:
    """Stages of a run; none where it is drawn over time."""
    over_travel = look.travels_over(look.evolution(solution)[1])
    return list(summary_with_stages(solution)["stages"]) if over_travel else []


def leaves_plane(shape: Floats) -> bool:
    """Whether plates move out of the x-z plane by more than 0.1 % of the size of the structure."""
    if shape.size == 0:
        return False
    size = float(np.max(np.ptp(shape.reshape(-1, 3), axis=0)))
    across = np.max(np.abs((shape[:, :, 3] - shape[:, :, 0])[..., [0, 2]]), initial=0.0)
    return bool(np.ptp(shape[..., 1].mean(axis=2)) > 1e-3 * size or across > 1e-3 * size)


def _height(extent: Floats, columns: int, rows: int, title: float, space: bool) -> float:
    """Height of the figure, inches, for pictures of equal scale that contain the points (n, 3)."""
    if extent.size == 0:
        return 3.0 * rows
    if space:
        return rows * height_in_space(columns, extent, title)
    width, height = np.ptp(extent[:, 0]), np.ptp(extent[:, 2])
    ratio = float(height / width) if width > 0 else 1.0
    return rows * (0.25 + title + float(np.clip((look.WIDE[0] - 0.7) / columns * ratio, 0.8, 3.4)))


def _arrange_plane(fig: Figure, columns: int, rows: int, below: float) -> None:
    """Put axes around the pictures in the plane; only the first column and the lowest picture of a column have labels."""
    if not fig.axes:
        return
    renderer: Any = fig.canvas.get_renderer()  # type: ignore[attr-defined, unused-ignore]
    width, height = fig.get_size_inches()  # a legend below takes `below` of it
    first, last = fig.axes[0], fig.axes[-1]
    left = _beside(first.yaxis.get_tightbbox(renderer), first, fig.dpi)[0] + _PAD
    lower = _beside(last.xaxis.get_tightbbox(renderer), last, fig.dpi)[1] + 2.0 * _PAD
    labelled = [lower if (row + 1) * columns + columns > len(fig.axes) else _PAD for row in range(rows)]
    title = max(ax.title.get_window_extent(renderer).height for ax in fig.axes) / fig.dpi + 2.0 * _PAD + 0.1
    side = (width - left - columns * _PAD) / columns
    high = (height - below - sum(labelled) - rows * title) / rows
    top = height
    for k, ax in enumerate(fig.axes):
        row, column = divmod(k, columns)
        if column == 0:
            top -= title + high + (labelled[row - 1] if row else 0.0)
        ax.set_position(((left + column * (side + _PAD)) / width, top / height, side / width, high / height))


def _beside(box: Any, ax: Axes, dpi: float) -> tuple[float, float]:
    """Widths of the parts of a box left of the axes and below them, inches."""
    inside = ax.get_window_extent()
    return (float(inside.x0 - box.x0) / dpi, float(inside.y0 - box.y0) / dpi) if box is not None else (0.0, 0.0)


def _title(solution: Solution, record: int, stages: list[dict[str, Any]]) -> str:
    """Title of a picture: travel and force, or time; in the second line the stage, if there are several."""
    label = look.evolution(solution)[1]
    if label.startswith("step"):
        name, rows = next((name, rows) for name, rows in look.steps_of(solution) if record < rows.stop)
        return f"{name}, {look.rounded(solution.time[record] - look.start_of_step(solution, rows))} s"
    if label == "time (s)":
        return f"{look.rounded(solution.time[record])} s"
    largest = np.abs(solution.force).max(axis=0)
    drive = int(np.argmax(largest > _IDLE * largest.max()))  # the first drive may only guide, without a force
    travel, force = solution.travel[record, drive], solution.force[:, drive]
    # a force as small as a residual of the solver is displayed as zero
    value = force[record] if abs(force[record]) > 1e-4 * np.max(np.abs(force)) else 0.0
    effort, way = look.drive_units(solution, [drive])
    text = f"{look.rounded(way.factor * travel)} {way.name}, {look.rounded(effort.factor * value)} {effort.name}"
    if len(stages) < 2:
        return text
    first = solution.travel[record, 0]
    stage = [one for one in stages if one["travel"] <= first * (1.0 + 1e-9) + 1e-12][-1]
    return f"{text}\n{stage['name']}"


def _view(solution: Solution) -> tuple[Floats, float]:
    """Centre of all plates and moving obstacles, and half the size of drawn planes, m."""
    everything = np.concatenate([solution.shape.reshape(-1, 3), *_moving_solids(solution)])
    if not len(everything):
        return np.zeros(3), 1.0
    low, high = everything.min(axis=0), everything.max(axis=0)
    return (low + high) / 2, 2.0 * float(np.linalg.norm(high - low))


def _extent(solution: Solution) -> Floats:
    """Points (n, 3), m, that all pictures contain: plates of all records, and bounded obstacles."""
    outlines = obstacle_outlines(solution, 0, *_view(solution)) if len(solution) else []
    bounded = [face for outline in outlines if outline.bounded for face in outline.faces]
    squares = lattice_squares(solution, solution.shape)
    seen = solution.shape if squares is None else squares
    return np.concatenate([seen.reshape(-1, 3), *bounded, *_moving_solids(solution)])


def _moving_solids(solution: Solution) -> list[Floats]:
    """Faces of the bounded obstacles that move with a body, in the records that are drawn."""
    return [
        face
        for record in pick_records(solution)
        for outline in obstacle_outlines(solution, record, np.zeros(3), 1.0)
        if outline.bounded and outline.moves
        for face in outline.faces
    ]


def _label(axis: Axis, text: str) -> None:
    """Label an axis. An empty label has a fixed place, because Matplotlib would measure all numbers of the axis to place a
    label.
    """
    axis.set_label_text(text)
    if not text:
        axis.set_label_coords(0.0, 0.0)


def _draw_plane(ax: Axes, solution: Solution, record: int, extent: Floats, view: tuple[Floats, float]) -> str:
    """Draw a record in its plane; return the unit of lengths."""
    factor, unit = look.figure_unit("m", np.ptp(extent, axis=0) if len(extent) else 0.0)
    outlines = obstacle_outlines(solution, record, *view)
    sections = [factor * outline.section[:, [0, 2]] for outline in outlines]
    ax.add_collection(_plates_in_plane(solution, record, factor))
    if sections:
        ax.add_collection(PolyCollection(sections, facecolors=OBSTACLE, edgecolors=OBSTACLE, alpha=0.5, zorder=0.5))
    if len(extent):
        low, high = (pick(extent, axis=0)[[0, 2]] * factor for pick in (np.min, np.max))
        margin = 0.05 * float(np.max(high - low))
        ax.set_xlim(low[0] - margin, high[0] + margin)
        ax.set_ylim(low[1] - margin, high[1] + margin)
    ax.set_aspect("equal", adjustable="box")
    return unit


def _plates_in_plane(solution: Solution, record: int, factor: float) -> LineCollection | PolyCollection:
    """Plates as lines; plates of a lattice as squares."""
    quads, colours = solution.shape[record] * factor, colours_of_parts(solution)
    squares = lattice_squares(solution, quads)
    if squares is not None:
        style = {"facecolors": colours, "edgecolors": "#42526A", "linewidths": line_width(0.4)}
        return PolyCollection(list(squares[..., [0, 2]]), **style)
    ends = np.stack([quads[:, [0, 3]].mean(axis=1), quads[:, [1, 2]].mean(axis=1)], axis=1)[..., [0, 2]]
    axes = panels_of(solution) == JOINT_AXIS
    if axes.any():
        ends[axes, 1] += 1e-4 * np.ptp(ends, axis=(0, 1)).max()  # a line without length would not be drawn
    widths = np.where(axes, line_width(4.0), line_width(1.8))
    return LineCollection(list(ends), colors=colours, linewidths=widths, capstyle="round")
