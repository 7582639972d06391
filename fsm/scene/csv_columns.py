"""Text files of measured columns: what a row, a cell and a heading are.

Values are separated by commas, semicolons, tabs or blanks; lines that start with ``#`` are comments. A heading names a
quantity and its unit: ``angle [deg]``, ``moment (N mm)``, ``force_N``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from fsm.errors import CaseError, Fault
from fsm.input_file import read_failure, read_input_file
from fsm.scene.units import parse_unit

__all__ = ["cells_of", "heading", "headings_of", "number_in", "separator_of", "shorten", "text_rows"]

MOST_FAULTS = 8
_HEADING = re.compile(r"\s*([A-Za-z_][\w -]*?)\s*(?:[(\[]\s*([^)\]]*?)\s*[)\]])?\s*$")
_HEADING_AMONG_BLANKS = re.compile(r"[A-Za-z_]\w*(?:\s*[(\[][^)\]]*[)\]])?")


def text_rows(file: Path, path: str, wanted: str) -> list[tuple[int, str]]:
    """Lines with something in them, with their numbers as a text editor counts them.

    Parameters
    ----------
    file : Path
    path : str
        What faults are named by.
    wanted : str
        What an empty file should have held.
    """
    try:
        raw = read_input_file(file)
    except (OSError, ValueError) as error:
        raise CaseError(Fault(path, f"cannot read {file}: {read_failure(error)}")) from None
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    if "\0" in text:
        raise CaseError(Fault(path, f"{file} is not a text file; save it as CSV"))
    lines = enumerate(text.splitlines(), start=1)
    rows = [
        (number, line) for number, line in lines if line.strip(" \t,;") and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise CaseError(Fault(path, f"{file} is empty; {wanted}"))
    return rows


def separator_of(line: str) -> str:
    """What separates the values; a blank stands for any run of blanks."""
    return next((mark for mark in (";", "\t", ",") if mark in line), " ")


def cells_of(line: str, separator: str) -> list[str]:
    """The cells of a line; empty ones at its end go."""
    if separator == " ":
        return line.split()
    cells = [cell.strip().strip('"').strip() for cell in line.split(separator)]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def headings_of(line: str, separator: str) -> list[str]:
    """The cells of a header line; between blanks, a unit in brackets belongs to the name before it."""
    return _HEADING_AMONG_BLANKS.findall(line) if separator == " " else cells_of(line, separator)


def number_in(cell: str, separator: str) -> float | None:
    """The number in a cell; a decimal comma is one where commas do not separate."""
    try:
        return float(cell if separator == "," else cell.replace(",", "."))
    except ValueError:
        return None


def heading(cell: str, names: Iterable[str]) -> tuple[str, str]:
    """Name, in small letters with underscores, and unit of a heading; no unit is an empty one.

    A unit may follow the name of one of `names` as a suffix: ``moment_N_mm``.
    """
    match = _HEADING.match(cell)
    if match is None:
        return cell, ""
    written, unit = re.sub(r"[ -]+", "_", match[1]), match[2] or ""
    name = written.lower()
    if unit or name in names:
        return name, unit
    for known in names:
        if name.startswith(f"{known}_"):
            suffix = written[len(known) + 1 :].replace("_", " ")
            try:
                parse_unit(suffix)
            except ValueError:
                continue
            return known, suffix
    return name, ""


def shorten(faults: Sequence[Fault], path: str) -> list[Fault]:
    """The first faults of a file; thousands of the same kind help nobody."""
    more = len(faults) - MOST_FAULTS
    return list(faults) if more <= 0 else [*faults[:MOST_FAULTS], Fault(path, f"and {more} more rows like these")]
