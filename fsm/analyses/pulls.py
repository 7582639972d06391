"""Pulls that are not quasi-static, or that end before their peak."""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.results.curve import START_UP
from fsm.results.solution import ENERGIES, Solution

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
