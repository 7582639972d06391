"""Ideal joints in steps of the mean-force method: energies, order, reactions, motors, couplings, events, flexible parts."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.model.compile.compile_case import compile_case
from fsm.model.elements.joints import JointGroup
from fsm.model.plan.in_python import InPython
from fsm.solve.stepping.march import ALLOWED, BALANCE
from fsm.solve.time.mean_force import MeanForce
from tests.physics.test_coupled_joints import wheels
from tests.physics.test_explicit import panel
from tests.physics.test_flexible_joints import beam
from tests.physics.test_flexible_joints import case as flexible
from tests.physics.test_flexible_joints import hinge as hinge_of
from tests.physics.test_ideal_joints import bars, body, joint, mechanism, of


def chain() -> dict[str, Any]:
    """Three bars in space: a ball joint, a cross and an inclined hinge."""
    bodies = [body(f"bar {k}", [k + 0.5, 0.0, 0.0], [0.02, 0.1, 0.09]) for k in range(3)]
    joints = [
        joint("ball", "spherical", "ground", "bar 0", [0, 0, 0]),
        joint("cross", "universal", "bar 0", "bar 1", [1, 0, 0], axis=[0, 1, 0], second_axis=[0, 0, 1]),
        joint("hinge", "revolute", "bar 1", "bar 2", [2, 0, 0], axis=[0, 0.6, 0.8]),
    ]
    return mechanism(bodies, joints, 0.6, 0.1)


def four_bar() -> dict[str, Any]:
    """A loop in a plane; nine of its locked directions follow from others."""
    return mechanism(*bars([(0.0, 0.0), (0.5, 0.9), (2.2, 1.6), (2.0, 0.0)]), 0.6, 0.1)


def run(case: dict[str, Any], folder: Path, method: str = "mean-force", **solve: Any) -> fsm.Result:
    case["solve"] |= {"method": method, **solve}
    return fsm.load(case).run(folder / f"{method} {solve.get('step')}", figures=False)


def started(case: dict[str, Any], step: float) -> MeanForce:
    """The method at the start of a case without initial velocities."""
    _, system = compile_case(fsm.load(case).model)
    q, u = (part.copy() for part in system.initial())
    system.consistent(0.0, q, u, np.zeros(len(u)))
    return MeanForce(system, 0.0, q, u, 1e-9, step)


def march(method: MeanForce, until: float) -> None:
    balance = np.zeros(BALANCE)
    balance[ALLOWED] = math.inf
    while method.t < until:
        method.march(balance, until, 1000)


def own_energy(method: MeanForce) -> float:
    """Energy with the velocity of the method."""
    return method.system.energy(method.t, method.q, method.motion.u).stored


@pytest.mark.parametrize("case", [chain, four_bar])
def test_multipliers_do_no_work_and_no_joint_opens(case: Any) -> None:
    """Steps in which bodies turn by up to 0.1 rad; angles and openings at ends of steps have round-off only."""
    method = started(case(), 0.01)
    first = own_energy(method)
    for end in (1.0, 2.0, 4.0):
        march(method, end)
        system, (t, q) = method.system, (method.t, method.q)
        kinetic = system.energy(t, q, method.u).kinetic
        assert kinetic > 0.1
        assert own_energy(method) == pytest.approx(first, abs=1e-9)
        group = system.locking[0]
        assert isinstance(group, JointGroup)
        assert np.abs(group.openings(system.place(t, q, None)[0])[0]).max() < 1e-11
        assert np.abs(system.locked_rows(t, q) @ method.u).max() < 1e-9
    assert method.failed == 0


@pytest.mark.parametrize("case", [chain, four_bar])
def test_second_order_of_states_and_reactions(case: Any, tmp_path: Path) -> None:
    exact, errors = run(case(), tmp_path, "explicit"), []
    names = [name for name in exact.channels if name.endswith((".position", ".velocity", ".force"))]
    for step in (0.01, 0.005):
        found = run(case(), tmp_path, step=step)
        errors.append([np.abs(of(found, name) - of(exact, name)).max() for name in names])
    coarse, fine = np.array(errors)
    assert len(names) >= 12
    large = coarse > 1e-8
    assert np.log2(coarse[large] / fine[large]) == pytest.approx(2.0, abs=0.25)
    assert fine.max() < 0.05


def test_error_control_agrees_with_explicit_steps(tmp_path: Path) -> None:
    exact, found = run(chain(), tmp_path, "explicit"), run(chain(), tmp_path, rtol=1e-7)
    assert found.summary["steps_compiled"]
    for name in ("body.bar 2.position", "body.bar 2.velocity", "joint.cross.force"):
        assert of(found, name) == pytest.approx(of(exact, name), abs=2e-3 * np.abs(of(exact, name)).max())


def test_steps_in_python_are_the_compiled_ones() -> None:
    ends = []
    for compiled in (True, False):
        method = started(chain(), 0.02)
        if not compiled:
            method.system.in_python = InPython(("a test",))
        march(method, 0.1)
        assert isinstance(method.system.locking[0], JointGroup)
        ends.append((method.q, method.u, method.system.locking[0].efforts.copy()))
    for one, other in zip(*ends, strict=True):
        assert one == pytest.approx(other, rel=1e-7, abs=1e-7)


def test_a_motor_puts_in_the_work_that_the_energies_show(tmp_path: Path) -> None:
    """The coordinate follows its program, and the work of the motor is the change of the energy."""
    motor = {"angle": 1.0, "time": {"kind": "ramp", "end": 1.0}}
    case = panel(motor=motor)
    case["save"] = {"interval": 0.25, "channels": ["joint.*", "energy.*", "body.*"]}
    case["solve"]["end_time"] = 1.5
    exact, found = run(case, tmp_path, "explicit"), run(case, tmp_path, step=0.01)
    assert of(found, "joint.hinge.angle") == pytest.approx(of(exact, "joint.hinge.angle"), abs=1e-12)
    work = of(exact, "energy.work")
    assert of(found, "energy.work") == pytest.approx(work, abs=2e-3 * np.abs(work).max())
    moments = of(exact, "joint.hinge.motor")
    assert of(found, "joint.hinge.motor") == pytest.approx(moments, abs=1e-9 * np.abs(moments).max())
    assert found.summary["energy_error"] < 1e-9


def test_a_motor_starts_from_rest_without_loads(tmp_path: Path) -> None:
    """The first steps of error control have no energy but that of the motor."""
    case = panel(motor={"angle": 1.0, "time": {"kind": "ramp", "end": 1.0}}) | {"gravity": [0.0, 0.0, 0.0]}
    case["solve"]["end_time"] = 1.0
    found = run(case, tmp_path, rtol=1e-7)
    assert of(found, "joint.hinge.angle")[-1] == pytest.approx(1.0, abs=1e-12)
    assert found.summary["energy_error"] < 1e-7


def test_a_latch_closes_at_its_time(tmp_path: Path) -> None:
    """Stop, latch and damper are those of other methods; the step that latches is shortened."""
    given = {
        "spring": {"stiffness": 12.0, "rest": 0.8}, "damper": {"coefficient": 0.6},
        "stop": {"lower": -0.2, "stiffness": 3e4}, "latch": {"at": 1.0, "play": 0.001, "stiffness": 2e4},
    }  # fmt: skip
    exact, found = (run(panel(**given), tmp_path, method, rtol=1e-7) for method in ("explicit", "mean-force"))
    times = [[row["time"] for row in result.summary["joint_events"]] for result in (exact, found)]
    assert len(times[0]) > 0
    assert times[1] == pytest.approx(times[0], rel=1e-3)


def test_gears_turn_together(tmp_path: Path) -> None:
    case = wheels({"ratio": -2.5}, 1.0, spin=3.0, moment=0.4)
    exact, found = run(case, tmp_path, "explicit"), run(case, tmp_path, step=0.01)
    for name in ("joint.a.angle", "joint.b.angle"):
        assert of(found, name) == pytest.approx(of(exact, name), abs=1e-9)


def test_a_beam_swings_on_a_hinge_and_keeps_its_energy(tmp_path: Path) -> None:
    case = flexible([hinge_of("hinge", "ground", "beam.start", 0.0)], {"end_time": 0.3}, beams=[beam(young=1e8)])
    case |= {"gravity": [0.0, 0.0, -9.81], "save": {"interval": 0.01, "channels": ["joint.*", "energy.*"]}}
    found = run(case, tmp_path, step=1e-3)
    assert found.summary["energy_error"] < 1e-6
    exact = run(case, tmp_path, "generalized-alpha", rtol=1e-6)
    assert of(found, "joint.hinge.angle") == pytest.approx(of(exact, "joint.hinge.angle"), abs=2e-3)


def test_a_restart_has_the_velocities_across_the_joints() -> None:
    """They carry energy from step to step, and records do not have them."""
    one, other = started(chain(), 0.02), started(chain(), 0.02)
    march(one, 0.1)
    other.system.restore(one.system.memory())
    again = MeanForce(other.system, one.t, one.q.copy(), one.u.copy(), 1e-9, 0.02)
    again.resume(one.state())
    assert np.abs(one.motion.u - one.u).max() > 1e-5
    for method in (one, again):
        march(method, 0.2)
    assert again.q == pytest.approx(one.q, abs=1e-12)
    assert again.motion.u == pytest.approx(one.motion.u, abs=1e-10)
