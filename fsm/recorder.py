"""Recording of one solve: results file, checkpoints, restart and summary."""

from __future__ import annotations

import json
import math
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from fsm.analyses.analysis import Analysis
from fsm.channels.sample import ChannelSampler, model_of_analysis
from fsm.errors import CaseError, EnergyAbort, NotConverged, is_interrupt
from fsm.hdf5_checked import READ_ERRORS
from fsm.kernels import jit
from fsm.panel_crossing import lattice_overlap
from fsm.progress import Progress, report_restart
from fsm.provenance import made_by, provenance
from fsm.results.channel import extremes_of
from fsm.results.curve import Curve
from fsm.results.solution import Record, Solution
from fsm.results.store import ResultWriter, part_path, read_checkpoint, read_solution, write_checkpoint
from fsm.round_off import RoundOff, position_round_off_energy, round_off_of
from fsm.scene.load_case import LoadedCase
from fsm.scene.scene import Scene
from fsm.solve.handed_over import CurvePoint, Saved, Statistics, StepEnd
from fsm.solve.ledger import Ledger
from fsm.solve.settings import Settings
from fsm.solve.solver import solve
from fsm.solve.static import PathSettings
from fsm.solve.status import Event
from fsm.summary import summary_of
from fsm.system import DriveState

__all__ = ["CHECKPOINT_EVERY", "RecordedSolve"]

CHECKPOINT_EVERY = 1.0
"""Wall time between checkpoints, s; one checkpoint takes about 10 ms."""
_SAME = 1e-10
"""Relative difference below which two times are the same."""
_STATE = "state_"
"""Prefix of the arrays of `StepEnd.state` in a checkpoint."""


@dataclass(frozen=True)
class _RestartPoint:
    """Point at which a solve can restart: state, energy balance, points of the curve, and written records and samples."""

    end: StepEnd
    ledger: Ledger
    seen: int
    written: tuple[int, int]


