"""Store of a table: the rows with the hash of each complete case, and the results of those that are finished.

The store is an SQLite file, which the coordinator of a table alone writes, in one transaction for each row. A kill at any
moment leaves a store with all rows that were finished before. A row takes 0.5 to 1 kB: results are compressed with the first
one as dictionary. Results are read one after the other, so a table of 100,000 rows needs no memory for them.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self, overload

from fsm.case.loading.table import STORE
from fsm.errors import CannotWrite, CaseError
from fsm.io.provenance import fsm_version

_ROWS = "CREATE TABLE IF NOT EXISTS rows (number INTEGER PRIMARY KEY, name TEXT, hash TEXT, result BLOB)"
_TABLES = f"CREATE TABLE IF NOT EXISTS about (key TEXT PRIMARY KEY, value TEXT); {_ROWS};"
_FINISHED = "SELECT number FROM rows WHERE result NOT NULL ORDER BY number"
_DICTIONARY = "first result"
"""Key of the text with which results are compressed."""

_REMEDY = "check free space and write permission"


class Entry(NamedTuple):
    """Row of a table: its number in the whole table, its name, and the hash of its case."""

    number: int
    name: str
    hash: str


def hash_of(case: str) -> str:
    """Hash of a complete case, given by its own hash, and of the version of fsm."""
    return hashlib.sha256(f"{fsm_version()}\n{case}".encode()).hexdigest()[:32]


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
        self.path, self._closed = folder / STORE, False
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
                self._dictionary = self._first_result()
            except BaseException:
                self._file.close()  # else this process keeps the file locked
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._file.close()
        self._closed = True

    def _first_result(self) -> bytes:
        found = self._file.execute("SELECT value FROM about WHERE key = ?", (_DICTIONARY,)).fetchone()
        return found[0].encode() if found else b""

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
            old = (
                {(entry.name, entry.hash): entry.number for entry, row in self.results() if not row.get("error")}
                if keep
                else {}
            )
            kept = [(entry, old.get((entry.name, entry.hash))) for entry in entries]
            with self._change():
                self._file.execute("ALTER TABLE rows RENAME TO earlier")
                self._file.execute(_ROWS)
                take = "INSERT INTO rows VALUES (?, ?, ?, (SELECT result FROM earlier WHERE number = ?))"
                self._file.executemany(take, ((*entry, number) for entry, number in kept))
                self._file.execute("DROP TABLE earlier")
                put = "INSERT OR REPLACE INTO about VALUES (?, ?)"
                self._file.executemany(put, [(key, json.dumps(value)) for key, value in about.items()])
        return {entry.number for entry, number in kept if number is not None}

    def drop(self, numbers: Sequence[int]) -> None:
        """Forget the results of some rows."""
        with self._errors(), self._change():
            self._file.executemany("UPDATE rows SET result = NULL WHERE number = ?", [(number,) for number in numbers])

    def put(self, number: int, row: Mapping[str, Any]) -> None:
        """Store the result of a row."""
        text = json.dumps(row)
        with self._errors():
            if not self._dictionary:
                self._file.execute("INSERT INTO about VALUES (?, ?)", (_DICTIONARY, text))
                self._dictionary = text.encode()
            packing = zlib.compressobj(zdict=self._dictionary)
            packed = packing.compress(text.encode()) + packing.flush()
            self._file.execute("UPDATE rows SET result = ? WHERE number = ?", (packed, number))

    def about(self) -> dict[str, Any]:
        """What is known of the whole table."""
        with self._errors():
            found = self._file.execute("SELECT key, value FROM about WHERE key != ?", (_DICTIONARY,))
            return {key: json.loads(value) for key, value in found}

    def results(self) -> Iterator[tuple[Entry, dict[str, Any]]]:
        """Finished rows, in the order of the table, each read when it is asked for."""
        with self._errors():
            found = self._file.execute("SELECT number, name, hash, result FROM rows WHERE result NOT NULL ORDER BY number")
            for number, name, hashed, result in found:
                yield Entry(number, name, hashed), self._unpacked(result)

    def rows(self) -> StoredRows:
        """Results of the finished rows, in the order of the table."""
        with self._errors():
            numbers = [number for (number,) in self._file.execute(_FINISHED)]
        return StoredRows(self, numbers)

    def results_of(self, numbers: Iterable[int]) -> Iterator[dict[str, Any]]:
        """Results of some finished rows; a closed store is opened to read."""
        with self._errors(), self._open_file() as file:
            for number in numbers:
                (result,) = file.execute("SELECT result FROM rows WHERE number = ?", (number,)).fetchone()
                yield self._unpacked(result)

    @contextmanager
    def _open_file(self) -> Iterator[sqlite3.Connection]:
        if not self._closed:
            yield self._file
            return
        with closing(sqlite3.connect(f"{self.path.resolve().as_uri()}?mode=ro", uri=True)) as file:
            yield file

    def _unpacked(self, result: bytes) -> dict[str, Any]:
        text = zlib.decompressobj(zdict=self._dictionary).decompress(result)
        row: dict[str, Any] = json.loads(text)
        return row

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


class StoredRows(Sequence[dict[str, Any]]):
    """Rows of a table, each read from its store when it is asked for, also after the store is closed.

    Parameters
    ----------
    store : RowStore
    numbers : sequence of int
        Numbers of the rows in the store.
    """

    def __init__(self, store: RowStore, numbers: Sequence[int]) -> None:
        self._store, self._numbers = store, numbers

    def __len__(self) -> int:
        return len(self._numbers)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return self._store.results_of(self._numbers)

    @overload
    def __getitem__(self, which: int) -> dict[str, Any]: ...

    @overload
    def __getitem__(self, which: slice) -> StoredRows: ...

    def __getitem__(self, which: int | slice) -> dict[str, Any] | StoredRows:
        if isinstance(which, slice):
            return StoredRows(self._store, self._numbers[which])
        return next(self._store.results_of([self._numbers[which]]))
