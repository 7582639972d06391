"""Sheets with rows of slits: vertices, edges and facets against counts by hand, edges of the sheet, and impossible sizes."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from fsm.builders.patterns.slits import slits
from fsm.case.pattern_files.pattern import Pattern

SPACING, SLIT, LIGAMENT = 3.8e-3, 17.2e-3, 4.4e-3
SIZES = SPACING, SLIT, LIGAMENT


def area(pattern: Pattern) -> float:
    """Area of all facets, m^2."""
    return sum(float(np.prod(np.ptp(pattern.vertices[list(face), :2], axis=0))) for face in pattern.faces)


@pytest.mark.parametrize(
    ("periods", "rows", "vertices", "facets", "letters"),
    [
        # lines x = 0, 8.6, 13, 21.6 mm: half slits at both sides, so the cuts make no hole
        (1, 1, 14, 6, {"B": 10, "C": 4, "F": 5}),
        # also the lines 2.2, 19.4 mm: a whole slit in row 2
        (1, 2, 30, 15, {"B": 16, "C": 14, "F": 15}),
        # 21 x 32 rectangles; 16 rows with 16 edges on slits, and 15 rows with 15 edges
        (5, 31, 22 * 33 + 16 * 12 + 15 * 10, 672, {"B": 2 * 21 + 2 * 32, "C": 962, "F": 15 * 6 + 16 * 5 + 20 * 32}),
    ],
)
def test_counts_by_hand(periods: float, rows: int, vertices: int, facets: int, letters: dict[str, int]) -> None:
    """Slits without width are cuts of two edges; the Euler characteristic is 1 less the number of slits inside."""
    pattern = slits(periods, rows, *SIZES)
    assert len(pattern.vertices) == vertices and len(pattern.faces) == facets
    assert Counter(pattern.assignment) == letters
    inside = sum(periods if row % 2 else periods - 1 for row in range(rows))
    assert len(pattern.vertices) - len(pattern.edges) + len(pattern.faces) == 1 - inside
    assert area(pattern) == pytest.approx(periods * (SLIT + LIGAMENT) * (rows + 1) * SPACING)
    for name, axis, where in (("left", 0, 0.0), ("top", 1, (rows + 1) * SPACING)):
        np.testing.assert_allclose(pattern.vertices[list(pattern.groups[name]), axis], where, rtol=1e-12)


@pytest.mark.parametrize("shift", [0.0, 0.3, 0.5])
def test_slits_with_a_width_are_holes(shift: float) -> None:
    """A hole takes the area of its slit; slits that are open to a side are cut at this side."""
    width = 0.5e-3
    pattern = slits(3, 4, *SIZES, width, shift)
    assert "C" not in pattern.assignment
    period = SLIT + LIGAMENT
    whole = 3 * period * 5 * SPACING - 4 * 3 * SLIT * width  # a shift by periods of the sheet keeps the length of slits
    assert area(pattern) == pytest.approx(whole)
    assert pattern.vertices[:, 1].max() == pytest.approx(5 * SPACING)


@pytest.mark.parametrize("slit_width", [0.0, 0.4e-3])
def test_row_on_an_edge(slit_width: float) -> None:
    """With a margin of 0 the edge consists of the ligaments of its row; half of their width belongs to the sheet."""
    pattern = slits(2.5, 2, *SIZES, slit_width, margin=(SPACING, 0.0))
    top = pattern.vertices[list(pattern.groups["top"])]
    np.testing.assert_allclose(np.unique(top[:, 0]), [0.0, 2.2e-3, 19.4e-3, 23.8e-3, 41e-3, 45.4e-3], atol=1e-12)
    np.testing.assert_allclose(top[:, 1], 2.0 * SPACING)


def test_aligned_slits_do_not_join_the_ligaments_of_an_edge() -> None:
    """Rows without a shift have no line between two ligaments; the generator adds one."""
    pattern = slits(2, 2, *SIZES, shift=0.0, margin=(0.0, 0.0))
    top = set(pattern.groups["top"])
    lines = [edge for edge in pattern.edges.tolist() if set(edge) <= top]
    assert sorted(float(np.ptp(pattern.vertices[edge, 0])) for edge in lines) == pytest.approx([2.2e-3, 2.2e-3, 4.4e-3])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"slit_width": "4 mm"}, "slit_width = 0.004 m must be less than spacing = 0.0038 m"),
        ({"slit_width": "0.4 mm", "margin": ["0.1 mm", "2 mm"]}, "leaves no strip beside a row of slits"),
        ({"periods": 0.2}, "row 1 has no ligament"),
        ({"rows": 1, "margin": [0, 0]}, "leave no strip"),
        ({"rows": 1000, "periods": 100}, "at most 20,000 facets"),
        ({"shift": 1.0}, "shift"),
        ({"ligament": None}, "needs `ligament`"),
        ({"columns": 3}, "`columns` is not used"),
    ],
)
def test_impossible_sizes_are_refused_in_one_line(change: dict[str, object], words: str) -> None:
    """Each impossible value is one fault of the sheet, before the run."""
    sheet = {
        "kind": "slits", "periods": 2, "rows": 3, "spacing": "3.8 mm", "slit_length": "17.2 mm", "ligament": "4.4 mm",
        "facets": "flexible", "mesh_size": "3.8 mm", "thickness": "0.1 mm", "support": [{"at": "edge bottom"}], **change,
    }  # fmt: skip
    import fsm

    data = {
        "sheet": {key: value for key, value in sheet.items() if value is not None},
        "material": {"young": "4 GPa", "density": 1400},
        "drive": [{"edge": "top", "direction": [0, 1, 0], "speed": "1 mm/s", "travel": "1 mm"}],
    }
    with pytest.raises(fsm.CaseError) as caught:
        fsm.load(data).check()
    assert len(caught.value.faults) == 1 and words in str(caught.value)
