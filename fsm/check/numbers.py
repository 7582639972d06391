"""Report of `fsm check` on the numbers of a case with their units, so that the user can find wrong values."""

from __future__ import annotations

from collections.abc import Iterator

from fsm.builders.strip import bending_stiffness
from fsm.case.models.materials import Crease, LinearCrease, SplineCrease
from fsm.case.models.scene import Body, ForceElement
from fsm.check.view import CheckContext
from fsm.model.elements.element_angles import initial_twists, rest_twists
from fsm.text.shown_units import material_text, shown, shown_points, shown_range, shown_size, triple

_LISTED = 8
"""Largest number of bodies or elements of a scene with a line each."""


def strip_lines(view: CheckContext) -> Iterator[str]:
    """Lines on size, panels, fold angle and mass."""
    strip, material = view.case.strip, view.case.material
    if strip is None or material is None:
        return
    mass = material.density * strip.length * strip.width * strip.thickness
    size = shown_size(strip.length, strip.width, strip.thickness)
    panels = f"{strip.panels} panels of {shown(strip.length / strip.panels, 'm')}"
    yield f"{size}, {shown(mass, 'kg')}; {panels} at {shown(strip.fold_angle, 'rad')} from the horizontal"


def material_lines(view: CheckContext) -> Iterator[str]:
    """Lines on elastic constants, density and bending stiffness."""
    strip, material = view.case.strip, view.case.material
    if strip is None or material is None:
        return
    bending = bending_stiffness(strip, material)
    how = "E w t^3/12/(1 - nu^2)" if material.plate else "E w t^3/12"
    yield material_text(material.young, material.poisson, material.density)
    yield f"bending stiffness EI {shown(bending, 'N m^2')} ({how})"


def crease_lines(view: CheckContext) -> Iterator[str]:
    """Lines on the stiffness of a crease, its ratio to the stiffness of a panel, and its rest angle."""
    strip, material, crease = view.case.strip, view.case.material, view.case.crease
    if strip is None or material is None or crease is None:
        return
    folded = strip.crease_angle
    ratio = crease.mean_stiffness * strip.length / strip.panels / bending_stiffness(strip, material)
    rest = "as folded" if crease.rest_angle is None else f"folded to {shown(folded, 'rad')}"
    angle = shown(folded if crease.rest_angle is None else crease.rest_angle, "rad")
    zero = "no moment" if isinstance(crease, LinearCrease) else "zero of the data"
    yield f"{_law(crease)}, {ratio:.3g} EI per panel length; {zero} at {angle} from flat ({rest})"


def lattice_lines(view: CheckContext) -> Iterator[str]:
    """Lines on squares, hinges and density of a lattice."""
    lattice = view.case.lattice
    if lattice is None:
        return
    turned = f"rotated by {shown(lattice.angle, 'rad')}"
    size = f"{lattice.columns} x {lattice.rows} squares, spacing {shown(lattice.spacing, 'm')}"
    yield f"{size}, {turned}, {shown(lattice.depth, 'm')} deep, {lattice.density:g} kg/m^3"
    axial, shear, rotational = lattice.stiffness
    springs = f"axial {axial:.4g} N/m, shear {shear:.4g} N/m, rotational {shown(rotational, 'N m/rad')}"
    yield f"hinges of {shown(lattice.hinge_length, 'm')}: {springs}; damping {shown(lattice.damping, 's')}"
    if lattice.hinge_thickness is not None:
        length = shown(lattice.hinge_length + 2.0 * lattice.clamp, "m")
        yield f"hinges are beams, {shown(lattice.hinge_thickness, 'm')} thick, free length {length} between their clamps"


def body_lines(view: CheckContext) -> Iterator[str]:
    """Lines on masses, sizes and velocities of the bodies of a [scene]."""
    if view.case.scene is None:
        return
    free = view.free
    if len(free) <= _LISTED:
        yield from (_body(body) for body in free)
    elif free:
        masses = [body.mass for body in free]
        yield f"total mass {shown(sum(masses), 'kg')}, {shown_range(min(masses), max(masses), 'kg')} each"


def element_lines(view: CheckContext) -> Iterator[str]:
    """Lines on stiffness and angles of the elements of a [scene]."""
    if view.case.scene is None or len(view.elements) > _LISTED:
        return
    initial = initial_twists(view.elements, view.scene.bodies)
    rest = rest_twists(view.elements, initial)
    yield from (_element(*each) for each in zip(view.elements, initial, rest, strict=True))


def _body(body: Body) -> str:
    parts = [f"{body.name}: {shown(body.mass, 'kg')}, {triple(body.inertia)} kg m^2 at {shown_points([body.position])}"]
    if body.plate is not None:
        plate = body.plate
        parts.append(f"plate {shown_size(plate.length, plate.width, plate.thickness)}")
    if any(body.velocity):
        parts.append(f"velocity {shown_points([body.velocity], 'm/s')}")
    if any(body.angular_velocity):
        parts.append(f"angular velocity {triple(body.angular_velocity)} rad/s")
    return ", ".join(parts)


def _element(element: ForceElement, start: float, rest: float) -> str:
    parts = []
    if any(element.translation):
        parts.append(f"{triple(element.translation)} N/m")
    if any(element.rotation):
        parts.append(f"{shown_points([element.rotation], 'N m/rad')}")
    if element.crease is not None:
        parts.append(_law(element.crease))
    twists = element.frame == "outer" and (element.crease is not None or element.rotation[1])
    angles = f"; twist {shown(start, 'rad')} at the start, no moment at {shown(rest, 'rad')}" if twists else ""
    return f"{element.name}: {', '.join(parts) or 'no stiffness'}{angles}"


def _law(crease: Crease) -> str:
    """Text on a crease law and its stiffness; the stiffness of a curve is the mean slope between its ends."""
    if isinstance(crease, LinearCrease):
        return f"crease {shown(crease.stiffness, 'N m/rad')}"
    if not isinstance(crease, SplineCrease) or crease.angle is None or crease.moment is None:
        return "crease curve from a file"
    low, high = (crease.scale * moment for moment in (min(crease.moment), max(crease.moment)))
    scaled = "" if crease.scale == 1.0 else f" (scale {crease.scale:g})"
    return f"crease {shown(crease.mean_stiffness, 'N m/rad')} on average, {shown_range(low, high, 'N m')}{scaled}"
