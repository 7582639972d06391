"""All faults of a scene, found before it is compiled."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from fsm.case.derived.frame_bodies import frame_faults, norm_faults
from fsm.case.models.scene import DIRECTIONS, GROUND, ForceElement, Scene
from fsm.case.schema.known_names import nearest_name
from fsm.errors import Fault
from fsm.model.elements.element_angles import angle_faults
from fsm.model.faults.check_contacts import contact_faults
from fsm.model.faults.check_joints import coupling_faults, joint_faults


def check_scene(scene: Scene) -> list[Fault]:
    """All faults of a scene; empty when it can be compiled."""
    return [
        *_bodies(scene),
        *frame_faults(scene),
        *_references(scene),
        *angle_faults(scene),
        *contact_faults(scene),
        *joint_faults(scene),
        *coupling_faults(scene),
        *_drives(scene),
    ]


def _bodies(scene: Scene) -> Iterator[Fault]:
    if not scene.bodies and not scene.flexible:
        yield Fault("scene.bodies", "the scene has no bodies; give at least one")
    for name, count in Counter(body.name for body in scene.bodies).items():
        if count > 1:
            yield Fault("scene.bodies", f"the name {name!r} is used {count} times; names must differ")
    driven = {name for drive in scene.drives for name in drive.moved}
    for i, body in enumerate(scene.bodies):
        path = f"scene.bodies.{i}"
        if body.name == GROUND:
            text = f"{GROUND!r} is the fixed body of every scene; choose another name"
            yield Fault(f"{path}.name", text)
        yield from norm_faults(f"{path}.orientation", body.orientation)
        if body.held or body.name in driven:
            continue
        if body.mass <= 0:
            yield Fault(f"{path}.mass", f"{body.mass:g} kg of a body that can move ({body.name!r}); it must be positive")
        if min(body.inertia) <= 0:
            yield Fault(f"{path}.inertia", f"{body.inertia} kg m^2 of {body.name!r}; all three must be positive")
        largest = max(body.inertia)
        if largest > (sum(body.inertia) - largest) * (1 + 1e-9):
            yield Fault(f"{path}.inertia", f"{body.inertia} kg m^2: one moment exceeds the sum of the others")


def _is_linear_crease(element: ForceElement) -> bool:
    """Whether an element is a crease by its kind, with a linear spring about its axis."""
    return element.kind == "crease" and element.frame == "outer" and element.rotation[1] > 0.0


def _references(scene: Scene) -> Iterator[Fault]:
    names = dict.fromkeys([GROUND, *(body.name for body in scene.bodies)])
    for i, element in enumerate(scene.elements):
        for end in ("inner", "outer"):
            name = getattr(element, end)
            if name not in names:
                yield Fault(f"scene.elements.{i}.{end}", f"no body is called {name!r}{nearest_name(name, list(names))}")
        for axes in ("axes_inner", "axes_outer"):
            yield from norm_faults(f"scene.elements.{i}.{axes}", getattr(element, axes))
        if element.crease_flexibility and element.crease is None and not _is_linear_crease(element):
            text = f"{element.crease_flexibility:g} rad/(N m) is in series with a missing `crease`; remove this key"
            yield Fault(f"scene.elements.{i}.crease_flexibility", text)
        ligament = 'not available for a ligament (frame = "chord"), which is always linear; remove this key'
        if element.bends and element.frame != "chord":
            yield Fault(f"scene.elements.{i}.bends", 'is for ligaments; add `frame = "chord"` or remove this key')
        if element.latch and element.law is not None:
            yield Fault(f"scene.elements.{i}.latch", "not available with `law`; remove one of them")
        if element.frame == "chord" and element.law is not None:
            yield Fault(f"scene.elements.{i}.law", ligament)
        if element.inner == element.outer:
            yield Fault(f"scene.elements.{i}", f"joins {element.inner!r} to itself")
        if element.frame == "chord" and element.crease is not None:
            yield Fault(f"scene.elements.{i}.crease", ligament)
        if element.locked and (element.frame == "chord" or (element.rest_turn and "psi" in element.locked)):
            text = 'not available with frame = "chord", and psi not with `rest_turn`; remove this key'
            yield Fault(f"scene.elements.{i}.locked", text)
        stiffness = dict(zip(DIRECTIONS, (*element.translation, *element.rotation), strict=True))
        for k, direction in enumerate(element.locked):
            if not stiffness[direction]:
                text = f"{direction} has no stiffness; give one in `translation` or `rotation`, as 1e7 times the others"
                yield Fault(f"scene.elements.{i}.locked.{k}", text)
        if element.crease is not None and element.rotation[1]:
            what = f"{element.rotation[1]:g} N m/rad is not used beside `crease`, which gives the twist; write 0"
            yield Fault(f"scene.elements.{i}.rotation.1", what)
    for i, group in enumerate(scene.point_elements):
        for k, point in enumerate(group.points):
            if point.body not in names:
                text = f"no body is called {point.body!r}{nearest_name(point.body, list(names))}"
                yield Fault(f"scene.point_elements.{i}.points.{k}.body", text)
    for i, load in enumerate(scene.loads):
        if load.pressure is None and load.body not in names:
            yield Fault(f"load.{i}.body", f"no body is called {load.body!r}{nearest_name(load.target, list(names))}")


def _drives(scene: Scene) -> Iterator[Fault]:
    bodies = {body.name: body for body in scene.bodies}
    for i, drive in enumerate(scene.drives):
        if drive.crease is not None:
            yield Fault(f"drive.{i}.crease", "a scene without a strip has no numbered creases; give `body`")
        elif drive.edge is not None:
            yield Fault(f"drive.{i}.edge", "a scene without a lattice has no named edges; give `bodies`")
        key = "body" if drive.body is not None else "bodies"
        for name in drive.moved:
            if name not in bodies:
                yield Fault(f"drive.{i}.{key}", f"no body is called {name!r}{nearest_name(name, list(bodies))}")
            elif bodies[name].held:
                yield Fault(f"drive.{i}.{key}", f"{name!r} is held; a held body cannot be driven")
    for name, count in Counter(name for drive in scene.drives for name in drive.moved).items():
        if count > 1:
            yield Fault("drive", f"{name!r} is driven {count} times; one drive a body")
