"""What a run amounts to: its summary, its warnings, and whether it is what was expected."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from fsm.crossing import first_crossings
from fsm.errors import CaseError, Fault
from fsm.results.quantities import Curve, summarise, summarise_contacts
from fsm.results.solution import Solution
from fsm.scene.case import Case
from fsm.scene.load_case import LoadedCase
from fsm.scene.scene import Scene
from fsm.solve.simulate import Ledger, Statistics
from fsm.solve.status import Event

__all__ = ["check_expectations", "missed_expectations", "summary_of"]

_SCALARS = (
    "peak_force", "peak_travel", "final_travel", "final_force", "contact_travel", "contact_force", "bending_travel",
    "bending_force", "dof", "steps", "newton_iterations", "energy_error", "unstable_equilibria", "wall_time_s",
)  # fmt: skip


def summary_of(
    solution: Solution, scene: Scene, statistics: Statistics, ledger: Ledger, warnings: list[str]
) -> dict[str, Any]:
    """What summary.json holds, but for times and sizes: peak, stages, contacts, counters, energy error, warnings.

    Parameters
    ----------
    solution : all records
    scene : Scene
    statistics, ledger : of the solve
    warnings : what was noticed before and during it
    """
    summary: dict[str, Any] = {"peak_force": 0.0, "peak_travel": 0.0, "stages": []}
    if solution.travel.shape[1]:
        summary |= summarise(_fine_curve(solution, statistics), solution.layout.pair_names)
    looked_at = np.array([forces for _, forces in statistics.seen])
    summary["contact"] = summarise_contacts(solution, looked_at, summary.get("touches", ()))
    unstable = int(np.sum(solution.negative_pivots > 0))
    summary |= {
        "steps": statistics.steps,
        "newton_iterations": statistics.newton_iterations,
        "energy_error": ledger.relative_error,
        "unstable_equilibria": unstable,
        "events": [asdict(event) for event in statistics.events],
        "solve_time_s": statistics.wall_time,
    }
    summary["warnings"] = [*warnings, *_warnings(solution, scene, summary, statistics)]
    return summary


def _fine_curve(solution: Solution, statistics: Statistics) -> Curve:
    """Records and every point looked at on the way, so that peak and stages do not depend on what is saved."""
    looked_at = Curve(
        np.array([drive.travel[0] for drive, _ in statistics.seen]),
        np.array([drive.force[0] for drive, _ in statistics.seen]),
        np.array([pairs for _, pairs in statistics.seen]).reshape(len(statistics.seen), solution.pair_force.shape[1]),
    )
    return Curve.of(solution).merged(looked_at)


def _warnings(
    solution: Solution, scene: Scene, summary: dict[str, Any], statistics: Statistics
) -> list[str]:
    found = []
    if summary["energy_error"] > 1e-3:
        found.append(f"energy balance off by {summary['energy_error']:.2g} of the energy turned over; tighten rtol")
    found += [_told(event) for event in statistics.events]
    if summary["unstable_equilibria"]:
        first = float(solution.travel[np.argmax(solution.negative_pivots > 0), 0]) if solution.travel.size else 0.0
        found.append(
            f"{summary['unstable_equilibria']} saved states have an unstable tangent, the first at {1e3 * first:.4g} mm: "
            "the strip snaps there, and its path depends on inertia and damping"
        )
    thickness = solution.layout.thickness
    if solution.pair_gap.size and -solution.pair_gap.min() > 0.2 * thickness:
        pair = solution.layout.pair_names[int(np.argmin(solution.pair_gap.min(axis=0)))]
        found.append(
            f"faces of {pair} penetrate by {-1e3 * solution.pair_gap.min():.3g} mm, more than a fifth of the thickness; "
            "raise contact.stiffness"
        )
    for first_panel, second_panel, travel in first_crossings(solution, scene):
        found.append(
            f"panels {first_panel} and {second_panel} pass through each other from {1e3 * travel:.4g} mm of travel on: "
            "they are not a contact pair, and the result beyond is not physical"
        )
    if solution.travel.size:
        moving = solution.energy["kinetic"] > 0.01 * np.maximum.accumulate(
            solution.energy["panels"] + solution.energy["creases"]
        )
        moving &= solution.travel[:, 0] > 0.02 * solution.travel[-1, 0]
        if moving.any():
            at = float(solution.travel[np.argmax(moving), 0])
            found.append(
                f"not quasi-static at {1e3 * at:.4g} mm: the kinetic energy is over 1 % of the elastic; pull slower"
            )
        if summary["peak_travel"] > 0.999 * solution.travel[-1, 0]:
            found.append("the force is still rising at the end of the travel; the peak may lie beyond it")
    return found


def _told(event: Event) -> str:
    """An event in words."""
    where = f"at {1e3 * event.travel:.4g} mm of travel" if event.travel else f"at {event.time:.4g} s"
    if event.kind == "bifurcation":
        return f"bifurcation {where}: the path there is unstable, a stable branch was taken; solve.imperfection chooses it"
    until = f"{1e3 * event.end_travel:.4g} mm" if event.end_travel else f"{event.end_time:.4g} s"
    forces = f"force {event.force:.4g} N before, {event.end_force:.4g} N after"
    return f"snap {where}: solved with inertia until {until}; {forces}"


def check_expectations(loaded: LoadedCase) -> None:
    """Refuse names in [expect] that no summary has."""
    faults = [
        Fault(f"expect.{name}", f"is not a number of the summary; there are {', '.join(_SCALARS)}")
        for name in loaded.case.expect
        if name not in _SCALARS
    ]
    if faults:
        raise CaseError(faults, str(loaded.path))


def missed_expectations(case: Case, summary: dict[str, Any]) -> list[str]:
    """A line for every number of [expect] that was missed."""
    lines = []
    for name, expect in case.expect.items():
        value = summary.get(name)
        bound = (expect.atol or 0.0) + (expect.rtol or 0.0) * abs(expect.value)
        if value is None:
            lines.append(f"expect.{name}: {expect.value:g} expected, but the run never got there")
        elif not abs(value - expect.value) <= bound:
            lines.append(f"expect.{name}: {value:.6g}, expected {expect.value:g} +- {bound:.3g}")
    return lines
