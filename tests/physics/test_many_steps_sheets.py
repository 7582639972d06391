"""Flexible facets that touch each other, an obstacle and a rigid body: kernels of one state and of many steps, against
Python.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fsm.api.case import load
from fsm.builders.scene import build_scene
from fsm.model.compile.compile_joined import compile_model
from fsm.model.joined.system import JoinedSystem
from fsm.model.system.array_kernels import KERNELS
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.stepping import march as balances
from fsm.solve.stepping.march import march
from fsm.solve.stepping.mean_force import march_mean_force
from fsm.solve.stepping.model import DRIVES
from fsm.solve.stepping.outcomes import STEPPED
from fsm.solve.time.generalized_alpha import GeneralizedAlpha
from fsm.solve.time.mean_force import MeanForce
from tests.physics.test_flexible_facets_touch import closed, zigzag
from tests.physics.test_many_steps_joined import opened

SLIDING = {"law": "tanh", "mu_dynamic": 0.4, "v_static": "10 mm/s"}


@pytest.mark.parametrize("friction", [False, True])
def test_force_and_tangents_of_random_states(friction: bool) -> None:
    """Each state is accepted, so that the sides of nodes and the memory of contacts come from the state before."""
    system, q, u = closed(friction)
    other, *_ = closed(friction)
    ready, random = LinearSolver().ready, np.random.default_rng(4)
    nodes = q[-system.elements.nq :].reshape(-1, 3, 3)
    for k in range(4):
        nodes[:, 0] += random.normal(scale=1e-5 * (k + 1), size=nodes[:, 0].shape)
        t, model = 1e-3 * k, system.arrays(ready)
        assert model is not None
        system.to_arrays(True)
        found = KERNELS.renewed_force(model.arrays, t, q, u)
        while system.lacks_arrays():
            model = system.arrays(ready)
            found = KERNELS.renewed_force(model.arrays, t, q, u)
        expected = other.linearise(t, q, u)
        assert np.abs(found - expected.force).max() < 1e-12 * np.abs(expected.force).max()
        v = random.normal(size=system.nu)
        for kernel, matrix in ((KERNELS.stiffness_times, expected.stiffness), (KERNELS.damping_times, expected.damping)):
            exact = matrix.bsr() @ v
            assert np.abs(kernel(model.arrays, v) - exact).max() < 1e-12 * np.abs(exact).max()
        touching = other.contacts[0].geometry.find(other.place(t, q, u)[0], 0.0)
        assert len(touching.slot) > 50
        KERNELS.accept(model.arrays, t, q, u)
        system.from_arrays()
        other.commit(t, q, u)
        memory = other.memory()
        assert system.memory() == pytest.approx(memory, rel=1e-9, abs=1e-12 * np.abs(memory).max())


def shutting() -> JoinedSystem:
    """Crease that closes a panel onto a held panel, and a plate that flies onto the panel; the edges stand on a floor."""
    plate = {
        "name": "plate", "mass": 2e-3, "inertia": [2e-8, 2e-8, 4e-8], "position": [2.35e-3, 1e-3, 0.021],
        "orientation": [0.5**0.5, 0.0, 0.5**0.5, 0.0], "velocity": [-0.5, 0.0, 0.0],
        "plate": {"length": 0.012, "width": 0.01, "thickness": 2e-3},
    }  # fmt: skip
    data = zigzag(
        crease={"stiffness_per_length": 0.5, "rest_angle": "175 deg"}, friction=SLIDING,
        scene={"bodies": [plate], "pairs": [{"first": "sheet", "second": "plate"}]},
        obstacle=[{"name": "floor", "shape": "plane", "position": [0.0, 0.0, -0.24e-3]}],
        solve={"method": "mean-force", "end_time": "18 ms"},
    )  # fmt: skip
    data["sheet"] |= {"columns": 2, "fold_angle": "89 deg"}
    data["material"] |= {"damping": "20 us"}
    data["contact"] |= {"stiffness": "1e5 N/m", "damping": 5.0}
    system = compile_model(build_scene(load(data, folder=Path())._loaded.case))
    assert isinstance(system, JoinedSystem)
    return system


@pytest.mark.parametrize("method", ["generalized-alpha", "mean-force"])
def test_same_steps(method: str) -> None:
    """States, counts, contact forces, memory, work and energies of many steps agree."""
    count, solvers = 60, []
    for _ in range(2):
        system = shutting()
        q, u = system.initial()
        if method == "mean-force":
            solvers.append(MeanForce(system, 0.0, q, u, 1e-3, 3e-5))
            solvers[-1]._begin()
        else:
            solvers.append(GeneralizedAlpha(system, 0.0, q, u, 1e-4))
    compiled, python = solvers
    assert compiled.marches
    balance, others = opened(compiled), opened(python)
    records, expected = compiled.march(balance, 1.0, count, every=True), python.records(count)
    own = march_mean_force if method == "mean-force" else march
    assert own(python.model, python.motion, python.rules, others, 1.0, count, expected) == STEPPED
    assert compiled.steps == python.steps == count
    assert compiled.iterations == pytest.approx(python.iterations, rel=0.05)  # round-off determines some of them
    assert (compiled.rejected, compiled.failed) == (python.rejected, python.failed)
    assert compiled.t == pytest.approx(python.t, rel=1e-9)
    assert np.abs((compiled.q - python.q) / compiled.system.scales().configuration).max() < 1e-9
    turnover = others[balances.TURNOVER]
    for number in (balances.START, balances.TURNOVER, balances.KINETIC_WORST):
        assert balance[number] == pytest.approx(others[number], abs=1e-9 * turnover)
    # controlled steps in Python use mean rates in the middle of the step, and the kernel at both ends
    close = 1e-6 if method == "mean-force" else 0.05
    assert balance[balances.DISSIPATED] == pytest.approx(others[balances.DISSIPATED], rel=close)
    forces = records[:, DRIVES : DRIVES + 3]
    assert np.abs(forces - expected[:, DRIVES : DRIVES + 3]).max() < 1e-8 * forces.max()
    touching = (forces > 0.0).sum(axis=0)  # panels, floor, plate
    assert 10 < touching[0] < count
    assert (touching[1:] > 10).all()
    memory = python.system.memory()
    assert compiled.system.memory() == pytest.approx(memory, rel=1e-6, abs=1e-9 * np.abs(memory).max())
