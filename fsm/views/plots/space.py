"""Pictures of a structure in space: shaded facets, obstacles, axes that fit the structure."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.proj3d import proj_transform

from fsm.results.film import Floats
from fsm.results.solution import FILM, Solution
from fsm.views.plots.drawing import line_width, points
from fsm.views.plots.obstacles import ObstacleOutline, obstacle_outlines
from fsm.views.plots.parts import LINES, OBSTACLE, colours_of_parts, panels_of, polygons
from fsm.views.plots.style import WIDE, figure_unit

_FILLED = 0.74
"""Part of the width of a picture that the box around the structure fills."""
_LABELS, _BELOW, _LEFT = 0.25, 0.06, 0.06
"""Relative to the width of a picture: height of the labels, additional label height below the box, shift to the left for the
label of z."""
_LIGHT = np.array([-0.35, -0.55, 0.76])
_DARKEST = 0.62
"""Brightness of a facet that is parallel to the light."""
_MOST_EDGES = 4000
"""Number of facets above which edges would hide the facets."""
_PADS = {"x": -3.5, "y": -5.0, "z": -7.0}
"""Distance of a label from its axis beside the width of the numbers, points."""
_LABEL, _TICK = 21.0, 8.0
"""Matplotlib's distances of labels and numbers without padding, points."""
_USUAL = np.array([1.05, 1.2, 0.55])
"""Sides of a box in which Matplotlib's distances are right."""
_CORNER = 0.08
"""Part of an axis next to its ends that has no numbers, because numbers of two axes would meet there."""


def height_in_space(columns: int, extent: Floats, title: float) -> float:
    """Height of a picture with its title and labels, inches, around points (n, 3); `title` is the height of the title."""
    return title + WIDE[0] / columns * (_projected(_reach(extent))[1] + _LABELS)


def _reach(extent: Floats) -> Floats:
    """Sides of the box that is drawn around points (n, 3), m."""
    sides = np.ptp(extent, axis=0) if len(extent) else np.ones(3)
    return np.asarray(np.maximum(sides, 0.05 * float(np.max(sides)) or 1.0))


@lru_cache(maxsize=64)
def _zoomed(x: float, y: float, z: float) -> tuple[float, float, Floats]:
    """Zoom at which a box of these sides fills its picture, height of the box, and a distance for each axis.

    Height and distances are relative to the width of the picture. This distance is the length of a displacement by both
    other sides of the box. Matplotlib's distances of labels are proportional to it.
    """
    ax: Any = Figure(figsize=(1.0, 1.0)).add_subplot(projection="3d")
    ax.set(xlim=(-x / 2, x / 2), ylim=(-y / 2, y / 2), zlim=(-z / 2, z / 2))
    ax.set_box_aspect((x, y, z))
    corners = np.array(np.meshgrid(*([-side / 2, side / 2] for side in (x, y, z)))).reshape(3, -1)
    across, up, _ = proj_transform(*corners, ax.get_proj())
    window = ax.viewLim
    width, height = np.ptp(across) / window.width, np.ptp(up) / window.height
    zoom = _FILLED / max(width, height)
    shifts = np.array([[0, -y, -z], [x, 0, -z], [x, y, 0], [0, 0, 0]]).T  # away from the middle of the box, and zero
    across, up, _ = proj_transform(*shifts, ax.get_proj())
    away = np.hypot((across[:3] - across[3]) / window.width, (up[:3] - up[3]) / window.height)
    return zoom, float(zoom * height), zoom * away


def _projected(reach: Floats) -> tuple[float, float, Floats]:
    """See `_zoomed`; for sides in any unit."""
    x, y, z = (float(side) for side in np.round(reach / np.max(reach), 3))
    return _zoomed(x, y, z)


def arrange_in_space(fig: Figure, columns: int, rows: int, below: float, title: float) -> None:
    """Put square axes around the pictures; the empty parts of rows overlap. `below` is the height of a legend, inches."""
    width, height = fig.get_size_inches()
    cell = (height - below) / rows
    side = width / columns
    for k, ax in enumerate(fig.axes):
        row, column = divmod(k, columns)
        middle = below + (rows - row - 0.5) * cell - 0.5 * title + 0.5 * _BELOW * side
        ax.set_position(((column - _LEFT) * side / width, (middle - 0.5 * side) / height, side / width, side / height))


def draw_in_space(
    fig: Figure, solution: Solution, record: int, extent: Floats, view: tuple[Floats, float], title: str
) -> None:
    """Draw a record into new axes.

    All pictures contain the points `extent` (n, 3), m. `view` has the last two arguments of `obstacle_outlines`.
    """
    ax: Any = fig.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d", label=str(record))
    ax.patch.set_visible(False)
    factor, unit = figure_unit("m", np.ptp(extent, axis=0))
    # the limits are set below, because automatic limits of collections sometimes come from uninitialised memory
    add = partial(ax.add_collection3d, autolim=False)
    _draw_parts(ax, add, solution, record, factor)
    low, high = (factor * pick(extent, axis=0) for pick in (np.min, np.max))
    outlines = obstacle_outlines(solution, record, *view)
    solids = [factor * face for outline in outlines if outline.bounded for face in outline.faces]
    if solids:
        add(Poly3DCollection(solids, facecolors=OBSTACLE, edgecolors=OBSTACLE, linewidths=line_width(0.2), alpha=0.3))
    planes = [face for outline in outlines if not outline.bounded for face in _cut(outline, low, high, factor)]
    if planes:
        add(Poly3DCollection(planes, facecolors=OBSTACLE, edgecolors=OBSTACLE, linewidths=line_width(0.2), alpha=0.15))
    draw_axes(ax, factor * _reach(extent), (low + high) / 2, unit)
    ax.set_title(title, y=0.5 + 0.5 * _projected(_reach(extent))[1] + 0.08, pad=0)


