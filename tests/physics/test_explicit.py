"""Explicit steps of order 8: against minimal coordinates, energies, and the choice of the method."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fsm
from fsm.builders.scene import build_scene
from fsm.case.derived.frame_bodies import matrix_quaternion
from fsm.errors import CaseError
from fsm.interactions.joint_tree import CHILD
from fsm.model.compile.compile_case import compile_case
from fsm.model.elements.joint_forces import JointForceGroup
from fsm.model.plan.in_python import InPython
from fsm.model.plan.joint_state import JointsAtStart
from fsm.model.plan.motion_method import MotionMethod
from fsm.model.plan.plan import plan_of
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

_G = 9.81


def panel(**actions: Any) -> dict[str, Any]:
    """A panel of 2 kg and 1 m on a hinge along y; its centre is 0.5 m from the hinge, along x."""
    body = {"name": "panel", "mass": 2.0, "inertia": [0.05, 0.17, 0.2], "position": [0.5, 0.0, 0.0]}
    hinge = {
        "name": "hinge", "kind": "revolute", "first": "ground", "second": "panel", "at": [0, 0, 0], "axis": [0, 1, 0],
        **actions,
    }  # fmt: skip
    return {
        "units": "SI", "gravity": [0.0, 0.0, -_G], "scene": {"bodies": [body], "joints": [hinge]},
        "solve": {"end_time": 3.0, "error_estimates": "off"}, "save": {"interval": 0.1, "channels": ["joint.*"]},
    }  # fmt: skip


@pytest.mark.parametrize(("rtol", "error"), [(1e-6, 3e-5), (1e-10, 1e-9)])
def test_a_panel_on_a_spring_with_a_damper(rtol: float, error: float, tmp_path: Path) -> None:
    """Angle from its equation; work, losses and energies close to the accuracy of the angle."""
    spring, damper, inertia = 12.0, 0.6, 0.17 + 2.0 * 0.25
    case = panel(spring={"stiffness": spring, "rest": 0.8}, damper={"coefficient": damper})
    case["solve"]["rtol"] = rtol
    result = fsm.load(case).run(tmp_path)
    summary = result.summary
    assert summary["method"] == "explicit"
    assert summary["steps_compiled"]

    def rate(t: float, y: np.ndarray) -> list[float]:  # a positive angle about y moves the centre down
        moment = -spring * (y[0] - 0.8) - damper * y[1] + 2.0 * _G * 0.5 * math.cos(y[0])
        return [y[1], moment / inertia]

    exact = solve_ivp(rate, (0.0, 3.0), [0.0, 0.0], "DOP853", result.time, rtol=1e-12, atol=1e-13).y
    assert np.asarray(result["joint.hinge.angle"].values).ravel() == pytest.approx(exact[0], abs=error)
    assert np.asarray(result["joint.hinge.rate"].values).ravel() == pytest.approx(exact[1], abs=10.0 * error)
    assert summary["energy_error"] < error
    lost = damper * np.trapezoid(
        solve_ivp(rate, (0.0, 3.0), [0.0, 0.0], "DOP853", np.linspace(0, 3, 3001), rtol=1e-11, atol=1e-12).y[1] ** 2,
        dx=1e-3,
    )
    assert float(result["energy.dissipated"].values[-1]) == pytest.approx(lost, rel=1e-5)


def test_the_work_of_a_motor_is_energy(tmp_path: Path) -> None:
    """A motor lifts the panel with a ramp that has kinks in its rate; its work is the gain of energy."""
    case = panel(motor={"angle": -1.2, "time": {"kind": "ramp", "end": 2.0}})
    summary = fsm.load(case).run(tmp_path).summary
    assert summary["method"] == "explicit"
    assert summary["energy_error"] < 1e-9


def test_a_free_body_turns_by_eulers_equations(tmp_path: Path) -> None:
    """The middle axis of inertia is unstable: the body turns over."""
    moments, spin = np.array([0.1, 0.2, 0.25]), [0.01, 6.0, 0.02]
    body = {"name": "body", "mass": 1.0, "inertia": moments.tolist(), "angular_velocity": spin}
    case = {
        "units": "SI", "scene": {"bodies": [body]}, "save": {"interval": 0.2, "channels": ["body.*"]},
        "solve": {"method": "explicit", "end_time": 4.0, "rtol": 1e-10, "error_estimates": "off"},
    }  # fmt: skip
    result = fsm.load(case).run(tmp_path)
    exact = solve_ivp(
        lambda t, w: np.cross(moments * w, w) / moments, (0.0, 4.0), spin, "DOP853", result.time, rtol=1e-12, atol=1e-12
    ).y.T
    assert exact[:, 1].min() < -5.0
    found = np.asarray(result["body.body.angular_velocity"].values)
    turned = np.asarray(result["body.body.orientation"].values)
    assert np.linalg.norm(turned, axis=1) == pytest.approx(1.0, abs=1e-12)
    # in axes of the body
    inverse = turned * [1.0, -1.0, -1.0, -1.0]
    w, v = inverse[:, :1], inverse[:, 1:]
    own = found + 2.0 * np.cross(v, np.cross(v, found) + w * found)
    assert own == pytest.approx(exact, abs=1e-7)


def ends(case: dict[str, Any], rtol: float, duration: float) -> list[np.ndarray]:
    """State (q, u) at the end by compiled steps, and by steps in Python, which project all bodies."""
    found = []
    for reasons in ((), ("a test",)):
        _, system = compile_case(fsm.load(case).model)
        system.in_python = InPython(reasons)
        saved: list[SavedState] = []
        simulate(system, Settings("explicit", rtol, duration), [duration], saved.append)
        found.append(np.concatenate([saved[-1].q, saved[-1].u]))
    return found


@pytest.mark.parametrize("limit", [{}, {"stop": {"upper": 0.3, "stiffness": 4e3, "damping": 4.0}}])
def test_explicit_steps_in_python_are_the_compiled_ones(limit: dict[str, Any]) -> None:
    """With a second hinge, which repeats the first one, the joints form a loop; with a stop, steps end at events."""
    case = panel(spring={"stiffness": 12.0}, damper={"coefficient": 0.6}, **limit)
    case["scene"]["joints"].append(
        {"name": "other", "kind": "revolute", "first": "panel", "second": "ground", "at": [0, 0.3, 0], "axis": [0, 1, 0]}
    )
    compiled, in_python = ends(case, 1e-8, 0.5)
    assert compiled == pytest.approx(in_python, abs=1e-13)


_KINDS = "revolute", "prismatic", "cylindrical", "spherical", "universal", "planar", "in-line", "in-plane", "fixed"


@pytest.mark.parametrize("seed", range(6))
def test_coordinates_of_joints_give_the_motion_of_projected_bodies(seed: int) -> None:
    """Random trees of all kinds of joints, in both orders of their bodies, with branches and a body without a joint."""
    random = np.random.default_rng(seed)
    bodies, joints = [], []
    for k in range(5):
        turn = random.normal(size=4)
        bodies.append({
            "name": f"b{k}", "mass": float(random.uniform(0.5, 2.0)), "inertia": random.uniform(0.2, 0.3, 3).tolist(),
            "position": random.normal(size=3).tolist(), "orientation": (turn / np.linalg.norm(turn)).tolist(),
            "velocity": random.normal(size=3).tolist(), "angular_velocity": random.normal(size=3).tolist(),
        })  # fmt: skip
        if k == 2:
            continue
        kind, ends_of = _KINDS[random.integers(len(_KINDS))], [f"b{random.integers(k)}" if k else "ground", f"b{k}"]
        at, axis = random.normal(size=3), random.normal(size=3)
        if random.random() < 0.5:
            ends_of.reverse()
        joint = {"name": f"j{k}", "kind": kind, "first": ends_of[0], "second": ends_of[1], "at": at.tolist()}
        joint |= {"axis": axis.tolist()} if kind not in ("fixed", "spherical") else {}
        joint |= {"second_axis": np.cross(axis, random.normal(size=3)).tolist()} if kind == "universal" else {}
        joint |= {"to": at.tolist()} if kind in ("in-line", "in-plane") else {}
        joints.append(joint)
    scene = {"bodies": bodies, "joints": joints}
    case = {"units": "SI", "gravity": [0.0, 0.0, -_G], "scene": scene, "solve": {"end_time": 1.0, "method": "explicit"}}
    _, system = compile_case(fsm.load(case).model)
    assert np.all(system.tree.links[:, CHILD] >= 0)
    compiled, in_python = ends(case, 1e-11, 0.4)
    assert compiled == pytest.approx(in_python, abs=1e-8)


def save_with_memory(
    system: Any, saved: list[SavedState], memories: list[np.ndarray], latched: list[bool], state: SavedState
) -> None:
    """Keep a state, the memory of the system there, and whether the latch of the hinge is closed."""
    saved.append(state)
    if state.memory is not None:
        system.restore(state.memory)
    memories.append(system.memory())
    laws = next(group for group in system.groups if isinstance(group, JointForceGroup))
    latched.append(laws.latched("joint.hinge"))


def test_states_that_a_kernel_passes_are_those_at_which_it_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Many saved states of one call of a kernel, and one call for each: same states, energies, and memory of a latch."""
    latch = {"at": 0.5, "stiffness": 4e3, "damping": 4.0}
    case = panel(spring={"stiffness": 12.0}, damper={"coefficient": 0.6}, latch=latch)
    found = []
    for batched in (True, False):
        _, system = compile_case(fsm.load(case).model)
        if not batched:
            monkeypatch.setattr(system, "memory_in_place", lambda: None)
        saved, latched, memories = list[SavedState](), list[bool](), list[np.ndarray]()
        statistics, balance = simulate(
            system, Settings("explicit", 1e-6, 1.0), np.linspace(0.0, 1.0, 41).tolist(),
            partial(save_with_memory, system, saved, memories, latched),
        )  # fmt: skip
        assert [state.memory is None for state in saved] == [True] + [not batched] * 40
        numbers = [[s.time, *s.q, *s.u, s.dissipated, s.work] for s in saved]
        energies = [[s.observation.energy.stored, s.observation.energy.kinetic, s.error] for s in saved]
        points = [point.time for point in statistics.points]
        found.append((numbers, energies, points, latched, memories, system.memory(), balance.worst))
    many, single = found
    assert np.array(many[0]) == pytest.approx(np.array(single[0]), rel=1e-15, abs=1e-15)  # quaternions are normalised again
    assert np.array(many[1]) == pytest.approx(np.array(single[1]), abs=1e-12)
    assert (many[2], many[6]) == (single[2], single[6])
    assert many[3] == single[3]
    assert many[3].count(True) not in (0, 41)
    np.testing.assert_array_equal(many[4], single[4])
    np.testing.assert_array_equal(many[5], single[5])


