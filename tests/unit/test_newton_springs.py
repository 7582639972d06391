"""Newton's method in one call for springs alone: that of `EquilibriumStep`, to the last bit, or nothing."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from fsm.compile_case import compile_case
from fsm.scene.load_case import load_case
from fsm.solve.equilibrium_step import Ending, EquilibriumStep
from fsm.solve.static import PathSettings, follow

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
FREE = ["expect=none", "contact=none", "strip.thickness=1e-4", "crease.stiffness=0.02", "strip.segments_per_panel=3"]
KINDS = pytest.mark.parametrize(
    ("spatial", "damping"), [(False, 0.0), (False, 0.5), (True, 0.0), (True, 0.5)]
)


def system_of(spatial, damping, in_one_call=True, *overrides):
    own = [f"solve.spatial={str(spatial).lower()}", f"material.damping={damping}", *overrides]
    _, system = compile_case(load_case(CASE, [*FREE, *own]).case)
    if not in_one_call:
        system.__dict__["newton_pattern"] = lambda: None  # as if something else acted
    return system


def same(one, other):
    """Two equilibria, to the last bit."""
    return all(
        np.array_equal(getattr(one, field.name), getattr(other, field.name)) for field in dataclasses.fields(one)
    )


def path(system):
    """Ends of all steps, and what was counted."""
    motion = system.motions[0]
    settings = PathSettings(motion.time_of(0.04), motion.time_of(2e-3), rtol=1e-3)
    ends = []
    statistics, energy_balance = follow(system, settings, [], lambda saved: None, ends.append)
    counted = statistics.newton_iterations, statistics.factorisations, statistics.force_evaluations, statistics.rejected
    return [end.q for end in ends], [end.u for end in ends], counted, dataclasses.astuple(energy_balance)[:-1]


@KINDS
def test_paths_are_the_same_to_the_last_bit(spatial, damping, monkeypatch):
    system, other = system_of(spatial, damping), system_of(spatial, damping, in_one_call=False)
    assert system.rate_dependent == (damping > 0.0)
    given_up = []
    newton_solve = type(system).newton_solve
    monkeypatch.setattr(type(system), "newton_solve", lambda *a: given_up.append(s := newton_solve(*a)) or s)
    found = path(system)
    assert given_up
    assert all(settled is not None for settled in given_up)
    assert len(found[0]) > 5
    monkeypatch.undo()
    wanted = path(other)
    assert all(np.array_equal(a, b) for a, b in zip(found[0], wanted[0], strict=True))
    assert all(np.array_equal(a, b) for a, b in zip(found[1], wanted[1], strict=True))
    assert found[2:] == wanted[2:]


@KINDS
def test_steps_from_anywhere_end_the_same(spatial, damping):
    """Found at once, in many iterations, or not: near and far, under all kinds of rules, from any efforts and last state."""
    system, other = system_of(spatial, damping), system_of(spatial, damping, in_one_call=False)
    rng, (q, _) = np.random.default_rng(3), system.initial()
    span, run_up = system.scales().span, system.motions[0].program.run_up_time
    endings, iterations, settled, reached = set(), set(), set(), False
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
        assert step.solver.factorisations == wanted.solver.factorisations
        endings.add(one.ending)
        if one.ending in (Ending.CONVERGED, Ending.UNSTABLE):
            iterations.add(one.iterations)
            assert np.array_equal(step.solver._matrix.data, wanted.solver._matrix.data)
            assert np.array_equal(step.solver._factors, wanted.solver._factors)
            right = rng.standard_normal(system.nu)
            assert np.array_equal(step.solver.solve(right), wanted.solver.solve(right))
            moved = np.abs(system.difference(guess, one.q) / span).max()
            reached = reached or moved > rules[2]
        ready = step.solver.ready(system.newton_pattern())
        own = step.efforts(t, guess, before) if efforts is None else efforts
        settled.add(system.newton_solve(t, guess, before, own, reaction, step._rules, *ready) is not None)
    assert {Ending.CONVERGED, Ending.ITERATIONS} <= endings
    assert {1, 2, 3} <= iterations
    assert reached  # some came through although they were held back on the way
    assert settled == {True, False}


def test_after_one_that_superlu_had_to_take_over():
    step = EquilibriumStep(system_of(False, 0.0))
    q, _ = step.system.initial()
    step.solver._other = lambda right: np.full(len(right), np.nan)  # what it had then
    found = step.solve(0.0, q, (0.0, q))
    assert found.ending is Ending.CONVERGED
    assert np.isfinite(step.solver.solve(np.ones(step.system.nu))).all()


def test_a_singular_matrix_is_left_to_the_solver_that_says_so():
    system = system_of(False, 0.0)
    (springs,) = system.groups
    q, _ = system.initial()
    assert EquilibriumStep(system).solve(0.0, q, (0.0, q)).ending is Ending.CONVERGED
    body = system.bodies.free[0]
    springs._constants[(springs.bodies == body).any(axis=1), 10:13] = 0.0  # joints that hold nothing
    assert EquilibriumStep(system).solve(0.0, q, (0.0, q)).ending is Ending.SINGULAR


def test_where_anything_else_acts_it_is_not_tried():
    contact, hinged = ["expect=none", "strip.segments_per_panel=3"], [*FREE, 'gravity=[0, 0, -9.81]']
    assert compile_case(load_case(CASE, contact).case)[1].newton_pattern() is None
    assert compile_case(load_case(CASE, hinged).case)[1].newton_pattern() is None
    assert compile_case(load_case(CASE, FREE).case)[1].newton_pattern() is not None
