"""Warnings on the results of a deployment: deep contacts, panels that cross, stretch or tear, large errors, creases beyond
their data, a pull that is too fast, and a peak at its end.

Pulls that are not quasi-static, or that end before their peak.

Creases outside the angles of their tabulated curves, where the moment is extrapolated.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.analyses.branch_points import branch_warnings
from fsm.analyses.panel_crossing import lattice_overlap, unwatched_crossings
from fsm.case.models.case import Case
from fsm.case.models.materials import SplineCrease
from fsm.case.models.scene import ForceElement, Scene
from fsm.model.elements.creases import CreaseGroup
from fsm.model.plan.planned import Plan
from fsm.model.system.system import SegmentSystem
from fsm.results.curve import START_UP
from fsm.results.quantities import in_motion
from fsm.results.solution import ENERGIES, Solution
from fsm.text.shown_units import count, shown

_MARGIN = 0.01
"""Excess, relative to the range of angles, below which there is no warning (half a degree for a range of 50 degrees)."""
_NAMED_CREASES = 4
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
    names = ", ".join(creases[i].name for i in far[:_NAMED_CREASES])
    more = f" and {len(far) - _NAMED_CREASES} more" if len(far) > _NAMED_CREASES else ""
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


_STORED = tuple(name for name in ENERGIES if name not in ("kinetic", "drives", "dissipated", "numerical", "work", "error"))
"""Potential energies of a record, except of drives."""


def pull_warnings(solution: Solution, summary: dict[str, Any], structure: bool) -> list[str]:
    """Warnings on a pull that is not quasi-static, or that ends before its peak.

    A pull has to be slow if it deploys a `structure`: a strip, lattice or sheet. A drive of a [scene] may be a machine,
    whose force is due to inertia at any speed.
    """
    found: list[str] = []
    if not solution.travel.size:
        return found
    statics = set(summary["method"].split(" + ")) == {"static"}
    moving = _too_fast(solution, summary) if structure else np.zeros(len(solution.time), dtype=bool)
    if moving.any():
        at = solution.layout.travel_text(float(solution.travel[np.argmax(moving), 0]))
        off = f"at {at} the kinetic energy is above 1 % of the largest stored energy"
        found.append(
            f"statics neglects inertia, but {off} at this speed; pull slower, or give solve.method = \"generalized-alpha\""
            if statics
            else f"not quasi-static: {off}; pull slower"
        )
    if structure and summary["peak_kind"] == "dynamic":
        found.append("no part of the pull is quasi-static: peak_force is the largest dynamic force; pull slower")
    # if other drives continue, the force may have decreased while the travel stayed the same
    at_end = summary["peak_travel"] > 0.999 * solution.travel[-1, 0]
    if at_end and summary["final_force"] >= summary["peak_force"] - 1e-3 * abs(summary["peak_force"]) and _rises(solution):
        what, way = ("moment", "turn") if solution.layout.turns() else ("force", "travel")
        found.append(f"the {what} is still rising at the end of the {way}; the peak may lie beyond this {way}")
    return found


def _too_fast(solution: Solution, summary: dict[str, Any]) -> np.ndarray:
    """Records (n,) in which kinetic energy exceeds 1 % of the largest change of stored energy, outside events.

    Events of a static run, such as snaps, are motions at any speed of the drive. The first 2 % of the travel are ignored.
    """
    stored = sum(solution.energy[name] - solution.energy[name][0] for name in _STORED)
    moving = solution.energy["kinetic"] > 0.01 * float(np.max(np.abs(stored)))
    moving &= solution.travel[:, 0] > START_UP * solution.travel[-1, 0]
    for event in summary["events"]:
        moving &= ~((solution.time >= event["time"]) & (solution.time <= event["end_time"]))
    return np.asarray(moving)


def _rises(solution: Solution) -> bool:
    """Whether the force of the first drive rises by more than 0.1 % in the last 5 % of the travel."""
    travel, force = solution.travel[:, 0], solution.force[:, 0]
    before = force[np.flatnonzero(travel <= 0.95 * travel[-1])[-1:]]
    return bool(np.any(force[-1] - before > 1e-3 * abs(force[-1])))


_NAMED = 3
"""Largest number of pairs of panels named in a warning."""
_STRETCHED = 0.01
"""Separation of the sides of a joint relative to the length of a segment. A larger value means that a strip is pulled beyond
its full length. Real sheets yield earlier."""

_TORN = 1e-3
"""Separation of the sides of a crease relative to the length of a facet, above which facets cannot follow a motion."""
DEEP = 0.2
"""Ratio of the penetration of contacts to the largest thickness, above which there is a warning."""


def deploy_warnings(
    solution: Solution, summary: dict[str, Any], case: Case, scene: Scene, system: SegmentSystem, plan: Plan,
    same_throughout: bool, ends_on_path: bool, structure: bool,
) -> list[str]:  # fmt: skip
    """Warnings on the results of a deployment.

    Parameters
    ----------
    solution, summary : results of the run
    case, scene, system, plan : the model and its steps
    same_throughout : whether `system` gives the forces of all records
    ends_on_path : whether a drive acts in the last state
    structure : see `pull_warnings`
    """
    found = []
    thickness = solution.layout.thickness
    if solution.pair_gap.size and -solution.pair_gap.min() > DEEP * thickness > 0.0:
        pair = solution.layout.pair_names[int(np.argmin(solution.pair_gap.min(axis=0)))]
        found.append(
            f"faces of {pair} penetrate by {shown(-solution.pair_gap.min(), 'm')}, more than a fifth of the thickness; "
            "raise contact.stiffness"
        )
    found += branch_warnings(solution, system)
    found += _crossed(unwatched_crossings(solution, scene), solution)
    found += _stretched(solution, case, system, same_throughout) + _torn(summary, case, system)
    if case.sheet is not None:
        from fsm.analyses.sheet_motion import fold_warning  # imports all parts of patterns

        found += fold_warning(solution, summary.get("folded", {}))
    meeting = lattice_overlap(solution, scene)
    if meeting:
        found.append(meeting)
    arcs = [repr(step.name) for step in plan.steps if step.method == "arc-length"]
    if arcs and scene.friction is not None:
        found.append(f'"arc-length" has no friction: contacts slide without it in {", ".join(arcs)}')
    found += _unstable_at_end(solution) if ends_on_path else []
    return found + extrapolation_warnings(solution, scene, system) + (
        [] if plan.written else pull_warnings(solution, summary, structure)
    )


def _torn(summary: dict[str, Any], case: Case, system: SegmentSystem) -> list[str]:
    """Warning if the two sides of a joint of a sheet separate, because rigid facets cannot follow the drive."""
    length = system.scales().length
    if case.sheet is None or summary["joint_opening"] <= _TORN * length:
        return []
    return [
        f"facets separate by up to {shown(summary['joint_opening'], 'm')} at their creases, so rigid facets cannot "
        "follow this motion and the force is not physical; change drive or supports, or try facets = \"bend-lines\""
    ]


def _stretched(solution: Solution, case: Case, system: SegmentSystem, same_throughout: bool) -> list[str]:
    """Warning if a drive stretches the panels of a strip, with the travel at which this begins."""
    if case.strip is None or not solution.travel.shape[1] or not same_throughout:
        return []
    length = system.scales().length
    for poses, travel in zip(system.poses_over_time(solution.time, solution.q), solution.travel[:, 0], strict=True):
        if system.opening_of(poses)[0] > _STRETCHED * length:
            apart, joint = system.max_joint_opening(float(solution.time[-1]), solution.q[-1])
            return [
                f"panels are stretched by over {100 * _STRETCHED:g} % from {shown(travel, 'm')} of travel on, by "
                f"{100 * apart / length:.2g} % at its end ({joint}): a drive pulls beyond the full length of the "
                "strip; reduce its travel"
            ]
    return []


def unstable_end(solution: Solution) -> bool:
    """Whether the last state is unstable and near an equilibrium."""
    return bool(solution.negative_pivots[-1] > 0 and not in_motion(solution.energy)[-1])


def _unstable_at_end(solution: Solution) -> list[str]:
    """Warning if the last state is unstable, with the travel at which this begins."""
    if not solution.travel.shape[1] or not unstable_end(solution):
        return []
    stable = np.flatnonzero(solution.negative_pivots == 0)
    since = solution.layout.travel_text(float(solution.travel[stable[-1] if len(stable) else 0, 0]))
    return [
        f"the last state is unstable: only friction and dampers prevent a snap from {since} on, "
        "and final_force depends on the speed and on the segments; pull slower, or hold the drive at its end"
    ]


def _crossed(crossings: list[tuple[int, int, float]], solution: Solution) -> list[str]:
    """Warning on panels that pass through each other, with the travel or time of the first ones."""
    if not crossings:
        return []
    first = sorted(crossings, key=lambda crossing: crossing[2])
    driven, layout = solution.travel.shape[1] > 0, solution.layout
    named = ", ".join(
        f"{a} and {b} (from {layout.travel_text(at) if driven else f'{at:.4g} s'} on)" for a, b, at in first[:_NAMED]
    )
    more = f", and {count(len(first) - _NAMED, 'more pair')} later" if len(first) > _NAMED else ""
    return [f"panels pass through each other: {named}{more}; no contact pair includes them; later results are not physical"]
