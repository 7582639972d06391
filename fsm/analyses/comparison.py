"""Errors of a run from further runs of the same case: on coarser or finer meshes, or with larger steps in time.

The numbers of two runs are compared: the peak and the last force of the first drive, positions at the records, displacements
of probes, natural frequencies, displacements of loads and limit points. A difference of the run with cells of size h and a
run with r h is r - 1 times the error if the error is of first order in h, and more if it is of second order. The ratio r
follows from the numbers of cells, because few cells cannot be halved exactly. The order is not assumed: a third mesh shows
it. With the errors d and D of first order that both differences give, and R = d/D above 1/2 (less than first order), the
error is d R/(1 - R), at most 3 d. A difference that is small by coincidence gives too small an error, so the error is at
least D/8. All differences due to the mesh are multiplied by 1.25 (the grid convergence index of Roache, 1994), those due to
steps by 3 (`validation/errors`). If the positions of two motions with other steps part, no error is stated. The numbers in
the results are not corrected.

After a snap or a bifurcation, runs on different meshes may follow different branches, and finer meshes do not approach a
limit. The error of a force is then at least the largest difference of all runs times a factor.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from fsm.case.models.case import Case
from fsm.case.models.sheet import Sheet
from fsm.case.models.solve import Solve
from fsm.case.plan.method_selection import solve_of
from fsm.results.solution import Solution
from fsm.text.shown_units import shown_range, turns

MOST_WORK = 5e9
"""Work of a run up to which "auto" compares, about five seconds: Newton iterations (or steps) times the square of the
degrees of freedom, for flexible facets 1.2e-9 s each. The number depends on the case alone, so that each run of a case
states the same errors."""
ASK_FOR_ALL = 'set solve.error_estimates = "all"'
"""Remedy where "auto" does not compare."""
_OVERHEAD = 1e5
"""Work of an iteration of a small system."""
_SLOWEST = 3.0
"""Largest ratio of an error to the difference from a mesh with half as many cells."""
_COINCIDENCE = 0.125
"""Smallest ratio of an error to the difference between two coarser meshes."""
_UNEVEN, _HALVED = 1.6, 1.9
"""Further factor of differences if the ratio of the sizes of cells is smaller: few cells do not show the order."""
_PART = 0.2
"""Difference of positions relative to the largest displacement, above which motions with other steps part."""
_SAME = 0.02
"""Distance of the same material point on two meshes at the start, relative to the size of a cell of the coarser mesh."""
_SEEN = 0.7
"""Smallest displacement of common points relative to the largest displacement, along an axis with an error."""
_STILL = 1e-6
"""Largest displacement relative to the largest coordinate, below which nothing moves and no error is stated."""
_MOVES = 1e-4
"""Smallest displacement along an axis relative to the largest displacement, for an error along this axis."""
_LARGE = 0.02
"""Error of positions above which its time is stated."""
_NO_BRANCH = ("vibration", "force limit")
"""Kinds of events after which all meshes follow the same branch."""
_BRANCHES = 3.0
"""Factor of the largest difference of forces on different branches. Of four random forces, the difference of the first from
one is below three times the larger difference from the others in 95 of 100 cases."""
_SAME_TRAVEL = 0.02
"""Largest relative difference of the travels of a snap on two meshes that follow the same branch."""
_LOOSER, _LONGER = 10.0, 2.0
"""Ratios of tolerances, and of fixed steps and largest steps."""

Statement = dict[str, Any]
"""Errors of the numbers of a summary due to one cause, and `by`: how they were found, or why there are none."""


@dataclass(frozen=True)
class Comparison:
    """Further runs that show one kind of error.

    Attributes
    ----------
    by : words about the runs
    cases : cases of further runs, in the order of increasing size of cells or steps
    cells : whether cells differ, so that differences are errors of first order times a ratio of cells
    coarsen : factor of the steps that resolve impacts
    records : the further runs keep one of so many records, because steps end at records
    safety : factor of all differences
    parts : whether motions can part, so that a large difference is no error
    reach : (n,) array, m
        Radii of gyration of the bodies; absent: bodies turn little, or have plates.
    least : errors of forces of a path with snaps, known without further runs; only these forces are compared
    """

    by: str
    cases: tuple[Case, ...]
    cells: bool = False
    coarsen: float = 1.0
    records: int = 1
    safety: float = 1.25
    parts: bool = False
    reach: np.ndarray | None = None
    least: Statement | None = None

    def error(self, differences: Sequence[float]) -> float:
        """Error from the errors of first order that successive runs give, the first from the run itself."""
        first = self.safety * differences[0]
        if len(differences) == 1:
            return first
        second = self.safety * differences[1]
        if first >= second:  # no convergence yet
            return _SLOWEST * first
        ratio = first / second
        slow = min(ratio / (1.0 - ratio), _SLOWEST) if ratio > 0.5 else 1.0
        return max(slow * first, _COINCIDENCE * second)


def not_compared(wanted: str, iterations: int, dof: int) -> str:
    """Words if a run is not compared with further runs; empty if it is.

    Parameters
    ----------
    wanted : `solve.error_estimates`
    iterations : Newton iterations or steps, whichever are more
    dof : degrees of freedom
    """
    work = iterations * (float(dof) ** 2 + _OVERHEAD)
    if wanted == "off":
        return 'not estimated: solve.error_estimates = "off"'
    if wanted == "auto" and work > MOST_WORK:
        return f"not estimated for a long run; {ASK_FOR_ALL}"
    return ""


def larger_steps(case: Case) -> Case:
    """Case with ten times the tolerance, or twice the fixed step, in all steps of the run."""

    def looser(solve: Solve) -> Solve:
        solve = solve_of(solve, case.scene)
        changed: dict[str, Any] = {"rtol": _LOOSER * solve.rtol, "error_estimates": "off"}
        for name in ("step", "max_step", "increment"):
            value = getattr(solve, name)
            if value is not None:
                changed[name] = _LONGER * value
        return solve.model_copy(update=changed)

    steps = tuple(
        step if step.solve is None else step.model_copy(update={"solve": looser(step.solve)}) for step in case.step
    )
    return case.model_copy(update={"solve": looser(case.solve), "step": steps})


def path_events(summary: dict[str, Any], until: float) -> list[dict[str, Any]]:
    """Snaps and bifurcations of a path that begin up to a travel of its first drive."""
    return [one for one in summary["events"] if one["kind"] not in _NO_BRANCH and one["travel"] <= until * (1.0 + _STILL)]


def other_segments(case: Case) -> tuple[Case, ...]:
    """The strip with three quarters and three halves of its segments; half of them are too coarse for contact."""
    strip = case.strip
    assert strip is not None
    count = strip.segments_per_panel
    counts = (3 * count // 4, 3 * count // 2) if count > 3 else (2 * count, 3 * count)
    solve = case.solve.model_copy(update={"error_estimates": "off"})
    return tuple(
        case.model_copy(update={"strip": strip.model_copy(update={"segments_per_panel": n}), "solve": solve}) for n in counts
    )


def other_meshes(case: Case) -> tuple[Case, ...]:
    """The case with cells of twice and of four times the size; empty if no direction has two cells."""
    found = []
    for factor in (2, 4):
        sheet = case.sheet
        assert sheet is not None
        if sheet.mesh_size is not None:
            found.append(_on_mesh(case, {"mesh_size": factor * sheet.mesh_size}))
            continue
        assert sheet.mesh is not None
        least = (1, 4) if sheet.is_annulus else (1, 1)
        mesh = tuple(max(bound, -(-count // factor)) for count, bound in zip(sheet.mesh, least, strict=True))
        before = sheet.mesh if not found else found[-1].sheet.mesh  # type: ignore[union-attr]
        assert before is not None
        if 1.5 * mesh[0] * mesh[1] > before[0] * before[1]:
            break
        found.append(_on_mesh(case, {"mesh": mesh}))
    return tuple(found)


def finer_mesh(case: Case) -> Case:
    """The case with cells of half the size."""
    sheet: Sheet | None = case.sheet
    assert sheet is not None
    if sheet.mesh_size is not None:
        return _on_mesh(case, {"mesh_size": 0.5 * sheet.mesh_size})
    assert sheet.mesh is not None
    return _on_mesh(case, {"mesh": (2 * sheet.mesh[0], 2 * sheet.mesh[1])})


def _on_mesh(case: Case, mesh: dict[str, Any]) -> Case:
    assert case.sheet is not None
    solve = case.solve.model_copy(update={"error_estimates": "off"})
    return case.model_copy(update={"sheet": case.sheet.model_copy(update=mesh), "solve": solve})


def compared(comparison: Comparison, own: tuple[Solution, dict[str, Any]], others: Sequence[Solution]) -> Statement:
    """Errors of the numbers that all runs have.

    Parameters
    ----------
    comparison : Comparison
    own : records and summary of the run
    others : results of its further runs, in the order of `comparison.cases`
    """
    solution, summary = own
    runs = [(other, other.summary) for other in others]
    if comparison.least is not None:
        return _of_snaps(comparison, comparison.least, summary, [there for _, there in runs])
    chain = [solution, *others]
    factors = [_of_first_order(a, b) if comparison.cells else 1.0 for a, b in pairwise(chain)]
    positions = _of_positions(comparison, chain, factors)
    if comparison.parts and positions.get("positions", 0.0) > comparison.safety * _PART:
        apart, since = positions["positions"] / comparison.safety, positions["positions_since"]
        text = f"none stated: motions part, positions differ by {100.0 * apart:.2g} % of the largest displacement"
        return {"by": f"{text} in the {comparison.by}", "positions_since": since}
    found: Statement = {"by": comparison.by}

    def state(values: Callable[[dict[str, Any]], np.ndarray | None], scale: float | np.ndarray) -> list[float] | None:
        numbers = [values(summary), *(values(there) for _, there in runs)]
        first = numbers[0]
        if first is None or not first.size or any(n is None or n.shape != first.shape for n in numbers):
            return None
        scales = np.broadcast_to(scale, first.shape)
        if not np.all(scales > 0.0):
            return None
        known = [np.asarray(n) for n in numbers]
        apart = [factor * np.abs(b - a) / scales for factor, (a, b) in zip(factors, pairwise(known), strict=True)]
        return [comparison.error([float(d.ravel()[k]) for d in apart]) for k in range(first.size)]

    peak, final = (abs(summary.get(name) or 0.0) for name in ("peak_force", "final_force"))
    if solution.travel.shape[1]:
        for name, scale in (("peak_force", peak), ("final_force", max(peak, final))):
            error = state(lambda at, name=name: np.array([at[name]]) if name in at else None, scale)  # type: ignore[misc]
            if error:
                found[name] = error[0]
    found |= positions
    if comparison.cells and "peak_force" in found:
        found |= _of_snaps(comparison, found, summary, [there for _, there in runs])
    elif comparison.cells and any(len(there["events"]) != len(summary["events"]) for _, there in runs):
        found["by"] += "; other meshes snap at other loads"
    probes = {}
    for name, moved in summary.get("probe_displacement", {}).items():
        size = float(np.linalg.norm(moved))
        error = state(lambda at, name=name: np.array(at.get("probe_displacement", {}).get(name, ())), size)  # type: ignore[misc]
        if error:
            probes[name] = float(np.linalg.norm(error))
    frequencies, limits = {}, {}
    for number, step in enumerate(summary.get("step", ())):
        own_modes = np.abs(np.array(step.get("frequencies_hz", ())))
        error = state(lambda at, n=number: np.array(at["step"][n].get("frequencies_hz", ())), own_modes)  # type: ignore[misc]
        if error:
            frequencies[step["name"]] = error
        sizes = np.abs(_limit_loads(summary, number))
        error = state(lambda at, n=number: _limit_loads(at, n), float(sizes.max(initial=0.0)))  # type: ignore[misc]
        if error:
            limits[step["name"]] = max(error)
    loads = _of_loads(comparison, chain, factors)
    named = {"probes": probes, "frequencies": frequencies, "limit_points": limits, "loads": loads}
    return found | {name: errors for name, errors in named.items() if errors}


def _of_snaps(comparison: Comparison, least: Statement, own: dict[str, Any], others: Sequence[dict[str, Any]]) -> Statement:
    """Errors of the forces of runs that may follow different branches: at least a factor times their largest difference."""
    runs, found = [own, *others], Statement(by=comparison.by)
    scales = {"peak_force": abs(own["peak_force"]), "final_force": max(abs(own["peak_force"]), abs(own["final_force"]))}
    for name in (name for name in scales if name in least):
        found[name], scale = least[name], scales[name]
        paths = [path_events(run, run[name.replace("force", "travel")]) for run in runs]
        if not any(paths) or not scale:
            continue
        forces, alike = [run[name] for run in runs], all(_alike(paths[0], path) for path in paths[1:])
        apart = max(abs(force - forces[0]) for force in forces) / scale
        found[name] = max((comparison.safety if alike else _BRANCHES) * apart, found[name] or 0.0)
        if not alike and "other meshes" not in found["by"]:
            size = shown_range(min(forces), max(forces), "N m" if turns(own) else "N")
            found["by"] += f"; other meshes snap at other travels: {name.replace('_', ' ')} {size}"
    return found


def _alike(path: Sequence[dict[str, Any]], other: Sequence[dict[str, Any]]) -> bool:
    """Whether two paths have the same events at about the same travels."""
    pairs = list(zip(path, other, strict=False))
    same = all(a["kind"] == b["kind"] and math.isclose(a["travel"], b["travel"], rel_tol=_SAME_TRAVEL) for a, b in pairs)
    return len(path) == len(other) and same


def _of_first_order(own: Solution, other: Solution) -> float:
    """Error of first order over the difference from another run; 1 with the same cells, or cells of twice the size."""
    cells = own.shape.shape[1], other.shape.shape[1]
    if cells[0] == cells[1] or not all(cells):
        return 1.0
    ratio = math.sqrt(max(cells) / min(cells))
    if cells[1] > cells[0]:
        return ratio / (ratio - 1.0)
    return (_UNEVEN if ratio < _HALVED else 1.0) / (ratio - 1.0)


def _limit_loads(summary: dict[str, Any], number: int) -> np.ndarray:
    """Sizes of the first load at the limit points of a step."""
    points = summary["step"][number].get("limit_points", ())
    return np.array([next(iter(point["loads"].values()))["size"] for point in points if point["loads"]])


def _of_loads(comparison: Comparison, chain: Sequence[Solution], factors: Sequence[float]) -> dict[str, float]:
    """Errors of the displacements of the loads at the end, relative to these displacements."""
    path = chain[0].load_path
    if path is None or any(other.load_path is None or other.load_path.names != path.names for other in chain):
        return {}
    found = {}
    for k, name in enumerate(path.names):
        ends = [float(one.load_path.way[-1, k]) for one in chain if one.load_path is not None]
        if np.all(np.isfinite(ends)) and ends[0]:
            apart = [f * abs(b - a) / abs(ends[0]) for f, (a, b) in zip(factors, pairwise(ends), strict=True)]
            found[name] = comparison.error(apart)
    return found


def _of_positions(comparison: Comparison, chain: Sequence[Solution], factors: Sequence[float]) -> Statement:
    """Errors of the positions at the records: relative to the largest displacement, and along each axis to that along it."""
    own = chain[0]
    steps = own.step
    differences, points = [], []
    ways = [_places(one, comparison.reach) for one in chain]
    for factor, (finer, coarser), (a, b) in zip(factors, pairwise(chain), pairwise(ways), strict=True):
        pair = _same_points((finer, a), (coarser, b))
        if pair is None:
            return {}
        differences.append(factor * pair[0])
        points.append(pair[1])
    places = ways[0]
    moved = np.abs(places - places[0]).max(axis=0, initial=0.0)
    way = moved.max(axis=0, initial=0.0)
    largest = float(way.max(initial=0.0))
    size = float(np.abs(places).max(initial=0.0))
    if largest <= _STILL * size or not len(steps):
        return {}
    # common points at held edges alone would show no error
    seen = moved[points[0]].max(axis=0, initial=0.0) >= _SEEN * way
    if not seen[int(np.argmax(way))]:
        return {}
    total = [float(pair.max(initial=0.0)) / largest for pair in differences]
    found: Statement = {"positions": comparison.error(total)}
    above = np.flatnonzero(differences[0].max(axis=1) > _LARGE * largest)
    if len(above) and found["positions"] > _LARGE:
        found["positions_since"] = float(own.time[_common_records(own, chain[1])[0][above[0]]])
    along = {
        axis: comparison.error([float(pair[:, k].max(initial=0.0)) / float(way[k]) for pair in differences])
        for k, axis in enumerate("xyz")
        if way[k] > _MOVES * largest and seen[k]
    }
    return found | {"positions_along": along}


def _places(solution: Solution, reach: np.ndarray | None) -> np.ndarray:
    """Points at the records, (n, points, 3), m: corners of all plates; without plates, or with the radii `reach` of all
    bodies, the centre of each body, and a point on each of its axes at its radius.
    """
    points = [solution.shape.reshape(len(solution), -1, 3)] if solution.shape.size else []
    if not points or reach is not None:
        centres, axes = _bodies(solution)
        points.append(centres)
        if reach is not None:
            points += [centres + reach[:, None] * axis for axis in axes]
    return np.concatenate(points, axis=1)


def _bodies(solution: Solution) -> tuple[np.ndarray, list[np.ndarray]]:
    """Positions of all bodies at the records, and unit vectors along their axes, (n, bodies, 3) each."""
    spatial, count = solution.layout.dimension == "spatial", len(solution.layout.body_names)
    size = 7 if spatial else 3
    poses = solution.q[:, : count * size].reshape(len(solution), count, size)
    if spatial:
        w, v = poses[..., 3:4], poses[..., 4:7]
        return poses[..., :3], [e + 2.0 * np.cross(v, np.cross(v, e) + w * e) for e in np.eye(3)]
    x, z, angle = np.moveaxis(poses, -1, 0)
    zero, c, s = np.zeros_like(x), np.cos(angle), np.sin(angle)
    return np.stack([x, zero, z], axis=-1), [np.stack([c, zero, s], axis=-1), np.stack([-s, zero, c], axis=-1)]


def _same_points(
    one: tuple[Solution, np.ndarray], another: tuple[Solution, np.ndarray]
) -> tuple[np.ndarray, np.ndarray] | None:
    """Largest difference of the positions of common points at each common record, along each axis, (records, 3), m; and the
    numbers of these points. Each run has its points at its records.
    """
    (own, a), (other, b) = one, another
    mine, theirs = _common_records(own, other)
    if len(mine) < 2:
        return None
    if a.shape[1] == b.shape[1]:
        first, second = np.arange(a.shape[1]), np.arange(b.shape[1])
    else:
        first, second = _common_points(own, other, a[0], b[0])
    if not len(first):
        return None
    return np.abs(a[mine][:, first] - b[theirs][:, second]).max(axis=1), first


def _common_records(own: Solution, other: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the records of both runs at the same step and time."""
    key = {(int(s), f"{t:.9g}"): k for k, (s, t) in enumerate(zip(other.step, other.time, strict=True))}
    pairs = [(k, key.get((int(s), f"{t:.9g}"))) for k, (s, t) in enumerate(zip(own.step, own.time, strict=True))]
    found = [(k, there) for k, there in pairs if there is not None]
    return np.array([k for k, _ in found], dtype=int), np.array([there for _, there in found], dtype=int)


def _common_points(own: Solution, other: Solution, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of corners of both meshes that are the same material point, as they have the same place at the start."""
    cells = b.reshape(-1, 4, 3)
    size = float(np.linalg.norm(cells[:, 2] - cells[:, 0], axis=1).max(initial=0.0))
    parts = own.layout.panel, other.layout.panel
    found: tuple[list[int], list[int]] = ([], [])
    for panel in np.unique(parts[1]):
        rows, others = (np.flatnonzero(np.repeat(part == panel, 4)) for part in parts)
        if not len(rows):
            continue
        from scipy.spatial import cKDTree  # runs without a second mesh do not import SciPy

        far, near = cKDTree(a[rows]).query(b[others])
        same = far <= _SAME * size
        found[0].extend(rows[near[same]].tolist())
        found[1].extend(others[same].tolist())
    return np.array(found[0], dtype=int), np.array(found[1], dtype=int)
