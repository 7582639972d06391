"""Faults of couplings, found before the scene is compiled."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from fsm.case.models.coupling import SceneCoupling
from fsm.case.models.joint import SceneJoint
from fsm.case.models.scene import Scene
from fsm.case.schema.known_names import nearest_name
from fsm.errors import Fault


def coupling_faults(scene: Scene) -> Iterator[Fault]:
    """Faults of `[[scene.couplings]]`."""
    elements, joints = {element.name: element for element in scene.elements}, {joint.name: joint for joint in scene.joints}
    for name, times in Counter(coupling.name for coupling in scene.couplings).items():
        if times > 1:
            yield Fault("scene.couplings", f"the name {name!r} is used {times} times; names must differ")
    for i, coupling in enumerate(scene.couplings):
        path = f"scene.couplings.{i}"
        found: list[SceneJoint] = []
        for k, name in enumerate(coupling.joints):
            if name in joints:
                found.append(joints[name])
                if joints[name].kind not in ("revolute", "prismatic"):
                    text = f"joint {name!r} of kind {joints[name].kind!r} has no single coordinate"
                    yield Fault(f"{path}.joints.{k}", f"{text}; couple revolute or prismatic joints")
            elif name not in elements:
                known = [*joints, *elements]
                what = "joint or element" if joints else "element"
                yield Fault(f"{path}.joints.{k}", f"no {what} is called {name!r}{nearest_name(name, known)}")
            elif elements[name].frame == "chord":
                text = f'{name!r} is a hinge of finite length (`frame` "chord"), whose twist no coupling has'
                yield Fault(f"{path}.joints.{k}", text)
        yield from _sorts(path, coupling, found, all(name in joints or name in elements for name in coupling.joints))


def _sorts(path: str, coupling: SceneCoupling, joints: list[SceneJoint], known: bool) -> Iterator[Fault]:
    """Faults of the sorts of joints of a coupling."""
    if known and 0 < len(joints) < len(coupling.joints):
        yield Fault(f"{path}.joints", "couples an ideal joint with a force element; use joints of one sort")
    if known and coupling.ideal and not joints:
        text = "an ideal coupling acts on [[scene.joints]]; give a stiffness for force elements, for example"
        yield Fault(f"{path}.parameters.stiffness", f'{text} "5 N m/rad"')
    if len(set(coupling.joints)) < len(coupling.joints):
        yield Fault(f"{path}.joints", f"{coupling.joints[0]!r} is coupled with itself")
    slides = bool(joints) and joints[0].kind == "prismatic"
    if known and coupling.kind in ("gear", "rack") and slides != (coupling.kind == "rack"):
        moves, other = ("slides", "rack") if slides else ("turns", "gear")
        yield Fault(f"{path}.kind", f'the first joint {coupling.joints[0]!r} {moves}, which is kind "{other}"')
