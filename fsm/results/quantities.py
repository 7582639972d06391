"""Numbers drawn from force curves: peaks, stages of a pulled strip, the summary of a run; the one home of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fsm.results.curve import Curve
from fsm.results.solution import Floats, Solution

__all__ = [
    "CONTACT_THRESHOLD",
    "STAGES",
    "Peak",
    "Peaks",
    "Stage",
    "bending_onset",
    "find_stages",
    "first_touch",
    "peak",
    "peaks",
    "sliding_distance",
    "summarise",
    "summarise_contacts",
    "touching_pairs",
]

STAGES = ("initial deformation", "contact", "bending")
CONTACT_THRESHOLD = 1e-4
"""Share of the largest pair force of the run from which on a pair counts as touching."""
BENT = 2.0 / 3.0
"""Share of the panels in the elastic energy of panels and creases from which on panels bend: twice that of the creases."""
_NEGLIGIBLE = 1e-4
"""Elastic energy since the start, over its largest, below which its shares mean nothing."""
START_UP = 0.02
"""Share of the travel within which a dynamic force is the jerk of the start, and no peak."""


class Stage(NamedTuple):
    """A stage of the motion and where it begins: name, travel (m), force of the drive there (N)."""

    name: str
    travel: float
    force: float


class Peak(NamedTuple):
    """Force (N) and the travel (m) at which it acts."""

    force: float
    travel: float


class Peaks(NamedTuple):
    """Peaks of the first drive of a run.

    Attributes
    ----------
    largest : the largest quasi-static force; of a run that has none, the largest dynamic force
    dynamic : the largest force in motions after the start-up; None without any
    magnitude : the largest magnitude of a quasi-static force, where some of them is negative; else None
    """

    largest: Peak
    dynamic: Peak | None
    magnitude: Peak | None


def peaks(curve: Curve) -> Peaks:
    """Peaks of a force curve, quasi-static and dynamic ones apart.

    A force is quasi-static on an equilibrium path, and in a motion whose inertial forces are small against it
    (`fsm.solve.handed_over.inertia_counts`). A dynamic force within `START_UP` of the travel is the jerk of the start.
    """
    travel, force = curve.travel[:, 0], curve.force[:, 0]
    still, moving = ~curve.dynamic, curve.dynamic & (travel >= START_UP * travel[-1])
    dynamic = _highest(travel, force, curve.path, moving) if moving.any() else None
    if not curve.has_quasi_static:
        every = np.ones(len(curve), dtype=bool)
        return Peaks(dynamic or _highest(travel, force, curve.path, every), dynamic, None)
    magnitude = None
    if (force[still] < -1e-9 * np.abs(force[still]).max()).any():
        magnitude = _highest(travel, np.abs(force), curve.path, still)
    return Peaks(_highest(travel, force, curve.path, still), dynamic, magnitude)


def _highest(travel: Floats, force: Floats, path: np.ndarray, chosen: np.ndarray) -> Peak:
    """`peak` of the points that are chosen, with neighbours on the same path only."""
    numbers = np.flatnonzero(chosen & np.isfinite(force))
    if len(numbers) == 0:
        raise ValueError("no record with a finite force")
    top = int(numbers[np.argmax(force[numbers])])
    alike = numbers[path[numbers] == path[top]]
    return Peak(*peak(travel[alike], force[alike]))


def peak(travel: ArrayLike, force: ArrayLike) -> tuple[float, float]:
    """Largest force, and the travel at which it acts.

    Between the records the curve near its largest value is the parabola through that record and its two
    neighbours (any spacing). Where the largest record is the first or the last, it is itself the result.

    Parameters
    ----------
    travel : (n,) array, m           not falling; records at which the drive stands still are allowed
    force : (n,) array, N

    Returns
    -------
    (peak_force, peak_travel) : N, m

    Raises
    ------
    ValueError
        There is no record with a finite force.
    """
    s, f = np.asarray(travel, dtype=float), np.asarray(force, dtype=float)
    finite = np.isfinite(s) & np.isfinite(f)
    s, f = s[finite], f[finite]
    if len(f) == 0:
        raise ValueError("no record with a finite force")
    top = int(np.argmax(f))
    before, after = np.flatnonzero(s[:top] < s[top]), top + np.flatnonzero(s[top:] > s[top])
    if len(before) == 0 or len(after) == 0:
        return float(f[top]), float(s[top])
    i, j = int(before[-1]), int(after[0])
    # points so close need no parabola, which the noise of the force would bend
    if min(s[top] - s[i], s[j] - s[top]) <= 1e-4 * (s.max() - s.min()):
        return float(f[top]), float(s[top])
    left, right = s[i] - s[top], s[j] - s[top]  # f = f_top + b x + c x^2 through both neighbours
    slope_left, slope_right = (f[i] - f[top]) / left, (f[j] - f[top]) / right
    c = (slope_right - slope_left) / (right - left)
    b = slope_left - c * left
    if not c < 0:
        return float(f[top]), float(s[top])
    x = float(np.clip(-b / (2 * c), left, right))
    return float(f[top] + b * x + c * x * x), float(s[top] + x)


def find_stages(curve: Curve) -> list[Stage]:
    """Where the stages of a pulled strip begin, in the order in which they are reached.

    * "initial deformation" begins with the first point, where neither of the others does.
    * "contact" begins at the first touch of any pair (`first_touch`).
    * "bending" begins where the panels bend more than the creases turn, by energy (`bending_onset`). With creases
      stiffer than the panels that is from the start.

    A stage that is not reached is absent. Points at which the drive stands still or goes back are left out.
    """
    if len(curve) == 0:
        return []
    keep = _advancing(curve.travel[:, 0])
    s, f = curve.travel[keep, 0], curve.force[keep, 0]
    touches = [x for x in first_touch(s, curve.pair_force[keep]) if x is not None]
    begins = {STAGES[0]: float(s[0]), STAGES[1]: min(touches, default=None), STAGES[2]: bending_onset(curve)}
    reached = sorted((x, name) for name, x in begins.items() if x is not None)
    if len(reached) > 1 and reached[1][0] <= s[0]:
        reached = [(x, name) for x, name in reached if name != STAGES[0]]
    return [Stage(name, x, float(np.interp(x, s, f))) for x, name in reached]


def bending_onset(curve: Curve) -> float | None:
    """Travel from which on the panels bend: they have taken up `BENT` of the elastic energy of panels and creases.

    Both energies are changes since the start, by magnitude. A folded strip with soft creases and no contact moves by
    its creases alone, and its panels store almost no energy; panels that are pressed along their length buckle and
    store most. Found on quasi-static paths, between the last point below the bound and the first of two above it.

    Returns
    -------
    float or None, m
        None where the panels never do.
    """
    still = ~curve.dynamic if curve.has_quasi_static else np.ones(len(curve), dtype=bool)
    keep = np.flatnonzero(still)[_advancing(curve.travel[still, 0])]
    s = curve.travel[keep, 0]
    panels, creases = (np.abs(energy[keep] - energy[0]) for energy in (curve.panels, curve.creases))
    total = panels + creases
    known = total > _NEGLIGIBLE * total.max(initial=0.0)
    share = np.where(known, panels / np.where(known, total, 1.0), 0.0)
    bent = share >= BENT
    sustained = np.flatnonzero(bent & np.append(bent[1:], True))
    if len(sustained) == 0:
        return None
    first = int(sustained[0])
    if not known[:first].any():
        return float(s[0])
    return float(np.interp(BENT, share[first - 1 : first + 1], s[first - 1 : first + 1]))


def first_touch(travel: ArrayLike, pair_force: ArrayLike) -> list[float | None]:
    """Travel at which each pair first carries a normal force; None for a pair that never does.

    A pair counts as touching when its force is above `CONTACT_THRESHOLD` times the largest force of any pair
    in the run. The onset is where the line through the first two touching records comes down to zero force,
    and is looked for between the last free record and the first touching one.

    Parameters
    ----------
    travel : (n,) array, m            increasing
    pair_force : (n, n_pairs) array, N
    """
    s, f = np.asarray(travel, dtype=float), np.asarray(pair_force, dtype=float)
    largest = float(np.nanmax(f, initial=0.0))
    if largest <= 0.0:
        return [None] * f.shape[1]
    touching = f > CONTACT_THRESHOLD * largest
    columns = zip(f.T, touching.T, strict=True)
    return [_onset(s, column, mask) if mask.any() else None for column, mask in columns]


def _onset(s: Floats, f: Floats, touching: np.ndarray) -> float:
    k = int(np.argmax(touching))
    if k == 0:
        return float(s[0])
    rise = f[k + 1] - f[k] if k + 1 < len(f) else 0.0
    if not rise > 0.0:  # no slope to extend: from the last free record up to the first touching one
        return float(s[k - 1])
    return float(np.clip(s[k] - f[k] * (s[k + 1] - s[k]) / rise, s[k - 1], s[k]))


def _advancing(s: Floats) -> np.ndarray:
    """Numbers of the records at which the travel is greater than ever before."""
    before = np.concatenate([[-np.inf], np.maximum.accumulate(s)[:-1]])
    return np.flatnonzero(s > before)


def summarise(curve: Curve, pair_names: Sequence[str]) -> dict[str, Any]:
    """Named results of a pull, SI, ready to be stored and compared with an expectation.

    * `peak_force`, `peak_travel`: largest quasi-static force, see `peaks`; `peak_kind`: "quasi-static", or "dynamic" of a
      run that is dynamic throughout
    * `dynamic_peak_force`, `dynamic_peak_travel`: largest force in motions after the start-up, None without any
    * `largest_magnitude`, `largest_magnitude_travel`: of the quasi-static force, None if none of it is negative
    * `final_travel`, `final_force`: of the last point
    * `stages`: list of {name, travel, force}, see `find_stages`
    * `contact_travel`, `contact_force`, `bending_travel`, `bending_force`: the same as numbers, if reached
    * `touches`: list of {pair, travel, force}: first touch of every pair that touches, in the order of travel
    """
    found = peaks(curve)
    stages = find_stages(curve)
    summary: dict[str, Any] = {
        "peak_force": found.largest.force,
        "peak_travel": found.largest.travel,
        "peak_kind": "quasi-static" if curve.has_quasi_static else "dynamic",
        "final_travel": float(curve.travel[-1, 0]),
        "final_force": float(curve.force[-1, 0]),
        "stages": [stage._asdict() for stage in stages],
        "touches": _touches(curve, pair_names),
    }
    for name, one in (("dynamic_peak", found.dynamic), ("largest_magnitude", found.magnitude)):
        key = f"{name}_force" if name == "dynamic_peak" else name
        summary |= {key: one.force if one else None, f"{name}_travel": one.travel if one else None}
    for stage in stages:
        if stage.name != STAGES[0]:
            summary |= {f"{stage.name}_travel": stage.travel, f"{stage.name}_force": stage.force}
    return summary


def _touches(curve: Curve, pair_names: Sequence[str]) -> list[dict[str, Any]]:
    keep = _advancing(curve.travel[:, 0])
    travel, force = curve.travel[keep, 0], curve.force[keep, 0]
    found = [
        {"pair": name, "travel": x, "force": float(np.interp(x, travel, force))}
        for name, x in zip(pair_names, first_touch(travel, curve.pair_force[keep]), strict=True)
        if x is not None
    ]
    return sorted(found, key=lambda touch: touch["travel"])


def touching_pairs(pair_force: ArrayLike) -> list[int]:
    """Numbers of the pairs that touch at some time, as `first_touch` has it; (n, n_pairs) array, N."""
    f = np.asarray(pair_force, dtype=float)
    largest = f.max(axis=0, initial=0.0)
    return [int(k) for k in np.flatnonzero(largest > CONTACT_THRESHOLD * largest.max(initial=0.0))]


def sliding_distance(time: ArrayLike, slip: ArrayLike) -> Floats:
    """How far the faces of every pair have slid along each other up to each record, m, (n, n_pairs).

    Slip speeds integrated over time by the trapezoidal rule, so only as good as records are dense.

    Parameters
    ----------
    time : (n,) array, s
    slip : (n, n_pairs) array, m/s
    """
    t, v = np.asarray(time, dtype=float), np.asarray(slip, dtype=float)
    steps = 0.5 * (v[1:] + v[:-1]) * np.diff(t)[:, None]
    return np.concatenate([np.zeros((1, v.shape[1])), np.cumsum(steps, axis=0)])


def summarise_contacts(
    solution: Solution, pair_force: ArrayLike, touches: Sequence[dict[str, Any]] = ()
) -> list[dict[str, Any]]:
    """What became of every pair that touched, SI, in the order of the scene.

    * `pair`; `travel` at the first touch, or its `time` without a drive
    * `largest_force`; `largest_penetration`, `largest_area` of all records, 0 if the faces are apart in all of them
    * `sliding_distance`: see there; `friction_energy`, `damping_energy`: dissipated in all

    Parameters
    ----------
    solution : Solution
    pair_force : (m, n_pairs) array, N       at all points looked at, more than the records
    touches : as in `summarise`
    """
    looked_at = np.asarray(pair_force, dtype=float)
    forces = np.concatenate([looked_at.reshape(len(looked_at), solution.pair_force.shape[1]), solution.pair_force])
    slid = sliding_distance(solution.time, solution.pair_slip)
    known = {touch["pair"]: touch["travel"] for touch in touches}
    found = []
    for k in touching_pairs(forces):
        name = solution.layout.pair_names[k]
        entry: dict[str, Any] = {"pair": name}
        record = int(np.argmax(solution.pair_force[:, k] > 0.0))
        if solution.travel.shape[1]:
            entry["travel"] = known.get(name, float(solution.travel[record, 0]))
        else:
            entry["time"] = float(solution.time[record])
        found.append(
            entry
            | {
                "largest_force": float(forces[:, k].max()),
                "largest_penetration": max(0.0, -float(solution.pair_gap[:, k].min())),
                "largest_area": float(solution.pair_area[:, k].max()),
                "sliding_distance": float(slid[-1, k]),
                "friction_energy": float(solution.pair_friction_energy[-1, k]),
                "damping_energy": float(solution.pair_damping_energy[-1, k]),
            }
        )
    return found
