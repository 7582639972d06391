"""LSODA with its band: the reordered solver gives what the dense one gives, in the caller's order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import LSODA

from fsm.scene.builders.scene import build_scene
from fsm.scene.case import Case
from fsm.segments.compile import compile_scene
from fsm.segments.system import SegmentSystem
from fsm.solve.scipy_ivp import FirstOrder, _ReorderedLSODA, make_solver

END = 0.05


def strip(contact: bool, spatial: bool = False) -> SegmentSystem:
    data = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": 1.4,
            "segments_per_panel": 10 if spatial else 6,
        },
        "material": {"young": 3e9, "density": 800.0, "damping": 1e-2},
        "crease": {"law": "linear", "stiffness": 9e-3},
        "drive": [{"crease": 3, "speed": 0.02, "travel": 0.02}],
    }  # fmt: skip
    if contact:
        data["contact"] = {"stiffness": 1e9}
    return compile_scene(build_scene(Case.model_validate(data)), spatial)


@pytest.mark.parametrize("spatial", [False, True])
def test_band_gives_what_the_dense_matrix_gives(spatial: bool) -> None:
    equations = FirstOrder(strip(False, spatial))
    end = END / 10 if spatial else END
    banded = make_solver("LSODA", equations, 0.0, equations.initial(), end, 1e-7, np.inf)
    assert isinstance(banded, _ReorderedLSODA)
    dense = LSODA(
        equations.rate, 0.0, equations.initial(), end, rtol=1e-7, atol=equations.absolute_tolerance(1e-7),
        first_step=1e-6 * end, jac=lambda t, y: equations.jacobian(t, y).toarray(),
    )  # fmt: skip
    for solver in (banded, dense):
        while solver.status == "running":
            assert solver.step() is None
    scale = equations.system.scales()
    size = np.concatenate([scale.configuration, scale.velocity])
    assert np.abs((banded.state() - dense.y) / size).max() < 1e-5
    np.testing.assert_array_equal(banded.interpolant()(banded.t), banded.state())
    assert np.abs(equations.split(banded.state())[1]).max() > 1e-6  # it moved


def test_no_band_where_panels_can_meet() -> None:
    equations = FirstOrder(strip(True))
    assert not isinstance(make_solver("LSODA", equations, 0.0, equations.initial(), END, 1e-6, np.inf), _ReorderedLSODA)
