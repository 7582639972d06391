"""Quantities computed from force curves: peaks, stages of a pulled strip, contacts, the summary of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fsm.results.curve import START_UP, ForceCurve
from fsm.results.film import Floats
from fsm.results.solution import Solution

STAGES = ("initial deformation", "contact", "bending")
CONTACT_THRESHOLD = 1e-4
"""Smallest force of a touching pair, as a fraction of the largest pair force of the run."""
FACET_FORCES = "contact.facets.force"
"""Channel of the normal forces on the facets of a sheet that touches itself."""
BEND = 0.5
"""Angle of one panel bent to an arc, rad. Bending begins at the energy of such a panel; its sag is 6 % of its
length."""


class Stage(NamedTuple):
    """Stage of the motion: its name, and travel (m) and drive force (N) at its beginning."""

    name: str
    travel: float
    force: float


_ELASTIC = ("panels", "creases", "bars", "hinges", "film", "patch", "cable", "beam")
"""Elastic energies of the structure."""
_IN_MOTION = 0.01
"""Ratio of the kinetic energy to the largest elastic energy so far, above which a state is not near an equilibrium."""


class Peak(NamedTuple):
    """Peak force (N) and the travel (m) at which it acts."""

    force: float
    travel: float


class Peaks(NamedTuple):
    """Peaks of the first drive of a run.

    Attributes
    ----------
    largest : Peak
        Largest quasi-static force; the largest dynamic force if the run has no quasi-static part.
    dynamic : Peak or None
        Largest force in dynamic motion after the start-up, if any.
    magnitude : Peak or None
        Largest magnitude of the quasi-static force, if that force is negative anywhere.
    """

    largest: Peak
    dynamic: Peak | None
    magnitude: Peak | None


def peaks(curve: ForceCurve) -> Peaks:
    """Quasi-static and dynamic peaks of a force curve.

    A force is quasi-static on an equilibrium path, and in a motion whose inertial forces are small compared with it
    (`fsm.solve.outcome.run_io.inertia_counts`). After a snap it is quasi-static once the motion is near a stable
    equilibrium. Dynamic forces within the start-up phase (`START_UP`) are ignored.

    Raises
    ------
    ValueError
        No force is finite.
    """
    travel, force = curve.travel[:, 0], curve.force[:, 0]
    quasi_static, moving = ~curve.dynamic, curve.dynamic & (travel >= START_UP * travel[-1])
    dynamic = _peak_of_selected(travel, force, curve.path, moving) if moving.any() else None
    if not curve.has_quasi_static:
        every = np.ones(len(curve), dtype=bool)
        return Peaks(dynamic or _peak_of_selected(travel, force, curve.path, every), dynamic, None)
    magnitude = None
    if (force[quasi_static] < -1e-9 * np.abs(force[quasi_static]).max()).any():
        magnitude = _peak_of_selected(travel, np.abs(force), curve.path, quasi_static)
    return Peaks(_peak_of_selected(travel, force, curve.path, quasi_static), dynamic, magnitude)


def _start_up(curve: ForceCurve, largest: float) -> dict[str, float]:
    """Largest force in the start-up phase and its travel, if it is larger than the peak after this phase."""
    travel, force = curve.travel[:, 0], curve.force[:, 0]
    force = np.where(np.isfinite(force) & (travel < START_UP * travel[-1]), force, -np.inf)
    top = int(np.argmax(force))
    return {"start_up_force": float(force[top]), "start_up_travel": float(travel[top])} if force[top] > largest else {}


def _peak_of_selected(travel: Floats, force: Floats, path: np.ndarray, selected: np.ndarray) -> Peak:
    """Peak of the selected points; only neighbours on the same path enter the interpolation."""
    numbers = np.flatnonzero(selected & np.isfinite(force))
    if len(numbers) == 0:
        raise ValueError("no record with a finite force")
    top = int(numbers[np.argmax(force[numbers])])
    same_path = numbers[path[numbers] == path[top]]
    return Peak(*peak(travel[same_path], force[same_path]))


def peak(travel: ArrayLike, force: ArrayLike) -> tuple[float, float]:
    """Largest force and the travel at which it acts.

    The curve near its largest value is the parabola through that record and its two neighbours, at any spacing.
    If the largest record is the first or the last record, the result is this record.

    Parameters
    ----------
    travel : (n,) array, m
        Non-decreasing; the drive may stand still.
    force : (n,) array, N

    Returns
    -------
    (peak_force, peak_travel) : N, m

    Raises
    ------
    ValueError
        No force is finite.
    """
    s, f = np.asarray(travel, dtype=float), np.asarray(force, dtype=float)
    finite = np.isfinite(s) & np.isfinite(f)
    s, f = s[finite], f[finite]
    if len(f) == 0:
        raise ValueError("no record with a finite force")
    i, top, j = peak_rows(s, f)
    if i == j:
        return float(f[top]), float(s[top])
    left, right = s[i] - s[top], s[j] - s[top]  # the parabola f = f_top + b x + c x^2 passes through both neighbours
    slope_left, slope_right = (f[i] - f[top]) / left, (f[j] - f[top]) / right
    c = (slope_right - slope_left) / (right - left)
    b = slope_left - c * left
    if not c < 0:
        return float(f[top]), float(s[top])
    x = float(np.clip(-b / (2 * c), left, right))
    return float(f[top] + b * x + c * x * x), float(s[top] + x)


def peak_rows(s: Floats, f: Floats) -> tuple[int, int, int]:
    """Largest of finite records, between those whose parabola gives the peak; without a parabola it is all three."""
    top = int(np.argmax(f))
    before, after = np.flatnonzero(s[:top] < s[top]), top + np.flatnonzero(s[top:] > s[top])
    if len(before) == 0 or len(after) == 0:
        return top, top, top
    i, j = int(before[-1]), int(after[0])
    # a parabola through points this close would amplify noise of the force
    if min(s[top] - s[i], s[j] - s[top]) <= 1e-4 * (s.max() - s.min()):
        return top, top, top
    return i, top, j


def in_motion(energy: Mapping[str, Floats]) -> np.ndarray:
    """Records (n,) whose kinetic energy is above 1 % of the largest elastic energy so far.

    These states are not near an equilibrium: accelerations change the balance of forces, and the sign of the stiffness says
    nothing about stability.
    """
    parts = [energy[name] for name in _ELASTIC if name in energy]
    elastic = np.maximum.accumulate(np.sum(parts, axis=0))
    return np.asarray(energy["kinetic"] > _IN_MOTION * elastic)


def find_stages(curve: ForceCurve, bent: float | None = None) -> list[Stage]:
    """Stages of a pulled strip in the order in which they begin.

    * "initial deformation" begins at the first point, unless another stage begins at this point.
    * "contact" begins at the first touch of any pair (`first_touch`).
    * "bending" begins at the onset of bending (`bending_onset`) with the energy `bent` (J); absent for None.

    Stages that are not reached are absent. Points without forward motion of the drive are ignored.
    """
    if len(curve) == 0:
        return []
    keep = _advancing(curve.travel[:, 0])
    s, f = curve.travel[keep, 0], curve.force[keep, 0]
    touches = [x for x in first_touch(s, curve.pair_force[keep]) if x is not None]
    begins = {STAGES[0]: float(s[0]), STAGES[1]: min(touches, default=None), STAGES[2]: bending_onset(curve, bent)}
    reached = sorted((x, name) for name, x in begins.items() if x is not None)
    if len(reached) > 1 and reached[1][0] <= s[0]:
        reached = [(x, name) for x, name in reached if name != STAGES[0]]
    return [Stage(name, x, float(np.interp(x, s, f))) for x, name in reached]


def bent_energy(case: Mapping[str, Any]) -> float | None:
    """Energy (J) of one panel of a strip that is bent to an arc of `BEND`, E I BEND^2/(2 a).

    None without a strip, and for the case of a damaged result that lacks a number of the strip.

    Parameters
    ----------
    case : keys of the case, SI
    """
    strip = case.get("strip")
    if strip is None:
        return None
    try:
        stiffness = case["material"]["young"] * strip["width"] * strip["thickness"] ** 3 / 12.0
        return float(0.5 * stiffness * BEND**2 * strip["panels"] / strip["length"])
    except (LookupError, TypeError):
        return None


def bending_onset(curve: ForceCurve, bent: float | None) -> float | None:
    """Travel at which the panels begin to bend: the panels' energy has changed by `bent` (J) since the start.

    The square root of this energy is proportional to the angle of bending. The onset is interpolated linearly in this
    root between the last point below `bent` and the first point above. The energy must remain above `bent` at two
    quasi-static points, so that vibrations do not count; the onset may lie in the motion before them.

    Returns
    -------
    float or None, m
        None if this energy is never reached, or not known.
    """
    if bent is None:
        return None
    keep = _advancing(curve.travel[:, 0])
    s, angle = curve.travel[keep, 0], np.sqrt(np.abs(curve.panels[keep] - curve.panels[0]) / bent)
    above = angle >= 1.0
    at_rest = np.flatnonzero(~curve.dynamic[keep]) if curve.has_quasi_static else np.arange(len(keep))
    remains = np.append(above[at_rest][1:], True)
    sustained = at_rest[above[at_rest] & remains]
    if len(sustained) == 0:
        return None
    since = at_rest[at_rest < sustained[0]].max(initial=-1) + 1
    first = int(since + np.argmax(above[since:]))
    if first == 0:
        return float(s[0])
    return float(np.interp(1.0, angle[first - 1 : first + 1], s[first - 1 : first + 1]))


def first_touch(travel: ArrayLike, pair_force: ArrayLike) -> list[float | None]:
    """Travel at which each pair first carries a normal force; None for a pair that never touches.

    A pair touches when its force exceeds `CONTACT_THRESHOLD` times the largest force of any pair in the run.
    The onset is the zero of the line through the first two touching records.
    The onset is limited to the interval between the last free record and the first touching one.

    Parameters
    ----------
    travel : (n,) array, m
        Increasing.
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
    if not rise > 0.0:  # there is no rising line to extrapolate, so the last free record is used
        return float(s[k - 1])
    return float(np.clip(s[k] - f[k] * (s[k + 1] - s[k]) / rise, s[k - 1], s[k]))