# loose tolerances -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_a_loose_tolerance_resolves_a_fast_top(seed: int) -> None:
    """Random symmetric tops, by Euler's equations: the tolerance of their fast turn also bounds their slow precession."""
    random = np.random.default_rng(seed)
    mass, arm, spin = random.uniform(1.0, 20.0), random.uniform(0.2, 1.0), random.uniform(60.0, 300.0)
    across = mass * arm**2 * random.uniform(0.01, 0.3)
    about = across * random.uniform(0.3, 1.9)
    tilt, end = random.uniform(0.3, 1.5), 1.0
    moments = np.array([across + mass * arm**2, across + mass * arm**2, about])
    turn = np.array([math.cos(0.5 * tilt), math.sin(0.5 * tilt), 0.0, 0.0])
    centre = arm * np.array([0.0, -math.sin(tilt), math.cos(tilt)])
    case = {
        "units": "SI", "gravity": [0.0, 0.0, -_G], "solve": {"end_time": end, "method": "explicit"},
        "scene": {
            "bodies": [{
                "name": "top", "mass": mass, "inertia": [across, across, about], "position": centre.tolist(),
                "orientation": turn.tolist(), "angular_velocity": [0.0, 0.0, spin],
            }],
            "joints": [{"name": "foot", "kind": "spherical", "first": "ground", "second": "top", "at": [0, 0, 0]}],
        },
    }  # fmt: skip

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        (w, v), omega = (y[0], y[1:4]), y[4:]
        up = np.array([2 * (v[0] * v[2] - w * v[1]), 2 * (v[1] * v[2] + w * v[0]), 1 - 2 * (v[0] ** 2 + v[1] ** 2)])
        moment = np.cross([0.0, 0.0, arm], -_G * mass * up)
        turned = 0.5 * np.array([-v @ omega, *(w * omega + np.cross(v, omega))])
        return np.concatenate([turned, (moment - np.cross(omega, moments * omega)) / moments])

    w, *v = solve_ivp(rate, (0.0, end), [*turn, 0.0, 0.0, spin], "DOP853", rtol=1e-11, atol=1e-12).y[:4, -1]
    exact = arm * np.array([2 * (v[0] * v[2] + w * v[1]), 2 * (v[1] * v[2] - w * v[0]), 1 - 2 * (v[0] ** 2 + v[1] ** 2)])
    assert np.linalg.norm(exact - centre) > 0.1 * arm
    assert np.abs(at_end(case, 1e-2, end)[:3] - exact).max() < 5e-4 * arm
    assert np.abs(at_end(case, 1e-9, end)[:3] - exact).max() < 1e-6 * arm


