"""Steps of a deployment, from `[[step]]` or from the other keys of the case.

A case without `[[step]]` is expanded. A strip that starts in equilibrium has a step "start" (relax). `release.hold_time`
gives a step "hold" at rest. The motion is the step "deploy". A run consists of such steps only.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from fsm.case.checks.check_steps import step_names
from fsm.case.models.case import Case
from fsm.case.models.loads import Drive, Load
from fsm.case.models.scene import Body, Scene
from fsm.case.models.solve import Kind, Solve, Step
from fsm.case.models.time_program import Constant, Ramp, Table, TimeFunction, end_of, shifted
from fsm.case.plan.method_selection import STATICS, automatic_method, dynamic_method, solve_of
from fsm.case.plan.step_items import DrivePart, drive_parts, loads_of, start_of
from fsm.case.schema.known_names import nearest_name
from fsm.errors import CaseError, Fault
from fsm.model.bodies.drive import Travel, parts, program_of, time_function
from fsm.model.plan.in_python import parts_in_python
from fsm.model.plan.joint_state import JointsAtStart
from fsm.model.plan.motion_method import MotionMethod
from fsm.model.plan.plan_warnings import method_faults
from fsm.model.plan.planned import Plan, PlannedStep

ALL = "all"
"""Name of all bodies, drives and loads in `hold` and `release`."""
HOLD = 0.01
"""Rest time of the drives after a pull, relative to the duration of the pull; damper forces decay in this time."""
_ROUNDING = 1e-12
"""Relative difference of times below which they are equal."""
_STATIC_DURATION = 1.0
"""Duration of a static step in which no drive and no load has an end, s."""


def plan_of(case: Case, scene: Scene) -> Plan:
    """Steps of a case.

    Parameters
    ----------
    case : Case
    scene : Scene
        Scene of the case (`fsm.builders.scene.build_scene`).

    Raises
    ------
    CaseError
        Names that do not exist, and steps without an end.
    """
    plan = _Planner(case, scene).plan() if case.step else _short(case, scene)
    faults = list(method_faults(plan, scene))
    if faults:
        raise CaseError(faults)
    steps = []
    for number, step in enumerate(plan.steps):
        name = plan.name_for_joints(number) if plan.written else None
        in_python = parts_in_python(scene, name, step.contact)
        steps.append(replace(step, in_python=in_python))
    return replace(plan, steps=tuple(steps))


def _short(case: Case, scene: Scene) -> Plan:
    """Steps of a case without `[[step]]`."""
    programs = tuple(program_of(drive, f"drive.{k}") for k, drive in enumerate(scene.drives))
    end = case.solve.end_time
    if end is None:
        if not programs:
            text = "missing, and there is no drive, so the run has no end; give one of them"
            raise CaseError(Fault("solve.end_time", text))
        end = max(program.end_time for program in programs) * (1.0 + HOLD if case.stages else 1.0)
    chosen = case.solve.method
    solve = solve_of(case.solve, scene)
    method, reason = _automatic(case, scene, end, solve.rtol) if chosen == "auto" else (chosen, "requested")
    if case.solve.force_limit is not None and method != "static":
        text = f'is used by method = "static" only; "auto" selects "{method}" ({reason}). Set solve.method = "static"'
        raise CaseError(Fault("solve.force_limit", f"{text}, or remove this key"))
    held = frozenset(body.name for body in scene.bodies if body.held)
    kind: Kind = "static" if method in ("static", "arc-length") else "dynamic"
    release = 0.0 if case.release is None else case.release.hold_time
    loads = tuple(load for _, load in loads_of(case))
    motion = PlannedStep(
        "deploy", kind, release, end, method, reason, solve, case.save, (True,) * len(programs), loads,
        held,
    )  # fmt: skip
    steps = [motion]
    if release:
        steps.insert(0, replace(motion, name="hold", kind="static", start=0.0, end=release, method="hold", still=True))
    if start_of(case, scene)[0] == "equilibrium":
        steps.insert(0, _relaxing(motion))
    return Plan(tuple(steps), programs, False)


def _automatic(case: Case, scene: Scene, end: float, rtol: float) -> tuple[str, str]:
    """Method and reason of a case without steps that ends at this time (s)."""
    if not scene.joints or scene.flexible:
        return automatic_method(scene, bool(case.stages))
    motion = MotionMethod(JointsAtStart(scene))
    method, reason = automatic_method(scene, bool(case.stages), motion.unheld)
    return (method, reason) if method in STATICS else motion.choice(end, rtol, reason)


def _relaxing(step: PlannedStep) -> PlannedStep:
    """Step "start" before the first one."""
    return replace(step, name="start", kind="relax", start=0.0, end=0.0, method="relax", reason="", described=())


@dataclass
class _Acting:
    """Active load: name, load, factor over the time of the run, and whether it ends in this step."""

    name: str
    load: Load
    function: TimeFunction
    ends: bool = False

    def as_load(self) -> Load:
        """The load with its function of the time of the whole run."""
        return self.load.model_copy(update={"time": self.function})


def _on_line(drive: Drive) -> bool:
    """Whether a drive moves a crease line or an end line of a strip."""
    return drive.crease is not None or drive.end is not None


class _Planner:
    def __init__(self, case: Case, scene: Scene) -> None:
        self.case, self.scene = case, scene
        self.faults: list[Fault] = []
        self.drives = drive_parts(case)
        self.targets = max((part.target for part in self.drives), default=-1) + 1
        self.parts: list[list[tuple[float, float, Travel]]] = [[] for _ in range(self.targets)]
        self.massless = {body.name for body in scene.bodies if _weightless(body)}
        self.acting = [self._is_line(k) for k in range(self.targets)]
        self.started = [False] * self.targets
        self.held = {body.name for body in scene.bodies if body.held}
        self.frames = {frame.name for frame in scene.frames}
        self.fixed = self.frames | {name for k, drive in enumerate(scene.drives) if self._is_line(k) for name in drive.moved}
        self.loads: list[_Acting] = []

    def plan(self) -> Plan:
        """Plan all steps, or raise the faults of the case."""
        steps: list[PlannedStep] = []
        time = 0.0
        for number, (name, step) in enumerate(zip(step_names(self.case.step), self.case.step, strict=True)):
            planned = self._step(number, name, step, time)
            self._unchanging(planned, number)
            steps.append(planned)
            time = planned.end
        self.faults += self._unused_weightless(steps)
        if self.faults:
            raise CaseError(self.faults)
        if start_of(self.case, self.scene)[0] == "equilibrium" and steps[0].kind != "relax":
            steps.insert(0, _relaxing(steps[0]))
        return Plan(tuple(steps), self._programs(), True)

    def _programs(self) -> tuple[Travel, ...]:
        return tuple(parts(one) for one in self.parts)

    def _is_line(self, target: int) -> bool:
        """Whether a target is a line of a strip or a place of a sheet, whose body has no mass and rests before its first
        drive.
        """
        massless = not self.massless.isdisjoint(self.scene.drives[target].moved)
        drives = (part.drive for part in self.drives if part.target == target)
        return any(_on_line(drive) or (massless and not drive.moved) for drive in drives)

    def _joins_again(self, target: int) -> bool:
        """Whether a target is a place whose springs act only while it is driven; see `acting_steps`."""
        return self.case.sheet is not None and self.scene.built.facets is None and self._is_line(target)

    def _join(self, target: int) -> None:
        """Begin to drive a target, or to hold a place of a sheet with its driven body."""
        self.acting[target] = self.started[target] = True
        if self._joins_again(target):
            self.held -= set(self.scene.drives[target].moved)

    def _step(self, number: int, name: str, step: Step, start: float) -> PlannedStep:
        begun = [part for part in self.drives if part.step == number]
        new = [load for at, load in loads_of(self.case) if at == number]
        said = [f"holds {', '.join(step.hold)}"] if step.hold else []
        said += [f"releases {', '.join(step.release)}"] if step.release else []
        replaced = {acting.name: f" in place of {acting.name!r}" for acting in self.loads if not acting.ends}
        let_go = self._release(number, step)
        self._hold(number, step)
        self._drive(begun, start)
        end = self._at_break(start + self._duration(step, begun, new, number))
        self._load(step, new, let_go, start, end)
        said += ["without contact"] if not step.contact and self.scene.contact is not None else []
        said += [f"drives {part.drive.called}" for part in begun]
        said += [f"loads {load.target}{replaced.get(load.called, '')}" for load in new]
        solve = step.solve or self.case.solve
        solve = solve if step.kind == "static" else solve_of(solve, self.scene)
        method, reason = self._method(step, solve, end - start)
        if step.kind == "modes" and not self._has_free():
            text = "no body is free in this step, so there are no natural modes; release a body before this step"
            self.faults.append(Fault(f"step.{number}.kind", text))
        still = not self._has_free() and not self._moves(start, end)
        return PlannedStep(
            name, step.kind, start, end, method, reason, solve, step.save or self.case.save, tuple(self.acting),
            self._placed_loads(), frozenset(self.held), still=still,
            contact=step.contact, modes=step.modes, described=tuple(said),
        )  # fmt: skip

    def _placed_loads(self) -> tuple[Load, ...]:
        """Loads that act, on bodies."""
        loads = tuple(acting.as_load() for acting in self.loads)
        if self.case.sheet is None:
            return loads
        from fsm.builders.sheet.sheet_loads import placed_loads  # imports all parts of patterns

        return placed_loads(self.case, loads)

    def _unchanging(self, planned: PlannedStep, number: int) -> None:
        """Report a fault if no load or drive changes in a step by arc length."""
        if planned.method != "arc-length":
            return
        ends = (planned.start, planned.end)
        times = np.linspace(*ends, 11)
        factors = (time_function(load.time) for load in planned.loads)
        grows = any(len({factor.at(t)[0] for t in times.tolist()}) > 1 for factor in factors)
        if not (grows or self._moves(*ends)):
            text = '"arc-length" needs a load or a drive that changes over the step; add a load or a drive, or use "static"'
            self.faults.append(Fault(f"step.{number}.solve.method", text))

    def _driven(self) -> set[str]:
        drives = [drive for drive, acting in zip(self.scene.drives, self.acting, strict=True) if acting]
        return {name for drive in drives for name in drive.moved}

    def _has_free(self) -> bool:
        """Whether any body or node can move freely."""
        fixed = self.held | self._driven()
        return bool(self.scene.flexible) or any(body.name not in fixed for body in self.scene.bodies)

    def _moves(self, start: float, end: float) -> bool:
        """Whether any drive moves between two times (s)."""
        programs = zip(self._programs(), self.acting, strict=True)
        return any(acts and program.gone(end) > program.gone(start) for program, acts in programs)

    def _method(self, step: Step, solve: Solve, duration: float) -> tuple[str, str]:
        paths = ("static", "arc-length")
        if step.kind in ("relax", "modes"):
            return step.kind, ""
        if step.kind == "static":
            return (solve.method, "requested") if solve.method in paths else ("static", "the step is static")
        if not self._has_free():
            return "generalized-alpha", "no body is free"
        if solve.method == "auto" or solve.method in paths:
            if self.scene.joints and not self.scene.flexible:
                return MotionMethod(JointsAtStart(self.scene)).choice(duration, solve.rtol, "the step is dynamic")
            return dynamic_method(self.scene), "the step is dynamic"
        return solve.method, "requested"

    # bodies ---------------------------------------------------------------------------------------------------------

    def _bodies(self, name: str) -> set[str]:
        """Bodies with a name in `hold` or `release`; empty if there are none."""
        bodies = self.scene.bodies
        if name == ALL:
            return {body.name for body in bodies} - self.fixed
        found = {body.name for body in bodies if body.name == name}
        if not found:
            listed = [(part.name, part.bodies) for part in self.scene.surfaces]
            listed += [(part.name, part.bodies) for part in self.scene.groups]
            found = {body for called, members in listed if called == name for body in members}
        return found or {body.name for body in bodies if body.panel and f"panel {body.panel}" == name}

    def _names(self) -> list[str]:
        panels = dict.fromkeys(f"panel {body.panel}" for body in self.scene.bodies if body.panel)
        drives = [part.drive.called for part in self.drives]
        return [*panels, *dict.fromkeys(drives), *(body.name for body in self.scene.bodies), ALL]

    def _hold(self, number: int, step: Step) -> None:
        for index, name in enumerate(step.hold):
            bodies = self._bodies(name)
            if not bodies:
                text = f"no body is called {name!r}{nearest_name(name, self._names())}"
                self.faults.append(Fault(f"step.{number}.hold.{index}", text))
            if name in self.frames:
                text = f"{name!r} is a frame, which its film or cable carries; join it to a body, and hold that body"
                self.faults.append(Fault(f"step.{number}.hold.{index}", text))
            for k in (k for k in range(self.targets) if name != ALL and self._joins_again(k)):
                if bodies.issuperset(moved := set(self.scene.drives[k].moved)) and not (self.acting[k] and self.started[k]):
                    self._join(k)
                    bodies -= moved
            driven = bodies & self._driven() if name != ALL else set()
            if driven:
                text = f"{sorted(driven)[0]!r} is driven, so it cannot be held; it stays where its drive stops"
                self.faults.append(Fault(f"step.{number}.hold.{index}", text))
            self.held |= bodies

    def _release(self, number: int, step: Step) -> list[_Acting]:
        """Release bodies and drives, and return the loads that are released."""
        let_go: list[_Acting] = []
        initially = {body.name for body in self.scene.bodies if body.held}
        for index, name in enumerate(step.release):
            bodies = self._bodies(name) & self.held - self.fixed
            if name == ALL:
                bodies -= initially
            loads = [acting for acting in self.loads if name in (ALL, acting.name)]
            drives = [
                k for k in range(self.targets)
                if self.started[k] and self.acting[k] and name in (ALL, *self._called(k))
            ]  # fmt: skip
            if not (bodies or loads or drives):
                known = sorted(self.held - self.fixed) + [acting.name for acting in self.loads]
                known += [called for k in range(self.targets) if self.acting[k] for called in self._called(k)]
                text = f"no held body and no acting drive or load is called {name!r}{nearest_name(name, known)}"
                self.faults.append(Fault(f"step.{number}.release.{index}", text))
            self.held -= bodies
            for k in drives:
                self.acting[k] = False
                if self._is_line(k):  # a massless body stays in place, and its springs do not act after this
                    self.held |= set(self.scene.drives[k].moved)
            let_go += loads
        return let_go

    def _called(self, target: int) -> list[str]:
        """Names that refer to a target of drives: the names of its drives and of its bodies."""
        of_target = [part.drive for part in self.drives if part.target == target]
        moved = self.scene.drives[target].moved if self._joins_again(target) else ()
        return [name for drive in of_target for name in (drive.called, *drive.moved, *moved)]

    def _unused_weightless(self, steps: Iterable[PlannedStep]) -> list[Fault]:
        """Bodies without mass that can move in a step."""
        bodies = enumerate(self.scene.bodies)
        weightless = {body.name: i for i, body in bodies if body.name not in self.fixed and _weightless(body)}
        faults = {}
        for step in steps:
            drives = [drive for drive, acting in zip(self.scene.drives, step.acting, strict=True) if acting]
            fixed = step.held | {name for drive in drives for name in drive.moved}
            for name, i in weightless.items():
                if name not in fixed and name not in faults:
                    text = f"{name!r} can move in step {step.name!r}, so mass and moments of inertia must be positive"
                    faults[name] = Fault(f"scene.bodies.{i}.mass", text)
        return list(faults.values())

    # drives and loads -----------------------------------------------------------------------------------------------

    def _duration(self, step: Step, begun: list[DrivePart], new: list[Load], number: int) -> float:
        if step.kind in ("relax", "modes"):
            return 0.0
        if step.duration is not None:
            return step.duration
        ends = [self._program(part).end_time for part in begun]
        ends += [end for load in new if load.time is not None and (end := end_of(load.time))]
        if not ends and step.kind == "dynamic":
            text = "is missing; a dynamic step without a drive needs this key"
            self.faults.append(Fault(f"step.{number}.duration", text))
        return max(ends, default=_STATIC_DURATION)

    def _at_break(self, t: float) -> float:
        """A given time; a time at which a drive begins, ends or reverses replaces it if both differ by round-off."""
        near = [at for program in self._programs() for at in program.breaks() if abs(at - t) <= _ROUNDING * t]
        return near[0] if near else t

    def _program(self, part: DrivePart) -> Travel:
        try:
            return program_of(part.drive, part.path)
        except CaseError as error:
            self.faults += [fault for fault in error.faults if fault not in self.faults]
            return parts(())

    def _drive(self, begun: list[DrivePart], start: float) -> None:
        seen: set[int] = set()
        for part in begun:
            if part.target in seen:
                self.faults.append(Fault(part.path, f"{part.drive.called!r} is driven twice in one step; remove one drive"))
            seen.add(part.target)
            again = self.started[part.target] and not self.acting[part.target]
            if again and self._is_line(part.target) and not self._joins_again(part.target):
                line, remedy = "a place of flexible facets", "give a load"
                if _on_line(part.drive):
                    line, remedy = "a crease line or end line", "drive a panel"
                text = f"{part.drive.called} was released, and {line} cannot be driven again; {remedy}"
                self.faults.append(Fault(part.path, text))
            for name in part.drive.moved:
                if name in self.held:
                    self.faults.append(Fault(part.path, f"{name!r} is held in this step; a held body cannot be driven"))
            self.parts[part.target].append((start, part.sense, self._program(part)))
            self._join(part.target)
        moved: dict[str, int] = {}
        for k, drive in enumerate(self.scene.drives):
            for name in drive.moved if self.acting[k] else ():
                both = [part.path for part in begun if part.target in (k, moved.get(name))]
                if name in moved and k != moved[name] and both:
                    path = both[-1]
                    text = f"{name!r} is still driven by {self.scene.drives[moved[name]].called!r}; release that first"
                    self.faults.append(Fault(path, text))
                moved[name] = k

    def _load(self, step: Step, new: list[Load], let_go: list[_Acting], start: float, end: float) -> None:
        """Loads of a step. Loads begin and end with a ramp in a static step, and suddenly in a dynamic step."""
        named = {load.called for load in new}
        kept: list[_Acting] = []
        for acting in self.loads:
            if acting.ends:  # the drive acted in the previous step
                continue
            if acting not in let_go and acting.name not in named:
                kept.append(acting)
            elif step.kind == "static":
                now = time_function(acting.function).at(start)[0]
                kept.append(replace(acting, ends=True, function=_ramp(start, end, now, 0.0)))
        first = step is self.case.step[0]
        for load in new:
            function: TimeFunction
            if load.time is not None:
                function = shifted(load.time, start)
            elif step.kind == "static" and not (first and load not in step.load):
                function = _ramp(start, end, 0.0, 1.0)
                if (step.solve or self.case.solve).method == "arc-length":
                    function = Ramp(kind="ramp", start=start, end=end, shape="unbounded")
            else:
                function = Constant()
            kept.append(_Acting(load.called, load, function))
        self.loads = kept


def _ramp(start: float, end: float, first: float, last: float) -> TimeFunction:
    return Table(kind="table", time=(start, end), value=(first, last))


def _weightless(body: Body) -> bool:
    return not (body.mass > 0.0 and min(body.inertia) > 0.0)
