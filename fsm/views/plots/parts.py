"""Colours and names of the parts of a structure, outlines of their facets, and squares of a lattice in their plane."""

from __future__ import annotations

from collections.abc import KeysView
from functools import cache

import matplotlib
import numpy as np
from matplotlib.colors import to_hex
from matplotlib.patches import Patch

from fsm.results.film import Floats, Integers
from fsm.results.solution import BEAM, FILM, JOINT_AXIS, LINE, LINK, Solution
from fsm.views.plots.style import COLOURS, GREY, shortened

OBSTACLE = "#BDBDBD"
_FEW = 6
"""Largest number of panels or bodies that each have a colour of the palette."""
_KINDS = {
    FILM: ("film", "#A6CEE3"), LINE: ("cable", COLOURS[6]), BEAM: ("beam", "#882255"),
    JOINT_AXIS: ("axes of joints", "#222222"),
}  # fmt: skip
LINES = {LINE: 1.0, LINK: 2.2, JOINT_AXIS: 3.2}
"""Kinds of quadrilaterals that are lines, with their widths in figures in space."""
_PLAIN = "#8DA0B6"
"""Colour of structures whose parts are alike: facets, squares."""
_BARS = {"1": ("first bars of the units", COLOURS[0]), "2": ("second bars", COLOURS[1])}


def panels_of(solution: Solution) -> Integers:
    """Panel of every quadrilateral, or the number of its kind; zeros in older files."""
    panel, count = np.asarray(solution.layout.panel), solution.shape.shape[1]
    return panel if len(panel) == count else np.zeros(count, dtype=np.int64)


def colours_of_parts(solution: Solution) -> list[str]:
    """Colour of every quadrilateral."""
    return [colour for _, colour in _parts(solution)]


def handles_of_parts(solution: Solution) -> list[Patch]:
    """Entries of the legend; none if all quadrilaterals have one colour."""
    named = dict(_parts(solution))
    if len(set(named.values())) < 2:
        return []
    panels = [name for name in named if name.startswith("panel ")]
    if len(panels) > _FEW:  # the colours come from a map, so the first, the middle and the last name are enough
        shown = {panels[0], panels[len(panels) // 2], panels[-1]}
        named = {name: colour for name, colour in named.items() if name in shown or name not in panels}
    return [Patch(facecolor=colour, label=shortened(name)) for name, colour in named.items()]


def _parts(solution: Solution) -> list[tuple[str, str]]:
    """Name for the legend, and colour, of every quadrilateral."""
    panel, names = panels_of(solution).tolist(), list(solution.layout.quad_names)
    case = solution.layout.case
    last = max(panel, default=0)
    if solution.layout.film is not None:
        return [("film", _KINDS[FILM][1]) if number == 0 else ("patch", COLOURS[1]) for number in panel]
    names = names if len(names) == len(panel) else ["body"] * len(panel)
    bodies = list(dict.fromkeys(name for name, number in zip(names, panel, strict=True) if number in (0, LINK)))
    return [
        (f"panel {number}", _of_panel(number, last)) if number > 0
        else _KINDS[number] if number in _KINDS
        else _of_body(name, bodies, max(last, 0), case.keys())
        for name, number in zip(names, panel, strict=True)
    ]  # fmt: skip


@cache
def _of_panel(number: int, last: int) -> str:
    """Colour of the palette, or with many panels of a map from the first to the last one."""
    if last <= _FEW:
        return COLOURS[number - 1]
    return to_hex(matplotlib.colormaps["viridis"](0.92 * (number - 1) / (last - 1)))


def _of_body(name: str, bodies: list[str], panels: int, sections: KeysView[str]) -> tuple[str, str]:
    """Name and colour of a body, or of its kind if there are many bodies."""
    if "scissor" in sections:
        side = name.rpartition(".")[2]
        return _BARS.get(side, ("bars", COLOURS[0]))
    if "sheet" in sections or "lattice" in sections:
        return "facets", _PLAIN
    if len(bodies) + panels <= _FEW:
        return name, COLOURS[panels + bodies.index(name)]
    return "bodies", GREY


def polygons(solution: Solution, record: int) -> tuple[list[Floats], Integers]:
    """Outlines of all facets in a record, m, and for each the number of its first quadrilateral.

    Quadrilaterals that are parts of one polygon are joined. A triangle has three corners.
    """
    shape, joined = solution.shape[record], _joined(solution)
    found: list[Floats] = []
    first = np.flatnonzero(~joined)
    for begin, end in zip(first, [*first[1:], len(shape)], strict=True):
        corners = shape[begin]
        if end > begin + 1:
            corners = np.concatenate([corners, *(quad[2:] for quad in shape[begin + 1 : end])])
        found.append(_without_repeats(corners))
    return found, first


def _joined(solution: Solution) -> np.ndarray:
    """Whether a quadrilateral continues the polygon of the previous quadrilateral: both share their first corner and
    one side.
    """
    start = solution.shape[0]
    joined = np.zeros(len(start), dtype=bool)
    if len(start) > 1:
        size = float(np.max(np.ptp(start.reshape(-1, 3), axis=0))) or 1.0
        same = np.abs(start[1:, 0] - start[:-1, 0]).max(axis=1) < 1e-9 * size
        next_to = np.abs(start[1:, 1] - start[:-1, 3]).max(axis=1) < 1e-9 * size
        names = np.asarray(solution.layout.quad_names)
        alike = names[1:] == names[:-1] if len(names) == len(start) else np.zeros(len(start) - 1, dtype=bool)
        joined[1:] = same & next_to & alike & (panels_of(solution)[1:] == 0)
    return joined


def _without_repeats(corners: Floats) -> Floats:
    """Corners without repetitions of the previous corner."""
    apart = np.abs(corners - np.roll(corners, 1, axis=0)).max(axis=1)
    kept = corners[apart > 1e-9 * (float(np.max(np.ptp(corners, axis=0))) or 1.0)]
    return kept if len(kept) > 2 else corners


def vertical_axis(solution: Solution) -> str:
    """Name of the vertical axis in the case: y for a scissor array, else z."""
    return "y" if "scissor" in solution.layout.case else "z"


def lattice_squares(solution: Solution, shape: Floats) -> Floats | None:
    """Corners of the squares of a lattice, from their middle planes in the result; None for other structures.

    Parameters
    ----------
    solution : Solution
    shape : (..., squares, 4, 3) array, m
        Middle planes in some of the records.

    Returns
    -------
    (..., squares, 4, 3) array, m
        Corners in order around each square, seen along y.
    """
    if "lattice" not in solution.layout.case:
        return None
    start, end = shape[..., [0, 3], :].mean(axis=-2), shape[..., [1, 2], :].mean(axis=-2)
    half = 0.5 * (end - start)
    across = np.stack([-half[..., 2], half[..., 1], half[..., 0]], axis=-1)
    return np.stack([start - across, end - across, end + across, start + across], axis=-2)