@pytest.mark.parametrize("seed", range(4))
def test_a_loose_tolerance_resolves_a_fast_gyroscope(seed: int) -> None:
    """A rotor on a hinge in a frame on a universal joint, of random sizes; the reference has a tight tolerance."""
    random = np.random.default_rng(seed)
    spin, across, about = random.uniform(100.0, 300.0), *random.uniform(5e-3, 2e-2, 2)
    axis = random.normal(size=3)
    axis /= np.linalg.norm(axis)
    offset = (0.1 * axis).tolist()
    shaft = {"name": "shaft", "kind": "revolute", "first": "frame", "second": "rotor", "at": offset, "axis": axis.tolist()}
    other = np.cross(axis, random.normal(size=3))
    normal = other / np.linalg.norm(other)
    turn = matrix_quaternion(np.column_stack([np.cross(normal, axis), normal, axis]))
    case = {
        "units": "SI", "gravity": [0.0, 0.0, -_G], "solve": {"end_time": 1.0, "method": "explicit"},
        "scene": {
            "bodies": [
                {"name": "frame", "mass": 0.5, "inertia": [4e-3, 4e-3, 4e-3], "position": [0.0, 0.0, 0.0]},
                {"name": "rotor", "mass": 2.0, "inertia": [across, across, about], "position": offset,
                 "orientation": list(turn), "angular_velocity": [0.0, 0.0, spin]},
            ],
            "joints": [
                {"name": "gimbal", "kind": "universal", "first": "ground", "second": "frame", "at": [0, 0, 0],
                 "axis": normal.tolist(), "second_axis": np.cross(normal, axis).tolist()},
                shaft,
            ],
        },
    }  # fmt: skip
    loose, exact = (at_end(case, rtol, 0.5)[7:10] for rtol in (1e-2, 1e-10))
    assert np.linalg.norm(exact - offset) > 5e-3
    assert loose == pytest.approx(exact, abs=1e-4 * 0.1)


