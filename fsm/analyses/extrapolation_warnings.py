"""Creases outside the angles of their tabulated curves, where the moment is extrapolated."""

from __future__ import annotations

import numpy as np

from fsm.case.models.materials import SplineCrease
from fsm.case.models.scene import ForceElement, Scene
from fsm.model.elements.creases import CreaseGroup
from fsm.model.system.system import SegmentSystem
from fsm.results.solution import Solution

_MARGIN = 0.01
"""Excess, relative to the range of angles, below which there is no warning (half a degree for a range of 50 degrees)."""
_NAMED = 4
"""Largest number of creases named in a warning."""


def extrapolation_warnings(solution: Solution, scene: Scene, system: SegmentSystem) -> list[str]:
    """Warnings on creases that are opened, and on creases that are closed, beyond their curves in a saved state.

    Parameters
    ----------
    solution : saved states
    scene : Scene
    system : compiled system of the scene
    """
    group = next((group for group in system.groups if isinstance(group, CreaseGroup)), None)
    creases = [element for element in scene.elements if element.crease is not None]
    if group is None or not len(solution) or all(_margin(crease) == np.inf for crease in creases):
        return []
    opening = _openings(solution, system, group)
    closed = _past(creases, group, opening.min(axis=0), 0)
    opened = _past(creases, group, opening.max(axis=0), -1)
    return [*_warning(creases, opened, -1, "opened"), *_warning(creases, closed, 0, "closed")]


def _openings(solution: Solution, system: SegmentSystem, group: CreaseGroup) -> np.ndarray:
    """Opening angles of the creases in all saved states, (n, m), rad, with the bending of the half segments in series."""
    poses, count = system.poses_over_time(solution.time, solution.q), len(group.bodies)
    states, each, width = len(poses), poses.shape[1], poses.shape[2]
    # all states in one call: the bodies of each state follow those of the state before
    bodies = (group.bodies + each * np.arange(states)[:, None, None]).reshape(-1, 2)
    constants = (np.concatenate([array] * states) for array in group.geometry)
    rates = np.zeros((states * each, 6 if system.spatial else 3))
    angles = group.measure(poses.reshape(-1, width), rates, bodies, *constants)[0]
    return np.asarray(group.rest - group.side * np.reshape(angles, (states, count)))


def _past(creases: list[ForceElement], group: CreaseGroup, opening: np.ndarray, end: int) -> np.ndarray:
    """Excess of each crease over the first (`end` 0) or last (-1) angle of its curve, (m,), rad.

    The half segments in series with a crease take a part of the opening. Beyond a curve its slope k is constant, and the
    crease takes the fraction 1 - k f of the opening.
    """
    table, number = group.table, group.curve
    knot = table.bounds[number] if end == 0 else table.bounds[number + 1] - 1
    part = 1.0 - table.coefficients[knot, 2] * np.array([element.crease_flexibility for element in creases])
    beyond = opening - table.knots[knot]
    return np.asarray(part * (-beyond if end == 0 else beyond))


def _warning(creases: list[ForceElement], past: np.ndarray, end: int, moved: str) -> list[str]:
    """Warning with the creases, the excess and the remedy."""
    far = [i for i, element in enumerate(creases) if past[i] > _margin(element)]
    if not far:
        return []
    most = max(far, key=lambda i: float(past[i]))
    crease = creases[most].crease
    assert isinstance(crease, SplineCrease) and crease.angle is not None
    names = ", ".join(creases[i].name for i in far[:_NAMED])
    more = f" and {len(far) - _NAMED} more" if len(far) > _NAMED else ""
    by = f"{creases[most].name} the farthest, by" if len(far) > 1 else "by"
    limit = f"{'begin' if end == 0 else 'end'} at {np.degrees(crease.angle[end]):.4g} deg"
    return [
        f"{names}{more} {moved} beyond the measured angles, which {limit}, {by} {np.degrees(past[most]):.3g} deg: the "
        "moment is extrapolated linearly there; extend the test to these angles"
    ]


def _margin(element: ForceElement) -> float:
    """Admissible excess of a crease over its curve, rad; infinite for a linear law."""
    crease = element.crease
    if not isinstance(crease, SplineCrease) or crease.angle is None:
        return np.inf
    return _MARGIN * (crease.angle[-1] - crease.angle[0])
