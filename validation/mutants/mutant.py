"""Mutant: one fault, which is put into a copy of the package."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

__all__ = ["Mutant", "physics_test", "unit_test"]


def unit_test(file: str, *tests: str) -> tuple[str, ...]:
    """Nodes of tests in a file of `tests/unit`."""
    return tuple(f"tests/unit/test_{file}.py::{test}" for test in tests)


def physics_test(file: str, *tests: str) -> tuple[str, ...]:
    """Nodes of tests in a file of `tests/physics`."""
    return tuple(f"tests/physics/test_{file}.py::{test}" for test in tests)


@dataclass(frozen=True)
class Mutant:
    """A fault at one place of the program.

    Attributes
    ----------
    name : description of the fault
    file : path relative to the repository
    old, new : the replaced text and its replacement; `old` occurs exactly once in the file
    guard : tests that must detect the fault and name its cause: nodes of pytest
    """

    name: str
    file: str
    old: str
    new: str
    guard: tuple[str, ...]

    def fault(self, root: Path) -> str:
        """Fault of the entry itself; empty if there is none."""
        path = root / self.file
        if not path.is_file():
            return f"{self.name}: {self.file} is not there"
        count = path.read_text(encoding="utf-8").count(self.old)
        if count != 1:
            return f"{self.name}: {self.file} has {self.old.strip()!r} {count} times; the text must be there exactly once"
        for node in self.guard:
            where, _, test = node.partition("::")
            if not (test and _defines(root / where, test)):
                return f"{self.name}: no test {node} in `make test`"
        return ""

    def changed(self, text: str) -> str:
        """Text of the file with the fault."""
        return text.replace(self.old, self.new)

    def key(self, root: Path) -> str:
        """Digest of the entry, its file and its tests; a result is valid as long as these do not change."""
        files = [self.file, *(node.partition("::")[0] for node in self.guard)]
        digest = hashlib.sha256("\0".join((self.name, self.old, self.new, *self.guard)).encode())
        for name in files:
            digest.update(b"\0" + (root / name).read_bytes())
        return digest.hexdigest()[:16]


def _defines(path: Path, test: str) -> bool:
    """Whether a file has a test that is not nightly."""
    if not path.is_file():
        return False
    before, found, _ = path.read_text(encoding="utf-8").partition(f"\ndef {test.partition('[')[0]}(")
    return bool(found) and "@pytest.mark.nightly" not in before.rpartition("\n\n")[2].splitlines()
