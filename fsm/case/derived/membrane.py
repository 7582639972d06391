"""Mesh lines of a film along the edges of its patches, and checks of the patches."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

from fsm.case.models.membrane import CentrePatch, DiagonalPatch, DiagonalsPatch, Membrane, Patch, PositionPatch
from fsm.errors import Fault
from fsm.text.shown_units import shown, shown_points

COARSEST = 5.0
"""Largest ratio of the widths of two neighbouring elements at the edge of a patch."""
_SAME = 1e-9
"""Largest difference of two lengths that count as equal, relative to the size of the film."""


@dataclass(frozen=True)
class PlacedPatch:
    """Patch with its position.

    Attributes
    ----------
    number : number of its section in the case, from 0
    x, y : m
        Coordinates of the centre of the patch, from the centre of the film.
    size : m
        Side of the patch.
    """

    number: int
    x: float
    y: float
    size: float

    def covers(self, x: float, y: float) -> bool:
        """Whether a point lies in the patch."""
        return max(abs(x - self.x), abs(y - self.y)) < 0.5 * self.size

    def edges(self, axis: int) -> tuple[float, float]:
        """Coordinates of its edges along x (axis 0) or y (axis 1), m."""
        centre = (self.x, self.y)[axis]
        return centre - 0.5 * self.size, centre + 0.5 * self.size


@dataclass(frozen=True)
class MeshLines:
    """Coordinates of the mesh lines along length (x) and width (y), m from the centre of the film, increasing."""

    x: tuple[float, ...]
    y: tuple[float, ...]

    def patch_of(self, patches: Sequence[PlacedPatch], column: int, row: int) -> int | None:
        """Number of the patch of an element; None if it belongs to the film."""
        x, y = 0.5 * sum(self.x[column : column + 2]), 0.5 * sum(self.y[row : row + 2])
        return next((patch.number for patch in patches if patch.covers(x, y)), None)


def place_patches(membrane: Membrane, patches: Mapping[int, Patch]) -> list[PlacedPatch]:
    """All patches with their positions; one section can give several patches."""
    diagonal = math.hypot(membrane.length, membrane.width)
    along = (membrane.length / diagonal, membrane.width / diagonal)
    placed = []
    for number, patch in patches.items():
        placed += [PlacedPatch(number, x, y, patch.size) for x, y in _centres(patch, along)]
    return placed


def _centres(patch: Patch, along: tuple[float, float]) -> list[tuple[float, float]]:
    """Centres of the patches of a section; `along` points from the film's centre to its corner ++."""
    if isinstance(patch, CentrePatch):
        return [(0.0, 0.0)]
    if isinstance(patch, PositionPatch):
        return [patch.position]
    if isinstance(patch, DiagonalPatch):
        return [_on_arm(patch.arm, patch.distance, along)]
    if isinstance(patch, DiagonalsPatch):
        steps = range(1, patch.count + 1)
        return [_on_arm(arm, step * patch.distance, along) for step in steps for arm in ("++", "-+", "--", "+-")]
    xs, ys = (
        [(step - 0.5 * (count - 1)) * spacing for step in range(count)]
        for count, spacing in zip(patch.count, patch.spacing, strict=True)
    )
    return [(x, y) for y in ys for x in xs]


def _on_arm(arm: str, distance: float, along: tuple[float, float]) -> tuple[float, float]:
    x, y = (distance * part if sign == "+" else -distance * part for sign, part in zip(arm, along, strict=True))
    return x, y


def mesh_lines(membrane: Membrane, patches: Sequence[PlacedPatch]) -> MeshLines:
    """Mesh lines on the edges of film and patches, with equal cells between these lines; the cells are at least as fine as
    `mesh` requires.
    """
    return MeshLines(*(_divided(*_pieces(membrane, patches, axis)) for axis in (0, 1)))


def finer_lines(membrane: Membrane, patches: Sequence[PlacedPatch]) -> MeshLines:
    """Mesh lines of `mesh_lines` with every cell halved in both directions."""
    found = [_pieces(membrane, patches, axis) for axis in (0, 1)]
    return MeshLines(*(_divided(given, [2 * count for count in counts]) for given, counts in found))


def coarser_lines(membrane: Membrane, patches: Sequence[PlacedPatch]) -> tuple[MeshLines, float]:
    """Mesh lines with half as many cells between the edges of film and patches, and the smallest ratio of these numbers.

    The ratio is 1 if a single cell lies between two edges.
    """
    found = [_pieces(membrane, patches, axis) for axis in (0, 1)]
    halves = [[math.ceil(count / 2) for count in counts] for _, counts in found]
    ratios = [
        count / half for (_, counts), few in zip(found, halves, strict=True) for count, half in zip(counts, few, strict=True)
    ]
    lines = MeshLines(*(_divided(given, few) for (given, _), few in zip(found, halves, strict=True)))
    return lines, min(ratios)