def _advancing(s: Floats) -> np.ndarray:
    """Indices of the records at which the travel exceeds all earlier ones."""
    before = np.concatenate([[-np.inf], np.maximum.accumulate(s)[:-1]])
    return np.flatnonzero(s > before)


def summarise(curve: ForceCurve, pair_names: Sequence[str], bent: float | None = None) -> dict[str, Any]:
    """Named results of a pull, SI, for `summary.json` and for comparison with expected values.

    * `peak_force`, `peak_travel`: largest quasi-static force, see `peaks`
    * `peak_kind`: "quasi-static", or "dynamic" if the whole run is dynamic
    * `dynamic_peak_force`, `dynamic_peak_travel`: largest force in motions after the start-up; None without motion
    * `start_up_force`, `start_up_travel`: larger force in the first 2 % of a travel that begins as a motion, if any
    * `largest_magnitude`, `largest_magnitude_travel`: of the quasi-static force; None unless it is negative somewhere
    * `final_travel`, `final_force`: at the last point
    * `stages`: list of {name, travel, force}, see `find_stages`, with the energy `bent` (J) of bent panels
    * `contact_travel`, `contact_force`, `bending_travel`, `bending_force`: beginning of these stages, if reached
    * `touches`: list of {pair, travel, force}: first touch of every pair that touches, in the order of travel
    """
    found = peaks(curve)
    stages = find_stages(curve, bent)
    summary: dict[str, Any] = {
        "peak_force": found.largest.force,
        "peak_travel": found.largest.travel,
        "peak_kind": "quasi-static" if curve.has_quasi_static else "dynamic",
        "final_travel": float(curve.travel[-1, 0]),
        "final_force": float(curve.force[-1, 0]),
        "stages": [stage._asdict() for stage in stages],
        "touches": _touches(curve, pair_names),
    }
    if curve.dynamic[0]:
        summary |= _start_up(curve, found.largest.force)
    for name, one in (("dynamic_peak", found.dynamic), ("largest_magnitude", found.magnitude)):
        key = f"{name}_force" if name == "dynamic_peak" else name
        summary |= {key: one.force if one else None, f"{name}_travel": one.travel if one else None}
    for stage in stages:
        if stage.name != STAGES[0]:
            summary |= {f"{stage.name}_travel": stage.travel, f"{stage.name}_force": stage.force}
    return summary


