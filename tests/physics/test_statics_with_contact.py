"""Newton's method of statics with contact in one kernel, against the same iterations in Python from the same states."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from fsm.compile_case import compile_case
from fsm.scene.load_case import load_case
from fsm.segments.static_arrays import StaticSegments
from fsm.solve.equilibrium_step import _CALLS, EquilibriumStep, _Model
from fsm.solve.linear import LinearSolver
from fsm.solve.static import PathSettings, follow
from fsm.stepping.quasi_static import FACTORISED, FOUND, StaticModel, settle

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
DRY = 'friction={law="step", mu_static=0.3, mu_dynamic=0.2, v_static=1e-3, v_dynamic=1e-2}'
BRISTLES = 'friction={law="lugre", mu_static=0.4, mu_dynamic=0.3, v_stribeck=1e-2, presliding=1e-5}'
CYLINDER = 'obstacle=[{name="bar", shape="cylinder", radius=2e-3, length=0.06, position=[0.0278, 0.0, 0.02]}]'
BALL = 'obstacle=[{name="ball", shape="sphere", radius=3e-3, position=[0.0278, 0.005, 0.025]}]'
BOX = 'obstacle=[{name="block", shape="box", size=[3e-3, 0.01, 3e-3], position=[0.0278, 0.018, 0.022]}]'


def strip(spatial, *overrides, travel=0.1):
    own = [
        "expect=none", "strip.segments_per_panel=4", f"drive.0.travel={travel}", f"solve.spatial={str(spatial).lower()}",
        *overrides,
    ]  # fmt: skip
    return compile_case(load_case(CASE, own).case)[1]


def path(system, part=1.0):
    """Ends of all steps of a path over a part of the travel, and what was counted."""
    motion, ends = system.motions[0], []
    settings = PathSettings(motion.time_of(part * motion.travel), motion.time_of(motion.travel / 100), rtol=1e-3)
    statistics, _ = follow(system, settings, [], lambda saved: None, ends.append)
    return ends, (statistics.newton_iterations, statistics.factorisations, statistics.rejected)


def compared(monkeypatch):
    """Repeat each solution of the kernel in Python; returns what was seen."""
    solve_arrays, seen, farthest = EquilibriumStep._solve_arrays, Counter(), [0.0]

    def both(self, t, guess, before, efforts, rules):
        found = solve_arrays(self, t, guess, before, efforts, rules)
        if found is None:
            seen["in Python"] += 1
            return None
        rates, depths = self._rates(t, before), self.mixed.depths(self.largest_reaction)
        model = _Model(self.system, self.mixed, LinearSolver(), t, before, rates, efforts, depths)
        mine, wanted = found[0], settle(StaticModel(_CALLS, model), guess, rules)
        assert mine.ending == wanted.ending
        assert mine.counts.tolist() == wanted.counts.tolist()
        if mine.ending == FOUND:
            farthest[0] = max(farthest[0], np.abs(self.system.difference(mine.q, wanted.q) / self.scales.span).max())
            scale = np.abs(model.efforts).max(initial=1e-9)
            assert np.abs(found[1] - model.efforts).max(initial=0.0) < 1e-6 * scale
            if wanted.counts[FACTORISED] and found[2].pattern is model.matrix.pattern:
                assert np.allclose(found[2].data, model.matrix.data, rtol=0.0, atol=1e-6 * np.abs(model.matrix.data).max())
        seen["in one call"] += 1
        seen["with contact"] += sum(len(group._contact_memory.key) > 0 for group in self.system.contacts)
        return found

    monkeypatch.setattr(EquilibriumStep, "_solve_arrays", both)
    return seen, farthest


CASES = {
    "panels, plane": (False, ("contact.thickness_in_gap=true",)),
    "panels with friction, plane": (False, (DRY,)),
    "panels with bristles, plane": (False, (BRISTLES,)),
    "panels with friction, space": (True, (DRY,)),
    "cylinder with friction, plane": (False, (CYLINDER, DRY)),
    "cylinder with bristles, space": (True, (CYLINDER, BRISTLES)),
    "ball, space": (True, (BALL,)),
    "edges of a box with friction, space": (True, (BOX, DRY)),
}


@pytest.mark.parametrize("name", CASES)
def test_each_solution_takes_the_same_iterations(name, monkeypatch):
    spatial, overrides = CASES[name]
    seen, farthest = compared(monkeypatch)
    path(strip(spatial, *overrides), 0.2 if "obstacle" in overrides[0] else 0.7)  # farther, an obstacle tears the strip
    assert seen["in one call"] > 10
    assert seen["in one call"] > 10 * seen["in Python"]
    assert seen["with contact"] > 5
    assert farthest[0] < 1e-9  # the solutions differ by round-off, and would differ by 1e-6 with another tangent


def test_arrays_grow_where_bodies_meet_that_were_apart(monkeypatch):
    begun, solved, begin, solve = [], [], StaticSegments.begin, EquilibriumStep.solve
    monkeypatch.setattr(StaticSegments, "begin", lambda self, *a: begun.append(0) or begin(self, *a))
    monkeypatch.setattr(EquilibriumStep, "solve", lambda self, *a: solved.append(0) or solve(self, *a))
    seen, _ = compared(monkeypatch)
    path(strip(False, "strip.segments_per_panel=12"))
    assert len(begun) > len(solved)  # some were begun again
    assert seen["in one call"] > 10 * seen["in Python"]


@pytest.mark.parametrize("spatial", [False, True])
def test_a_second_run_of_a_system_is_the_same_to_the_last_bit(spatial):
    system = strip(spatial, DRY)
    one, two = path(system), path(system)
    assert one[1] == two[1]
    assert len(one[0]) == len(two[0]) > 10
    assert all(np.array_equal(a.q, b.q) and np.array_equal(a.u, b.u) for a, b in zip(one[0], two[0], strict=True))


def test_small_largest_reaction_limits_the_depth_of_new_contacts(monkeypatch):
    """Guesses that penetrate deeply: new contacts are linearised where their force is the largest reaction."""
    seen, farthest = compared(monkeypatch)
    system = strip(False, CYLINDER)
    rng, (q, _) = np.random.default_rng(5), system.initial()
    span = system.scales().span
    for _ in range(30):
        guess = system.retract(q, 10.0 ** rng.uniform(-3.0, -1.0) * span * rng.standard_normal(system.nu))
        step = EquilibriumStep(system, 10.0 ** rng.uniform(-9.0, -5.0), int(rng.integers(3, 15)))
        step.largest_reaction = 10.0 ** rng.uniform(-6.0, 1.0)
        step.solve(1e-3, guess, (0.0, q))
    assert seen["in one call"] > 20
    assert farthest[0] < 1e-7
