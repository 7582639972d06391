"""Report of `fsm check` for a scissor array: the model and its approximations."""

from __future__ import annotations

from collections.abc import Iterator

from fsm.case.checks.check_scissor import default_holds
from fsm.case.derived.scissor import array_at
from fsm.case.models.case import Case
from fsm.case.models.time_program import Constant
from fsm.text.shown_units import labelled, material_text, shown, shown_size

_ELEMENTS = {
    "section": "shear-deformable beams of 14 coordinates, strains of the section",
    "green": "shear-deformable beams of 14 coordinates, Green's strain over the section",
    "cable": "Bernoulli beams of 8 coordinates, no shear",
}


def describe_array(case: Case) -> list[str]:
    """Lines of the report: the model and the approximations."""
    sections = {
        "case": _title, "array": _array, "bars": _bars, "mesh": _mesh, "hold": _hold, "force": _force, "hinges": _hinges,
        "stop": _stop, "steps": _run_steps, "solve": _solve, "approximate": _approximations,
    }  # fmt: skip
    return labelled(sections.items(), case)


def _run_steps(case: Case) -> Iterator[str]:
    end = case.solve.end_time
    yield "1 deploy: dynamic" + ("" if end is None else f", 0 to {end:.4g} s")


def _title(case: Case) -> Iterator[str]:
    if case.title:
        yield case.title


def _array(case: Case) -> Iterator[str]:
    scissor = case.scissor
    assert scissor is not None
    kind = {"linear": "in a straight line", "arched": "along an arch", "ring": "in a closed ring"}[scissor.shape]
    array = array_at(scissor, scissor.initial_angle)
    xs, ys = ([at[axis] for at in array.points.values()] for axis in (0, 1))
    yield f"{scissor.units} units {kind}, {len(array.bars)} bars at {shown(scissor.initial_angle, 'rad')}"
    yield f"size at the start {shown_size(max(xs) - min(xs), max(ys) - min(ys))}; points a1 ..., b1 ..., hinges h1 ..."


def _bars(case: Case) -> Iterator[str]:
    scissor, bar, material = case.scissor, case.bar, case.material
    assert scissor is not None and bar is not None and material is not None
    mass = material.density * bar.width * bar.height * scissor.bar_length
    size = f"{shown(bar.width, 'm')} wide, {shown(bar.height, 'm')} high in the plane"
    yield f"{shown(scissor.bar_length, 'm')} long, {size}, {shown(mass, 'kg')} each"
    yield material_text(material.young, material.poisson, material.density)
    if scissor.shape != "linear":
        bent = "with a kink of 2 pi/units at the hinge" if scissor.shape == "ring" else "straight"
        yield f"hinge at {scissor.hinge:g} of the length, {bent}"


def _mesh(case: Case) -> Iterator[str]:
    scissor = case.scissor
    assert scissor is not None
    if scissor.rigid:
        yield "rigid bars: one body for each bar, joined at hinges by springs of 1e10 N/m"
        return
    yield f"{scissor.elements_per_bar} elements per bar: {_ELEMENTS[scissor.element]}"
    yield "joined bars share their position and not their slope, without constraint equations"


def _hold(case: Case) -> Iterator[str]:
    assert case.scissor is not None
    for hold in case.hold or default_holds(case.scissor):
        along = "" if hold.direction is None else f" along [{hold.direction[0]:g}, {hold.direction[1]:g}]"
        yield f"{hold.point} {hold.kind}{along}" + ("" if case.hold else " (default support)")


def _force(case: Case) -> Iterator[str]:
    for force in case.force:
        if force.force is not None:
            size = f"[{force.force[0]:g}, {force.force[1]:g}] N"
        else:
            size = f"{force.radial:g} N radially outwards"
        how = "constant from the start" if isinstance(force.time, Constant) else "a function of time"
        yield f"{size} at {force.point}, {how}"
    if any(case.gravity):
        yield f"gravity [{case.gravity[0]:g}, {case.gravity[1]:g}] m/s^2"


def _hinges(case: Case) -> Iterator[str]:
    hinge = case.hinge
    if hinge is None:
        yield "free: no [hinge]"
        return
    yield (
        f"{hinge.at}: spring {hinge.stiffness:g} N m/rad, damper {hinge.damping:g} N m s/rad, "
        f"dry friction {hinge.friction_moment:g} N m"
    )
    if hinge.stiffness:
        yield f"the moment of springs is zero after a rotation of {shown(hinge.rest_turn, 'rad')}"


def _stop(case: Case) -> Iterator[str]:
    stop = case.stop
    if stop is None:
        yield "none: no [stop]"
        return
    yield f"at a bar angle of {shown(stop.angle, 'rad')}, {stop.stiffness:g} N m/rad^1.5, damping {stop.damping:g} s/rad"
    if stop.latch:
        yield "with a latch: a middle hinge that has reached the stop is held there in both directions"


def _solve(case: Case) -> Iterator[str]:
    assert case.scissor is not None
    method: str = case.solve.method
    if method == "auto":
        method = "Radau-blocks (rigid bars on stiff hinges)" if case.scissor.rigid else "generalized-alpha"
    yield f"{method}{_steps(case)}, end time {case.solve.end_time:g} s"
    if not case.scissor.rigid and case.stop is None and (case.hinge is None or case.hinge.friction_moment == 0.0):
        yield "the same array with rigid bars is also solved, for comparison"


def _steps(case: Case) -> str:
    """Text on `solve.step`, which only methods with fixed steps use."""
    solve, scissor = case.solve, case.scissor
    assert scissor is not None
    if solve.step is None:
        return ""
    if solve.method in ("generalized-alpha", "newmark") or (solve.method == "auto" and not scissor.rigid):
        return f", steps of {shown(solve.step, 's')}"
    return ", steps by error control (solve.step is not used)"


def _approximations(case: Case) -> Iterator[str]:
    assert case.scissor is not None
    yield "bars have no contact with each other; the motion is planar"
    if case.scissor.rigid:
        return
    if case.hinge is not None and case.hinge.friction_moment > 0.0:
        yield f"regularised dry friction creeps below {case.hinge.friction_speed:g} rad/s"
    if case.stop is not None and case.stop.latch:
        yield "a latch closes at the end of a step, so at most one step too late"
    if any(isinstance(force.time, Constant) for force in case.force):
        yield "a force with a jump excites all frequencies of the mesh: accelerations depend on the mesh and on rho_inf"
    yield "error of strongly bent bars: 1e-3 with 8 elements per bar, order 5; small bending is exact (docs/scissor.md)"
