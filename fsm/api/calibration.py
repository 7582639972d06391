"""Calibrations in Python: numbers with intervals, figures with bands, files for cases."""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from fsm.api.picture import Picture
from fsm.calibrate.kinds import CALIBRATIONS
from fsm.calibrate.report import Calibration, Options, Quantity, table_lines, write_calibration
from fsm.errors import CaseError, NotInResult

if TYPE_CHECKING:
    Kind = Literal["crease", "relaxation", "bending", "force"]

_FITS = ("smooth", "interpolate", "monotone")


def calibrate(
    kind: Kind,
    data: str | Path,
    *,
    out: str | Path | None = None,
    fit: Literal["smooth", "interpolate", "monotone"] = "smooth",
    without_flagged: bool = False,
    level: float = 0.95,
    seed: int = 0,
    progress: bool = False,
) -> Calibrated:
    """Identify parameters and their intervals from measured data; ``fsm.calibrate`` is this function.

    Parameters
    ----------
    kind : "crease", "relaxation", "bending" or "force"
    data : str or Path
        CSV file with units in its headings, or for "force" a study (docs/calibration.md).
    out : str or Path, optional
        Folder for calibration.json, figures and files for cases; absent: nothing is written.
    fit : "smooth", "interpolate" or "monotone"
        Curves through measured points.
    without_flagged : bool
        Whether to leave out rows that are flagged as outliers.
    level : float
        Confidence level of intervals, 0.5 to 0.9999.
    seed : int
        Seed of the random numbers.
    progress : bool
        Whether to show progress on standard error.

    Raises
    ------
    CaseError
        An argument, the data or the study are faulty; nothing is written.

    Examples
    --------
    >>> import fsm
    >>> found = fsm.calibrate("crease", "folding_cases/strip_hinge/hinge.csv")
    >>> found
    Calibrated('crease': 4 quantities, 2 figures)
    >>> found["curve: mean stiffness"].unit
    'N m/rad'
    """
    if kind not in CALIBRATIONS:
        raise CaseError(f'unknown kind "{str(kind)[:40]}"; the kinds are {", ".join(CALIBRATIONS)}', "calibrate")
    if fit not in _FITS:
        raise CaseError(f'fit: unknown value "{str(fit)[:40]}"; the values are {", ".join(_FITS)}', "calibrate")
    if not 0.5 <= level <= 0.9999:
        raise CaseError(f"level: must be between 0.5 and 0.9999; it is {level:g}", "calibrate")
    module, function = CALIBRATIONS[kind].split(":")
    options = Options(fit, without_flagged, float(level), int(seed), progress)
    found = Calibrated(getattr(importlib.import_module(module), function)(Path(data), options), options)
    if out is not None:
        found.write(out)
    return found


class Calibrated:
    """Result of a calibration.

    Attributes
    ----------
    kind : str
    quantities : dict of Quantity
        Calibrated numbers by name, each with `value`, `low`, `high`, `standard_error` (SI) and `unit`.
    numbers : dict
        Further contents of calibration.json.
    warnings : list of str
    figures : tuple of str
        Names of the figures.

    Examples
    --------
    >>> import fsm
    >>> found = fsm.calibrate("crease", "folding_cases/strip_hinge/hinge.csv")
    >>> found.figures
    ('curves', 'residuals')
    >>> found.plot("curves").kind
    '.png'
    """

    def __init__(self, found: Calibration, options: Options) -> None:
        self._found, self._options = found, options
        self.kind = found.kind
        self.quantities = {quantity.name: quantity for quantity in found.quantities}
        self.numbers: dict[str, Any] = found.numbers
        self.warnings = list(found.warnings)
        self._plots = {Path(name).stem: write for name, write in found.plots}
        self.figures = tuple(self._plots)

    def __getitem__(self, name: str) -> Quantity:
        """Quantity by its name.

        Raises
        ------
        NotInResult
            There is no such quantity. The message has all names.
        """
        if name not in self.quantities:
            raise NotInResult(f'no quantity "{name}"; the quantities are {", ".join(self.quantities)}')
        return self.quantities[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.quantities)

    def __len__(self) -> int:
        return len(self.quantities)

    def plot(self, name: str | None = None, out: str | Path | None = None) -> Picture:
        """Figure with bands, for a notebook or a file; without `name` the first figure.

        Parameters
        ----------
        name : str, optional
            One of `figures`.
        out : str or Path, optional
            File to write, .png, .svg or .pdf.

        Raises
        ------
        NotInResult
            There is no such figure, or the format of `out` is unknown.
        """
        from fsm.views.plots.drawing import FORMATS

        chosen = name or next(iter(self._plots), "")
        if chosen not in self._plots:
            raise NotInResult(f'no figure "{chosen}"; the figures are {", ".join(self._plots) or "none"}')
        suffix = ".png" if out is None else Path(out).suffix.lower()
        if suffix not in FORMATS:
            raise NotInResult(f"{out}: unknown format {suffix or 'without a suffix'}; give a name with {', '.join(FORMATS)}")
        with tempfile.TemporaryDirectory(prefix="fsm-") as folder:
            path = Path(folder) / f"figure{suffix}"
            self._plots[chosen](path)
            picture = Picture(path.read_bytes(), suffix, chosen)
        if out is not None:
            picture.save(out)
        return picture

    def write(self, folder: str | Path) -> list[Path]:
        """Write calibration.json, figures and files for cases, as ``fsm calibrate``; return their paths."""
        return write_calibration(self._found, Path(folder), self._options)

    def __str__(self) -> str:
        return "\n".join(table_lines(self._found, self._options))

    def __repr__(self) -> str:
        count = len(self.warnings)
        warned = f", {count} warning{'s' if count > 1 else ''}" if count else ""
        return f"Calibrated({self.kind!r}: {len(self)} quantities, {len(self.figures)} figures{warned})"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"
