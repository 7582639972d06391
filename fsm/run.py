"""One case from description to files: the glue between scene, compiler, solver, results and plots."""

from __future__ import annotations

import json
import math
import os
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fsm.crossing import first_crossings
from fsm.errors import CaseError, ExpectationFailed, Fault, FsmError
from fsm.kernels import jit
from fsm.overlap import find_overlaps
from fsm.plots.energy import plot_energy
from fsm.plots.force import plot_force
from fsm.plots.motion import plot_motion
from fsm.progress import Progress
from fsm.results.export import write_force_csv
from fsm.results.quantities import Curve, summarise
from fsm.results.solution import Layout, Record, Solution
from fsm.results.store import (
    ResultWriter,
    part_path,
    read_checkpoint,
    read_solution,
    write_checkpoint,
)
from fsm.scene.builders.strip import build_scene
from fsm.scene.builders.warm_up import WARM_UP_SHIFT, warm_up_cases
from fsm.scene.case import Case
from fsm.scene.load_case import LoadedCase
from fsm.scene.planar import out_of_plane
from fsm.scene.scene import Scene
from fsm.segments.compile import compile_scene
from fsm.segments.save_times import save_times
from fsm.segments.system import SegmentSystem
from fsm.solve.newton import equilibrium, negative_pivots
from fsm.solve.simulate import Ledger, Saved, Settings, Statistics, choose_method, simulate
from fsm.system import Observation

__all__ = ["prepare", "run_case", "warm_up"]

CHECKPOINT_EVERY = 1.0
"""Seconds of wall time between checkpoints; one takes about 10 ms."""


def prepare(case: Case, source: str = "") -> tuple[Scene, SegmentSystem]:
    """Build and compile a case.

    Raises
    ------
    CaseError
        All faults of the scene, and panels that overlap as folded.
    """
    scene = build_scene(case)
    try:
        system = compile_scene(scene, case.solve.spatial)
    except CaseError as error:
        raise CaseError(error.faults, source) from None
    if scene.contact is not None and not out_of_plane(scene):
        faults = [
            Fault(
                "strip" if case.strip else "scene",
                f"{first} and {second} overlap at the start by {1e3 * depth:.3g} mm; "
                "use a smaller fold_angle or thickness, or thickness_in_gap = false",
            )
            for first, second, depth in find_overlaps(scene)
        ]
        if faults:
            raise CaseError(faults, source)
    return scene, system


def run_case(
    loaded: LoadedCase, out: Path, *, progress: bool | Callable[[float], None] = True, resume: bool = False
) -> dict[str, Any]:
    """Run a case and write result.h5, summary.json, force.csv, force.png, motion.png and energy.png into `out`.

    Parameters
    ----------
    loaded : LoadedCase
    out : folder for the results, made if needed
    progress : bool or callable
        A bar on standard error, or called with the fraction done.
    resume : bool
        Go on from the last checkpoint in `out` if there is one of this very case; steps and times in the
        summary are then those of the last part.

    Returns
    -------
    dict
        What summary.json holds.

    Raises
    ------
    CaseError
        Nothing has been written.
    NotConverged, EnergyAbort
        What was solved until then is in result.part.h5.
    ExpectationFailed
        Everything has been written.
    KeyboardInterrupt
        A checkpoint has been written.
    """
    begun = time.perf_counter()
    compiled = jit.compile_time()
    scene, system = prepare(loaded.case, str(loaded.path))
    _check_expectations(loaded)
    out.mkdir(parents=True, exist_ok=True)
    solution = _Solve(loaded, scene, system, out, resume).run(progress, begun, compiled)
    _write(solution, out)
    summary = solution.summary
    failed = _missed(loaded.case, summary)
    if failed:
        raise ExpectationFailed("\n".join(failed))
    return summary


def warm_up(spatial: bool = False) -> None:
    """Compile (or load) every kernel a run needs, by solving the first instants of a small strip of every kind."""
    for case in warm_up_cases(spatial):
        _, system = prepare(case)
        q, u = system.initial()
        end = 1e-3 * (system.end_time() or 1.0)
        simulate(system, Settings("Radau", 1e-3, end), [0.0, end], lambda saved: None)
        negative_pivots(system, 0.0, q)
        pushed = np.zeros((system.n_free, system.size))
        names = [system.bodies.names[i] for i in system.bodies.free]
        pushed[[name.startswith("panel 3") for name in names], 0] = WARM_UP_SHIFT
        touching = system.retract(q, pushed.ravel())
        system.tangent(0.0, touching, u)
        system.observe(0.0, touching, u)


