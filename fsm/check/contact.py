"""Report of `fsm check` on contact and friction."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from fsm.case.derived.contact_points import pairs_by_geometry, pairs_of_boxes, sheet_parts, sheet_spacing
from fsm.case.models.case import contact_scale
from fsm.case.models.contact import Contact
from fsm.case.models.flexible_facets import SHEET
from fsm.case.models.scene import Body
from fsm.check.view import CheckContext
from fsm.registry import CONTACT_LAWS, FRICTION_LAWS, GEOMETRIES, AddedLaw
from fsm.text.shown_units import count, shown

SURFACE_TIP = 0.025
"""Copy of `fsm.interactions.surfaces.surface.TIP`, whose module imports the compiler; a test compares both values."""

_SOFT = 0.005
"""Decrease of a strip's peak due to soft contact, relative to the peak, above which there is a warning."""

_LAWS = {
    "hertz": "Hertz law",
    "impact": "impact law (ADAMS)",
    "linear": "linear law",
    "hunt-crossley": "Hunt-Crossley law",
    "lankarani-nikravesh": "Lankarani-Nikravesh law",
    "flores": "law of Flores",
    "restitution": "law with exact restitution",
}


def _added(law: AddedLaw, parameters: Mapping[str, Any] | None) -> str:
    """Law or geometry with its parameters in SI, and whether it is of an extension."""
    values = {key: f"{value:.4g}" if isinstance(value, float) else value for key, value in (parameters or {}).items()}
    given = ", ".join(f"{key} {value}" for key, value in values.items())
    own = getattr(law.law, "__module__", "").startswith("fsm.model.")  # a contact geometry of the package
    notes = "; ".join(text for text in ("" if own else "extension", given) if text)
    return f"{law.text} ({notes})" if notes else law.text


def _damping(contact: Contact) -> str:
    """Dissipation of a contact."""
    if contact.restitution is not None:
        return f", coefficient of restitution {contact.restitution:g}"
    return f", damping C = {contact.damping:.4g} N s/m" if contact.damping else ", no damping"


def contact_lines(view: CheckContext) -> Iterator[str]:
    """Lines on pairs, law, contact points and gap."""
    contact = view.scene.contact
    if contact is None or not view.pairs:
        return
    names = ", ".join(f"{pair.first} - {pair.second}" for pair in view.pairs)
    yield f"{count(len(view.pairs), 'pair')}: {names}"
    law = _LAWS[contact.law] if contact.law in _LAWS else _added(CONTACT_LAWS[contact.law], contact.parameters)
    faces = sorted({group.face for group in view.scene.groups if group.face is not None})
    if view.scene.built.touching is not None:
        faces = [view.scene.built.touching.mean_facet]
    where = f"{shown(faces[0], 'm^2')}, the area of a mean facet" if len(faces) == 1 else "a whole face"
    yield f"{law}, K = {contact.stiffness:.4g} N/m^{contact.exponent:g} for {where}{_damping(contact)}"
    if contact.restitution is not None:
        slow = shown(contact.speed_floor, "m/s")
        yield f"an impact takes at least about 90 steps; a contact that closes slower than {slow} is not an impact"
    for name, pairs in pairs_by_geometry(view.scene).items():
        if name in GEOMETRIES:
            first = pairs[0][1]
            others = f", {first.first} - {first.second}" + (f" and {len(pairs) - 1} more" if len(pairs) > 1 else "")
            yield _added(GEOMETRIES[name], first.parameters) + others
    boxes = pairs_of_boxes(view.scene)
    if boxes:
        cells = 6 * contact.points_per_segment**2
        yield (
            f"{count(len(boxes), 'pair')} of boxes: the smaller box of a pair is an elastic foundation of {cells} cells, "
            "with K for its largest face"
        )
    points = _contact_points(view)
    if points:
        yield f"{count(points, 'contact point')} on both faces of all pairs"
    if view.scene.built.touching is not None:
        crossing = "edges that cross touch at half of the thickness" if contact.thickness_in_gap else "edges do not touch"
        yield f"nodes of facets touch the planes of nearby triangles; {crossing}"
        if view.scene.built.facets is None:
            yield "triangles between bars stay flat, and touch with their vertices and edges only"
        else:
            yield "parts of one facet touch only if they are more than three longest edges of the mesh apart"
        yield "facets with a common vertex have no contact where they touch at the start"
        if contact.thickness_in_gap:
            yield "facets with a common crease touch at a distance that grows from zero at the crease to the thickness"
        wanted, _ = sheet_spacing(view.scene)
        if math.isfinite(wanted):
            apart = shown(view.scene.built.touching.longest_edge / sheet_parts(view.scene), "m")
            yield f"bodies and obstacles touch the sheet at points up to {apart} apart; {shown(wanted, 'm')} is wanted"
    if view.scene.obstacles:
        yield "overlap with obstacles at the start is checked by the run, not here"
    if contact.thickness_in_gap:
        yield "faces touch at half the sum of their thicknesses"
    else:
        yield "middle surfaces touch, because the gap does not include the thickness"


