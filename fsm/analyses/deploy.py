"""Deployment of a strip, or the motion of a scene, by finite segments."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np

from fsm.analyses.analysis import Analysis, RunStep, StatedErrors, States
from fsm.analyses.comparison import (
    ASK_FOR_ALL,
    Comparison,
    Statement,
    finer_mesh,
    larger_steps,
    not_compared,
    other_meshes,
    other_segments,
    path_events,
)
from fsm.analyses.deploy_warnings import DEEP, deploy_warnings, unstable_end
from fsm.analyses.segment_error import SegmentError
from fsm.case.derived.joint_margin import margin_results
from fsm.case.models.case import Case
from fsm.case.models.sheet import SHELLS
from fsm.case.plan.step_items import start_of
from fsm.errors import FsmError, NotConverged
from fsm.model.compile.compile_case import compile_case, compile_planned, path_settings
from fsm.model.elements.creases import CreaseGroup
from fsm.model.elements.hysteresis import HysteresisGroup
from fsm.model.elements.ligaments import LigamentGroup
from fsm.model.faults.separate import shallowest
from fsm.model.plan.plan import plan_of
from fsm.model.plan.planned import PlannedStep, save_times
from fsm.model.system.step_system import system_in_step, whole_system
from fsm.model.system.system import SegmentSystem
from fsm.results.curve import ForceCurve
from fsm.results.quantities import bent_energy, summarise, summarise_contacts, summarise_drives
from fsm.results.solution import Layout, Solution
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.equations.newton import negative_pivots
from fsm.solve.interface.system import System
from fsm.solve.outcome.run_io import Statistics
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.statics.arc_length import ArcSettings
from fsm.text.shown_units import negative_margins, shown

_NAMED = 3
_FEWER = 0.7
"""Ratio of the unknowns of a coarser mesh to those of the mesh itself, below which both are compared."""

_COARSER = 4.0
"""Ratio of the steps that resolve impacts, for the error of a motion. With twice the steps the difference is small by
coincidence in one of four motions (`validation/errors`)."""
_SPARSER = 2
"""Records of a motion for each record of its further run. Steps end at records, so with all of them a larger tolerance may
give the same steps, and no difference."""
_SAFE = 3.0
"""Factor of the differences of motions with other steps, whose order is irregular."""

_VERBS = {"bifurcation": "has a bifurcation", "motion": "has a motion", "release": "begins with a motion"}
"""Words on an event of a path by its kind; other kinds are snaps."""
_LIMITS = "; limit points are interpolated, see them with half of solve.max_step"


class Deployment(Analysis):
    """Compiled strip or scene; see `Analysis`.

    Parameters
    ----------
    case : Case
    source : name of the file in messages
    warnings : warnings on changed values are appended

    Attributes
    ----------
    scene : Scene
    system : SegmentSystem
    """

    system: SegmentSystem

    def __init__(self, case: Case, source: str, warnings: list[str] | None) -> None:
        self.case = case
        self.scene, self.system, plan = compile_planned(case, source, warnings)
        self.plan = plan or plan_of(case, self.scene)
        if self.plan.written:  # the travels refer to the whole run
            self.system = whole_system(self.system, self.scene, self.plan)
        self._pivots = LinearSolver()
        self._records = 1
        self._steps: list[RunStep] = []

    @property
    def kernels(self) -> tuple[str, ...]:
        """See `Analysis`."""
        space, method = "spatial" if self.system.spatial else "planar", self.method()[0]
        compiled = not self._in_python([step for step in self.plan.steps if step.method == method][-1])
        if self.case.sheet is not None:
            return self._kernels_of_sheet(method)
        found = [space]
        if self.scene.flexible:
            found.append("films, cables, beams, trusses")
        if self.scene.films:
            found.append("film")
        if self.case.contact is not None and self.case.strip is None:
            found.append("plates")
        if any(isinstance(group, LigamentGroup) for group in self.system.groups):
            found.append("lattice")
        if any(isinstance(group, HysteresisGroup) for group in self.system.groups):
            found.append(f"hysteresis, {space}")
        if method == "static":
            if compiled:
                curved = any(isinstance(group, CreaseGroup) for group in self.system.groups)
                found.append(f"statics {'with tabulated creases' if curved else 'in one kernel'}, {space}")
            return tuple(found)
        found.append(f"in time, {space}")
        if method == "Radau-blocks":
            found.append(f"structured Radau, {space}")
        elif method in ("generalized-alpha", "newmark") and compiled:
            found.append(f"steps in one kernel, {space}")
        elif method == "mean-force" and compiled and not self.scene.flexible:
            found.append(f"mean-force method, {space}")
        return tuple(found)

    def _kernels_of_sheet(self, method: str) -> tuple[str, ...]:
        sheet = self.case.sheet
        assert sheet is not None
        if method == "arc-length":
            found = ["arc length"]
        else:
            found = [f"{sheet.facets} facets, {'static' if method == 'static' else 'in time'}"]
        if sheet.kind in SHELLS:
            found.append("shells")
        if method == "mean-force":
            found.append("mean-force method, spatial")
        return (*found, *(["gas"] if self.case.gas else []))

    def method(self) -> tuple[str, str]:
        """Method of the last step that is solved, and the reason."""
        last = [step for step in self.plan.steps if step.kind in ("static", "dynamic")][-1:] or self.plan.steps[-1:]
        return last[0].method, last[0].reason

    def settings(self, method: str) -> Settings | PathSettings | ArcSettings:
        """Settings of the solver for a method, with the settings of the last step."""
        return self._settings(replace(self.plan.steps[-1], method=method))

    def _settings(self, step: PlannedStep) -> Settings | PathSettings | ArcSettings:
        solve, end = step.solve, step.end
        max_step = solve.max_step or math.inf
        if step.method == "arc-length":
            longest = min(ArcSettings.longest, max_step / (end - step.start))
            return ArcSettings(end, min(ArcSettings.first, longest), longest, solve.max_steps, solve.branch or 0.0)
        if step.method != "static":
            settings = Settings(
                step.method, solve.rtol, end, max_step, solve.max_steps, solve.energy_abort, step=solve.step,
                start_time=step.start,
            )
            return settings if solve.rho_inf is None else replace(settings, rho_inf=solve.rho_inf)
        if not self.plan.written:
            return path_settings(self.case, self.system, end, step.start)
        first = (end - step.start) / 200.0
        begun = next((k for k, acts in enumerate(step.acting) if acts), None)
        if solve.increment is not None and begun is not None:
            program = self.plan.programs[begun]
            gone = program.gone(step.start)
            if program.gone(end) > gone:
                first = min(program.time_of(gone + solve.increment), end) - step.start
        return PathSettings(
            end, first, max_step, solve.rtol, solve.max_steps, solve.imperfection, solve.energy_abort, step.start
        )

    def steps(self) -> list[RunStep]:
        """See `Analysis`."""
        self._steps = self._steps or [self._run_step(step) for step in self.plan.steps]
        return self._steps

    def _run_step(self, step: PlannedStep) -> RunStep:
        times: list[float] = []
        if step.end > step.start:
            begun = next((k for k, acts in enumerate(step.acting) if acts), None)
            program = None if begun is None else self.plan.programs[begun]
            times = save_times(step.save, program, step.end, step.start)
            if self._records > 1:
                times = [*times[: -1 : self._records], times[-1]]
        settings = self._settings(step) if step.solved else None
        return RunStep(
            step.name, step.kind, step.start, step.end, step.method, step.reason, settings, times,
            modes=step.modes if step.kind == "modes" else 0,
        )  # fmt: skip

    def in_python(self) -> tuple[str, ...]:
        """See `Analysis`."""
        solved = [step for step in self.plan.steps if step.solved]
        return tuple(dict.fromkeys(reason for step in solved for reason in self._in_python(step)))

    def _in_python(self, step: PlannedStep) -> tuple[str, ...]:
        """Reasons why a step is computed in Python."""
        if step.method == "static":
            return (*step.in_python.of(step.method), *self.system.large_statics(self._pivots.ready))
        return (*step.in_python.of(step.method), *(self.system.large_contacts() if step.contact else ()))

    def cut(self, number: int, time: float) -> None:
        """See `Analysis`."""
        planned = self.plan.steps
        if self.plan.written:
            first = len(planned) - len(self.case.step)  # a step "start" before those of the case
            steps = list(self.case.step)
            steps[number - first] = steps[number - first].model_copy(update={"duration": time - planned[number].start})
            self.case = self.case.model_copy(update={"step": tuple(steps)})
            self.plan = plan_of(self.case, self.scene)
            self.system = whole_system(self.system, self.scene, self.plan)
        else:
            ended = (*planned[:number], replace(planned[number], end=time), *planned[number + 1 :])
            self.plan = replace(self.plan, steps=ended)
        self._steps = []

    def enter(self, number: int, states: States | None) -> SegmentSystem:
        """See `Analysis`: the system of the whole case, or a system in which the bodies of this step are free."""
        if not self.plan.written:
            return self.system
        return system_in_step(self.system, self.scene, self.plan, number, states)

    def begin(self, number: int, system: System, states: States | None) -> tuple[np.ndarray, np.ndarray]:
        """See `Analysis`: a dynamic step keeps the velocities of a dynamic step before it; all others start at rest."""
        if states is None:
            return system.initial()
        assert isinstance(system, SegmentSystem)
        q, u = system.from_states(states)
        steps = self.plan.steps
        if steps[number].contact and not steps[number - 1].contact and steps[number].kind != "relax":
            self._refuse_overlap(system, steps[number].start, q)
        last = next((step.kind for step in reversed(steps[:number]) if step.kind != "modes"), "modes")
        moves = last == "dynamic" and steps[number].kind in ("dynamic", "modes")
        return q, u if moves else self._at_first(number, system)

    def _refuse_overlap(self, system: SegmentSystem, t: float, q: np.ndarray) -> None:
        """Refuse a state in which bodies overlap deeply when their contact begins."""
        gaps = system.observe(t, q, None).pairs.gap
        if not len(gaps):
            return
        bound = max(DEEP * self.layout().thickness, shallowest(system))
        if -gaps.min() > bound:
            raise NotConverged(
                f"{system.pair_names[int(np.argmin(gaps))]} overlap by {shown(-gaps.min(), 'm')} when their contact "
                f"begins; the limit is {shown(bound, 'm')}. Separate them in an earlier step, or add a step with "
                'kind = "relax" before this one'
            )

    def _at_first(self, number: int, system: SegmentSystem) -> np.ndarray:
        """Initial velocities of the case before any motion; zero after that."""
        moved = any(step.kind in ("static", "dynamic") and not step.still for step in self.plan.steps[:number])
        return np.zeros(system.nu) if moved else system.initial()[1]

    def leave(self, system: System, t: float, q: np.ndarray, u: np.ndarray) -> States:
        """See `Analysis`."""
        assert isinstance(system, SegmentSystem)
        return system.all_states(t, q, u) | {"memory": system.memory()} | system.latched

    def whole(self, system: System, t: float, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Analysis`."""
        if system is self.system:
            return q, u
        assert isinstance(system, SegmentSystem)
        return self.system.from_states(system.all_states(t, q, u))

    def layout(self) -> Layout:
        """See `Analysis`."""
        bodies = self.system.bodies
        return Layout(
            dimension="spatial" if self.system.spatial else "planar",
            body_names=tuple(bodies.names[i] for i in bodies.free),
            panel=self.system.panels,
            quad_names=self.system.quad_names,
            pair_names=self.system.pair_names,
            drive_names=tuple(
                drive.part + (" (turn)" if drive.turn is not None else "") for drive in self.scene.drives
            ),
            thickness=max(
                (plate.thickness for _, plate, _ in bodies.plates),
                default=0.0 if self.case.sheet is None else self.case.sheet.thickness,
            ),
        )

    def negative_pivots(self, system: System, t: float, q: np.ndarray) -> int:
        """See `Analysis`; the result is zero without a drive, because a free motion does not follow equilibria."""
        assert isinstance(system, SegmentSystem)
        return negative_pivots(system, t, q, self._pivots) if len(system.driven) and system.nu else 0

    def stated_errors(self, solution: Solution, statistics: Statistics, summary: dict[str, Any]) -> StatedErrors:
        """See `Analysis`."""
        iterations = max(statistics.newton_iterations, statistics.steps)
        refused = not_compared(self.case.solve.error_estimates, iterations, self.system.dof)
        return {"mesh": self._of_mesh(solution, summary, refused), "steps": self._of_steps(solution, summary, refused)}

    def coarsen(self, factor: float, records: int) -> None:
        """See `Analysis`."""
        self._records, self._steps = records, []
        self.system.contacts.coarsen(factor)

    def _of_mesh(self, solution: Solution, summary: dict[str, Any], refused: str) -> Statement | Comparison:
        """Error due to segments or cells."""
        if self.case.strip is not None:
            return self._of_segments(solution, summary, refused)
        if self.scene.built.facets is None:
            if self.scene.films or self.scene.cables or self.scene.beams:
                return {"by": "not estimated: compare with more elements of films, cables and beams"}
            return {"by": "none: rigid bodies and bars have no mesh"}
        if refused:
            return {"by": refused}
        coarser = self._coarser_meshes()
        if coarser:
            size = "2 and 4 times" if len(coarser) > 1 else "twice"
            return Comparison(f"comparison with cells of {size} the size", coarser, cells=True)
        return Comparison("comparison with cells of half the size", (finer_mesh(self.case),), cells=True)

    def _of_segments(self, solution: Solution, summary: dict[str, Any], refused: str) -> Statement | Comparison:
        """Error due to the segments of a strip: by the energy that they do not resolve, and after a snap by further runs."""
        strip, material = self.case.strip, self.case.material
        # the energy is differentiated with respect to the travel
        forth = solution.travel.shape[1] and bool(np.all(np.diff(solution.travel[:, 0]) >= 0.0))
        if strip is None or material is None or not forth or not self._same_throughout:
            text = "not estimated: bodies differ between steps, or the first drive goes back"
            return {"by": f"{text}; compare with another strip.segments_per_panel"}
        error, forces = SegmentError(self.system, strip, material), Statement()
        peak, final = abs(summary["peak_force"]), abs(summary["final_force"])
        for of, scale in (("peak", peak), ("final", max(peak, final))):
            off = error.at(solution, summary[f"{of}_travel"], summary[f"{of}_force"])
            forces[f"{of}_force"] = None if off is None or not scale else off / scale
        touches = bool(np.any(solution.pair_force))
        by = f"bending energy that the segments do not resolve{', contact not included' if touches else ''}"
        if None in forces.values():
            by = "not estimated: no panel bends, or a panel has fewer than four segments"
        snaps = path_events(summary, summary["final_travel"])
        if not snaps:
            return {"by": by} | forces
        first, verb = snaps[0]["travel"], _VERBS.get(snaps[0]["kind"], "snaps")
        before_peak = bool(path_events(summary, summary["peak_travel"]))
        side = "before" if first < summary["peak_travel"] else "at" if before_peak else "after"
        where = f"the path {verb} at {solution.layout.travel_text(first)}, {side} its peak"
        others = other_segments(self.case)
        counts = [other.strip.segments_per_panel for other in others if other.strip is not None]
        named = re.search(r"segment \d", str(self.case.model_dump(exclude={"save", "report", "title"})))
        if not refused and not named:
            text = f"comparison with {counts[0]} and {counts[1]} segments per panel, because {where}"
            return Comparison(text if before_peak else f"{by}; final force: {text}", others, least=forces)
        more = f"compare with strip.segments_per_panel = {3 * strip.segments_per_panel // 2}"
        text = f"not estimated: {where}; {more}{', and other names of segments' if named else f', or {ASK_FOR_ALL}'}"
        if before_peak:
            return {"by": text, "peak_force": None, "final_force": None}
        return {"by": f"{by}; final force {text}"} | forces | {"final_force": None}

    def _coarser_meshes(self) -> tuple[Case, ...]:
        """Coarser meshes, each with far fewer unknowns than the one before; at most one in a dynamic case."""
        found: tuple[Case, ...] = ()
        unknowns = self.system.nu
        for coarser in other_meshes(self.case)[: 1 if self._dynamic else None]:
            try:
                fewer = compile_case(coarser)[1].nu
            except FsmError:  # the mesh is too coarse for the case
                break
            if fewer >= _FEWER * unknowns:
                break
            found, unknowns = (*found, coarser), fewer
        return found

    def _of_steps(self, solution: Solution, summary: dict[str, Any], refused: str) -> Statement | Comparison:
        """Error due to steps in time, or due to increments."""
        if not any(step.settings is not None for step in self.steps()):
            return {"by": "none: nothing moves"}
        dynamic = self._dynamic
        if not dynamic and not summary["events"] and not np.any(solution.pair_friction):
            arc = any(step.method == "arc-length" for step in self.plan.steps)
            return {"by": f"none: all records are equilibria{_LIMITS if arc else ''}"}
        if not dynamic and self.case.solve.error_estimates == "auto":
            return {"by": f'not estimated for friction and snaps on a static path; {ASK_FOR_ALL}'}
        impacts = self._with_impacts and bool(np.any(solution.pair_force))
        if refused and (self.case.solve.error_estimates == "off" or not impacts):
            return {"by": refused}
        fixed = any(isinstance(step.settings, Settings) and step.settings.step is not None for step in self.steps())
        by = f"comparison with {'steps of twice the size' if fixed else 'ten times the tolerance'} and half of the records"
        resolved = dynamic and self.system.contacts.resolves
        if resolved:
            by += ", and a quarter of the steps in an impact"
        reach = None
        if self.case.scene is not None and not self.scene.flexible:
            inertia = self.system.bodies.inertia[self.system.bodies.free]
            moments = inertia[:, 3 if self.system.spatial else 2 :]
            reach = np.sqrt(moments.max(axis=1, initial=0.0) / inertia[:, 0])
        coarsen = _COARSER if resolved else 1.0
        cases = (larger_steps(self.case),)
        return Comparison(by, cases, coarsen=coarsen, records=_SPARSER, safety=_SAFE, parts=True, reach=reach)

    @property
    def _dynamic(self) -> bool:
        """Whether any step is a motion in time."""
        return any(isinstance(step.settings, Settings) for step in self.steps())

    @property
    def _with_impacts(self) -> bool:
        """Whether the run is one motion of a [scene] whose steps have to resolve impacts."""
        dynamic = not self.plan.written and isinstance(self._settings(self.plan.steps[0]), Settings)
        return dynamic and self.case.scene is not None and self.case.strip is None and self.system.contacts.resolves

    def summarise(self, solution: Solution, statistics: Statistics) -> dict[str, Any]:
        """Peak, stages, contacts, and the error of a motion."""
        summary: dict[str, Any] = {"start": start_of(self.case, self.scene)[0]}
        if solution.travel.shape[1]:
            curve = ForceCurve.from_points(statistics.points)
            summary |= summarise(curve, solution.layout.pair_names, self._bent_energy)
            if solution.travel.shape[1] > 1:
                summary["drives"] = summarise_drives(curve, solution.layout.drive_names)
            summary["unstable_at_end"] = self._ends_on_path and unstable_end(solution)
        looked_at = np.array([point.pair_force for point in statistics.points])
        summary["contact"] = summarise_contacts(solution, looked_at, summary.get("touches", ()))
        if self.case.margin:
            found = summary["margins"] = margin_results(self.case.margin, self.scene.joints)
            summary["smallest_margin"] = min((row["margin"] for row in found if row["margin"] is not None), default=None)
        summary["contact_stats"] = self.system.contacts.stats()
        if self.case.sheet is not None:
            states = zip(solution.time, solution.q, strict=True)
            summary["joint_opening"] = max(self.system.max_joint_opening(float(t), q)[0] for t, q in states)
            summary["folded"] = self._folded(solution)
        if self.scene.built.facets is not None and self.scene.built.facets.probes:
            from fsm.analyses.facet_results import probe_displacements  # imports all kinds of elements

            summary["probe_displacement"] = probe_displacements(self.system, self.scene.built.facets, solution)
        return summary

    @property
    def _bent_energy(self) -> float | None:
        return bent_energy(self.case.model_dump(include={"strip", "material"}, exclude_none=True))

    def _folded(self, solution: Solution) -> dict[str, Any]:
        """Fractions of the rest angles that creases have reached with `sheet.fold_to`."""
        from fsm.analyses.sheet_motion import folded_parts  # imports all parts of patterns

        assert self.case.sheet is not None
        if not self.case.sheet.fold_to or self.scene.built.facets is None:
            return folded_parts(solution) if self.case.sheet.fold_to else {}
        from fsm.analyses.fold_results import folds_of  # imports all kinds of elements

        folds = folds_of(self.scene)
        if folds is None:
            return {}
        angles = folds.over_time(self.system, solution)[-1].tolist()
        return folded_parts(solution, dict(zip(folds.data.names, angles, strict=True)))

    @property
    def _same_throughout(self) -> bool:
        """Whether `system` gives the forces of all records: the same bodies and loads act in all steps, and drives follow
        the time of the records.
        """
        steps = self.plan.steps
        loaded = self.plan.written and any(step.loads for step in steps)
        alike = len({(step.held, step.contact) for step in steps}) == 1 and not loaded
        return alike and not self.system.steps_of and all(all(s.acting) and s.method != "arc-length" for s in steps)

    @property
    def _ends_on_path(self) -> bool:
        """Whether a drive acts in the last state, so that this state is not part of a free motion of a later step."""
        return not self.plan.written or self.plan.steps[-1].kind != "dynamic"

    def warnings(self, solution: Solution, summary: dict[str, Any]) -> list[str]:
        """See `fsm.analyses.deploy_warnings`."""
        return negative_margins(summary.get("margins", ())) + deploy_warnings(
            solution, summary, self.case, self.scene, self.system, self.plan, self._same_throughout, self._ends_on_path,
            self._is_structure,
        )  # fmt: skip

    @property
    def _is_structure(self) -> bool:
        """Whether a drive deploys a strip, lattice or sheet; a drive of a [scene] may be a machine."""
        return any(part is not None for part in (self.case.strip, self.case.lattice, self.case.sheet))