class _Watched(SegmentSystem):
    """A system that remembers what was looked at while it was solved.

    Attributes
    ----------
    points : rows of travel (m) and force (N) of the first drive, and normal force of every contact pair (N)
    latest : time (s), q and u of the latest state; after a step that is its end
    """

    def __init__(self, system: SegmentSystem) -> None:
        super().__init__(system.bodies, system.motions, system.groups, system.contacts, system.pair_names)
        self.points: list[np.ndarray] = []
        self.latest = (-math.inf, *self.initial())

    def observe(self, t: float, q: np.ndarray, u: np.ndarray | None) -> Observation:
        """See `System`."""
        seen = super().observe(t, q, u)
        if self.motions:
            self.points.append(np.concatenate([seen.drive.travel[:1], seen.drive.force[:1], seen.pair_force]))
        if u is not None and t > self.latest[0]:
            self.latest = (t, q, u)
        return seen

    def curve(self, count: int | None = None) -> np.ndarray:
        """The points, or the first so many, a row each."""
        return np.array(self.points[:count]).reshape(-1, 2 + len(self.pair_names))


@dataclass(frozen=True)
class _Point:
    """Where a solve can go on: the end of a step.

    A state between steps will not do: there the stiff modes are interpolated, and starting from it they ring.

    Attributes
    ----------
    time : s
    q, u : arrays
    ledger : Ledger
    curve : how many points of the force curve there are up to here
    records : how many records
    """

    time: float
    q: np.ndarray
    u: np.ndarray
    ledger: Ledger
    curve: int
    records: int


