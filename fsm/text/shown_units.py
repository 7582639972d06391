"""Units in which texts and figures show quantities, by the size of the values. Files have SI units.

Text of the report of `fsm check`: labelled lines, and numbers with their units.

Text of motorisation margins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar


class ShownUnit(NamedTuple):
    """Factor from SI, and name of a unit."""

    factor: float
    name: str

    def text(self, value: float) -> str:
        """Value (SI) with four significant digits in this unit."""
        return f"{self.factor * value:.4g} {self.name}"


_UNITS: dict[str, tuple[str, tuple[tuple[float, float, str], ...]]] = {
    "m": ("mm", ((1e4, 1e-3, "km"), (2.0, 1.0, "m"), (0.99e-5, 1e3, "mm"), (1e-7, 1e6, "um"), (0.0, 1e9, "nm"))),
    "rad": ("deg", ((4.0 * math.pi, 0.5 / math.pi, "turns"), (0.0, 180.0 / math.pi, "deg"))),
    "N": ("N", ((1e4, 1e-3, "kN"), (1e-2, 1.0, "N"), (1e-5, 1e3, "mN"), (1e-8, 1e6, "uN"), (0.0, 1e9, "nN"))),
    "N m": (
        "N m", ((1e4, 1e-3, "kN m"), (1e-2, 1.0, "N m"), (1e-5, 1e3, "N mm"), (1e-8, 1e6, "uN m"), (0.0, 1e9, "nN m"))
    ),
    "Pa": ("Pa", ((1e8, 1e-9, "GPa"), (1e5, 1e-6, "MPa"), (1e3, 1e-3, "kPa"), (0.0, 1.0, "Pa"))),
    "J": (
        "J", ((1e6, 1e-6, "MJ"), (1e4, 1e-3, "kJ"), (1.0, 1.0, "J"), (1e-3, 1e3, "mJ"), (1e-6, 1e6, "uJ"),
              (1e-9, 1e9, "nJ"), (0.0, 1e12, "pJ")),
    ),
    "m^2": ("mm^2", ((1e6, 1e-6, "km^2"), (0.1, 1.0, "m^2"), (1e-9, 1e6, "mm^2"), (0.0, 1e12, "um^2"))),
    "m^3": (
        "litre", ((0.1, 1.0, "m^3"), (1e-5, 1e3, "litre"), (1e-8, 1e6, "ml"), (1e-12, 1e9, "mm^3"), (0.0, 1e18, "um^3"))
    ),
    "N m^2": ("N m^2", ((1.0, 1.0, "N m^2"), (1e-9, 1e6, "N mm^2"), (0.0, 1e12, "N um^2"))),
    "kg": (
        "kg", ((1.0, 1.0, "kg"), (1e-3, 1e3, "g"), (1e-6, 1e6, "mg"), (1e-9, 1e9, "ug"), (1e-12, 1e12, "ng"),
               (0.0, 1e15, "pg")),
    ),
    "s": ("s", ((1.0, 1.0, "s"), (1e-3, 1e3, "ms"), (1e-6, 1e6, "us"), (0.0, 1e9, "ns"))),
}  # fmt: skip
"""SI unit: unit of a zero, then lower bound of the size (SI), factor and name of every unit, the largest first."""

_ROUND_OFF = 1e-9
"""Size of a component relative to the largest one, below which it is round-off."""
_PER = ("s", "rad", "rad/m")
"""Denominators beside which a numerator has the units of the table."""


def shown_unit(si: str, size: float) -> ShownUnit:
    """Unit of a quantity whose largest magnitude is `size` (SI); the SI unit itself if it has no others.

    A quotient has the unit of its first factor: "m/s" as "m", "N m/rad" as "N m"; others, as "N/m", have SI units.
    """
    if si not in _UNITS:
        numerator, _, denominator = si.partition("/")
        if denominator not in _PER or numerator not in _UNITS:
            return ShownUnit(1.0, si)
        unit = shown_unit(numerator, size)
        return unit._replace(name=f"{unit.name}/{denominator}")
    of_zero, units = _UNITS[si]
    size = abs(size)
    if size == 0.0 or not math.isfinite(size):
        return next(ShownUnit(factor, name) for _, factor, name in units if name == of_zero)
    return next(ShownUnit(factor, name) for bound, factor, name in units if size >= bound)


def shown(value: float, si: str) -> str:
    """Value (SI) with four significant digits, in the unit of its size."""
    return shown_unit(si, value).text(value)


def shown_size(*lengths: float) -> str:
    """Lengths (m) of the sides of an object, in the unit of the longest; sides below a tenth of this unit have their own."""
    unit = shown_unit("m", max(lengths))
    return " x ".join(unit.text(x) if unit.factor * x >= 0.1 or x == 0.0 else shown(x, "m") for x in lengths)


def shown_range(low: float, high: float, si: str) -> str:
    """Range of values (SI) in one unit, or one value if both look the same."""
    factor, name = shown_unit(si, max(abs(low), abs(high)))
    first, last = f"{factor * low:.4g}", f"{factor * high:.4g}"
    return f"{first if first == last else f'{first} to {last}'} {name}"


def shown_points(points: Iterable[Iterable[float]], si: str = "m", between: str = ", ") -> str:
    """Vectors (SI) in one unit, that of the largest component; components of round-off are zero."""
    rows = [[float(x) for x in point] for point in points]
    size = max((abs(x) for row in rows for x in row), default=0.0)
    factor, name = shown_unit(si, size)
    texts = (", ".join(f"{factor * x if abs(x) > _ROUND_OFF * size else 0.0:.4g}" for x in row) for row in rows)
    return f"{between.join(f'({text})' for text in texts)} {name}"


def travel_text(turning: bool, travel: float) -> str:
    """Travel (m) of a drive, or turn (rad) of a drive that turns."""
    return shown(travel, "rad" if turning else "m")


def turns(summary: Mapping[str, Any]) -> bool:
    """Whether the first drive of a run turns bodies: its travel is an angle (rad), its force a moment (N m)."""
    if "drive" in summary:
        return str(summary["drive"]).endswith("(turn)")
    steps = [step for step in summary.get("step", ()) if isinstance(step, Mapping) and "drive" in step]
    return bool(steps) and str(steps[0]["drive"]).endswith("(turn)")


_LABEL = 14
_T = TypeVar("_T")


def labelled(sections: Iterable[tuple[str, Callable[[_T], Iterable[str]]]], case: _T) -> list[str]:
    """Lines of all sections, the first line of each with its label."""
    lines = []
    for label, section in sections:
        for text in section(case):
            lines.append(f"{label:<{_LABEL}}{text}")
            label = ""
    return lines


def count(number: int, one: str, many: str = "") -> str:
    """Number with a noun in singular or plural."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def triple(vector: tuple[float, float, float]) -> str:
    """Vector as text."""
    return "(" + ", ".join(f"{x:g}" for x in vector) + ")"


