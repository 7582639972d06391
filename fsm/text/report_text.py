"""Text of the report of `fsm check`: labelled lines, and numbers with their units."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

from fsm.text.shown_units import shown

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