class _Solve:
    """The solve of one case, writing as it goes."""

    def __init__(self, loaded: LoadedCase, scene: Scene, system: SegmentSystem, out: Path, resume: bool) -> None:
        self.loaded, self.scene, self.system, self.out = loaded, scene, _Watched(system), out
        self.case = loaded.case
        self.warnings: list[str] = []
        self.target = out / "result.h5"
        self.checkpoint = out / "checkpoint.h5"
        self.last_checkpoint = time.perf_counter()
        self.resumed = self._read_checkpoint() if resume else None
        (out / "summary.json").unlink(missing_ok=True)  # it says that the case in this folder is done
        if self.resumed is None:
            self.checkpoint.unlink(missing_ok=True)  # of another run, whose records go now
        self.records = 0
        self.last: _Point | None = None

    def run(self, progress: bool | Callable[[float], None], begun: float, compiled: float) -> Solution:
        """Solve, write the results file and read it back; `begun` and `compiled` are clocks at the start of the run."""
        method, reason = choose_method(self.case.solve.method)
        end = self.system.end_time() if self.case.solve.end_time is None else self.case.solve.end_time
        assert end is not None
        settings = Settings(
            method,
            self.case.solve.rtol,
            end,
            self.case.solve.max_step or math.inf,
            self.case.solve.max_steps,
            self.case.solve.energy_abort,
        )
        start, ledger, at = self._start()
        records = self.resumed[1] if self.resumed else None
        self.records = records or 0
        motion = self.system.motions[0] if self.system.motions else None
        times = [t for t in save_times(self.case, motion, end) if records is None or t > at]
        bar = Progress(progress, end, self.loaded.case.title or str(self.loaded.path), jit)
        with ResultWriter(self.target, self._layout(method, reason), resume_at=records) as writer, bar:
            try:
                statistics, _ = simulate(
                    self.system,
                    settings,
                    times,
                    lambda saved: self._save(writer, saved),
                    lambda t, steps: self._step(writer, bar, ledger, t, steps),
                    start,
                    ledger,
                )
            except KeyboardInterrupt:
                writer.flush()
                if self.last is not None:
                    self._write_checkpoint(self.last)
                raise
            writer.flush()
            solution = read_solution(part_path(self.target))
            summary = _summary(solution, self.scene, statistics, ledger, self.warnings, self.system.curve()) | {
                "method": statistics.method,
                "dof": self.system.nu,
                "dimension": solution.layout.dimension,
                "compile_time_s": jit.compile_time() - compiled,
                "wall_time_s": time.perf_counter() - begun,
            }
            writer.finish(_plain(statistics), summary)
        self.checkpoint.unlink(missing_ok=True)
        return read_solution(self.target)

    def _start(self) -> tuple[tuple[float, np.ndarray, np.ndarray], Ledger, float]:
        """State to start from, the ledger that is kept from there on, and the time up to which there are records."""
        if self.resumed is not None:
            arrays, _, self.warnings = self.resumed
            self.system.points = list(arrays["curve"])
            at = float(arrays["time"][0])
            return (at, arrays["q"], arrays["u"]), Ledger(*(float(x) for x in arrays["ledger"])), at
        start = self._settled() or (0.0, *self.system.initial())
        return start, Ledger(start=self.system.energy(*start).stored), 0.0

    def _settled(self) -> tuple[float, np.ndarray, np.ndarray] | None:
        """A strip whose creases are not at rest as folded starts from its equilibrium; other scenes start as given."""
        q, u = self.system.initial()
        residual = float(np.abs(self.system.force(0.0, q, u)).max(initial=0.0))
        if self.case.strip is None or residual < 1e-9:
            return None
        try:
            q = equilibrium(self.system, q, np.array([0.0]))
        except FsmError as error:
            self.warnings.append(f"not in equilibrium at the start, and none was found: {error}")
            return None
        if self.case.contact is not None and find_overlaps_now(self.system, q):
            self.warnings.append("at rest the strip's panels lie in each other; the creases open or close too far")
        return 0.0, q, u

    def _save(self, writer: ResultWriter, saved: Saved) -> None:
        seen = saved.observation
        stored = seen.energy.potential
        writer.append(
            Record(
                time=saved.time,
                q=saved.q,
                u=saved.u,
                travel=seen.drive.travel,
                force=seen.drive.force,
                energy={
                    **stored,
                    "kinetic": seen.energy.kinetic,
                    "dissipated": saved.dissipated,
                    "work": saved.work,
                    "error": saved.error,
                },
                pair_force=seen.pair_force,
                pair_gap=seen.pair_gap,
                shape=self.system.shape(saved.time, saved.q),
                negative_pivots=negative_pivots(self.system, saved.time, saved.q),
            )
        )
        self.records += 1

    def _step(self, writer: ResultWriter, bar: Progress, ledger: Ledger, t: float, steps: int) -> None:
        _, q, u = self.system.latest
        self.last = _Point(t, q.copy(), u.copy(), replace(ledger), len(self.system.points), self.records)
        if time.perf_counter() - self.last_checkpoint > CHECKPOINT_EVERY:
            writer.flush()
            self._write_checkpoint(self.last)
        bar.step(t, steps)

    def _write_checkpoint(self, point: _Point) -> None:
        write_checkpoint(
            self.checkpoint,
            {
                "time": np.array([point.time]),
                "q": point.q,
                "u": point.u,
                "ledger": np.array(list(asdict(point.ledger).values())),
                "curve": self.system.curve(point.curve),
            },
            {"case": self.loaded.text, "records": point.records, "warnings": self.warnings},
        )
        self.last_checkpoint = time.perf_counter()

    def _read_checkpoint(self) -> tuple[dict[str, np.ndarray], int, list[str]] | None:
        """Arrays, number of records and warnings of a checkpoint of this very case; None if there is none."""
        if not self.checkpoint.is_file() or not part_path(self.target).is_file():
            return None
        arrays, attributes = read_checkpoint(self.checkpoint)
        if attributes.get("case") != self.loaded.text:
            return None
        return arrays, int(attributes["records"]), list(attributes["warnings"])

    def _layout(self, method: str, reason: str) -> Layout:
        bodies = self.system.bodies
        return Layout(
            case_text=self.loaded.text,
            provenance=_provenance(f"{method}: {reason}"),
            dimension="spatial" if self.system.spatial else "planar",
            body_names=tuple(bodies.names[i] for i in bodies.free),
            panel=np.array([panel for _, _, panel in bodies.plates], dtype=np.int64),
            pair_names=self.system.pair_names,
            drive_names=tuple(bodies.names[motion.body] for motion in self.system.motions),
            thickness=max((plate.thickness for _, plate, _ in bodies.plates), default=0.0),
        )


def find_overlaps_now(system: SegmentSystem, q: np.ndarray) -> bool:
    """Whether some pair of surfaces penetrates in a configuration."""
    gaps = system.observe(0.0, q, np.zeros(system.nu)).pair_gap
    return bool(len(gaps)) and float(gaps.min()) < -1e-4


def _provenance(method: str) -> dict[str, str]:
    import numba
    import scipy

    import fsm

    return {
        "fsm": fsm.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "numba": numba.__version__,
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
        "command": " ".join([Path(sys.argv[0]).name, *sys.argv[1:]]),
        "method": method,
        "started": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
    }


def _plain(statistics: Statistics) -> dict[str, Any]:
    """Counters of a solve, without the curve."""
    return {
        "method": statistics.method,
        "outcome": statistics.outcome.name.lower(),
        "steps": statistics.steps,
        "force_evaluations": statistics.force_evaluations,
        "jacobian_evaluations": statistics.jacobian_evaluations,
        "factorisations": statistics.factorisations,
        "newton_iterations": statistics.newton_iterations,
        "smallest_step_s": statistics.smallest_step if math.isfinite(statistics.smallest_step) else 0.0,
        "solve_time_s": statistics.wall_time,
    }


