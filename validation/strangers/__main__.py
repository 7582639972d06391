"""Thousands of cases as engineers would write them, each run by `fsm run`; README.md describes the cases and the results.

    python -m validation.strangers [--cases 2400] [--seed 1] [--workers 1] [--kinds strips,films] [--out out/strangers]
    python -m validation.strangers --seed 1 --only strips:17       (one case again; its folder is kept)

An interrupted command continues where it stopped. With --earlier, cases that earlier sources solved are not run again. Exit
code 1 means that less than 95 % of any kind is solved, that the second solver finds a wrong result, or that facets of a
saved state pass through each other.
"""

from __future__ import annotations

import validation.benchmarks.one_thread  # noqa: F401  isort: skip

import argparse
import json
import sys
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from fsm.run.warm_up import compile_ahead
from validation.strangers.campaign import LIMIT, Line, course_of, fsm_command, run_campaign
from validation.strangers.cases import FULL, KINDS, Row, rows
from validation.strangers.launch import side_by_side
from validation.strangers.report import report, write_csv

GOAL = 0.95
"""Part of every kind that has to be solved."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the campaign, or one of its cases."""
    parser = argparse.ArgumentParser(prog="python -m validation.strangers", description="Cases that an engineer would type.")
    parser.add_argument("--cases", type=int, default=FULL, help="of all kinds together; scales each")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--limit", type=float, default=LIMIT, help="seconds of processor time for a case")
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--out", type=Path, default=Path("out/strangers"))
    parser.add_argument("--earlier", action="store_true", help="count cases that earlier sources solved; run all others")
    parser.add_argument("--only", metavar="KIND:INDEX", help="the one case to run again, whose folder is kept")
    chosen = parser.parse_args(arguments)
    kinds = tuple(chosen.kinds.split(","))
    if find_spec("ipctk") is None:
        parser.error("saved states with contact are tested by IPC Toolkit: pip install 'fsm[peers]'")
    if unknown := set(kinds) - set(KINDS):
        parser.error(f"no such kinds: {', '.join(sorted(unknown))}; there are {', '.join(KINDS)}")
    if chosen.only is not None:
        kind, _, index = chosen.only.partition(":")
        if kind not in KINDS or not index.isdigit():
            parser.error(f"--only {chosen.only}: give a kind of {', '.join(KINDS)} and a number, as strips:17")
        return _again(Row(kind, int(index), checked=True), chosen.seed, chosen.limit, chosen.out)
    compile_ahead(show=False)
    name, begun = f"seed_{chosen.seed}", time.perf_counter()
    lines = run_campaign(
        chosen.out / f"{name}.jsonl",
        rows(chosen.cases, kinds, chosen.seed),
        chosen.seed,
        chosen.workers,
        chosen.limit,
        _tell,
        chosen.earlier,
    )
    lines.sort(key=lambda line: (list(KINDS).index(line["kind"]), line["index"]))
    text = report(lines, chosen.seed)
    (chosen.out / f"{name}.md").write_text(text + "\n", encoding="utf-8")
    write_csv(chosen.out / f"{name}.csv", lines)
    print(text)
    print(f"\n{time.perf_counter() - begun:.0f} s on the clock, {chosen.workers} workers", file=sys.stderr)
    return int(not _passed(lines))


def _passed(lines: Sequence[Line]) -> bool:
    if any(line.get("second") == "differs" or line.get("intersecting") for line in lines):
        return False
    own = ([line["code"] == 0 for line in lines if line["kind"] == kind] for kind in KINDS)
    return all(sum(solved) >= GOAL * len(solved) for solved in own)


def _tell(line: Line) -> None:
    if line["code"] != 0 or line.get("second") == "differs":
        what = line["said"] or f"{line['of']} off by {line['off']:.2g}"
        print(f"{line['kind']}:{line['index']} {line['cause']} ({line['cpu_s']:.0f} s): {what}", file=sys.stderr, flush=True)
    if line.get("intersecting"):
        what = f"{line['intersecting']} of {line['states']} states have intersections"
        print(f"{line['kind']}:{line['index']}: {what}", file=sys.stderr, flush=True)


def _again(row: Row, seed: int, limit: float, out: Path) -> int:
    folder = out / f"seed_{seed}_{row.kind}_{row.index}"
    (line,) = side_by_side([course_of(row, seed, folder, limit, out, keep=True)], 1, fsm_command)
    print(json.dumps(line, indent=2))
    print(f"fsm run {folder / 'case.toml'} --out {folder / 'out'}")
    return int(line["code"] != 0 or line.get("second") == "differs")


if __name__ == "__main__":
    sys.exit(main())
