"""Coverage of stated errors: python -m validation.errors [KIND ...] [--count N] [--seed N]."""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from validation.errors import facets, films, motions, rigid, strips
from validation.errors.coverage import Number, table

KINDS = films.KINDS | facets.KINDS | motions.KINDS | rigid.KINDS | strips.KINDS


def main() -> None:
    """Draw cases, compute stated and true errors, and print the table."""
    reader = argparse.ArgumentParser(description=__doc__)
    reader.add_argument("kinds", nargs="*", metavar="KIND", help=f"default: all of {', '.join(KINDS)}")
    reader.add_argument("--count", type=int, default=20)
    reader.add_argument("--seed", type=int, default=1)
    reader.add_argument("--all", action="store_true", help="print every number that is not covered")
    asked = reader.parse_args()
    found: dict[str, list[list[Number]]] = {}
    for kind in asked.kinds or KINDS:
        begun = time.perf_counter()
        cases = found[KINDS[kind].title] = []
        for number in range(asked.count):
            random = np.random.default_rng([asked.seed, *kind.encode(), number])
            cases.append(list(KINDS[kind].numbers(random)))
            for one in cases[-1]:
                if asked.all and not one.covered:
                    print(f"{kind} {number}: {one.name}: stated {one.stated}, true {one.true:.3g}", file=sys.stderr)
        print(f"{kind}: {time.perf_counter() - begun:.0f} s", file=sys.stderr, flush=True)
    print(table(found))


if __name__ == "__main__":
    main()
