"""Command line that the folders have in common: it runs some parts or all, and prints each result."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from validation.gallery.record import Part, Place, show

__all__ = ["command"]


def command(parts: Mapping[str, Part], folder: str, text: str | None) -> int:
    """Run the selected parts of a folder; returns 1 if a check fails."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=list(parts), default=list(parts))
    parser.add_argument("--full", action="store_true", help="also what takes many minutes")
    parser.add_argument("--out", type=Path, default=Path("out/validation") / folder)
    options = parser.parse_args()
    red = 0
    for name in options.parts:
        print(f"\n{name}: {(parts[name].__doc__ or '').splitlines()[0]}")
        red |= show(parts[name](Place(options.out / name, options.full)))
    return red
