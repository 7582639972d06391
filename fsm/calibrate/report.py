"""Result of a calibration: a printed table, `calibration.json`, plots, and files for use in cases.

A kind of calibration is a function ``(data: Path, options: Options) -> Calibration``. The function computes everything
before any file is written. The files appear together: after an error the folder is unchanged.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from fsm.io.atomic_write import file_to_replace
from fsm.io.json_values import finite_values
from fsm.io.provenance import provenance

REPORT = "calibration.json"
"""Name of the report file."""
_TABLE_UNITS = {
    "m": (1e3, "mm"),
    "rad": (180.0 / math.pi, "deg"),
    "N m": (1e3, "N mm"),
    "N m/rad": (1e3, "N mm/rad"),
    "N/m": (1e-3, "N/mm"),
    "N m^2": (1e6, "N mm^2"),
    "J": (1e3, "mJ"),
    "Pa": (1e-9, "GPa"),
}
"""Factor and name of the unit in the printed table, by SI unit."""


@dataclass(frozen=True)
class Options:
    """Options of the command line for every kind of calibration.

    Attributes
    ----------
    fit : "smooth", "interpolate" or "monotone"
        Kind of curve through measured points.
    without_flagged : bool
        Exclude flagged rows.
    level : -
        Confidence level of intervals.
    seed : int
        Seed of all random numbers.
    progress : bool
        Show the progress of long work.
    """

    fit: str = "smooth"
    without_flagged: bool = False
    level: float = 0.95
    seed: int = 0
    progress: bool = False


@dataclass(frozen=True)
class Quantity:
    """Calibrated number with its interval.

    Attributes
    ----------
    name : str
    value : float, SI
    unit : str
        SI unit.
    low, high : float or None
        Lower and upper end of the confidence interval, if known.
    standard_error : float or None
    """

    name: str
    value: float
    unit: str
    low: float | None = None
    high: float | None = None
    standard_error: float | None = None


@dataclass
class Calibration:
    """Complete result of a calibration.

    Attributes
    ----------
    kind : str
    sources : files that were read
    quantities : rows of the printed table
    numbers : further contents of `calibration.json`: numbers, lists, arrays, texts
    lines : lines below the printed table
    warnings : warnings about the data and the fit
    plots, files : (name, function that writes the file to a path)
    """

    kind: str
    sources: tuple[Path, ...]
    quantities: list[Quantity] = field(default_factory=list)
    numbers: dict[str, Any] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    plots: list[tuple[str, Callable[[Path], None]]] = field(default_factory=list)
    files: list[tuple[str, Callable[[Path], None]]] = field(default_factory=list)


def quantities_of(names: Sequence[str], units: Sequence[str], estimate: Any, level: float) -> list[Quantity]:
    """Quantities with intervals from the parameters of a `fsm.calibrate.uncertainty.Estimate`."""
    bounds, error = estimate.interval(level), estimate.standard_error
    return [
        Quantity(name, float(value), unit, float(low), float(high), float(spread))
        for name, unit, value, (low, high), spread in zip(names, units, estimate.values, bounds, error, strict=True)
    ]


def table_lines(found: Calibration, options: Options) -> list[str]:
    """Lines of the printed table: name, value with unit, interval; then further lines and warnings."""
    rows = [("quantity", "value", f"{100 * options.level:g} % interval")]
    for quantity in found.quantities:
        factor, unit = _TABLE_UNITS.get(quantity.unit, (1.0, quantity.unit))
        low, high = quantity.low, quantity.high
        between, digits = "", 5
        if low is not None and high is not None:
            digits = _digits(quantity.value, 0.5 * (high - low))
            between = f"{factor * low:.{digits}g} to {factor * high:.{digits}g}"
        rows.append((quantity.name, f"{factor * quantity.value:.{digits}g} {unit}".strip(), between))
    widths = [max(len(row[k]) for row in rows) for k in range(3)]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return [*lines, *found.lines, *(f"warning  {text}" for text in found.warnings)]


def _digits(value: float, half_width: float) -> int:
    """Significant digits of the value that resolve two digits of the half width of its interval."""
    if half_width <= 0.0 or value == 0.0 or not math.isfinite(half_width):
        return 5
    return min(max(math.ceil(math.log10(abs(value) / half_width)) + 2, 3), 9)


def write_calibration(found: Calibration, folder: Path, options: Options) -> list[Path]:
    """Write `calibration.json`, plots and files into a folder.

    All files are first written to a temporary folder next to it, so an error leaves the folder unchanged.

    Returns
    -------
    list of Path
        Paths of the written files.
    """
    temporary = folder.parent / f".{folder.name}.part"
    shutil.rmtree(temporary, ignore_errors=True)  # an earlier calibration that was killed may have left this folder
    temporary.mkdir(parents=True)
    try:
        for name, write in [*found.files, *found.plots]:
            write(temporary / name)
        text = json.dumps(finite_values(_contents(found, options)), indent=2, ensure_ascii=False, allow_nan=False)
        (temporary / REPORT).write_text(text + "\n", encoding="utf-8")
        folder.mkdir(exist_ok=True)
        names = [*(name for name, _ in [*found.files, *found.plots]), REPORT]
        (folder / REPORT).unlink(missing_ok=True)  # the report is moved last, so a folder with a report is complete
        for name in names:
            os.replace(temporary / name, file_to_replace(folder / name))
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return [folder / name for name in names]


def _contents(found: Calibration, options: Options) -> dict[str, Any]:
    return {
        "kind": found.kind,
        "quantities": [asdict(quantity) for quantity in found.quantities],
        **found.numbers,
        "warnings": found.warnings,
        "data": [{"file": str(file), "sha256": _digest(file)} for file in _with_toml_files(found.sources)],
        "options": {key: value for key, value in asdict(options).items() if key != "progress"},
        "provenance": provenance(),
    }


def _with_toml_files(sources: Sequence[Path]) -> list[Path]:
    """Data files, each followed by the TOML file of the same name if it exists."""
    files = [other for file in sources for other in (file, file.with_suffix(".toml")) if other == file or other.is_file()]
    return list(dict.fromkeys(files))


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()
