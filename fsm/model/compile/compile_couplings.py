"""Couplings of a scene as groups of elements on the coordinates of joints."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from fsm.case.models.coupling import SceneCoupling
from fsm.case.models.scene import ForceElement, Scene
from fsm.model.compile.compile_joints import coordinates_of
from fsm.model.elements.couplings import Coupling, CouplingGroup, Joints
from fsm.model.elements.gears import GEAR
from fsm.model.elements.locked_couplings import LOCKED_GEAR, LockedCouplings
from fsm.registry import COUPLINGS

OWN = {"gear": GEAR, "rack": GEAR}
"""Kinds of the package, `fsm.case.models.coupling.OWN_COUPLINGS`."""


def coupling_groups(
    scene: Scene, index: Mapping[str, int], poses: np.ndarray, twists_of: Callable[[list[ForceElement]], Joints]
) -> list[CouplingGroup]:
    """Groups of all couplings, one for each kind and sort of joints.

    Parameters
    ----------
    scene : scene without faults
    index : numbers of bodies
    poses : (n_bodies, 3 or 7) array
        Poses at the start.
    twists_of : twists of force elements
    """
    elements, joints = {e.name: e for e in scene.elements}, {joint.name: joint for joint in scene.joints}
    sorts: dict[tuple[str, bool, bool], list[SceneCoupling]] = {}
    for coupling in scene.couplings:
        sorts.setdefault((coupling.kind, coupling.joints[0] in joints, coupling.ideal), []).append(coupling)
    found = []
    for (kind, of_joints, locked), chosen in sorts.items():
        names = [name for coupling in chosen for name in coupling.joints]
        if of_joints:
            ends = np.array([[index[joints[name].first], index[joints[name].second]] for name in names], dtype=np.int64)
            measured = coordinates_of([joints[name] for name in names], ends, poses)
        else:
            measured = twists_of([elements[name] for name in names])
        law: Coupling = LOCKED_GEAR if locked else OWN[kind] if kind in OWN else COUPLINGS[kind].law
        found.append((LockedCouplings if locked else CouplingGroup)(
            measured.ends.reshape(len(chosen), -1), measured, law, tuple(coupling.parameters for coupling in chosen),
            tuple(coupling.name for coupling in chosen),
        ))  # fmt: skip
    return found
