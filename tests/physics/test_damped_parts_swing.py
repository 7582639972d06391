"""Damped flexible parts that swing: the mean-force method at the default tolerance against generalized-alpha at a tight one.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.model.compile.compile_case import compile_case
from fsm.model.plan.in_python import InPython
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from tests.physics.test_flexible_joints import beam, case, film, hinge
from tests.physics.test_frames_on_sheets import END, moving, tip

_SOFT = {"young": 3e9, "density": 1000.0, "viscosity": 1e-3}
_TIP = {"points": {"tip": {"body": "tip"}}, "channels": ["point.*"], "interval": 0.02}


def sheet() -> dict[str, Any]:
    """Folded sheet of flexible facets that swings by 60 degrees about an edge."""
    held = moving({"frames": [END]}, 1e-3)
    held["sheet"]["support"] = [{"at": "edge left", "fixed": ["x", "y", "z"]}]
    return held


def hanging(root: str, frame: dict[str, Any], **parts: Any) -> dict[str, Any]:
    """Part of 1 m that swings by 66 degrees about a hinge at its start."""
    joints, frames = [hinge("root", "ground", root, 0.0)], [{"name": "tip"} | frame]
    return case(joints, {"end_time": 0.4}, gravity=[0.0, 0.0, -9.81], frames=frames, save=_TIP, **parts)


def parts() -> dict[str, dict[str, Any]]:
    ends = {"start": [0.0, 0.0, 0.0], "end": [1.0, 0.0, 0.0]}
    cable = {"name": "cable", "diameter": 2e-3, "elements": 4} | ends | _SOFT
    return {
        "sheet": sheet(),
        "film": hanging("film.left", {"on": "film", "edge": "right"}, films=[film(mesh=[4, 1], thickness=1e-3, **_SOFT)]),
        "beam": hanging("beam.start", {"on": "beam", "at": [1.0]}, beams=[beam(elements=4, thickness=2e-3, **_SOFT)]),
        "cable": hanging("cable.start", {"on": "cable", "at": [1.0]}, cables=[cable]),
    }


@pytest.mark.parametrize("part", ["sheet", "film", "beam", "cable"])
def test_a_damped_part_swings_as_with_tight_tolerance(part: str, tmp_path: Path) -> None:
    """The tip within 0.3 % of its path, and the loss within 1e-3 of the energy of the motion (a tenth, and more than 2 %, if
    the dampers act at the Gauss points).
    """
    found = []
    for method, rtol in (("mean-force", 1e-6), ("generalized-alpha", 1e-7)):
        given = parts()[part]
        given["solve"] |= {"method": method, "rtol": rtol}
        found.append(fsm.load(given).run(tmp_path / method, figures=False))
    one, two = found
    path = float(np.abs(np.diff(two["point.tip.position"].values, axis=0)).sum())
    assert tip(one) == pytest.approx(tip(two), abs=3e-3 * path)
    energy = float(two.solution.energy["gravity"][0] - two.solution.energy["gravity"].min())
    lost, wanted = (float(result.solution.energy["dissipated"][-1]) for result in found)
    assert lost == pytest.approx(wanted, abs=1e-3 * energy)
    assert one.summary["energy_error"] < 1e-6


@pytest.mark.parametrize("part", ["sheet", "film"])
def test_steps_in_python_are_the_compiled_ones(part: str) -> None:
    ends = []
    for reasons in ((), ("a test",)):
        _, system = compile_case(fsm.load(parts()[part]).model)
        system.in_python = InPython(reasons)
        saved = list[SavedState]()
        simulate(system, Settings("mean-force", 1e-6, 0.002, step=2e-4), [0.002], saved.append)
        ends.append(np.concatenate([saved[-1].q, saved[-1].u]))
    assert ends[1] == pytest.approx(ends[0], abs=1e-9)
