"""Selection of the method for `method = "auto"`: statics for slow drives, dynamics otherwise.

The pace is a ratio: kinetic energy of the bodies at drive speed over elastic energy of a hinge. For the pulled strip at a
pace of 1e-6, static and dynamic force agree to 0.01 % of the peak. Statics takes a fifth of the time. At 1e-4 the dynamic
force at first contact reaches twice the peak (validation/benchmarks).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from fsm.case.models.coupling import OWN_COUPLINGS
from fsm.case.models.materials import SplineCrease
from fsm.case.models.scene import ForceElement, Scene
from fsm.case.models.solve import Solve
from fsm.case.models.time_program import Constant

MAX_STATIC_PACE = 1e-5
"""Largest pace for which statics is selected; statics neglects inertia."""
STATICS = "static", "arc-length"
"""Methods of equilibria."""
WITH_JOINTS = "generalized-alpha", "newmark", "mean-force", "explicit", *STATICS
"""Methods that have ideal joints."""
REFERENCES = "Radau", "BDF", "LSODA"
"""Methods of SciPy, which have ideal joints between rigid bodies."""
RTOL_OF_JOINTS = 1e-9
"""Relative tolerance with ideal joints. Nothing damps the errors of a mechanism, which add up over its turns: after some
swings of a pendulum, positions are off by 1e-3 of its length at 1e-6, and by 1e-5 at 1e-9."""
_MAX_PACE_OF_SHEETS = 1e-2
"""Largest pace for statics of trusses and of flexible facets without contact. There are no impacts, which would raise
the force. These parts have no dampers, so vibrations would not decay in a dynamic solution."""


def automatic_method(scene: Scene, comes_to_rest: bool = False, unheld: int = 0) -> tuple[str, str]:
    """Method for `method = "auto"`.

    Parameters
    ----------
    scene : Scene
    comes_to_rest : bool
        Whether the next stage starts at rest, so that inertia in this stage has no effect on it.
    unheld : int
        Number of motions at the start that neither ideal joints nor springs hold; used with ideal joints.

    Returns
    -------
    method, reason : str
    """
    dynamics = dynamic_method(scene)
    if not scene.drives:
        return dynamics, "there is no drive, so the motion is free"
    if scene.built.actions:
        return dynamics, "events happen in motions"
    if any(joint.motor is not None for joint in scene.joints):
        return dynamics, "motors of joints are computed in motions"
    if scene.joints and unheld:
        text = "1 motion of the bodies" if unheld == 1 else f"{unheld} motions of the bodies"
        return dynamics, f"neither joints nor springs hold {text}"
    if any(any(body.velocity) or any(body.angular_velocity) for body in scene.bodies):
        return dynamics, "bodies have initial velocities"
    if not all(load.time is None or isinstance(load.time, Constant) for load in scene.loads):
        return dynamics, "loads depend on time"
    if comes_to_rest:
        return "static", "the strip is at rest before it vibrates, so inertia of the deployment has no effect"
    sheet = scene.contact is None and (bool(scene.trusses) or scene.built.facets is not None)
    number, limit = pace(scene), _MAX_PACE_OF_SHEETS if sheet else MAX_STATIC_PACE
    if math.isinf(number):
        return dynamics, "no hinge or plate has a stiffness against bending, which would bring moving bodies to rest"
    if number > limit:
        return dynamics, f"the drive is fast: kinetic over elastic energy is {number:.1g}, above {limit:g}"
    return "static", f"the drive is slow: kinetic over elastic energy is {number:.1g}, below {limit:g}"


def dynamic_method(scene: Scene) -> str:
    """Method for motions: generalized-alpha is not used for undamped films and cables, because its numerical damping would
    remove their vibration energy, unless ideal joints need it. `fsm.model.plan.motion_method` takes explicit steps in its
    place where they cost less.
    """
    return "mean-force" if scene.flexible and not scene.joints else "generalized-alpha"


def beyond_explicit(scene: Scene) -> str:
    """Part of a scene that explicit steps do not have; empty if there is none."""
    elements = scene.elements
    parts = {
        "films, cables, beams, bars or flexible facets": scene.flexible,
        "contact": scene.contact is not None,
        "gas": scene.built.chambers,
        "a harness of a joint": any(joint.harness for joint in scene.joints),
        "friction of a joint with bristles": any(
            joint.friction and joint.friction.law == "lugre" for joint in scene.joints
        ),
        "a spring of a joint with hysteresis": any(getattr(joint.spring, "unloading", None) for joint in scene.joints),
        "friction of a cord": any(pulley.friction for cord in scene.cords for pulley in cord.over),
        "creases with hysteresis": any(getattr(e.crease, "hysteresis", False) for e in elements),
        "laws of extensions": scene.point_elements or any(e.law is not None for e in elements)
        or any(coupling.kind not in OWN_COUPLINGS for coupling in scene.couplings),
    }
    return next((name for name, given in parts.items() if given), "")


def slope_of(law: Any, key: str) -> float:
    """Coefficient of a law, or largest slope of its table."""
    rows = getattr(law, "table", None) or ()
    if isinstance(law, SplineCrease) and law.angle is not None and law.moment is not None:
        rows = tuple(zip(law.angle, (law.scale * moment for moment in law.moment), strict=True))
    slopes = (abs((b[1] - a[1]) / (b[0] - a[0])) for a, b in pairwise(rows))
    return max([float(getattr(law, key, None) or 0.0), *slopes])


def solve_of(solve: Solve, scene: Scene | None) -> Solve:
    """Settings of a motion: with ideal joints, springs or cords and without `rtol`, the tolerance of mechanisms.

    Settings with a method of statics remain.
    """
    if scene is None or scene.flexible or "rtol" in solve.model_fields_set:
        return solve
    if not (scene.joints or scene.springs or scene.cords):
        return solve
    if solve.method in STATICS:
        return solve
    return solve.model_copy(update={"rtol": RTOL_OF_JOINTS})


def pace(scene: Scene) -> float:
    """Ratio of the kinetic energy of all free parts at drive speed to the elastic energy of the softest hinge at a rotation
    of 1 rad.

    Hinges are force elements, springs of joints, the folds of trusses, and the creases of flexible facets. Facets without
    creases count as a square plate that is bent by 1 rad. The ratio is infinite if none of these has a stiffness.
    """
    reach = max((math.dist(place, (0.0, 0.0, 0.0)) for place in _places(scene)), default=0.0)
    speed = max((drive.fastest * (1.0 if drive.turn is None else reach) for drive in scene.drives), default=0.0)
    mass = sum(body.mass for body in scene.bodies if not body.held) + sum(sum(truss.mass) for truss in scene.trusses)
    hinges = [k for element in scene.elements if (k := hinge_stiffness(element)) > 0.0]
    springs = [(slope_of(joint.spring, "stiffness"), joint.kind == "prismatic") for joint in scene.joints]
    hinges += [k * (reach * reach if slides else 1.0) for k, slides in springs if k > 0.0]
    hinges += [k for truss in scene.trusses for k in truss.fold_stiffness if k > 0.0]
    if scene.built.facets is not None:
        mass += scene.built.facets.mass
        hinges += scene.built.facets.hinge_stiffness
    return mass * speed * speed / min(hinges) if hinges else float("inf")


def _places(scene: Scene) -> Iterator[tuple[float, ...]]:
    """Positions of bodies, of the points of trusses, and of the nodes of flexible facets, m."""
    yield from (body.position for body in scene.bodies)
    yield from (point for truss in scene.trusses for point in truss.points)
    if scene.built.facets is not None:
        yield from (tuple(place) for place in scene.built.facets.mesh.positions.tolist())


def hinge_stiffness(element: ForceElement) -> float:
    """Stiffness about the crease axis, N m/rad; for a tabulated crease the slope between the ends of its curve."""
    return element.twist_stiffness if element.crease is None else element.crease.mean_stiffness
