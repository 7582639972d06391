"""Export of results to other programs. Every module of this folder that uses `exporter` adds a format."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

from fsm.case.schema.units import did_you_mean
from fsm.errors import CaseError
from fsm.io.atomic_write import atomic_write
from fsm.results.solution import Solution
from fsm.views.exporters.registry import EXPORTERS, Exporter

__all__ = ["EXPORTERS", "export", "exporter_of", "numbered"]

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")


def exporter_of(to: str) -> Exporter:
    """Exporter of a format.

    Raises
    ------
    CaseError
        The format is unknown.
    """
    if to not in EXPORTERS:
        known = ", ".join(sorted(EXPORTERS))
        raise CaseError(f'unknown format "{to[:40]}"{did_you_mean(to, EXPORTERS)}; the formats are {known}', "export")
    return EXPORTERS[to]


def numbered(out: Path, name: str, count: int) -> Path:
    """File of one result out of several; the name of the file is extended by the name of the result."""
    return out if count == 1 else out.with_name(f"{out.stem}-{name}{out.suffix}")


def export(solution: Solution, to: str, out: Path, source: str = "export") -> Path:
    """Write a solution to a file of another format.

    Parameters
    ----------
    solution : Solution
    to : name of the format, a key of `EXPORTERS`
    out : file to write; its folder is created
    source : name of the result in messages

    Returns
    -------
    Path
        The file.

    Raises
    ------
    CaseError
        The format is unknown, the solution has no record or nothing that the format can show, or a package is not installed.
    """
    write = exporter_of(to).write
    if not len(solution):
        raise CaseError("the result has no record; run the case again", source)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(out) as part:
            write(solution, part)
    except CaseError as error:
        raise CaseError(error.faults, source) from None
    return out