def at_end(case: dict[str, Any], rtol: float, end: float) -> np.ndarray:
    """Configuration at the end of explicit steps."""
    _, system = compile_case(fsm.load(case).model)
    saved: list[SavedState] = []
    simulate(system, Settings("explicit", rtol, end), [end], saved.append)
    return saved[-1].q


# choice -----------------------------------------------------------------------------------------------------------------


def chosen(case: dict[str, Any]) -> tuple[float, str, str]:
    """Largest rate of springs and dampers, the method of "auto", and its reason."""
    model = fsm.load(case).model
    scene = build_scene(model)
    step = plan_of(model, scene).steps[-1]
    return MotionMethod(JointsAtStart(scene)).fastest, step.method, step.reason


@pytest.mark.parametrize(
    ("actions", "rate"),
    [
        ({"spring": {"stiffness": 67.0}}, 10.0),
        ({"damper": {"coefficient": 6.7}}, 10.0),
        ({"stop": {"upper": 1.0, "stiffness": 6.7e5}}, 1e3),
    ],
)
def test_the_rate_of_springs_is_that_of_the_mechanism(actions: dict[str, Any], rate: float) -> None:
    """sqrt(k/I) and c/I with the moment of inertia of all that turns about the hinge."""
    found, method, reason = chosen(panel(**actions))
    assert found == pytest.approx(rate)
    assert method == "explicit"
    assert f"{rate:.2g}/s" in reason


