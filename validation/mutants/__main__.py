"""Mutants of the physics of the product, each with the test of `make test` that must detect it; see README.md.

    python -m validation.mutants [--only NAME ...] [--workers 1] [--again] [--out out/mutants]
    python -m validation.mutants --list

An interrupted command continues where it stopped. Exit code 1 means that a mutant is not detected or that a test fails
without one; 2 means that the list is out of date.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from validation.mutants.listed import MUTANTS
from validation.mutants.mutant import Mutant
from validation.mutants.run import CAUGHT, REPOSITORY, judge, work_copy

README = Path(__file__).with_name("README.md")
NOT_RUN = {"verdict": "not run"}
BEGIN, END = "<!-- table -->", "<!-- end of table -->"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the selected mutants and write the verdicts."""
    parser = argparse.ArgumentParser(prog="python -m validation.mutants", description="Faults put in on purpose.")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="names, or parts of them")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--again", action="store_true", help="also what has been judged with the same sources")
    parser.add_argument("--list", action="store_true", help="print the names and guards, run nothing")
    parser.add_argument("--out", type=Path, default=Path("out/mutants"))
    chosen = parser.parse_args(arguments)
    if faults := [fault for mutant in MUTANTS if (fault := mutant.fault(REPOSITORY))]:
        print("\n".join(faults))
        return 2
    asked = [m for m in MUTANTS if not chosen.only or any(part in m.name for part in chosen.only)]
    if not asked:
        parser.error(f"no mutant is called {', '.join(chosen.only)}; --list shows the names")
    if chosen.list:
        print("\n".join(f"{mutant.name}: {', '.join(mutant.guard)}" for mutant in asked))
        return 0
    path = chosen.out / "verdicts.json"
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    waiting = [m for m in asked if chosen.again or found.get(m.name, {}).get("key") != m.key(REPOSITORY)]
    shares = [waiting[k :: chosen.workers] for k in range(chosen.workers)]
    with ThreadPoolExecutor(chosen.workers) as pool:
        list(pool.map(lambda share: _work(share, path, found), shares))
    verdicts = [found[mutant.name]["verdict"] for mutant in asked]
    print(f"{verdicts.count(CAUGHT)} of {len(asked)} caught")
    write_table(README, {m.name: found[m.name] for m in MUTANTS if found.get(m.name, {}).get("key") == m.key(REPOSITORY)})
    return int(verdicts.count(CAUGHT) < len(asked))


def _work(mutants: Sequence[Mutant], path: Path, found: dict[str, Any]) -> None:
    if not mutants:
        return
    with work_copy() as root:
        for mutant in mutants:
            begun = time.monotonic()
            verdict, told = judge(mutant, root)
            date = time.strftime("%d %B %Y")
            found[mutant.name] = {"key": mutant.key(root), "verdict": verdict, "told": told, "date": date}
            path.parent.mkdir(parents=True, exist_ok=True)
            part = path.with_suffix(".part")
            part.write_text(json.dumps(dict(found), indent=1), encoding="utf-8")
            part.replace(path)
            print(f"{mutant.name}: {verdict} ({time.monotonic() - begun:.0f} s) {told}", flush=True)


def write_table(readme: Path, found: dict[str, Any]) -> None:
    """Write the verdicts of all mutants into the README, between its two marks; `found` contains the valid verdicts."""
    text = readme.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    date = max((one["date"] for one in found.values()), default="never run")
    caught = sum(one["verdict"] == CAUGHT for one in found.values())
    rows = [
        f"`python -m validation.mutants`, {date}: {caught} of {len(MUTANTS)} caught, {len(MUTANTS) - len(found)} not run.\n",
        "| fault | file | guard | verdict |",
        "|---|---|---|---|",
    ]
    for mutant in MUTANTS:
        guard = ", ".join(f"`{node.rpartition('/')[2]}`" for node in mutant.guard)
        rows.append(f"| {mutant.name} | `{mutant.file}` | {guard} | {found.get(mutant.name, NOT_RUN)['verdict']} |")
    readme.write_text(f"{before}{BEGIN}\n" + "\n".join(rows) + f"\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
