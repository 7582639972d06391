"""Groups of springs that act in different steps become one group: forces, matrices and energies are their sum."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fsm.case.models.case import Case
from fsm.model.compile.compile_case import compile_case
from fsm.model.elements.elements import BushingGroup
from fsm.model.system.merge import merged

SPLINE = {"law": "spline", "angle": [0.0, 1.0, 2.0], "moment": [0.0, 5e-3, 8e-3], "interpolation": "pchip"}


def released(crease: dict[str, Any], spatial: bool) -> Case:
    """Strip whose driven crease line is released in the second step, so that its half joints act from then on."""
    strip = {
        "length": 0.24, "width": 0.04, "thickness": 3e-4, "panels": 4, "fold_angle": "50 deg", "segments_per_panel": 4,
    }  # fmt: skip
    drive = {"crease": 2, "direction": [0, 0, 1], "speed": 2e-3, "travel": 0.01}
    pull = {"name": "pull", "kind": "static", "drive": [drive]}
    free = {"name": "free", "kind": "dynamic", "release": ["all"], "duration": "10 ms"}
    return Case.model_validate({
        "strip": strip, "material": {"young": 3e9, "density": 800, "damping": "1 ms"}, "crease": crease,
        "step": [pull, free], "solve": {"spatial": spatial},
    })  # fmt: skip


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("crease", [{"law": "linear", "stiffness": 9e-3}, SPLINE], ids=["linear", "spline"])
def test_the_springs_of_a_released_strip_are_one_group(crease: dict[str, Any], spatial: bool) -> None:
    _, system = compile_case(released(crease, spatial))
    assert sum(isinstance(group, BushingGroup) for group in system.groups) > 1
    one = system.variant(system.bodies, system.motions, merged(system.groups))
    assert sum(isinstance(group, BushingGroup) for group in one.groups) == 1
    q, u = system.initial()
    rng = np.random.default_rng(3)
    q = system.retract(q, 0.02 * rng.standard_normal(system.nu) * system.scales().increment)
    u = rng.standard_normal(system.nu) * system.scales().increment
    ours, theirs = one.linearise(0.1, q, u), system.linearise(0.1, q, u)
    for name in ("stiffness", "damping"):
        a, b = (getattr(each, name).bsr().toarray() for each in (ours, theirs))
        assert np.abs(a - b).max() <= 1e-12 * np.abs(b).max()
    assert np.abs(one.force(0.1, q, u) - theirs.force).max() <= 1e-12 * np.abs(theirs.force).max()
    stored = [each.observe(0.1, q, u).energy for each in (one, system)]
    for pick in (lambda e: e.potential, lambda e: e.dissipated_power):
        assert pick(stored[0]) == pytest.approx(pick(stored[1]), rel=1e-12)
