"""Check whether the peak of the pulled strip depends on the speed of the pull or on the damping.

`python -m validation.quasi_static.check` runs it from the root of the repository; exit code 1 means that half the speed
changes the peak by 1 % or more.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fsm.case.loading.table import load_table
from fsm.run.table import run_table
from validation.gallery.command import command
from validation.gallery.drawing import beside
from validation.gallery.record import Check, Part, Place, below
from validation.quasi_static.one_peak import one_peak
from validation.quasi_static.stages import stages

TABLE = Path(__file__).parents[2] / "folding_cases" / "strip_pull" / "table.csv"
CONDITION = "80 deg low"
SPEEDS = (2.0, 1.0, 0.5)  # mm/s
DAMPINGS = (10.0, 5.0)  # ms
BOUND = 0.01


@dataclass(frozen=True)
class Pull:
    """One run: requested speed and damping (mm/s, ms), and its peak (N, mm)."""

    speed: float
    damping: float
    peak_force: float
    peak_travel: float
    wall_time: float


def pulls(table: Path = TABLE, speeds: tuple[float, ...] = SPEEDS, dampings: tuple[float, ...] = DAMPINGS) -> list[Pull]:
    """Run the condition at every speed and damping, on all cores."""
    condition = next(case.overrides for case in load_table(table) if case.name == CONDITION)
    header = ["case", *condition, "drive.0.speed", "material.damping"]
    asked = [(speed, damping) for speed in speeds for damping in dampings]
    rows = [
        [f"speed {speed:g} damping {damping:g}", *condition.values(), f"{speed} mm/s", f"{damping} ms"]
        for speed, damping in asked
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.csv"
        lines = [f"# base = {table.parent / 'case.toml'}", ",".join(header), *(",".join(row) for row in rows)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        done = run_table(path, Path(folder) / "out", progress=False)
    failed = [f"{row['case']}: {row['error']}" for row in done if row.get("error")]
    if failed:
        raise SystemExit("\n".join(failed))
    return [
        Pull(*both, row["peak_force"], 1e3 * row["peak_travel"], row["wall_time_s"])
        for both, row in zip(asked, done, strict=True)
    ]


def changes(found: list[Pull]) -> tuple[float, float]:
    """Largest relative change of the peak force due to half the speed, and due to half the damping."""
    peak = {(pull.speed, pull.damping): pull.peak_force for pull in found}
    by_speed = [abs(peak[v / 2, b] / f - 1) for (v, b), f in peak.items() if (v / 2, b) in peak]
    by_damping = [abs(peak[v, b / 2] / f - 1) for (v, b), f in peak.items() if (v, b / 2) in peak]
    return max(by_speed), max(by_damping)


def speeds(place: Place) -> Iterator[Check]:
    """The peak of the pulled strip against the speed of the pull and its damping."""
    found = pulls()
    by_speed, by_damping = changes(found)
    ours = {
        f"damping {b:g} ms": ([p.speed for p in found if p.damping == b], [p.peak_force for p in found if p.damping == b])
        for b in DAMPINGS
    }
    picture = beside(place.out / "speed.png", ours, {}, "speed of the pull (mm/s)", "peak force (N)")
    detail = ", ".join(f"{p.speed:g} mm/s {p.damping:g} ms: {p.peak_force:.5f} N" for p in found)
    yield below(
        "change of the peak when the speed is halved",
        "2 to 0.5 mm/s",
        by_speed,
        BOUND,
        "a static quantity does not depend on the speed",
        picture,
        detail=detail,
    )
    yield below(
        "change of the peak when the damping is halved", "10 and 5 ms", by_damping, BOUND, "nor on the damping", picture
    )


TITLE = "The pull is quasi-static"
PARTS: dict[str, Part] = {"speeds": speeds, "one_peak": one_peak, "stages": stages}

if __name__ == "__main__":
    sys.exit(command(PARTS, "quasi_static", __doc__))
