"""Equilibrium paths with critical points: the buckled column of Euler, and a truss that snaps through and back."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fsm.case.models.loads import Drive
from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.errors import NotConverged
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.equations.newton import negative_pivots
from fsm.solve.outcome.run_io import CurvePoint, SavedState, Statistics
from fsm.solve.settings import PathSettings
from fsm.solve.statics import snap_through
from fsm.solve.statics.arc_length import PathPoint, trace
from fsm.solve.statics.static import follow
from validation.closed_forms.beams import POST_BUCKLING as ELASTICA
from validation.closed_forms.chains import column

# column -------------------------------------------------------------------------------------------------------


@cache
def buckled(
    count: int, spatial: bool = False, imperfection: float = 0.0, damping: float = 0.0
) -> tuple[list[SavedState], Statistics, SegmentSystem]:
    system = column(count, spatial, damping)
    motion = system.motions[0]
    times = [motion.time_of(shortening) for _, shortening, _ in ELASTICA.values()]
    saved: list[SavedState] = []
    settings = PathSettings(system.end_time() or 0.0, motion.time_of(2e-3), imperfection=imperfection)
    statistics, _ = follow(system, settings, times, saved.append)
    return saved, statistics, system


def deflection(system: SegmentSystem, saved: SavedState) -> float:
    """Of the middle, m."""
    return float(saved.q.reshape(system.n_free, -1)[system.n_free // 2, 2 if system.spatial else 1])


@pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
def test_column_past_buckling(spatial: bool) -> None:
    saved, statistics, system = buckled(200 if not spatial else 100, spatial)
    tolerance = 1e-4 if not spatial else 4e-4  # errors fall as 1/N^2
    for state, (load, _, sideways) in zip(saved, ELASTICA.values(), strict=True):
        assert state.observation.drive.force[0] / np.pi**2 == pytest.approx(load, rel=tolerance)
        # the middle of the column is the end of the segment that contains it
        assert abs(deflection(system, state)) == pytest.approx(sideways, rel=tolerance)
    (event,) = statistics.events
    assert event.kind == "bifurcation"
    # the smallest step, 1e-6 of the travel, is half the critical load of such a stiff column; the search finds the load more
    # accurately
    assert event.force / np.pi**2 == pytest.approx(1.0, rel=2e-2)


def test_dampers_do_not_keep_a_column_straight() -> None:
    saved, statistics, system = buckled(20, damping=1e-3)
    free, _, _ = buckled(20)
    for state, other in zip(saved, free, strict=True):
        force, undamped = state.observation.drive.force[0], other.observation.drive.force[0]
        assert force == pytest.approx(undamped, rel=1e-3)
        assert negative_pivots(system, state.time, state.q) == 0
    assert [event.kind for event in statistics.events] == ["bifurcation"]
    # the damper of the pulled pin, 10 N at the speed of the drive, causes no spike where the branch is taken
    assert max(drive.force[0] for drive, *_ in statistics.points) < 1.01 * max(s.observation.drive.force[0] for s in saved)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_column_buckles_to_the_side_asked_for(side: float) -> None:
    """The rotations of both ends are the largest components of the mode; the sign is that of the first end."""
    saved, _, system = buckled(20, imperfection=side)
    assert np.sign(saved[-1].q.reshape(system.n_free, -1)[0, 2]) == side
    assert abs(deflection(system, saved[-1])) > 0.3


# shallow truss, half of it: a bar from a pin to an apex that is guided along z and pushed down by a soft spring -------

BAR, BASE, RISE, SOFT = 1000.0, 1.0, 0.3, 20.0
"""Stiffness of the bar (N/m), its span and rise (m), stiffness of the spring (N/m): softer than the truss falls, 44 N/m."""


def resistance(sunk: np.ndarray) -> np.ndarray:
    """Closed form: force of the truss (N) as a function of the downward displacement of its apex (m)."""
    height = RISE - sunk
    length = np.hypot(BASE, height)
    return BAR * (np.hypot(BASE, RISE) - length) * height / length


def truss(damping: float = 0.0) -> SegmentSystem:
    length, stiff = float(np.hypot(BASE, RISE)), 1e9
    turn = -float(np.arctan2(RISE, BASE)) / 2
    bodies = (
        Body(name="bar", mass=0.1, inertia=(0.01,) * 3, position=(BASE / 2, 0.0, RISE / 2),
             orientation=(float(np.cos(turn)), 0.0, float(np.sin(turn)), 0.0)),
        Body(name="apex", mass=0.1, inertia=(0.01,) * 3, position=(BASE, 0.0, RISE)),
        Body(name="hand", mass=0.0, inertia=(0.0,) * 3, position=(BASE, 0.0, RISE)),
    )  # fmt: skip
    elements = (
        ForceElement(name="pin", inner=GROUND, outer="bar", point_outer=(-length / 2, 0.0, 0.0),
                     translation=(BAR, stiff, stiff), translation_damping=(damping * BAR, 0.0, 0.0)),
        ForceElement(name="hinge", inner="apex", outer="bar", point_outer=(length / 2, 0.0, 0.0), translation=(stiff,) * 3),
        ForceElement(name="guide", inner="apex", outer=GROUND, point_outer=(BASE, 0.0, RISE),
                     translation=(stiff, stiff, 0.0), rotation=(1e3,) * 3),
        ForceElement(name="spring", inner="apex", outer="hand", translation=(0.0, 0.0, SOFT),
                     translation_damping=(0.0, 0.0, damping * SOFT)),
    )  # fmt: skip
    drive = Drive(body="hand", direction=(0.0, 0.0, -1.0), speed=0.01, travel=1.0)
    return compile_scene(Scene(bodies=bodies, elements=elements, drives=(drive,)))


def sunk(q: np.ndarray) -> float:
    """Downward displacement of the apex from its start, m."""
    return RISE - float(q[4])


@pytest.mark.parametrize("damping", [0.0, 0.05], ids=["slides", "moves"])
def test_truss_snaps_through(damping: float) -> None:
    system = truss(damping)
    saved: list[SavedState] = []
    motion = system.motions[0]
    times = [motion.time_of(travel) for travel in np.linspace(0.05, 1.0, 20)]
    statistics, energy_balance = follow(system, PathSettings(motion.end_time, motion.time_of(0.01)), times, saved.append)
    (event,) = statistics.events
    assert event.kind == "snap"  # dampers do not hide the limit point
    # the limit point of D = w + F(w)/k
    depth = np.linspace(0.0, RISE, 100_001)
    limit = float(np.max(depth + resistance(depth) / SOFT))
    if damping:  # the dampers slow it down while it creeps past
        assert limit < event.travel < 1.02 * limit
    else:
        assert event.travel == pytest.approx(limit, rel=1e-4)
    assert event.end_force < 0.2 * event.force
    for state in saved:
        w = sunk(state.q)
        force, travel = state.observation.drive.force[0], state.observation.drive.travel[0]
        if limit <= travel <= event.end_travel:
            continue  # this state is not an equilibrium, because the motion is under way
        tolerance = 2e-3 if damping else 1e-5  # the force of the dampers, and that of the rest of the motion
        assert force == pytest.approx(resistance(np.array(w)), abs=tolerance * 10.0)
        assert travel == pytest.approx(w + force / SOFT, abs=tolerance)
        if not event.travel <= travel <= event.end_travel:
            assert (w > RISE) == (travel > event.travel)  # no state is on the unstable branch in between
    assert energy_balance.relative_error < 1e-2


def test_what_hardly_anything_damps_does_not_ring_on() -> None:
    """With a damper of 1e-5 s the vibration after a snap lasts to the end: 14533 steps, the rest of the travel as a motion,
    and 16 % of its energy lost by numerical damping. Artificial damping is added after the first phase of the snap. With
    dampers that differ by 1e-7, 0.4 to 2.1 % are lost: the vibration is chaotic."""
    system = truss(1e-5)
    motion = system.motions[0]
    saved: list[SavedState] = []
    settings = PathSettings(motion.end_time, motion.time_of(0.01))
    statistics, energy_balance = follow(system, settings, [motion.end_time], saved.append)
    (event,) = statistics.events
    assert event.end_travel < 0.75
    assert statistics.steps < 5000
    assert energy_balance.relative_error < 4e-2
    (state,) = saved
    assert state.observation.drive.force[0] == pytest.approx(resistance(np.array(sunk(state.q))), rel=1e-4)


@pytest.mark.parametrize("rtol", [1e-3, 3e-4, 3e-5])
def test_no_energy_is_lost_in_a_snap(rtol: float) -> None:
    """A step of the motion that was too long gained 5 J of 2.4 J, at these tolerances or others."""
    system = truss(0.05)
    motion = system.motions[0]
    statistics, energy_balance = follow(
        system, PathSettings(motion.end_time, motion.time_of(0.01), rtol=rtol), [], lambda state: None
    )
    assert [event.kind for event in statistics.events] == ["snap"]
    assert energy_balance.relative_error < 1e-2
    assert statistics.steps < 1000


def test_arc_length_passes_a_snap_back() -> None:
    system = truss()
    q, _ = system.initial()
    end = system.motions[0].time_of(0.98)
    points: list[PathPoint] = list(trace(system, q, 0.0, end, 0.01, 0.05))
    travel = np.array([system.motions[0].at(point.time)[0] for point in points])
    w = np.array([sunk(point.q) for point in points])
    np.testing.assert_allclose(travel, w + resistance(w) / SOFT, atol=1e-5)
    back = np.diff(travel) < 0.0
    assert back.any() and travel[-1] == pytest.approx(0.98)
    assert np.all(np.diff(w) > 0.0)
    # states are unstable exactly where the path goes back
    slope = np.gradient(w + resistance(w) / SOFT, w)
    clear = np.abs(slope) > 0.2
    unstable = np.array([point.negative_pivots for point in points]) > 0
    np.testing.assert_array_equal(unstable[clear], slope[clear] < 0.0)
    assert unstable.any()


def snap_of_truss(points: list[CurvePoint] | None = None, **settings: float) -> tuple[np.ndarray, Statistics]:
    """Forces of all steps (N), and statistics, of the truss with weak damping, whose apex swings for long after the snap."""
    system = truss(0.002)
    motion, points = system.motions[0], [] if points is None else points
    whole = PathSettings(motion.time_of(0.5), motion.time_of(0.01))
    statistics, _ = follow(system, replace(whole, **settings), [], lambda state: None, points=points)
    return np.array([point.drive.force[0] for point in points]), statistics


def test_a_snap_ends_at_the_force_limit() -> None:
    """The apex swings below the hand after the snap, and pulls it with more force than the truss resisted before."""
    free, unlimited = snap_of_truss()
    force, statistics = snap_of_truss(force_limit=5.2)
    snap, limit = statistics.events
    assert free.min() < -5.4 and free.max() < 5.1
    assert limit.kind == "force limit" and limit.end_force == force[-1] == pytest.approx(-5.2, rel=1e-3)
    assert np.abs(force[:-1]).max() < 5.2
    assert snap.travel < limit.travel < unlimited.events[0].end_travel


def test_a_snap_does_not_depend_on_the_steps_of_a_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    """Force of a motion whose steps are taken one by one, and up to eight in each kernel, over its first swing; then the
    phases of both part, by the tolerance of the motion.
    """
    several, alone = list[CurvePoint](), list[CurvePoint]()
    snap_of_truss(several)
    monkeypatch.setattr(snap_through, "_LOOKS", 1)
    monkeypatch.setattr(snap_through, "_FEW", 1)
    snap_of_truss(alone)
    (t, force), (s, other) = (np.array([(p.time, p.drive.force[0]) for p in one]).T for one in (several, alone))
    swing = int(np.argmin(force))
    assert force[swing] < -5.0
    apart = np.abs(force - np.interp(t, s, other))[: swing + 1]
    assert apart.max() < 5e-3 * np.abs(force).max()


def test_the_steps_of_a_snap_count() -> None:
    with pytest.raises(NotConverged, match=r"step 400, .* solve.max_steps, in the motion after a snap; raise"):
        snap_of_truss(max_steps=400)
