"""Tables of numbers as CSV files.

Tables of numbers and texts as Parquet files.
"""

from __future__ import annotations

import csv
import io
import itertools
from collections.abc import Callable, Iterable, Sequence
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


_BATCH = 10_000
"""Number of rows that are in memory at once."""


def write_parquet(path: Path, heading: Sequence[str], rows: Callable[[], Iterable[Sequence[Any]]]) -> None:
    """Write a heading and rows atomically, if pyarrow is installed; else an earlier file is deleted.

    Columns are numbers, truth values or texts; a column with texts among its numbers is text. None is an empty cell, and so
    is an empty text among numbers. `rows` is called twice: a long table is not in memory.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        path.unlink(missing_ok=True)
        return
    known = [set[type | None]() for _ in heading]
    for row in rows():
        for kinds, value in zip(known, row, strict=True):
            if value is not None:
                kinds.add(None if value == "" else type(value))
    types = {float: pyarrow.float64(), int: pyarrow.int64(), bool: pyarrow.bool_(), str: pyarrow.string()}
    of = [_kind(kinds) for kinds in known]
    schema = pyarrow.schema([pyarrow.field(name, types[kind]) for name, kind in zip(heading, of, strict=True)])
    with atomic_write(path) as part, parquet.ParquetWriter(part, schema, compression="zstd") as writer:
        left = iter(rows())
        while batch := list(itertools.islice(left, _BATCH)):
            cells = [_cells(values, kind) for values, kind in zip(zip(*batch, strict=True), of, strict=True)]
            columns = [pyarrow.array(values, types[kind]) for values, kind in zip(cells, of, strict=True)]
            writer.write_table(pyarrow.Table.from_arrays(columns, schema=schema))


def _kind(known: set[type | None]) -> type:
    """Type of a column from those of its values; None stands for an empty text."""
    kinds = known - {None}
    if not kinds:
        return str if known else float
    if kinds <= {int, float}:
        return int if kinds == {int} else float
    return bool if kinds == {bool} else str


def _cells(values: Sequence[Any], kind: type) -> list[Any]:
    if kind is str:
        return [None if value is None else str(value) for value in values]
    return [None if value == "" else value for value in values]
