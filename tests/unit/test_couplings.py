"""Elements on the twists of several joints: gears, and kinds of extensions."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

import fsm
from fsm.case.loading.load_case import LoadedCase
from fsm.case.models.case import Case
from fsm.case.models.coupling import OWN_COUPLINGS
from fsm.case.models.scene import Scene
from fsm.errors import CaseError
from fsm.model.bodies.group import BlockSums, BodyState, PreviousPoses, body_pattern
from fsm.model.compile import compile_couplings
from fsm.model.compile.compile import compile_scene
from fsm.model.elements.couplings import CouplingGroup
from fsm.run.run_case import run_case
from fsm.solve.equations.linear import LinearSolver

RATIO, STIFFNESS, DAMPING = -2.5, 3.0, 0.02
FIRST, SECOND = 2e-3, 5e-3
"""Moments of inertia of both wheels about their axes, kg m^2."""


def wheels(spatial: bool, method: str = "generalized-alpha", **more: Any) -> dict[str, Any]:
    """Two wheels on a free carrier (or on the ground), geared with each other."""
    carrier = more.pop("carrier", "ground")
    turn = {"rotation": [80.0, 0.1, 90.0], "translation": [1e4] * 3} | more.pop("turn", {})
    bodies = [
        {"name": "first", "mass": 1.0, "inertia": [FIRST, FIRST, FIRST], "angular_velocity": [0.0, 2.0, 0.0]},
        {"name": "second", "mass": 1.0, "inertia": [SECOND] * 3, "position": [0.2, 0.0, 0.1]},
    ]
    if carrier != "ground":
        bodies.append({"name": carrier, "mass": 1.0, "inertia": [FIRST] * 3, "position": [0.1, 0.0, -0.1]})
    elements = [
        {"name": f"hinge of {name}", "inner": name, "outer": carrier, "point_outer": place} | turn
        for name, place in (("first", [0.0, 0.0, 0.0]), ("second", [0.2, 0.0, 0.1]))
    ]
    gear = {
        "name": "teeth", "kind": "gear", "joints": [element["name"] for element in elements],
        "parameters": {"ratio": RATIO, "stiffness": STIFFNESS, "damping": DAMPING},
    } | more.pop("gear", {})  # fmt: skip
    solve = {"method": method, "end_time": 0.1, "spatial": spatial} | more.pop("solve", {})
    return {"scene": {"bodies": bodies, "elements": elements, "couplings": [gear]}, "solve": solve} | more


@pytest.mark.parametrize("past", [False, True], ids=["in motion", "along a path"])
@pytest.mark.parametrize("sort", ["plane", "space", "joints", "ideal"])
def test_force_energy_and_tangent_agree(sort: str, past: bool) -> None:
    """Forces are the gradient of the energy without dampers, and K and D the derivatives of all forces."""
    given, spatial = wheels(sort != "plane", carrier="carrier")["scene"], sort != "plane"
    if sort in ("joints", "ideal"):
        given |= {"joints": ideal_joints(), "elements": []}
        given["couplings"][0] |= {"kind": "rack", "joints": ["rail", "pin"]}
        given["couplings"][0]["parameters"] |= {"backlash": 1e-3}
    if sort == "ideal":
        given["couplings"][0]["parameters"] = {"ratio": RATIO}
    scene = Scene.model_validate(given)
    system = compile_scene(scene, spatial)
    (group,) = [group for group in system.groups if isinstance(group, CouplingGroup)]
    if group.locks:
        group.lock(STIFFNESS / group.masses[0] / 1e4)  # type: ignore[attr-defined]
    rng, size = np.random.default_rng(3), 6 if spatial else 3
    q, u = system.initial()
    q = system.retract(q, 0.4 * rng.normal(size=system.nu))
    u = 3.0 * rng.normal(size=len(u))
    before = PreviousPoses(system.place(0.0, system.retract(q, 0.2 * rng.normal(size=system.nu)), None)[0].copy(), 0.3)
    since = before if past else None
    dof = np.arange(-1, len(scene.bodies))  # the ground is the first body
    pattern = body_pattern(dof, [group.pairs(system.bodies.pose)[0]], size)

    def force(x: np.ndarray, v: np.ndarray) -> np.ndarray:
        poses, rates = system.place(0.0, system.retract(q, x), v)
        out = np.zeros(rates.shape)
        group.add_force(BodyState(0.0, poses, rates, since), out)
        return out[system.bodies.free].ravel()

    def energy(x: np.ndarray) -> float:
        poses, rates = system.place(0.0, system.retract(q, x), None)
        return group.energy(BodyState(0.0, poses, rates))[0]["panels"]

    zero, step = np.zeros(system.nu), 1e-6
    poses, rates = system.place(0.0, q, u)
    out, stiffness, damping = np.zeros(rates.shape), pattern.zeros(), pattern.zeros()
    group.add_linearised(BodyState(0.0, poses, rates, since), BlockSums(pattern, out, stiffness, damping))
    np.testing.assert_array_equal(out[system.bodies.free].ravel(), force(zero, u))
    scale = np.abs(out).max()
    still = np.zeros(len(u))
    for k, row in enumerate(np.eye(system.nu)):
        x = step * row
        if not past and sort != "ideal":
            slope = (energy(x) - energy(-x)) / (2.0 * step)
            assert force(zero, still)[k] == pytest.approx(-slope, rel=1e-6, abs=1e-7 * scale)
        column = -(force(x, u) - force(-x, u)) / (2.0 * step)
        matrix = dense(pattern, stiffness + (damping / before.duration if past else 0.0))
        np.testing.assert_allclose(matrix[:, k], column, atol=3e-7 * scale)
        if not past:
            column = -(force(zero, u + x) - force(zero, u - x)) / (2.0 * step)
            np.testing.assert_allclose(dense(pattern, damping)[:, k], column, atol=1e-7 * scale)
    _, lost, _ = group.energy(BodyState(0.0, poses, rates, since))
    _, efforts = group.states(0.0, poses, rates)
    assert np.abs(efforts).max() > 0.1 and (lost > 0.0) == (sort != "ideal")


def ideal_joints() -> list[dict[str, Any]]:
    common = {"first": "carrier", "axis": [0.3, 1.0, 0.2]}
    return [
        {"name": "rail", "kind": "prismatic", "second": "first", "at": [0.0, 0.1, 0.0]} | common,
        {"name": "pin", "kind": "revolute", "second": "second", "at": [0.2, 0.0, 0.1]} | common,
    ]


def dense(pattern: Any, data: np.ndarray) -> np.ndarray:
    size = data.shape[1]
    out = np.zeros((size * pattern.order,) * 2)
    for row, column, block in zip(pattern.rows, pattern.indices, data, strict=True):
        out[size * row : size * (row + 1), size * column : size * (column + 1)] = block
    return out


@pytest.mark.parametrize("spatial", [False, True], ids=["plane", "space"])
def test_geared_wheels_swing_as_the_closed_form(spatial: bool, tmp_path: Path) -> None:
    """The slip s = phi_1 - n phi_2 is a damped oscillation with the effective inertia 1/(1/J_1 + n^2/J_2); the momentum
    n J_1 phi_1' + J_2 phi_2' is constant. Steps are compiled."""
    more = {"save": {"interval": "5 ms", "channels": ["coupling.*", "energy.*"]}, "solve": {"rtol": 1e-9}}
    case = Case.model_validate(wheels(spatial, turn={"rotation": [80.0, 0.0, 90.0]}, **more))
    system = compile_scene(case.scene, spatial)
    assert system.arrays(LinearSolver().ready) is not None
    summary = run_case(LoadedCase(case, "", tmp_path / "case.toml"), tmp_path / "out", progress=False, figures=False)
    assert summary["steps_compiled"] and summary["energy_error"] < 1e-5
    solution = fsm.read_solution(tmp_path / "out" / "result.h5")
    effective = 1.0 / (1.0 / FIRST + RATIO**2 / SECOND)
    decay = 0.5 * DAMPING / effective
    omega = math.sqrt(STIFFNESS / effective - decay**2)
    t = solution.time
    slip = 2.0 / omega * np.exp(-decay * t) * np.sin(omega * t)
    angle = solution.channels["coupling.teeth.angle"].values
    np.testing.assert_allclose(angle[:, 0] - RATIO * angle[:, 1], slip, atol=1e-4 * np.abs(slip).max())
    np.testing.assert_allclose(RATIO * FIRST * angle[:, 0] + SECOND * angle[:, 1], RATIO * FIRST * 2.0 * t, atol=1e-6)
    moment = solution.channels["coupling.teeth.moment"].values
    np.testing.assert_allclose(moment[:, 1], -RATIO * moment[:, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"kind": "gears"}, "'gear'"),
        ({"joints": ["hinge of first"]}, "1 joints; a coupling of kind 'gear' has 2"),
        ({"joints": ["hinge of first", "hinge of secnd"]}, "no element is called 'hinge of secnd'"),
        ({"parameters": {"ratio": 2.0, "stiffness": -1.0}}, "stiffness"),
    ],
)
def test_wrong_couplings_are_refused(change: dict[str, Any], text: str) -> None:
    with pytest.raises((ValidationError, CaseError), match=text):
        compile_scene(Case.model_validate(wheels(False, gear=change)).scene)


def test_kinds_of_the_package_have_kernels() -> None:
    """A kind is its kernel, its keys in `OWN_COUPLINGS`, and a line that joins both."""
    assert OWN_COUPLINGS.keys() == compile_couplings.OWN.keys()
    assert all(compile_couplings.OWN[name].joints == kind.law for name, kind in OWN_COUPLINGS.items())
