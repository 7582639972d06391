"""Verdict on a run: solved, or the cause of the failure."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from fsm.results.store import read_solution
from validation.sheets.self_contact import intersecting
from validation.strangers.launch import Ended

__all__ = ["CAUSES", "cause_of", "first_words", "intersections_of", "numbers_of"]

CAUSES = ("refused", "equilibrium", "steps", "not converged", "energy", "time", "internal", "crash")
"""Why a run failed.

"refused": exit code 2, the reader or the compiler; "equilibrium", "steps", "not converged": exit code 3, for want of a
stable equilibrium, by `max_steps`, and all else; "energy": exit code 5; "time": the time of a case was up; "internal":
exit code 1; "crash": ended by a signal.
"""


_PROGRESS = re.compile(r"compiling kernels|: *\d+ %, \d+ steps")


def cause_of(ended: Ended) -> str:
    """ "solved", or one of `CAUSES`."""
    if ended.code is None:
        return "time"
    if ended.code < 0:
        return "crash"
    if ended.code == 3:
        if "equilibrium" in ended.said:
            return "equilibrium"
        return "steps" if "max_steps" in ended.said else "not converged"
    return {0: "solved", 2: "refused", 5: "energy"}.get(ended.code, "internal")


def first_words(ended: Ended, folder: str) -> str:
    """The line with the error message, without the folder of the case and without progress."""
    lines = [line.strip() for line in ended.said.replace("\r", "\n").splitlines()]
    lines = [line.replace(folder, "") for line in lines if line and not _PROGRESS.search(line)]
    if ended.code is None:
        return f"{ended.cpu:.0f} s of processor time are over" + (f"; {lines[-1]}" if lines else "")
    return lines[0][:400] if lines else f"exit code {ended.code} and no word"


def numbers_of(folder: Path) -> dict[str, Any]:
    """Numbers of a summary that are stored."""
    path = folder / "summary.json"
    if not path.is_file():
        return {}
    summary = json.loads(path.read_text(encoding="utf-8"))
    names = ("method", "dof", "steps", "energy_error", "peak_force", "frequency_hz", "compile_time_s")
    found = {name: summary[name] for name in names if summary.get(name) is not None}
    events = [event["kind"] for event in summary.get("events", ())]
    return found | {"warnings": summary.get("warnings", []), "events": len(events)}


def intersections_of(folder: Path) -> dict[str, int]:
    """Number of saved states of a sheet, and of those in which facets pass through each other (IPC Toolkit); whether facets
    touch."""
    shape = read_solution(folder / "result.h5").shape
    touches = int((folder / "contact.csv").is_file())
    return {"states": len(shape), "intersecting": len(intersecting(shape)), "touches": touches} if shape.size else {}