def summarise_drives(curve: ForceCurve, names: Sequence[str]) -> list[dict[str, Any]]:
    """Largest force, its travel, and force and travel at the end of every drive; see `peaks`.

    * `name`, `peak_force`, `peak_travel`, `peak_kind`, `final_force`, `final_travel`: as in `summarise`
    """
    return [{"name": name} | summarise_drive(curve, k) for k, name in enumerate(names)]


def summarise_drive(curve: ForceCurve, k: int) -> dict[str, Any]:
    """Numbers of drive k in `summarise_drives`."""
    own = replace(curve, travel=curve.travel[:, [k]], force=curve.force[:, [k]])
    largest = peaks(own).largest
    return {
        "peak_force": largest.force, "peak_travel": largest.travel,
        "peak_kind": "quasi-static" if own.has_quasi_static else "dynamic",
        "final_force": float(own.force[-1, 0]), "final_travel": float(own.travel[-1, 0]),
    }  # fmt: skip


def _touches(curve: ForceCurve, pair_names: Sequence[str]) -> list[dict[str, Any]]:
    keep = _advancing(curve.travel[:, 0])
    travel, force = curve.travel[keep, 0], curve.force[keep, 0]
    found = [
        {"pair": name, "travel": x, "force": float(np.interp(x, travel, force))}
        for name, x in zip(pair_names, first_touch(travel, curve.pair_force[keep]), strict=True)
        if x is not None
    ]
    return sorted(found, key=lambda touch: touch["travel"])


