"""Peak force of the demo strip by Radau, BDF and LSODA: three codes, one answer.

    python -m validation.methods.check [--segments 20] [--rtol 1e-6] [--out out/validation/methods]

Exit code 1 if two peaks are apart by more than 0.1 %.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from fsm.errors import FsmError
from fsm.run import run_case
from fsm.scene.load_case import load_case

FOLDER = Path(__file__).parents[2] / "folding_cases"
METHODS = ("Radau", "BDF", "LSODA")
TOLERANCE = 1e-3


def main() -> int:
    """Run all, print a row each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--segments", type=int, help="segments a panel, instead of those of the case")
    parser.add_argument("--rtol", type=float, default=1e-6)
    parser.add_argument("--out", type=Path, default=Path("out/validation/methods"))
    options = parser.parse_args()
    demo = FOLDER / "strip_pull" / "case.toml"
    path = demo if demo.is_file() else FOLDER / "strip_trial" / "case.toml"
    # past the peak at 24 mm is far enough
    overrides = [f"solve.rtol={options.rtol}", "expect=none", 'drive.0.travel="28 mm"']
    if options.segments:
        overrides.append(f"strip.segments_per_panel={options.segments}")
    print(f"{path.parent.name}, rtol = {options.rtol:g}\n")
    print("| method | peak, N | at, mm | steps | Newton iterations | energy error | time, s |")
    print("|---|---|---|---|---|---|---|")
    peaks, failed = [], 0
    for method in METHODS:
        loaded = load_case(path, [*overrides, f"solve.method={method}"])
        try:
            summary = run_case(loaded, options.out / method, progress=False)
        except FsmError as error:
            failed += 1
            print(f"| {method} | {error} | | | | | |", flush=True)
            continue
        peaks.append(summary["peak_force"])
        print(
            f"| {method} | {summary['peak_force']:.6f} | {1e3 * summary['peak_travel']:.3f} | {summary['steps']} "
            f"| {summary['newton_iterations']} | {summary['energy_error']:.1e} | {summary['solve_time_s']:.1f} |",
            flush=True,
        )
    if len(peaks) < 2:
        return 1
    spread = (max(peaks) - min(peaks)) / max(peaks)
    print(f"\nspread {100 * spread:.4f} %, allowed {100 * TOLERANCE:g} %")
    return int(failed > 0 or spread > TOLERANCE)


if __name__ == "__main__":
    sys.exit(main())
