"""Text of the report of `fsm check`: labelled lines, and numbers with their units."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TypeVar

__all__ = ["count", "degrees", "labelled", "material_text", "millimetres", "size_text", "stress_text", "triple"]

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


def millimetres(length: float) -> str:
    """Length as text in mm."""
    return f"{1e3 * length:.4g} mm"


def size_text(*lengths: float) -> str:
    """Size of an object as text in mm."""
    return " x ".join(map(millimetres, lengths))


def triple(vector: tuple[float, float, float]) -> str:
    """Vector as text."""
    return "(" + ", ".join(f"{x:g}" for x in vector) + ")"


def degrees(angle: float) -> str:
    """Angle as text in degrees."""
    return f"{math.degrees(angle):.4g} deg"


def stress_text(stress: float) -> str:
    """Stress as text in GPa, MPa or Pa."""
    if abs(stress) < 1e4:
        return f"{stress:.4g} Pa"
    return f"{1e-9 * stress:.4g} GPa" if stress >= 1e9 else f"{1e-6 * stress:.4g} MPa"


def material_text(young: float, poisson: float, density: float) -> str:
    """Elastic constants and density as text."""
    return f"E {stress_text(young)}, Poisson's ratio {poisson:g}, density {density:g} kg/m^3"
