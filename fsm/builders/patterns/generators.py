"""Crease patterns from a few numbers: Miura, zigzag and waterbomb sheets, cones, flashers and tubes."""

from __future__ import annotations

import math

import numpy as np

from fsm.case.pattern_files.pattern import Pattern, edge_groups


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


def miura_tube(columns: int, a: float, b: float, sector_angle: float, fold_angle: float) -> Pattern:
    """Tube of two Miura sheets of two rows that are mirror images of each other; its length is along x.

    The rings are rhombs with sides a in planes x = const, and zigzag along y. All facets fold as rigid panels, from a
    closed zigzag (fold_angle 90 deg) to a flat tube (fold_angle 0). The enclosed volume of a column is
    a^2 b sin(sector_angle)^2 sin(2 fold_angle). Vertices are numbered ring by ring.
    """
    s, along, v, h = miura_cell(a, b, sector_angle, fold_angle)
    i, j = np.divmod(np.arange(4 * (columns + 1)), 4)
    y = np.array([0.0, along, 2.0 * along, along])[j] + v * (i % 2)
    vertices = np.column_stack([i * s, y, h * np.array([0.0, -1.0, 0.0, 1.0])[j]])
    corners = [(4 * k + m, 4 * k + (m + 1) % 4) for k in range(columns) for m in range(4)]
    faces = [(low, high, high + 4, low + 4) for low, high in corners]
    count = len(vertices)
    return Pattern.of_faces(vertices, faces, None, {"left": tuple(range(4)), "right": tuple(range(count - 4, count))})


def zigzag(columns: int, a: float, width: float, fold_angle: float) -> Pattern:
    """Row of `columns` rectangular panels of length a and of a width; odd panels rise along x and even panels fall."""
    i = np.repeat(np.arange(columns + 1), 2)
    y = np.tile([0.0, width], columns + 1)
    folded = np.column_stack([i * a * math.cos(fold_angle), y, (i % 2) * a * math.sin(fold_angle)])
    return Pattern.of_faces(folded, _grid_faces(columns, 1), np.column_stack([i * a, y]), _grid_groups(columns, 1))


def waterbomb(columns: int, rows: int, a: float) -> Pattern:
    """Flat waterbomb sheet of `columns` by `rows` square cells of side a; every second row is shifted by half a cell.

    The diagonals of a cell are valleys. The cell's sides, and the vertical line through its centre, are mountains. The
    target angle is 180 degrees.
    """
    places: dict[tuple[int, int], int] = {}
    faces: list[tuple[int, int, int]] = []
    for row in range(rows):
        for column in range(columns):
            x, y = 2 * column + row % 2, 2 * row  # coordinates are in units of a/2
            around = [(x, y), (x + 1, y), (x + 2, y), (x + 2, y + 2), (x + 1, y + 2), (x, y + 2), (x + 1, y + 1)]
            *corners, centre = [places.setdefault(place, len(places)) for place in around]
            faces += [(first, last, centre) for first, last in zip(corners, [*corners[1:], corners[0]], strict=True)]
    flat = 0.5 * a * np.array(list(places), dtype=float)
    pattern = Pattern.of_faces(np.column_stack([flat, np.zeros(len(flat))]), faces, flat, edge_groups(flat, faces))
    across = np.abs(np.diff(flat[pattern.edges], axis=1)[:, 0])
    diagonal = across.min(axis=1) > 1e-6 * a
    letters = ["B" if old == "B" else "V" if slant else "M" for old, slant in zip(pattern.assignment, diagonal, strict=True)]
    return _fully_folded(pattern, letters)


def cone(sides: int, inner_radius: float, outer_radius: float) -> Pattern:
    """Flat ring with radial creases that folds to a cone of `sides` pleats.

    Each pleat has a mountain and a valley. All sectors have the angle pi/sides, so the alternating sum of the angles about
    the centre is zero. The target angle is 180 degrees.
    """
    count = 2 * sides
    angle = math.pi * np.arange(count) / sides
    directions = np.column_stack([np.cos(angle), np.sin(angle)])
    flat = np.concatenate([inner_radius * directions, outer_radius * directions])
    faces = [(k, count + k, count + (k + 1) % count, (k + 1) % count) for k in range(count)]
    groups = {"inner": tuple(range(count)), "outer": tuple(range(count, 2 * count))}
    pattern = Pattern.of_faces(np.column_stack([flat, np.zeros(len(flat))]), faces, flat, groups)
    edges = zip(pattern.assignment, pattern.edges.tolist(), strict=True)
    letters = ["B" if old == "B" else "MV"[u % count % 2] for old, (u, _) in edges]
    return _fully_folded(pattern, letters)


