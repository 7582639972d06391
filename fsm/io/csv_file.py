"""Tables of numbers as CSV files."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fsm.io.atomic_write import atomic_write


def write_csv(
    path: str | Path, heading: Iterable[str], rows: Iterable[Iterable[Any]] | np.ndarray, names: Sequence[str] = (),
    before: int = 0,
) -> None:  # fmt: skip
    """Write a heading and rows atomically; real numbers have 12 significant digits.

    All rows of an array (n, m) of numbers are formatted at once. With `names`, texts that repeat from row to row follow the
    first `before` numbers of each row.
    """
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heading)
        if isinstance(rows, np.ndarray):
            numbers = ["%.12g"] * rows.shape[1]
            lines = [",".join([*numbers[:before], _cell(name), *numbers[before:]]) for name in names] or [",".join(numbers)]
            text = "".join(f"{line}\n" for line in lines) * (len(rows) // len(lines))
            file.write(text % tuple(rows.ravel().tolist()))
            return
        writer.writerows([f"{value:.12g}" if isinstance(value, float) else value for value in row] for row in rows)


def _cell(text: str) -> str:
    """Text as a cell of a format."""
    found = io.StringIO()
    csv.writer(found, lineterminator="").writerow([text])
    return found.getvalue().replace("%", "%%")
