"""Result files of runs and tables by their folders."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fsm.errors import CaseError


def find_results(given: Sequence[str]) -> dict[str, Path]:
    """Result files by a short name: files, folders of runs, and folders of tables with one folder for each case.

    Raises
    ------
    CaseError
        A folder contains no result.
    """
    paths: list[Path] = []
    for text in given:
        path = Path(text)
        if not path.is_dir():
            paths.append(path)
            continue
        inside = [path / "result.h5"] if (path / "result.h5").is_file() else sorted(path.glob("*/result.h5"))
        if not inside:
            raise CaseError("is a folder without result.h5; give a results file, or the folder of a run or a table", text)
        paths += inside
    paths = list(dict.fromkeys(paths))
    return dict(zip(_short_names(paths), paths, strict=True))


def _short_names(paths: Sequence[Path]) -> list[str]:
    """Name of the folder of each result, or of the file if it is not called result.h5; equal names get a number."""
    names = [path.resolve().parent.name or "result" if path.name == "result.h5" else path.stem for path in paths]
    found: list[str] = []
    for name in names:
        number, one = 2, name
        while one in found:
            one, number = f"{name} ({number})", number + 1
        found.append(one)
    return found
