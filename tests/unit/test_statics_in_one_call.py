"""Quasi-static steps in one kernel: the same as in Python, with springs alone to the last bit."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.model.compile.compile_case import compile_case
from fsm.solve.equations.equilibrium_step import Ending, EquilibriumStep
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.settings import PathSettings
from fsm.solve.statics.path_steps import PathSteps
from fsm.solve.statics.static import follow

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
SQUARES = CASE.parents[1] / "rotating_squares" / "case.toml"
FREE = ["expect=none", "contact=none", "strip.thickness=1e-4", "crease.stiffness=0.02", "strip.segments_per_panel=3"]
KINDS = pytest.mark.parametrize(
    ("spatial", "damping"), [(False, 0.0), (False, 0.5), (True, 0.0), (True, 0.5)]
)


def system_of(spatial, damping, in_one_call=True, *overrides):
    own = [f"solve.spatial={str(spatial).lower()}", f"material.damping={damping}", *overrides]
    _, system = compile_case(load_case(CASE, [*FREE, *own]).case)
    if not in_one_call:
        in_python(system)
    return system


def in_python(system):
    """The same system, but with a placeholder that is not described by arrays."""
    system.__dict__["static_arrays"] = lambda ready: None
    return system


def kept(monkeypatch):
    """The data that `EquilibriumStep` gets from the kernel in each step."""
    found, solve_arrays = [], EquilibriumStep._solve_arrays
    monkeypatch.setattr(EquilibriumStep, "_solve_arrays", lambda *a: found.append(s := solve_arrays(*a)) or s)
    return found


def kept_of_paths(monkeypatch):
    """Numbers of steps that the kernel takes in each call, and Python without the kernel."""
    found, march, in_python = [], PathSteps._march_arrays, PathSteps._in_python
    monkeypatch.setattr(PathSteps, "_march_arrays", lambda *a: found.append(s := march(*a)) or s)
    monkeypatch.setattr(PathSteps, "_in_python", lambda *a, **k: found.append(False) or in_python(*a, **k))
    return found


def same(one, other):
    """Two equilibria are bitwise equal."""
    return all(
        np.array_equal(getattr(one, field.name), getattr(other, field.name)) for field in dataclasses.fields(one)
    )


def path(system):
    """Curve of all steps, last state, and the counters."""
    motion = system.motions[0]
    settings = PathSettings(motion.time_of(0.04), motion.time_of(2e-3), rtol=1e-3)
    ends = []
    statistics, energy_balance = follow(system, settings, [], lambda saved: None, ends.append)
    counted = statistics.newton_iterations, statistics.factorisations, statistics.force_evaluations, statistics.rejected
    points = statistics.points
    curve = np.array([[p.time, *p.drive.travel, *p.drive.force] for p in points])
    energies = np.array([[p.panels, p.creases] for p in points])
    return (curve, energies), [ends[-1].q, ends[-1].u], counted, dataclasses.astuple(energy_balance)[:-1]


@KINDS
def test_paths_are_the_same_to_the_last_bit(spatial, damping, monkeypatch):
    system, other = system_of(spatial, damping), system_of(spatial, damping, in_one_call=False)
    assert system.rate_dependent == (damping > 0.0)
    of_kernel = kept_of_paths(monkeypatch)
    found = path(system)
    assert of_kernel == [False, True]  # only the first step has no history
    assert len(found[0][0]) > 5
    monkeypatch.undo()
    wanted = path(other)
    round_off = 1e-10 if spatial and damping else 0.0  # of the deformations of dampers in space
    for mine, theirs in zip(found[1], wanted[1], strict=True):
        assert np.allclose(mine, theirs, rtol=0.0, atol=round_off * np.abs(theirs).max(initial=1.0))
    for number, error in enumerate((1e3 * round_off, max(1e-15, round_off))):  # curve, energies
        mine, theirs = found[0][number], wanted[0][number]
        assert np.all(np.abs(mine - theirs) <= error * np.abs(theirs).max(axis=0))
    counted = [0, 2, 3]  # Python also factorises to count pivots
    assert [found[2][k] for k in counted] == [wanted[2][k] for k in counted]
    assert found[3] == pytest.approx(wanted[3], rel=1e-12, abs=max(1e-12, 10.0 * round_off) * max(map(abs, wanted[3])))


@KINDS
def test_steps_from_anywhere_end_the_same(spatial, damping, monkeypatch):
    """Equilibria found at once, in many iterations, or not at all: from near and far, with all rules, efforts and last
    states."""
    of_kernel = kept(monkeypatch)
    system, other = system_of(spatial, damping), system_of(spatial, damping, in_one_call=False)
    rng, (q, _) = np.random.default_rng(3), system.initial()
    span, run_up = system.scales().span, system.motions[0].program.breaks()[1]
    endings, iterations, reached = set(), set(), False
    for _ in range(400):
        t = run_up * rng.uniform(0.0, 2.0)
        guess = system.retract(q, 10.0 ** rng.uniform(-12.0, 0.3) * span * rng.standard_normal(system.nu))
        last = system.retract(q, 10.0 ** rng.uniform(-12.0, -1.0) * span * rng.standard_normal(system.nu))
        before = t * rng.choice([0.0, 0.5, 1.0]), last
        efforts = None
        if rng.random() < 0.4:  # predicted, more or less
            efforts = system.efforts(t, guess) * (1.0 + 10.0 ** rng.uniform(-6.0, 1.0) * rng.standard_normal())
        rules = 10.0 ** rng.uniform(-12.0, -2.0), int(rng.integers(0, 16)), 10.0 ** rng.uniform(-2.0, 0.5)
        steps = EquilibriumStep(system, *rules), EquilibriumStep(other, *rules)
        reaction = 10.0 ** rng.uniform(-6.0, 2.0)
        for step in steps:
            step.largest_reaction = reaction
        step, wanted = steps
        one, another = (each.solve(t, guess, before, efforts) for each in steps)
        assert same(one, another)
        assert (step.round_off, step.iterations, step.evaluations) == (
            wanted.round_off, wanted.iterations, wanted.evaluations,
        )  # fmt: skip
        assert step.solver.factorisations == wanted.solver.factorisations or not step.solver.symmetric
        endings.add(one.ending)
        if one.ending in (Ending.CONVERGED, Ending.UNSTABLE):
            iterations.add(one.iterations)
            if not step.solver.symmetric:  # Python also factorised the symmetric part
                continue
            assert np.array_equal(step.solver._matrix.data, wanted.solver._matrix.data)
            assert np.array_equal(step.solver._factors, wanted.solver._factors)
            right = rng.standard_normal(system.nu)
            assert np.array_equal(step.solver.solve(right), wanted.solver.solve(right))
            moved = np.abs(system.difference(guess, one.q) / span).max()
            reached = reached or moved > rules[2]
    assert {Ending.CONVERGED, Ending.ITERATIONS} <= endings
    assert {1, 2, 3} <= iterations
    assert reached  # some were found although their corrections were limited
    assert sum(settled is not None for settled in of_kernel) > 300  # every second step is computed in Python


def test_after_one_that_superlu_had_to_take_over():
    step = EquilibriumStep(system_of(False, 0.0))
    q, _ = step.system.initial()
    step.solver._other = lambda right: np.full(len(right), np.nan)  # the earlier values
    found = step.solve(0.0, q, (0.0, q))
    assert found.ending is Ending.CONVERGED
    assert np.isfinite(step.solver.solve(np.ones(step.system.nu))).all()


def test_a_singular_matrix_is_left_to_the_solver_that_says_so():
    system = system_of(False, 0.0)
    (springs,) = system.groups
    q, _ = system.initial()
    assert EquilibriumStep(system).solve(0.0, q, (0.0, q)).ending is Ending.CONVERGED
    body = system.bodies.free[0]
    springs._constants[(springs.bodies == body).any(axis=1), 10:13] = 0.0  # joints without stiffness
    assert EquilibriumStep(system).solve(0.0, q, (0.0, q)).ending is Ending.SINGULAR


def test_systems_with_hysteresis_or_contact_have_static_arrays():
    solver = LinearSolver()
    for overrides, tried in (([], True), (FREE, True), ([*FREE, *SPLINE, LOOPS], True), ([*FREE, *SPLINE], True)):
        _, system = compile_case(load_case(CASE, ["expect=none", *overrides]).case)
        assert (system.static_arrays(solver.ready) is not None) == tried


LOAD = (
    'load=[{body="panel 2 segment 2", point=[0.01, 0.0, 0.0], force=[1e-3, 0.0, -2e-3], follower=true, '
    'time={kind="ramp", end=3.0}}]'
)
SPLINE = [
    "crease.law=spline", "crease.stiffness=none", "crease.angle=[0.0, 1.0, 2.0, 3.0]",
    "crease.moment=[0.0, 0.01, 0.015, 0.018]", "crease.rest_angle=3.0",
]  # fmt: skip
LOOPS = "crease.unloading=[-0.001, 0.008, 0.014, 0.018]"


def other_systems():
    """Curved creases, weights and a load over time, ligaments, hysteresis; with and without dampers."""
    for spatial in (False, True):
        for damping in (0.0, 0.5):
            own = [*FREE, *SPLINE, LOAD, "gravity=[0, 0, -9.81]", f"solve.spatial={str(spatial).lower()}"]
            yield load_case(CASE, [*own, f"material.damping={damping}"])
    yield load_case(SQUARES, ["expect=none"])
    yield load_case(SQUARES, ["expect=none", "lattice.damping=1e-4"])
    yield load_case(CASE, [*FREE, *SPLINE, LOOPS])


@pytest.mark.parametrize("number", range(7))
def test_all_other_elements_take_the_same_iterations(number, monkeypatch):
    loaded = list(other_systems())[number]
    system, other = compile_case(loaded.case)[1], in_python(compile_case(loaded.case)[1])
    of_kernel, ends = kept_of_paths(monkeypatch), []
    for one in (system, other):
        motion, states = one.motions[0], []
        end = motion.time_of(0.1 * motion.travel)
        settings = PathSettings(end, motion.time_of(0.01 * motion.travel), rtol=1e-3)
        statistics, _ = follow(one, settings, np.linspace(0.0, end, 6).tolist(), states.append)
        ends.append((statistics.newton_iterations, statistics.force_evaluations, statistics.steps, states))
    assert ends[0][:3] == ends[1][:3]
    assert ends[0][2] > 3
    assert sum(of_kernel) > 0
    for mine, wanted in zip(ends[0][3], ends[1][3], strict=True):
        assert np.abs(system.difference(mine.q, wanted.q) / system.scales().increment).max() < 1e-9
