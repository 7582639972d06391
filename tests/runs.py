"""Runs of cases given by their text, for tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fsm.case.loading.load_case import load_case
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.run.run_case import run_case


def run(folder: Path, text: str, *overrides: str) -> tuple[Solution, dict[str, Any]]:
    """Results and summary of a case; its results are in the subfolder "out"."""
    folder.mkdir(exist_ok=True)
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    summary = run_case(load_case(path, overrides), folder / "out", progress=False)
    return read_solution(folder / "out" / "result.h5"), summary
