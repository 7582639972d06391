"""Formats of `fsm export`. A new exporter is one file in this folder with a function that has the decorator `exporter`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from fsm.results.solution import Solution

Write = Callable[[Solution, Path], None]


class Exporter(NamedTuple):
    """Exporter of a format: its description, and its function, which writes a solution to a path."""

    text: str
    write: Write


EXPORTERS: dict[str, Exporter] = {}


def exporter(name: str, text: str) -> Callable[[Write], Write]:
    """Register a function that writes a format (a decorator).

    Parameters
    ----------
    name : name of the format, which is also the suffix of its files
    text : description for `fsm export --help`
    """

    def register(write: Write) -> Write:
        EXPORTERS[name] = Exporter(text, write)
        return write

    return register