def _contact_points(view: CheckContext) -> int:
    assert view.scene.contact is not None
    per_segment = view.scene.contact.points_per_segment + 1
    # this corresponds to the compiler, which uses plates that are not held, including driven plates
    moving = [body.plate.length for body in view.scene.bodies if body.plate is not None and not body.held]
    mean = float(np.mean(moving)) if moving else 0.0
    total = rigid = 0
    balls = {obstacle.name for obstacle in view.scene.obstacles if obstacle.shape == "sphere"}
    for pair in view.pairs:
        if pair.geometry is not None:
            continue
        if balls & {pair.first, pair.second}:
            rigid += 1  # the sphere has one contact with each plate
            continue
        total -= 2 if pair.shared == "end-start" else 0  # the crease itself has no point
        sides = [view.sides[pair.first], view.sides[pair.second]]
        if any(side.kind == "film" for side in sides):
            touching = sides[:1] if pair.first == pair.second else sides
            rigid += sum(len(side.bodies) for side in touching if side.kind == "film")
            continue
        if any(side.kind != "surface" for side in sides):
            # rigid plates: corners and centres of the cells of a grid
            own = sides[:1] if pair.first == pair.second else sides  # pair of a group with itself
            bodies = [view.bodies[name] for side in own if side.kind != "obstacle" for name in side.bodies]
            rigid += sum(_points_of_plate(body, per_segment - 1, view.spatial) for body in bodies)
            continue
        for name in (*sides[0].bodies, *sides[1].bodies):
            body = view.bodies[name]
            assert body.plate is not None
            held = body.held and mean > 0.0
            # a held plate has cells about as long as the moving segments
            total += per_segment * (max(1, round(body.plate.length / mean)) if held else 1)
    return total * (2 if view.spatial else 1) + rigid


