"""The pulled strip with three and with six degrees of freedom a segment: its crease line guided, it stays in the plane."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fsm.builders.scene import build_scene
from fsm.case.models.case import Case, Strip
from fsm.case.models.contact import Contact, Friction
from fsm.case.models.loads import Drive
from fsm.case.models.materials import LinearCrease, Material
from fsm.model.compile.compile import compile_scene
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

TRAVEL = 8e-3


def pulled(spatial: bool) -> list[SavedState]:
    """41 states up to 8 mm; panels 3 and 4 touch from 5 mm on."""
    case = Case(
        strip=Strip(length=0.48, width=0.04, thickness=3e-4, panels=6, fold_angle=math.radians(80.0), segments_per_panel=4),
        material=Material(young=3e9, density=800, damping=1e-2),
        crease=LinearCrease(stiffness=9e-3),
        contact=Contact(stiffness=1e8, damping=10.0, ramp=1e-5),
        friction=Friction(law="step", mu_static=0.3, mu_dynamic=0.2, v_static=1e-3, v_dynamic=5e-3),
        drive=(Drive(crease=3, speed=0.01, travel=TRAVEL),),
    )
    system = compile_scene(build_scene(case), spatial)
    assert system.spatial == spatial
    motion = system.motions[0]
    saved: list[SavedState] = []
    times = [motion.time_of(x) for x in np.linspace(0.0, TRAVEL, 41)]
    simulate(system, Settings("Radau", 1e-8, motion.end_time), times, saved.append)
    return saved


@pytest.mark.nightly
def test_spatial_force_curve_is_the_planar_one() -> None:
    planar, spatial = pulled(False), pulled(True)
    plane, space = (np.array([s.observation.drive.force[0] for s in run]) for run in (planar, spatial))
    assert space == pytest.approx(plane, abs=1e-6 * plane.max())
    pairs, pairs_in_space = (np.array([s.observation.pairs.force for s in run]) for run in (planar, spatial))
    # first contact is within the travel, not at the start
    assert pairs[0].max() < 1e-12
    assert pairs[-1].max() > 0.1
    assert pairs_in_space == pytest.approx(pairs, abs=1e-5 * pairs.max())
    # no body has left the plane
    out_of_plane = spatial[-1].q.reshape(-1, 7)[:, [1, 4, 6]]
    assert np.abs(out_of_plane).max() < 1e-10
