"""The mean-force method on rigid bodies and joined systems: energy, order, drives, contact."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.case.models.loads import Drive, Load
from fsm.case.models.scene import Body, ForceElement, Scene
from fsm.case.models.time_program import Ramp
from fsm.model.compile.compile_joined import compile_model
from fsm.model.system.system import SegmentSystem
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.time.mean_force import MeanForce


def free_body() -> SegmentSystem:
    body = Body(name="brick", mass=1.0, inertia=(1e-3, 2e-3, 2.5e-3), angular_velocity=(1.0, 20.0, 2.0))
    return compile_model(Scene(bodies=(body,)), spatial=True)


def pendulum(damping: float = 0.0, driven: bool = False) -> SegmentSystem:
    """A heavy body on a soft ball joint that spins; the joint sits on the ground or on a driven body."""
    bob = Body(
        name="bob", mass=0.2, inertia=(1e-4, 2e-4, 1.5e-4), position=(0.1, 0.0, 0.0), angular_velocity=(3.0, 1.0, 10.0)
    )
    cart = Body(name="cart", mass=1.0, inertia=(1.0, 1.0, 1.0))
    joint = ForceElement(
        name="ball", inner="bob", outer="cart" if driven else "ground", point_inner=(-0.1, 0.0, 0.0),
        translation=(2e3, 2e3, 2e3), rotation=(0.01, 0.02, 0.01), rotation_damping=(damping, damping, damping),
    )  # fmt: skip
    drive = Drive(body="cart", direction=(1.0, 0.0, 1.0), travel=0.05, time=Ramp(kind="ramp", end=0.2))
    load = Load(body="bob", force=(0.0, 0.5, 0.0), time=Ramp(kind="ramp", end=0.3))
    return compile_model(
        Scene(
            bodies=(bob, cart) if driven else (bob,), elements=(joint,), drives=(drive,) if driven else (), loads=(load,),
            gravity=(0.0, 0.0, -9.81),
        ),
        spatial=True,
    )  # fmt: skip


def went(system: SegmentSystem, step: float, end: float) -> MeanForce:
    q, u = system.initial()
    method = MeanForce(system, 0.0, q, u, 1e-10, step)
    while method.t < end:
        method.step(end)
    return method


def test_a_free_body_keeps_its_energy() -> None:
    system = free_body()
    start = system.energy(0.0, *system.initial()).kinetic
    method = went(system, 2e-3, 0.2)
    assert system.energy(method.t, method.q, method.u).kinetic == pytest.approx(start, rel=1e-10)


def test_the_method_is_of_second_order() -> None:
    ends = np.array([went(pendulum(), step, 0.1).q[:3] for step in (4e-4, 2e-4, 1e-4)])
    one, two = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    assert one / two == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(("damping", "driven"), [(0.0, False), (2e-3, False), (2e-3, True)])
def test_loads_drives_and_dampers_are_in_the_balance(damping: float, driven: bool) -> None:
    system = pendulum(damping, driven)
    settings = Settings("mean-force", 1e-4, 0.4)
    statistics, energy_balance = simulate(system, settings, [0.0, 0.4], lambda saved: None)
    assert energy_balance.relative_error < 1e-5
    assert energy_balance.turnover > 1e-3
    assert (energy_balance.dissipated > 1e-4) == (damping > 0.0)
    assert statistics.steps < 4000


def test_tolerance_controls_the_error() -> None:
    exact = went(pendulum(), 2e-5, 0.05).q[:3]
    errors = []
    for rtol in (1e-5, 1e-7):
        saved = []
        simulate(pendulum(), Settings("mean-force", rtol, 0.05), [0.05], saved.append)
        errors.append(np.linalg.norm(saved[-1].q[:3] - exact))
    assert errors[1] < 0.2 * errors[0]
    assert errors[1] < 1e-5
