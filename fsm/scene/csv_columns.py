"""Rows, cells and headings of text files with columns of measured values.

Commas, semicolons, tabs or blanks separate values. Lines that start with ``#`` are comments. A heading names a quantity and
its unit: ``angle [deg]``, ``moment (N mm)``, ``force_N``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from fsm.errors import CaseError, Fault
from fsm.input_file import read_failure, read_input_file
from fsm.scene.units import parse_unit

__all__ = ["cells_of", "first_row_faults", "heading", "headings_of", "number_in", "separator_of", "text_rows"]

MOST_FAULTS = 8
_HEADING = re.compile(r"\s*([A-Za-z_][\w -]*?)\s*(?:[(\[]\s*([^)\]]*?)\s*[)\]])?\s*$")
_HEADING_AMONG_BLANKS = re.compile(r"[A-Za-z_]\w*(?:\s*[(\[][^)\]]*[)\]])?")


def text_rows(file: Path, path: str, required: str) -> list[tuple[int, str]]:
    """Lines that are neither empty nor comments, with line numbers as in a text editor.

    Parameters
    ----------
    file : Path
    path : str
        Path in messages.
    required : str
        Required content, for the message about an empty file.

    Raises
    ------
    CaseError
        The file cannot be read, is not text, or is empty.
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
        raise CaseError(Fault(path, f"{file} is empty; {required}"))
    return rows


def separator_of(line: str) -> str:
    """Separator of the values; a blank means one blank or several."""
    return next((mark for mark in (";", "\t", ",") if mark in line), " ")


def cells_of(line: str, separator: str) -> list[str]:
    """Cells of a line, without empty cells at its end."""
    if separator == " ":
        return line.split()
    cells = [cell.strip().strip('"').strip() for cell in line.split(separator)]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def headings_of(line: str, separator: str) -> list[str]:
    """Cells of a header line; if blanks separate the cells, a unit in brackets belongs to the name before it."""
    return _HEADING_AMONG_BLANKS.findall(line) if separator == " " else cells_of(line, separator)


def number_in(cell: str, separator: str) -> float | None:
    """Number in a cell, or None; a decimal comma is accepted, unless commas separate the values."""
    try:
        return float(cell if separator == "," else cell.replace(",", "."))
    except ValueError:
        return None


def heading(cell: str, names: Iterable[str]) -> tuple[str, str]:
    """Name (lower case with underscores) and unit of a heading; the unit is empty if there is none.

    A unit may also follow one of the `names` as a suffix: ``moment_N_mm``.
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


def first_row_faults(faults: Sequence[Fault], path: str) -> list[Fault]:
    """First faults of the rows of a file, and a message with the number of the remaining faults."""
    more = len(faults) - MOST_FAULTS
    return list(faults) if more <= 0 else [*faults[:MOST_FAULTS], Fault(path, f"and {more} more rows like these")]
