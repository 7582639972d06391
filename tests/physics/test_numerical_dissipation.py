"""Numerical dissipation of generalized-alpha: an entry of the energy balance, from forces and velocities alone."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.errors import EnergyAbort
from fsm.model.compile.compile_case import compile_case
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.time.system_model import SystemModel
from tests.physics.test_generalized_alpha import ALPHA, oscillator
from tests.physics.test_ideal_joints import body, joint, mechanism
from validation.flexible_wing.check import HINGE, PANEL


def balance_of(system: SegmentSystem, end: float, **settings: Any) -> EnergyBalance:
    own = {"method": ALPHA, "rtol": 1e-9, "end_time": end, "judge_losses": False} | settings
    return simulate(system, Settings(**own), [], lambda saved: None)[1]


def energy_left(rho_inf: float, h: float, steps: int) -> float:
    """Part of the energy that u'' = -u keeps in steps of generalized-alpha (Chung and Hulbert 1993)."""
    alpha_m, alpha_f = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0), rho_inf / (rho_inf + 1.0)
    beta, gamma = 1.0 / (1.0 + rho_inf) ** 2, 0.5 - alpha_m + alpha_f
    q, u = 0.0, 1.0
    by_x = (1.0 - alpha_m) / ((1.0 - alpha_f) * beta * h * h)
    a = -q - (alpha_m - alpha_f) * h * u * by_x / (1.0 + by_x)  # the first slope of u' is filtered
    for _ in range(steps):
        # (1 - alpha_m) a1 + alpha_m a = -(1 - alpha_f) q1 - alpha_f q
        known = q + h * u + h * h * (0.5 - beta) * a
        a1 = -((1.0 - alpha_f) * known + alpha_f * q + alpha_m * a) / (1.0 - alpha_m + (1.0 - alpha_f) * beta * h * h)
        q, u, a = known + h * h * beta * a1, u + h * ((1.0 - gamma) * a + gamma * a1), a1
    return q * q + u * u


@pytest.mark.parametrize("rho_inf", [0.0, 0.5, 0.9])
def test_a_linear_oscillator_loses_what_the_method_loses(rho_inf: float) -> None:
    """The residual falls from the loss of the method to the tolerance of Newton's method."""
    balance = balance_of(oscillator(1.0), 12.0, rho_inf=rho_inf, step=0.3)
    lost = 0.5 * (1.0 - energy_left(rho_inf, 0.3, 40))
    assert balance.numerical == pytest.approx(lost, rel=1e-6)
    assert balance.drift >= 0.99 * lost and lost > 1e-5
    assert balance.worst < 1e-10


@pytest.mark.parametrize(("method", "rho_inf"), [(ALPHA, 1.0), ("newmark", 0.0)])
def test_the_trapezoidal_rule_conserves_the_energy_of_a_linear_oscillator(method: str, rho_inf: float) -> None:
    balance = balance_of(oscillator(1.0), 12.0, method=method, rho_inf=rho_inf, step=0.3)
    assert abs(balance.numerical) < 1e-10 and balance.drift < 1e-10


def pendulum() -> SegmentSystem:
    """A damped pendulum on an ideal hinge, from 80 degrees."""
    start = math.radians(80.0)
    pin = joint("pin", "revolute", "ground", "bob", [0, 0, 0], axis=[0, 1, 0]) | {"damper": {"coefficient": 0.2}}
    bob = body("bob", [math.sin(start), 0.0, -math.cos(start)], [0.1] * 3)
    system = compile_case(fsm.load(mechanism([bob], [pin], 1.0, 0.1)).model)[1]
    assert isinstance(system, SegmentSystem)
    return system


def test_the_residual_of_a_nonlinear_motion_is_of_fourth_order() -> None:
    """It is the error of two Gauss points; without the entry the residual is of order 2 to 3."""
    found = [balance_of(pendulum(), 1.0, rho_inf=0.5, step=h) for h in (0.02, 0.01)]
    assert found[1].worst < 1e-3 * found[1].drift
    assert math.log2(found[0].worst / found[1].worst) > 3.5
    assert math.log2(found[0].drift / found[1].drift) < 3.5


def test_steps_in_python_have_the_same_entry(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = balance_of(pendulum(), 0.5, rho_inf=0.5, step=0.02)
    monkeypatch.setattr(SegmentSystem, "arrays", lambda *given: None)
    found = balance_of(pendulum(), 0.5, rho_inf=0.5, step=0.02)
    assert found.numerical == pytest.approx(compiled.numerical, rel=1e-6)
    assert found.numerical == pytest.approx(found.drift, rel=0.5)


def test_forces_that_contradict_the_energies_are_still_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Potential energies 1 % too large: the entry does not hide them, since it needs no stored energy."""
    true = SystemModel.energies

    def wrong(self: SystemModel, *state: Any) -> tuple[float, float, float, float, float]:
        kinetic, potential, dissipated, power, driven = true(self, *state)
        return kinetic, 1.01 * potential, dissipated, power, driven

    monkeypatch.setattr(SystemModel, "energies", wrong)
    monkeypatch.setattr(SegmentSystem, "arrays", lambda *given: None)
    balance = balance_of(oscillator(1.0), 12.0, rho_inf=0.5, step=0.3)
    assert balance.relative_error == pytest.approx(0.01, rel=0.3)


def test_the_bound_of_the_energy_counts_what_the_steps_lose() -> None:
    with pytest.raises(EnergyAbort, match="Numerical dissipation"):
        balance_of(oscillator(1.0), 60.0, rho_inf=0.0, step=0.5, judge_losses=True, energy_abort=0.05)


def test_the_balance_of_a_flexible_wing_with_latches_closes(tmp_path: Path) -> None:
    """Past the first latch; the sum of all entries is constant, and one of them is what the steps lose."""
    case = {
        "units": "SI", "wing": PANEL | {"hinge": HINGE, "flexible": {"young": 5e9}},
        "solve": {"end_time": 4.6, "rtol": 1e-7, "error_estimates": "off"},
        "save": {"interval": 0.1, "channels": ["energy.*"]},
    }  # fmt: skip
    result = fsm.load(case).run(tmp_path, figures=False)
    summary = result.summary
    assert "latch closes" in [event["what"] for event in summary["joint_events"]]
    assert summary["energy_error"] < 1e-6 < 5e-6 < summary["numerical_dissipation"]
    of = {name: np.asarray(result[f"energy.{name}"].values) for name in ("kinetic", "potential", "dissipated", "numerical")}
    total = of["kinetic"] + of["potential"] + of["dissipated"] + of["numerical"]
    assert total == pytest.approx(total[0], abs=1e-6 * of["dissipated"][-1])
