"""Crease pattern of a sheet: vertices, edges with assignment and fold angle, and faces.

Rigid facets, facets with bend lines and flexible facets read the same pattern. Fold angles follow the FOLD format: 0 is
flat, a valley is positive, and 180 degrees is closed. The normal of a face follows from the order of its vertices.

Lines of crease patterns as files give them, choices of a section [sheet] for their reading, and faults with places.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

TOLERANCE = 1e-3
"""Distance relative to the size of the pattern below which points are one vertex."""
RANK = "BCMVUFJ"
"""Letters in the order in which they replace each other where lines coincide."""


class Line(NamedTuple):
    """Straight line of a pattern: ends (2,), letter, and fold angle in the folded state, rad (NaN: none)."""

    first: tuple[float, float]
    last: tuple[float, float]
    letter: str
    target: float


def unit_targets(letter: str, part: float = 1.0) -> float:
    """Fold angle of an assignment: a part of 180 degrees for mountains and valleys; NaN for unassigned creases."""
    return {"M": -math.pi * part, "V": math.pi * part, "U": math.nan}.get(letter, 0.0)


def counted(number: int, one: str, many: str) -> str:
    """Number with its noun."""
    return f"{number:,} {one if number == 1 else many}"


def others(count: int, what: str = "place") -> str:
    """Text on further places of a fault."""
    return f" ({counted(count - 1, f'other {what}', f'other {what}s')} too)" if count > 1 else ""


@dataclass(frozen=True)
class Reading:
    """Choices for the reading of a pattern.

    Attributes
    ----------
    merge : m
        Distance below which points are one vertex, and height below which a facet is planar. None: from the file.
    part : number of the part of the pattern that is the sheet, from 1; None: the pattern must be one part
    divided : whether facets are divided into triangles, so that they need not be planar
    """

    merge: float | None = None
    part: int | None = None
    divided: bool = False


class PatternFault(ValueError):
    """Fault of a pattern at some places.

    Parameters
    ----------
    message : str
    places : (n, 2) or (n, 3) positions of the fault, m
    labels : texts beside the places

    Attributes
    ----------
    lines : ends (m, 2, 2) or (m, 2, 3) of the lines of the pattern, m
    letters : letters of the lines
    """

    def __init__(self, message: str, places: Any = (), labels: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.places, self.labels = np.asarray(places, dtype=float), tuple(labels)
        self.lines: np.ndarray = np.zeros((0, 2, 2))
        self.letters: Sequence[str] = ()

    def among(self, lines: np.ndarray, letters: Sequence[str]) -> PatternFault:
        """Same fault, with the lines of its pattern."""
        self.lines, self.letters = lines, letters
        return self


ASSIGNMENTS = {
    "B": "boundary", "M": "mountain", "V": "valley", "F": "flat", "U": "unassigned", "C": "cut", "J": "bend line",
}  # fmt: skip
"""Letters of the FOLD format with their names; J is a join of one facet, here a bend line."""

_FLAT = 1e-9
"""Fold angle below which a crease counts as flat, rad."""
_CLOSED = 1e-3
"""Distance of a fold angle from 180 degrees below which a crease is closed, rad."""
_ZIGZAG = 0.25
"""Largest distance of an edge of a pattern from the side of the box around it, relative to this box."""
_SAME = 1e-6
"""Relative distance below which a vertex lies on a side of the bounding box of the pattern; the reference is the size of the
pattern."""


@dataclass(frozen=True)
class Pattern:
    """Crease pattern of a sheet.

    Attributes
    ----------
    vertices : (n, 3) array
        Positions at the start, m.
    flat : (n, 2) array or None
        Positions in the flat sheet, m; None for a closed surface, for example a tube.
    edges : (m, 2) int array
        First and last vertex of each edge; the first face of the edge is on its left.
    assignment : (m,) letters, see `ASSIGNMENTS`
    target : (m,) array
        Fold angle of each edge in the folded state that the pattern describes, rad; NaN for an edge without such an angle.
    faces : vertices of each face, counter-clockwise around its normal
    groups : vertices of named edges of the sheet, for example "left"
    notes : lines of its file that are ignored, and what was changed
    uncut : vertex of the sheet without cuts for each vertex, see `open_cuts`; empty without cuts
    """

    vertices: np.ndarray
    flat: np.ndarray | None
    edges: np.ndarray
    assignment: tuple[str, ...]
    target: np.ndarray
    faces: tuple[tuple[int, ...], ...]
    groups: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    uncut: tuple[int, ...] = ()

    @classmethod
    def of_faces(
        cls,
        vertices: np.ndarray,
        faces: Sequence[Sequence[int]],
        flat: np.ndarray | None = None,
        groups: Mapping[str, tuple[int, ...]] | None = None,
    ) -> Pattern:
        """Pattern of oriented faces, with the assignment and the fold angles of its start.

        Raises
        ------
        PatternFault
            An edge has more than two faces, or two faces use it in the same direction.
        """
        numbers: dict[tuple[int, int], int] = {}
        edges: list[tuple[int, int]] = []
        uses: list[int] = []
        for face in faces:
            for pair in _sides(face):
                if pair in numbers:
                    text = f"the edge of the vertices {pair[0] + 1} and {pair[1] + 1} has two faces on one side"
                    raise PatternFault(f"{text}; remove one of these faces", [np.asarray(vertices)[list(pair)].mean(axis=0)])
                reverse = numbers.get((pair[1], pair[0]))
                numbers[pair] = len(edges) if reverse is None else reverse
                if reverse is None:
                    edges.append(pair)
                    uses.append(1)
                else:
                    uses[reverse] += 1
        pattern = cls(
            np.asarray(vertices, dtype=float), flat, np.array(edges, dtype=np.int64), ("B",) * len(edges),
            np.zeros(len(edges)), tuple(tuple(int(v) for v in face) for face in faces),
            groups or {},
        )  # fmt: skip
        angles = pattern.fold_angles()
        letters = ["B" if use == 1 else _letter(angle) for use, angle in zip(uses, angles, strict=True)]
        return pattern.assigned(letters, angles)

    def assigned(self, letters: Sequence[str], target: Sequence[float] | np.ndarray) -> Pattern:
        """Copy of the pattern with a new assignment and new target fold angles."""
        return replace(self, assignment=tuple(letters), target=np.asarray(target, dtype=float))

    @cached_property
    def edge_faces(self) -> np.ndarray:
        """Faces on the left and on the right of each edge, (m, 2); -1 for none."""
        numbers = {tuple(edge): k for k, edge in enumerate(self.edges.tolist())}
        found = np.full((len(self.edges), 2), -1, dtype=np.int64)
        for face, vertices in enumerate(self.faces):
            for first, last in _sides(vertices):
                if (first, last) in numbers:
                    found[numbers[first, last], 0] = face
                elif (last, first) in numbers:
                    found[numbers[last, first], 1] = face
        return found

    @cached_property
    def creases(self) -> np.ndarray:
        """Numbers of the edges that join two faces; a cut joins no faces."""
        joined = (self.edge_faces >= 0).all(axis=1)
        return np.flatnonzero(joined & np.array([letter not in "BC" for letter in self.assignment], dtype=bool))

    @cached_property
    def lengths(self) -> np.ndarray:
        """Length of each edge, (m,), m."""
        return np.asarray(np.linalg.norm(np.diff(self.vertices[self.edges], axis=1)[:, 0], axis=1))

    def normals(self, vertices: np.ndarray | None = None) -> np.ndarray:
        """Unit normals of the faces, (n_faces, 3), at given positions of the vertices, by default at the start."""
        at = self.vertices if vertices is None else vertices
        found = np.zeros((len(self.faces), 3))
        for rows, faces in self.faces_by_size():
            apart = at[faces[:, 1:]] - at[faces[:, :1]]
            area = np.cross(apart[:, :-1], apart[:, 1:]).sum(axis=1)
            size = np.linalg.norm(area, axis=1)
            found[rows] = area / np.where(size > 0.0, size, 1.0)[:, None]
        return found

    def faces_by_size(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Numbers (m,) of the faces with k corners, and their vertices (m, k), for each k."""
        sizes = np.array([len(face) for face in self.faces], dtype=np.int64)
        rows = [np.flatnonzero(sizes == size) for size in np.unique(sizes)]
        return [(row, np.array([self.faces[number] for number in row.tolist()], dtype=np.int64)) for row in rows]

    def fold_angles(self, vertices: np.ndarray | None = None) -> np.ndarray:
        """Fold angle of each edge, (m,), from -pi to pi, rad; zero on boundaries."""
        at = self.vertices if vertices is None else vertices
        normals = self.normals(at)
        left, right = self.edge_faces.T
        along = at[self.edges[:, 1]] - at[self.edges[:, 0]]
        along = along / np.linalg.norm(along, axis=1)[:, None]
        first, second = normals[left], normals[right]
        sine = np.einsum("ij,ij->i", along, np.cross(second, first))
        angles = np.arctan2(sine, np.einsum("ij,ij->i", first, second))
        return np.where((left >= 0) & (right >= 0), angles, 0.0)

    def start_angles(self) -> np.ndarray:
        """Fold angles at the start, (m,), rad; the sign of a closed crease is the sign of its target."""
        angles = self.fold_angles()
        closed = np.abs(angles) > np.pi - _CLOSED  # the positions do not determine the sign of a closed crease
        return np.where(closed, np.copysign(angles, np.nan_to_num(self.target)), angles)

    def with_bend_lines(self, most: int = 3) -> Pattern:
        """Pattern whose faces with more than `most` corners are divided into triangles, with bend lines between them.

        Each division uses the shortest diagonal inside the face.
        """
        faces: list[tuple[int, ...]] = []
        added: list[tuple[int, int]] = []
        for face, normal in zip(self.faces, self.normals(), strict=True):
            pieces, lines = ([face], []) if len(face) <= most else triangles_of_face(self.vertices, face, normal)
            faces += pieces
            added += lines
        count = len(added)
        return replace(
            self,
            edges=np.concatenate([self.edges, np.array(added, dtype=np.int64).reshape(-1, 2)]),
            assignment=(*self.assignment, *("J",) * count),
            target=np.concatenate([self.target, np.zeros(count)]),
            faces=tuple(faces),
        )

    def extent(self) -> float:
        """Largest side of the box around the vertices, m."""
        return float(np.ptp(self.vertices, axis=0).max())


