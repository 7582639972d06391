"""Whether openings of joints and couplings can depend on each other."""

from __future__ import annotations

from typing import Any

import pytest

import fsm
from fsm.model.compile.compile_case import compile_case
from fsm.model.elements.locked_inertia import have_loops
from tests.physics.test_ideal_joints import body, joint, mechanism

_CHAIN = [("ground", "a"), ("a", "b"), ("b", "c")]
_GEARS = [("j0", "j1"), ("j1", "j2")]
_MOTOR = {"angle": 0.1, "time": {"kind": "ramp", "end": 1.0}}


@pytest.mark.parametrize(
    ("pairs", "gears", "motors", "loops"),
    [
        (_CHAIN, [], [], False),
        ([*_CHAIN, ("c", "ground")], [], [], True),
        ([*_CHAIN, ("a", "b")], [], [], True),
        (_CHAIN, _GEARS, [0], False),
        (_CHAIN, [*_GEARS, ("j0", "j2")], [], True),
        (_CHAIN, _GEARS, [0, 2], True),
    ],
)
def test_loops(pairs: list[tuple[str, str]], gears: list[tuple[str, str]], motors: list[int], loops: bool) -> None:
    bodies = [body(name, [k, 0, 0], [0.1] * 3) for k, name in enumerate("abc")]
    joints: list[dict[str, Any]] = []
    for k, (first, second) in enumerate(pairs):
        keys = {"motor": _MOTOR} if k in motors else {}
        joints.append(joint(f"j{k}", "revolute", first, second, [k - 0.5, 0, 0], axis=[0, 0, 1]) | keys)
    couplings = [
        {"name": f"g{k}", "kind": "gear", "joints": list(pair), "parameters": {"ratio": 1.0}} for k, pair in enumerate(gears)
    ]  # fmt: skip
    case = mechanism(bodies, joints, 1.0, 0.1, **({"couplings": couplings} if couplings else {}))
    _, system = compile_case(fsm.load(case).model)
    assert have_loops(system.locking, system.compiled_pattern([]).dof) == loops
