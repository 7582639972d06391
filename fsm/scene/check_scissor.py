"""What no section of a scissor array can see alone."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from fsm.errors import Fault
from fsm.scene.builders.scissor import build_array
from fsm.scene.scissor import PointForce, PointSupport, Scissor
from fsm.scene.sections import Sections, keys_of_paths, method_faults
from fsm.scene.units import nearest

__all__ = ["check_scissor", "default_holds"]


def check_scissor(sections: Sections) -> list[Fault]:
    """Contradictions between the sections of a scissor array."""
    faults = [*_missing(sections), *_solve(sections)]
    scissor = sections.scissor
    if scissor is None:
        return faults
    array, impossible = build_array(scissor)
    faults += impossible
    faults += _points(scissor, array.points, sections.holds, sections.forces)
    return [*faults, *_stop(sections), *_mesh(sections), *_rigid(sections), *_force(sections)]


def default_holds(scissor: Scissor) -> tuple[PointSupport, ...]:
    """b1 pinned and a1 guided along the line through both; of a ring, a1 and b1 guided along their radius."""
    guide = PointSupport(point="a1", kind="slider", direction=(0.0, 1.0))
    first = guide.model_copy(update={"point": "b1"}) if scissor.shape == "ring" else PointSupport(point="b1")
    return first, guide


def _missing(sections: Sections) -> Iterable[Fault]:
    for name, why in (
        ("scissor", "it says what array there is"),
        ("bar", "it gives the section of the bars: width and height"),
        ("material", "the bars need it"),
    ):
        if name not in sections.written:
            yield Fault(name, f"section [{name}] is missing; {why}")


def _points(
    scissor: Scissor,
    known: Mapping[str, tuple[float, float]],
    holds: Mapping[int, PointSupport],
    forces: Mapping[int, PointForce],
) -> Iterable[Fault]:
    """Supports and forces on points that are not there."""
    last = scissor.units if scissor.shape == "ring" else scissor.units + 1
    for kind, items in (("hold", holds), ("force", forces)):
        for index, item in items.items():
            if item.point not in known:
                yield Fault(
                    f"{kind}.{index}.point",
                    f'there is no point "{item.point}"; {scissor.units} units have a1 ... a{last}, b1 ... b{last} and the '
                    f"hinges h1 ... h{scissor.units}{nearest(item.point, known)}",
                )
    for index, hold in holds.items():
        if hold.direction is not None and 0.0 not in hold.direction:
            yield Fault(
                f"hold.{index}.direction",
                f"[{hold.direction[0]:g}, {hold.direction[1]:g}] is along neither axis; a slider moves along [1, 0] or "
                "[0, 1]",
            )
    for index, force in forces.items():
        if force.radial is not None and scissor.shape == "linear":
            yield Fault(f"force.{index}.radial", "a linear array has no centre; give `force` = [x, y]")


def _stop(sections: Sections) -> Iterable[Fault]:
    scissor, stop = sections.scissor, sections.stop
    if scissor is not None and stop is not None and stop.angle >= scissor.initial_angle:
        given, start = math.degrees(stop.angle), math.degrees(scissor.initial_angle)
        yield Fault(
            "stop.angle",
            f"{given:.4g} deg: the array is locked, it starts at {start:.4g} deg and its angle falls as it deploys; "
            "give less",
        )


def _mesh(sections: Sections) -> Iterable[Fault]:
    scissor = sections.scissor
    if scissor is not None and scissor.element == "cable" and scissor.shape == "ring":
        yield Fault("scissor.element", '"cable" has no section to carry the bend of ring bars; use "section" or "green"')


def _rigid(sections: Sections) -> Iterable[Fault]:
    """What rigid bars do not have."""
    if sections.scissor is None or not sections.scissor.rigid:
        return
    if sections.stop is not None:
        what = "end stop, nor a latch" if sections.stop.latch else "end stop"
        yield Fault("stop", f"rigid bars have no {what}; take it out, or rigid = false")
    if sections.hinge is not None and sections.hinge.friction_moment > 0.0:
        yield Fault("hinge.friction_moment", "rigid bars have no dry friction at hinges; take it out, or rigid = false")


def _force(sections: Sections) -> Iterable[Fault]:
    """Nothing that moves the array."""
    hinge = sections.hinge
    if len(sections.gravity) == 3 and sections.gravity[2]:
        yield Fault("gravity.2", f"{sections.gravity[2]:g} m/s^2 is across the plane x, y of the array; give it along y")
    if sections.material is not None and sections.material.plate:
        yield Fault("material.plate", "is of wide strips; bars bend as beams; take it out")
    sprung = hinge is not None and hinge.stiffness > 0.0 and hinge.rest_turn != 0.0
    if not ({"force", "gravity"} & sections.written) and not sprung:
        yield Fault("force", 'nothing moves the array; give [[force]] with a point ("a1" for example), gravity, or springs')


def _solve(sections: Sections) -> Iterable[Fault]:
    solve, save = sections.solve, sections.save
    if solve is not None:
        if solve.method == "static":
            yield Fault("solve.method", 'an array that unfolds is dynamic; give "generalized-alpha" or leave it "auto"')
        if solve.end_time is None:
            yield Fault("solve.end_time", "missing: nothing says when to stop")
        for key in keys_of_paths(solve):
            yield Fault(f"solve.{key}", 'not used with analysis = "scissor": it is of drives; take it out')
        if solve.spatial:
            yield Fault("solve.spatial", "an array moves in its plane only; take it out")
        if solve.method != "auto":
            yield from method_faults(solve)
    if save is not None and save.every is not None:
        yield Fault("save.every", "counts the travel of a drive; give `interval` (time) instead")
