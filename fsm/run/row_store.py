"""Store of a table: the rows with the hash of each complete case, and the results of those that are finished.

The store is an SQLite file, which the coordinator of a table alone writes, in one transaction for each row. A kill at any
moment leaves a store with all rows that were finished before. A row takes about 0.7 kB.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import sys
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

from fsm.case.loading.table import STORE
from fsm.errors import CannotWrite, CaseError
from fsm.io.version import fsm_version

_TABLES = """
CREATE TABLE IF NOT EXISTS about (key TEXT PRIMARY KEY, value TEXT);
CREATE TABLE IF NOT EXISTS rows (number INTEGER PRIMARY KEY, name TEXT, hash TEXT, result BLOB);
"""


_REMEDY = "check free space and write permission"


class Entry(NamedTuple):
    """Row of a table: its number in the whole table, its name, and the hash of its case."""

    number: int
    name: str
    hash: str


def hash_of(text: str) -> str:
    """Hash of a complete case and of the version of fsm."""
    return hashlib.sha256(f"{fsm_version()}\n{text}".encode()).hexdigest()[:32]


class RowStore:
    """Open store of a table; a context manager.

    Parameters
    ----------
    folder : folder of the table
    make : whether to make a store that does not exist

    Raises
    ------
    CaseError
        There is no store, or the file is no store.
    CannotWrite
        The disk is full, or the user may not write there.
    """

    def __init__(self, folder: Path, make: bool = True) -> None:
        self.path = folder / STORE
        if not make and not self.path.is_file():
            raise CaseError(f"has no {STORE}: this is no folder of `fsm table`", str(folder))
        with self._errors():
            self._file = sqlite3.connect(self.path, isolation_level=None)
            try:
                # no other process writes: the folder is locked; the log of changes survives a kill
                self._file.executescript(
                    "PRAGMA locking_mode=EXCLUSIVE; PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;"
                )
                self._file.executescript(_TABLES)
            except BaseException:
                self._file.close()  # else this process keeps the file locked
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def begin(self, entries: Sequence[Entry], about: Mapping[str, Any], keep: bool) -> set[int]:
        """List the rows of a table.

        Parameters
        ----------
        entries : rows of the table
        about : what is known of the whole table
        keep : whether rows with the same name and hash keep their result, if they have one without an error

        Returns
        -------
        set of int
            Numbers of the rows that keep their result.
        """
        with self._errors():
            found = self._file.execute("SELECT name, hash, result FROM rows WHERE result NOT NULL") if keep else ()
            old = {(name, hashed): result for name, hashed, result in found if not _unpacked(result).get("error")}
            rows = [(*entry, old.get((entry.name, entry.hash))) for entry in entries]
            with self._change():
                self._file.execute("DELETE FROM rows")
                self._file.executemany("INSERT INTO rows VALUES (?, ?, ?, ?)", rows)
                self._file.executemany(
                    "INSERT OR REPLACE INTO about VALUES (?, ?)", [(key, json.dumps(value)) for key, value in about.items()]
                )
        return {number for number, _, _, result in rows if result is not None}

    def drop(self, numbers: Sequence[int]) -> None:
        """Forget the results of some rows."""
        with self._errors(), self._change():
            self._file.executemany("UPDATE rows SET result = NULL WHERE number = ?", [(number,) for number in numbers])

    def put(self, number: int, row: Mapping[str, Any]) -> None:
        """Store the result of a row."""
        packed = zlib.compress(json.dumps(row).encode())
        with self._errors():
            self._file.execute("UPDATE rows SET result = ? WHERE number = ?", (packed, number))

    def about(self) -> dict[str, Any]:
        """What is known of the whole table."""
        with self._errors():
            return {key: json.loads(value) for key, value in self._file.execute("SELECT key, value FROM about")}

    def entries(self) -> list[Entry]:
        """All rows, in the order of the table."""
        with self._errors():
            return [Entry(*row) for row in self._file.execute("SELECT number, name, hash FROM rows ORDER BY number")]

    def results(self) -> Iterator[tuple[Entry, dict[str, Any]]]:
        """Finished rows, in the order of the table."""
        with self._errors():
            found = self._file.execute("SELECT number, name, hash, result FROM rows WHERE result NOT NULL ORDER BY number")
            for number, name, hashed, result in found:
                yield Entry(number, name, hashed), _unpacked(result)

    @contextmanager
    def _change(self) -> Iterator[None]:
        """One change of the file, complete or not at all."""
        self._file.execute("BEGIN")
        try:
            yield
        except BaseException:
            if self._file.in_transaction:  # a full disk ends it
                self._file.execute("ROLLBACK")
            raise
        self._file.execute("COMMIT")

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.DatabaseError as error:
            if isinstance(error, sqlite3.OperationalError):
                remedy = "close the other program that reads it" if "locked" in str(error) else _REMEDY
                raise CannotWrite(f"{self.path}: {error}; {remedy}") from None
            raise CaseError(f"is no store of a table ({error}); delete it, or give another folder", str(self.path)) from None


def _unpacked(result: bytes) -> dict[str, Any]:
    row: dict[str, Any] = json.loads(zlib.decompress(result), object_pairs_hook=_with_shared_keys)
    return row


def _with_shared_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Dictionary whose keys all rows share, which saves half of the memory of a long table."""
    return {sys.intern(key): value for key, value in pairs}