def _draw_parts(ax: Any, add: Any, solution: Solution, record: int, factor: float) -> None:
    """Draw facets, shaded by their direction, and cables, bodies without a shape, and axes of joints as lines."""
    faces, first = polygons(solution, record)
    panel, colours = panels_of(solution)[first], np.array([to_rgb(c) for c in colours_of_parts(solution)])[first]
    lines, films = np.isin(panel, [*LINES]), panel == FILM
    ends, widths = factor * solution.shape[record][first[lines]][:, :2], [line_width(LINES[kind]) for kind in panel[lines]]
    shown = colours * _brightness(faces)[:, None]
    # faces are sorted by their middles, which fails for a plate on a film, so the plate is drawn before or after the whole
    # film
    ax.computed_zorder = not films.any()
    width = 0.0 if len(faces) > _MOST_EDGES else line_width(0.4 if len(faces) < 500 else 0.2)
    for part, order in ((films & ~lines, 2.0), (~films & ~lines, 3.0 if _above(faces, films, lines) else 1.0)):
        chosen = np.flatnonzero(part)
        if len(chosen):
            style = {"edgecolors": 0.55 * shown[chosen], "linewidths": width, "zorder": order}
            add(Poly3DCollection([factor * faces[k] for k in chosen], facecolors=shown[chosen], **style))
    if len(ends):
        add(Line3DCollection(list(ends), colors=colours[lines], linewidths=widths, capstyle="round", zorder=2.5))


def _brightness(faces: list[Floats]) -> Floats:
    """Brightness of facets from the angle between their normals (Newell's method) and the light; both sides are alike."""
    normals = np.array([np.cross(face, np.roll(face, -1, axis=0)).sum(axis=0) for face in faces]).reshape(-1, 3)
    length = np.linalg.norm(normals, axis=1)
    along = np.abs(normals @ (_LIGHT / np.linalg.norm(_LIGHT))) / np.where(length > 0.0, length, 1.0)
    return np.asarray(_DARKEST + (1.0 - _DARKEST) * along)


def _above(faces: list[Floats], films: np.ndarray, lines: np.ndarray) -> bool:
    """Whether plates lie on average above the parts of films next to them."""
    others = ~films & ~lines
    if not films.any() or not others.any():
        return True
    middle = np.array([face.mean(axis=0) for face in faces])
    plates, near = middle[others], middle[films]
    beside = np.linalg.norm(plates[:, None, :2] - near[None, :, :2], axis=-1).argmin(axis=1)
    return bool(np.mean(plates[:, 2] - near[beside, 2]) >= 0.0)


def _cut(outline: ObstacleOutline, low: Floats, high: Floats, factor: float) -> list[Floats]:
    """Part of a plane within the bounds of the picture; an empty list if the plane is outside."""
    face = factor * outline.faces[0]
    margin = 0.05 * float(np.max(high - low))
    cut = np.clip(face, low - margin, high + margin)
    # clipping must not shift the plane along its normal
    normal = np.cross(face[1] - face[0], face[3] - face[0])
    away = np.abs((cut - face[0]) @ normal) / np.linalg.norm(normal)
    return [cut] if away.max() < 0.5 * margin else []


def draw_axes(ax: Any, reach: Floats, middle: Floats, unit: str) -> None:
    """Set limits, numbers and labels of the three axes for a box of sides `reach` around `middle`, in a unit."""
    for name, centre, side in zip("xyz", middle, reach, strict=True):
        ax.set(**{f"{name}lim": (centre - side / 2, centre + side / 2)})
    zoom, _, away = _projected(reach)
    nearer = _projected(_USUAL)[2] / away
    ax.set_box_aspect(tuple(reach), zoom=zoom)  # Matplotlib would change the array
    size = matplotlib.rcParams["xtick.labelsize"] - points(1.0)
    axes = (ax.xaxis, ax.yaxis, ax.zaxis)
    for axis, name, centre, side, factor in zip(axes, "xyz", middle, reach, nearer, strict=True):
        share = side / reach.max() * (2.0 if name == "z" else 1.0)  # x and y are drawn shorter than z
        number = 4 if share > 0.6 else 3 if share > 0.4 else 2 if share > 0.25 else 1
        ticks = _ticks(centre - side / 2, centre + side / 2, number, lowest=name == "x", highest=name == "z")
        axis.set_ticks(ticks)
        axis.set_label_text(f"{name} ({unit})", fontsize=size)
        letters = max(len(f"{tick:g}") for tick in ticks) if len(ticks) else 0
        axis.labelpad = factor * points(_LABEL + _PADS[name] + 1.4 * max(letters, 2)) - _LABEL
        beside = 2.0 * max(letters - 3, 0) if name == "z" else 0.0  # numbers are centred
        axis.set_tick_params(labelsize=size, pad=factor * points(_TICK - 2.0 + beside) - _TICK)
        axis.pane.set_edgecolor("#D0D0D0")
        axis._axinfo["grid"].update(color="#E2E2E2", linewidth=line_width(0.5))


def _ticks(low: float, high: float, number: int, lowest: bool, highest: bool) -> Floats:
    """Round values between two ends; those next to an end are left out unless `lowest` or `highest` is set."""
    from_low, to_high = (0.0 if lowest else _CORNER), (0.0 if highest else _CORNER)
    span = high - low
    for count in range(max(number, 2), number + 4):
        ticks = np.asarray(MaxNLocator(count, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
        inside = ticks[(ticks >= low + from_low * span - 1e-9 * span) & (ticks <= high - to_high * span + 1e-9 * span)]
        if len(inside) >= min(number, 2):
            return inside if number > 1 else inside[len(inside) // 2 :][:1]
    return inside