def polygon_normal(points: np.ndarray) -> np.ndarray:
    """Unit normal (3,) of a polygon (k, 3) by the sum of its cross products."""
    apart = points - points[0]
    area = np.cross(apart[1:-1], apart[2:]).sum(axis=0)
    size = float(np.linalg.norm(area))
    return np.asarray(area / size if size else area)


def triangles_of_face(
    vertices: np.ndarray, face: tuple[int, ...], normal: np.ndarray
) -> tuple[list[tuple[int, ...]], list[tuple[int, int]]]:
    """Triangles of a face, and the diagonals between them, by clipping of the corner with the shortest diagonal."""
    rest, pieces, lines = list(face), [], []
    while len(rest) > 3:
        options = []
        for k in range(len(rest)):
            before, corner, after = rest[k - 1], rest[k], rest[(k + 1) % len(rest)]
            others = [v for v in rest if v not in (before, corner, after)]
            if _is_ear(vertices, (before, corner, after), others, normal):
                diagonal = float(np.linalg.norm(vertices[after] - vertices[before]))
                options.append((float(f"{diagonal:.9e}"), k))  # equal diagonals must not be ordered by round-off
        k = min(options)[1] if options else 0
        before, corner, after = rest[k - 1], rest[k], rest[(k + 1) % len(rest)]
        pieces.append((before, corner, after))
        lines.append((before, after))
        del rest[k]
    return [*pieces, tuple(rest)], lines


