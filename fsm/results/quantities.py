"""Numbers drawn from curves: the peak, the three stages of a pulled strip, the summary of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fsm.results.solution import Floats, Solution

__all__ = [
    "CONTACT_THRESHOLD",
    "STAGES",
    "Curve",
    "Stage",
    "find_stages",
    "first_touch",
    "peak",
    "sliding_distance",
    "summarise",
    "summarise_contacts",
    "touching_pairs",
]

STAGES = ("initial deformation", "contact", "bending")
CONTACT_THRESHOLD = 1e-4
"""Share of the largest pair force of the run from which on a pair counts as touching."""
KNEE = 0.5
"""Fraction of the steepest slope since contact below which the rise of the force is over."""
RESAMPLED = 200
"""Even intervals of travel that slopes are taken over."""


class Stage(NamedTuple):
    """A stage of the motion and where it begins: name, travel (m), force of the drive there (N)."""

    name: str
    travel: float
    force: float


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
    # neighbours so close that the noise of the force would bend the parabola are passed over
    apart = 1e-4 * (s.max() - s.min())
    before = np.flatnonzero(s[:top] < s[top] - apart)
    after = np.flatnonzero(s[top:] > s[top] + apart)
    if len(before) == 0 or len(after) == 0:
        return float(f[top]), float(s[top])
    i, j = int(before[-1]), top + int(after[0])
    left, right = s[i] - s[top], s[j] - s[top]  # f = f_top + b x + c x^2 through both neighbours
    slope_left, slope_right = (f[i] - f[top]) / left, (f[j] - f[top]) / right
    c = (slope_right - slope_left) / (right - left)
    b = slope_left - c * left
    if not c < 0:
        return float(f[top]), float(s[top])
    x = float(np.clip(-b / (2 * c), left, right))
    return float(f[top] + b * x + c * x * x), float(s[top] + x)


@dataclass(frozen=True)
class Curve:
    """Pull force and contact forces against travel, as finely as they are known.

    Attributes
    ----------
    travel, force : (n,) arrays, m, N        of the first drive
    pair_force : (n, n_pairs) array, N       normal force of every contact pair
    """

    travel: Floats
    force: Floats
    pair_force: Floats

    @classmethod
    def of(cls, solution: Solution) -> Curve:
        """The curve through the records of a solution, which must have a drive."""
        return cls(solution.travel[:, 0], solution.force[:, 0], solution.pair_force)

    def merged(self, other: Curve) -> Curve:
        """Both curves' points in the order of travel."""
        travel = np.concatenate([self.travel, other.travel])
        order = np.argsort(travel, kind="stable")
        return Curve(
            travel[order],
            np.concatenate([self.force, other.force])[order],
            np.concatenate([self.pair_force, other.pair_force])[order],
        )


def find_stages(curve: Curve) -> list[Stage]:
    """Where the stages of a pulled strip begin (seed 003, figure 20): initial deformation, contact, bending.

    * "initial deformation" begins with the first record: the creases turn and the panels bend little.
    * "contact" begins at the travel at which the first of the pairs is touched (`first_touch`): the creases have
      swung inwards, the force rises steeply, since the panels that led them in are now pressed along their length.
    * "bending" begins where that rise is over: the slope dF/ds has fallen below `KNEE` times its largest value
      since contact, because the pressed panels have buckled. Slopes are differences of the curve resampled at
      `RESAMPLED` even travels from contact to the end, and must stay low over two of them.

    A stage that is not reached is absent. Points at which the drive stands still or goes back are left out.

    Returns
    -------
    list of Stage, in the order in which they are reached
    """
    if len(curve.travel) == 0:
        return []
    keep = _advancing(curve.travel)
    s, f = curve.travel[keep], curve.force[keep]
    begins = [float(s[0])]
    touches = [x for x in first_touch(s, curve.pair_force[keep]) if x is not None]
    if touches:
        begins.append(min(touches))
        bending = _end_of_rise(s, f, begins[1])
        if bending is not None:
            begins.append(bending)
    return [Stage(name, x, float(np.interp(x, s, f))) for name, x in zip(STAGES, begins, strict=False)]


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


def _end_of_rise(s: Floats, f: Floats, contact: float) -> float | None:
    """Travel after contact at which the slope of the force has fallen below `KNEE` of its largest; None if never."""
    if s[-1] <= contact:
        return None
    grid = np.linspace(contact, s[-1], RESAMPLED + 1)
    slope = np.diff(np.interp(grid, s, f)) / np.diff(grid)
    largest = np.maximum.accumulate(slope)
    low = (slope < KNEE * largest) & (largest > 0.0)
    sustained = np.flatnonzero(low[:-1] & low[1:])
    return float(grid[sustained[0]]) if len(sustained) else None


def _advancing(s: Floats) -> np.ndarray:
    """Numbers of the records at which the travel is greater than ever before."""
    before = np.concatenate([[-np.inf], np.maximum.accumulate(s)[:-1]])
    return np.flatnonzero(s > before)


def summarise(curve: Curve, pair_names: Sequence[str]) -> dict[str, Any]:
    """Named results of a pull, SI, ready to be stored and compared with an expectation.

    * `peak_force`, `peak_travel`: see `peak`; `final_travel`, `final_force`: of the last point
    * `stages`: list of {name, travel, force}, see `find_stages`
    * `contact_travel`, `contact_force`, `bending_travel`, `bending_force`: the same as numbers, if reached
    * `touches`: list of {pair, travel, force}: first touch of every pair that touches, in the order of travel
    """
    peak_force, peak_travel = peak(curve.travel, curve.force)
    stages = find_stages(curve)
    summary: dict[str, Any] = {
        "peak_force": peak_force,
        "peak_travel": peak_travel,
        "final_travel": float(curve.travel[-1]),
        "final_force": float(curve.force[-1]),
        "stages": [stage._asdict() for stage in stages],
        "touches": _touches(curve, pair_names),
    }
    for stage in stages[1:]:
        summary |= {f"{stage.name}_travel": stage.travel, f"{stage.name}_force": stage.force}
    return summary


def _touches(curve: Curve, pair_names: Sequence[str]) -> list[dict[str, Any]]:
    keep = _advancing(curve.travel)
    travel, force = curve.travel[keep], curve.force[keep]
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