class RecordedSolve:
    """Solve of one case that writes records during the run and checkpoints at intervals.

    Parameters
    ----------
    loaded : LoadedCase
    analysis : analysis of the compiled case
    out : folder of the results
    resume : bool
        Restart from a checkpoint in `out` if there is one of the same case.
    warnings : list of str
        Warnings before the solve.
    """

    def __init__(self, loaded: LoadedCase, analysis: Analysis, out: Path, resume: bool, warnings: list[str]) -> None:
        self.loaded, self.analysis, self.out = loaded, analysis, out
        self.system = analysis.system
        self.warnings = list(warnings)
        self.channels = ChannelSampler(model_of_analysis(analysis), loaded.case.save.channels)
        self.target = out / "result.h5"
        self.checkpoint = out / "checkpoint.h5"
        self.last_checkpoint = time.perf_counter()
        self.seen: list[CurvePoint] = []
        self.of_another_case = False
        self.resumed = self._read_checkpoint() if resume else None
        (out / "summary.json").unlink(missing_ok=True)  # its presence would mean that the run is complete
        if self.resumed is None:
            self.checkpoint.unlink(missing_ok=True)  # belongs to another run, whose records are replaced
        self.records, self.samples = (0, 0) if self.resumed is None else self.resumed.written
        self.last: _RestartPoint | None = None

    def run(self, progress: bool | Callable[[float], None], begun: float, compiled: float) -> Solution:
        """Solve, write the results file and read it back.

        Parameters
        ----------
        progress : bool or callable
        begun, compiled : s
            Clock and compile time at the start of the run.
        """
        if self.of_another_case:
            report_restart(progress, self.checkpoint)
        method, reason = self.analysis.method()
        settings = self.analysis.settings(method)
        end = settings.end_time
        start, ledger = self._start()
        record_times, sample_times = self.analysis.record_times(end), self.analysis.sample_times(end)
        past = -1.0 if self.resumed is None else self.resumed.end.time * (1.0 + _SAME)
        self.records_due, self.samples_due = (deque(t for t in times if t > past) for times in (record_times, sample_times))
        layout = replace(
            self.analysis.layout(),
            case_text=self.loaded.text,
            provenance=provenance() | {"method": f"{method}: {reason}"},
            channels=self.channels.infos,
        )
        bar = Progress(progress, end, self.loaded.case.title or str(self.loaded.path), jit)
        resume_at = self.records if self.resumed else None
        with ResultWriter(self.target, layout, resume_at, samples_at=self.samples) as writer, bar:
            if start is not None:
                self._record_hold(writer, start, record_times)
            try:
                statistics = self._solve(
                    settings,
                    _merged(record_times, sample_times, _SAME * end),
                    lambda saved: self._save(writer, saved),
                    lambda end: self._step(writer, bar, ledger, end),
                    start,
                    ledger,
                )
            except (KeyboardInterrupt, SystemError) as error:
                if not is_interrupt(error):
                    raise
                writer.flush()
                if self.last is not None:
                    self._write_checkpoint(self.last)
                raise KeyboardInterrupt from None
            except (NotConverged, EnergyAbort) as error:  # the cause may be round-off, or squares of a lattice that touch
                writer.flush()
                refusal, beyond = self._causes() if self.records else ("", "")
                if refusal:
                    raise NotConverged(refusal) from error
                if beyond:
                    raise type(error)(f"{error}. {beyond[0].upper()}{beyond[1:]}") from error
                raise
            writer.flush()
            round_off = self._round_off()
            if round_off.refusal():
                raise NotConverged(round_off.refusal())
            solution = read_solution(part_path(self.target))
            solution.array = array = self.analysis.array_motion(solution, self.warnings)
            summary = summary_of(self.analysis, solution, statistics, ledger, self.warnings, round_off) | {
                "compile_time_s": jit.compile_time() - compiled,
                "wall_time_s": time.perf_counter() - begun,
            }
            if solution.channels:
                summary["channels"] = extremes_of(solution.channels, solution.time, solution.travel)
            driven = bool(self.seen) and len(self.seen[0].drive.travel) > 0
            curve = Curve.from_points(self.seen).decimate() if driven else None
            writer.finish(_counters(statistics), summary, array, curve)
        self.checkpoint.unlink(missing_ok=True)
        return read_solution(self.target)

    def _solve(
        self,
        settings: Settings | PathSettings,
        times: list[float],
        on_save: Callable[[Saved], None],
        on_step: Callable[[StepEnd], None],
        start: tuple[float, np.ndarray, np.ndarray] | None,
        ledger: Ledger,
    ) -> Statistics:
        own = self.analysis.own_solver()
        if own is not None:
            return own(settings.end_time, times, on_save, on_step, ledger)
        after = None if self.resumed is None else self.resumed.end
        return solve(self.system, settings, times, on_save, on_step, start, ledger, self.seen, after)[0]

    def _causes(self) -> tuple[str, str]:
        """Messages on two possible causes of a failed solve: round-off, and squares of a lattice that touch."""
        solution, scene = read_solution(part_path(self.target)), getattr(self.analysis, "scene", None)
        meeting = lattice_overlap(solution, scene) if isinstance(scene, Scene) else ""
        return round_off_of(self.system, solution).refusal(), meeting

    def _round_off(self) -> RoundOff:
        """Round-off of the records written so far."""
        return round_off_of(self.system, read_solution(part_path(self.target)))

    def _start(self) -> tuple[tuple[float, np.ndarray, np.ndarray] | None, Ledger]:
        """Start state (None for the state of a checkpoint), and the energy balance at the start."""
        if self.resumed is not None:
            return None, self.resumed.ledger
        start = self.analysis.start(self.warnings)
        ledger = Ledger.opened(self.system.energy(*start))
        ledger.trifle = max(ledger.trifle, position_round_off_energy(self.system, start))
        return start, ledger

    def _record_hold(self, writer: ResultWriter, start: tuple[float, np.ndarray, np.ndarray], times: list[float]) -> None:
        """Write the start state as the records of all times before the release, while all bodies are held."""
        begin, q, u = start
        held = [t for t in times if t < begin * (1.0 - _SAME)]
        if held:
            seen = self.system.observe(begin, q, u)
            for t in held:
                self._save(writer, Saved(t, q, u, seen, 0.0, 0.0, 0.0, np.zeros_like(seen.energy.pair_power)))

    def _save(self, writer: ResultWriter, saved: Saved) -> None:
        """Write a record of the whole state, a sample of the probes, or both, as required at this time."""
        if _due(self.records_due, saved.time):
            self._record(writer, saved)
        if _due(self.samples_due, saved.time):
            writer.sample(saved.time, self.analysis.probes(saved.q))
            self.samples += 1

    def _record(self, writer: ResultWriter, saved: Saved) -> None:
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
                negative_pivots=self.analysis.unstable_ways(saved.time, saved.q),
                channels=self.channels.values(self.system, saved),
            )
        )
        self.records += 1

    def _step(self, writer: ResultWriter, bar: Progress, ledger: Ledger, end: StepEnd) -> None:
        if end.state is not None:
            self.last = _RestartPoint(end, replace(ledger), len(self.seen), (self.records, self.samples))
            if time.perf_counter() - self.last_checkpoint > CHECKPOINT_EVERY:
                writer.flush()
                self._write_checkpoint(self.last)
        bar.step(end.time, end.steps)

    def _write_checkpoint(self, point: _RestartPoint) -> None:
        ledger = asdict(point.ledger)
        pair_energy = ledger.pop("pair_energy")
        state = point.end.state
        assert state is not None
        write_checkpoint(
            self.checkpoint,
            {
                **{f"{_STATE}{name}": values for name, values in state.items()},
                "time": np.array([point.end.time]),
                "q": point.end.q,
                "u": point.end.u,
                "ledger": np.array(list(ledger.values())),
                "pair_energy": pair_energy,
                "travel": np.array([seen.drive.travel for seen in self.seen[: point.seen]]),
                "force": np.array([seen.drive.force for seen in self.seen[: point.seen]]),
                "pair_force": np.array([seen.pair_force for seen in self.seen[: point.seen]]),
                "point": np.array([seen[2:] for seen in self.seen[: point.seen]]),
            },
            {
                "case": self.loaded.text,
                "made_by": json.dumps(made_by()),
                "steps": point.end.steps,
                "records": point.written[0],
                "samples": point.written[1],
                "warnings": self.warnings,
                "events": json.dumps([asdict(event) for event in point.end.events]),
            },
        )
        self.last_checkpoint = time.perf_counter()

    def _read_checkpoint(self) -> _RestartPoint | None:
        """Restart point of a checkpoint of the same case; None if there is none.

        A checkpoint of another version is not used: its internal state may have another meaning.
        """
        if not self.checkpoint.is_file() or not part_path(self.target).is_file():
            return None
        arrays, attributes = read_checkpoint(self.checkpoint)
        try:
            return self._point(arrays, attributes)
        except READ_ERRORS as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())[:100]
            what = f"is damaged ({reason}); run without --resume, or delete it to start from the beginning"
            raise CaseError(what, str(self.checkpoint)) from error

    def _check(self, arrays: dict[str, np.ndarray], attributes: dict[str, Any]) -> None:
        """Raise a ValueError if the content of a checkpoint does not fit this case."""
        q, u = self.system.initial()
        pairs = self.system.energy(0.0, q, u).pair_power
        shapes = {"time": (1,), "q": q.shape, "u": u.shape, "pair_energy": pairs.shape, "ledger": (len(fields(Ledger)) - 1,)}
        for name, shape in shapes.items():
            if arrays[name].shape != shape or not np.all(np.isfinite(arrays[name])):
                raise ValueError(f"{name} is not finite, or its shape is not {shape}")
        if min(int(attributes[name]) for name in ("steps", "records", "samples")) < 0:
            raise ValueError("steps, records or samples are negative")
        if not all(isinstance(text, str) for text in attributes["warnings"]):
            raise ValueError("a warning is not a string")

    def _point(self, arrays: dict[str, np.ndarray], attributes: dict[str, Any]) -> _RestartPoint | None:
        """Restart point of a checkpoint; None if it belongs to another case or version."""
        if attributes.get("case") != self.loaded.text:
            self.of_another_case = True
            return None
        if "steps" not in attributes:
            return None
        if attributes.get("made_by") != json.dumps(made_by()):
            why = "was written by another version of fsm or its libraries: the run starts from the beginning"
            self.warnings.append(f"{self.checkpoint} {why}")
            return None
        self._check(arrays, attributes)
        self.warnings = list(attributes["warnings"])
        self.seen = list(_points(arrays))
        state = {name.removeprefix(_STATE): values for name, values in arrays.items() if name.startswith(_STATE)}
        events = tuple(Event(**event) for event in json.loads(attributes["events"]))
        end = StepEnd(float(arrays["time"][0]), arrays["q"], arrays["u"], int(attributes["steps"]), events, state)
        ledger = Ledger(*[*arrays["ledger"].tolist(), arrays["pair_energy"]])
        return _RestartPoint(end, ledger, len(self.seen), (int(attributes["records"]), int(attributes["samples"])))


def _merged(one: Iterable[float], two: Iterable[float], same: float) -> list[float]:
    """All times in ascending order, without duplicates."""
    times: list[float] = []
    for t in sorted([*one, *two]):
        if not times or t > times[-1] + same:
            times.append(t)
    return times


def _due(times: deque[float], now: float) -> bool:
    """Whether at least one of the times has passed; passed times are removed."""
    passed = False
    while times and times[0] <= now * (1.0 + _SAME):
        times.popleft()
        passed = True
    return passed


def _points(arrays: dict[str, np.ndarray]) -> Iterator[CurvePoint]:
    """Points of the curve in a checkpoint."""
    columns = arrays["travel"], arrays["force"], arrays["pair_force"], arrays["point"].tolist()
    for travel, force, pairs, (at, path, panels, creases) in zip(*columns, strict=True):
        yield CurvePoint(DriveState(travel, force), pairs, at, int(path), panels, creases)


def _counters(statistics: Statistics) -> dict[str, Any]:
    """Counters of a solve for the results file."""
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
