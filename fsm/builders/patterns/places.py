"""Places on a sheet by name or by geometry: edges, vertices, facets, and boxes."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from fsm.case.pattern_files.pattern import Pattern

_NUMBERS = re.compile(r"(vertex|vertices|facet)\s+(\d+(?:\s*,\s*\d+)*)")
_FACETS = re.compile(r"facets?\s+(\d+(?:\s*,\s*\d+)*)")


class Place(NamedTuple):
    """Place on a sheet: its name, and its vertices or its facet (numbers from 0)."""

    name: str
    vertices: tuple[int, ...]
    facet: int | None = None


def place_of(pattern: Pattern, at: str | tuple[tuple[float, float, float], tuple[float, float, float]]) -> Place:
    """Vertices or facet at a place.

    Parameters
    ----------
    pattern : Pattern
    at : str, or two opposite corners of a box in m
        "edge left", "vertex 12", "vertices 3, 4, 5", "facet 7" (numbers from 1), or a box around vertices at the start.

    Raises
    ------
    ValueError
        There is no such place; the message lists the places.
    """
    if not isinstance(at, str):
        return _in_box(pattern, np.array(at))
    word, _, rest = at.strip().partition(" ")
    if word == "edge":
        if rest not in pattern.groups:
            names = ", ".join(f'"edge {name}"' for name in pattern.groups)
            raise ValueError(f'"{at}" is not an edge of the sheet; its edges are {names or "not named, give vertices"}')
        return Place(at.strip(), pattern.groups[rest])
    match = _NUMBERS.fullmatch(at.strip())
    if match is None:
        text = 'give "edge left", "vertex 12", "vertices 3, 4, 5", "facet 7", or a box [[x, y, z], [x, y, z]]'
        raise ValueError(f'"{at}" is not a place of the sheet; {text}')
    numbers = tuple(int(number) - 1 for number in match[2].split(","))
    if match[1] == "facet":
        if len(numbers) > 1:
            raise ValueError(f'"{at}" names {len(numbers)} facets; give one facet for each item')
        _check(numbers, len(pattern.faces), "facets")
        return Place(f"facet {numbers[0] + 1}", (), numbers[0])
    _check(numbers, len(pattern.vertices), "vertices")
    return Place(at.strip(), tuple(dict.fromkeys(numbers)))


def facets_named(at: str, count: int) -> tuple[int, ...]:
    """Numbers from 0 of facets on which a pressure acts: "all", "facet 3", or "facets 1, 2".

    Parameters
    ----------
    at : str
    count : number of facets of the sheet

    Raises
    ------
    ValueError
        There is no such facet.
    """
    if at.strip() == "all":
        return tuple(range(count))
    match = _FACETS.fullmatch(at.strip())
    if match is None:
        raise ValueError(f'"{at}" names no facets; a pressure needs "all", "facet 3" or "facets 1, 2"')
    numbers = tuple(dict.fromkeys(int(number) - 1 for number in match[1].split(",")))
    _check(numbers, count, "facets")
    return numbers


def _check(numbers: tuple[int, ...], count: int, what: str) -> None:
    """Raise a ValueError if a number is out of range."""
    for number in numbers:
        if not 0 <= number < count:
            raise ValueError(f"there is no number {number + 1}; the sheet has {count} {what}, numbered from 1")


def _in_box(pattern: Pattern, corners: np.ndarray) -> Place:
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = 1e-9 * max(pattern.extent(), 1e-300)
    inside = ((pattern.vertices >= low - margin) & (pattern.vertices <= high + margin)).all(axis=1)
    if not inside.any():
        sides = "; ".join(f"{x} {a:.4g} to {b:.4g} m" for x, a, b in zip("xyz", *_bounds(pattern), strict=True))
        raise ValueError(f"the box contains no vertex of the sheet, which extends over {sides}; move or enlarge the box")
    return Place("box " + " ".join(f"{x:g}" for x in corners.ravel()), tuple(np.flatnonzero(inside).tolist()))


def _bounds(pattern: Pattern) -> tuple[list[float], list[float]]:
    return pattern.vertices.min(axis=0).tolist(), pattern.vertices.max(axis=0).tolist()
