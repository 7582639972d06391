"""Stated errors of a run, and its differences from a reference run with much smaller cells or steps."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from fsm.analyses.comparison import Comparison, compared
from fsm.case.loading.load_case import load_tables
from fsm.case.loading.overrides import Given
from fsm.errors import EnergyAbort, NotConverged
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.run.run_case import run_case
from validation.errors.coverage import Number

__all__ = ["numbers"]

_WORDS = ("by", "positions_since")
"""Entries of a statement that are not errors."""


def _run(tables: Mapping[str, Any], changes: Mapping[str, Any]) -> Solution:
    loaded = load_tables(tables, [(key, Given(value)) for key, value in changes.items()], Path("case"))
    with tempfile.TemporaryDirectory() as folder:
        run_case(loaded, Path(folder) / "out", progress=False, figures=False)
        return read_solution(Path(folder) / "out" / "result.h5")


def numbers(tables: Mapping[str, Any], cause: str, finer: Mapping[str, Any], snaps: bool = False) -> Iterator[Number]:
    """Errors of one cause that the run of a case states, with the differences from the same case with changed keys.

    Cases that cannot be solved give no number, and with `snaps` cases whose path has no event. A statement "none: ..." says
    that all errors are zero.
    """
    try:
        own = _run(tables, {"solve.error_estimates": "all"})
        if snaps and not own.summary["events"]:
            return
        reference = _run(tables, {"solve.error_estimates": "off", **finer})
    except (NotConverged, EnergyAbort):
        return
    true = _flat(compared(Comparison("", (), safety=1.0), (own, own.summary), [reference]))
    statement = own.summary["errors"][cause]
    stated, absent = _flat(statement), 0.0 if statement["by"].startswith("none: ") else None
    for name, error in true.items():
        yield Number(name, stated.get(name, absent), error)


def _flat(errors: Any, name: str = "") -> dict[str, float]:
    """All errors of a statement by their paths."""
    if isinstance(errors, list):
        errors = dict(enumerate(errors))
    if not isinstance(errors, Mapping):
        return {name: float(errors)}
    kept = {key: value for key, value in errors.items() if key not in _WORDS and value is not None}
    return {path: e for key, value in kept.items() for path, e in _flat(value, f"{name} {key}".strip()).items()}
