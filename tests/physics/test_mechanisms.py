"""Statics of structures without supports or without stiffness."""

from __future__ import annotations

import pytest

from fsm.case.loading.load_case import load_case
from fsm.case.models.loads import Drive
from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.errors import NotConverged
from fsm.model.compile.compile import compile_scene
from fsm.model.compile.compile_case import compile_case
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import PathSettings
from fsm.solve.statics.path_steps import PathSteps, Reason
from fsm.solve.statics.static import follow
from validation.strip_trial.check import CASE


def test_free_hinges_pull_with_no_force() -> None:
    """All energies are those of round-off forces, so their balance has no meaning, and no step is shortened for it."""
    free = ["crease.stiffness=0", "contact=none", "material.damping=0", "strip.segments_per_panel=4", "expect=none"]
    _, system = compile_case(load_case(CASE, free).case)
    motion = system.motions[0]
    statistics, energy_balance = follow(system, PathSettings(motion.end_time, motion.time_of(1e-3)), [], lambda state: None)
    assert max(abs(drive.force[0]) for drive, *_ in statistics.points) < 1e-6
    assert 0.0 < energy_balance.turnover < 1e-9
    assert energy_balance.relative_error == 0.0
    assert statistics.steps < 100
    assert not statistics.events


def pulled_bar(*more: Body, by: tuple[ForceElement, ...] = ()) -> Scene:
    stiff = ForceElement(name="foot", inner=GROUND, outer="bar", translation=(1e3,) * 3, rotation=(10.0,) * 3)
    bar = Body(name="bar", mass=0.1, inertia=(0.01,) * 3)
    hand = Body(name="hand", mass=0.0, inertia=(0.0,) * 3)
    spring = ForceElement(name="spring", inner="bar", outer="hand", translation=(100.0,) * 3)
    drive = Drive(body="hand", direction=(0.0, 0.0, 1.0), speed=0.01, travel=0.1)
    return Scene(bodies=(bar, hand, *more), elements=(stiff, spring, *by), drives=(drive,))


def path(scene: Scene) -> list[SavedState]:
    system = compile_scene(scene)
    motion = system.motions[0]
    saved: list[SavedState] = []
    follow(system, PathSettings(motion.end_time, motion.time_of(0.01)), [0.0, motion.end_time], saved.append)
    return saved


def test_a_body_that_nothing_holds_is_named() -> None:
    series = 1.0 / (1.0 / 1e3 + 1.0 / 100.0)
    assert path(pulled_bar())[-1].observation.drive.force[0] == pytest.approx(series * 0.1, rel=1e-9)
    ballast = Body(name="ballast", mass=0.1, inertia=(0.01,) * 3, position=(1.0, 0.0, 0.0))
    with pytest.raises(NotConverged, match="Not held: ballast") as failure:
        path(pulled_bar(ballast))
    assert "at t = 0 s" in str(failure.value)
    assert "the stiffness is singular" in str(failure.value)


def test_a_body_that_may_turn_freely_is_named() -> None:
    """Its position is held, but its angle about the hinge is not; both are rows of the same block."""
    hinge = ForceElement(name="hinge", inner="bar", outer="vane", translation=(1e3,) * 3, rotation=(10.0, 0.0, 10.0))
    vane = Body(name="vane", mass=0.1, inertia=(0.01,) * 3)
    with pytest.raises(NotConverged, match="Not held: vane"):
        path(pulled_bar(vane, by=(hinge,)))


def test_a_failure_states_why_the_last_static_step_was_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PathSteps, "_march", lambda *_: Reason.FAR)
    with pytest.raises(NotConverged, match="Last rejected static step: the equilibrium found is far from its prediction"):
        path(pulled_bar())
