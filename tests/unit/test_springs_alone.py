"""Newton's method in one call for springs alone: that of `EquilibriumStep`, to the last bit, or nothing."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from fsm.prepare import prepare
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
    _, system = prepare(load_case(CASE, [*FREE, *own]).case)
    if not in_one_call:
        system.__dict__["settles"] = None  # as if something else acted
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
    statistics, ledger = follow(system, settings, [], lambda saved: None, ends.append)
    counted = statistics.newton_iterations, statistics.factorisations, statistics.force_evaluations, statistics.rejected
    return [end.q for end in ends], [end.u for end in ends], counted, dataclasses.astuple(ledger)[:-1]


@KINDS
def test_paths_are_the_same_to_the_last_bit(spatial, damping, monkeypatch):
    system, other = system_of(spatial, damping), system_of(spatial, damping, in_one_call=False)
    assert system.rate_dependent == (damping > 0.0)
    given_up = []
    settle = type(system).settle
    monkeypatch.setattr(type(system), "settle", lambda *a: given_up.append(s := settle(*a)) or s)
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
    """Near, where it settles at once, and so far away that it gives up or does not converge at all."""
    system, other = system_of(spatial, damping), system_of(spatial, damping, in_one_call=False)
    rng, (q, _) = np.random.default_rng(3), system.initial()
    t, endings, settled = 0.5 * system.motions[0].run_up_time, set(), set()
    for size in (0.0, 1e-9, 1e-6, 1e-4, 1e-2, 0.1, 0.3, 1.0):
        guess = system.retract(q, size * system.scales().span * rng.standard_normal(system.nu))
        for before in ((0.0, q), (t, guess)):
            steps = EquilibriumStep(system, 1e-6), EquilibriumStep(other, 1e-6)
            for step in steps:
                step.largest_reaction = 0.1
            one, another = (step.solve(t, guess, before) for step in steps)
            assert same(one, another)
            assert steps[0].round_off == steps[1].round_off
            for count in ("iterations", "evaluations"):
                assert getattr(steps[0], count) == getattr(steps[1], count)
            assert steps[0].solver.factorisations == steps[1].solver.factorisations
            if one.ending in (Ending.CONVERGED, Ending.UNSTABLE):
                assert steps[0].solver.negative_pivots() == steps[1].solver.negative_pivots()
                right = rng.standard_normal(system.nu)
                assert np.array_equal(steps[0].solver.solve(right), steps[1].solver.solve(right))
            endings.add(one.ending)
            efforts = steps[0].efforts(t, guess, before)
            ready = steps[0].solver.ready(system.settles)
            settled.add(system.settle(t, guess, before, efforts, 0.1, steps[0]._rules, *ready) is not None)
    assert Ending.CONVERGED in endings
    assert len(endings) > 1
    assert settled == {True, False}


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
    assert prepare(load_case(CASE, contact).case)[1].settles is None
    assert prepare(load_case(CASE, hinged).case)[1].settles is None
    assert prepare(load_case(CASE, FREE).case)[1].settles is not None
