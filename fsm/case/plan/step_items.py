"""Drives and loads of all steps of a case, in one order.

Initial state of a deployment, and the reason for it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from fsm.case.checks.check_steps import step_names
from fsm.case.models.case import Case, Start
from fsm.case.models.loads import Drive, Load
from fsm.case.models.materials import SplineCrease
from fsm.case.models.scene import ForceElement, Scene
from fsm.errors import Fault


@dataclass(frozen=True)
class DrivePart:
    """A drive of a case.

    Attributes
    ----------
    step : number of its step, from 0
    target : number of its target, from 0
    sense : 1 or -1, along the first drive of this target
    drive, path : the drive itself, and its dotted path
    """

    step: int
    target: int
    sense: float
    drive: Drive
    path: str


def _number(case: Case, name: str | None) -> int:
    return 0 if name is None else step_names(case.step).index(name)


def _drives(case: Case) -> Iterator[tuple[int, Drive, str]]:
    top = case.drive or (case.scene.drives if case.scene is not None else ())
    for index, drive in enumerate(top):
        yield _number(case, drive.step), drive, f"drive.{index}"
    for number, step in enumerate(case.step):
        for index, drive in enumerate(step.drive):
            yield number, drive, f"step.{number}.drive.{index}"


def drive_parts(case: Case) -> list[DrivePart]:
    """All drives in the order of their steps, with their targets: two drives of one target move the same bodies."""
    found: list[DrivePart] = []
    firsts: list[Drive] = []
    for number, drive, path in sorted(_drives(case), key=lambda item: item[0]):
        target, sense = len(firsts), 1.0
        for known, first in enumerate(firsts):
            same = _sense(first, drive)
            if same:
                target, sense = known, same
                break
        else:
            firsts.append(drive)
        found.append(DrivePart(number, target, sense, drive, path))
    return found


def _sense(first: Drive, drive: Drive) -> float:
    """1 if two drives move the same bodies in the same direction, -1 in opposite directions, 0 if they differ."""
    one, other = (
        (of.crease, of.panel, of.end, set(of.moved), of.edge, of.at, of.guide, of.turn is None) for of in (first, drive)
    )
    if one != other:
        return 0.0
    if drive.turn is not None and drive.point != first.point:
        return 0.0
    along, now = (first.direction, drive.direction) if drive.turn is None else (first.axis, drive.axis)
    cosine = sum(a * b for a, b in zip(along, now, strict=True)) / math.hypot(*along) / math.hypot(*now)
    return math.copysign(1.0, cosine) if abs(cosine) > 1.0 - 1e-9 else 0.0


def drives_of(case: Case) -> tuple[Drive, ...]:
    """First drive of every target."""
    parts = drive_parts(case)
    targets = {part.target: part.drive for part in reversed(parts)}
    return tuple(targets[k] for k in sorted(targets))


def loads_of(case: Case) -> list[tuple[int, Load]]:
    """All loads with the numbers of their steps."""
    return [(number, load) for number, load, _ in _loads(case)]


def _loads(case: Case) -> list[tuple[int, Load, str]]:
    top = case.load or (case.scene.loads if case.scene is not None else ())
    found = [(_number(case, load.step), load, f"load.{index}") for index, load in enumerate(top)]
    for number, step in enumerate(case.step):
        found += [(number, load, f"step.{number}.load.{index}") for index, load in enumerate(step.load)]
    return sorted(found, key=lambda item: item[0])


def with_paths_of_steps(case: Case, faults: Iterable[Fault]) -> list[Fault]:
    """Faults of a scene; paths of drives and loads are given as in the steps of the case."""
    if not case.step:
        return list(faults)
    paths = {f"load.{index}": path for index, (_, _, path) in enumerate(_loads(case))}
    for part in reversed(drive_parts(case)):
        paths[f"drive.{part.target}"] = part.path
    found = []
    for fault in faults:
        name, _, rest = fault.path.partition(".")
        index, _, key = rest.partition(".")
        path = paths.get(f"{name}.{index}")
        found.append(fault if path is None else Fault(f"{path}.{key}" if key else path, fault.message))
    return found


def acting_steps(case: Case, target: int, body: str) -> tuple[str, ...]:
    """Names of the steps in which a place of a sheet is joined to its driven body: from a drive of the target, or a `hold`
    of the body, until a release.
    """
    parts = [part for part in drive_parts(case) if part.target == target]
    begins, names = {part.step for part in parts}, {"all", body, *(part.drive.called for part in parts)}
    acts, found = False, []
    for number, (name, step) in enumerate(zip(step_names(case.step), case.step, strict=True)):
        acts = (acts and not names & set(step.release)) or number in begins or body in step.hold
        found += [name] if acts else []
    return tuple(found)


def releases(case: Case, name: str) -> int | None:
    """Number of the first step that releases a name, from 0; None if no step does."""
    numbers = (number for number, step in enumerate(case.step) if name in step.release or "all" in step.release)
    return next(numbers, None)


def steps_from(case: Case, number: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the steps before a step, and of all other steps."""
    names = step_names(case.step)
    return tuple(names[:number]), tuple(names[number:])


_SAME_ANGLE = 1e-9
"""Difference below which two angles are the same, rad."""


def start_of(case: Case, scene: Scene) -> tuple[Start, str]:
    """Initial state of a case, and the reason; the key `start` of the case decides if it is given.

    A strip without a drive, whose creases carry moment as folded, starts as folded and at rest. All other strips start in
    equilibrium. Scenes and lattices start as given.

    Parameters
    ----------
    case : Case
    scene : Scene
        Scene of the case.
    """
    if case.start is not None:
        return case.start, "set by `start`"
    if case.strip is None:
        return "as-folded", "initial positions of the case"
    if scene.drives:
        return "equilibrium", "the strip has a drive"
    if creases_at_rest(scene):
        return "equilibrium", "the creases carry no moment as folded"
    return "as-folded", "the strip has no drive, and its creases carry moment as folded"


def creases_at_rest(scene: Scene) -> bool:
    """Whether all creases of a scene are free of moment at their initial angle."""
    return all(_at_rest(element) for element in scene.elements if element.kind == "crease")


def _at_rest(element: ForceElement) -> bool:
    crease = element.crease
    folded = abs(element.initial_angle or 0.0)
    opening = (folded if element.rest_angle is None else abs(element.rest_angle)) - folded
    if isinstance(crease, SplineCrease) and crease.angle is not None and crease.moment is not None:
        largest = float(np.abs(crease.moment).max())
        inside = crease.angle[0] <= opening <= crease.angle[-1]
        return inside and abs(float(np.interp(opening, crease.angle, crease.moment))) <= 1e-9 * largest
    return element.rotation[1] == 0.0 or abs(opening) <= _SAME_ANGLE
