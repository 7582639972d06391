"""Steps of bodies joined with films, cables and beams in one kernel, against the same steps in Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.model.compile.compile_case import compile_case
from fsm.model.joined.system import JoinedSystem
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.stepping import march as balances
from fsm.solve.stepping.march import BALANCE, march
from fsm.solve.stepping.mean_force import march_mean_force
from fsm.solve.stepping.model import DRIVES
from fsm.solve.stepping.outcomes import STEPPED
from fsm.solve.time.array_steps import StepMethod
from fsm.solve.time.generalized_alpha import GeneralizedAlpha
from fsm.solve.time.mean_force import MeanForce

CASES = Path(__file__).parents[2] / "folding_cases"
SMALL = {
    "beam_between_panels": (
        "scene.elements.0.translation_damping=[0.1, 0.1, 0.1]", "scene.elements.0.rotation_damping=[1e-4, 1e-4, 1e-4]",
    ),
    "plate_on_film": (
        "scene.bodies.0.position=[0.006, 0.004, 9e-4]", "scene.bodies.0.orientation=[1, 0, 0, 0]",
        "scene.bodies.0.velocity=[0.5, 0, -2]", "scene.films.0.mesh=[3, 3]", "scene.films.0.viscosity=1e-6",
        "contact.damping=5", "friction.mu_static=0.3", "friction.mu_dynamic=0.2", "friction.v_static=0.01",
        "friction.v_dynamic=0.02",
    ),
    "sail_on_cables": ("scene.films.0.mesh=[2, 2]", "scene.cables.0.viscosity=1e-5"),
    "film_on_strip": ("scene.films.0.mesh=[3, 2]", "material.damping=1e-4"),
}  # fmt: skip
"""Shipped cases with dampers, and coarser films."""


def joined(name: str) -> JoinedSystem:
    """System of the start of a case."""
    _, system = compile_case(load_case(CASES / name / "case.toml", list(SMALL[name])).case)
    assert isinstance(system, JoinedSystem)
    return system


def moved(system: JoinedSystem) -> tuple[np.ndarray, np.ndarray]:
    """Initial state with random velocities of all free coordinates."""
    q, u = system.initial()
    change = 0.01 * system.scales().velocity * np.random.default_rng(1).standard_normal(len(u))
    change[6 * system.n_free :][system.elements.fixed] = 0.0
    return q, u + change


def opened(solver: StepMethod) -> np.ndarray:
    """Array `balance` of `march` without a bound on the energy error."""
    energy = solver.system.energy(0.0, solver.q, solver.u)
    balance = np.zeros(BALANCE)
    balance[balances.START], balance[balances.POWER] = energy.stored, energy.input_power
    balance[balances.SHORTEST], balance[balances.ALLOWED], balance[balances.DRIVEN] = np.inf, np.inf, energy.driven
    return balance


def check_same_state(compiled: StepMethod, python: StepMethod, count: int) -> None:
    """Counts, time and state after many steps agree."""
    assert compiled.steps == python.steps == count
    assert compiled.iterations == pytest.approx(python.iterations, rel=0.05)  # round-off determines some of them
    assert (compiled.rejected, compiled.failed) == (python.rejected, python.failed)
    assert compiled.t == pytest.approx(python.t, rel=1e-6)
    assert np.abs((compiled.q - python.q) / python.system.scales().configuration).max() < 1e-6
    assert np.abs(compiled.u - python.u).max() < 1e-5 * np.abs(python.u).max()


@pytest.mark.parametrize("name", SMALL)
def test_same_steps(name: str) -> None:
    """States, counts, drive and contact forces, work and energies of many steps agree."""
    count = 200 if name == "plate_on_film" else 60
    systems = joined(name), joined(name)
    states = [(0.0, *moved(system)) for system in systems]
    compiled, python = (
        GeneralizedAlpha(system, *state, 1e-4, first=system.observe(*state))
        for system, state in zip(systems, states, strict=True)
    )
    assert compiled.marches
    balance, others = opened(compiled), opened(python)
    records, expected = compiled.march(balance, 1.0, count, every=True), python.records(count)
    assert march(python.model, python.motion, python.rules, others, 1.0, count, expected) == STEPPED
    check_same_state(compiled, python, count)
    turnover = others[balances.TURNOVER]
    for number in (balances.START, balances.WORK, balances.TURNOVER, balances.KINETIC_WORST):
        assert balance[number] == pytest.approx(others[number], abs=1e-6 * turnover)
    # the kernel uses deformations of springs over the whole step; Python uses the middle of the step
    assert balance[balances.DISSIPATED] == pytest.approx(others[balances.DISSIPATED], rel=2e-3)
    assert balance[balances.DISSIPATED] > 1e-3 * turnover
    assert np.abs(records[:, DRIVES:] - expected[:, DRIVES:]).max() < 1e-5 * np.abs(expected).max()
    if name == "plate_on_film":
        assert records[:, DRIVES].max() > 0.1  # normal force
        dissipated = python.motion.all_pairs
        assert dissipated.min() >= 0.0
        assert dissipated.sum() > 0.0
        assert compiled.pair_energy == pytest.approx(dissipated, rel=1e-3)
    memory = systems[1].memory()
    assert systems[0].memory() == pytest.approx(memory, rel=1e-4, abs=1e-6 * np.abs(memory).max())


@pytest.mark.parametrize("name", SMALL)
def test_same_fixed_steps_of_the_mean_force_method(name: str) -> None:
    """States, counts, forces, work and dissipated energy of fixed steps, the last of them with contact, agree."""
    count, step = (20, 5e-5) if name == "plate_on_film" else (60, 2e-5)
    compiled, python = (MeanForce(system, 0.0, *moved(system), 1e-3, step) for system in (joined(name), joined(name)))
    assert compiled.marches
    for method in (compiled, python):
        method._begin()
    balance, others = opened(compiled), opened(python)
    records, expected = compiled.march(balance, 1.0, count, every=True), python.records(count)
    assert march_mean_force(python.model, python.motion, python.rules, others, 1.0, count, expected) == STEPPED
    assert compiled.steps == python.steps == count
    assert compiled.iterations == pytest.approx(python.iterations, rel=0.05)  # round-off determines some of them
    assert compiled.failed == python.failed
    assert compiled.t == pytest.approx(python.t, rel=1e-12)
    assert np.abs((compiled.q - python.q) / compiled.system.scales().configuration).max() < 1e-6
    turnover = others[balances.TURNOVER]
    for number in (balances.START, balances.WORK, balances.TURNOVER, balances.DISSIPATED, balances.DRIVEN):
        assert balance[number] == pytest.approx(others[number], abs=1e-6 * turnover)
    assert balance[balances.DISSIPATED] > 1e-6 * turnover
    assert balance[balances.WORST] < 1e-3 * turnover
    assert np.abs(records[:, DRIVES:] - expected[:, DRIVES:]).max() < 1e-4 * np.abs(expected).max()
    assert compiled.pair_energy == pytest.approx(python.motion.all_pairs, rel=1e-3, abs=1e-9 * turnover)
    if name == "plate_on_film":
        assert records[:, DRIVES].max() > 0.1  # normal force
        assert compiled.pair_energy.sum() > 0.0


@pytest.mark.parametrize("name", SMALL)
def test_a_run_with_error_control_ends_as_a_run_in_python(name: str) -> None:
    """Motion, drive, dissipated energy and energy balance; round-off of the energy determines the step sizes."""
    end, found = 1e-3 if name == "plate_on_film" else 4e-4, []
    for arrays in (True, False):
        system = joined(name)
        if not arrays:
            system.__dict__["arrays"] = lambda ready: None
        saved: list[Any] = []
        start = (0.0, *moved(system))
        settings, times = Settings("mean-force", 1e-4, end), [0.0, 0.5 * end, end]
        statistics, balance = simulate(system, settings, times, saved.append, start=start)
        assert [state.time for state in saved] == [0.0, 0.5 * end, end]
        assert balance.worst < 1e-5 * balance.turnover
        found.append((statistics, balance, saved[-1]))
    (statistics, balance, state), (others, other, expected) = found
    assert statistics.steps == pytest.approx(others.steps, rel=0.1)
    if system.motions or system.pair_names:
        assert len(statistics.points) == 1 + statistics.steps
    assert statistics.newton_iterations == pytest.approx(others.newton_iterations, rel=0.2)
    assert np.abs((state.q - expected.q) / system.scales().configuration).max() < 1e-3
    assert balance.dissipated == pytest.approx(other.dissipated, rel=1e-2)
    assert balance.work == pytest.approx(other.work, abs=1e-3 * other.turnover)
    assert balance.pair_energy == pytest.approx(other.pair_energy, rel=0.05)
    drives = [[point.drive.force for point in each.points[1:]] for each in (statistics, others)]
    assert np.mean(drives[0], axis=0) == pytest.approx(np.mean(drives[1], axis=0), rel=0.05)
    if name == "plate_on_film":
        assert max(point.pair_force[0] for point in statistics.points) > 0.1
        assert balance.pair_energy.sum() > 0.0
