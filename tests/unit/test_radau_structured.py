"""Radau's method with block matrices takes the steps of SciPy's Radau, and its reduced equations equal those of the whole
Jacobian."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.integrate import Radau, solve_ivp

from fsm.builders.scene import build_scene
from fsm.case.models.case import Case
from fsm.case.models.contact import Contact, Friction
from fsm.case.models.scene import Body, ContactPair, ForceElement, Plate, Scene, Surface
from fsm.kernels.blocks import BlockMatrix
from fsm.model.bodies.group import body_pattern
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.interface.records import Linearised
from fsm.solve.outcome.run_io import SavedState, Statistics
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.time.dense_run import stretch
from fsm.solve.time.radau_structured import StructuredRadau, _diagonal_blocks, second_order_jacobian
from fsm.solve.time.scipy_ivp import FirstOrder, make_solver

LENGTH, WIDTH, THICKNESS = 0.02, 0.03, 1e-3


def chain(name: str, x: float, z: float, spatial: bool) -> tuple[list[Body], list[ForceElement]]:
    """Four plates joined by uneven springs and dampers, moving at random."""
    rng = np.random.default_rng(ord(name))
    keep = np.array([1.0, float(spatial), 1.0])
    turn = np.array([float(spatial), 1.0, float(spatial)])
    bodies = [
        Body(
            name=f"{name}{i}",
            mass=1e-3 * (1.0 + i),
            inertia=(8e-8, 4e-8, 1e-7),
            position=(x + (i + 0.5) * LENGTH, 0.0, z),
            velocity=tuple(0.1 * rng.standard_normal(3) * keep),
            angular_velocity=tuple(2.0 * rng.standard_normal(3) * turn),
            plate=Plate(length=LENGTH, width=WIDTH, thickness=THICKNESS),
        )
        for i in range(4)
    ]
    elements = [
        ForceElement(
            name=f"{name} joint {i}",
            inner=f"{name}{i}",
            outer=f"{name}{i + 1}",
            point_inner=(LENGTH / 2, 0.0, 0.0),
            point_outer=(-LENGTH / 2, 0.0, 0.0),
            translation=(3e3, 1e3, 2e3),
            rotation=(0.03, 0.02, 0.1),
            translation_damping=(0.3, 0.2, 0.1),
            rotation_damping=(3e-5, 2e-5, 1e-4),
        )
        for i in range(3)
    ]
    return bodies, elements


def rubbing(spatial: bool) -> SegmentSystem:
    """Two free chains, one pressed into the other by 0.1 mm."""
    lower, upper = chain("a", 0.0, 0.0, spatial), chain("b", LENGTH / 3, THICKNESS - 1e-4, spatial)
    scene = Scene(
        bodies=(*lower[0], *upper[0]),
        elements=(*lower[1], *upper[1]),
        surfaces=tuple(Surface(name=n, bodies=tuple(b.name for b in c[0])) for n, c in (("a", lower), ("b", upper))),
        pairs=(ContactPair(first="a", second="b"),),
        contact=Contact(stiffness=1e7, damping=20.0, ramp=1e-4),
        friction=Friction(mu_static=0.4, mu_dynamic=0.3, v_static=0.01, v_dynamic=0.05),
    )
    system = compile_scene(scene, spatial)
    assert system.spatial == spatial
    return system


def strip(spatial: bool) -> SegmentSystem:
    data = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": 1.4, "segments_per_panel": 10,
        },
        "material": {"young": 3e9, "density": 800.0, "damping": 1e-2},
        "crease": {"law": "linear", "stiffness": 9e-3},
        "drive": [{"crease": 3, "speed": 0.02, "travel": 0.02}],
    }  # fmt: skip
    return compile_scene(build_scene(Case.model_validate(data)), spatial)


def both(system: SegmentSystem, end: float, rtol: float) -> tuple[FirstOrder, Radau, Radau, list[list[float]]]:
    """The equations, SciPy's solver and ours at the end, and the times of their steps."""
    equations = FirstOrder(system)
    solvers, times = [], []
    for method in ("Radau", "Radau-blocks"):
        solver = make_solver(method, equations, 0.0, equations.initial(), end, rtol, np.inf)
        times.append([])
        while solver.status == "running":
            assert solver.step() is None
            times[-1].append(solver.t)
        solvers.append(solver)
    return equations, solvers[0], solvers[1], times


