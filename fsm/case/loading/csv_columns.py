"""Rows, cells and headings of text files with columns of measured values.

Commas, semicolons, tabs or blanks separate values. Lines that start with ``#`` are comments. A heading names a quantity and
its unit: ``angle [deg]``, ``moment (N mm)``, ``force_N``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from fsm.case.schema.units import parse_unit, to_si
from fsm.errors import CaseError, Fault
from fsm.io.input_file import read_failure, read_input_file

MOST_FAULTS = 8
_COUNTS = {2: "two", 3: "three"}
_ALIKE = 5
"""Number of further rows with the same mistake that a message names."""
_HEADING = re.compile(
    r"\s*([^\W\d][\w -]*?)\s*(?:[(\[]\s*([^)\]]*?)\s*[)\]]|(?:/|(?<=\s)in(?=\s))\s*([^()\[\]]+?))?\s*$"
)
_HEADING_AMONG_BLANKS = re.compile(r"[^\W\d]\w*(?:\s*[(\[][^)\]]*[)\]])?")
_VALUES = re.compile(r'(?<![\w`])[-+]?\d[\d.]*(?:[eE][-+]?\d+)?|"[^"]*"')
_OTHER_NAMES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("winkel", "drehwinkel", "faltwinkel", "rotation"), ("angle",)),
    **dict.fromkeys(("drehmoment", "biegemoment", "torque"), ("moment",)),
    **dict.fromkeys(("kraft", "last", "load", "zugkraft", "druckkraft", "standardkraft"), ("force",)),
    **dict.fromkeys(("weg", "verschiebung", "traversenweg", "standardweg"), ("displacement", "deflection", "travel")),
    **dict.fromkeys(("durchbiegung", "auslenkung"), ("deflection", "displacement")),
    **dict.fromkeys(("hebelarm", "hebel"), ("lever_arm",)),
    **dict.fromkeys(("wiederholung", "probe"), ("repeat",)),
    **dict.fromkeys(("zyklus", "öffnung"), ("opening",)),
    **dict.fromkeys(("länge", "laenge"), ("length",)),
    "breite": ("width",), "dicke": ("thickness",), "zeit": ("time",), "zweig": ("branch",), "presszeit": ("press_time",),
}  # fmt: skip
"""German and other common headings, with the quantities that they may mean."""


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

    The unit is in brackets, or follows a slash or the word "in" (``Kraft / N``), or follows one of the `names` as a suffix:
    ``moment_N_mm``. German names are translated.
    """
    match = _HEADING.match(cell)
    if match is None:
        return cell, ""
    if match[3] and not _is_unit(match[3]):
        match = _HEADING.match(re.sub(r"[^\w]+", "_", cell.strip()).strip("_")) or match
    written, unit = re.sub(r"[ -]+", "_", match[1]), match[2] or match[3] or ""
    name = _known(written.lower(), names)
    if unit or name in names:
        return name, unit
    for place in (place for place, mark in enumerate(written) if mark == "_"):
        known, suffix = _known(written[:place].lower(), names), written[place + 1 :].replace("_", " ")
        if known in names and _is_unit(suffix):
            return known, suffix
    return name, ""


def columns_of(
    rows: Sequence[tuple[int, str]], separator: str, names: Iterable[str]
) -> tuple[list[str], list[str], list[str], list[tuple[int, str]]]:
    """Headings of a file as written, their names and units, and the rows below; units may have a row of their own."""
    cells = headings_of(rows[0][1], separator)
    columns = [heading(cell, names) for cell in cells]
    units, body = [unit for _, unit in columns], list(rows[1:])
    below = _units_in_row(body[0][1], separator, len(cells)) if body else None
    if below is not None:
        units, body = [own or other for own, other in zip(units, below, strict=True)], body[1:]
    return cells, [name for name, _ in columns], units, body


def numbers_of(
    file: Path, body: Sequence[tuple[int, str]], columns: Sequence[tuple[str, str, str]], separator: str, system: str,
    path: str,
) -> dict[str, list[float]]:
    """Numbers in SI of the columns (name, unit as written, SI unit) of a file.

    Raises
    ------
    CaseError
        Rows without a number in each column, or units of another quantity.
    """
    found: dict[str, list[float]] = {name: [] for name, _, _ in columns}
    faults, count = [], _COUNTS.get(len(columns), str(len(columns)))
    for number, line in body:
        cells = cells_of(line, separator)
        values = [number_in(cell, separator) for cell in cells]
        if len(cells) != len(columns) or None in values:
            faults.append(Fault(path, f"{file}, line {number}: needs {count} numbers; it is `{line.strip()[:60]}`"))
            continue
        for (name, unit, si), value in zip(columns, values, strict=True):
            assert value is not None
            try:
                found[name].append(to_si(f"{value!r} {unit}" if unit else value, si, system))
            except ValueError as error:
                raise CaseError(Fault(path, f"{file}: column `{name}`: {error}")) from None
    if faults:
        raise CaseError(first_row_faults(faults, path))
    return found


def _known(name: str, names: Iterable[str]) -> str:
    """Name of the quantity that a heading means."""
    return name if name in names else next((other for other in _OTHER_NAMES.get(name, ()) if other in names), name)


def _is_unit(text: str) -> bool:
    try:
        parse_unit(text)
    except ValueError:
        return False
    return True


def _units_in_row(line: str, separator: str, width: int) -> list[str] | None:
    """Units of the columns, from a row of units below the headings; None if the row holds anything else.

    Testing machines write such rows. A column without a unit has an empty cell or ``-``.
    """
    cells = [cell.strip("[]() ") for cell in cells_of(line, separator)]
    units = [*cells, *[""] * (width - len(cells))]
    if len(units) != width or all(number_in(unit, separator) is not None for unit in units if unit):
        return None
    return units if all(unit in ("", "-", "1") or _is_unit(unit) for unit in units) else None


def first_row_faults(faults: Sequence[Fault], path: str) -> list[Fault]:
    """First faults of the rows of a file; rows with the same mistake share one line."""
    groups: dict[str, list[Fault]] = {}
    for fault in faults:
        groups.setdefault(_VALUES.sub("#", fault.message), []).append(fault)
    found = []
    for alike in groups.values():
        first, others = alike[0], [fault.path.rpartition(" ")[2] for fault in alike[1:]]
        more = f" and {len(others) - _ALIKE:,} more" if len(others) > _ALIKE else ""
        also = f" (also in row{'s' * (len(others) > 1)} {', '.join(others[:_ALIKE])}{more})" if others else ""
        found.append(Fault(first.path, first.message + also))
    more_kinds = len(found) - MOST_FAULTS
    return found if more_kinds <= 0 else [*found[:MOST_FAULTS], Fault(path, f"and {more_kinds} other mistakes")]
