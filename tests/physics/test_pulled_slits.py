"""A pulled sheet with slits: it buckles out of its plane, with the sense that the case selects, and its parts agree."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import fsm

CASE = Path(__file__).parents[2] / "folding_cases" / "slit_sheet" / "case.toml"
TRAVEL = 1e-3
SMALL = {
    "sheet.periods": 0.5, "sheet.rows": 6, "drive.0.travel": TRAVEL, "save.every": 0.1 * TRAVEL,
    "solve.error_estimates": "off",
}  # fmt: skip


def pulled(changes: dict[str, Any]) -> tuple[np.ndarray, fsm.Result]:
    """Force at three travels, N, and the result."""
    result = fsm.load(CASE).set({**SMALL, **changes}).run(figures=False)
    travel, force = result.force()
    return np.interp([0.25 * TRAVEL, 0.5 * TRAVEL, TRAVEL], travel, force), result


def heights(result: fsm.Result) -> np.ndarray:
    """Positions along z of the corners of all triangles at the end, m."""
    return np.asarray(result.solution.shape)[-1][..., 2]


def test_sense_of_tilt_and_parts() -> None:
    """Both senses of tilt have one force, and a half beside the plane of symmetry has half of the force."""
    one, above = pulled({"solve.imperfection": 1})
    other, below = pulled({"solve.imperfection": -1})
    assert above.summary["events"][0]["kind"] == "bifurcation"
    assert np.abs(heights(above)).max() > 0.3e-3
    np.testing.assert_allclose(heights(above), -heights(below), atol=0.02 * np.abs(heights(above)).max())
    np.testing.assert_allclose(one, other, rtol=1e-3)
    ends = [{"at": "edge bottom", "fixed": ["x", "z"], "clamped": True}, {"at": "edge top", "fixed": ["y", "z"]}]
    wide, _ = pulled({"sheet.periods": 1, "sheet.support": ends})
    np.testing.assert_allclose(0.5 * wide, one, rtol=0.02)  # diagonals of the cells differ
