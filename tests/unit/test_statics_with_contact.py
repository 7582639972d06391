"""Quasi-static paths with contact: one kernel computes the same steps as the groups in Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.interactions.contact import pair_sums
from fsm.model.compile.compile_case import compile_case
from fsm.solve.outcome.run_io import CurvePoint, SavedState
from fsm.solve.settings import PathSettings
from fsm.solve.statics.path_model import SystemPath
from fsm.solve.statics.static import follow
from fsm.solve.stepping import path_state as stepping
from tests.case_texts import STRIP_ON_A_FLOOR

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
SOFT = ["expect=none", "strip.segments_per_panel=4", "contact.stiffness=3e6 N/m^1.5"]
COULOMB = ["friction={mu_static=0.3, mu_dynamic=0.2, v_static=1e-4, v_dynamic=2e-4}"]
BRISTLES = ['friction={law="lugre", mu_static=0.3, mu_dynamic=0.25, v_stribeck=1e-3, presliding="20 um"}']
FLOOR = STRIP_ON_A_FLOOR.replace("FRICTION", 'law = "tanh"\nmu_dynamic = 0.2\nv_static = "1 mm/s"')
DAMPED = ["expect=none", "strip.segments_per_panel=4", "material.damping=20 s", 'drive.0.travel="120 mm"']
CASES = {
    "plane": [],
    "plane, no damping": ["material.damping=0"],
    "plane, friction": COULOMB,
    "plane, bristles": BRISTLES,
    "plane, thick": ["contact.thickness_in_gap=true", "strip.thickness=0.5e-3"],
    "space": ["solve.spatial=true"],
    "space, friction": ["solve.spatial=true", *COULOMB],
    "space, bristles": ["solve.spatial=true", *BRISTLES],
    "damped contact": ['contact.law="flores"', "contact.restitution=0.5"],
}

Followed = tuple[Any, list[SavedState], list[CurvePoint]]
"""System, saved states, and the curve of all steps."""


def follow_case(overrides: list[str], compiled: bool, path: Path = CASE, travel: float = 0.02) -> Followed:
    """System, saved states and the curve of the beginning of a path."""
    _, system = compile_case(load_case(path, overrides).case)
    if not compiled:
        system.__dict__["static_arrays"] = lambda ready: None
    motion, saved = system.motions[0], list[SavedState]()
    settings = PathSettings(motion.time_of(travel), motion.time_of(1e-3), rtol=1e-4)
    statistics, _ = follow(system, settings, np.linspace(0.0, motion.time_of(travel), 11).tolist(), saved.append)
    return system, saved, statistics.points


def numbers(state: SavedState) -> dict[str, np.ndarray]:
    """All quantities of a saved state."""
    observed = state.observation
    energy, pairs = observed.energy, observed.pairs
    return {
        "force": observed.drive.force, "reaction": np.array([observed.reaction]),
        "energies": np.array(list(energy.potential.values())),
        "powers": np.array([energy.dissipated_power, energy.input_power, energy.sliding_power]),
        "pair power": energy.pair_power, "pressed": pairs.force, "gap": pairs.gap, "area": pairs.area,
        "friction": pairs.friction, "slip": pairs.slip, "lost": np.array([pairs.friction_power, pairs.damping_power]),
        "balance": np.array([state.work, state.dissipated]), "of pairs": np.asarray(state.pair_energy),
    }  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_the_kernel_takes_the_steps_of_the_groups_in_python(name: str) -> None:
    overrides = [*SOFT, *CASES[name]]
    compare(follow_case(overrides, compiled=True), follow_case(overrides, compiled=False))


@pytest.mark.parametrize("overrides", [[], ["solve.spatial=true"], ["friction=none"]])
def test_a_tip_on_a_floor_takes_the_same_steps(overrides: list[str], tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(FLOOR)
    compare(*(follow_case(overrides, compiled, path, travel=8e-3) for compiled in (True, False)))


def compare(one: Followed, other: Followed) -> None:
    """Both paths have the same steps, observations and memory."""
    system, saved, ends = one
    python, wanted, steps = other
    assert system._statics is not None
    assert python._statics is None
    assert len(ends) == len(steps) > 10
    assert max(state.observation.pairs.force.max() for state in wanted) > 0.0  # faces have touched
    size, largest = system.scales().increment, max(np.abs(point.drive.force).max() for point in steps)
    for mine, theirs in zip(ends, steps, strict=True):
        assert mine.time == pytest.approx(theirs.time, rel=1e-7)
        assert mine.drive.force == pytest.approx(theirs.drive.force, rel=1e-6, abs=1e-6 * largest)
    for own, another in zip(saved, wanted, strict=True):
        assert np.abs(system.difference(own.q, another.q) / size).max() < 1e-6
        assert list(own.observation.energy.potential) == list(another.observation.energy.potential)
        for key, value in numbers(another).items():
            assert np.allclose(numbers(own)[key], value, rtol=1e-6, atol=1e-6 * np.abs(value).max(initial=0.0)), key
    assert system.memory() == pytest.approx(python.memory(), rel=1e-5, abs=1e-9)


def test_records_have_the_rows_of_the_sums_of_pairs() -> None:
    names = ("FORCE", "AREA", "FRICTION", "CARRIED", "SLIDING", "DAMPING")
    assert [getattr(stepping, f"PAIR_{name}") for name in names] == [getattr(pair_sums, name) for name in names]


@pytest.mark.parametrize("friction", [[], COULOMB], ids=["no friction", "friction"])
def test_kernels_judge_states_that_dampers_hold(friction: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers of negative pivots, and the ends of damped snaps, in several states of one kernel, and in Python."""
    judged: list[int] = []
    judge = SystemPath.judged_at_rest

    def count(model: SystemPath, *arguments: Any) -> int:
        judged.append(judge(model, *arguments))
        return judged[-1]

    monkeypatch.setattr(SystemPath, "judged_at_rest", count)
    found = []
    for compiled in (True, False):
        system = compile_case(load_case(CASE, [*DAMPED, *friction]).case)[1]
        if not compiled:
            system.__dict__["static_arrays"] = lambda ready: None
        motion, saved = system.motions[0], list[SavedState]()
        settings = PathSettings(motion.time_of(0.08), motion.time_of(6e-4), rtol=1e-3)
        statistics, _ = follow(system, settings, [motion.time_of(x) for x in np.arange(0.05, 0.08, 2e-4)], saved.append)
        found.append((statistics, [state.negative_pivots for state in saved], len(judged)))
        judged.clear()
    (kernel, pivots, by_python), (python, expected, _) = found
    assert by_python == 1  # the first step, which has no history, is taken in Python
    assert pivots == expected and sum(pivots) > 50
    assert len(kernel.events) == len(python.events) == (3 if friction else 2)
    for event, wanted in zip(kernel.events, python.events, strict=True):
        assert event.kind == wanted.kind == "damped snap"
        for name in ("time", "end_time", "travel", "end_travel", "force", "end_force"):
            assert getattr(event, name) == pytest.approx(getattr(wanted, name), rel=1e-6)
