"""Figure of the motion: the shape of the structure at six travels."""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.proj3d import proj_transform

from fsm.plots.legend import add_legend_across
from fsm.plots.marks import stage_colour, stage_name, summary_with_stages
from fsm.plots.obstacles import ObstacleOutline, obstacle_outlines
from fsm.plots.plane import lattice_squares, vertical_axis
from fsm.plots.style import COLOURS, GREY, WIDE, evolution, figure, rounded, start_of_step, steps_of
from fsm.results.solution import BEAM, FILM, LINE, Floats, Integers, Solution

__all__ = ["leaves_plane", "pick_records", "plot_motion"]

_OF_FILMS = "#9ECAE1"
_FILLED = 0.76
"""Part of the width of a picture in space that the box around the structure fills."""
_PAD = 0.05
"""Distance between pictures in the plane and their labels, inches."""
_TITLE, _LABELS, _BELOW, _LEFT = 0.3, 0.16, 0.04, 0.07
"""Title height, inches. Relative to the width of a picture: height of the labels, additional label height below the box,
shift to the left for the label of z."""


def plot_motion(solution: Solution, path: str | Path, views: int = 6) -> None:
    """Draw the shape at up to `views` travels, see `pick_records`. All pictures have the same scale.

    With a drive, the background colour of a title names the stage.
    A plane motion is drawn in its plane, the x-z plane or for a scissor array the x-y plane. In this plane a plate is a
    line in the colour of its panel, without thickness, and a square of a lattice is a square. Other motions are drawn in
    space. Obstacles are grey.
    """
    chosen = pick_records(solution, views)
    stages = _stages(solution)
    columns = 3 if len(chosen) > 2 else max(len(chosen), 1)
    rows = max(1, -(-len(chosen) // columns))
    space = leaves_plane(solution.shape)
    everything, view = _extent(solution), _view(solution)
    height = _height(everything, columns, rows, space)
    with figure(path, (WIDE[0], height)) as fig:
        fig.set_layout_engine(None)
        for k, record in enumerate(chosen):
            if space:
                _draw_space(fig, solution, record, everything, view)
            else:
                first = fig.axes[0] if fig.axes else None
                ax = fig.add_subplot(rows, columns, k + 1, sharex=first, sharey=first)
                _draw_plane(ax, solution, record, everything, view)
                lowest, leftmost = k + columns >= len(chosen), k % columns == 0
                _label(ax.xaxis, "x (mm)" if lowest else "")
                _label(ax.yaxis, f"{vertical_axis(solution)} (mm)" if leftmost else "")
                ax.tick_params(labelbottom=lowest, labelleft=leftmost)
            if stages:
                _frame(fig.axes[-1], _stage_at(stages, float(solution.travel[record, 0])))
        if stages:
            handles = [_handle(stage, first=k == 0) for k, stage in enumerate(stages)]
            add_legend_across(fig, handles, "lower")
        (_arrange if space else _arrange_plane)(fig, columns, rows, fig.get_figheight() - height)


def pick_records(solution: Solution, views: int = 6) -> list[int]:
    """Indices of `views` records or fewer: equally spaced, with the first and the last.

    If a drive moves to the end, the records at the peak force and at the beginning of stages replace their nearest
    neighbours.
    """
    x, label = evolution(solution)
    if len(x) == 0:
        return []
    chosen = [int(np.argmin(np.abs(x - value))) for value in np.linspace(x[0], x[-1], views)]
    chosen[0], chosen[-1] = 0, len(x) - 1
    if solution.force.shape[1] and views > 2 and label == "travel (mm)":
        summary = summary_with_stages(solution)
        marked = [summary["peak_travel"], *(stage["travel"] for stage in summary["stages"][1:])]
        free = list(range(1, len(chosen) - 1))
        for travel in marked[: len(free)]:
            record = int(np.argmin(np.abs(x - 1e3 * travel)))
            if record in chosen:
                free = [place for place in free if chosen[place] != record]
            elif free:
                nearest = min(free, key=lambda place: abs(x[chosen[place]] - x[record]))
                chosen[nearest] = record
                free.remove(nearest)
    return sorted(set(chosen))


def _stages(solution: Solution) -> list[dict[str, Any]]:
    """Stages of a run; none where it is drawn over time."""
    over_travel = solution.travel.shape[1] and evolution(solution)[1] == "travel (mm)"
    return list(summary_with_stages(solution)["stages"]) if over_travel else []


def _stage_at(stages: list[dict[str, Any]], travel: float) -> dict[str, Any]:
    """Stage at a travel."""
    return [stage for stage in stages if stage["travel"] <= travel * (1.0 + 1e-9) + 1e-12][-1]


def _frame(ax: Any, stage: dict[str, Any]) -> None:
    ax.title.set_bbox({"facecolor": stage_colour(stage), "alpha": 0.35, "linewidth": 0, "pad": 1.5})


def _handle(stage: dict[str, Any], first: bool) -> Patch:
    return Patch(facecolor=stage_colour(stage), alpha=0.35, label=stage_name(stage, first))


def leaves_plane(shape: Floats) -> bool:
    """Whether plates move out of the x-z plane by more than 0.1 % of the size of the structure."""
    if shape.size == 0:
        return False
    size = float(np.max(np.ptp(shape.reshape(-1, 3), axis=0)))
    across = np.max(np.abs((shape[:, :, 3] - shape[:, :, 0])[..., [0, 2]]), initial=0.0)
    return bool(np.ptp(shape[..., 1].mean(axis=2)) > 1e-3 * size or across > 1e-3 * size)


def _height(points: Floats, columns: int, rows: int, space: bool) -> float:
    """Height of the figure, inches, for pictures of equal scale that contain the points (n, 3)."""
    if points.size == 0:
        return 3.0 * rows
    if space:
        return rows * _cell(columns, points)
    width, height = np.ptp(points[:, 0]), np.ptp(points[:, 2])
    ratio = float(height / width) if width > 0 else 1.0
    return rows * (0.55 + float(np.clip((WIDE[0] - 0.7) / columns * ratio, 0.8, 3.4)))


def _cell(columns: int, points: Floats) -> float:
    """Height of a picture in space with its title and labels, inches."""
    return _TITLE + WIDE[0] / columns * (_projected(_reach(points))[1] + _LABELS)


def _reach(points: Floats) -> Floats:
    """Sides of the box that is drawn around points (n, 3), m."""
    sides = np.ptp(points, axis=0) if len(points) else np.ones(3)
    return np.asarray(np.maximum(sides, 0.05 * float(np.max(sides)) or 1.0))


@cache
def _zoomed(x: float, y: float, z: float) -> tuple[float, float]:
    """Zoom at which a box of these sides fills its picture, and its height there, over the width of the picture."""
    ax: Any = Figure(figsize=(1.0, 1.0)).add_subplot(projection="3d")
    ax.set(xlim=(-x / 2, x / 2), ylim=(-y / 2, y / 2), zlim=(-z / 2, z / 2))
    ax.set_box_aspect((x, y, z))
    corners = np.array(np.meshgrid(*([-side / 2, side / 2] for side in (x, y, z)))).reshape(3, -1)
    across, up, _ = proj_transform(*corners, ax.get_proj())
    window = ax.viewLim
    width, height = np.ptp(across) / window.width, np.ptp(up) / window.height
    zoom = _FILLED / max(width, height)
    return zoom, float(zoom * height)


def _projected(reach: Floats) -> tuple[float, float]:
    """See `_zoomed`; for sides in any unit."""
    x, y, z = (float(side) for side in np.round(reach / np.max(reach), 3))
    return _zoomed(x, y, z)


def _arrange(fig: Figure, columns: int, rows: int, below: float) -> None:
    """Put square axes around the pictures in space; the empty parts of rows overlap."""
    width, height = fig.get_size_inches()  # a legend below takes `below` of it
    cell = (height - below) / rows
    side = width / columns
    for k, ax in enumerate(fig.axes):
        row, column = divmod(k, columns)
        middle = below + (rows - row - 0.5) * cell - 0.5 * _TITLE + 0.5 * _BELOW * side
        ax.set_position(((column - _LEFT) * side / width, (middle - 0.5 * side) / height, side / width, side / height))


def _arrange_plane(fig: Figure, columns: int, rows: int, below: float) -> None:
    """Put axes around the pictures in the plane; those of the first column, and the lowest of each column, have labels."""
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


def _title(solution: Solution, record: int) -> str:
    label = evolution(solution)[1]
    if label.startswith("step"):
        name, rows = next((name, rows) for name, rows in steps_of(solution) if record < rows.stop)
        return f"{name}, {rounded(solution.time[record] - start_of_step(solution, rows))} s"
    if label == "time (s)":
        return f"{rounded(solution.time[record])} s"
    force = solution.force[:, 0]
    # a residual of the solver is shown as zero
    value = force[record] if abs(force[record]) > 1e-4 * np.max(np.abs(force)) else 0.0
    return f"{rounded(solution.travel[record, 0] * 1e3)} mm, {rounded(value)} N"


def _colours(panel: Integers, quads: int) -> list[str]:
    numbers = panel if len(panel) == quads else np.zeros(quads, dtype=np.int64)
    other = {FILM: _OF_FILMS, LINE: COLOURS[6], BEAM: "#882255"}
    return [COLOURS[(int(n) - 1) % (len(COLOURS) - 1)] if n > 0 else other.get(int(n), GREY) for n in numbers]


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
    """Label an axis. An empty label has a fixed place, because the search for one measures all numbers of the axis."""
    axis.set_label_text(text)
    if not text:
        axis.set_label_coords(0.0, 0.0)


def _draw_plane(ax: Axes, solution: Solution, record: int, extent: Floats, view: tuple[Floats, float]) -> None:
    outlines = obstacle_outlines(solution, record, *view)
    sections = [1e3 * outline.section[:, [0, 2]] for outline in outlines]
    ax.add_collection(_plates_in_plane(solution, record))
    if sections:
        ax.add_collection(PolyCollection(sections, facecolors=GREY, edgecolors=GREY, alpha=0.3))
    if len(extent):
        low, high = (pick(extent, axis=0)[[0, 2]] * 1e3 for pick in (np.min, np.max))
        margin = 0.05 * float(np.max(high - low))
        ax.set_xlim(low[0] - margin, high[0] + margin)
        ax.set_ylim(low[1] - margin, high[1] + margin)
    ax.set_aspect("equal", adjustable="box")
    ax.set_title(_title(solution, record))


def _plates_in_plane(solution: Solution, record: int) -> LineCollection | PolyCollection:
    """Plates as lines; plates of a lattice as squares."""
    quads = solution.shape[record] * 1e3
    colours = _colours(solution.layout.panel, len(quads))
    squares = lattice_squares(solution, quads)
    if squares is not None:
        return PolyCollection(list(squares[..., [0, 2]]), facecolors=colours)
    ends = np.stack([quads[:, [0, 3]].mean(axis=1), quads[:, [1, 2]].mean(axis=1)], axis=1)[..., [0, 2]]
    return LineCollection(list(ends), colors=colours, linewidths=1.8, capstyle="round")


def _cut(outline: ObstacleOutline, low: Floats, high: Floats) -> list[Floats]:
    """Part of a plane within the bounds of the picture, mm; an empty list if the plane is outside."""
    face = 1e3 * outline.faces[0]
    margin = 0.05 * float(np.max(high - low))
    cut = np.clip(face, low - margin, high + margin)
    # clipping must not shift the plane along its normal
    normal = np.cross(face[1] - face[0], face[3] - face[0])
    away = np.abs((cut - face[0]) @ normal) / np.linalg.norm(normal)
    return [cut] if away.max() < 0.5 * margin else []


def _above(quads: Floats, films: np.ndarray) -> bool:
    """Whether the plates lie above the parts of films that are next to them, in the mean."""
    if not films.any() or films.all():
        return True
    plates, near = quads[~films].mean(axis=1), quads[films].mean(axis=1)
    beside = np.linalg.norm(plates[:, None, :2] - near[None, :, :2], axis=-1).argmin(axis=1)
    return bool(np.mean(plates[:, 2] - near[beside, 2]) >= 0.0)


def _draw_space(fig: Figure, solution: Solution, record: int, extent: Floats, view: tuple[Floats, float]) -> None:
    ax: Any = fig.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d", label=str(record))
    ax.patch.set_visible(False)
    quads, panel = solution.shape[record] * 1e3, solution.layout.panel
    lines = panel == LINE if len(panel) == len(quads) else np.zeros(len(quads), dtype=bool)
    colours = [colour for colour, line in zip(_colours(panel, len(quads)), lines, strict=True) if not line]
    cables, quads = quads[lines][:, :2], quads[~lines]
    # the limits are set below, because automatic limits of collections sometimes come from uninitialised memory
    add = partial(ax.add_collection3d, autolim=False)
    # faces are sorted by their middles, which fails for a plate on a film: it is drawn before or after the whole film
    of_films = np.array([colour == _OF_FILMS for colour in colours], dtype=bool)
    ax.computed_zorder = not of_films.any()
    for part, order in ((of_films, 2.0), (~of_films, 3.0 if _above(quads, of_films) else 1.0)):
        if part.any():
            chosen = [colour for colour, shown in zip(colours, part, strict=True) if shown]
            style = {"edgecolors": "white", "linewidths": 0.3, "alpha": 0.85, "zorder": order}
            add(Poly3DCollection(list(quads[part]), facecolors=chosen, **style))
    if len(cables):
        add(Line3DCollection(list(cables), colors=COLOURS[6], linewidths=1.0, zorder=2.5))
    outlines = obstacle_outlines(solution, record, *view)
    solids = [1e3 * face for outline in outlines if outline.bounded for face in outline.faces]
    if solids:
        add(Poly3DCollection(solids, facecolors=GREY, edgecolors=GREY, linewidths=0.2, alpha=0.3))
    low, high = (pick(extent, axis=0) * 1e3 for pick in (np.min, np.max))
    reach = 1e3 * _reach(extent)
    middle = (low + high) / 2
    planes = [face for outline in outlines if not outline.bounded for face in _cut(outline, low, high)]
    if planes:
        add(Poly3DCollection(planes, facecolors=GREY, edgecolors=GREY, linewidths=0.2, alpha=0.15))
    for name, centre, side in zip("xyz", middle, reach, strict=True):
        ax.set(**{f"{name}lim": (centre - side / 2, centre + side / 2)})
    zoom, up = _projected(reach)
    ax.set_box_aspect(reach, zoom=zoom)
    for axis, name in ((ax.xaxis, "x (mm)"), (ax.yaxis, "y (mm)"), (ax.zaxis, "z (mm)")):
        axis.set_label_text(name, fontsize=7)
        axis.labelpad = -6 if axis is ax.zaxis else -4
    # labels of x and y would meet at their common corner
    for axis, side, prune in zip((ax.xaxis, ax.yaxis, ax.zaxis), reach, ("upper", "lower", "lower"), strict=True):
        number = 4 if side > 0.5 * reach.max() else 2 if side > 0.15 * reach.max() else 1
        axis.set_major_locator(MaxNLocator(number, prune=prune if number > 1 else None))
    ax.tick_params(labelsize=6, pad=-2)
    ax.set_title(_title(solution, record), y=0.5 + 0.5 * up + 0.06, pad=0)
