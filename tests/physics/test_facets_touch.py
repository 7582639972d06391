"""Contact between the facets of rigid sheets."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np

from fsm.results.solution import Solution
from tests.runs import run

ZIGZAG = """
[sheet]
kind = "zigzag"
columns = 6
a = "40 mm"
b = "30 mm"
fold_angle = "60 deg"
thickness = "0.5 mm"
[[sheet.support]]
at = "edge left"
fixed = ["x", "y", "z"]
[material]
young = 3e9
density = 1000
damping = "10 ms"
[crease]
stiffness_per_length = 0.05
{contact}
[[drive]]
edge = "right"
direction = [-1, 0, 0]
speed = "1 mm/s"
travel = "104 mm"
[solve]
method = "static"
[save]
every = "1 mm"
"""
CONTACT = """
[contact]
law = "linear"
stiffness = "1e6 N/m"
"""


def crossings(solution: Solution) -> int:
    """Number of pairs of facets without a common crease whose middle lines cross in the x-z plane, over all records."""
    found = 0
    for quads in solution.shape[..., [0, 2]]:
        lines = np.stack([quads.min(axis=1), quads.max(axis=1)])  # boxes are compared first, because this is fast
        for i, j in combinations(range(len(quads)), 2):
            if j == i + 1 or (lines[0, i] > lines[1, j]).any() or (lines[0, j] > lines[1, i]).any():
                continue
            (a, b), (c, d) = ends(quads[i]), ends(quads[j])
            found += side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0
    return found


def ends(quad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The two corners of a quad (4, 2), seen from its side, that are farthest apart."""
    apart = np.linalg.norm(quad[:, None] - quad[None], axis=2)
    i, j = np.unravel_index(np.argmax(apart), apart.shape)
    return quad[i], quad[j]


def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    along, over = b - a, c - a
    return float(along[0] * over[1] - along[1] * over[0])


def test_facets_do_not_pass_through_each_other(tmp_path: Path) -> None:
    """A zigzag is pushed together, bulges, and its middle panels meet; without contact they cross."""
    (tmp_path / "free").mkdir()
    free, _ = run(tmp_path / "free", ZIGZAG.format(contact=""))
    assert crossings(free) > 0
    touching, summary = run(tmp_path, ZIGZAG.format(contact=CONTACT))
    assert crossings(touching) == 0
    assert summary["energy_error"] < 1e-4
    stages = [stage["name"] for stage in summary["stages"]]  # type: ignore[attr-defined]
    assert "contact" in stages
    at = touching.travel[:, 0] < 0.09
    np.testing.assert_allclose(touching.force[at, 0], np.interp(touching.travel[at, 0], free.travel[:, 0], free.force[:, 0]),
                               rtol=1e-3, atol=1e-6)  # fmt: skip