def _points_of_plate(body: Body, cells: int, spatial: bool) -> int:
    """Contact points of a plate: corners and centres of the cells of its grid, or of its triangles."""
    assert body.plate is not None
    if body.plate.outline is None:
        dimensions = 2 if spatial else 1
        return int((cells + 1) ** dimensions + cells**dimensions)
    triangles = len(body.plate.outline) - 2
    return triangles * ((cells + 1) * (cells + 2) // 2 + cells**2) - (triangles - 1) * (cells + 1)


def friction_lines(view: CheckContext) -> Iterator[str]:
    """Lines on the friction law."""
    law = view.scene.friction
    if law is None or not view.pairs:
        return
    if law.law in FRICTION_LAWS:
        yield _added(FRICTION_LAWS[law.law], law.parameters)
    elif law.law == "lugre":
        yield (
            f"LuGre bristles: mu {law.mu_static:g} at a deflection of {shown(law.presliding or 0.0, 'm')}, "
            f"{law.mu_dynamic:g} when sliding faster than about {shown(law.v_stribeck or 0.0, 'm/s')}"
        )
    elif law.law == "stribeck":
        yield (
            f"Stribeck curve: mu {law.mu_static:g} at {shown(law.v_static, 'm/s')}, {law.mu_dynamic:g} above about "
            f"{shown(law.v_stribeck or 0.0, 'm/s')}"
        )
    elif law.law == "step":
        yield (
            f"two STEP functions: mu {law.mu_static:g} at {shown(law.v_static, 'm/s')}, "
            f"{law.mu_dynamic:g} above {shown(law.v_dynamic or law.v_static, 'm/s')}"
        )
    else:
        yield f"mu = {law.mu_dynamic:g} tanh(v / {shown(law.v_static, 'm/s')})"
    if law.across != 1.0:
        yield f"mu across a panel is {law.across:g} times as large" + ("" if view.spatial else ", not used in planar motion")


def approximations_of_contact(view: CheckContext) -> Iterator[str]:
    """Approximations of surfaces, thickness and pairs."""
    contact = view.scene.contact
    assert contact is not None
    rigid = {obstacle.name for obstacle in view.scene.obstacles if obstacle.shape == "cylinder"}
    if view.spatial and any(rigid & {pair.first, pair.second} for pair in view.pairs):
        yield "the rim of a tilted cylinder is a circle that touches a plane or a plate at one point, with K/24"
    on_surfaces = any(view.sides[p.first].kind == view.sides[p.second].kind == "surface" for p in view.pairs)
    boxes = pairs_of_boxes(view.scene)
    if boxes:
        yield (
            "boxes on boxes: pressure K/S times the depth, so edges and corners are softer than faces, by depth over size "
            "and its square; faces are less stiff by twice the depth over their side"
        )
        if contact.exponent != 1.0:
            yield f"a cell that is covered in part, T, has T^{0.5 * contact.exponent + 0.5:g} of the force of a whole one"
    if all(pair.geometry is not None or pair in boxes for pair in view.pairs):
        return
    if not on_surfaces:
        yield "edges of rigid plates are rounded by half the thickness; nearly parallel edges have contact at points only"
        if any(SHEET in (pair.first, pair.second) for pair in view.pairs):
            yield "facets touch at t min(1, s/L) at the distance s from a common crease; L is the depth of the smaller facet"
        return
    if view.segment:
        off = shown(view.segment / 8 * math.radians(10), "m")
        yield f"the contact surface deviates from the segments by l alpha/8: {off} at a joint bent by alpha = 10 deg"
    if contact.thickness_in_gap and any(pair.shared == "end-start" for pair in view.pairs):
        yield "beside a common crease the thickness in the gap decreases to zero, because the layers are joined there"
    yield (
        f"a surface is extended beyond its ends by a rounded tip of {100 * SURFACE_TIP:g} % of its length; "
        "ends of other panels touch the whole tip, their other points half of it"
    )
    if contact.pairs is not None:
        yield "only the pairs above have contact: other panels pass through each other"
    if view.spatial:
        yield "side edges have no contact: points beyond the sides of a panel, |y| > width/2, touch nothing"


def approximations_of_friction(view: CheckContext) -> str:
    """Approximation of a sticking contact by the friction law."""
    law = view.scene.friction
    assert law is not None
    if law.law in FRICTION_LAWS:
        return "an extension computes the friction"
    if law.law == "lugre":
        return "bristles are elastic up to 0.8 mu_static; an oscillating load above it causes some slip below mu_static"
    if law.law in ("step", "stribeck"):
        return (
            "regularised friction creeps: the speed on a slope a is at most v = v_static tan(a)/mu_static, "
            f"{shown(law.v_static, 'm/s')} at the limit"
        )
    return (
        "regularised friction creeps: the speed on a slope a is v = v_static atanh(tan(a)/mu), "
        f"about v_static tan(a)/mu; v_static is {shown(law.v_static, 'm/s')}"
    )


def stick_slip(view: CheckContext) -> Iterator[str]:
    """Line on drives whose speed is in the range where friction falls with speed."""
    law = view.scene.friction
    if law is None or not view.pairs or law.mu_static <= law.mu_dynamic:
        return
    slow, fast = law.v_static, law.v_dynamic if law.law == "step" else law.v_stribeck
    speeds = [drive.fastest for drive in view.scene.drives if drive.turn is None]
    if fast is None or not speeds or not slow < max(speeds) < fast:
        return
    yield (
        f"drive speed {shown(max(speeds), 'm/s')}, where friction falls with speed: contacts may alternately stick "
        f"and slip, and a run may take long; use a speed below v_static = {shown(slow, 'm/s')} or above "
        f"{shown(fast, 'm/s')}"
    )


def soft_contact(view: CheckContext) -> Iterator[str]:
    """Warning about a low contact stiffness, which lowers the peak of a strip."""
    contact, strip, material = view.scene.contact, view.case.strip, view.case.material
    if contact is None or strip is None or material is None or not view.pairs:
        return
    force, _ = contact_scale(strip, material)
    depth = (force / contact.stiffness) ** (1.0 / contact.exponent)
    part = 10.0 * depth * strip.panels / strip.length
    if part > _SOFT:
        given = f"{contact.stiffness:.3g} N/m^{contact.exponent:g}"
        yield (
            f"contact.stiffness = {given} is low for this strip: the penetration is about {shown(depth, 'm')}, "
            f"which lowers the peak by about {100 * part:.2g} %; remove this key to use the material"
        )
