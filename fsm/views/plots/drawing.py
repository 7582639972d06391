"""Selection of the style and of the file format of all figures, and of the number of processes that draw them.

The style "paper" has the sizes and letters of a printed page. The style "slide" has larger letters and thicker lines in the
same sizes.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

FORMATS = (".png", ".svg", ".pdf")
STYLES = {"paper": (1.0, 1.0), "slide": (1.4, 1.6)}
"""Factors of the sizes of letters and of the widths of lines, by the name of the style."""
_SELECTED: ContextVar[tuple[str, str]] = ContextVar("_SELECTED", default=("paper", ".png"))
_TWO: ContextVar[bool] = ContextVar("_TWO", default=False)


@contextmanager
def drawing(style: str = "paper", suffix: str = ".png", two: bool = False) -> Iterator[None]:
    """Draw all figures within the block in a style, and in the format of a suffix; see `STYLES` and `FORMATS`.

    With `two`, the figures of a result may be drawn in two processes, see `fsm.views.plots.beside`.
    """
    token, before = _SELECTED.set((style, suffix)), _TWO.set(two)
    try:
        yield
    finally:
        _SELECTED.reset(token)
        _TWO.reset(before)


def selected() -> tuple[str, str]:
    """Style and suffix, the arguments of `drawing`."""
    return _SELECTED.get()


def in_two_processes() -> bool:
    """Whether the figures of a result may be drawn in two processes."""
    return _TWO.get()


def file_format() -> str:
    """Suffix of the figures."""
    return selected()[1]


def points(size: float) -> float:
    """Size of letters, points, from the size in the style of a paper."""
    return size * STYLES[selected()[0]][0]


def line_width(width: float) -> float:
    """Width of a line, points, from the width in the style of a paper."""
    return width * STYLES[selected()[0]][1]
