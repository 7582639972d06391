"""Conditions for folding at the inner vertices of a flat pattern.

Consider the creases at a vertex that all fold from flat, mountains to one side and valleys to the other. Rigid facets allow
this only if two conditions hold: the creases of one kind span the plane with positive factors, and there is a crease of the
other kind (Abel, Cantarella, Demaine, Eppstein, Hull, Ku, Lang and Tachi, 2016). Kawasaki (1989) and Maekawa give conditions
for the state that is folded flat.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fsm.case.pattern_files.pattern import Pattern

_CREASES = "MVU"
_EITHER = "UFJ"
"""Letters of creases and bend lines that can fold to either side or remain flat."""
_SAME = 1e-6
"""Alternating sum of sector angles that is round-off, rad."""
_NAMED = 20
"""Largest number of vertices in a line."""
_STRAIGHT = 1e-6
"""Difference from 180 degrees below which two creases are one straight line, rad."""


class Foldability(NamedTuple):
    """Inner vertices of a flat pattern, and vertices that violate a condition (numbers from 0).

    Attributes
    ----------
    inner : vertices with facets all around them
    rigid : vertices with fewer than four creases: rigid facets cannot fold there
    blocked : vertices whose mountains and valleys cannot all fold from flat together, with rigid facets
    kawasaki : vertices at which the alternating sum of the sector angles is not zero, so that they do not fold flat
    maekawa : vertices at which mountains and valleys do not differ by two, so that they do not fold flat
    """

    inner: tuple[int, ...]
    rigid: tuple[int, ...]
    blocked: tuple[int, ...]
    kawasaki: tuple[int, ...]
    maekawa: tuple[int, ...]

    @property
    def folds_flat(self) -> bool:
        """Whether all inner vertices meet the conditions for flat folding, which are necessary and not sufficient."""
        return not (self.rigid or self.kawasaki or self.maekawa)


def foldability(pattern: Pattern, bends: bool = False) -> Foldability | None:
    """Conditions at all inner vertices; None for a pattern without a flat state.

    Vertices without creases count as inner vertices that meet all conditions. Unassigned creases count for Kawasaki's
    condition (Kawasaki, 1989); Maekawa's condition is not checked there.

    Parameters
    ----------
    pattern : Pattern
    bends : whether facets bend along the bend lines of the pattern
    """
    if pattern.flat is None:
        return None
    edges = list(zip(pattern.edges.tolist(), pattern.assignment, strict=True))
    outer = {v for edge, letter in edges if letter in "BC" for v in edge}
    around: dict[int, list[tuple[float, str]]] = {}
    folding = _CREASES + (_EITHER if bends else "")
    for (u, v), letter in edges:
        if letter in folding:
            along = pattern.flat[v] - pattern.flat[u]
            angle = math.atan2(along[1], along[0])
            around.setdefault(u, []).append((angle % (2.0 * math.pi), letter))
            around.setdefault(v, []).append(((angle + math.pi) % (2.0 * math.pi), letter))
    inner = tuple(vertex for vertex in range(len(pattern.flat)) if vertex not in outer)
    rigid, blocked, kawasaki, maekawa = [], [], [], []
    for vertex in inner:
        every = sorted(around.get(vertex, []))
        lines = [line for line in every if line[1] in _CREASES]
        if not lines or _is_straight(lines):
            continue
        if len(every) < 4:
            rigid.append(vertex)
        elif not _folds_rigidly(every):
            blocked.append(vertex)
        angles = np.array([angle for angle, _ in lines])
        sectors = np.diff(angles, append=angles[0] + 2.0 * math.pi)
        if len(lines) % 2 or abs(float(sectors[::2].sum() - sectors[1::2].sum())) > _SAME:
            kawasaki.append(vertex)
        letters = [letter for _, letter in lines]
        if "U" not in letters and abs(letters.count("M") - letters.count("V")) != 2:
            maekawa.append(vertex)
    return Foldability(inner, tuple(rigid), tuple(blocked), tuple(kawasaki), tuple(maekawa))


def bad_vertices(pattern: Pattern, bends: bool = False) -> list[tuple[tuple[int, ...], str, str]]:
    """Vertices (from 0) that cannot fold from flat, and other vertices that do not fold flat, each with the marker of a
    picture and a text; kinds without vertices are left out.
    """
    found = foldability(pattern, bends)
    if found is None:
        return []
    stuck = tuple(sorted({*found.rigid, *found.blocked}))
    open_ones = tuple(sorted({*found.kawasaki, *found.maekawa} - set(stuck)))
    kinds = [(stuck, "X", "cannot fold from flat"), (open_ones, "o", "does not fold flat")]
    return [(vertices, marker, text) for vertices, marker, text in kinds if vertices]


def bad_lines(pattern: Pattern, bends: bool = False) -> list[str]:
    """Lines that name the vertices of `bad_vertices`, numbered from 1."""
    found = []
    for vertices, _, text in bad_vertices(pattern, bends):
        listed = ", ".join(str(v + 1) for v in vertices[:_NAMED]) + (" ..." if len(vertices) > _NAMED else "")
        found.append(f"{'vertex' if len(vertices) == 1 else f'{len(vertices)} vertices:'} {listed} {text}")
    return found


def _folds_rigidly(lines: Sequence[tuple[float, str]]) -> bool:
    """Whether rigid facets around a vertex can fold from flat about lines (angle, letter), mountains to one side and valleys
    to the other.
    """
    free = [angle for angle, letter in lines if letter in _EITHER]
    for side, other in ("MV", "VM"):
        own = [angle for angle, letter in lines if letter == side]
        if any(letter == other for _, letter in lines):
            if _span_plane([*own, *free]):
                return True
        elif any(_span_plane([*own, *free[:k], *free[k + 1 :]]) for k in range(len(free))):
            return True
    return False


def _span_plane(angles: Sequence[float]) -> bool:
    """Whether directions span the plane with positive factors; this holds if every angle between neighbouring directions is
    below 180 degrees.
    """
    if len(angles) < 3:
        return False
    ordered = sorted(angles)
    return bool(np.diff(ordered, append=ordered[0] + 2.0 * math.pi).max() < math.pi - _STRAIGHT)


def _is_straight(lines: list[tuple[float, str]]) -> bool:
    """Whether two creases make one straight line, about which rigid facets can fold."""
    return len(lines) == 2 and abs(abs(lines[1][0] - lines[0][0]) - math.pi) < _STRAIGHT and lines[0][1] == lines[1][1]
