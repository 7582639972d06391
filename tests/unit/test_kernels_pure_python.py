"""Compiled kernels compared with the same kernels executed by Python (NUMBA_DISABLE_JIT=1) in a separate process."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fsm.builders.strip import build_strip
from fsm.case.models.case import Case
from fsm.model.compile.compile import compile_scene
from tests.without_compiler import without_compiler


def evaluate(spatial: bool) -> dict[str, Any]:
    """State of a strip with all kinds of elements, which calls all kernels of its dimension."""
    data: dict[str, Any] = {
        "strip": {
            "length": 0.24, "width": 0.04, "thickness": 3e-4, "panels": 4, "fold_angle": "80 deg",
            "segments_per_panel": 2, "held": [1],
        },
        "material": {"young": 3e9, "density": 800},
        "crease": {"law": "spline", "angle": [0.0, 1.0, 2.0, 3.0], "moment": [0.0, 5e-3, 8e-3, 9e-3]},
        "contact": {"stiffness": 1e6, "damping": 3.0, "points_per_segment": 1},
        "friction": {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": 0.05, "v_dynamic": 0.2},
        "drive": [{"crease": 3, "speed": "2 mm/s", "travel": "40 mm"}],
    }  # fmt: skip
    system = compile_scene(build_strip(Case.model_validate(data)), spatial)
    rng = np.random.default_rng(3)
    q, _ = system.initial()
    move = 5e-3 * rng.normal(size=system.nu)
    middle = 3 * 0.06 * np.cos(np.radians(80))
    for row, body in enumerate(system.bodies.free):  # panels 3 and 4 upright, 2 mm into each other
        panel = int(system.bodies.names[body].split()[1])
        if panel in (3, 4):
            side = 1.0 if panel == 3 else -1.0
            move[row * system.size] = middle + side * 1e-3 - system.bodies.pose[body, 0]
            move[row * system.size + (2 if system.size == 3 else 4)] -= side * np.radians(10)
    q = system.retract(q, move)
    u = rng.normal(size=system.nu)
    seen = system.observe(1.0, q, u)
    stiffness, damping = system.tangent(1.0, q, u)
    jacobian = [matrix.toarray() for matrix in system.kinematic_jacobian(q, u)]
    return {
        "force": system.force(1.0, q, u),
        "stiffness": stiffness.toarray(),
        "damping": damping.toarray(),
        "energy": np.array([seen.energy.stored, seen.energy.dissipated_power, seen.energy.input_power]),
        "pairs": np.concatenate(list(vars(seen.pairs).values())),
        "reactions": system.reactions(1.0, q, u),
        "rates": system.kinematic_map(q, u),
        "jacobian": np.hstack([np.asarray(part) for part in jacobian]),
        "tangent map": system.tangent_map(q).toarray(),
    }


@pytest.fixture(scope="module")
def pure_python() -> list[dict[str, Any]]:
    both = "[module.evaluate(spatial) for spatial in (False, True)]"
    return without_compiler(__file__, "fsm.laws.crease.crease_moment", both)


@pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
def test_compiled_is_what_python_says(spatial: bool, pure_python: list[dict[str, Any]]) -> None:
    compiled, wanted = evaluate(spatial), pure_python[spatial]
    assert compiled.keys() == wanted.keys()
    force = wanted["pairs"].reshape(7, -1)[0]  # the first of a PairState
    assert force.max() > 0.1  # there is contact
    for name, array in compiled.items():
        size = np.abs(wanted[name]).max()
        np.testing.assert_allclose(array, wanted[name], rtol=1e-9, atol=1e-12 * size, err_msg=name)
