"""Check the steps of a case before its bodies exist."""

from __future__ import annotations

from collections.abc import Iterable

from fsm.case.checks.sections import Sections, method_faults, static_faults
from fsm.case.models.solve import Solve, Step
from fsm.case.models.time_program import end_of
from fsm.case.schema.known_names import nearest_name
from fsm.errors import Fault

_INSTANT = ("modes", "relax")
"""Kinds of steps without a duration."""
_PATHS = ("auto", "static", "arc-length")
"""Methods of static steps."""


def step_names(steps: Iterable[Step]) -> list[str]:
    """Names of the steps of a case, in order."""
    return [step.name or f"step {number}" for number, step in enumerate(steps, 1)]


def check_steps(sections: Sections) -> Iterable[Fault]:
    """Faults of steps, and of sections that cannot be used beside them."""
    if sections.faulty_steps:
        return
    names = step_names(sections.listed["step"].values())
    listed = [(f"drive.{index}", drive.step) for index, drive in sections.listed["drive"].items()]
    listed += [(f"load.{index}", load.step) for index, load in sections.listed["load"].items()]
    for path, wanted in listed:
        if wanted is not None and wanted not in names:
            hint = nearest_name(wanted, names) if names else "; there is no [[step]]"
            yield Fault(f"{path}.step", f"no step is called {wanted!r}{hint}")
        elif wanted is not None and path.startswith("drive"):
            step = sections.listed["step"].get(names.index(wanted))
            if step is not None and step.kind in _INSTANT:
                text = f'{wanted!r} has kind = "{step.kind}" and takes no time, so a drive cannot act'
                yield Fault(f"{path}.step", f"{text}; name another step")
    for index, element in enumerate(sections.case.scene.elements if sections.case.scene is not None else ()):
        path = f"scene.elements.{index}"
        for wanted in element.steps or ():
            if wanted not in names:
                hint = nearest_name(wanted, names) if names else "; there is no [[step]]"
                yield Fault(f"{path}.steps", f"no step is called {wanted!r}{hint}")
        if element.latch and element.steps is None:
            yield Fault(f"{path}.latch", "needs `steps`; give the names of the steps in which the latch acts")
        if element.latch and (element.crease is not None or element.frame == "chord" or element.law is not None):
            yield Fault(f"{path}.latch", "is for linear joints, without `crease`, `frame` and `law`")
    if "step" not in sections.written:
        return
    if len(sections.stages) > 1:
        yield Fault("step", "cannot be used with `stages`; remove one of them")
    if "release" in sections.written:
        yield Fault("release", 'cannot be used with [[step]]; use hold = ["all"] and then release = ["all"]')
    if sections.solve is not None and sections.solve.end_time is not None:
        yield Fault("solve.end_time", "cannot be used with [[step]]; give the `duration` of each step")
    if sections.solve is not None and sections.solve.force_limit is not None:
        yield Fault("solve.force_limit", "cannot be used with [[step]]; remove this key")
    for number, step in sections.listed["step"].items():
        path = f"step.{number}"
        if names.index(names[number]) != number:
            yield Fault(f"{path}.name", f"{names[number]!r} is the name of an earlier step; names must differ")
        yield from _of_kind(step, path)
        for name in ("drive", "load"):
            for index, item in enumerate(getattr(step, name)):
                if item.step is not None:
                    yield Fault(f"{path}.{name}.{index}.step", "a section inside [[step]] belongs to it; remove this key")


def _of_kind(step: Step, path: str) -> Iterable[Fault]:
    """Faults of keys that a kind of step does not use, and of missing keys that it requires."""
    instant = step.kind in _INSTANT
    for key in ("duration", "save") if instant else ():
        if getattr(step, key) is not None:
            yield Fault(f"{path}.{key}", f'a step with kind = "{step.kind}" takes no time; remove this key')
    if instant and step.drive:
        yield Fault(f"{path}.drive", f'a step with kind = "{step.kind}" takes no time, so nothing is driven; use "static"')
    if step.kind != "modes" and "modes" in step.model_fields_set and step.modes != 10:
        yield Fault(f"{path}.modes", 'is used with kind = "modes" only; remove this key')
    if step.kind == "dynamic" and step.duration is None and not step.drive:
        ends = [end_of(load.time) if load.time is not None else 0.0 for load in step.load]
        if not any(ends):
            yield Fault(f"{path}.duration", "is missing; a dynamic step without a drive needs this key")
    if step.save is not None:
        for key in ("channels", "points"):
            if getattr(step.save, key):
                yield Fault(f"{path}.save.{key}", "belongs to the whole case; move this key to [save]")
    if step.solve is not None:
        yield from _settings(step, step.solve, path)


def _settings(step: Step, solve: Solve, path: str) -> Iterable[Fault]:
    if solve.end_time is not None:
        yield Fault(f"{path}.solve.end_time", "is not used in a step; give `duration`")
    if solve.force_limit is not None:
        yield Fault(f"{path}.solve.force_limit", "cannot be used with [[step]]; remove this key")
    if solve.spatial:
        yield Fault(f"{path}.solve.spatial", "belongs to the whole case; move this key to [solve]")
    is_path = solve.method in ("static", "arc-length")
    if (step.kind == "dynamic" and is_path) or (step.kind == "static" and solve.method not in _PATHS):
        yield Fault(f"{path}.solve.method", f'"{solve.method}" does not fit kind = "{step.kind}"; change one of them')
    for fault in (*method_faults(solve), *static_faults(solve)):
        yield Fault(f"{path}.{fault.path}", fault.message)
