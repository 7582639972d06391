"""Randomly damaged files for the readers of the program; README.md describes the method and the results.

    python -m validation.fuzz [--count 2000] [--seed 1] [--targets case,table,...] [--out out/fuzz]
    python -m validation.fuzz --atheris [--seconds 60] ...

Exit code 1 means that a reader neither read a file nor refused it with a message.
"""

from __future__ import annotations

import validation.benchmarks.one_thread  # noqa: F401  isort: skip

import argparse
import importlib.util
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from validation.fuzz.campaign import CLASSES, Line, run_fuzz
from validation.fuzz.guided import run_guided
from validation.fuzz.targets import TARGETS


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the campaign and print the outcomes of the files."""
    parser = argparse.ArgumentParser(prog="python -m validation.fuzz", description="Broken files, read or refused.")
    parser.add_argument("--count", type=int, default=2000, help="files for every reader")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--targets", default=",".join(TARGETS))
    parser.add_argument("--atheris", action="store_true", help="files that look for new code, in place of random ones")
    parser.add_argument("--seconds", type=int, default=60, help="with --atheris: for every reader")
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"))
    chosen = parser.parse_args(arguments)
    names = chosen.targets.split(",")
    if unknown := set(names) - set(TARGETS):
        parser.error(f"no such targets: {', '.join(sorted(unknown))}; there are {', '.join(TARGETS)}")
    if chosen.atheris:
        return _guided(names, chosen.seconds, chosen.seed, chosen.out)
    lines: list[Line] = []
    print(f"| reader | files | {' | '.join(CLASSES)} | time (s) | slowest (s) |\n|{'---|' * (len(CLASSES) + 4)}")
    for name in names:
        own = run_fuzz(name, chosen.seed, chosen.count, chosen.out, _tell)
        counts = Counter(line["class"] for line in own)
        times = [line.get("cpu_s", 0.0) for line in own]
        cells = [name, len(own), *(counts[one] for one in CLASSES), f"{sum(times):.0f}", f"{max(times):.1f}"]
        print("| " + " | ".join(map(str, cells)) + " |", flush=True)
        lines += own
    return int(any(line["class"] not in ("read", "refused") for line in lines))


def _guided(names: Sequence[str], seconds: int, seed: int, keep: Path) -> int:
    if importlib.util.find_spec("atheris") is None:
        print("atheris is not installed: pip install 'fsm[fuzz]'", file=sys.stderr)
        return 2
    print("| reader | files | branches reached | faults |\n|---|---|---|---|")
    faults = 0
    for name in names:
        files, reached, wrong = run_guided(name, seconds, seed, keep)
        faults += bool(wrong)
        print(f"| {name} | {files} | {reached} | {int(bool(wrong))} |", flush=True)
        print(wrong, file=sys.stderr, end="", flush=True)
    return int(bool(faults))


def _tell(line: Line) -> None:
    last = line["what"].strip().splitlines()[-1] if line["what"] else ""
    print(f"{line['target']} {line['number']}: {line['class']}: {last}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
