"""Fractions of lines and of branches that tests reach, each alone, and exit code 1 if either is less than `LEAST`.

    python -m coverage json && python -m tests.covered out/coverage/figures.json

In a single figure, as in `fail_under` of coverage, missed branches are hidden by lines, which are more numerous.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

__all__ = ["LEAST", "covered"]

LEAST = 90.0
"""Percent."""


def covered(report: Path) -> dict[str, float]:
    """Percent of lines and of branches that were reached, from a report of ``coverage json``."""
    totals = json.loads(report.read_text(encoding="utf-8"))["totals"]
    return {
        "lines": 100.0 * totals["covered_lines"] / totals["num_statements"],
        "branches": 100.0 * totals["covered_branches"] / totals["num_branches"],
    }


def main(report: Path) -> int:
    """Print both figures."""
    found = covered(report)
    for name, percent in found.items():
        print(f"{name:9}{percent:.1f} %{'' if percent >= LEAST else f', less than {LEAST:g} %'}")
    return int(min(found.values()) < LEAST)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
