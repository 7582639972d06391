"""Kills at random moments and locations that cannot be written to; README.md gives the results.

    python -m validation.faults [--kills 200] [--seed 1] [--kinds run,table,calibrate]

Exit code 1 means that data were lost or damaged.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from validation.faults.kills import KINDS, LONGEST_LOSS, kill_many
from validation.faults.writing import FAULTS


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all parts and print the results."""
    parser = argparse.ArgumentParser(prog="python -m validation.faults", description="Kills, and places not to write to.")
    parser.add_argument("--kills", type=int, default=200, help="in all, shared by the kinds")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", default=",".join(KINDS))
    chosen = parser.parse_args(arguments)
    kinds, bad = chosen.kinds.split(","), 0
    for name, try_it in FAULTS.items():
        with tempfile.TemporaryDirectory(prefix="fsm-faults-") as folder:
            wrong = try_it(Path(folder))
        bad += bool(wrong)
        print(f"{name}: {wrong or 'as it should be'}", flush=True)
    for number, kind in enumerate(kinds):
        share = chosen.kills // len(kinds) + (number < chosen.kills % len(kinds))
        with tempfile.TemporaryDirectory(prefix="fsm-faults-") as folder:
            found = kill_many(kind, share, chosen.seed, Path(folder))
        bad += len(found.faults) + (found.worst_loss > LONGEST_LOSS)
        cost = f"a whole one takes {found.whole:.0f} s"
        if found.losses:
            cost += f"; {len(found.losses)} unfinished solves, since the last checkpoint {_spread(found.losses)}"
        print(f"\n{kind}: {found.kills} kills, {found.finished} done before, {len(found.faults)} faults; {cost}", flush=True)
        print("".join(f"  {text}\n" for text in found.faults), end="")
    return int(bool(bad))


def _spread(seconds: Sequence[float]) -> str:
    return f"{statistics.median(seconds):.1f} s in the middle, {max(seconds):.1f} s at most"


if __name__ == "__main__":
    sys.exit(main())
