"""Words that people write in place of kinds of joints and couplings."""

from __future__ import annotations

from typing import Any

import pytest

import fsm
from fsm.errors import CaseError

_BODY = {"name": "a", "mass": 1.0, "inertia": [1.0, 1.0, 1.0]}
_JOINT = {"name": "j", "kind": "revolute", "first": "ground", "second": "a", "at": [0, 0, 0], "axis": [0, 0, 1]}
_CABLE = "a closed cable over pulleys of radii r1 and r2 is kind"


@pytest.mark.parametrize(
    ("kind", "remark"),
    [("hinge", '; write "revolute"'), ("Revolute", '; write "revolute"'), ("ball", '; write "spherical"'), ("bearing", "")],
)
def test_a_joint_under_another_name(kind: str, remark: str) -> None:
    scene = {"bodies": [_BODY], "joints": [_JOINT | {"kind": kind}]}
    with pytest.raises(CaseError) as error:
        fsm.load({"scene": scene, "solve": {"end_time": 1.0}})
    (fault,) = error.value.faults
    assert fault.path == "scene.joints.0.kind"
    assert fault.message.endswith(f'; it is "{kind}"{remark}')


@pytest.mark.parametrize(("kind", "remark"), [("cable", _CABLE), ("belt", _CABLE), ("spring", "")])
def test_a_coupling_under_another_name(kind: str, remark: str) -> None:
    """Parameters of an unknown kind are no second fault."""
    coupling: dict[str, Any] = {"name": "c", "kind": kind, "joints": ["j", "k"], "parameters": {"ratio": -1.0}}
    scene = {"bodies": [_BODY], "joints": [_JOINT, _JOINT | {"name": "k"}], "couplings": [coupling]}
    with pytest.raises(CaseError) as error:
        fsm.load({"scene": scene, "solve": {"end_time": 1.0}})
    (fault,) = error.value.faults
    assert fault.path == "scene.couplings.0.kind"
    assert remark in fault.message
    assert bool(remark) == (_CABLE in fault.message)
