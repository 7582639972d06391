"""Equilibrium paths with critical points: Euler's column past buckling, a truss that snaps through and back."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fsm.scene.loads import Drive
from fsm.scene.scene import GROUND, Body, ForceElement, Scene
from fsm.segments.compile import compile_scene
from fsm.segments.system import SegmentSystem
from fsm.solve.arc_length import PathPoint, trace
from fsm.solve.simulate import Saved, Statistics
from fsm.solve.static import PathSettings, follow

# pinned column after buckling, inextensible: largest slope (deg): P/Pcr, shortening/L, deflection of the middle/L;
# elliptic functions, validation/references.md
ELASTICA = {
    20: (1.015396866, 0.030269093, 0.109706521),
    60: (1.151719620, 0.258980394, 0.296603823),
    90: (1.393203930, 0.543053419, 0.381379882),
}


# column -------------------------------------------------------------------------------------------------------


def column(count: int, spatial: bool = False) -> SegmentSystem:
    """Unit length and EI, pinned at both ends, compressed along x by a drive; as good as inextensible."""
    length = 1.0 / count
    stiff = 1e9
    names = [f"segment {k}" for k in range(count)]
    bodies = [
        Body(name=name, mass=length, inertia=(length**3 / 12,) * 3, position=((k + 0.5) * length, 0.0, 0.0))
        for k, name in enumerate(names)
    ]
    bodies.append(Body(name="end", mass=0.0, inertia=(0.0, 0.0, 0.0), position=(1.0, 0.0, 0.0)))
    half = (length / 2, 0.0, 0.0), (-length / 2, 0.0, 0.0)
    elements = [
        ForceElement(
            name=f"joint {k}", inner=names[k], outer=names[k + 1], point_inner=half[0], point_outer=half[1],
            translation=(stiff,) * 3, rotation=(1.0 / length, 1.0 / length, 4.0 / length), kind="panel",
        )
        for k in range(count - 1)
    ]  # fmt: skip
    pin = {"translation": (stiff,) * 3, "rotation": (1e3, 0.0, 1e3)}
    elements.append(ForceElement(name="pin", inner=GROUND, outer=names[0], point_outer=half[1], **pin))
    elements.append(ForceElement(name="pulled pin", inner="end", outer=names[-1], point_outer=half[0], **pin))
    drive = Drive(body="end", direction=(-1.0, 0.0, 0.0), speed=0.01, travel=0.55)
    return compile_scene(Scene(bodies=tuple(bodies), elements=tuple(elements), drives=(drive,)), spatial)


@cache
def buckled(count: int, spatial: bool = False, imperfection: float = 0.0) -> tuple[list[Saved], Statistics, SegmentSystem]:
    system = column(count, spatial)
    motion = system.motions[0]
    times = [motion.time_of(shortening) for _, shortening, _ in ELASTICA.values()]
    saved: list[Saved] = []
    settings = PathSettings(system.end_time() or 0.0, motion.time_of(2e-3), imperfection=imperfection)
    statistics, _ = follow(system, settings, times, saved.append)
    return saved, statistics, system


def deflection(system: SegmentSystem, saved: Saved) -> float:
    """Of the middle, m."""
    return float(saved.q.reshape(system.n_free, -1)[system.n_free // 2, 2 if system.spatial else 1])


@pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
def test_column_past_buckling(spatial: bool) -> None:
    saved, statistics, system = buckled(200 if not spatial else 100, spatial)
    tolerance = 1e-4 if not spatial else 4e-4  # errors fall as 1/N^2
    for state, (load, _, sideways) in zip(saved, ELASTICA.values(), strict=True):
        assert state.observation.drive.force[0] / np.pi**2 == pytest.approx(load, rel=tolerance)
        # the middle of the column is the end of the segment that holds it
        assert abs(deflection(system, state)) == pytest.approx(sideways, rel=tolerance)
    (event,) = statistics.events
    assert event.kind == "bifurcation"
    assert event.force / np.pi**2 == pytest.approx(1.0, rel=5e-3)
