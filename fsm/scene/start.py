"""State that a deployment starts from, and the reason for it."""

from __future__ import annotations

import numpy as np

from fsm.scene.case import Case, Start
from fsm.scene.materials import SplineCrease
from fsm.scene.scene import ForceElement, Scene

__all__ = ["creases_at_rest", "start_of"]

_SAME_ANGLE = 1e-9
"""Angles that differ by less are the same, rad."""


def start_of(case: Case, scene: Scene) -> tuple[Start, str]:
    """Start of a case and the reason, `start` of the case if it is given.

    A strip without a drive whose creases carry moment as folded is released: it starts as folded, at rest. Every other
    strip starts in equilibrium, scenes and lattices as given.

    Parameters
    ----------
    case : Case
    scene : Scene
        Of the case.
    """
    if case.start is not None:
        return case.start, "asked for"
    if case.strip is None:
        return "as-folded", "the scene as given"
    if scene.drives:
        return "equilibrium", "the strip is driven"
    if creases_at_rest(scene):
        return "equilibrium", "the creases are at rest as folded"
    return "as-folded", "no drive, and the creases are not at rest as folded: the strip is released"


def creases_at_rest(scene: Scene) -> bool:
    """Whether no crease of a scene carries a moment at its initial angle."""
    return all(_at_rest(element) for element in scene.elements if element.kind == "crease")


def _at_rest(element: ForceElement) -> bool:
    crease = element.crease
    folded = abs(element.initial_angle or 0.0)
    opening = (folded if element.rest_angle is None else abs(element.rest_angle)) - folded
    if isinstance(crease, SplineCrease) and crease.angle is not None and crease.moment is not None:
        largest = float(np.abs(crease.moment).max())
        inside = crease.angle[0] <= opening <= crease.angle[-1]
        return inside and abs(float(np.interp(opening, crease.angle, crease.moment))) <= 1e-9 * largest
    return element.rotation[1] == 0.0 or abs(opening) <= _SAME_ANGLE
