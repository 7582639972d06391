"""Flat crease pattern from lines: vertices at their ends and crossings, and faces between them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fsm.case.pattern_files.holes import area, joining_lines, loops
from fsm.case.pattern_files.mending import SAME, Edges, merged, tolerances, without_loose
from fsm.case.pattern_files.pattern import ASSIGNMENTS, Line, Pattern, PatternFault, Reading, counted, edge_groups, others
from fsm.text.shown_units import shown_points

_SIZES = 1e-6, 1e4
"""Smallest and largest size of a pattern, m."""


def check_size(size: float) -> None:
    """Raise a ValueError if the size of a pattern (m) is outside the range of sheets."""
    if not _SIZES[0] <= size <= _SIZES[1]:
        text = f"the pattern has a size of {size:.3g} m; it must be from {_SIZES[0]:g} to {_SIZES[1]:g} m"
        raise ValueError(f"{text}: correct the unit or the coordinates")


def planar_pattern(
    lines: list[Line], scale: float, split: bool = True, reading: Reading | None = None, notes: Sequence[str] = ()
) -> Pattern:
    """Pattern of lines in the plane.

    Without `reading.merge`, points are one vertex up to a distance that follows from the file (`mending.tolerances`); if the
    pattern is faulty with this distance, some smaller and larger ones are tried.

    Parameters
    ----------
    lines : list of Line
    scale : length of one unit of the lines, m
    split : bool
        Whether lines are split where they cross; if false, crossing lines are an error, and points are one vertex only if
        the digits of the coordinates do not distinguish them.
    reading : choices of the section [sheet]
    notes : notes of the file, in front of those of the pattern

    Raises
    ------
    PatternFault
        The pattern has a crease of zero length, lines that cross or contradict each other, a line that ends inside of a
        facet, or separate parts.
    ValueError
        The pattern is empty, or too large.
    """
    reading = Reading() if reading is None else reading
    if not lines:
        raise ValueError("the pattern has no lines; draw the outline and the creases")
    ends = np.array([(line.first, line.last) for line in lines], dtype=float)
    if not np.isfinite(ends).all():
        raise ValueError("a coordinate of the pattern is not a finite number; correct the coordinate")
    with np.errstate(over="ignore"):
        size = float(np.ptp(ends.reshape(-1, 2), axis=0).max())
        if size:
            check_size(size * scale)
    nothing = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) <= SAME * size
    if nothing.all():
        raise ValueError("all lines of the pattern have zero length; correct the coordinates or the scale")
    letters = [line.letter for line in lines]
    for k in np.flatnonzero(nothing):
        if letters[k] in "MVU" and not split:
            x, y = ends[k, 0]
            text = f"the {ASSIGNMENTS[letters[k]]} crease at ({x:g}, {y:g}) has zero length; remove it"
            raise PatternFault(text, ends[k, :1] * scale).among(ends * scale, letters)
    first: PatternFault | None = None
    for near in tolerances(ends, size, split) if reading.merge is None else (reading.merge / scale,):
        try:
            pattern = _with_tolerance(lines, ends, scale, max(near, SAME * size), split, reading.part)
            return replace(pattern, notes=(*notes, *pattern.notes))
        except PatternFault as fault:
            first = first or fault
            if isinstance(fault, _Parts):
                first = fault
                break
    assert first is not None
    raise first.among(ends * scale, letters)


def _with_tolerance(
    lines: list[Line], ends: np.ndarray, scale: float, near: float, split: bool, part: int | None
) -> Pattern:
    points, edges, notes = merged(lines, ends, near, split, scale)
    edges, ignored = without_loose(edges)
    if ignored:
        first = shown_points([scale * points[ignored[0][0]]])
        notes.append(f"{counted(len(ignored), 'flat crease or bend line', 'flat creases and bend lines')} bound no facet "
                     f"and are ignored, the first at {first}")  # fmt: skip
    joined, holes = joining_lines(points, {pair: letter for pair, (letter, _) in edges.items()}, near)
    edges |= dict.fromkeys(joined, ("F", 0.0))
    if joined:
        text = counted(holes, "hole or end of a cut", "holes and ends of cuts")
        notes.append(
            f"{counted(len(joined), 'flat line', 'flat lines')} added between the outline and {text} inside of facets"
        )
    _check_ends(points * scale, edges)
    try:
        pattern = _with_faces(points * scale, edges)
        if part is not None and part > 1:
            raise PatternFault(f"sheet.part = {part}, but the pattern is one part; remove sheet.part")
    except _Parts as fault:
        if part is None or part > len(fault.parts):
            raise
        sides = {(min(u, v), max(u, v)) for f in fault.parts[part - 1] for u, v in zip(f, [*f[1:], f[0]], strict=True)}
        edges = {pair: found for pair, found in edges.items() if pair in sides}
        pattern = _with_faces(points * scale, edges)
        notes.append(f"part {part} of {len(fault.parts)} is the sheet (sheet.part)")
    outside = len(edges) - len(pattern.edges)
    if outside and split:
        notes.append(f"{counted(outside, 'line or part of a line', 'lines or parts of lines')} outside of all facets "
                     "are ignored")  # fmt: skip
    return replace(pattern, notes=(*notes, *pattern.notes))


def _check_ends(flat: np.ndarray, edges: Edges) -> None:
    """Raise a PatternFault if lines end inside of a facet."""
    degree: dict[int, int] = {}
    for pair in edges:
        for v in pair:
            degree[v] = degree.get(v, 0) + 1
    if min(degree.values()) > 1:
        return
    bad = sorted({v for loop, area in loops(flat, edges) if area > 0.0 for v in loop if degree[v] == 1})
    if bad:
        x, y = flat[bad[0]]
        text = f"a line ends inside of a facet near ({x:g}, {y:g}) m{others(len(bad))}"
        raise PatternFault(f"{text}; continue it to another line, or remove it", flat[bad])


def _with_faces(flat: np.ndarray, edges: Edges) -> Pattern:
    """Pattern with the faces that the edges enclose."""
    faces = [loop for loop, area in loops(flat, edges) if area > 0.0]
    if not faces:
        raise PatternFault("the lines of the pattern enclose no facet; close the outline", _free_ends(flat, edges))
    for face in faces:
        if len(set(face)) < len(face):
            place = next(v for v, count in Counter(face).items() if count > 1)
            x, y = flat[place]
            raise PatternFault(
                f"a facet touches itself at ({x:g}, {y:g}) m; separate its corners there, or join them by a line",
                flat[[place]],
            )
    faces, cut_off = _joined(faces, edges, flat)
    used = np.unique(np.concatenate(faces))  # the outline without the ends of lines that extend beyond it
    number = {int(v): k for k, v in enumerate(used)}
    faces = [[number[v] for v in face] for face in faces]
    edges = {(number[u], number[v]): found for (u, v), found in edges.items() if u in number and v in number}
    flat = flat[used]
    pattern = Pattern.of_faces(np.column_stack([flat, np.zeros(len(flat))]), faces, flat, edge_groups(flat, faces))
    found = [edges[min(u, v), max(u, v)] for u, v in pattern.edges.tolist()]
    letters = ["B" if old == "B" else "C" if letter == "B" else letter
               for old, (letter, _) in zip(pattern.assignment, found, strict=True)]  # fmt: skip
    targets = [0.0 if letter in "BCJ" else target for letter, (_, target) in zip(letters, found, strict=True)]
    notes: tuple[str, ...] = ()
    if cut_off:
        text = counted(len(cut_off), "area without creases is", "areas without creases are")
        notes = (f"{text} cut off from the sheet and left out, the first around {shown_points(cut_off[:1])}",)
    return replace(pattern.assigned(letters, targets), notes=notes)


def _joined(faces: list[list[int]], edges: Edges, flat: np.ndarray) -> tuple[list[list[int]], list[np.ndarray]]:
    """Facets that creases join, and the middles of areas beside the outline that are left out. Other areas that boundaries
    and cuts enclose are holes.

    Raises
    ------
    _Parts
        Creases do not join all facets.
    """
    owner: dict[tuple[int, int], int] = {}
    parent = list(range(len(faces)))
    beside: set[int] = set()

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    for number, face in enumerate(faces):
        for u, v in zip(face, [*face[1:], face[0]], strict=True):
            pair = min(u, v), max(u, v)
            if pair in owner:
                if edges[pair][0] in "BC":
                    beside |= {number, owner[pair]}
                else:
                    parent[root(number)] = root(owner[pair])
            owner.setdefault(pair, number)
    parts: dict[int, list[int]] = {}
    for number in range(len(faces)):
        parts.setdefault(root(number), []).append(number)
    sheets = [part for part in parts.values() if len(part) > 1 or part[0] not in beside]
    if len(sheets) == 1:
        both = Counter((min(pair), max(pair)) for face in faces for pair in zip(face, [*face[1:], face[0]], strict=True))
        left_out = [faces[part[0]] for part in parts.values() if part is not sheets[0]]
        outer = [
            face for face in left_out
            if any(both[min(pair), max(pair)] == 1 for pair in zip(face, [*face[1:], face[0]], strict=True))
        ]  # fmt: skip
        return [faces[number] for number in sheets[0]], [flat[face].mean(axis=0) for face in outer]
    raise _Parts(flat, [[faces[number] for number in part] for part in sheets or parts.values()])


class _Parts(PatternFault):
    """Separate parts of a pattern, from the largest; `parts` has the faces of each part."""

    def __init__(self, flat: np.ndarray, parts: list[list[list[int]]]) -> None:
        areas = [sum(area(flat[face]) for face in part) for part in parts]
        order = sorted(range(len(parts)), key=lambda k: (-float(f"{areas[k]:.9e}"), *flat[parts[k][0][0]]))
        self.parts = [parts[k] for k in order]
        middles = [flat[np.unique(np.concatenate(part))].mean(axis=0) for part in self.parts]
        listed = [
            f"{number} with {counted(len(part), 'facet', 'facets')} around {shown_points([middle])}"
            for number, (part, middle) in enumerate(zip(self.parts, middles, strict=True), 1)
        ]
        more = f" and {len(listed) - 4} more" if len(listed) > 4 else ""
        text = f"the pattern has {len(parts)} separate parts: {', '.join(listed[:4])}{more}"
        super().__init__(
            f"{text}; choose one by its number, for example sheet.part = 1", middles, [str(k + 1) for k in range(len(parts))]
        )


def _free_ends(flat: np.ndarray, edges: Edges) -> np.ndarray:
    """Positions of vertices with one line only."""
    vertices, counts = np.unique(np.array(list(edges)).ravel(), return_counts=True)
    return flat[vertices[counts == 1]]
