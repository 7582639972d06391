"""Does everything of a scene lie in the plane y = 0, and move in it?"""

from __future__ import annotations

from fsm.scene.scene import Scene

__all__ = ["out_of_plane"]

_TOLERANCE = 1e-12


def out_of_plane(scene: Scene) -> list[str]:
    """Reasons why the scene needs six degrees of freedom a body; empty when three will do.

    A scene is planar when all bodies are centred on y = 0 and turned about y only, obstacles too, and nothing pushes
    them out.
    """
    reasons = []
    for body in scene.bodies:
        _, x, _, z = body.orientation
        if abs(body.position[1]) > _TOLERANCE or abs(x) > _TOLERANCE or abs(z) > _TOLERANCE:
            reasons.append(f"body {body.name!r} is not centred in the plane y = 0 or is turned out of it")
            break
    for body in scene.bodies:
        omega_x, _, omega_z = body.angular_velocity
        if abs(body.velocity[1]) > _TOLERANCE or abs(omega_x) > _TOLERANCE or abs(omega_z) > _TOLERANCE:
            reasons.append(f"body {body.name!r} starts with a velocity out of the plane")
            break
    for element in scene.elements:
        off_axis = [q for axes in (element.axes_inner, element.axes_outer) for q in (axes[1], axes[3])]
        points = (element.point_inner[1], element.point_outer[1])
        if any(abs(value) > _TOLERANCE for value in (*off_axis, *points)):
            reasons.append(f"element {element.name!r} acts off the plane")
            break
    for load in scene.loads:
        if load.force[1] or load.moment[0] or load.moment[2] or load.point[1]:
            reasons.append(f"a load on body {load.body!r} pushes out of the plane")
            break
    for drive in scene.drives:
        if drive.direction[1]:
            reasons.append("a drive pulls out of the plane")
            break
        if not drive.guide:
            reasons.append("an unguided crease line can sway out of the plane")
            break
    for obstacle in scene.obstacles:
        _, x, _, z = obstacle.orientation
        if obstacle.shape != "sphere" and (abs(x) > _TOLERANCE or abs(z) > _TOLERANCE):
            reasons.append(f"obstacle {obstacle.name!r} is turned out of the plane")
            break
        if obstacle.shape != "plane" and abs(obstacle.position[1]) > _TOLERANCE:
            reasons.append(f"obstacle {obstacle.name!r} is not centred in the plane y = 0")
            break
    if scene.gravity[1]:
        reasons.append("gravity acts out of the plane")
    return reasons
