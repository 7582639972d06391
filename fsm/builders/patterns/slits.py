"""Kirigami sheet: a flat rectangle with rows of parallel slits, of a given width or without width."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from fsm.builders.patterns.cuts import open_cuts
from fsm.case.models.sheet import MOST_FACETS
from fsm.case.pattern_files.pattern import Pattern

_SAME = 1e-9
"""Distance below which two lines of the pattern are one, relative to the size of the sheet."""


def slits(
    periods: float, rows: int, spacing: float, slit_length: float, ligament: float,
    slit_width: float = 0.0, shift: float = 0.5, margin: tuple[float, float] | None = None,
) -> Pattern:  # fmt: skip
    """Flat sheet with rows of slits along x, which follow each other along y. The sheet begins at the origin.

    A period consists of a slit and a ligament. Rows 2, 4, ... have a slit in the middle of each period, and half a ligament
    at both of its ends; rows 1, 3, ... are shifted by a part of a period. The sides of the sheet cut the rows where they
    are. Slits without width are open cuts; slits with a width are rectangular holes. Facets are rectangles between the
    lines x = const through the ends of slits, and no edge folds.

    Parameters
    ----------
    periods : number of periods along x, not necessarily whole
    rows : number of rows of slits
    spacing : distance of the middles of neighbouring rows, m
    slit_length, ligament : length of a slit, and of the sheet between two slits of a row, m
    slit_width : size of a slit along y, m
    shift : shift of rows 1, 3, ... along x over the period
    margin : distances of the first and of the last row from the edges "bottom" and "top", m; None: `spacing`. If it is 0
        the row lies on the edge, and the edge consists of the ligaments.

    Raises
    ------
    ValueError
        The slits leave no strip between two rows or beside an edge, or a row has no ligament.
    """
    below, above = (spacing, spacing) if margin is None else margin
    if slit_width >= spacing:
        raise ValueError(f"slit_width = {slit_width:g} m must be less than spacing = {spacing:g} m, else no strips remain")
    if any(0.0 < one <= 0.5 * slit_width for one in (below, above)):
        text = f"each margin must be 0, or more than half of slit_width = {slit_width:g} m"
        raise ValueError(f"margin = [{below:g}, {above:g}] m leaves no strip beside a row of slits; {text}")
    if rows == 1 and not below + above:
        raise ValueError("margin = [0, 0] and rows = 1 leave no strip; give a margin or more rows")
    period, at = slit_length + ligament, below + spacing * np.arange(rows)
    width, height = periods * period, float(at[-1] + above)
    joined = [_ligaments(period, ligament, width, shift * period if row % 2 == 0 else 0.0) for row in range(rows)]
    for row, found in enumerate(joined):
        if not found:
            text = f"row {row + 1} has no ligament in the width of {width:g} m, so the sheet is in two parts"
            raise ValueError(f"periods = {periods:g}: {text}; increase `periods` or change `shift`")
    x = _lines(joined, width)
    y = _apart([0.0, *np.clip(np.concatenate([at - 0.5 * slit_width, at + 0.5 * slit_width]), 0.0, height).tolist(), height])
    if (len(x) - 1) * (len(y) - 1) > MOST_FACETS:
        text = f"{len(x) - 1} x {len(y) - 1} rectangles; at most {MOST_FACETS:,} facets are allowed"
        raise ValueError(f"the slits divide the sheet into {text}: give fewer `periods` or `rows`")
    middle = 0.5 * (x[:-1] + x[1:])
    solid = np.array([[any(a < one < b for a, b in found) for one in middle.tolist()] for found in joined])
    return _pattern(x, y, at, slit_width, solid)


def _ligaments(period: float, ligament: float, width: float, shift: float) -> list[tuple[float, float]]:
    """Ends of the ligaments of a row inside of the sheet, m."""
    first = math.floor(-shift / period) - 1
    found = []
    for number in range(first, math.ceil((width - shift) / period) + 2):
        middle = number * period + shift
        low, high = max(middle - 0.5 * ligament, 0.0), min(middle + 0.5 * ligament, width)
        if high > low + _SAME * width:
            found.append((low, high))
    return found


def _apart(values: list[float]) -> np.ndarray:
    """Sorted values without repetitions."""
    found = np.array(sorted(values))
    return found[np.append(True, np.diff(found) > _SAME * found[-1])]


def _lines(joined: list[list[tuple[float, float]]], width: float) -> np.ndarray:
    """Coordinates x of all lines of the pattern, m: the sides, the ends of all ligaments, and the middle of a slit that has
    no other line, so that no line of the outline joins two ligaments along a slit.
    """
    x = _apart([0.0, width, *(end for found in joined[:2] for pair in found for end in pair)])
    near = _SAME * width
    slit = {(a, b) for found in joined[:2] for (_, a), (b, _) in pairwise(found)}
    return _apart([*x.tolist(), *(0.5 * (a + b) for a, b in slit if not ((x > a + near) & (x < b - near)).any())])


def _pattern(x: np.ndarray, y: np.ndarray, at: np.ndarray, slit_width: float, solid: np.ndarray) -> Pattern:
    """Pattern of rectangles.

    Parameters
    ----------
    x, y : lines between the rectangles, m
    at : (rows,) array, m
        Middles of the rows.
    slit_width : m
    solid : (rows, len(x) - 1) bool array
        Whether there is a ligament between two lines x.
    """
    middle = 0.5 * (y[:-1] + y[1:])
    faces, grid = [], dict[tuple[int, int], int]()
    for level, one in enumerate(middle.tolist()):
        row = int(np.abs(at - one).argmin())
        strip = abs(at[row] - one) > 0.5 * slit_width
        for k in range(len(x) - 1):
            if strip or solid[row, k]:
                corners = ((k, level), (k + 1, level), (k + 1, level + 1), (k, level + 1))
                faces.append(tuple(grid.setdefault(corner, len(grid)) for corner in corners))
    k, level = np.array(list(grid)).T
    flat = np.column_stack([x[k], y[level]])
    # rows on lines y, for slits without width
    row_of = {} if slit_width else {int(np.abs(y - one).argmin()): row for row, one in enumerate(at.tolist())}
    groups = {}
    for name, on in (
        ("left", k == 0), ("right", k == k.max()), ("bottom", level == 0), ("top", level == level.max())
    ):  # fmt: skip
        groups[name] = np.flatnonzero(on)
    for name, line in (("bottom", 0), ("top", len(y) - 1)):
        if line in row_of:
            joined = solid[row_of[line]]
            ends = np.append(joined, False) | np.append(False, joined)
            groups[name] = groups[name][ends[k[groups[name]]]]
    named = {name: tuple(group.tolist()) for name, group in groups.items()}
    pattern = Pattern.of_faces(np.column_stack([flat, np.zeros(len(flat))]), faces, flat, named)
    letters = list(pattern.assignment)
    for number, (u, v) in enumerate(pattern.edges.tolist()):
        row = row_of.get(int(level[u]), -1) if level[u] == level[v] else -1
        if row >= 0 and letters[number] != "B" and not solid[row, min(k[u], k[v])]:
            letters[number] = "C"
    return open_cuts(pattern.assigned(letters, pattern.target))
