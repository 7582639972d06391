"""Valid files from which damaged files are made: the shipped cases, small tests, and results of small runs."""

from __future__ import annotations

import functools
import math
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

import fsm.run.recorder
from fsm.case.loading.load_case import load_case
from fsm.run.run_case import run_case

__all__ = ["Seeds", "seeds"]

_CASES = Path(__file__).parents[2] / "folding_cases"
_SMALL = ["strip.segments_per_panel=2", "drive.0.travel=2 mm", "save.every=1 mm"]
_MANY = ["save.every=0.002 mm"]  # number of steps; the first checkpoint is written after some hundreds of steps
_ARRAY = ["solve.end_time=0.1", "save.interval=0.05"]


@dataclass(frozen=True)
class Seeds:
    """Texts and bytes of valid files.

    Attributes
    ----------
    cases : case files
    beside : files that cases refer to
    tables : case files with the tables that belong to them
    csv : data of every kind of calibration
    study : study of the kind "force"
    hdf5 : HDF5 files of every kind
    with_family : a case that refers to ``crease.h5``
    """

    cases: list[str]
    beside: dict[str, bytes]
    tables: list[tuple[str, list[str]]]
    csv: dict[str, list[str]]
    study: str
    hdf5: dict[str, list[bytes]]
    with_family: str


@functools.cache
def seeds() -> Seeds:
    """Read the files of the repository and solve two small cases."""
    files = sorted(_CASES.glob("*/case.toml"))
    tables = [(folder, _tables(folder)) for folder in (_CASES / "strip_pull", _CASES / "membrane_impact")]
    beside = [_CASES / "strip_pull/crease.csv", _CASES / "strip_hinge/crease.h5"]
    results, checkpoints = _solved()
    return Seeds(
        cases=[file.read_text(encoding="utf-8") for file in files],
        beside={file.name: file.read_bytes() for file in beside},
        tables=[((folder / "case.toml").read_text(encoding="utf-8"), found) for folder, found in tables],
        csv={
            "crease": [(_CASES / "strip_hinge/hinge.csv").read_text(encoding="utf-8"), _crease()],
            "relaxation": [_relaxation()],
            "bending": [_bending()],
        },
        study=(_CASES / "rotating_squares/calibration.toml").read_text(encoding="utf-8"),
        hdf5={"result": results, "checkpoint": checkpoints, "crease": [beside[1].read_bytes()]},
        with_family=(_CASES / "strip_hinge/case.toml").read_text(encoding="utf-8"),
    )


def _tables(folder: Path) -> list[str]:
    texts = [file.read_text(encoding="utf-8") for file in sorted(folder.glob("*.csv"))]
    return [text for text in texts if "case" in text[:400]]


def _crease() -> str:
    rows = ["angle (deg),moment (N mm),press_time (min),opening,repeat"]
    for press, opening, repeat in ((10, 1, 1), (10, 1, 2), (60, 1, 1), (60, 2, 1)):
        for angle in range(-20, 100, 10):
            moment = 0.1 * angle + 0.01 * press + 0.3 * math.sin(7 * angle + repeat)
            rows.append(f"{angle},{moment:.4f},{press},{opening},{repeat}")
    return "\n".join(rows)


def _relaxation() -> str:
    rows = [f"{100 - 4 * math.log1p(t / 10):.4f},{t}" for t in (0, 1, 3, 10, 30, 100, 300, 1000, 3000)]
    return "\n".join(["angle (deg),time (s)", *rows])


def _bending() -> str:
    rows = [f"{0.002 * k},{0.4 * k},80,40,0.3" for k in range(1, 9)]
    return "\n".join(["force (N),deflection (mm),length (mm),width (mm),thickness (mm)", *rows])


def _solved() -> tuple[list[bytes], list[bytes]]:
    """Results of a strip and of an array, and a checkpoint."""
    folder, results = Path(tempfile.mkdtemp(prefix="fsm-fuzz-")), []
    try:
        for name, overrides in (("strip_pull", _SMALL), ("scissor_array", _ARRAY)):
            loaded = load_case(_CASES / name / "case.toml", overrides)
            run_case(loaded, folder / name, progress=False)
            results.append((folder / name / "result.h5").read_bytes())
        every, fsm.run.recorder.CHECKPOINT_EVERY = fsm.run.recorder.CHECKPOINT_EVERY, 0.0
        try:
            loaded = load_case(_CASES / "strip_pull" / "case.toml", [*_SMALL, *_MANY])
            run_case(loaded, folder / "cut", progress=_stopped)
        except KeyboardInterrupt:
            pass
        finally:
            fsm.run.recorder.CHECKPOINT_EVERY = every
        return results, [(folder / "cut" / "checkpoint.h5").read_bytes()]
    finally:
        shutil.rmtree(folder)


def _stopped(done: float) -> None:
    if done > 0.9:
        raise KeyboardInterrupt
