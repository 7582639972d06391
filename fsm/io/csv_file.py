"""Tables of numbers as CSV files."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fsm.io.atomic_write import atomic_write


def write_csv(path: str | Path, heading: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    """Write a heading and rows atomically; real numbers have 12 significant digits."""
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heading)
        writer.writerows([f"{value:.12g}" if isinstance(value, float) else value for value in row] for row in rows)
