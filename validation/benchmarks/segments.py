"""Cost against the number of segments: a static Newton iteration, a time step, the contacts alone, and their slopes."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress

import numpy as np

from fsm.case.models.scene import Scene
from fsm.model.bodies.group import BlockSums, BodyState, body_pattern
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.equations.linear import Backend, LinearSolver
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from validation.benchmarks.precision import Row, say
from validation.benchmarks.scenes import cantilever, strip_scene

__all__ = ["COUNTS", "QUICK_COUNTS", "SEGMENTS", "SEGMENTS_COLUMNS", "measure_segments", "segments_table", "slope"]

SEGMENTS = "segments.csv"
SEGMENTS_COLUMNS = ("scene", "what", "segments", "time_s", "repeats", "slope", "message")
COUNTS = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
QUICK_COUNTS = (10, 50, 200, 500)
FITTED_FROM = 100
"""Smallest count for the fit of slopes; below it, the time of calls in Python dominates."""
MOVING_PANELS = 4
"""Number of moving panels; two of the six panels of the strip are held."""
STEPS, SETTLING = 10, 20
"""Time steps that are timed, after those in which the step size still grows."""
LARGEST_DENSE = 6000
"""States up to which LSODA is tried where it has no band: it keeps a full matrix."""
RTOL = 1e-3
CLOSED = 90.05
"""Fold angle at which contacts are timed, degrees: beyond a right angle panels lie in each other."""


class _Enough(Exception):
    """As many steps as requested."""


def _chain(count: int) -> Scene:
    return cantilever(count, ramp=10.0, damping=0.3)


def _strip(count: int) -> Scene:
    return strip_scene(round(count / MOVING_PANELS))


SCENES: dict[str, tuple[Callable[[int], Scene], bool, int]] = {
    "chain in the plane": (_chain, False, 10),
    "chain in space": (_chain, True, 10),
    "strip with contact in the plane": (_strip, False, 20),
}
"""Function that makes each scene with a number of segments, whether it is in space, and the smallest count."""


def measure_segments(counts: Sequence[int], methods: Sequence[str], repeat: int, limit: float) -> Iterator[list[Row]]:
    """All rows so far, written after every scene and count; if a run takes longer than `limit` (s), larger numbers of
    segments are skipped."""
    rows: list[Row] = []
    for scene, (make, spatial, smallest) in SCENES.items():
        over: set[str] = set()
        for count in (n for n in counts if n >= smallest):
            system = compile_scene(make(count), spatial)
            for what, clock in (_clocks(methods) | (CONTACT_CLOCKS if system.contacts else {})).items():
                if what not in over:
                    rows.append(_row(scene, what, count, system, clock, repeat))
                    if float(rows[-1]["time_s"] or "inf") * (STEPS + SETTLING) > limit:
                        over.add(what)
            yield _with_slopes(rows)


def _clocks(methods: Sequence[str]) -> dict[str, Callable[[SegmentSystem, int], list[float]]]:
    """All measured times by name."""

    def iteration(backend: Backend) -> Callable[[SegmentSystem, int], list[float]]:
        return lambda system, repeat: newton_iterations(system, backend, repeat)

    def step(method: str) -> Callable[[SegmentSystem, int], list[float]]:
        return lambda system, repeat: time_steps(system, method)

    return {
        "Newton iteration": iteration("block"),
        "Newton iteration, SuperLU": iteration("splu"),
        **{f"time step, {method}": step(method) for method in methods if method != "static"},
    }


def _row(
    scene: str,
    what: str,
    count: int,
    system: SegmentSystem,
    clock: Callable[[SegmentSystem, int], list[float]],
    repeat: int,
) -> Row:
    row = dict.fromkeys(SEGMENTS_COLUMNS, "") | {"scene": scene, "what": what, "segments": str(count)}
    try:
        times = clock(system, repeat)
    except Exception as error:
        row["message"] = f"{type(error).__name__}: {error}"
    else:
        row |= {"time_s": f"{statistics.median(times):.4g}", "repeats": str(len(times))}
    say(f"{scene}, {what}, {count}: {row['time_s'] or row['message']}")
    return row


def newton_iterations(system: SegmentSystem, backend: Backend, repeat: int) -> list[float]:
    """Processor times of force, tangents, factorisation and solution; the pattern is known, as in all iterations except the
    first."""
    q, _ = system.initial()
    # the state is slightly different from the initial state, so that no entry is zero by symmetry
    q = system.retract(q, 1e-4 * system.scales().increment * np.random.default_rng(0).standard_normal(system.nu))
    solver, times = LinearSolver(backend), []
    for _ in range(max(5, repeat) + 1):
        begun = time.process_time()
        linear = system.linearise(1.0, q, None)
        solver.factorise(linear.stiffness)
        solver.solve(linear.force)
        times.append(time.process_time() - begun)
    return times[1:]


def time_steps(system: SegmentSystem, method: str) -> list[float]:
    """Processor times of complete time steps: Jacobians, factorisations, rejections and the energy balance."""
    if method == "LSODA" and not system.fixed_pattern and system.nq + system.nu > LARGEST_DENSE:
        raise ValueError(f"no band where bodies can meet: a full matrix of {system.nq + system.nu} rows")
    ends: list[float] = []

    def count(_: object) -> None:
        ends.append(time.process_time())
        if len(ends) > STEPS + SETTLING:
            raise _Enough

    end = system.end_time() or 25.0
    with suppress(_Enough):
        simulate(system, Settings(method, RTOL, end), [], lambda saved: None, count)
    steps = np.diff(ends[SETTLING:])
    # a step that computes new matrices takes many times as long as other steps, so the mean is used
    return [float(np.mean(steps))]


def contact_forces(system: SegmentSystem, repeat: int) -> list[float]:
    """Processor times of contacts alone (search, measures, forces and tangents) in a state in which all faces touch."""
    poses, rates = closed(system), np.zeros(system.bodies.rate.shape)
    dof = np.full(len(poses), -1, dtype=np.int64)
    dof[system.bodies.free] = np.arange(system.n_free)
    pattern = body_pattern(dof, [group.pairs(poses)[0] for group in system.contacts], system.size)
    times = []
    for _ in range(max(5, repeat) + 1):
        here = BodyState(0.0, poses.copy(), rates)  # for the identical array, the contacts would come from the cache
        sums = BlockSums.zero(pattern, here)
        begun = time.process_time()
        for group in system.contacts:
            group.add_linearised(here, sums)
        times.append(time.process_time() - begun)
    return times[1:]


def contact_renewal(system: SegmentSystem, repeat: int) -> list[float]:
    """Processor times of the broad phase after every body has moved by its margin."""
    poses, times = closed(system), []
    for _ in range(max(5, repeat) + 1):
        begun = time.process_time()
        for group in system.contacts:
            poses = poses.copy()
            poses[:, 0] += group.geometry.margin
            group.pairs(poses)
        times.append(time.process_time() - begun)
    return times[1:]


def closed(system: SegmentSystem) -> np.ndarray:
    """Poses of the folded strip in the plane, closed so far that all neighbouring panels overlap slightly."""
    poses, _ = system.place(0.0, system.initial()[0], None)
    poses, turned = poses.copy(), np.abs(poses[:, 2]) > 0.1
    fold = float(np.abs(poses[turned, 2]).max())
    shut = math.radians(CLOSED)
    poses[turned, 2] *= shut / fold
    poses[:, 0] *= math.cos(shut) / math.cos(fold)
    poses[:, 1] *= math.sin(shut) / math.sin(fold)
    return poses


CONTACT_CLOCKS: dict[str, Callable[[SegmentSystem, int], list[float]]] = {
    "contact, all touching": contact_forces,
    "contact, broad phase": contact_renewal,
}


def slope(counts: Sequence[float], times: Sequence[float]) -> float:
    """Slope of log time against log count."""
    return float(np.polyfit(np.log(counts), np.log(times), 1)[0])


def _with_slopes(rows: list[Row]) -> list[Row]:
    for row in rows:
        line = [
            (float(r["segments"]), float(r["time_s"]))
            for r in rows
            if (r["scene"], r["what"]) == (row["scene"], row["what"]) and r["time_s"] and float(r["segments"]) >= FITTED_FROM
        ]
        row["slope"] = f"{slope(*zip(*line, strict=True)):.3f}" if len(line) > 1 else ""
    return rows


def segments_table(rows: Sequence[Row]) -> str:
    """Times in ms and slopes, in Markdown."""
    counts = sorted({int(row["segments"]) for row in rows})
    lines = ["| scene | what | " + " | ".join(map(str, counts)) + " | slope |", "|---" * (len(counts) + 3) + "|"]
    for scene, what in dict.fromkeys((row["scene"], row["what"]) for row in rows):
        own = {int(row["segments"]): row for row in rows if (row["scene"], row["what"]) == (scene, what)}
        cells = [f"{1e3 * float(own[n]['time_s']):.3g}" if n in own and own[n]["time_s"] else "-" for n in counts]
        lines.append(f"| {scene} | {what} | {' | '.join(cells)} | {next(iter(own.values()))['slope']} |")
    return "\n".join(lines)