def _divided(given: Sequence[float], counts: Sequence[int]) -> tuple[float, ...]:
    """Lines with equal cells of these numbers between successive given lines."""
    lines = [given[0]]
    for (begin, end), pieces in zip(pairwise(given), counts, strict=True):
        lines += [begin + (end - begin) * step / pieces for step in range(1, pieces)] + [end]
    return tuple(lines)


def _pieces(membrane: Membrane, patches: Sequence[PlacedPatch], axis: int) -> tuple[list[float], list[int]]:
    """Edges of film and patches along an axis, m, and numbers of cells between them."""
    size, count = _sizes(membrane)[axis], membrane.mesh[axis]
    wanted = sorted([-0.5 * size, 0.5 * size, *(edge for patch in patches for edge in patch.edges(axis))])
    given = [wanted[0]]
    for line in wanted[1:]:
        if line - given[-1] > _SAME * size:
            given.append(line)
    return given, [max(1, math.ceil((end - begin) / size * count - 1e-6)) for begin, end in pairwise(given)]


def _sizes(membrane: Membrane) -> tuple[float, float]:
    return membrane.length, membrane.width


def check_film(membrane: Membrane, patches: Mapping[int, Patch]) -> list[Fault]:
    """Faults of patches outside the film, of patches that overlap, and of meshes that are too coarse for a patch."""
    placed = place_patches(membrane, patches)
    faults = [*_outside(membrane, placed), *_overlapping(membrane, placed)]
    return faults or list(_coarse(membrane, placed))


def _where(patch: PlacedPatch) -> str:
    return f"its centre is {shown_points([(patch.x, patch.y)])}"


def _outside(membrane: Membrane, placed: Sequence[PlacedPatch]) -> Iterator[Fault]:
    reported = set()
    for patch in placed:
        for axis, (name, size) in enumerate(zip(("length", "width"), _sizes(membrane), strict=True)):
            reach = max(abs(edge) for edge in patch.edges(axis))
            if reach > (0.5 + _SAME) * size and patch.number not in reported:
                reported.add(patch.number)
                yield Fault(
                    f"patch.{patch.number}",
                    f"extends {shown(reach - 0.5 * size, 'm')} beyond the film along its {name} ({_where(patch)}, its "
                    f"side {shown(patch.size, 'm')}; the film ends at {shown(0.5 * size, 'm')}); move or shrink it",
                )


def _overlapping(membrane: Membrane, placed: Sequence[PlacedPatch]) -> Iterator[Fault]:
    reported = set()
    near = _SAME * max(_sizes(membrane))
    for one, two in combinations(placed, 2):
        reach = 0.5 * (one.size + two.size)
        depth = reach - max(abs(one.x - two.x), abs(one.y - two.y))
        pair = (one.number, two.number)
        if depth > near and pair not in reported:
            reported.add(pair)
            with_what = f"patch.{one.number}" if one.number != two.number else "another of the same section"
            yield Fault(
                f"patch.{two.number}",
                f"overlaps {with_what} by {shown(depth, 'm')} ({_where(two)}); place the centres at least "
                f"{shown(reach, 'm')} apart along x or y",
            )


def _coarse(membrane: Membrane, placed: Sequence[PlacedPatch]) -> Iterator[Fault]:
    """Faults of neighbouring elements with very different widths at the edge of a patch."""
    reported = set()
    for axis, (name, size) in enumerate(zip(("length", "width"), _sizes(membrane), strict=True)):
        lines = (mesh_lines(membrane, placed).x, mesh_lines(membrane, placed).y)[axis]
        widths = [end - begin for begin, end in pairwise(lines)]
        for k, (left, right) in enumerate(pairwise(widths)):
            small, large = min(left, right), max(left, right)
            if large <= COARSEST * small * (1 + 1e-9):
                continue
            edge = lines[k + 1]
            patch = min(placed, key=lambda patch: min(abs(edge - end) for end in patch.edges(axis)))
            if patch.number in reported:
                continue
            reported.add(patch.number)
            number = math.ceil(size / (COARSEST * small))
            yield Fault(
                "membrane.mesh",
                f"too coarse for patch.{patch.number} along the {name}: an element at its edge is {shown(small, 'm')} "
                f"wide, its neighbour {shown(large, 'm')}; give at least {number} elements, or move the edges",
            )