def flasher(sides: int, outer_radius: float, height: float) -> Pattern:
    """Flasher: a regular polygon that wraps around a hub; walls of a given height turn up at the sides of the hub, and the
    outer edge twists.

    The sides of the hub are valleys of 90 degrees. Two creases begin at each corner of the hub. A valley of 180 degrees
    runs along the radius. A mountain of 180 - 360/sides degrees runs at a right angle to the side before the corner.
    In the folded state the walls stand on the sides of the hub, and each wall continues as a double flap beyond a
    corner. During the motion between flat and folded, facets bend.

    Parameters
    ----------
    sides : number of sides of the hub and of the sheet
    outer_radius : circumradius of the sheet, m
    height : height of the walls, m

    Raises
    ------
    ValueError
        The walls are so high that no hub remains.
    """
    half = math.pi / sides
    inner_radius = outer_radius - height / math.cos(half)
    if inner_radius <= 0.0:
        most = outer_radius * math.cos(half)
        raise ValueError(f"height = {height:g} m leaves no hub; it must be less than {most:.6g} m for this outer_radius")
    corner = np.arange(sides)
    turns = 2.0 * half * corner
    radial = np.column_stack([np.cos(turns), np.sin(turns)])
    normal = np.column_stack([np.cos(turns - half), np.sin(turns - half)])  # of the side before a corner of the hub
    hub = inner_radius * radial
    flat = np.concatenate([hub, outer_radius * radial, hub + height * normal])
    after = np.roll(corner, -1)
    faces: list[tuple[int, ...]] = [tuple(corner.tolist())]
    for i, j in zip(corner.tolist(), after.tolist(), strict=True):
        faces += [(j, i, sides + i, 2 * sides + j), (i, 2 * sides + i, sides + i)]
    groups = {"hub": tuple(range(sides)), "outer": tuple(range(sides, 3 * sides))}
    pattern = Pattern.of_faces(np.column_stack([flat, np.zeros(len(flat))]), faces, flat, groups)
    angles = (0.5 * math.pi, math.pi, 2.0 * half - math.pi)  # at a corner of the hub, along the radius, and beside it
    ends = pattern.edges.max(axis=1) // sides
    target = [0.0 if old == "B" else angles[end] for old, end in zip(pattern.assignment, ends.tolist(), strict=True)]
    return pattern.assigned(["B" if not angle else "V" if angle > 0.0 else "M" for angle in target], target)


def tube(rows: int, radius: float, height: float) -> Pattern:
    """Flat pattern of a tube that is flattened and folded like a Z, with `rows` panels of a height.

    The sheet has the width 2 pi radius, which is the circumference of the tube; the seam joins the edges "left" and "right".
    The line in the middle and both edges are the sides of the flattened tube. Lines between panels are mountains on one half
    and valleys on the other, and change roles from line to line. The target angle is 180 degrees.
    """
    width = math.pi * radius
    i, j = np.divmod(np.arange(3 * (rows + 1)), rows + 1)
    flat = np.column_stack([i * width, j * height])
    pattern = Pattern.of_faces(
        np.column_stack([flat, np.zeros(len(flat))]), _grid_faces(2, rows), flat, _grid_groups(2, rows)
    )
    letters = []
    for old, (u, v) in zip(pattern.assignment, pattern.edges.tolist(), strict=True):
        across = i[u] != i[v]
        letters.append("B" if old == "B" else "MV"[int(j[u] + min(i[u], i[v])) % 2] if across else "V")
    return _fully_folded(pattern, letters)


def _fully_folded(pattern: Pattern, letters: list[str]) -> Pattern:
    """Pattern with letters whose target angles are 180 degrees."""
    return pattern.assigned(letters, [{"V": math.pi, "M": -math.pi}.get(letter, 0.0) for letter in letters])


def kresling(sides: int, rows: int, radius: float, height: float, twist: float, taper: float = 1.0) -> Pattern:
    """Kresling tube: regular polygons stacked at the distance `height`, each rotated by `twist` about z relative to the
    one below. With a taper the tube is a cone: all sizes of a storey are `taper` times those of the storey below.

    Parameters
    ----------
    sides : number of sides of a polygon
    rows : number of storeys
    radius, height : circumradius of a polygon and height of a storey, m
    twist : rotation of each ring relative to the ring below, rad
    taper : circumradius of each ring over that of the ring below
    """
    return _tube(sides, rows, radius, height, twist, taper)


def yoshimura(sides: int, rows: int, radius: float, height: float) -> Pattern:
    """Yoshimura tube: polygons as in `kresling`, each rotated by half a side, so that all triangles are isosceles."""
    return _tube(sides, rows, radius, height, math.pi / sides)


def _tube(sides: int, rows: int, radius: float, height: float, twist: float, taper: float = 1.0) -> Pattern:
    ring, corner = np.divmod(np.arange(sides * (rows + 1)), sides)
    angle = 2.0 * math.pi * corner / sides + ring * twist
    size = taper ** np.arange(rows + 1)
    level = np.concatenate([[0.0], np.cumsum(size[:-1])])
    r = radius * size[ring]
    vertices = np.column_stack([r * np.cos(angle), r * np.sin(angle), height * level[ring]])
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
    """Vertices on the four edges of a grid."""
    height, count = rows + 1, (columns + 1) * (rows + 1)
    return {
        "left": tuple(range(height)), "right": tuple(range(count - height, count)),
        "bottom": tuple(range(0, count, height)), "top": tuple(range(rows, count, height)),
    }  # fmt: skip
