"""SciPy's methods: the exact Jacobian of every kind of system; LSODA gives equal results with band and dense matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import LSODA

from fsm.analyses.choose import analysis_of
from fsm.builders.scene import build_scene
from fsm.case.models.case import Case
from fsm.model.compile.compile import compile_scene
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.loading import Loading
from fsm.model.nodes.system.build import CableMaterial, MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.model.system.system import SegmentSystem
from fsm.solve.interface.system import System
from fsm.solve.time.scipy_ivp import FirstOrder, _ReorderedLSODA, make_solver

END = 0.05
ARRAY = {
    "analysis": "scissor",
    "scissor": {"units": 2, "bar_length": 0.5, "initial_angle": 1.0, "elements_per_bar": 2},
    "bar": {"width": 0.02, "height": 0.012},
    "material": {"young": 2e11, "poisson": 0.3, "density": 7850, "damping": 1e-4},
    "force": [{"point": "a1", "force": [0, -50]}],
    "solve": {"end_time": 0.1},
}


def film() -> AncfSystem:
    """A film of 2 x 2 elements with a cable, with material damping and air damping."""
    made = MeshBuilder()
    lines = np.array([0.0, 0.12, 0.3])
    grid = made.film(lines, lines, (FilmMaterial(2.5e9, 0.34, 1420.0, 2e-4),), viscosity=1e-4, air=0.1)
    corner = int(grid.position[0, 0])
    made.cable(np.array([-0.1, -0.1, 0.0]), np.zeros(3), CableMaterial(2e11, 7800.0, 1e-3), 1, end_position=corner)
    return AncfSystem(made.build(), Loading(mass_damping=3.0))


def system_of(kind: str) -> System:
    """One of every kind of system."""
    if kind == "film":
        return film()
    if kind.startswith("strip"):
        return strip(True, "spatial" in kind)
    rigid = {"rigid": True} if "rigid" in kind else {}
    latched = {"stop": {"angle": 0.99, "stiffness": 100.0, "latch": True}} if "latch" in kind else {}
    return analysis_of(Case.model_validate(ARRAY | {"scissor": ARRAY["scissor"] | rigid} | latched)).system


def free(system: System) -> np.ndarray:
    """Which velocities are free, (nu,)."""
    return ~system.fixed if isinstance(system, AncfSystem) else np.ones(system.nu, dtype=bool)


def moved(system: System, seed: int = 0) -> np.ndarray:
    """A state away from the initial state."""
    rng, scales = np.random.default_rng(seed), system.scales()
    q, _ = system.initial()
    q = system.retract(q, 1e-3 * scales.increment * free(system) * rng.standard_normal(system.nu))
    return np.concatenate([q, 0.1 * scales.velocity * free(system) * rng.standard_normal(system.nu)])


@pytest.mark.parametrize("kind", ["strip", "strip spatial", "film", "array", "array with latches", "rigid array"])
def test_jacobian_against_differences(kind: str) -> None:
    """Every block of dy'/dy, entries judged by the largest of their rows and columns; held coordinates never move."""
    system = system_of(kind)
    equations, scales, y = FirstOrder(system), system.scales(), moved(system)
    exact = equations.jacobian(0.01, y).toarray()
    found = np.empty_like(exact)
    size = np.concatenate([scales.configuration, scales.velocity])
    for j, h in enumerate(1e-5 * size):
        move = h * (np.arange(len(y)) == j)
        near, far = (equations.rate(0.01, y + k * move) - equations.rate(0.01, y - k * move) for k in (1, 2))
        found[:, j] = (8 * near - far) / (12 * h)
    of_q = free(system) if system.nq == system.nu else np.ones(system.nq, dtype=bool)
    upper, lower = np.flatnonzero(of_q), system.nq + np.flatnonzero(free(system))
    for rows in (upper, lower):
        for columns in (upper, lower):
            one, other = (matrix[np.ix_(rows, columns)] * size[columns] for matrix in (exact, found))
            noise = 1e-9 * np.abs(equations.rate(0.01, y))[rows].max()  # round-off of the rates over a step of 1e-5
            allowed = 1e-5 * np.sqrt(np.outer(np.abs(other).max(axis=1), np.abs(other).max(axis=0))) + noise
            assert np.all(np.abs(one - other) <= allowed)


@pytest.mark.parametrize("method", ["Radau", "BDF"])
def test_equations_of_a_step_with_the_mass(method: str) -> None:
    """(gamma I - J) x = b of a film by sparse equations with its mass: the full Jacobian times x gives b again."""
    system = film()
    equations, y = FirstOrder(system), moved(system)
    solver = make_solver(method, equations, 0.0, y, 1e-3, 1e-5, np.inf)
    gamma = 1e4
    factors = solver.lu(gamma * solver.I - solver.J)
    size = np.concatenate([system.scales().configuration, gamma * system.scales().velocity])
    expected = size * np.random.default_rng(1).standard_normal(len(y))
    full = gamma * np.eye(len(y)) - equations.jacobian(0.0, y).toarray()
    found = solver.solve_lu(factors, full @ expected)
    assert np.abs((found - expected) / size).max() < 1e-8
    assert solver.J.nnz < 0.7 * np.count_nonzero(full)


def strip(contact: bool, spatial: bool = False) -> SegmentSystem:
    data = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": 1.4,
            "segments_per_panel": 10 if spatial else 6,
        },
        "material": {"young": 3e9, "density": 800.0, "damping": 1e-2},
        "crease": {"law": "linear", "stiffness": 9e-3},
        "drive": [{"crease": 3, "speed": 0.02, "travel": 0.02}],
    }  # fmt: skip
    if contact:
        data["contact"] = {"stiffness": 1e9}
    return compile_scene(build_scene(Case.model_validate(data)), spatial)


@pytest.mark.parametrize("spatial", [False, True])
def test_band_gives_what_the_dense_matrix_gives(spatial: bool) -> None:
    equations = FirstOrder(strip(False, spatial))
    end = END / 10 if spatial else END
    banded = make_solver("LSODA", equations, 0.0, equations.initial(), end, 1e-7, np.inf)
    assert isinstance(banded, _ReorderedLSODA)
    dense = LSODA(
        equations.rate, 0.0, equations.initial(), end, rtol=1e-7, atol=equations.absolute_tolerance(1e-7),
        first_step=1e-6 * end, jac=lambda t, y: equations.jacobian(t, y).toarray(),
    )  # fmt: skip
    for solver in (banded, dense):
        while solver.status == "running":
            assert solver.step() is None
    scale = equations.system.scales()
    size = np.concatenate([scale.configuration, scale.velocity])
    assert np.abs((banded.state() - dense.y) / size).max() < 1e-5
    np.testing.assert_array_equal(banded.interpolant()(banded.t), banded.state())
    assert np.abs(equations.split(banded.state())[1]).max() > 1e-6  # it moved


def test_no_band_where_panels_can_meet() -> None:
    equations = FirstOrder(strip(True))
    assert not isinstance(make_solver("LSODA", equations, 0.0, equations.initial(), END, 1e-6, np.inf), _ReorderedLSODA)
