"""What a calibration ends in: a short table, `calibration.json`, plots and files that cases name. All of it or nothing.

A kind of calibration is a function ``(data: Path, options: Options) -> Calibration``. It computes everything; nothing is
written before it is done, and what is written appears whole.
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

import numpy as np

from fsm.provenance import provenance

__all__ = ["Calibration", "Options", "Quantity", "quantities_of", "table_lines", "write_calibration"]

REPORT = "calibration.json"
_SHOWN = {
    "m": (1e3, "mm"),
    "rad": (180.0 / math.pi, "deg"),
    "N m": (1e3, "N mm"),
    "N m/rad": (1e3, "N mm/rad"),
    "N/m": (1e-3, "N/mm"),
    "N m^2": (1e6, "N mm^2"),
    "J": (1e3, "mJ"),
    "Pa": (1e-9, "GPa"),
}
"""Units of the printed table, with their factors."""


@dataclass(frozen=True)
class Options:
    """What a user chooses on the command line, for every kind.

    Attributes
    ----------
    fit : "smooth", "interpolate" or "monotone"
        How curves go through measured points.
    without_flagged : bool
        Leave out rows that were flagged as outliers.
    level : -
        Confidence level of intervals.
    seed : int
        Of everything drawn at random.
    progress : bool
        Show how far long work is.
    """

    fit: str = "smooth"
    without_flagged: bool = False
    level: float = 0.95
    seed: int = 0
    progress: bool = False


@dataclass(frozen=True)
class Quantity:
    """One calibrated number.

    Attributes
    ----------
    name : str
    value : float, SI
    unit : str
        SI unit.
    low, high : float
        Interval at the level of the options; absent without one.
    standard_error : float
    """

    name: str
    value: float
    unit: str
    low: float | None = None
    high: float | None = None
    standard_error: float | None = None


@dataclass
class Calibration:
    """All that a calibration found.

    Attributes
    ----------
    kind : str
    sources : files that were read
    quantities : what the table shows
    numbers : further contents of `calibration.json`: plain numbers, lists, arrays, texts
    lines : further lines to print below the table
    warnings : what the user should know before he believes a number
    plots, files : (name, function that writes it to a path)
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
    """The parameters of a `fsm.calibrate.uncertainty.Estimate` as quantities with their intervals."""
    bounds, error = estimate.interval(level), estimate.standard_error
    return [
        Quantity(name, float(value), unit, float(low), float(high), float(spread))
        for name, unit, value, (low, high), spread in zip(names, units, estimate.values, bounds, error, strict=True)
    ]


def table_lines(found: Calibration, options: Options) -> list[str]:
    """The table that is printed: name, value with its unit, interval; then warnings."""
    rows = [("quantity", "value", f"{100 * options.level:g} % interval")]
    for quantity in found.quantities:
        factor, unit = _SHOWN.get(quantity.unit, (1.0, quantity.unit))
        low, high = quantity.low, quantity.high
        between, digits = "", 5
        if low is not None and high is not None:
            digits = _digits(quantity.value, 0.5 * (high - low))
            between = f"{factor * low:.{digits}g} to {factor * high:.{digits}g}"
        rows.append((quantity.name, f"{factor * quantity.value:.{digits}g} {unit}".strip(), between))
    widths = [max(len(row[k]) for row in rows) for k in range(3)]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return [*lines, *found.lines, *(f"warning  {text}" for text in found.warnings)]


def _digits(value: float, reach: float) -> int:
    """Significant digits that show two of the interval's half."""
    if reach <= 0.0 or value == 0.0 or not math.isfinite(reach):
        return 5
    return min(max(math.ceil(math.log10(abs(value) / reach)) + 2, 3), 9)


def write_calibration(found: Calibration, folder: Path, options: Options) -> list[Path]:
    """Write `calibration.json`, the plots and the files into a folder, whole.

    Everything is made in a folder beside it first, so that an error on the way leaves nothing behind.

    Returns
    -------
    list of Path
        What was written.
    """
    beside = folder.parent / f".{folder.name}.part"
    shutil.rmtree(beside, ignore_errors=True)  # of a calibration that was killed while it wrote
    beside.mkdir(parents=True)
    try:
        for name, write in [*found.files, *found.plots]:
            write(beside / name)
        text = json.dumps(_plain(_contents(found, options)), indent=2, ensure_ascii=False, allow_nan=False)
        (beside / REPORT).write_text(text + "\n", encoding="utf-8")
        folder.mkdir(exist_ok=True)
        names = [*(name for name, _ in [*found.files, *found.plots]), REPORT]
        (folder / REPORT).unlink(missing_ok=True)  # it comes last: where it is, all that it speaks of is there
        for name in names:
            os.replace(beside / name, folder / name)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return [folder / name for name in names]


def _contents(found: Calibration, options: Options) -> dict[str, Any]:
    return {
        "kind": found.kind,
        "quantities": [asdict(quantity) for quantity in found.quantities],
        **found.numbers,
        "warnings": found.warnings,
        "data": [{"file": str(file), "sha256": _digest(file)} for file in _read_files(found.sources)],
        "options": {key: value for key, value in asdict(options).items() if key != "progress"},
        "provenance": provenance(),
    }


def _read_files(sources: Sequence[Path]) -> list[Path]:
    """The files, each with the TOML beside it if there is one."""
    beside = [other for file in sources for other in (file, file.with_suffix(".toml")) if other == file or other.is_file()]
    return list(dict.fromkeys(beside))


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _plain(value: Any) -> Any:
    """The same of what JSON knows; numbers that are not finite become null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, np.integer):
        return int(value)
    return value
