"""Small cases that between them use every kernel, for compiling ahead."""

from __future__ import annotations

from typing import Any

from fsm.scene.case import Case

__all__ = ["WARM_UP_SHIFT", "warm_up_cases"]

WARM_UP_SHIFT = 0.014
"""Moved by this along x (m), panel 3 lies in panel 4."""


def warm_up_cases(spatial: bool) -> list[Case]:
    """One strip with a tabulated crease, contact and friction."""
    data: dict[str, Any] = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 1e-4, "panels": 6, "fold_angle": 1.4, "segments_per_panel": 2,
        },
        "material": {"young": 3e9, "density": 800.0},
        "crease": {
            "law": "spline", "angle": [0.0, 1.0, 2.0, 3.0], "moment": [0.0, 0.01, 0.015, 0.018], "rest_angle": 3.0,
        },
        "contact": {"stiffness": 1e6, "damping": 1.0, "pairs": [[3, 4]]},
        "friction": {"law": "tanh", "mu_dynamic": 0.2, "v_static": 0.01},
        "drive": [{"crease": 3, "speed": 0.02, "travel": 0.01}],
        "solve": {"spatial": spatial},
    }  # fmt: skip
    return [Case.model_validate(data)]
