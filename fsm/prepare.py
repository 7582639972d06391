"""From a case to a system that can be solved, or all its faults."""

from __future__ import annotations

from fsm.errors import CaseError, Fault
from fsm.overlap import find_overlaps
from fsm.scene.builders.strip import build_scene
from fsm.scene.case import Case
from fsm.scene.planar import out_of_plane
from fsm.scene.scene import Scene
from fsm.segments.compile import compile_scene
from fsm.segments.system import SegmentSystem

__all__ = ["prepare"]


def prepare(case: Case, source: str = "") -> tuple[Scene, SegmentSystem]:
    """Build and compile a case.

    Raises
    ------
    CaseError
        All faults of the scene, and panels that overlap as folded.
    """
    scene = build_scene(case)
    try:
        system = compile_scene(scene, case.solve.spatial)
    except CaseError as error:
        raise CaseError(error.faults, source) from None
    if scene.contact is not None and not out_of_plane(scene):
        faults = [
            Fault(
                "strip" if case.strip else "scene",
                f"{first} and {second} overlap at the start by {1e3 * depth:.3g} mm; "
                "use a smaller fold_angle or thickness, or thickness_in_gap = false",
            )
            for first, second, depth in find_overlaps(scene)
        ]
        if faults:
            raise CaseError(faults, source)
    return scene, system
