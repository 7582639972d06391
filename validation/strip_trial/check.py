"""Peak force of the trial strip against the independent quasi-static computation of validation/references.md.

    python -m validation.strip_trial.check [--out out/validation/strip_trial]

Exit code 1 if a number is off by more than its tolerance.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from fsm.run import run_case
from fsm.scene.builders.scene import build_scene
from fsm.scene.load_case import load_case
from fsm.segments.compile import compile_scene
from fsm.solve.newton import equilibrium, negative_pivots
from validation.gallery.command import command
from validation.gallery.drawing import beside, convergence
from validation.gallery.record import Check, Part, Place, against, below

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
SOURCE = "independent quasi-static computation (validation/references.md)"


TRAVEL = 4e-3
COUNTS = (5, 10, 20, 40)


@dataclass(frozen=True)
class Pull:
    """One run: segments a panel, contact pairs (all for ""), reference peak (N), relative tolerance, travel."""

    segments: int
    pairs: str
    peak: float
    tolerance: float
    travel: str


# All contacts: 1.992 N +-0.5 %, the limit for many segments. Panels 3 and 4 only: a value for each number of segments, all
# with the half-cell correction, so the agreement is to be closer. validation/references.md.
PULLS = (
    Pull(20, "", 1.992, 0.015, "40 mm"),
    Pull(40, "", 1.992, 0.006, "40 mm"),
    Pull(10, "[[3, 4]]", 1.3787, 0.005, "45 mm"),
    Pull(20, "[[3, 4]]", 1.3988, 0.005, "45 mm"),
    Pull(40, "[[3, 4]]", 1.4052, 0.005, "45 mm"),
)
FIRST_TOUCH = (13.0, 1.27)
"""Travel (mm) and force (N) at which panel 2 first touches panel 1."""


def peaks(place: Place) -> Iterator[Check]:
    """Peak force with all contacts, and with the contact of panels 3 and 4 alone."""
    picture = place.out / "strip.png"
    curves = {}
    for pull in PULLS:
        overrides = [
            f"strip.segments_per_panel={pull.segments}",
            f"drive.0.travel={pull.travel}",
            "expect=none",
            *([f"contact.pairs={pull.pairs}"] if pull.pairs else []),
        ]
        touching = "panels 3 and 4 only" if pull.pairs else "all contacts"
        out = place.out / f"{pull.segments}_{'3-4' if pull.pairs else 'all'}"
        summary = run_case(load_case(CASE, overrides), out, progress=False)
        table = np.genfromtxt(out / "force.csv", delimiter=",", skip_header=1)
        curves[f"{touching}, {pull.segments}"] = (1e3 * table[:, 0], table[:, 1])
        yield against(
            f"peak force, {touching}, {pull.segments} segments",
            "80 deg, linear creases, no friction, no thickness in the gap",
            summary["peak_force"],
            pull.peak,
            SOURCE,
            picture,
            rtol=pull.tolerance,
            unit="N",
            detail=f"at {1e3 * summary['peak_travel']:.2f} mm; {summary['steps']} steps, {summary['solve_time_s']:.1f} s",
        )
        if not pull.pairs and pull.segments == 40:
            touch = next(row for row in summary["touches"] if row["pair"] == "panel 1 - panel 2")
            yield against(
                "travel at which panel 2 touches panel 1",
                "40 segments; the reference is of two digits",
                1e3 * touch["travel"],
                FIRST_TOUCH[0],
                SOURCE,
                picture,
                atol=0.5,
                unit="mm",
            )
            yield against(
                "force there",
                "40 segments; the reference is of three digits",
                touch["force"],
                FIRST_TOUCH[1],
                SOURCE,
                picture,
                rtol=0.02,
                unit="N",
            )
    shown = {name: curves[name] for name in ("all contacts, 40", "panels 3 and 4 only, 40")}
    known = {"reference, all": ([27.0], [1.992]), "reference, 3 and 4": ([39.5], [1.4052])}
    beside(picture, shown, known, "travel (mm)", "pull force (N)")


@cache
def static_force(segments: int, half_cell: bool) -> float:
    """Static pull force at 4 mm, before contact, N."""
    overrides = [
        f"strip.segments_per_panel={segments}",
        f"strip.half_cell={str(half_cell).lower()}",
        "contact=none",
        "material.damping=0",
    ]
    system = compile_scene(build_scene(load_case(CASE, overrides).case))
    times = np.array([system.motions[0].time_of(x) for x in np.linspace(0.0, TRAVEL, 9)])
    q = equilibrium(system, system.initial()[0], times)
    assert negative_pivots(system, times[-1], q) == 0
    return float(system.observe(times[-1], q, np.zeros(system.nu)).drive.force[0])


def limit() -> float:
    """Richardson's limit of 80 and 160 segments with the half-cell correction (second order), N."""
    coarse, fine = static_force(80, True), static_force(160, True)
    return fine + (fine - coarse) / 3


def orders(half_cell: bool) -> np.ndarray:
    """Of convergence, from 5 to 40 segments a panel."""
    errors = np.array([abs(static_force(count, half_cell) - limit()) for count in COUNTS])
    return np.asarray(np.log2(errors[:-1] / errors[1:]))


def before_contact(place: Place) -> Iterator[Check]:
    """Force at 4 mm, where nothing touches yet, and its order of convergence."""
    errors = {
        name: [abs(static_force(count, half) / limit() - 1) for count in COUNTS]
        for name, half in (("with half a cell at creases", True), ("without", False))
    }
    picture = convergence(place.out / "order.png", COUNTS, errors, 2, x="segments a panel")
    yield against("force at 4 mm", "limit of many segments", limit(), 0.11413, SOURCE, picture, atol=0.5e-5, unit="N")
    yield below(
        "order with the half-cell correction, off 2 by",
        "5 to 40 segments",
        float(np.abs(orders(True) - 2).max()),
        0.1,
        "second order by construction",
        picture,
    )
    yield below(
        "order without it, off 1 by", "5 to 40 segments", float(np.abs(orders(False) - 1).max()), 0.3, "first order", picture
    )


TITLE = "The trial strip"
PARTS: dict[str, Part] = {"peaks": peaks, "before_contact": before_contact}

if __name__ == "__main__":
    sys.exit(command(PARTS, "strip_trial", __doc__))
