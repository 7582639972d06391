"""Crease patterns from a few numbers: Miura sheet, zigzag, waterbomb sheet, Kresling and Yoshimura tubes."""

from __future__ import annotations

import math

import numpy as np

from fsm.scene.patterns.pattern import Pattern, box_groups

__all__ = ["kresling", "miura", "miura_cell", "waterbomb", "yoshimura", "zigzag"]


def miura_cell(a: float, b: float, sector_angle: float, fold_angle: float) -> tuple[float, float, float, float]:
    """Sizes (S, L, V, H) of a Miura panel in space, m (Schenk and Guest, 2013, eqs. 1 to 4).

    Parameters
    ----------
    a, b : sides of the parallelogram, m
    sector_angle : angle between both sides, rad
    fold_angle : angle of the panels with the mean plane, rad

    Returns
    -------
    S : step of the columns along x
    L : step of the rows along y
    V : shift of every second column along y
    H : height of every second row
    """
    reach = math.hypot(math.cos(sector_angle), math.cos(fold_angle) * math.sin(sector_angle))
    height = math.sin(fold_angle) * math.sin(sector_angle)
    return (
        b * math.cos(fold_angle) * math.sin(sector_angle) / reach,
        a * math.sqrt(1.0 - height * height),
        b * math.cos(sector_angle) / reach,
        a * height,
    )


def miura(columns: int, rows: int, a: float, b: float, sector_angle: float, fold_angle: float) -> Pattern:
    """Miura sheet of `columns` by `rows` panels; its mean plane is x-y, and the columns follow each other along x.

    A line between two columns lies in a plane x = const and zigzags along z; it consists of sides a. A line between two rows
    has a constant height and zigzags in the plane; it consists of sides b. Vertices are numbered along y first.
    """

    def place(fold: float) -> np.ndarray:
        s, along, v, h = miura_cell(a, b, sector_angle, fold)
        i, j = np.divmod(np.arange((columns + 1) * (rows + 1)), rows + 1)
        return np.column_stack([i * s, j * along + v * (i % 2), h * (j % 2)])

    return Pattern.of_faces(place(fold_angle), _grid_faces(columns, rows), place(0.0)[:, :2], _grid_groups(columns, rows))


def zigzag(columns: int, a: float, width: float, fold_angle: float) -> Pattern:
    """Row of `columns` rectangular panels of length a and of a width; odd panels rise along x and even panels fall."""
    i = np.repeat(np.arange(columns + 1), 2)
    y = np.tile([0.0, width], columns + 1)
    folded = np.column_stack([i * a * math.cos(fold_angle), y, (i % 2) * a * math.sin(fold_angle)])
    return Pattern.of_faces(folded, _grid_faces(columns, 1), np.column_stack([i * a, y]), _grid_groups(columns, 1))


def waterbomb(columns: int, rows: int, a: float) -> Pattern:
    """Flat waterbomb sheet of `columns` by `rows` square cells of side a; every second row is shifted by half a cell.

    The diagonals of a cell are valleys. Its sides, and the vertical line through its centre, are mountains. The target
    angle is 180 degrees.
    """
    places: dict[tuple[int, int], int] = {}
    faces: list[tuple[int, int, int]] = []
    for row in range(rows):
        for column in range(columns):
            x, y = 2 * column + row % 2, 2 * row  # in units of a / 2
            around = [(x, y), (x + 1, y), (x + 2, y), (x + 2, y + 2), (x + 1, y + 2), (x, y + 2), (x + 1, y + 1)]
            *corners, centre = [places.setdefault(place, len(places)) for place in around]
            faces += [(first, last, centre) for first, last in zip(corners, [*corners[1:], corners[0]], strict=True)]
    flat = 0.5 * a * np.array(list(places), dtype=float)
    pattern = Pattern.of_faces(np.column_stack([flat, np.zeros(len(flat))]), faces, flat, box_groups(flat))
    across = np.abs(np.diff(flat[pattern.edges], axis=1)[:, 0])
    diagonal = across.min(axis=1) > 1e-6 * a
    letters = ["B" if old == "B" else "V" if slant else "M" for old, slant in zip(pattern.assignment, diagonal, strict=True)]
    return pattern.assigned(letters, [{"V": math.pi, "M": -math.pi}.get(letter, 0.0) for letter in letters])


def kresling(sides: int, rows: int, radius: float, height: float, twist: float) -> Pattern:
    """Kresling tube: rings of regular polygons at a height of each other, each rotated by `twist` about z.

    Parameters
    ----------
    sides : number of sides of a polygon
    rows : number of storeys
    radius, height : circumradius of a polygon and height of a storey, m
    twist : rotation of each ring relative to the ring below, rad
    """
    return _tube(sides, rows, radius, height, twist)


def yoshimura(sides: int, rows: int, radius: float, height: float) -> Pattern:
    """Yoshimura tube: rings as in `kresling`, each rotated by half a side, so that all triangles are isosceles."""
    return _tube(sides, rows, radius, height, math.pi / sides)


def _tube(sides: int, rows: int, radius: float, height: float, twist: float) -> Pattern:
    ring, corner = np.divmod(np.arange(sides * (rows + 1)), sides)
    angle = 2.0 * math.pi * corner / sides + ring * twist
    vertices = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), ring * height])
    faces = []
    for k in range(rows):
        for i in range(sides):
            low, low_next = k * sides + i, k * sides + (i + 1) % sides
            up, up_next = low + sides, low_next + sides
            faces += [(low, low_next, up_next), (low, up_next, up)]
    groups = {"bottom": tuple(range(sides)), "top": tuple(range(rows * sides, (rows + 1) * sides))}
    return Pattern.of_faces(vertices, faces, None, groups)


def _grid_faces(columns: int, rows: int) -> list[tuple[int, int, int, int]]:
    """Faces of a grid of vertices that are numbered column by column."""
    height = rows + 1
    corners = [i * height + j for i in range(columns) for j in range(rows)]
    return [(v, v + height, v + height + 1, v + 1) for v in corners]


def _grid_groups(columns: int, rows: int) -> dict[str, tuple[int, ...]]:
    """Vertices of the four edges of a grid."""
    height, count = rows + 1, (columns + 1) * (rows + 1)
    return {
        "left": tuple(range(height)), "right": tuple(range(count - height, count)),
        "bottom": tuple(range(0, count, height)), "top": tuple(range(rows, count, height)),
    }  # fmt: skip
