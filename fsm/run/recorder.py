"""Recording of one solve: results file, checkpoints, restart and summary."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fsm.analyses import analysis as steps_of
from fsm.analyses.analysis import Analysis, RunStep, States, StepResult
from fsm.analyses.at_start import equilibrium_at_start
from fsm.analyses.choose import analysis_of
from fsm.analyses.comparison import Comparison, Statement, compared
from fsm.analyses.load_path import loads_at, loads_at_end, static_load_path
from fsm.analyses.panel_crossing import lattice_overlap
from fsm.case.derived.recorded import records_channels
from fsm.case.loading.load_case import LoadedCase
from fsm.case.loading.toml_text import case_text
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.errors import CaseError, EnergyAbort, FsmError, NotConverged, is_interrupt
from fsm.io.hdf5_checked import READ_ERRORS
from fsm.io.provenance import made_by, provenance
from fsm.kernels import jit
from fsm.model.elements.joint_forces import joint_events
from fsm.model.system.system import SegmentSystem
from fsm.results.attributes import stored_attributes
from fsm.results.channel import extremes_of
from fsm.results.checkpoint_file import read_checkpoint
from fsm.results.curve import ForceCurve
from fsm.results.records import Records
from fsm.results.reported import largest_reactions, report_of
from fsm.results.solution import Solution, stacked
from fsm.results.step_data import LoadPath, StepModes
from fsm.results.store import part_path
from fsm.results.writer import ResultWriter
from fsm.run.checkpoint import RestartPoint, check_point, read_point, write_point
from fsm.run.due_times import SAME, due, merged
from fsm.run.progress import Progress, report_restart
from fsm.run.round_off import position_round_off_energy, round_off_of
from fsm.run.summary import counters_of, state_errors, summary_of
from fsm.solve.interface.records import as_rows, mapped, row_of
from fsm.solve.interface.system import System
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import AcceptedStep, CurvePoint, SavedState, Statistics
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.simulate import simulate
from fsm.solve.statics.arc_length import ArcSettings
from fsm.solve.time.run import just_after

if TYPE_CHECKING:
    from fsm.channels.conditions import EventWatch
    from fsm.channels.sample import ChannelSampler

OnState = Callable[[System, float, np.ndarray, CurvePoint | None, bool], None]
"""Function of the system, the time (s), the configuration, the point of the force curve there, if there is one, and whether
the system is in this state; if not, it is in a later one.
"""
CHECKPOINT_EVERY = 1.0
"""Wall time between checkpoints, s; one checkpoint takes about 10 ms."""


class RecordedSolve:
    """Solve of one case that writes records during the run and checkpoints at intervals.

    Parameters
    ----------
    loaded : LoadedCase
    analysis : analysis of the compiled case
    out : folder of the results; None: nothing is written
    resume : bool
        Restart from a checkpoint in `out` if there is one of the same case.
    warnings : list of str
        Warnings before the solve.
    on_state : callable, optional
        Receives every state of equilibrium paths; see `OnState`.
    """

    def __init__(
        self,
        loaded: LoadedCase,
        analysis: Analysis,
        out: Path | None,
        resume: bool,
        warnings: list[str],
        on_state: OnState | None = None,
    ) -> None:
        self.loaded, self.analysis, self.on_state = loaded, analysis, on_state
        self.system = analysis.system
        self.warnings = list(warnings)
        self.channels: ChannelSampler | None = None
        self.judges = True  # whether records have the stability that the solver has not judged
        if records_channels(loaded.case, getattr(analysis, "scene", None)):
            from fsm.channels import sample  # this import loads all kinds of elements

            self.channels = sample.ChannelSampler(sample.model_of_analysis(analysis))
        self.watch: EventWatch | None = None
        if loaded.case.event:
            from fsm.channels import conditions, sample

            self.watch = conditions.EventWatch(sample.model_of_analysis(analysis), str(loaded.path))
        self.target = None if out is None else out / "result.h5"
        self.checkpoint = None if out is None else out / "checkpoint.h5"
        self.last_checkpoint = time.perf_counter()
        self.points: list[CurvePoint] = []
        self.of_another_case = False
        self.resumed = self._read_checkpoint() if resume else None
        self.steps = analysis.steps()
        if out is not None:
            (out / "summary.json").unlink(missing_ok=True)  # this file marks a complete run
        if self.resumed is None and self.checkpoint is not None:
            self.checkpoint.unlink(missing_ok=True)  # the file belongs to an earlier run, whose records are replaced
        resumed = self.resumed
        self.records, self.samples = (0, 0) if resumed is None else resumed.written
        self.number = 0 if resumed is None else resumed.step
        self.states: States | None = None if resumed is None else resumed.states
        self.energy_balance: EnergyBalance | None = None if resumed is None else resumed.energy_balance
        self.done: list[StepResult] = [] if resumed is None else list(resumed.done)
        self.modes: list[StepModes] = [] if resumed is None else list(resumed.modes)
        self.until = -1.0 if resumed is None else resumed.end.time * (1.0 + SAME)
        self.stored: float | None = None
        self.current = self.system
        self.latest: AcceptedStep | None = None
        self.last: RestartPoint | None = None

    def run(
        self,
        progress: bool | Callable[[float], None],
        begun: float,
        compiled: float,
        on_result: Callable[[Solution], None] = lambda solution: None,
    ) -> Solution:
        """Run all steps and write the results file.

        Parameters
        ----------
        progress : bool or callable
        begun, compiled : s
            Clock and compile time at the start of the run.
        on_result : function
            Receives the complete result before its file is written.
        """
        if self.of_another_case and self.checkpoint is not None:
            report_restart(progress, self.checkpoint)
        methods = [f"{step.method}: {step.reason}" for step in self.steps if step.settings is not None]
        layout = replace(
            self.analysis.layout(),
            case_text=self.loaded.text,
            provenance=stored_attributes(provenance() | {"method": "; ".join(dict.fromkeys(methods))}),
            channels=self.channels.infos if self.channels else (),
            step_names=tuple(step.name for step in self.steps),
        )
        bar = Progress(progress, self.steps[-1].end, self.loaded.case.title or str(self.loaded.path), jit)
        resume_at = self.records if self.resumed else None
        target, done = self.target, self.samples
        with Records(layout) if target is None else ResultWriter(target, layout, resume_at, samples_at=done) as writer, bar:
            try:
                for number in range(self.number, len(self.steps)):
                    self.number = number
                    self._run_step(self.steps[number], writer, bar)
            except (KeyboardInterrupt, SystemError) as error:
                if not is_interrupt(error):
                    raise
                writer.flush()
                if self.last is not None:
                    self._write_checkpoint(self.last)
                raise KeyboardInterrupt from None
            # the cause may be round-off, or squares of a lattice that touch each other
            except (NotConverged, EnergyAbort) as error:
                refusal, beyond = self._causes(writer.solution()) if self.records else ("", "")
                if refusal:
                    raise NotConverged(refusal) from error
                text = self._named(str(error))
                raise type(error)(f"{text}. {beyond[0].upper()}{beyond[1:]}" if beyond else text) from error
            solution = writer.solution()
            round_off = round_off_of(self.system, solution)
            if round_off.refusal():
                raise NotConverged(round_off.refusal())
            watch = partial(_further, bar)
            solution.array = self.analysis.array_motion(solution, self.warnings, watch)
            statistics, energy_balance = steps_of.total_of(self.done, self.points), self.energy_balance
            assert energy_balance is not None
            arcs = [number for number, result in enumerate(self.done, 1) if result.method == "arc-length"]
            events, unlisted = joint_events(self.current)
            self.warnings += unlisted
            if self.watch is not None:
                self.warnings += self.watch.missing(self.current)
                rows = [*events.get("joint_events", ()), *self.watch.rows(self.current)]
                events = {"joint_events": sorted(rows, key=lambda row: row["time"])} if rows else {}
            summary = summary_of(self.analysis, solution, statistics, energy_balance, self.warnings, round_off, arcs) | {
                "loads": steps_of.final_loads(self.done),
                "step": steps_of.step_summaries(self.done, self.points, solution),
            }
            summary |= events
            solution.load_path = LoadPath.of([result.path for result in self.done])
            state_errors(summary, self._errors(bar, solution, statistics, summary))
            if self.channels:
                summary["channels"] = extremes_of(solution.channels, solution.time, solution.travel)
                summary["report"] = report_of(solution.channels, self.channels.report, solution.time)
                summary["reactions"] = largest_reactions(solution.channels, solution.time)
            summary |= {"compile_time_s": jit.compile_time() - compiled, "wall_time_s": time.perf_counter() - begun}
            driven = bool(self.points) and len(self.points[0].drive.travel) > 0
            solution.curve = ForceCurve.from_points(self.points).decimate().without_pairs() if driven else None
            solution.stats, solution.summary = stored_attributes(counters_of(statistics)), stored_attributes(summary)
            solution.modes = StepModes.joined(self.modes)
            on_result(solution)
            writer.finish(solution)
        if self.checkpoint is not None:
            self.checkpoint.unlink(missing_ok=True)
        return solution

    def _errors(
        self, bar: Progress, solution: Solution, statistics: Statistics, summary: dict[str, Any]
    ) -> dict[str, Statement]:
        """Errors of the summary by their causes, with further runs of the case."""
        found: dict[str, Statement] = {}
        for cause, stated in self.analysis.stated_errors(solution, statistics, summary).items():
            if not isinstance(stated, Comparison):
                found[cause] = stated
                continue
            try:
                others = [self._further_run(case, stated, bar, cause) for case in stated.cases]
            except (FsmError, OSError) as error:  # the results of the run itself remain valid
                found[cause] = {"by": f"not estimated: the {stated.by} failed: {error}"} | dict.fromkeys(stated.least or ())
                continue
            found[cause] = compared(stated, (solution, summary), others)
        return found

    def _further_run(self, case: Case, stated: Comparison, bar: Progress, cause: str) -> Solution:
        """Result of a run with other settings, without its files."""
        loaded = LoadedCase(case, case_text(case), self.loaded.path)
        bar.further(f"estimating the error due to {cause}", 1.0)
        analysis, warnings = analysis_of(case, str(loaded.path)), list[str]()
        analysis.coarsen(stated.coarsen, stated.records)
        analysis.initialise(warnings)
        run = RecordedSolve(loaded, analysis, None, False, warnings)
        run.channels, run.judges = None, False
        return run.run(lambda fraction: bar.step(fraction, 0), time.perf_counter(), jit.compile_time())

    def _named(self, text: str) -> str:
        """Message with the name of the step, if the case has steps."""
        step = self.steps[self.number]
        return f"step {step.name!r} ({step.kind}): {text}" if self.loaded.case.step else text

    def _run_step(self, step: RunStep, writer: Records, bar: Progress) -> None:
        """Run one step from the state at the end of the previous step."""
        after = self.resumed.end if self.resumed is not None and self.number == self.resumed.step else None
        self.current = system = self.analysis.enter(self.number, self.states)
        if after is None:
            q, u = self.analysis.begin(self.number, system, self.states)
            self._open_energy_balance(step, q, u)
        else:
            q, u = after.q, after.u
        self.records_due, self.samples_due = (
            deque(t for t in times if t > self.until) for times in (step.record_times, step.sample_times)
        )
        self.latest = None
        result = StepResult(step.name, step.kind, step.method, step.start, step.end, {}, len(self.points))
        if step.kind == "relax":
            q, u = equilibrium_at_start(system, q, step.start), np.zeros(system.nu)
            if self.energy_balance is not None:
                self._change_to(system.energy(step.start, q, None).stored)
                self._record(writer, self._still(step.start, q, u, self.energy_balance))
        elif step.kind == "modes":
            found = steps_of.step_modes(self.analysis, system, step, self.number, q)
            self.modes.append(found)
            result.frequencies = found.frequency.tolist()
            if not self.records and self.number + 1 == len(self.steps):  # the run consists of natural modes only
                assert self.energy_balance is not None
                self._record(writer, self._still(step.start, q, u, self.energy_balance))
        elif step.settings is None:
            assert self.energy_balance is not None
            saved = self._still(step.end, q, u, self.energy_balance)
            for t in [*self.records_due]:
                self._save(writer, replace(saved, time=t))
        elif isinstance(step.settings, ArcSettings):
            from fsm.solve.statics.arc_run import ArcRun

            assert self.energy_balance is not None and isinstance(system, SegmentSystem)
            path = ArcRun(system, step.settings, self.energy_balance, self.points)
            q = path.go(step.start, q, lambda t, steps: bar.step(t, steps))
            for saved in path.saved:
                if saved.time > self.until:
                    self._record(writer, saved)
            self.warnings += path.warnings
            u, result.counters, result.path = np.zeros(system.nu), steps_of.counted(path.statistics), path.loads
            result.loads = {name: tuple(rows[-1]) for name, rows in path.loads["loads"].items()}
        else:
            assert self.energy_balance is not None
            statistics = self._solve(step, writer, bar, self.energy_balance, after, (step.start, q, u))
            result.counters, result.method = steps_of.counted(statistics), statistics.method
            result.events = [asdict(event) for event in statistics.events]
            end: AcceptedStep | None = self.latest
            if end is not None:
                q, u = end.q, end.u
            if self.watch is not None and end is not None and end.time < step.end * (1.0 - SAME):
                step = self._cut(end.time)
                result.end = end.time
            if isinstance(system, SegmentSystem) and isinstance(self.system, SegmentSystem) and end is not None:
                self._displace_loads(system, self.system, end, result, writer)
        result.n_points = len(self.points)
        self.done.append(result)
        if step.record_times:
            self.until = step.end * (1.0 + SAME)
        if self.number + 1 < len(self.steps):
            self.states = self.analysis.leave(system, step.end, q, u)
            if step.settings is not None and self.energy_balance is not None:
                self.stored = self.energy_balance.stored  # a static step may end in a snap, with kinetic energy

    def _cut(self, time: float) -> RunStep:
        """Let the present step end at a time (s), at which an event has ended it; later steps begin earlier."""
        self.analysis.cut(self.number, time)
        self.system, self.steps = self.analysis.system, self.analysis.steps()
        return self.steps[self.number]

    def _displace_loads(
        self, system: SegmentSystem, whole: SegmentSystem, end: AcceptedStep, result: StepResult, writer: Records
    ) -> None:
        """Compute displacements of loads at the end of a step, at its events, and along a static step."""
        if not system.load_displacements((end.time, end.q), (end.time, end.q)):
            return
        records = writer.solution()
        result.loads = loads_at_end(system, whole, records, self.number + 1, (end.time, end.q))
        for event in result.events:
            event["loads"] = loads_at(system, whole, records, self.number + 1, event["time"])
        if result.method == "static":
            points = self.points[self.done[-1].n_points if self.done else 0 :]
            result.path = static_load_path(system, whole, records, self.number + 1, points)

    def _solve(
        self,
        step: RunStep,
        writer: Records,
        bar: Progress,
        energy_balance: EnergyBalance,
        after: AcceptedStep | None,
        start: tuple[float, np.ndarray, np.ndarray],
    ) -> Statistics:
        times = merged(self.records_due, self.samples_due, SAME * step.end)

        def on_save(saved: SavedState) -> None:
            self._save(writer, saved)

        def on_step(end: AcceptedStep) -> None:
            self._step(writer, bar, energy_balance, end)
            if each_step:
                for t, q in end.passed:
                    self._pass_on(t, q, False)
                self._pass_on(end.time, end.q)

        assert isinstance(step.settings, Settings | PathSettings)
        each_step = self.on_state is not None and isinstance(step.settings, PathSettings)
        if each_step and after is None:
            self._pass_on(start[0], start[1])
        own = self.analysis.own_solver()
        if own is not None:
            return own(step.settings.end_time, times, on_save, on_step, energy_balance)
        begins = None if after is not None else start
        state = begins, energy_balance, self.points, after
        return simulate(self.current, step.settings, times, on_save, on_step, *state, self.watch, each_step, True)[0]

    def _pass_on(self, t: float, q: np.ndarray, present: bool = True) -> None:
        """Give a state of a path to `on_state`; `present`: it is that of the system."""
        assert self.on_state is not None
        point = next((point for point in reversed(self.points) if point.time <= t), None)
        self.on_state(self.current, t, q, point if point is not None and point.time == t else None, present)

    def _open_energy_balance(self, step: RunStep, q: np.ndarray, u: np.ndarray) -> None:
        """Open the energy balance at the first step after the search for the start, and update it in later steps."""
        state = (step.start, q, u)
        if self.energy_balance is None:
            if step.kind != "relax" or step is self.steps[-1]:
                balance = self.energy_balance = EnergyBalance.opened(self.current.energy(*state), self.current.scales().work)
                balance.round_off_floor = max(balance.round_off_floor, position_round_off_energy(self.current, state))
                self.stored = balance.start
        else:
            begin, moves = just_after(self.current, step.start), step.kind == "dynamic" or bool(u.any())
            self._change_to(self.current.energy(begin, q, u if moves else None).stored)

    def _change_to(self, stored: float) -> None:
        """Update the balance after a jump of the state: a loss of stored energy is dissipated, a gain is external work."""
        energy_balance = self.energy_balance
        assert energy_balance is not None
        change = 0.0 if self.stored is None else stored - self.stored
        energy_balance.work += max(change, 0.0)
        energy_balance.dissipated += max(-change, 0.0)
        self.stored = stored

    def _still(self, t: float, q: np.ndarray, u: np.ndarray, energy_balance: EnergyBalance) -> SavedState:
        """State at rest to be saved."""
        observed = self.current.observe(t, q, None if not u.any() else u)
        pairs = energy_balance.pair_energy if energy_balance.pair_energy.size else np.zeros_like(observed.energy.pair_power)
        lost, work, error = energy_balance.dissipated, energy_balance.work, energy_balance.residual(observed.energy.stored)
        numerical = energy_balance.numerical
        return SavedState(t, q, u, observed, lost, work, error, pairs, numerical=numerical, at_rest=not u.any())

    def _causes(self, solution: Solution) -> tuple[str, str]:
        """Messages on two possible causes of a failed solve: round-off, and contact of lattice squares."""
        scene = getattr(self.analysis, "scene", None)
        meeting = lattice_overlap(solution, scene) if isinstance(scene, Scene) else ""
        return round_off_of(self.system, solution).refusal(), meeting

    def _save(self, writer: Records, saved: SavedState) -> None:
        """Write a record of the whole state, a sample of the probes, or both, as required at this time."""
        rows = saved if np.ndim(saved.time) else self._rows(saved)
        recorded = [k for k, at in enumerate(rows.time.tolist()) if due(self.records_due, at) or saved.final]
        if len(recorded) == len(rows.time):
            self._record_rows(writer, rows)
        elif recorded:
            self._record_rows(writer, mapped(rows, lambda values: values[recorded]))
        for at, q in zip(rows.time.tolist(), rows.q, strict=True):
            if due(self.samples_due, at):
                writer.sample(at, self.analysis.probes(q))
                self.samples += 1

    def _rows(self, saved: SavedState) -> SavedState:
        """A state as several; the system gets its internal variables."""
        if saved.memory is not None:
            self.current.restore(saved.memory)
        return as_rows(replace(saved, observed=saved.observation))

    def _negative_pivots(self, saved: SavedState, times: np.ndarray) -> Any:
        """Negative pivots of the stiffness at saved states, as counted by the solver, else by the analysis."""
        if saved.negative_pivots is not None:
            return np.full(len(times), saved.negative_pivots)
        if not self.judges:
            return np.zeros(len(times), dtype=np.int64)
        numbers = self._in_turn(saved)
        return [self.analysis.negative_pivots(self.current, float(times[k]), saved.q[k]) for k in numbers]

    def _in_turn(self, saved: SavedState) -> Iterable[int]:
        """Numbers of several states; elements have the memory of each in turn."""
        memories = saved.element_memory
        return range(len(saved.q)) if memories is None else self.current.in_turn(memories)

    def _without_false_motion(self, saved: SavedState) -> SavedState:
        """States, those of a path whose drives rest without kinetic energy: the time of a path in load is no time of a
        motion.
        """
        system, before = self.current, saved.before
        if before is None or not isinstance(system, SegmentSystem):
            return saved
        middles = 0.5 * (before[0] + saved.time)
        moves = np.zeros(len(middles), dtype=bool)
        for motion in system.motions:
            moves |= motion.program.over(middles)[1] != 0.0
        kinetic: Any = np.where(moves, saved.observation.energy.kinetic, 0.0)
        energy = replace(saved.observation.energy, kinetic=kinetic)
        return replace(saved, observed=replace(saved.observation, energy=energy))

    def _channel_values(self, saved: SavedState, times: np.ndarray) -> dict[str, Any]:
        """Values of all channels at saved states, by name."""
        if self.channels is None:
            return {}
        nothing: Any = ()
        rows = replace(saved, observed=nothing)  # few channels need an observation
        states = (
            replace(row_of(rows, k), time=float(times[k]), observed=partial(row_of, saved.observation, k))
            for k in self._in_turn(saved)
        )
        found = [self.channels.values(self.current, state) for state in states]
        return {info.name: [values[info.name] for values in found] for info in self.channels.infos}

    def _record(self, writer: Records, saved: SavedState) -> None:
        self._record_rows(writer, self._rows(saved))

    def _record_rows(self, writer: Records, saved: SavedState) -> None:
        """Record several states, see `OutputRequest.several`."""
        saved = self._without_false_motion(saved)
        observed, times, count = saved.observation, np.asarray(saved.acting), len(saved.q)
        states = zip(times.tolist(), saved.q, saved.u, strict=True)
        q, u = zip(*(self.analysis.whole(self.current, t, *state) for t, *state in states), strict=True)
        energy = {
            **observed.energy.potential, "kinetic": observed.energy.kinetic, "dissipated": saved.dissipated,
            "work": saved.work, "error": saved.error, "numerical": saved.numerical,
        }  # fmt: skip
        values = {
            "time": saved.time, "q": q, "u": u, "travel": observed.drive.travel, "force": observed.drive.force,
            **{f"pair_{name}": each for name, each in vars(observed.pairs).items()},
            "pair_friction_energy": saved.pair_energy[:, 0], "pair_damping_energy": saved.pair_energy[:, 1],
            "shape": self.current.shapes(times, saved.q), "negative_pivots": self._negative_pivots(saved, times),
            "step": np.full(count, self.number + 1), "program_time": times, "memory": self._memory(saved),
        }  # fmt: skip
        writer.extend(stacked(values, energy, self._channel_values(saved, times)))
        self.records += count

    def _memory(self, saved: SavedState) -> np.ndarray:
        """Internal variables of the elements at several states, in rows as long as those of the system of all steps."""
        memory = saved.element_memory
        if memory is None:
            memory = np.tile(self.current.element_memory(), (len(saved.q), 1))
        if self.current is self.analysis.system:
            return memory
        return np.pad(memory, ((0, 0), (0, len(self.analysis.system.element_memory()) - memory.shape[1])))

    def _step(self, writer: Records, bar: Progress, energy_balance: EnergyBalance, end: AcceptedStep) -> None:
        self.latest = end
        if end.state is not None:
            self.last = RestartPoint(
                end, replace(energy_balance), len(self.points), (self.records, self.samples), self.number, self.states,
                tuple(self.done), tuple(self.modes),
            )  # fmt: skip
            if self.checkpoint is not None and time.perf_counter() - self.last_checkpoint > CHECKPOINT_EVERY:
                writer.flush()
                self._write_checkpoint(self.last)
        bar.step(end.time, end.steps)

    def _write_checkpoint(self, point: RestartPoint) -> None:
        if self.checkpoint is None:
            return
        own = {"case": self.loaded.text, "made_by": json.dumps(made_by()), "warnings": self.warnings}
        write_point(self.checkpoint, point, self.points, own)
        self.last_checkpoint = time.perf_counter()

    def _read_checkpoint(self) -> RestartPoint | None:
        """Restart point of a checkpoint of the same case; None if there is none.

        A checkpoint of another version is not used: its internal state may have another meaning.
        """
        if self.target is None or self.checkpoint is None:
            return None
        if not self.checkpoint.is_file() or not part_path(self.target).is_file():
            return None
        arrays, attributes = read_checkpoint(self.checkpoint)
        try:
            return self._point(arrays, attributes)
        except READ_ERRORS as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())[:100]
            what = f"is damaged ({reason}); run without --resume, or delete it to start from the beginning"
            raise CaseError(what, str(self.checkpoint)) from error

    def _point(self, arrays: dict[str, np.ndarray], attributes: dict[str, Any]) -> RestartPoint | None:
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
        point, self.points = read_point(arrays, attributes)
        for number, result in enumerate(point.done):
            if result.end < self.analysis.steps()[number].end:
                self.analysis.cut(number, result.end)
                self.system = self.analysis.system
        check_point(self.analysis.enter(point.step, point.states), arrays, attributes)
        self.warnings = list(attributes["warnings"])
        return point


def _further(bar: Progress, name: str, end: float) -> Callable[[AcceptedStep], None]:
    """Function that shows the progress of a further solve after each of its steps."""
    bar.further(name, end)
    return lambda step: bar.step(step.time, step.steps)