@pytest.mark.parametrize(
    ("damper", "end", "method"),
    [(2e4, 3.0, "explicit"), (2e4, 60.0, "explicit"), (2e5, 0.3, "explicit"), (2e5, 30.0, "generalized-alpha")],
)
def test_the_cost_decides(damper: float, end: float, method: str) -> None:
    """Rates of 3e4/s and 3e5/s beside weights with 4/s: the latter needs 5e4 explicit steps each second, generalized-alpha
    2e3, but a run of .3 s is cheap with both."""
    case = panel(damper={"coefficient": damper})
    case["solve"]["end_time"] = end
    rate, found, reason = chosen(case)
    assert rate == pytest.approx(damper / 0.67)
    assert found == method
    assert reason.startswith("there is no drive, so the motion is free; springs and dampers of up to ")


def test_a_slow_motion_with_fast_dampers_is_for_implicit_steps() -> None:
    """Without weight, a hinge that a motor opens in 200 s needs few steps of generalized-alpha."""
    case = panel(damper={"coefficient": 3e3}, motor={"torque": 10.0})
    case["solve"]["end_time"] = 200.0
    fast = chosen(case)
    case["gravity"] = [0.0, 0.0, 0.0]
    assert (fast[1], chosen(case)[1]) == ("explicit", "explicit")
    case["scene"]["joints"][0]["motor"] = {"torque": 1e-2}
    assert chosen(case)[1] == "generalized-alpha"


def test_held_bodies_have_no_inertia_in_the_choice() -> None:
    """A held body without mass carries a hinge with a stiff stop."""
    case = panel(stop={"upper": 1.0, "stiffness": 1e12})
    base = {"name": "base", "mass": 0.0, "inertia": [0.0, 0.0, 0.0], "held": True, "position": [0.0, 0.0, -1.0]}
    case["scene"]["bodies"].append(base)
    case["scene"]["joints"][0]["first"] = "base"
    assert chosen(case)[1] == "generalized-alpha"


def test_contact_is_not_for_explicit_steps() -> None:
    plate = {"length": 0.1, "width": 0.1, "thickness": 0.01}
    bodies = [
        {"name": name, "mass": 1.0, "inertia": [1.0, 1.0, 1.0], "plate": plate, "position": [0, 0, 0.1 * k]}
        for k, name in enumerate(("a", "b"))
    ]
    case = {
        "units": "SI", "scene": {"bodies": bodies}, "contact": {"law": "hertz", "stiffness": 1e6},
        "solve": {"method": "explicit", "end_time": 1.0},
    }  # fmt: skip
    with pytest.raises(CaseError, match='"explicit" is for bodies, joints and springs; the scene has contact'):
        fsm.load(case).run()


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="without the compiler there are no types")
def test_kernels_of_bodies_without_joints_do_not_serve_joints() -> None:
    """Without joints, kernels of minimal coordinates return constants; a march compiled with them has no other results."""
    body = {"name": "top", "mass": 2.0, "inertia": [0.1, 0.2, 0.3], "position": [0.0, -0.3, 0.4]}
    foot = {"name": "foot", "kind": "spherical", "first": "ground", "second": "top", "at": [0, 0, 0]}
    case = {"units": "SI", "gravity": [0.0, 0.0, -_G], "solve": {"end_time": 1.0, "method": "explicit"}}
    models = []
    for joints in ([], [foot]):
        _, system = compile_case(fsm.load(case | {"scene": {"bodies": [body], "joints": joints}}).model)
        models.append(system.arrays(LinearSolver().ready))
    free, held = (model.calls[0] for model in models)
    assert free is not held
    assert numba.typeof(models[0]) is not numba.typeof(models[1])
