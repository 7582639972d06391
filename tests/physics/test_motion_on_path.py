"""A motion after a snap counts as at rest when it follows its path of equilibria, however fast this path is."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fsm.case.loading.load_case import load_case
from fsm.model.compile.compile_case import compile_case
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.equations.newton import equilibrium
from fsm.solve.statics.snap_through import _on_path

TRIAL = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"


def test_speed_of_the_path_is_rest() -> None:
    sets = ["contact=none", "friction=none", "expect=none", "strip.segments_per_panel=4"]
    _, system = compile_case(load_case(TRIAL, sets).case)
    motion = system.motions[0]
    first, second = (motion.time_of(travel) for travel in (0.0300, 0.0301))
    q, _ = system.initial()
    before = equilibrium(system, q, np.linspace(0.0, first, 60))
    after = equilibrium(system, before, np.array([first, second]))
    u = system.difference(before, after) / (second - first)
    kinetic = 0.5 * float(u @ (system.mass(before) @ u))
    assert _on_path(system, LinearSolver(), first, before, kinetic, 0.0)
    assert _on_path(system, LinearSolver(), first, before, 3.0 * kinetic, 0.0)
    assert not _on_path(system, LinearSolver(), first, before, 5.0 * kinetic, 0.0)
    assert _on_path(system, LinearSolver(), first, before, 5.0 * kinetic, 6.0 * kinetic)
