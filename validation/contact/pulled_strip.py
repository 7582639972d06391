"""The pulled strip in space and in the plane, with friction, and with other contact stiffness and thickness."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fsm.case.loading.load_case import load_case
from fsm.model.compile.compile_case import compile_case
from fsm.results.quantities import peak
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import PathSettings
from fsm.solve.statics.static import follow

__all__ = ["CASE", "Pull", "as_thick", "curve_difference", "pull"]

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
EVERY = 1e-3
"""Travel between the records, m."""


@dataclass(frozen=True)
class Pull:
    """One pull.

    Attributes
    ----------
    travel, force : (n,) arrays, m and N
        At even travels.
    peak_force, peak_travel : N, m
        Of all steps.
    deepest : m
    slid : m
        Sliding distance of the faces of the pair with the largest sliding distance during contact.
    friction_energy, turnover : J
        Energy dissipated by friction; reference energy of the run.
    energy_error : error relative to the reference energy
    steps, rejected : int
    time : processor time of the solve, s
    """

    travel: np.ndarray
    force: np.ndarray
    peak_force: float
    peak_travel: float
    deepest: float
    slid: float
    friction_energy: float
    turnover: float
    energy_error: float
    steps: int
    rejected: int
    time: float


def pull(*changes: str, segments: int = 10, travel: float = 0.04, rtol: float = 1e-4) -> Pull:
    """Solution of the trial strip by statics, with changes in the form of `--set`."""
    overrides = [f"strip.segments_per_panel={segments}", f"drive.0.travel={travel}", "expect=none", *changes]
    _, system = compile_case(load_case(CASE, overrides).case)
    motion = system.motions[0]
    times = [motion.time_of(x) for x in np.arange(EVERY, travel, EVERY)]
    saved: list[SavedState] = []
    begun = time.process_time()
    settings = PathSettings(motion.end_time, motion.time_of(travel / 200), rtol=rtol)
    statistics, energy_balance = follow(system, settings, [0.0, *times, motion.end_time], saved.append)
    taken = time.process_time() - begun
    drives = [drive for drive, *_ in statistics.points]
    top, at = peak(np.array([d.travel[0] for d in drives]), np.array([d.force[0] for d in drives]))
    at_times = np.array([state.time for state in saved])
    slips = np.array([state.observation.pairs.slip for state in saved])
    return Pull(
        np.array([state.observation.drive.travel[0] for state in saved]),
        np.array([state.observation.drive.force[0] for state in saved]),
        top,
        at,
        max(0.0, -min(float(state.observation.pairs.gap.min()) for state in saved)),
        float(np.trapezoid(slips, at_times, axis=0).max(initial=0.0)),
        float(energy_balance.pair_energy[0].sum()),
        energy_balance.turnover,
        energy_balance.relative_error,
        statistics.steps,
        statistics.rejected,
        taken,
    )


def as_thick(thickness: float) -> list[str]:
    """Changes with which faces touch at another thickness, m, while mass and bending stiffness are constant."""
    part = 3e-4 / thickness
    return [
        f"strip.thickness={thickness}",
        "contact.thickness_in_gap=true",
        f"material.young={3e9 * part**3}",
        f"material.density={800.0 * part}",
    ]


def curve_difference(one: Pull, other: Pull) -> float:
    """Largest difference of two force curves over the peak."""
    return float(np.abs(one.force - other.force).max() / max(one.peak_force, other.peak_force))
