"""Ideal joints between segments of a strip and rigid bodies."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from tests.physics.test_joints_at_rest import of, pin, rod

_TILT, _SIDE, _MASS, _SEGMENTS = 0.5, 0.25, 0.01, 4
_ROOT = np.zeros(3)
_FOLD = _SIDE * np.array([math.cos(_TILT), 0.0, math.sin(_TILT)])
_TIP = np.array([2.0 * _FOLD[0], 0.0, 0.0])
_END = _TIP + [0.2, 0.0, 0.0]
_LAST = f"panel 2 segment {_SEGMENTS}"


def case(method: str, first: str, last: str, joints: list[Any], bodies: list[Any], load: list[float]) -> dict[str, Any]:
    """Two panels from a hinge on the ground to a hinge on a rigid arm, whose end has a load."""
    joints = [
        pin("root", "ground", first, _ROOT, spring={"stiffness": 5e-3, "rest": 0.0}), *joints,
        pin("tip", last, "arm", _TIP, spring={"stiffness": 3e-3, "rest": 0.0}),
    ]  # fmt: skip
    arm = {"mass": 0.05, "inertia": [1e-5, 2e-4, 2e-4]}
    load = {"name": "end", "body": "arm", "point": [0.1, 0.0, 0.0], "force": load}
    end = 1e3 if method == "static" else 0.6  # s
    load |= {"time": {"kind": "ramp", "end": end, "shape": "linear" if method == "static" else "smooth"}}
    return {
        "units": "SI", "gravity": [0.0, 0.0, 0.0], "load": [load],
        "scene": {"joints": joints, "bodies": [*bodies, rod("arm", _TIP, _END) | arm]},
        "solve": {"end_time": end, "error_estimates": "off", "method": method},
        "save": {"interval": 0.2 * end, "channels": ["joint.*"]},
    }  # fmt: skip


def strip(method: str, young: float, load: list[float]) -> dict[str, Any]:
    found = case(method, "panel 1 segment 1", _LAST, [], [], load)
    return found | {
        "strip": {"length": 2.0 * _SIDE, "width": 0.04, "thickness": 1e-3, "panels": 2, "fold_angle": _TILT,
                  "segments_per_panel": _SEGMENTS, "held": []},
        "material": {"young": young, "poisson": 0.0, "density": 1000.0,
                     "damping": 0.0 if method == "static" else 1e-3},
        "crease": {"law": "linear", "stiffness": 2e-3},
    }  # fmt: skip


def panels(method: str, load: list[float]) -> dict[str, Any]:
    length = _SIDE / _SEGMENTS
    inertia = _MASS * (_SIDE**2 - length**2) / 12.0 + _MASS * (length**2 + 1e-6) / 12.0
    own = {"mass": _MASS, "inertia": [_MASS * 0.04**2 / 12.0, inertia, inertia]}
    bodies = [rod("a", _ROOT, _FOLD) | own, rod("b", _FOLD, _TIP) | own]
    fold = pin("fold", "a", "b", _FOLD, spring={"stiffness": 2e-3, "rest": 0.0})
    return case(method, "a", "b", [fold], bodies, load)


@pytest.mark.parametrize(
    ("method", "load"), [("static", -4e-3), pytest.param("generalized-alpha", -4e-2, marks=pytest.mark.nightly)]
)
def test_stiff_panels_on_hinges_move_as_rigid_ones(tmp_path: Path, method: str, load: float) -> None:
    force = [0.0, 0.0, load]
    cases = panels(method, force), strip(method, 2e10, force), strip(method, 2e9, force)
    results = [fsm.load(each).run(tmp_path / str(k), figures=False) for k, each in enumerate(cases)]
    rigid, stiff, soft = (np.column_stack([of(r, f"joint.{n}.angle") for n in ("root", "tip")]) for r in results)
    assert np.abs(rigid).max() > 0.2
    bent = soft - rigid
    assert np.abs(bent).max() > 1e-3
    # the bending of the panels is proportional to their compliance
    assert stiff - rigid == pytest.approx(0.1 * bent, abs=0.02 * np.abs(bent).max())
