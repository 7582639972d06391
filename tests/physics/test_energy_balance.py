"""Energy balance: kinetic + potential + dissipated energy - work of loads and drives is constant."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from tests.physics.test_generalized_alpha import strip

# flexible pendulum released from the horizontal: tip (x, y) by time, to 1e-3, by 64 ANCF cable elements; references.md
PENDULUM = {
    0.1: (1.200000, -0.049049), 0.2: (1.179924, -0.196180), 0.3: (1.078738, -0.441262),
    0.4: (0.852851, -0.784469), 0.5: (0.394834, -1.215096),
}  # fmt: skip


@cache
def rubbing_strip(rtol: float) -> tuple[list[SavedState], EnergyBalance]:
    """A damped strip that is pulled until its panels touch and slide."""
    system = strip(0.01)
    saved: list[SavedState] = []
    end = system.end_time()
    assert end is not None
    _, energy_balance = simulate(system, Settings("Radau", rtol, end), list(np.linspace(0.0, end, 21)), saved.append)
    return saved, energy_balance


def flexible_pendulum(count: int) -> SegmentSystem:
    """The pendulum of references.md: L = 1.2, A = .0018, I = 1.215e-8, rho = 5540, E = .7e6, g = 9.81; y there is our z."""
    length, mass = 1.2 / count, 5540 * 0.0018 * 1.2 / count
    stretch, bend = 0.7e6 * 0.0018 / length, 0.7e6 * 1.215e-8 / length
    bodies = [
        Body(
            name=f"{i}",
            mass=mass,
            inertia=(mass * length**2 / 12,) * 3,
            position=((i + 0.5) * length, 0.0, 0.0),
        )
        for i in range(count)
    ]
    elements = [
        ForceElement(
            name=f"joint {i}",
            inner=f"{i - 1}" if i else GROUND,
            outer=f"{i}",
            point_inner=(length / 2 if i else 0.0, 0.0, 0.0),
            point_outer=(-length / 2, 0.0, 0.0),
            # half a segment can stretch at the hinge, which carries no moment; the shear stiffness equals the stiffness in
            # stretch
            translation=(stretch * (1 if i else 2),) * 3,
            rotation=(bend if i else 0.0,) * 3,
        )
        for i in range(count)
    ]
    return compile_scene(Scene(bodies=tuple(bodies), elements=tuple(elements), gravity=(0.0, 0.0, -9.81)))


def swing(count: int, rtol: float) -> tuple[list[SavedState], EnergyBalance]:
    saved: list[SavedState] = []
    _, energy_balance = simulate(flexible_pendulum(count), Settings("Radau", rtol, 0.5), list(PENDULUM), saved.append)
    return saved, energy_balance


def test_strip_with_contact_and_friction() -> None:
    saved, energy_balance = rubbing_strip(1e-8)
    touching = saved[-1].observation
    assert touching.pairs.force.sum() > 1e-3
    assert touching.energy.potential["contact"] > 0.0
    assert energy_balance.relative_error < 1e-6


def test_records_add_up() -> None:
    saved, energy_balance = rubbing_strip(1e-8)
    for record in saved:
        energy = record.observation.energy
        total = energy.kinetic + sum(energy.potential.values()) + record.dissipated - record.work
        assert total == pytest.approx(energy_balance.start, abs=1e-6 * energy_balance.turnover)


def test_friction_and_damping_take_part() -> None:
    _, energy_balance = rubbing_strip(1e-8)
    # without these terms the energy balance would have a large error
    assert energy_balance.dissipated > 1e-3 * energy_balance.turnover


def test_imbalance_falls_with_the_tolerance() -> None:
    assert rubbing_strip(1e-8)[1].relative_error < 1e-2 * rubbing_strip(1e-4)[1].relative_error


def test_undamped_flexible_pendulum() -> None:
    saved, energy_balance = swing(24, 1e-8)
    assert energy_balance.dissipated == 0.0
    assert energy_balance.relative_error < 1e-6
    # the pendulum has moved by a quarter turn, so the work of its weight has become kinetic energy
    assert saved[-1].observation.energy.kinetic > 0.9 * energy_balance.turnover


def test_flexible_pendulum_is_where_it_should_be() -> None:
    count = 128
    saved, _ = swing(count, 1e-6)
    half = 0.6 / count
    for record, (x, z) in zip(saved, PENDULUM.values(), strict=True):
        last = record.q[-3:]
        tip = (last[0] + half * math.cos(last[2]), last[1] - half * math.sin(last[2]))
        assert tip == pytest.approx((x, z), abs=1e-3)
