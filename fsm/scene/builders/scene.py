"""Scene of a deployment case."""

from __future__ import annotations

from fsm.scene.builders.lattice import build_lattice
from fsm.scene.builders.strip import build_strip
from fsm.scene.case import Case
from fsm.scene.scene import Scene

__all__ = ["build_scene"]


def build_scene(case: Case) -> Scene:
    """Scene of a case: from its strip, its lattice, or its [scene] with the contact, loads and drives of the case."""
    if case.strip is not None:
        return build_strip(case)
    if case.lattice is not None:
        return build_lattice(case)
    assert case.scene is not None
    update = {
        name: value
        for name, value in (
            ("contact", case.contact),
            ("friction", case.friction),
            ("loads", case.load),
            ("obstacles", case.obstacle),
            ("drives", case.drive),
            ("gravity", case.gravity if any(case.gravity) else None),
        )
        if value
    }
    return case.scene.model_copy(update=update)