def refined(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution with residuals in long doubles: mixed units cost the dense solver up to ten digits."""
    precise = matrix.astype(np.clongdouble)
    x = np.zeros(len(right), dtype=np.clongdouble)
    for _ in range(4):
        x = x + np.linalg.solve(matrix, (right - precise @ x).astype(complex))
    return x.astype(complex)


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("gamma", [3.0, 2e3, 2e5, 2.7e3 - 3.1e3j, 2.7 - 3.1j])
def test_solves_the_whole_equations(spatial: bool, gamma: complex) -> None:
    system = rubbing(spatial)
    equations = FirstOrder(system)
    rng = np.random.default_rng(3)
    y = equations.initial()
    y[: system.nq] += 1e-5 * rng.standard_normal(system.nq)  # quaternions off the unit sphere, too
    y[system.nq :] += 0.1 * rng.standard_normal(system.nu)
    assert system.observe(0.0, *equations.split(y)).pairs.force.max() > 0.0
    solver = StructuredRadau(equations.rate, 0.0, y, 1.0, system=system)
    factors = solver.lu(gamma * solver.I - second_order_jacobian(system, 0.0, y))
    whole = gamma * np.eye(len(y)) - equations.jacobian(0.0, y).toarray()
    for right in (np.eye(len(y))[0], rng.standard_normal(len(y)), equations.rate(0.0, y)):
        exact = equations.split(refined(whole, right))
        found = equations.split(solver.solve_lu(factors, right.astype(type(gamma))))
        for one, other in zip(found, exact, strict=True):
            assert np.abs(one - other).max() < 1e-10 * np.abs(other).max()


@pytest.mark.parametrize("spatial", [False, True])
def test_takes_the_steps_of_scipy_in_contact_and_friction(spatial: bool) -> None:
    system = rubbing(spatial)
    equations, plain, ours, times = both(system, 0.01, 1e-5)
    assert len(times[0]) == len(times[1]) > 20
    np.testing.assert_allclose(times[1], times[0], rtol=1e-8)
    np.testing.assert_allclose(ours.y, plain.y, rtol=0.0, atol=1e-8)
    assert (ours.nfev, ours.njev, ours.nlu) == (plain.nfev, plain.njev, plain.nlu)
    assert equations.jacobian_calls == 2 * ours.njev
    middle = 0.5 * (ours.t_old + ours.t)
    np.testing.assert_allclose(ours.dense_output()(middle), plain.dense_output()(middle), rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("spatial", [False, True])
def test_takes_the_steps_of_scipy_on_a_strip(spatial: bool) -> None:
    # round-off grows: within some tens of steps it is 1e-6 of a step, just as between SciPy's dense and sparse Jacobians
    _, plain, ours, times = both(strip(spatial), 0.025, 1e-4)
    assert len(times[0]) == len(times[1]) > 8
    np.testing.assert_allclose(ours.y, plain.y, rtol=0.0, atol=1e-8)
    assert (ours.nfev, ours.njev, ours.nlu) == (plain.nfev, plain.njev, plain.nlu)


def test_scipy_takes_it_as_a_method() -> None:
    system = rubbing(True)
    equations = FirstOrder(system)
    atol = equations.absolute_tolerance(1e-5)
    options = {"rtol": 1e-5, "atol": atol, "max_step": 1e-3, "first_step": 1e-5, "dense_output": True}
    span = (0.0, 0.005)
    ours = solve_ivp(equations.rate, span, equations.initial(), method=StructuredRadau, system=system, **options)
    plain = solve_ivp(equations.rate, span, equations.initial(), method="Radau", jac=equations.jacobian, **options)
    assert ours.success
    np.testing.assert_allclose(ours.t, plain.t, rtol=1e-8)
    np.testing.assert_allclose(ours.y, plain.y, rtol=0.0, atol=1e-8)
    assert (ours.nfev, ours.njev, ours.nlu) == (plain.nfev, plain.njev, plain.nlu)


class Springs:
    """A linear chain with a mass matrix that is not diagonal: what another kind of element would have."""

    def __init__(self) -> None:
        rng = np.random.default_rng(5)
        self.pattern = body_pattern(np.arange(6), [np.column_stack([np.arange(5), np.arange(1, 6)])], 3)
        root = rng.normal(size=(18, 18)) / 18
        blocks = [(row, column) for row, column in zip(self.pattern.rows, self.pattern.indices, strict=True)]

        def taken(dense: np.ndarray) -> np.ndarray:
            return np.array([dense[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] for i, j in blocks])

        self.stiffness = BlockMatrix(self.pattern, taken(50.0 * np.eye(18) + 20.0 * (root + root.T)))
        self.damping = BlockMatrix(self.pattern, taken(0.3 * np.eye(18) + root))
        self.mass = taken(np.eye(18) + root + root.T)
        self.nq = self.nu = 18

    def linearise(self, t: float, q: np.ndarray, u: np.ndarray | None) -> Linearised:
        return Linearised(np.zeros(18), self.stiffness, self.damping)

    def inertia(self, q: np.ndarray, pattern: object) -> np.ndarray:
        return self.mass

    def increment_map(self, dx: np.ndarray) -> None:
        return None


def test_mass_matrices_need_not_be_diagonal() -> None:
    system = Springs()
    inverse = np.linalg.inv(BlockMatrix(system.pattern, system.mass).bsr().toarray())
    lower = [-inverse @ matrix.bsr().toarray() for matrix in (system.stiffness, system.damping)]
    jacobian = np.block([[np.zeros((18, 18)), np.eye(18)], lower])
    y0 = np.random.default_rng(0).normal(size=36)
    ours = solve_ivp(lambda t, y: jacobian @ y, (0.0, 2.0), y0, method=StructuredRadau, system=system)
    plain = solve_ivp(lambda t, y: jacobian @ y, (0.0, 2.0), y0, method="Radau", jac=lambda t, y: jacobian)
    np.testing.assert_allclose(ours.t, plain.t, rtol=1e-8)
    np.testing.assert_allclose(ours.y, plain.y, rtol=0.0, atol=1e-8)


def test_kinematics_between_nodes_are_refused() -> None:
    with pytest.raises(ValueError, match="one node depend on another"):
        _diagonal_blocks(sparse.csr_matrix(np.ones((4, 4))), 2)


def pulled(method: str, system: SegmentSystem, times: np.ndarray, rtol: float) -> tuple[list[SavedState], Statistics]:
    saved: list[SavedState] = []
    statistics, energy_balance = simulate(system, Settings(method, rtol, float(times[-1])), list(times), saved.append)
    assert energy_balance.relative_error < 1e-4
    return saved, statistics


@pytest.mark.parametrize("spatial", [False, True])
def test_a_strip_pulled_by_it_has_the_peak_of_radau(spatial: bool) -> None:
    """Through `simulate`: steps end at the saved times, and the counters count what Radau's do."""
    system = strip(spatial)
    times = np.linspace(0.0, 0.1 * system.motions[0].end_time, 21)
    (ours, counted), (plain, reference) = (pulled(m, system, times, 1e-7) for m in ("Radau-blocks", "Radau"))
    assert [state.time for state in ours] == [state.time for state in plain] == list(times)
    force = np.array([state.observation.drive.force[0] for state in plain])
    np.testing.assert_allclose([s.observation.drive.force[0] for s in ours], force, atol=1e-5 * force.max())
    peaks = [max(drive.force[0] for drive, *_ in s.points) for s in (counted, reference)]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-5)
    assert counted.method == "Radau-blocks"
    assert counted.newton_iterations == counted.force_evaluations // 3 > 0
    assert 0 < counted.jacobian_evaluations <= counted.factorisations
    assert counted.steps == pytest.approx(reference.steps, rel=0.2)
    assert counted.smallest_step > 1e-6 * times[1]


@pytest.mark.parametrize("method", ["Radau", "Radau-blocks"])
@pytest.mark.parametrize("part", [1.0 - 1e-13, 1.0 - 1e-10])
def test_no_step_of_a_rounding_error_before_a_saved_time(method: str, part: float) -> None:
    """A step that would end next to the time to be saved ends there."""
    equations = FirstOrder(strip(False))
    bound = 1e-5
    for stretched in (False, True):
        solver = make_solver(method, equations, 0.0, equations.initial(), bound, 1e-3, np.inf)
        solver.h_abs = part * bound
        if stretched:
            stretch(solver)
        solver.step()
        assert (solver.t == bound) == stretched
        assert solver.t == pytest.approx(bound, rel=1e-9)
