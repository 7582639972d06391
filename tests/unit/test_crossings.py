"""Crossings of lines: those of a comparison of all pairs, and work that grows with the number of lines."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from fsm.case.pattern_files import crossings as module
from fsm.case.pattern_files.crossings import crossings, points_on_lines
from fsm.case.pattern_files.pattern import Line
from fsm.case.pattern_files.planar import planar_pattern


def cross(ends: np.ndarray, vertices: np.ndarray | None = None, near: float = 1e-6) -> np.ndarray:
    numbers = np.arange(2 * len(ends)).reshape(-1, 2) if vertices is None else vertices
    return crossings(ends, numbers, near)


def test_crossings_of_random_lines() -> None:
    """All pairs, by the signs of areas: as many crossings, each on both of its lines, ordered by the lowest x."""
    random = np.random.default_rng(3)
    start = random.uniform(size=(300, 2))
    ends = np.stack([start, start + random.normal(size=(300, 2)) * random.choice([0.02, 0.2, 1.0], size=(300, 1))], axis=1)

    def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
        (x, y), (u, v) = b - a, c - a
        return float(x * v - y * u)

    order = np.argsort(ends[:, :, 0].min(axis=1))
    pairs = [
        (one, other) for one, other in itertools.combinations(order, 2)
        if side(*ends[one], ends[other, 0]) * side(*ends[one], ends[other, 1]) < 0.0
        and side(*ends[other], ends[one, 0]) * side(*ends[other], ends[one, 1]) < 0.0
    ]  # fmt: skip
    found = cross(ends)
    assert len(found) == len(pairs) > 1000
    for point, pair in zip(found, pairs, strict=True):
        for a, b in ends[list(pair)]:
            assert abs(side(a, b, point)) < 1e-12
    lines, points, off = points_on_lines(found, ends, 1e-9)
    assert off.max() < 1e-9
    wanted = [sorted({k for k, pair in enumerate(pairs) if line in pair}) for line in range(300)]
    assert [sorted(points[lines == line].tolist()) for line in range(300)] == wanted
    along = np.linalg.norm(found[points] - ends[lines, 0], axis=1)
    assert (np.diff(along)[np.diff(lines) == 0] > 0.0).all()


@pytest.mark.parametrize("degrees", [0.0, 10.0, 45.0, 90.0, 147.0])
def test_parallel_lines_need_few_comparisons(degrees: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """2,000 parallel lines a thousandth of their length apart, and their ends: 2e6 pairs overlap along x or y."""
    monkeypatch.setattr(module, "_MOST_COMPARED", 200_000)
    angle = math.radians(degrees)
    along, across = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    start = 1e-3 * np.arange(2000)[:, None] * across
    ends = np.stack([start, start + along], axis=1)
    assert not len(cross(ends))
    lines, points, _ = points_on_lines(ends.reshape(-1, 2), ends, 1e-6)
    assert lines.tolist() == np.repeat(np.arange(2000), 2).tolist()
    assert points.tolist() == np.arange(4000).tolist()


def test_too_many_near_lines_are_refused() -> None:
    """39,000 lines at one point, and as many times one line: no comparison of all pairs."""
    angles = 2.0 * math.pi * np.arange(39_000) / 39_000
    star = [Line((0.0, 0.0), (math.cos(a), math.sin(a)), "M", -math.pi) for a in angles.tolist()]
    with pytest.raises(ValueError, match=r"too near to each other: 760,480,500 pairs .* limit is 150,000,000; give fewer"):
        planar_pattern(star, 1.0, split=False)
    same = [Line((0.0, 0.0), (1.0, 1.0), "M", -math.pi)] * 20_000
    with pytest.raises(ValueError, match="enclose no facet"):
        planar_pattern(same, 1.0)
