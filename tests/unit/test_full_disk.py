"""Full disks: one line that names the file, and nothing that was finished is lost."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from fsm.errors import CannotWrite
from fsm.io.atomic_write import atomic_write
from fsm.run.row_store import Entry, RowStore

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="files cannot be limited there")
ROWS = [Entry(number, f"row {number}", f"{number:032x}") for number in range(200)]


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """Let writing fail beyond a size, bytes, as on a full disk."""
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def run(folder: Path) -> set[int]:
    """Store all rows that the folder does not have; gives those that it had."""
    with RowStore(folder) as store:
        kept = store.begin(ROWS, {"rows": len(ROWS)}, keep=True)
        for entry in ROWS:
            if entry.number not in kept:
                store.put(entry.number, {"case": entry.name, "text": os.urandom(300).hex()})
    return kept


@pytest.mark.parametrize("size", [2_000, 30_000, 200_000])
def test_a_table_goes_on_in_its_folder_when_the_disk_has_space_again(tmp_path: Path, size: int) -> None:
    for _ in range(2):  # the second attempt is on the full disk too
        with files_of_at_most(size), pytest.raises(CannotWrite, match=r"rows\.db: .*; check free space"):
            run(tmp_path)
    kept = run(tmp_path)
    assert len(kept) < 200 and (size < 100_000 or len(kept) > 10)
    assert run(tmp_path) == set(range(200))


def test_a_full_disk_names_the_file(tmp_path: Path) -> None:
    def write() -> None:
        with atomic_write(tmp_path / "a.csv") as part:
            part.write_text("x" * 10_000)

    with files_of_at_most(1_000), pytest.raises(OSError, match=r"File too large: '.*/a\.csv'"):
        write()
    assert list(tmp_path.iterdir()) == []
