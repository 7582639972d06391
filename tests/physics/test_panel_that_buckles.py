"""A drive that pushes a panel along its length: the panel carries at most its Euler load, and the snap ends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.model.compile.compile_case import compile_case
from fsm.results.curve import ForceCurve
from fsm.results.quantities import peaks
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.simulate import simulate
from fsm.solve.statics.static import follow

CASE = """
[strip]
length = 0.63
width = 0.055
thickness = 0.42e-3
panels = 5
fold_angle = "71 deg"
segments_per_panel = 8
[material]
young = 5.2e9
density = "1350 kg/m^3"
[crease]
law = "linear"
stiffness = 0.037
[[drive]]
crease = 2
speed = "1.3 mm/s"
travel = "20 mm"
"""


def test_no_more_than_the_critical_load_is_quasi_static(tmp_path: Path) -> None:
    """While it leaves its straight state, a column slowly carries far more; the second panel is a column between two
    creases."""
    (tmp_path / "case.toml").write_text(CASE)
    system = compile_case(load_case(tmp_path / "case.toml").case)[1]
    motion = system.motions[0]
    settings = PathSettings(motion.end_time, motion.time_of(1e-4), rtol=1e-6)
    statistics, energy_balance = follow(system, settings, [], lambda state: None)
    assert energy_balance.relative_error < 1e-3
    (event,) = statistics.events
    assert event.kind == "snap"
    # 3 mm, and not the whole 20 mm: after the motion has decayed, equilibria are followed again
    assert event.end_travel < 4e-3
    stiffness, length = 5.2e9 * 0.055 * 0.42e-3**3 / 12.0, 0.63 / 5.0
    euler = stiffness * (np.pi / length) ** 2 * np.sin(np.radians(71.0))
    assert euler < event.force < 4.0 * euler  # the supports are between hinged and clamped
    curve = ForceCurve.from_points(statistics.points)
    assert peaks(curve).largest.force == pytest.approx(event.force, rel=1e-2)
    assert curve.force.max() > 1.5 * event.force


def test_nor_is_it_of_a_run_by_dynamics(tmp_path: Path) -> None:
    """Twice the critical load counted as the quasi-static peak; the remaining force is that of the decaying motion."""
    (tmp_path / "case.toml").write_text(CASE)
    system = compile_case(load_case(tmp_path / "case.toml").case)[1]
    statistics, _ = simulate(system, Settings("generalized-alpha", 1e-6, 2.0), [], lambda state: None)
    curve = ForceCurve.from_points(statistics.points)
    critical = 1.75
    assert curve.force.max() > 2.0 * critical
    assert critical < peaks(curve).largest.force < 1.4 * critical
    assert np.all(curve.force[~curve.dynamic, 0] < 1.4 * critical)
