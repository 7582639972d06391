"""Folders of `validation/` on the page, in their order, and the other folders with the reason for their absence."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).parents[1]

FIRST = (
    "closed_forms",
    "papers",
    "strip_trial",
    "quasi_static",
    "methods",
    "rotating_squares",
    "membrane",
    "sheets",
    "scissor",
    "contact",
)
"""The order of the page; others follow by name."""

NOT_IN_GALLERY = {
    "benchmarks": "run times, which depend on the machine and have no reference: make bench",
    "stress": "a campaign of thousands of scenes with a summary of its own: python -m validation.stress",
    "strangers": "a campaign of 1500 cases with a summary of its own: python -m validation.strangers",
    "intervals": "a campaign of 200 synthetic calibrations with a summary of its own: python -m validation.intervals",
    "fuzz": "broken files by thousands, with a summary of its own: python -m validation.fuzz",
    "faults": "kills and full disks, with a summary of its own: python -m validation.faults",
    "errors": "a campaign of random cases that compares stated errors with real ones: python -m validation.errors",
    "mutants": "faults put in on purpose, which the tests and this page must catch: python -m validation.mutants",
    "kirigami": "a prediction whose measured curve is not used here: python -m validation.kirigami.predict",
    "gallery": "the gallery itself",
}
"""Folders without checks on the page, each with its reason."""


def folders() -> list[str]:
    """Folders with a README, whose modules yield checks."""
    there = sorted(path.parent.name for path in ROOT.glob("*/README.md"))
    kept = [name for name in there if name not in NOT_IN_GALLERY]
    return sorted(kept, key=place_on_page)


def place_on_page(folder: str) -> tuple[int, str]:
    """Sort key of folders."""
    return (FIRST.index(folder) if folder in FIRST else len(FIRST), folder)


def checks_of(folder: str) -> ModuleType:
    """The module of a folder that has `TITLE` and `PARTS`: gallery.py, or else check.py."""
    name = "gallery" if (ROOT / folder / "gallery.py").is_file() else "check"
    return import_module(f"validation.{folder}.{name}")