def contact_rows(solution: Solution) -> tuple[list[str], Floats, Floats]:
    """Rows of a contact map: names (m), normal forces (n, m) in N, and areas (n, m) in m^2, or NaN where they are not known.

    Rows are the pairs that ever touch. If a sheet touches itself and the channel of its facets is recorded, they are the
    facets that ever touch, in place of the pairs.
    """
    facets = solution.channels.get(FACET_FORCES)
    if facets is not None:
        force = np.nan_to_num(facets.values)
        rows = touching_pairs(force)
        return [str(facets.info.dims[0].labels[k]) for k in rows], force[:, rows], np.full((len(force), len(rows)), np.nan)
    rows = touching_pairs(solution.pair_force)
    return [solution.layout.pair_names[k] for k in rows], solution.pair_force[:, rows], solution.pair_area[:, rows]


def touching_pairs(pair_force: ArrayLike) -> list[int]:
    """Indices of the pairs that touch at any time, by the criterion of `first_touch`; `pair_force` is (n, n_pairs), N."""
    f = np.asarray(pair_force, dtype=float)
    largest = f.max(axis=0, initial=0.0)
    return [int(k) for k in np.flatnonzero(largest > CONTACT_THRESHOLD * largest.max(initial=0.0))]


def sliding_distance(time: ArrayLike, slip: ArrayLike) -> Floats:
    """Sliding distance of the faces of every pair up to each record, (n, n_pairs), m.

    The distance is the trapezoidal integral of the slip speed, so its accuracy depends on the interval of the records.

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
    """Results of every pair that touches, SI, in the order of the scene.

    * `pair`: name of the pair
    * `travel`: travel of the first drive at first contact; without a drive, `time` at first contact
    * `largest_force`: largest contact force over all solver steps
    * `largest_penetration`, `largest_area`: maxima over the records, 0 if the pair touches in no record
    * `sliding_distance`: as defined by the function `sliding_distance`
    * `friction_energy`, `damping_energy`: energies dissipated in the whole run

    Parameters
    ----------
    solution : Solution
    pair_force : (m, n_pairs) array, N
        Forces at all steps of the solver, which are more than the records.
    touches : as in `summarise`
    """
    at_steps = np.asarray(pair_force, dtype=float)
    forces = np.concatenate([at_steps.reshape(len(at_steps), solution.pair_force.shape[1]), solution.pair_force])
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
