"""A free tip that slides along a stiff floor is in equilibrium, although the symmetric part of its tangent is indefinite."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.model.compile.compile_case import compile_case
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import PathSettings
from fsm.solve.statics.static import follow
from tests.case_texts import STRIP_ON_A_FLOOR

MU = 0.3
LAWS = {
    "tanh": f'law = "tanh"\nmu_dynamic = {MU}\nv_static = "10 um/s"',
    "lugre": f'law = "lugre"\nmu_static = {MU}\nmu_dynamic = {MU}\nv_stribeck = "5 mm/s"\npresliding = "1 um"',
}


@pytest.mark.parametrize(("law", "spatial"), [("tanh", False), ("tanh", True), ("lugre", False)])
def test_a_sliding_tip_is_followed_without_a_snap(tmp_path: Path, law: str, spatial: bool) -> None:
    """mu^2 k/4 of its contact exceeds by far the stiffness of the strip against sliding; an earlier version treated each
    step as a critical point.

    The work of bristles, which also act at rest, was missing in the energy balance.
    """
    (tmp_path / "case.toml").write_text(STRIP_ON_A_FLOOR.replace("FRICTION", LAWS[law]))
    system = compile_case(load_case(tmp_path / "case.toml", [f"solve.spatial={str(spatial).lower()}"]).case)[1]
    motion, saved = system.motions[0], list[SavedState]()
    settings = PathSettings(motion.end_time, motion.time_of(1e-4), rtol=1e-6)
    statistics, energy_balance = follow(system, settings, [motion.time_of(8e-3), motion.end_time], saved.append)
    assert statistics.events == []
    assert statistics.steps < (300 if law == "tanh" else 2000)
    assert energy_balance.relative_error < (1e-4 if law == "tanh" else 2e-3)
    for state in saved:
        pairs = state.observation.pairs
        assert pairs.force.max() > 1e-3
        np.testing.assert_allclose(pairs.friction.sum(), MU * pairs.force.sum(), rtol=1e-2)
