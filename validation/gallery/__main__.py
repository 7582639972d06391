"""Run the checks of `validation/` and write the gallery.

    python -m validation.gallery [--only closed_forms papers/pull] [--full] [--again] [--out out/validation]

Parts that were run with unchanged sources are not run again, unless --again is given. Exit code 1 means that a check has
failed without a known reason.
"""

from __future__ import annotations

import validation.benchmarks.one_thread  # noqa: F401  isort: skip

import argparse
import sys
from pathlib import Path

from validation.gallery.folders import folders
from validation.gallery.run import run


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", default=folders(), metavar="FOLDER[/PART]")
    parser.add_argument("--full", action="store_true", help="also what takes many minutes")
    parser.add_argument("--again", action="store_true", help="also what is done already")
    parser.add_argument("--out", type=Path, default=Path("out/validation"))
    options = parser.parse_args()
    return run(options.only, options.out, options.full, options.again)


if __name__ == "__main__":
    sys.exit(main())
