"""One solve, recorded: results file, checkpoints, resuming, summary."""

from __future__ import annotations

import json
import math
import os
import platform
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fsm.errors import FsmError
from fsm.kernels import jit
from fsm.prepare import path_settings
from fsm.progress import Progress
from fsm.results.solution import Layout, Record, Solution
from fsm.results.store import ResultWriter, part_path, read_checkpoint, read_solution, write_checkpoint
from fsm.scene.choice import automatic_method
from fsm.scene.load_case import LoadedCase
from fsm.scene.scene import Scene
from fsm.segments.save_times import save_times
from fsm.segments.system import SegmentSystem
from fsm.solve.linear import LinearSolver
from fsm.solve.newton import equilibrium, negative_pivots
from fsm.solve.simulate import Ledger, Saved, Settings, Statistics, StepEnd
from fsm.solve.solver import solve
from fsm.solve.static import PathSettings
from fsm.solve.status import Event
from fsm.summary import summary_of
from fsm.system import DriveState

__all__ = ["CHECKPOINT_EVERY", "RecordedSolve"]

CHECKPOINT_EVERY = 1.0
"""Seconds of wall time between checkpoints; one takes about 10 ms."""


@dataclass(frozen=True)
class _Point:
    """Where a solve can go on: the end of a step, the ledger there, how many points seen and records there were, memory."""

    end: StepEnd
    ledger: Ledger
    seen: int
    records: int
    memory: np.ndarray


