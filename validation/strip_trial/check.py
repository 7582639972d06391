"""Peak force of the trial strip against the independent quasi-static computation of validation/references.md.

    python -m validation.strip_trial.check [--out out/validation/strip_trial] [--quick]

Exit code 1 if a number is off by more than its tolerance.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

from fsm.run import run_case
from fsm.scene.load_case import load_case

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"


@dataclass(frozen=True)
class Check:
    """One run: segments a panel, contact pairs (all for ""), reference peak (N), relative tolerance, travel."""

    segments: int
    pairs: str
    peak: float
    tolerance: float
    travel: str


# All contacts: 1.992 N +-0.5 %, the limit for many segments. Panels 3 and 4 only: a value for each number of segments, all
# with the half-cell correction, so the agreement is to be closer. validation/references.md.
CHECKS = (
    Check(20, "", 1.992, 0.015, "40 mm"),
    Check(40, "", 1.992, 0.006, "40 mm"),
    Check(10, "[[3, 4]]", 1.3787, 0.005, "45 mm"),
    Check(20, "[[3, 4]]", 1.3988, 0.005, "45 mm"),
    Check(40, "[[3, 4]]", 1.4052, 0.005, "45 mm"),
)


def main() -> int:
    """Run all, print a row each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/validation/strip_trial"))
    parser.add_argument("--quick", action="store_true", help="only up to 20 segments a panel")
    options = parser.parse_args()
    print("| segments | contact pairs | peak, N | at, mm | reference, N | off, % | allowed, % | steps | time, s |")
    print("|---|---|---|---|---|---|---|---|---|")
    missed = 0
    for check in CHECKS:
        if options.quick and check.segments > 20:
            continue
        overrides = [
            f"strip.segments_per_panel={check.segments}",
            f"drive.0.travel={check.travel}",
            "expect=none",
            *([f"contact.pairs={check.pairs}"] if check.pairs else []),
        ]
        name = f"{check.segments}_{'3-4' if check.pairs else 'all'}"
        summary = run_case(load_case(CASE, overrides), options.out / name, progress=False)
        off = summary["peak_force"] / check.peak - 1
        missed += abs(off) > check.tolerance
        print(
            f"| {check.segments} | {'3-4' if check.pairs else 'all'} | {summary['peak_force']:.5f} "
            f"| {1e3 * summary['peak_travel']:.2f} | {check.peak:g} | {100 * off:+.2f} | {100 * check.tolerance:g} "
            f"| {summary['steps']} | {summary['solve_time_s']:.1f} |",
            flush=True,
        )
    print(f"\n{missed} missed" if missed else "\nall within their tolerance")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
