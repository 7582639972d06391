"""Checks of a scissor array that involve several sections."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from fsm.case.checks.sections import Sections, method_faults, missing_sections, static_keys
from fsm.case.derived.scissor import build_array
from fsm.case.models.scissor import PointForce, PointSupport, Scissor
from fsm.case.schema.units import did_you_mean
from fsm.errors import Fault


def check_scissor(sections: Sections) -> list[Fault]:
    """Faults of a scissor array that involve several sections."""
    faults = [*missing_sections(sections, _NEEDED), *_solve(sections)]
    scissor = sections.case.scissor
    if scissor is None:
        return faults
    array, impossible = build_array(scissor)
    faults += impossible
    faults += _points(scissor, array.points, sections.listed["hold"], sections.listed["force"])
    return [*faults, *_stop(sections), *_rigid(sections), *_force(sections)]


def default_holds(scissor: Scissor) -> tuple[PointSupport, ...]:
    """Default supports: b1 is pinned and a1 slides along the line through both; in a ring both slide along their radius."""
    guide = PointSupport(point="a1", kind="slider", direction=(0.0, 1.0))
    first = guide.model_copy(update={"point": "b1"}) if scissor.shape == "ring" else PointSupport(point="b1")
    return first, guide


_NEEDED = {
    "scissor": "it defines the array",
    "bar": "it gives width and height of the bars",
    "material": "it gives the material of the bars",
}


def _points(
    scissor: Scissor,
    known: Mapping[str, tuple[float, float]],
    holds: Mapping[int, PointSupport],
    forces: Mapping[int, PointForce],
) -> Iterable[Fault]:
    """Supports and forces on points that do not exist, or in impossible directions."""
    last = scissor.units if scissor.shape == "ring" else scissor.units + 1
    for kind, items in (("hold", holds), ("force", forces)):
        for index, item in items.items():
            if item.point not in known:
                yield Fault(
                    f"{kind}.{index}.point",
                    f'there is no point "{item.point}"; {scissor.units} units have a1 ... a{last}, b1 ... b{last} '
                    f"and the hinges h1 ... h{scissor.units}{did_you_mean(item.point, known)}",
                )
    for index, hold in holds.items():
        if hold.direction is not None and 0.0 not in hold.direction:
            yield Fault(
                f"hold.{index}.direction",
                f"[{hold.direction[0]:g}, {hold.direction[1]:g}] is not parallel to an axis; give [1, 0] or [0, 1]",
            )
    for index, force in forces.items():
        if force.radial is not None and scissor.shape == "linear":
            yield Fault(f"force.{index}.radial", "a linear array has no centre; give `force` = [x, y]")


def _stop(sections: Sections) -> Iterable[Fault]:
    scissor, stop = sections.case.scissor, sections.case.stop
    if scissor is not None and stop is not None and stop.angle >= scissor.initial_angle:
        given, start = math.degrees(stop.angle), math.degrees(scissor.initial_angle)
        yield Fault(
            "stop.angle",
            f"must be less than scissor.initial_angle, {start:.4g} deg, from which it decreases; it is {given:.4g} deg",
        )


def _rigid(sections: Sections) -> Iterable[Fault]:
    """Sections and keys that rigid bars do not support."""
    if sections.case.scissor is None or not sections.case.scissor.rigid:
        return
    if sections.case.stop is not None:
        what = "end stop and no latch" if sections.case.stop.latch else "end stop"
        yield Fault("stop", f"rigid bars have no {what}; remove the section, or set scissor.rigid = false")
    if sections.case.hinge is not None and sections.case.hinge.friction_moment > 0.0:
        yield Fault(
            "hinge.friction_moment", "rigid bars have no friction at hinges; remove this key, or set scissor.rigid = false"
        )


def _force(sections: Sections) -> Iterable[Fault]:
    """Loads that an array cannot have, and an array without loads."""
    hinge = sections.case.hinge
    if sections.case.gravity[2]:
        yield Fault(
            "gravity.2", f"{sections.case.gravity[2]:g} m/s^2 is normal to the plane x, y of the array; give gravity along y"
        )
    if sections.case.material is not None and sections.case.material.plate:
        yield Fault("material.plate", "applies to wide strips only, and bars bend as beams; remove this key")
    sprung = hinge is not None and hinge.stiffness > 0.0 and hinge.rest_turn != 0.0
    if not ({"force", "gravity"} & sections.written) and not sprung:
        yield Fault("force", 'the array has no load; give [[force]] at a point, for example "a1", gravity, or hinge springs')


def _solve(sections: Sections) -> Iterable[Fault]:
    solve = sections.solve
    if solve is not None:
        if solve.method == "static":
            yield Fault("solve.method", 'the deployment of an array is dynamic; give "generalized-alpha" or "auto"')
        if solve.end_time is None:
            yield Fault("solve.end_time", "missing; give the end time of the deployment")
        for key in static_keys(solve):
            yield Fault(f"solve.{key}", 'not used with analysis = "scissor", because an array has no drive; remove this key')
        if solve.spatial:
            yield Fault("solve.spatial", "an array moves in its plane only; remove this key")
        if solve.method != "auto":
            yield from method_faults(solve)
    if sections.case.save.every is not None:
        yield Fault("save.every", "is a travel of a drive, and an array has no drive; give `interval` (time) instead")
