"""Peak force of the demo strip by Radau, BDF and LSODA, which must agree.

    python -m validation.methods.check [--full] [--out out/validation/methods]

4 segments per panel at rtol 1e-5; with --full 20 segments at rtol 1e-6, some minutes. Exit code 1 means that two peaks
differ by more than 0.1 %.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fsm.case.loading.load_case import load_case
from fsm.run.run_case import run_case
from validation.gallery.command import command
from validation.gallery.drawing import beside
from validation.gallery.record import Check, Part, Place, against

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_pull" / "case.toml"
METHODS = ("Radau", "BDF", "LSODA", "static")
TOLERANCE = 1e-3


def peaks(place: Place) -> Iterator[Check]:
    """Peak of the demo strip by independent methods: implicit Runge-Kutta, multistep, statics."""
    segments, rtol = (20, 1e-6) if place.full else (4, 1e-5)
    # the travel must only exceed the peak at 24 mm
    overrides = [f"solve.rtol={rtol}", "expect=none", 'drive.0.travel="28 mm"', f"strip.segments_per_panel={segments}"]
    picture, curves = place.out / "methods.png", {}
    first = 0.0
    for method in METHODS:
        out = place.out / method
        summary = run_case(load_case(CASE, [*overrides, f"solve.method={method}"]), out, progress=False)
        table = np.genfromtxt(out / "force.csv", delimiter=",", skip_header=1)
        curves[method] = (1e3 * table[:, 0], table[:, 1])
        detail = (
            f"at {1e3 * summary['peak_travel']:.3f} mm; {summary['steps']} steps, "
            f"{summary['newton_iterations']} Newton iterations, "
            f"energy error {summary['energy_error']:.1e}, {summary['solve_time_s']:.1f} s"
        )
        if not first:
            first = summary["peak_force"]
            told = detail
            continue
        yield against(
            f"largest force up to 28 mm, {method}",
            f"{segments} segments per panel, rtol {rtol:g}",
            summary["peak_force"],
            first,
            f"Radau of SciPy ({told})",
            picture,
            rtol=TOLERANCE,
            unit="N",
            detail=detail,
        )
    # each curve has points at different travels, because the curves would hide each other
    few = {
        f"{name}, every 3 mm": (x[2 * k :: 6], y[2 * k :: 6]) for k, (name, (x, y)) in enumerate(list(curves.items())[1:])
    }
    beside(picture, {"Radau": curves["Radau"]}, few, "travel (mm)", "pull force (N)")


TITLE = "Three methods, one answer"
PARTS: dict[str, Part] = {"peaks": peaks}

if __name__ == "__main__":
    sys.exit(command(PARTS, "methods", __doc__))
