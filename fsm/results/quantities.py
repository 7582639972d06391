"""Numbers drawn from curves: the peak, the three stages of a pulled strip, the summary of a run."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fsm.results.solution import Floats, Solution

__all__ = ["CONTACT_THRESHOLD", "STAGES", "Stage", "find_stages", "first_touch", "peak", "summarise"]

STAGES = ("initial deformation", "contact", "bending")
CONTACT_THRESHOLD = 1e-4
"""Share of the largest pair force of the run from which on a pair counts as touching."""


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
    before = np.flatnonzero(s[:top] < s[top])
    after = np.flatnonzero(s[top:] > s[top])
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


def find_stages(
    travel: ArrayLike,
    pair_force: ArrayLike,
    energy_panels: ArrayLike,
    energy_creases: ArrayLike,
    force: ArrayLike,
) -> list[Stage]:
    """Where the stages of a pulled strip begin: initial deformation, contact, bending.

    * "initial deformation" begins with the first record: the panels are all but rigid and the creases turn.
    * "contact" begins at the travel at which the first of the pairs is touched (`first_touch`).
    * "bending" begins, not before contact, where the plain panels start to take more than half of every
      increment of elastic energy, dU_panels/ds > dU_creases/ds with dU_panels/ds > 0, and go on so over at
      least two intervals between records. Rates are differences between records; the beginning is where the
      rates, taken as linear between the middles of the intervals, cross.

    A stage that is not reached is absent. Records at which the drive stands still or goes back are left out.

    Parameters
    ----------
    travel : (n,) array, m
    pair_force : (n, n_pairs) array, N              normal force of every contact pair
    energy_panels, energy_creases : (n,) arrays, J  elastic energies
    force : (n,) array, N                           of the drive, reported with each stage

    Returns
    -------
    list of Stage, in the order in which they are reached
    """
    s = np.asarray(travel, dtype=float)
    if len(s) == 0:
        return []
    keep = _advancing(s)
    s, f = s[keep], np.asarray(force, dtype=float)[keep]
    pairs = np.asarray(pair_force, dtype=float)[keep]
    begins = [float(s[0])]
    touches = [x for x in first_touch(s, pairs) if x is not None]
    if touches:
        begins.append(min(touches))
        panels, creases = (np.asarray(e, dtype=float)[keep] for e in (energy_panels, energy_creases))
        bending = _panels_take_over(s, panels, creases, begins[1])
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


def _panels_take_over(s: Floats, panels: Floats, creases: Floats, contact: float) -> float | None:
    """Travel from which the panels take more than half of the elastic energy; None if they never do."""
    if len(s) < 3:
        return None
    middle, ds = (s[1:] + s[:-1]) / 2, np.diff(s)
    panel_rate, crease_rate = np.diff(panels) / ds, np.diff(creases) / ds
    excess = np.minimum(panel_rate - crease_rate, panel_rate)
    noise = 1e-9 * float(np.max(np.abs(np.concatenate([panel_rate, crease_rate]))))
    first = int(np.searchsorted(s, contact, side="left"))  # intervals after the one of the onset
    more = excess > noise
    sustained = np.flatnonzero(more[first:-1] & more[first + 1 :])
    if len(sustained) == 0:
        return None
    k = first + int(sustained[0])
    if k == 0 or more[k - 1]:  # they did so before contact already
        return contact
    low, high = excess[k - 1], excess[k]
    return max(contact, float(middle[k - 1] - low / (high - low) * (middle[k] - middle[k - 1])))


def _advancing(s: Floats) -> np.ndarray:
    """Numbers of the records at which the travel is greater than ever before."""
    before = np.concatenate([[-np.inf], np.maximum.accumulate(s)[:-1]])
    return np.flatnonzero(s > before)


def summarise(solution: Solution) -> dict[str, Any]:
    """Named results of a run, SI, ready to be stored and compared with an expectation.

    Keys (of the first drive; a scene without a drive has none of them):

    * `peak_force`, `peak_travel`: see `peak`; `final_travel`, `final_force`: of the last record
    * `stages`: list of {name, travel, force}, see `find_stages`
    * `contact_travel`, `contact_force`, `bending_travel`, `bending_force`: the same as numbers, if reached
    * `touches`: list of {pair, travel, force}: first touch of every pair that touches, in the order of travel
    """
    if solution.travel.shape[1] == 0 or len(solution) == 0:
        return {}
    travel, force = solution.travel[:, 0], solution.force[:, 0]
    peak_force, peak_travel = peak(travel, force)
    energy = solution.energy
    stages = find_stages(travel, solution.pair_force, energy["panels"], energy["creases"], force)
    summary: dict[str, Any] = {
        "peak_force": peak_force,
        "peak_travel": peak_travel,
        "final_travel": float(travel[-1]),
        "final_force": float(force[-1]),
        "stages": [stage._asdict() for stage in stages],
        "touches": _touches(solution),
    }
    for stage in stages[1:]:
        summary |= {f"{stage.name}_travel": stage.travel, f"{stage.name}_force": stage.force}
    return summary


def _touches(solution: Solution) -> list[dict[str, Any]]:
    keep = _advancing(solution.travel[:, 0])
    travel, force = solution.travel[keep, 0], solution.force[keep, 0]
    onsets = first_touch(travel, solution.pair_force[keep])
    found = [
        {"pair": name, "travel": x, "force": float(np.interp(x, travel, force))}
        for name, x in zip(solution.layout.pair_names, onsets, strict=True)
        if x is not None
    ]
    return sorted(found, key=lambda touch: touch["travel"])
