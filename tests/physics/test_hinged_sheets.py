"""Sheets that turn about a hinged edge."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import fsolve

import fsm


def test_a_hinged_zigzag_turns_until_its_ends_are_in_line_and_then_stretches(tmp_path: Path) -> None:
    """The free rotation about the hinged edge has no stiffness and ends suddenly; beyond it, three panels have a closed
    form."""
    a, fold, stiffness, travel = 0.02, math.radians(30.0), 0.5 * 0.01, 4e-3
    data = {
        "sheet": {
            "kind": "zigzag", "columns": 3, "a": a, "b": 0.01, "fold_angle": fold, "thickness": 2e-4,
            "support": [{"at": "edge left"}],
        },
        "material": {"young": 70e9, "poisson": 0.3, "density": 2700.0},
        "crease": {"stiffness_per_length": 0.5},
        "drive": [{"edge": "right", "direction": [1, 0, 0], "speed": 1e-3, "travel": travel, "guide": False}],
        "solve": {"method": "static"},
    }  # fmt: skip
    result = fsm.load(data, folder=tmp_path).run(tmp_path / "run", figures=False)

    def force(distance: float) -> float:
        """Outer panels at the angle alpha with the line of the ends, the middle one at -beta: 2 sin alpha = sin beta."""

        def beta(alpha: float) -> float:
            return math.asin(2.0 * math.sin(alpha))

        def apart(alpha: float) -> float:
            return 2.0 * a * math.cos(alpha) + a * math.cos(beta(alpha))

        alpha = float(fsolve(lambda x: apart(x[0]) - distance, [0.2], xtol=1e-13)[0])
        turned = 1.0 + 2.0 * math.cos(alpha) / math.cos(beta(alpha))
        moment = 2.0 * stiffness * (alpha + beta(alpha) - 2.0 * fold) * turned
        return moment / (-2.0 * a * math.sin(alpha) - a * math.sin(beta(alpha)) * (turned - 1.0))

    found = np.genfromtxt(tmp_path / "run" / "force.csv", delimiter=",", names=True)
    names = found.dtype.names
    way, pull = found[names[0]], found[names[1]]
    in_line = math.hypot(3.0 * a * math.cos(fold), a * math.sin(fold)) - 3.0 * a * math.cos(fold)
    assert np.abs(pull[way < 0.99 * in_line]).max() < 1e-5
    for at in (2e-3, 3e-3, travel):
        value = float(np.interp(at, way, pull))
        assert value == pytest.approx(force(3.0 * a * math.cos(fold) + at), rel=2e-3)
    assert result.summary["final_force"] == pytest.approx(force(3.0 * a * math.cos(fold) + travel), rel=1e-4)