def material_text(young: float, poisson: float, density: float) -> str:
    """Elastic constants and density as text."""
    return f"E {shown(young, 'Pa')}, Poisson's ratio {poisson:g}, density {density:g} kg/m^3"


_LISTED = 6
"""Largest number of joints with a text each."""


def margin_texts(margins: Sequence[Mapping[str, Any]]) -> list[str]:
    """One text for each of the joints with the smallest margins, the smallest first."""
    ordered = sorted(margins, key=lambda row: float("inf") if row["margin"] is None else row["margin"])
    texts = [margin_text(row) for row in ordered[:_LISTED]]
    return [*texts, *([f"and {len(ordered) - _LISTED} larger ones"] if len(ordered) > _LISTED else [])]


def negative_margins(margins: Sequence[Mapping[str, Any]]) -> list[str]:
    """Warnings on joints that may not move."""
    negative = [row for row in margins if row["margin"] is not None and row["margin"] < 0.0]
    return [f"the motorisation margin is negative: {margin_text(row)}" for row in negative]


def margin_text(row: Mapping[str, Any]) -> str:
    """Smallest margin of a joint, with its angle and moments."""
    moments = f"available {shown(row['available'], 'N m')}, required {shown(row['required'], 'N m')}"
    margin = "no moment required" if row["margin"] is None else f"{row['margin']:.3g}"
    return f"{row['joint']} {margin} at {shown(row['angle'], 'rad')} ({moments})"