def _is_ear(vertices: np.ndarray, corners: tuple[int, int, int], others: list[int], normal: np.ndarray) -> bool:
    """Whether three successive corners make a triangle inside the face."""
    a, b, c, *inner = vertices[[*corners, *others]].tolist()
    along, over, up = normal.tolist()

    def side(p: list[float], q: list[float], r: list[float]) -> float:
        x, y, z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        u, v, w = r[0] - p[0], r[1] - p[1], r[2] - p[2]
        return float((y * w - z * v) * along + (z * u - x * w) * over + (x * v - y * u) * up)

    if side(a, b, c) <= _SAME * math.dist(a, b) * math.dist(b, c):
        return False
    return not any(min(side(a, b, p), side(b, c, p), side(c, a, p)) >= 0.0 for p in inner)


def edge_groups(flat: np.ndarray, faces: Sequence[Sequence[int]]) -> dict[str, tuple[int, ...]]:
    """Vertices of the four edges of a pattern: those on the sides of the box around it, or the whole line of the outline
    between two corners if this line is a zigzag along the side.

    A line is a zigzag if it contains all vertices on the side of the box, at least two of them, and if it is not farther
    from this side than a quarter of the box. A straight line between two corners counts as well.

    Parameters
    ----------
    flat : (n, 2) positions
    faces : vertices of each face
    """
    low, high = flat.min(axis=0), flat.max(axis=0)
    near = _SAME * float((high - low).max())
    sides = {"bottom": (1, low), "right": (0, high), "top": (1, high), "left": (0, low)}
    found = {
        name: tuple(np.flatnonzero(np.abs(flat[:, axis] - bound[axis]) <= near).tolist())
        for name, (axis, bound) in sides.items()
    }
    loop = _outline(flat, faces)
    if not loop or not (high - low).all():
        return found
    u, v = ((flat[loop] - low) / (high - low)).T
    corners = [int(np.argmin(u + v)), int(np.argmax(u - v)), int(np.argmax(u + v)), int(np.argmin(u - v))]
    if len(set(corners)) < 4:
        return found
    for (name, (axis, bound)), first, last in zip(sides.items(), corners, [*corners[1:], corners[0]], strict=True):
        line = [loop[k % len(loop)] for k in range(first, first + (last - first) % len(loop) + 1)]
        away = float(np.abs(flat[line, axis] - bound[axis]).max())
        on_box = len(found[name]) > 1 or len(line) == 2
        if on_box and set(found[name]) <= set(line) and away <= _ZIGZAG * float((high - low)[axis]):
            found[name] = tuple(sorted(line))
    return found


def _outline(flat: np.ndarray, faces: Sequence[Sequence[int]]) -> list[int]:
    """Vertices of the longest closed line of edges with one face, counter-clockwise; empty if edges meet in other ways."""
    pairs = {pair for face in faces for pair in _sides(face)}
    after: dict[int, int] = {}
    for first, last in sorted(pairs):
        if (last, first) not in pairs:
            if first in after:
                return []
            after[first] = last
    best: list[int] = []
    length = 0.0
    while after:
        at, loop = next(iter(after)), list[int]()
        while at in after:
            loop.append(at)
            at = after.pop(at)
        points = flat[loop]
        size = float(np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1).sum())
        if size > length:
            best, length = loop, size
    return best


def _letter(angle: float) -> str:
    """Assignment of a crease with a fold angle, rad."""
    return "F" if abs(angle) < _FLAT else "V" if angle > 0.0 else "M"


def _sides(face: Sequence[int]) -> list[tuple[int, int]]:
    """Directed edges of a face."""
    return [(int(a), int(b)) for a, b in zip(face, [*face[1:], face[0]], strict=True)]
