"""kill -9 at random moments, in `fsm run`, `fsm table` and `fsm calibrate`, and what is left."""

from __future__ import annotations

import json
import math
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fsm.errors import CaseError
from fsm.results.store import part_path, read_solution

__all__ = ["KINDS", "Found", "kill_many"]

CASES = Path(__file__).parents[2] / "folding_cases"
LONGEST_LOSS = 5.0
"""Seconds of work that a kill may cost."""


@dataclass
class Found:
    """What a number of kills came to.

    Attributes
    ----------
    kills, finished : int
        Processes killed, and those that were done before.
    faults : texts, one for everything that was lost or broken
    worst_loss : s
        Longest time between the last flush and a kill.
    """

    kills: int = 0
    finished: int = 0
    faults: list[str] = field(default_factory=list)
    worst_loss: float = 0.0


def kill_many(kind: str, kills: int, seed: int, folder: Path) -> Found:
    """Start a command again and again with --resume, and kill it at a random moment, until so many kills are done."""
    command, longest = KINDS[kind](folder / "whole")
    subprocess.run(command, check=True, capture_output=True)
    command, longest = KINDS[kind](folder / "out")
    chance, found = random.Random(f"{kind} {seed}"), Found()
    out = folder / "out"
    while found.kills < kills:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        begun, since = time.monotonic(), time.time()
        moment = chance.uniform(0.0, longest)
        while process.poll() is None and time.monotonic() - begun < moment:
            time.sleep(0.002)
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
            found.kills += 1
        else:
            found.finished += 1
        _, errors = process.communicate()
        if process.returncode not in (0, -signal.SIGKILL):
            found.faults.append(f"{kind}: ended with {process.returncode}: {errors.strip()[-300:]}")
        if out.is_dir():
            found.worst_loss = max(found.worst_loss, _loss(out, since))
            found.faults += [f"{kind}, kill {found.kills}: {text}" for text in _broken(out)]
        if process.returncode == 0:
            found.faults += [f"{kind}, kill {found.kills}: {text}" for text in _differences(out, folder / "whole")]
            shutil.rmtree(out)
    return found


def _run(out: Path) -> tuple[list[str], float]:
    """A strip in motion, of about ten seconds."""
    case = str(CASES / "strip_pull/case.toml")
    sets = ["strip.segments_per_panel=4", "drive.0.travel=40 mm", "save.every=0.1 mm"]
    sets += ["solve.method=generalized-alpha", "solve.rtol=1e-8"]
    options = [word for text in sets for word in ("--set", text)]
    return [sys.executable, "-m", "fsm", "run", case, "--out", str(out), "--resume", "--quiet", *options], 15.0


def _table(out: Path) -> tuple[list[str], float]:
    table = str(CASES / "strip_pull/table.csv")
    sets = ["strip.segments_per_panel=4", "drive.0.travel=20 mm", "save.every=0.5 mm"]
    options = [word for text in sets for word in ("--set", text)]
    command = [sys.executable, "-m", "fsm", "table", table, "--out", str(out), "--resume", "--quiet"]
    return [*command, "--workers", "2", *options], 12.0


def _calibrate(out: Path) -> tuple[list[str], float]:
    data = str(CASES / "strip_hinge/hinge.csv")
    return [sys.executable, "-m", "fsm", "calibrate", "crease", data, "--out", str(out), "--quiet"], 8.0


KINDS: dict[str, Callable[[Path], tuple[list[str], float]]] = {"run": _run, "table": _table, "calibrate": _calibrate}


def _loss(out: Path, since: float) -> float:
    """Seconds between the last flush of an unfinished run and now; 0 where none was begun since the program started."""
    flushed = [part.stat().st_mtime for part in out.rglob("result.part.h5")]
    return max((time.time() - at for at in flushed if at > since), default=0.0)


def _differences(out: Path, whole: Path) -> list[str]:
    """Where curves and numbers of a run that was killed again and again differ from those of one that was not."""
    different = []
    for file in whole.rglob("*.csv"):
        other = out / file.relative_to(whole)
        if file.name != "summary.csv" and (not other.is_file() or other.read_bytes() != file.read_bytes()):
            different.append(f"{file.relative_to(whole)} is not that of an uninterrupted run")
    for file in whole.rglob("calibration.json"):
        one, two = (json.loads(path.read_text(encoding="utf-8"))["quantities"] for path in (file, out / file.name))
        if one != two:
            different.append("the quantities are not those of an uninterrupted run")
    return different


def _broken(out: Path) -> list[str]:
    """What is not as it should be in a folder of results."""
    faults = []
    for file in sorted(path for path in out.rglob("*") if path.is_file()):
        if file.name.startswith("."):
            continue  # being written
        try:
            _whole(file)
        except (CaseError, ValueError, OSError, SyntaxError) as error:
            faults.append(f"{file.relative_to(out)}: {str(error)[:200]}")
    for summary in out.rglob("summary.json"):
        if not (summary.parent / "result.h5").is_file():
            faults.append(f"{summary.relative_to(out)} without result.h5")
    return faults


def _whole(file: Path) -> None:
    """Read a file; an error if it is not whole."""
    if file.suffix == ".json":
        json.loads(file.read_text(encoding="utf-8"))
    elif file.name == part_path("result.h5").name:
        solution = read_solution(file)
        if not np.all(np.diff(solution.time) > 0.0) or not all(map(math.isfinite, solution.force.ravel())):
            raise ValueError("records out of order or not finite")
    elif file.name == "result.h5":
        if not read_solution(file).summary:
            raise ValueError("a finished file without a summary")
    elif file.suffix == ".csv":
        text = file.read_text(encoding="utf-8")
        rows = text.splitlines()
        if not text.endswith("\n") or len({row.count(",") for row in rows if not row.startswith("#")}) > 1:
            raise ValueError("a row is cut off")
    elif file.suffix in (".png", ".gif"):
        from PIL import Image

        with Image.open(file) as picture:
            picture.load()
