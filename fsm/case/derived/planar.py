"""Test whether a scene and its motion lie in the plane y = 0."""

from __future__ import annotations

from fsm.case.derived.contact_points import pairs_of_boxes
from fsm.case.models.scene import Scene

_TOLERANCE = 1e-12


def out_of_plane(scene: Scene) -> list[str]:
    """Reasons why a body of the scene needs 6 degrees of freedom; empty for a planar scene with 3.

    A scene is planar if all bodies and obstacles have their centres at y = 0 and are rotated about y only. No load, drive or
    velocity may be out of the plane.
    """
    reasons = []
    if scene.flexible:
        reasons.append("films, cables and beams have coordinates in space")
    if scene.point_elements:
        reasons.append("point elements act in space")
    if scene.joints:
        reasons.append("ideal joints act in space")
    if scene.springs or scene.cords:
        reasons.append("springs and cords between points act in space")
    if any(pair.geometry is not None for pair in scene.pairs):
        reasons.append("contact geometries of extensions act in space")
    if pairs_of_boxes(scene):
        reasons.append("boxes touch each other in space")
    if scene.pairs and any(body.plate is not None and body.plate.outline for body in scene.bodies):
        reasons.append("facets with outlines have contact in space only")
    for body in scene.bodies:
        _, x, _, z = body.orientation
        if abs(body.position[1]) > _TOLERANCE or abs(x) > _TOLERANCE or abs(z) > _TOLERANCE:
            reasons.append(f"body {body.name!r} is not centred in the plane y = 0, or is rotated out of it")
            break
    for body in scene.bodies:
        omega_x, _, omega_z = body.angular_velocity
        if abs(body.velocity[1]) > _TOLERANCE or abs(omega_x) > _TOLERANCE or abs(omega_z) > _TOLERANCE:
            reasons.append(f"body {body.name!r} has an initial velocity out of the plane")
            break
    for element in scene.elements:
        off_axis = [q for axes in (element.axes_inner, element.axes_outer) for q in (axes[1], axes[3])]
        points = (element.point_inner[1], element.point_outer[1])
        if any(abs(value) > _TOLERANCE for value in (*off_axis, *points)):
            reasons.append(f"element {element.name!r} acts out of the plane")
            break
    for load in scene.loads:
        if load.force[1] or load.moment[0] or load.moment[2] or load.point[1]:
            reasons.append(f"a load on body {load.body!r} acts out of the plane")
            break
    for drive in scene.drives:
        if drive.turn is None and drive.direction[1]:
            reasons.append("a drive moves out of the plane")
            break
        if drive.turn is not None and (drive.axis[0] or drive.axis[2]):
            reasons.append("a drive turns about an axis that is not normal to the plane")
            break
        if not drive.guide:
            reasons.append("a crease line without guide can move out of the plane")
            break
    for obstacle in scene.obstacles:
        _, x, _, z = obstacle.orientation
        if obstacle.shape != "sphere" and (abs(x) > _TOLERANCE or abs(z) > _TOLERANCE):
            reasons.append(f"obstacle {obstacle.name!r} is rotated out of the plane")
            break
        if obstacle.shape != "plane" and abs(obstacle.position[1]) > _TOLERANCE:
            reasons.append(f"obstacle {obstacle.name!r} is not centred in the plane y = 0")
            break
    if scene.gravity[1]:
        reasons.append("gravity acts out of the plane")
    return reasons