def _summary(
    solution: Solution, scene: Scene, statistics: Statistics, ledger: Ledger, warnings: list[str], points: np.ndarray
) -> dict[str, Any]:
    summary: dict[str, Any] = {"peak_force": 0.0, "peak_travel": 0.0, "stages": []}
    if solution.travel.shape[1]:
        summary |= summarise(_fine_curve(solution, points), solution.layout.pair_names)
    unstable = int(np.sum(solution.negative_pivots > 0))
    summary |= {
        "steps": statistics.steps,
        "newton_iterations": statistics.newton_iterations,
        "energy_error": ledger.relative_error,
        "unstable_equilibria": unstable,
        "solve_time_s": statistics.wall_time,
    }
    summary["warnings"] = [*warnings, *_warnings(solution, scene, summary)]
    return summary


def _fine_curve(solution: Solution, points: np.ndarray) -> Curve:
    """Records and every point looked at on the way, so that peak and stages do not depend on what is saved."""
    return Curve.of(solution).merged(Curve(points[:, 0], points[:, 1], points[:, 2:]))


def _warnings(solution: Solution, scene: Scene, summary: dict[str, Any]) -> list[str]:
    found = []
    if summary["energy_error"] > 1e-3:
        found.append(f"energy balance off by {summary['energy_error']:.2g} of the energy turned over; tighten rtol")
    if summary["unstable_equilibria"]:
        first = float(solution.travel[np.argmax(solution.negative_pivots > 0), 0]) if solution.travel.size else 0.0
        found.append(
            f"{summary['unstable_equilibria']} saved states have an unstable tangent, the first at {1e3 * first:.4g} mm: "
            "the strip snaps there, and its path depends on inertia and damping"
        )
    thickness = solution.layout.thickness
    if solution.pair_gap.size and -solution.pair_gap.min() > 0.2 * thickness:
        pair = solution.layout.pair_names[int(np.argmin(solution.pair_gap.min(axis=0)))]
        found.append(
            f"faces of {pair} penetrate by {-1e3 * solution.pair_gap.min():.3g} mm, more than a fifth of the thickness; "
            "raise contact.stiffness"
        )
    for first_panel, second_panel, travel in first_crossings(solution, scene):
        found.append(
            f"panels {first_panel} and {second_panel} pass through each other from {1e3 * travel:.4g} mm of travel on: "
            "they are not a contact pair, and the result beyond is not physical"
        )
    if solution.travel.size:
        moving = solution.energy["kinetic"] > 0.01 * np.maximum.accumulate(
            solution.energy["panels"] + solution.energy["creases"]
        )
        moving &= solution.travel[:, 0] > 0.02 * solution.travel[-1, 0]
        if moving.any():
            at = float(solution.travel[np.argmax(moving), 0])
            found.append(
                f"not quasi-static at {1e3 * at:.4g} mm: the kinetic energy is over 1 % of the elastic; pull slower"
            )
        if summary["peak_travel"] > 0.999 * solution.travel[-1, 0]:
            found.append("the force is still rising at the end of the travel; the peak may lie beyond it")
    return found


def _write(solution: Solution, out: Path) -> None:
    """Curve, plots, and summary.json last and whole, so that its presence means the case is done."""
    write_force_csv(solution, out / "force.csv")
    if solution.travel.shape[1]:
        plot_force(solution, out / "force.png")
    plot_motion(solution, out / "motion.png")
    plot_energy(solution, out / "energy.png")
    partial = out / "summary.json.part"
    partial.write_text(json.dumps(solution.summary, indent=2) + "\n", encoding="utf-8")
    os.replace(partial, out / "summary.json")


_SCALARS = (
    "peak_force", "peak_travel", "final_travel", "final_force", "contact_travel", "contact_force", "bending_travel",
    "bending_force", "dof", "steps", "newton_iterations", "energy_error", "unstable_equilibria", "wall_time_s",
)  # fmt: skip


def _check_expectations(loaded: LoadedCase) -> None:
    faults = [
        Fault(f"expect.{name}", f"is not a number of the summary; there are {', '.join(_SCALARS)}")
        for name in loaded.case.expect
        if name not in _SCALARS
    ]
    if faults:
        raise CaseError(faults, str(loaded.path))


def _missed(case: Case, summary: dict[str, Any]) -> list[str]:
    lines = []
    for name, expect in case.expect.items():
        value = summary.get(name)
        bound = (expect.atol or 0.0) + (expect.rtol or 0.0) * abs(expect.value)
        if value is None:
            lines.append(f"expect.{name}: {expect.value:g} expected, but the run never got there")
        elif not abs(value - expect.value) <= bound:
            lines.append(f"expect.{name}: {value:.6g}, expected {expect.value:g} +- {bound:.3g}")
    return lines
