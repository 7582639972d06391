"""Thousands of random scenes of all kinds; README.md describes the scenes and the checks.

    python -m validation.stress [--scenes 5000] [--first 0] [--seed 1] [--workers 1] [--limit 5] [--kinds strip,chain]
                                [--out out/stress]
    python -m validation.stress --seed 1 --only 1234         (one scene: its case file, and what becomes of it)

An interrupted campaign continues where it stopped. Exit code 1 means that a result is wrong, or that 5 % of the feasible
scenes fail.
"""

from __future__ import annotations

import validation.benchmarks.one_thread  # noqa: F401  isort: skip

import argparse
import json
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fsm.run.warm_up import compile_ahead
from validation.stress.campaign import examine, run_campaign
from validation.stress.scenes import KINDS, MIXED, draw, loaded
from validation.stress.summary import failed_of_feasible, summarised

MOST_FAILED = 0.05
"""Part of the feasible scenes that may fail."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the campaign, or one of its scenes."""
    parser = argparse.ArgumentParser(prog="python -m validation.stress", description="Random scenes, solved and judged.")
    parser.add_argument("--scenes", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--limit", type=float, default=5.0, help="seconds of processor time for a scene")
    parser.add_argument("--kinds", default=",".join(MIXED))
    parser.add_argument("--out", type=Path, default=Path("out/stress"))
    parser.add_argument("--only", type=int, help="number of the one scene to show and solve")
    chosen = parser.parse_args(arguments)
    kinds = tuple(chosen.kinds.split(","))
    if unknown := set(kinds) - set(KINDS):
        parser.error(f"no such kinds: {', '.join(sorted(unknown))}; there are {', '.join(KINDS)}")
    if chosen.only is not None:
        return _show(chosen.seed, chosen.only, kinds, chosen.limit)
    compile_ahead()
    name = f"seed_{chosen.seed}" + ("" if kinds == MIXED else "_" + "_".join(kinds))
    numbers = range(chosen.first, chosen.first + chosen.scenes)
    begun = time.perf_counter()
    lines = run_campaign(chosen.out / f"{name}.jsonl", chosen.seed, numbers, chosen.limit, chosen.workers, kinds, _tell)
    text = summarised(lines) + f"\n\n{time.perf_counter() - begun:.0f} s on the clock, {chosen.workers} workers"
    (chosen.out / f"{name}.md").write_text(text + "\n", encoding="utf-8")
    print(text)
    return int(any(line["class"] == "wrong" for line in lines) or failed_of_feasible(lines)[0] >= MOST_FAILED)


def _tell(line: Mapping[str, Any]) -> None:
    if line["class"] in ("wrong", "cut off"):
        print(f"{line['scene']} {line['kind']}: {line['class']}: {line['what']}", file=sys.stderr, flush=True)


def _show(seed: int, number: int, kinds: tuple[str, ...], limit: float) -> int:
    drawn = draw(seed, number, kinds)
    try:
        print(loaded(drawn.tables, "scene").text)
    except Exception as error:  # the error itself is the result to be shown
        print(f"no case: {error}")
    line = examine(drawn, limit)
    print(json.dumps(line, indent=2))
    return int(line["class"] == "wrong")


if __name__ == "__main__":
    sys.exit(main())
