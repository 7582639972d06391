"""Kills (kill -9) of `fsm run`, `fsm table` and `fsm calibrate` at random moments; checks of their files."""

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
from fsm.results.checkpoint_file import read_checkpoint
from fsm.results.store import part_path, read_solution

__all__ = ["KINDS", "Found", "kill_many"]

CASES = Path(__file__).parents[2] / "folding_cases"
LONGEST_LOSS = 5.0
"""Seconds of work of `run` and `table` that a kill may cost."""
_LOOK = 0.01
"""Seconds between looks at what a process has written."""


@dataclass
class Found:
    """Result of a number of kills.

    Attributes
    ----------
    kills, finished : int
        Numbers of killed processes, and of processes that had finished before.
    faults : texts, one for each lost or damaged file
    losses : s
        Work lost by each kill of an unfinished solve: the time since its last checkpoint. A checkpoint is written only
        after all earlier records are in the results file, so the results file loses no more than this.
    whole : s
        Duration of the command without a kill, s.
    """

    kills: int = 0
    finished: int = 0
    faults: list[str] = field(default_factory=list)
    losses: list[float] = field(default_factory=list)
    whole: float = 0.0

    @property
    def worst_loss(self) -> float:
        """Largest loss of all kills, s."""
        return max(self.losses, default=0.0)


def kill_many(kind: str, kills: int, seed: int, folder: Path) -> Found:
    """Start a command repeatedly with --resume, and kill it at random moments, until a number of kills is reached.

    Three of four moments are counted from the start of the solve; on a busy machine most kills would otherwise hit the start
    of Python.
    """
    chance, found, out = random.Random(f"{kind} {seed}"), Found(), folder / "out"
    command, longest = KINDS[kind](folder / "whole")
    begun = time.monotonic()
    subprocess.run(command, check=True, capture_output=True)
    found.whole = time.monotonic() - begun
    command, longest = KINDS[kind](out)
    reached: dict[Path, int] = {}
    while found.kills < kills:
        watch = _Watch(out)
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        moment, solving = chance.uniform(0.0, longest or 1.2 * found.whole), bool(longest) and chance.random() < 0.75
        begun = time.monotonic()
        while process.poll() is None and time.monotonic() - begun < moment:
            watch.look()
            if solving and not watch.begun:
                begun = time.monotonic()
            time.sleep(_LOOK)
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
            found.kills += 1
            found.losses += watch.losses()
        else:
            found.finished += 1
        _, errors = process.communicate()  # until the last of its processes has ended
        faults = _broken(out)
        if process.returncode not in (0, -signal.SIGKILL):
            faults.append(f"ended with {process.returncode}: {errors.strip()[-300:]}")
        before, reached = reached, _reached(out)
        faults += [f"{at.relative_to(out)} is back at step {reached[at]} from {before[at]}" for at in _back(before, reached)]
        if process.returncode == 0:
            faults += _differences(out, folder / "whole")
            shutil.rmtree(out)
            reached = {}
        found.faults += [f"{kind}, kill {found.kills}: {text}" for text in faults]
    return found


class _Watch:
    """Checkpoints of unfinished solves that a process has written since its start."""

    def __init__(self, out: Path) -> None:
        self.out, self.since = out, time.time()
        self.begun: dict[Path, float] = {}

    def look(self) -> None:
        """Record which solves have begun: a solve first opens its results file."""
        for part in self.out.rglob("result.part.h5"):
            if part.parent not in self.begun and (at := _written(part)) > self.since:
                self.begun[part.parent] = at

    def losses(self) -> list[float]:
        """Time since the last checkpoint, or else since the start of the solve, of every unfinished solve, s."""
        self.look()
        now = time.time()
        going = [folder for folder in self.begun if (folder / "result.part.h5").exists()]
        return [now - max(self.begun[folder], _written(folder / "checkpoint.h5")) for folder in going]


def _written(file: Path) -> float:
    """Time of the last write to a file; 0 if the file does not exist."""
    try:
        return file.stat().st_mtime
    except FileNotFoundError:
        return 0.0


def _reached(out: Path) -> dict[Path, int]:
    """Step number of every checkpoint."""
    return {file: int(read_checkpoint(file)[1]["steps"]) for file in out.rglob("checkpoint.h5")}


def _back(before: dict[Path, int], reached: dict[Path, int]) -> list[Path]:
    """Checkpoints whose step is earlier than before the last kill."""
    return [file for file in before if file in reached and reached[file] < before[file]]


def _run(out: Path) -> tuple[list[str], float]:
    """A strip in motion, whose solve takes about ten seconds."""
    case = str(CASES / "strip_pull/case.toml")
    sets = ["strip.segments_per_panel=4", "drive.0.travel=40 mm", "save.every=0.1 mm"]
    sets += ["solve.method=generalized-alpha", "solve.rtol=1e-8"]
    options = [word for text in sets for word in ("--set", text)]
    return [sys.executable, "-m", "fsm", "run", case, "--out", str(out), "--resume", "--quiet", *options], 8.0


def _table(out: Path) -> tuple[list[str], float]:
    table = str(CASES / "strip_pull/table.csv")
    sets = ["strip.segments_per_panel=4", "drive.0.travel=20 mm", "save.every=0.5 mm"]
    options = [word for text in sets for word in ("--set", text)]
    command = [sys.executable, "-m", "fsm", "table", table, "--out", str(out), "--resume", "--quiet"]
    return [*command, "--workers", "2", *options], 6.0


def _calibrate(out: Path) -> tuple[list[str], float]:
    data = str(CASES / "strip_hinge/hinge.csv")
    return [sys.executable, "-m", "fsm", "calibrate", "crease", data, "--out", str(out), "--quiet"], 0.0


KINDS: dict[str, Callable[[Path], tuple[list[str], float]]] = {"run": _run, "table": _table, "calibrate": _calibrate}
"""Command that writes to a folder, and the seconds it may go on for; 0: as long as it takes, nothing is kept on the way."""


def _differences(out: Path, whole: Path) -> list[str]:
    """Differences of curves and numbers between a run that was killed repeatedly and an uninterrupted run."""
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
    """Faults in a folder of results."""
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
    """Read a file; an incomplete file raises an error."""
    if file.suffix == ".json":
        json.loads(file.read_text(encoding="utf-8"))
    elif file.name == part_path("result.h5").name:
        solution = read_solution(file)
        if not np.all(np.diff(solution.time) > 0.0) or not all(map(math.isfinite, solution.force.ravel())):
            raise ValueError("records out of order or not finite")
    elif file.name == "checkpoint.h5":
        read_checkpoint(file)
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
