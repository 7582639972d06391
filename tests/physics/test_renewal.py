"""A solve that continues from a restart point gives the same bits as an uninterrupted solve, whatever happens during the
solve."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

import fsm.solve.statics.path_steps
import fsm.solve.time.run
import fsm.solve.time.stepwise_run
from fsm.case.models.contact import Contact, Friction
from fsm.case.models.flexible import SceneFilm
from fsm.case.models.scene import Body, ContactPair, Plate, Scene
from fsm.model.compile.compile import compile_scene
from fsm.model.compile.compile_joined import compile_model
from fsm.solve.interface.system import System
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.restart_points import MOST_OF_PATHS, steps_between
from fsm.solve.outcome.run_io import AcceptedStep, CurvePoint, SavedState, Statistics
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.simulate import simulate
from tests.physics.test_crease_hysteresis import CYCLE, crease, flap
from tests.physics.test_paths import truss


@dataclass
class Way:
    """Reported results of a solve, and its restart points."""

    saved: list[SavedState] = field(default_factory=list)
    points: list[CurvePoint] = field(default_factory=list)
    energy_balance: EnergyBalance = field(default_factory=EnergyBalance)
    renewals: list[tuple[AcceptedStep, EnergyBalance, int, int]] = field(default_factory=list)
    statistics: Statistics | None = None

    def go(
        self, system: System, settings: Settings | PathSettings, times: list[float], after: AcceptedStep | None = None
    ) -> Way:
        def step(end: AcceptedStep) -> None:
            if end.state is not None:
                self.renewals.append((copy.deepcopy(end), replace(self.energy_balance), len(self.points), len(self.saved)))

        if after is None:
            self.energy_balance = EnergyBalance.opened(system.energy(0.0, *system.initial()))
        self.statistics, _ = simulate(
            system, settings, times, self.saved.append, step, energy_balance=self.energy_balance, points=self.points,
            after=after,
        )  # fmt: skip
        return self


def same(one: Way, other: Way, first: int) -> None:
    """From the saved state `first` on."""
    assert len(one.saved) - first == len(other.saved)
    for a, b in zip(one.saved[first:], other.saved, strict=True):
        assert (a.time, a.dissipated, a.work, a.error) == (b.time, b.dissipated, b.work, b.error)
        np.testing.assert_array_equal(a.q, b.q)
        np.testing.assert_array_equal(a.u, b.u)
        np.testing.assert_array_equal(a.observation.drive.force, b.observation.drive.force)
    for a_point, b_point in zip(one.points, other.points, strict=True):
        np.testing.assert_array_equal(a_point.drive.force, b_point.drive.force)
        np.testing.assert_array_equal(a_point.pair_force, b_point.pair_force)
        assert a_point[2:] == b_point[2:]
    assert one.energy_balance.worst == other.energy_balance.worst
    assert one.energy_balance.turnover == other.energy_balance.turnover
    assert one.statistics is not None
    assert other.statistics is not None
    for name in ("steps", "rejected", "newton_iterations", "force_evaluations", "factorisations", "smallest_step", "events"):
        assert getattr(one.statistics, name) == getattr(other.statistics, name), name


def check(
    make: Callable[[], System], settings: Settings | PathSettings, monkeypatch: pytest.MonkeyPatch, every: int = 5
) -> Way:
    """Continue from the first, a middle and the last restart point."""
    for module in (fsm.solve.time.run, fsm.solve.statics.path_steps):
        monkeypatch.setattr(module, "steps_between", lambda nu, most=0: every)
    monkeypatch.setattr(fsm.solve.time.stepwise_run, "_MARCH", every)
    times = list(np.linspace(0.0, settings.end_time, 21))
    whole = Way().go(make(), settings, times)
    assert len(whole.renewals) > 2
    for end, energy_balance, seen, saved in (whole.renewals[k] for k in (0, len(whole.renewals) // 2, -1)):
        on = Way(points=list(whole.points[:seen]), energy_balance=replace(energy_balance))
        same(whole, on.go(make(), settings, times, end), saved)
    return whole


@pytest.mark.parametrize("damping", [0.0, 0.05], ids=["slides", "moves"])
def test_through_a_snap(damping: float, monkeypatch: pytest.MonkeyPatch) -> None:
    motion = truss(damping).motions[0]
    way = check(lambda: truss(damping), PathSettings(motion.end_time, motion.time_of(0.01)), monkeypatch)
    assert way.statistics is not None
    assert len(way.statistics.events) == 1
    snap = way.statistics.events[0]
    ends = [end.time for end, *_ in way.renewals]
    assert min(ends) < snap.time
    assert max(ends) > snap.end_time
    assert not any(snap.time < t < snap.end_time for t in ends)


@pytest.mark.parametrize(
    ("method", "spatial"), [("static", False), ("static", True), ("generalized-alpha", False)]
)
def test_with_creases_that_remember(method: str, spatial: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, end = flap(CYCLE, crease()), 2.5
    settings: Settings | PathSettings = Settings(method, 1e-4, end)
    if method == "static":
        settings = PathSettings(end, 0.02, 0.05, rtol=1e-6)
    check(lambda: compile_scene(scene, spatial), settings, monkeypatch)


def test_renewal_points_are_a_matter_of_the_size() -> None:
    assert [steps_between(nu) for nu in (0, 6, 1000, 1500, 6000, 10**6)] == [64, 64, 60, 40, 10, 8]
    assert [steps_between(nu, MOST_OF_PATHS) for nu in (0, 120, 480, 6000)] == [512, 500, 125, 10]


def test_mean_force_with_films_and_contact(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plate that bounces on a film."""
    film = SceneFilm(
        name="film", length=0.1, width=0.1, thickness=1e-4, young=3e9, density=1400.0, mesh=(2, 2), strain=(2e-3, 2e-3),
        held=("left", "right"),
    )  # fmt: skip
    plate = Body(
        name="plate", mass=4e-3, inertia=(3e-7, 6e-7, 8e-7), position=(0.003, 0.002, 0.001), velocity=(0.0, 0.1, -1.0),
        plate=Plate(length=0.05, width=0.04, thickness=1e-3),
    )  # fmt: skip
    scene = Scene(
        bodies=(plate,), films=(film,), pairs=(ContactPair(first="film", second="plate"),),
        contact=Contact(law="hertz", stiffness=1e6), friction=Friction(law="tanh", mu_dynamic=0.2, v_static=0.1),
    )  # fmt: skip
    way = check(lambda: compile_model(scene), Settings("mean-force", 1e-3, 2e-3), monkeypatch, 10)
    assert max(point.pair_force[0] for point in way.points) > 0.1
