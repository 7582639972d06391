"""Units in which texts and figures show results, by the size of the values. Files have SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

__all__ = ["ShownUnit", "shown_unit", "travel_text", "turns"]


class ShownUnit(NamedTuple):
    """Factor from SI, and name of a unit."""

    factor: float
    name: str

    def text(self, value: float) -> str:
        """Value (SI) with four significant digits in this unit."""
        return f"{self.factor * value:.4g} {self.name}"


_UNITS: dict[str, tuple[str, tuple[tuple[float, float, str], ...]]] = {
    "m": ("mm", ((2.0, 1.0, "m"), (0.99e-5, 1e3, "mm"), (1e-7, 1e6, "um"), (0.0, 1e9, "nm"))),
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
    "m^3": ("litre", ((0.1, 1.0, "m^3"), (1e-5, 1e3, "litre"), (1e-8, 1e6, "ml"), (0.0, 1e9, "mm^3"))),
}  # fmt: skip
"""SI unit: unit of a zero, then lower bound of the size (SI), factor and name of every unit, the largest first."""


def shown_unit(si: str, size: float) -> ShownUnit:
    """Unit of a quantity whose largest magnitude is `size` (SI); the SI unit itself if it has no others."""
    if si not in _UNITS:
        return ShownUnit(1.0, si)
    of_zero, units = _UNITS[si]
    size = abs(size)
    if size == 0.0 or not math.isfinite(size):
        return next(ShownUnit(factor, name) for _, factor, name in units if name == of_zero)
    return next(ShownUnit(factor, name) for bound, factor, name in units if size >= bound)


def travel_text(turning: bool, travel: float) -> str:
    """Travel (m) of a drive, or turn (rad) of a drive that turns."""
    return shown_unit("rad" if turning else "m", travel).text(travel)


def turns(summary: Mapping[str, Any]) -> bool:
    """Whether the first drive of a run turns bodies: its travel is an angle (rad), its force a moment (N m)."""
    if "drive" in summary:
        return str(summary["drive"]).endswith("(turn)")
    steps = [step for step in summary.get("step", ()) if isinstance(step, Mapping) and "drive" in step]
    return bool(steps) and str(steps[0]["drive"]).endswith("(turn)")
