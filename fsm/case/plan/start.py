"""Initial state of a deployment, and the reason for it."""

from __future__ import annotations

import numpy as np

from fsm.case.models.case import Case, Start
from fsm.case.models.materials import SplineCrease
from fsm.case.models.scene import ForceElement, Scene

_SAME_ANGLE = 1e-9
"""Difference below which two angles are the same, rad."""


def start_of(case: Case, scene: Scene) -> tuple[Start, str]:
    """Initial state of a case, and the reason; the key `start` of the case decides if it is given.

    A strip without a drive, whose creases carry moment as folded, starts as folded and at rest. All other strips start in
    equilibrium. Scenes and lattices start as given.

    Parameters
    ----------
    case : Case
    scene : Scene
        Scene of the case.
    """
    if case.start is not None:
        return case.start, "set by `start`"
    if case.strip is None:
        return "as-folded", "initial positions of the case"
    if scene.drives:
        return "equilibrium", "the strip has a drive"
    if creases_at_rest(scene):
        return "equilibrium", "the creases carry no moment as folded"
    return "as-folded", "the strip has no drive, and its creases carry moment as folded"


def creases_at_rest(scene: Scene) -> bool:
    """Whether all creases of a scene are free of moment at their initial angle."""
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
