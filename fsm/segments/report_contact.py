"""What `fsm check` says of contact and friction."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fsm.scene.case import contact_scale
from fsm.scene.contact import Contact
from fsm.segments.report_view import View, count, millimetres

__all__ = [
    "SURFACE_TIP",
    "approximations_of_contact",
    "approximations_of_friction",
    "contact_lines",
    "friction_lines",
    "soft_contact",
]

SURFACE_TIP = 0.025
"""`fsm.interactions.surface.TIP`, which comes with the compiler; a test holds the two together."""

_SOFT = 0.005
"""Part of its peak that soft contact may cost a strip without a warning."""

_LAWS = {
    "hertz": "Hertz law",
    "impact": "impact law (ADAMS)",
    "linear": "linear law",
    "hunt-crossley": "Hunt-Crossley law",
    "lankarani-nikravesh": "Lankarani-Nikravesh law",
    "flores": "law of Flores",
    "restitution": "law of exact restitution",
}


def _lost(contact: Contact) -> str:
    """What a contact loses energy by."""
    if contact.restitution is not None:
        return f", coefficient of restitution {contact.restitution:g}"
    return f", damped: C = {contact.damping:.4g} N s/m" if contact.damping else ", not damped"


def contact_lines(view: View) -> Iterator[str]:
    """The pairs, the law, the points, the gap."""
    contact = view.scene.contact
    if contact is None or not view.pairs:
        return
    names = ", ".join(f"{pair.first} - {pair.second}" for pair in view.pairs)
    yield f"{count(len(view.pairs), 'pair')} watched: {names}"
    yield f"{_LAWS[contact.law]}, K = {contact.stiffness:.4g} N/m^{contact.exponent:g} of a whole face{_lost(contact)}"
    if contact.restitution is not None:
        slow = f"{millimetres(contact.speed_floor)}/s"
        yield f"impacts take about 90 steps at least; below {slow} a contact is a press, not an impact"
    yield f"{count(_contact_points(view), 'contact point')}, both faces of a pair watching each other"
    if view.scene.obstacles:
        yield "whether anything overlaps an obstacle at the start is found out by the run"
    if contact.thickness_in_gap:
        yield "faces touch at half the sum of their thicknesses"
    else:
        yield "middle surfaces touch: no thickness in the gap"


def _contact_points(view: View) -> int:
    assert view.scene.contact is not None
    per_segment = view.scene.contact.points_per_segment + 1
    # as in the compiler: plates that are not held, driven ones among them
    moving = [body.plate.length for body in view.scene.bodies if body.plate is not None and not body.held]
    mean = float(np.mean(moving)) if moving else 0.0
    total = rigid = 0
    balls = {obstacle.name for obstacle in view.scene.obstacles if obstacle.shape == "sphere"}
    for pair in view.pairs:
        if balls & {pair.first, pair.second}:
            rigid += 1  # the centre of the ball, for each plate
            continue
        total -= 2 if pair.shared == "end-start" else 0  # none on the crease itself
        sides = [view.parties[pair.first], view.parties[pair.second]]
        if any(side.kind != "surface" for side in sides):
            # rigid plates: corners and middles of the cells of a grid
            own = sides[:1] if pair.first == pair.second else sides  # a group with itself
            plates = sum(len(side.bodies) for side in own if side.kind != "obstacle")
            dimensions = 2 if view.spatial else 1
            rigid += plates * (per_segment**dimensions + (per_segment - 1) ** dimensions)
            continue
        for name in (*sides[0].bodies, *sides[1].bodies):
            body = view.bodies[name]
            assert body.plate is not None  # checked
            held = body.held and mean > 0.0
            # a held plate is cut into cells about as long as the segments that move
            total += per_segment * (max(1, round(body.plate.length / mean)) if held else 1)
    return total * (2 if view.spatial else 1) + rigid


def friction_lines(view: View) -> Iterator[str]:
    """The law."""
    law = view.scene.friction
    if law is None or not view.pairs:
        return
    if law.law == "lugre":
        yield (
            f"LuGre bristles: {law.mu_static:g} at rest after {millimetres(law.presliding or 0.0)}, "
            f"{law.mu_dynamic:g} sliding, over {millimetres(law.v_stribeck or 0.0)}/s"
        )
    elif law.law == "stribeck":
        yield (
            f"Stribeck: {law.mu_static:g} at {millimetres(law.v_static)}/s, {law.mu_dynamic:g} beyond "
            f"{millimetres(law.v_stribeck or 0.0)}/s"
        )
    elif law.law == "step":
        yield (
            f"two STEPs: {law.mu_static:g} at {millimetres(law.v_static)}/s, "
            f"{law.mu_dynamic:g} from {millimetres(law.v_dynamic or law.v_static)}/s on"
        )
    else:
        yield f"{law.mu_dynamic:g} tanh(v / {millimetres(law.v_static)}/s)"
    if law.across != 1.0:
        yield f"{law.across:g} times as much across a panel" + ("" if view.spatial else ": left out in the plane")


def approximations_of_contact(view: View) -> Iterator[str]:
    """What surfaces, thickness and pairs leave out."""
    contact = view.scene.contact
    assert contact is not None
    on_surfaces = any(view.parties[p.first].kind == view.parties[p.second].kind == "surface" for p in view.pairs)
    if not on_surfaces:
        yield "rigid plates are rounded by half their thickness; nearly parallel edges touch by the points along them"
        return
    if view.segment:
        off = millimetres(view.segment / 8 * math.radians(10))
        yield f"the contact surface departs from the segments by l alpha/8: {off} at a joint bent by 10 deg"
    if contact.thickness_in_gap and any(pair.shared == "end-start" for pair in view.pairs):
        yield "next to a shared crease the thickness in the gap is tapered to nothing: layers join there"
    yield (
        f"a surface goes on by {100 * SURFACE_TIP:g} % of its length beyond its ends, rounded off: "
        "all of it meets ends of other panels, half of it their other points"
    )
    if contact.pairs is not None:
        yield "only the pairs above touch: faces of other panels pass through each other"
    if view.spatial:
        yield "edges do not touch: points beyond a panel's sides, |y| > width/2, meet nothing"


def approximations_of_friction(view: View) -> str:
    """How the law departs from sticking."""
    law = view.scene.friction
    assert law is not None
    if law.law == "lugre":
        return "bristles are springs up to 0.8 of mu_static; between that and mu_static a load that swings slips a little"
    if law.law in ("step", "stribeck"):
        return (
            "friction creeps instead of sticking: on a slope a at v_static tan(a)/mu_static at most, "
            f"{millimetres(law.v_static)}/s at the limit"
        )
    return (
        "friction creeps instead of sticking: on a slope a it slides at v_static atanh(tan(a)/mu), "
        f"about v_static tan(a)/mu; v_static is {millimetres(law.v_static)}/s"
    )


def soft_contact(view: View) -> Iterator[str]:
    """Of a strip whose contact gives way where its panels buckle."""
    contact, strip, material = view.scene.contact, view.case.strip, view.case.material
    if contact is None or strip is None or material is None or not view.pairs:
        return
    force, _ = contact_scale(strip, material)
    depth = (force / contact.stiffness) ** (1.0 / contact.exponent)
    part = 10.0 * depth * strip.panels / strip.length
    if part > _SOFT:
        given = f"{contact.stiffness:.3g} N/m^{contact.exponent:g}"
        yield (
            f"contact.stiffness = {given} is soft for this strip: faces sink in by about {millimetres(depth)}, "
            f"which lowers a peak by about {100 * part:.2g} %; leave it out, and it follows from the material"
        )
