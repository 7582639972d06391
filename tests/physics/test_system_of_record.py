"""Systems in saved states have the internal variables of these states."""

from __future__ import annotations

import math
from pathlib import Path

import h5py
import numpy as np
import pytest

import fsm
from fsm.errors import CaseError
from validation.sheets.origami import miura_force

CASE = Path(__file__).parents[2] / "folding_cases" / "miura_push" / "case.toml"
STEPS = [
    {"name": "push", "kind": "static", "drive": [{"edge": "right", "direction": [-1, 0, 0], "guide": False, "travel": 0.3}]},
    {"name": "back", "kind": "static", "drive": [{"edge": "right", "direction": [1, 0, 0], "guide": False, "travel": 0.1}]},
]


def forces(result: fsm.Result, record: int) -> tuple[np.ndarray, np.ndarray]:
    """Forces of the drives at a record: of the result, and of the system in this state."""
    system, t, q, _ = result.system(record)
    return result.solution.force[record], system.observe(t, q, None).drive.force


def test_forces_of_a_rigid_sheet_in_saved_states(tmp_path: Path) -> None:
    """They are those of the run and of the closed form; a system without multipliers has none. Files of earlier versions
    load, and refuse to give a system.
    """
    data = {"sheet.columns": 4, "sheet.rows": 4, "save.every": 0.1, "drive": [], "step": [
        {**step, "drive": [{**step["drive"][0], "speed": 1e-3}]} for step in STEPS  # type: ignore[dict-item]
    ]}  # fmt: skip
    result = fsm.load(CASE).set(data).run(tmp_path / "run", figures=False)
    last = [int(np.flatnonzero(result.solution.step == step)[-1]) for step in (1, 2)]
    for record, pushed in zip(last, (0.3, 0.2), strict=True):
        saved, found = forces(result, record)
        np.testing.assert_allclose(found, saved, rtol=1e-9, atol=1e-9 * np.abs(saved).max())
        exact = miura_force(pushed, 4, 4, 2.0, 2.0, math.pi / 3.0, math.radians(15.0), 0.1)
        assert abs(found[0]) == pytest.approx(exact, rel=1e-6)
    system, t, q, _ = result.system()
    system.restore(np.zeros(0))
    assert np.abs(system.observe(t, q, None).drive.force).max() < 1e-3
    with h5py.File(tmp_path / "run" / "result.h5", "r+") as file:
        del file["state/memory"], file["memory_number"]
    old = fsm.open(tmp_path / "run")
    np.testing.assert_array_equal(old.solution.q, result.solution.q)
    with pytest.raises(CaseError, match=r"state/memory: has no internal variables of elements .* run the case again"):
        old.system()
    with pytest.raises(CaseError, match="has no record 99; its records are 0 to"):
        old.system(99)


def test_reactions_of_ideal_joints_in_saved_states(tmp_path: Path) -> None:
    """A driven slider lifts a rod with a spring at its other end; the force of the slider acts through its joint alone."""
    model = fsm.Model("lift")
    for name, x in (("rod", 0.1), ("slider", 0.0)):
        model.body(name, mass=0.2, inertia=[1e-4, 1e-4, 1e-4], position=[x, 0, 0])
    model.element("spring", inner="rod", outer="ground", point_inner=[0.1, 0, 0], point_outer=[0.2, 0, 0],
                  translation=[1e3, 1e3, 1e3], rotation=[1.0, 1.0, 1.0])  # fmt: skip
    model.joint("pin", kind="revolute", first="slider", second="rod", at=[0, 0, 0], axis=[0, 1, 0])
    model.drive(body="slider", direction=[0, 0, 1], speed=0.01, travel=0.02)
    result = model.settings(method="static").record(every=0.01).solve(out=tmp_path)
    saved, found = forces(result, -1)
    assert abs(saved[0]) > 0.1
    np.testing.assert_allclose(found, saved, rtol=1e-9)
