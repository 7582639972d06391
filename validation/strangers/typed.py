"""Quantities as engineers write them: a few digits and a unit."""

from __future__ import annotations

import math

__all__ = ["deg", "digits", "gpa", "mm", "newton", "nice", "pascal", "stiffness_text", "um"]


def digits(value: float, count: int = 3) -> float:
    """A number rounded to a number of significant digits."""
    return float(f"{value:.{count}g}")


def nice(value: float) -> float:
    """A number rounded to two significant digits, as sizes are chosen."""
    return digits(value, 2)


def _text(value: float, count: int) -> str:
    return f"{digits(value, count):.12g}"


def mm(metres: float, count: int = 6) -> str:
    """Millimetres."""
    return f"{_text(1e3 * metres, count)} mm"


def um(metres: float, count: int = 4) -> str:
    """Micrometres."""
    return f"{_text(1e6 * metres, count)} um"


def deg(radians: float, count: int = 4) -> str:
    """Degrees."""
    return f"{_text(math.degrees(radians), count)} deg"


def gpa(pascals: float, count: int = 3) -> str:
    """Gigapascals."""
    return f"{_text(1e-9 * pascals, count)} GPa"


def newton(force: float, count: int = 3) -> str:
    """Newtons."""
    return f"{_text(force, count)} N"


def pascal(pressure: float, count: int = 6) -> str:
    """Pascals."""
    return f"{_text(pressure, count)} Pa"


def stiffness_text(stiffness: float, count: int = 3) -> str:
    """A torsional stiffness in N mm/rad."""
    return f"{_text(1e3 * stiffness, count)} N mm/rad"
