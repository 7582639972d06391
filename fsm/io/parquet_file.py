"""Tables of numbers and texts as Parquet files."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from fsm.io.atomic_write import atomic_write


def write_parquet(path: Path, heading: Sequence[str], rows: Iterable[Iterable[Any]]) -> None:
    """Write a heading and rows atomically, if pyarrow is installed; else an earlier file is deleted.

    Columns are numbers, truth values or texts; a column with texts among its numbers is text. None is an empty cell, and so
    is an empty text among numbers.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        path.unlink(missing_ok=True)
        return
    columns: list[list[Any]] = [[] for _ in heading]
    for row in rows:
        for values, value in zip(columns, row, strict=True):
            values.append(value)
    arrays = [_column(values, pyarrow) for values in columns]
    with atomic_write(path) as part:
        parquet.write_table(pyarrow.Table.from_arrays(arrays, names=list(heading)), part, compression="zstd")


def _column(values: list[Any], pyarrow: Any) -> Any:
    """Array of a column."""
    kinds = {type(value) for value in values if value is not None and value != ""}
    numbers = [None if value == "" else value for value in values]
    if not kinds and "" in values:
        return pyarrow.array(values, pyarrow.string())
    if kinds <= {int, float}:
        return pyarrow.array(numbers, pyarrow.int64() if kinds == {int} else pyarrow.float64())
    if kinds == {bool}:
        return pyarrow.array(numbers)
    return pyarrow.array([None if value is None else str(value) for value in values])
