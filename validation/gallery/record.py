"""Checks, their criteria, and texts on references that are not compared.

A folder of `validation/` is in the gallery by a module `gallery.py` or `check.py` with a `TITLE` and `PARTS`, a dict of
functions `(place) -> iterator of Check or NotCompared`. The same functions serve the folder's own command line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

__all__ = ["Check", "NotCompared", "Part", "Place", "Reason", "against", "below", "said", "show"]

Kind = Literal["relative", "absolute", "bound", "said"]


@dataclass(frozen=True)
class Place:
    """Folder for the figures of a part, and whether the part may take long."""

    out: Path
    full: bool = False


@dataclass(frozen=True)
class Reason:
    """Reason why a check fails, and the value for which it was found; another value needs another reason.

    Attributes
    ----------
    text : why
    value : value of the check when the reason was found
    within : relative band about the value in which the reason is valid
    """

    text: str
    value: float
    within: float

    def explains(self, value: float | None) -> bool:
        """Whether the reason is valid for this value."""
        return value is not None and abs(value - self.value) <= self.within * abs(self.value)


@dataclass(frozen=True)
class Check:
    """One comparison with a reference.

    Attributes
    ----------
    name : compared quantity
    what : description of the case
    reference, value : number (or text) of the reference, and computed value
    source : where the reference comes from: paper with equation, table or figure, or closed form
    error, tolerance : the check passes if the error is finite and at most the tolerance
    kind : str
        "relative" and "absolute" errors; "bound": the value itself must be at most the tolerance; "said": a statement of a
        paper is true (error 0) or not (error 1).
    unit : unit of reference, value and, if absolute, error
    figure : figure of the computed curve with the reference
    reason : known reason of a failure, with the value for which it is known
    number : value on which a statement depends, to which its reason refers; for other kinds, the value of the check
    detail : further text on the run, for the command line and the small print
    """

    name: str
    what: str
    reference: float | str
    value: float | str
    source: str
    error: float
    tolerance: float
    kind: Kind
    figure: Path
    unit: str = ""
    reason: Reason | None = None
    detail: str = ""
    number: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.value, str):
            object.__setattr__(self, "number", self.value)
        elif self.reason is not None and self.number is None:
            raise ValueError(f"{self.name}: a statement with a reason needs the number that it hangs on")

    @property
    def passed(self) -> bool:
        return math.isfinite(self.error) and self.error <= self.tolerance

    @property
    def explained(self) -> bool:
        """Whether the check fails for a known reason that is valid for this value."""
        return not self.passed and self.reason is not None and self.reason.explains(self.number)

    @property
    def told(self) -> str:
        """Reason of the failure; empty if the check passes."""
        if self.passed:
            return ""
        if self.kind == "said":
            plain = "does not come out"
        else:
            plain = f"error {self.error:.2g}, allowed {self.tolerance:.2g}"
        if self.reason is None:
            return plain
        if self.explained:
            return f"{plain}: {self.reason.text}"
        known = f"the reason that is known is for {self.reason.value:.4g} within {100 * self.reason.within:g} %"
        return f"{plain}; not explained: {known}, this is {self.number:.4g}"


@dataclass(frozen=True)
class NotCompared:
    """Statement or number of a source that is not compared, with the reason."""

    name: str
    source: str
    reason: str


Part = Callable[[Place], Iterator[Check | NotCompared]]


def against(
    name: str,
    what: str,
    value: float,
    reference: float,
    source: str,
    figure: Path,
    *,
    rtol: float | None = None,
    atol: float | None = None,
    unit: str = "",
    reason: Reason | None = None,
    detail: str = "",
) -> Check:
    """A number compared with a reference, within a relative or an absolute tolerance (one of both)."""
    if (rtol is None) == (atol is None):
        raise ValueError("give rtol or atol")
    off = abs(float(value) - reference)
    if rtol is not None:
        error, tolerance, kind = off / abs(reference), rtol, "relative"
    else:
        error, tolerance, kind = off, float(atol or 0.0), "absolute"
    return Check(
        name,
        what,
        float(reference),
        float(value),
        source,
        float(error),
        tolerance,
        kind,
        figure,
        unit,
        reason,
        detail,  # type: ignore[arg-type]
    )


def below(
    name: str,
    what: str,
    value: float,
    allowed: float,
    source: str,
    figure: Path,
    *,
    unit: str = "",
    reason: Reason | None = None,
    detail: str = "",
) -> Check:
    """A number with an upper bound: an energy error, a scatter, the error of an order."""
    return Check(
        name,
        what,
        f"at most {allowed:g}",
        float(value),
        source,
        float(value),
        allowed,
        "bound",
        figure,
        unit,
        reason,
        detail,
    )


def said(
    name: str,
    statement: str,
    source: str,
    shown: str,
    holds: bool,
    figure: Path,
    *,
    reason: Reason | None = None,
    number: float | None = None,
    detail: str = "",
) -> Check:
    """Statement of a paper in words, the result of this program, and whether both agree."""
    error = 0.0 if holds else 1.0
    return Check(name, "", statement, shown, source, error, 0.0, "said", figure, "", reason, detail, number)


def number(value: float | str) -> str:
    """Text of a number for display."""
    return value if isinstance(value, str) else f"{value:.7g}"


def show(found: Iterable[Check | NotCompared]) -> int:
    """Print a table of the checks as they are completed; returns 1 as exit code if a check fails."""
    red = 0
    print("| check | case | value | reference | source | error | allowed | | detail |")
    print("|---" * 9 + "|")
    for check in found:
        if isinstance(check, NotCompared):
            print(f"| {check.name} | | | not compared | {check.source} | | | | {check.reason} |", flush=True)
            continue
        red += not check.passed
        numbers = "| |" if check.kind == "said" else f"| {check.error:.2e} | {check.tolerance:g} |"
        unit = f" {check.unit}" if check.unit else ""
        reference = f"{number(check.reference)} | {check.source}"
        print(
            f"| {check.name} | {check.what} | {number(check.value)}{unit} | {reference} {numbers} "
            f"{'ok' if check.passed else 'RED'} | {' '.join(filter(None, (check.told, check.detail)))} |",
            flush=True,
        )
    print(f"\n{red} red" if red else "\nall within their tolerance")
    return int(red > 0)
