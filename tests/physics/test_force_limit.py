"""End of a static run at a force of the drive."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.errors import FsmError
from fsm.results.store import read_solution


def pressed(**solve: Any) -> dict[str, Any]:
    """Zigzag of rigid panels that is pushed together; its force rises."""
    return {
        "sheet": {
            "kind": "zigzag", "columns": 2, "a": "40 mm", "b": "30 mm", "fold_angle": "40 deg", "thickness": "0.5 mm",
            "support": [{"at": "edge left"}],
        },
        "material": {"young": 3e9, "density": 1000.0},
        "crease": {"stiffness_per_length": 0.1},
        "drive": [{"edge": "right", "direction": [-1, 0, 0], "speed": "1 mm/s", "travel": "40 mm"}],
        "solve": {"method": "static"} | solve,
        "save": {"every": "5 mm"},
    }  # fmt: skip


def test_the_run_ends_where_the_force_reaches_the_limit(tmp_path: Path) -> None:
    """The last saved state is on the curve without a limit, between two requested states."""
    whole, limited = (
        fsm.load(pressed(**more), folder=tmp_path).run(tmp_path / name, figures=False)
        for name, more in (("whole", {}), ("limited", {"force_limit": "0.08 N"}))
    )
    curve, solution = whole.solution.force_curve, read_solution(tmp_path / "limited" / "result.h5")
    assert abs(solution.force[-1, 0]) == pytest.approx(0.08, rel=2e-3)
    at = np.interp(0.08, np.abs(curve.force[:, 0]), curve.travel[:, 0])
    assert solution.travel[-1, 0] == pytest.approx(at, rel=5e-3)
    assert solution.travel[-2, 0] < solution.travel[-1, 0] < 0.035
    assert [event["kind"] for event in limited.summary["events"]] == ["force limit"]
    (warning,) = [text for text in limited.summary["warnings"] if "force_limit" in text]
    assert warning == (
        f"the force of the drive reached solve.force_limit at {1e3 * solution.travel[-1, 0]:.4g} mm of travel, "
        f"{abs(solution.force[-1, 0]):.4g} N; the run ends there"
    )


TURN = {"at": "edge right", "axis": [0, 1, 0], "turn": "10 deg", "rate": "1 deg/s"}
FAST = pressed()["drive"][0] | {"speed": "100 m/s"}
STEP = {"kind": "static", "duration": "40 s"}


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"solve": {"force_limit": 1.0}, "drive": [FAST]}, '"auto" selects "generalized-alpha"'),
        ({"solve": {"method": "generalized-alpha", "force_limit": 1.0}}, 'is used by method = "static" and "auto" only'),
        ({"solve": {"method": "static", "force_limit": 1.0}, "step": [STEP]}, "cannot be used with [[step]]"),
        ({"step": [STEP | {"solve": {"force_limit": 1.0}}]}, "cannot be used with [[step]]"),
        ({"solve": {"method": "static", "force_limit": 1.0}, "drive": [TURN]}, "whose effort is a moment"),
        ({"solve": {"method": "static", "force_limit": -1.0}}, "solve.force_limit"),
    ],
)
def test_a_limit_that_is_not_used_is_refused(changes: dict[str, Any], text: str, tmp_path: Path) -> None:
    with pytest.raises(FsmError) as caught:
        fsm.load(pressed() | changes, folder=tmp_path).check()
    assert "force_limit" in str(caught.value)
    assert text in str(caught.value)