class RecordedSolve:
    """The solve of one case, writing records as it goes and checkpoints every now and then.

    Parameters
    ----------
    loaded : LoadedCase
    scene, system : what it describes and was compiled to
    out : folder of the results
    resume : bool
        Go on from a checkpoint in `out`, if there is one of this very case.
    warnings : list of str
        What was noticed before.
    """

    def __init__(
        self,
        loaded: LoadedCase,
        scene: Scene,
        system: SegmentSystem,
        out: Path,
        resume: bool,
        warnings: list[str],
    ) -> None:
        self.loaded, self.scene, self.system, self.out = loaded, scene, system, out
        self.case = loaded.case
        self.warnings = list(warnings)
        self.target = out / "result.h5"
        self.checkpoint = out / "checkpoint.h5"
        self.last_checkpoint = time.perf_counter()
        self.events: list[Event] = []
        self.resumed = self._read_checkpoint() if resume else None
        (out / "summary.json").unlink(missing_ok=True)  # it says that the case in this folder is done
        if self.resumed is None:
            self.checkpoint.unlink(missing_ok=True)  # of another run, whose records go now
        self.seen: list[tuple[DriveState, np.ndarray]] = []
        self.records = 0
        self.last: _Point | None = None
        self.pivots = LinearSolver()

    def run(self, progress: bool | Callable[[float], None], begun: float, compiled: float) -> Solution:
        """Solve, write the results file and read it back; `begun` and `compiled` are clocks at the start of the run."""
        method, reason = self._method()
        end = self.system.end_time() if self.case.solve.end_time is None else self.case.solve.end_time
        assert end is not None
        settings = self._settings(method, end)
        start, ledger, at = self._start()
        records = self.resumed[1] if self.resumed else None
        self.records = records or 0
        motion = self.system.motions[0] if self.system.motions else None
        times = [t for t in save_times(self.case, motion, end) if records is None or t > at]
        bar = Progress(progress, end, self.loaded.case.title or str(self.loaded.path), jit)
        with ResultWriter(self.target, self._layout(method, reason), resume_at=records) as writer, bar:
            try:
                statistics, _ = solve(
                    self.system,
                    settings,
                    times,
                    lambda saved: self._save(writer, saved),
                    lambda end: self._step(writer, bar, ledger, end),
                    start,
                    ledger,
                    self.seen,
                )
            except KeyboardInterrupt:
                writer.flush()
                if self.last is not None:
                    self._write_checkpoint(self.last)
                raise
            statistics.events[:0] = self.events
            writer.flush()
            solution = read_solution(part_path(self.target))
            summary = summary_of(solution, self.scene, statistics, ledger, self.warnings) | {
                "method": statistics.method,
                "dof": self.system.nu,
                "dimension": solution.layout.dimension,
                "compile_time_s": jit.compile_time() - compiled,
                "wall_time_s": time.perf_counter() - begun,
                "contact_stats": self.system.contacts.stats(),
            }
            writer.finish(_plain(statistics), summary)
        self.checkpoint.unlink(missing_ok=True)
        return read_solution(self.target)

    def _method(self) -> tuple[str, str]:
        """What solves the case, and why."""
        chosen = self.case.solve.method
        return automatic_method(self.scene) if chosen == "auto" else (chosen, "asked for")

    def _settings(self, method: str, end: float) -> Settings | PathSettings:
        solve = self.case.solve
        max_step = solve.max_step or math.inf
        if method != "static":
            settings = Settings(method, solve.rtol, end, max_step, solve.max_steps, solve.energy_abort, step=solve.step)
            return settings if solve.rho_inf is None else replace(settings, rho_inf=solve.rho_inf)
        return path_settings(self.case, self.system, end)

    def _start(self) -> tuple[tuple[float, np.ndarray, np.ndarray], Ledger, float]:
        """State to start from, the ledger that is kept from there on, and the time up to which there are records."""
        if self.resumed is not None:
            arrays, _, self.warnings = self.resumed
            self.seen = [(DriveState(travel, force), pairs) for travel, force, pairs in _rows(arrays)]
            at = float(arrays["time"][0])
            self.system.restore(arrays["memory"])
            ledger = Ledger(*[*arrays["ledger"].tolist(), arrays["pair_energy"]])
            return (at, arrays["q"], arrays["u"]), ledger, at
        start = self._settled() or (0.0, *self.system.initial())
        return start, Ledger.opened(self.system.energy(*start)), 0.0

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
                **{f"pair_{name}": values for name, values in vars(seen.pairs).items()},
                pair_friction_energy=saved.pair_energy[0],
                pair_damping_energy=saved.pair_energy[1],
                shape=self.system.shape(saved.time, saved.q),
                negative_pivots=self._unstable_ways(saved),
            )
        )
        self.records += 1

    def _unstable_ways(self, saved: Saved) -> int:
        """Negative pivots of the stiffness; none without a drive, since a free motion passes no equilibria."""
        return negative_pivots(self.system, saved.time, saved.q, self.pivots) if self.system.motions else 0

    def _step(self, writer: ResultWriter, bar: Progress, ledger: Ledger, end: StepEnd) -> None:
        self.last = _Point(end, replace(ledger), len(self.seen), self.records, self.system.memory())
        if time.perf_counter() - self.last_checkpoint > CHECKPOINT_EVERY:
            writer.flush()
            self._write_checkpoint(self.last)
        bar.step(end.time, end.steps)

    def _write_checkpoint(self, point: _Point) -> None:
        ledger = asdict(point.ledger)
        pair_energy = ledger.pop("pair_energy")
        write_checkpoint(
            self.checkpoint,
            {
                "time": np.array([point.end.time]),
                "q": point.end.q,
                "u": point.end.u,
                "memory": point.memory,
                "ledger": np.array(list(ledger.values())),
                "pair_energy": pair_energy,
                "travel": np.array([drive.travel for drive, _ in self.seen[: point.seen]]),
                "force": np.array([drive.force for drive, _ in self.seen[: point.seen]]),
                "pair_force": np.array([pairs for _, pairs in self.seen[: point.seen]]),
            },
            {
                "case": self.loaded.text,
                "records": point.records,
                "warnings": self.warnings,
                "events": json.dumps([asdict(event) for event in (*self.events, *point.end.events)]),
            },
        )
        self.last_checkpoint = time.perf_counter()

    def _read_checkpoint(self) -> tuple[dict[str, np.ndarray], int, list[str]] | None:
        """Arrays, number of records and warnings of a checkpoint of this very case; None if there is none."""
        if not self.checkpoint.is_file() or not part_path(self.target).is_file():
            return None
        arrays, attributes = read_checkpoint(self.checkpoint)
        if attributes.get("case") != self.loaded.text:
            return None
        self.events = [Event(**event) for event in json.loads(attributes["events"])]
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
            drive_names=tuple(" + ".join(bodies.names[body] for body in motion.bodies) for motion in self.system.motions),
            thickness=max((plate.thickness for _, plate, _ in bodies.plates), default=0.0),
        )


def _rows(arrays: dict[str, np.ndarray]) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    return zip(arrays["travel"], arrays["force"], arrays["pair_force"], strict=True)


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
        "rejected_steps": statistics.rejected,
        "solve_time_s": statistics.wall_time,
    }
