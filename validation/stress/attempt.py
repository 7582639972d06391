"""Solution of one case within a time limit, whatever happens."""

from __future__ import annotations

import faulthandler
import signal
import tempfile
import time
import traceback
import warnings as python_warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from fsm.analyses.choose import analysis_of
from fsm.case.loading.load_case import LoadedCase
from fsm.errors import CaseError, FsmError, raised_by_signal
from fsm.kernels import jit
from fsm.results.solution import Solution
from fsm.run.recorder import RecordedSolve
from fsm.run.run_case import run_case
from validation.stress.scenes import loaded

__all__ = ["Attempt", "attempt"]


_SMALL = 300.0
"""Bodies that double the time of a scene."""
_OF_A_SHEET = 300
"""Bodies that count for a sheet."""
_DRAWN = 4.0
"""Times the time that a scene has whose curves and pictures are written, too: it is solved twice."""


@dataclass
class Attempt:
    """Result of a case.

    Attributes
    ----------
    end : "finished", "refused", "failed" (with a message), "cut off" (it took steps until its time limit), "hang" (it took
        no step in the second half of its time), "trace" (an unexpected error)
    what : message of the run
    loaded, solution : the solved case, and the result as far as it exists
    warned : warnings of NumPy and other libraries
    cpu : s
    method : method that was used
    reached : solved fraction of the time or travel
    """

    end: str
    what: str = ""
    loaded: LoadedCase | None = None
    solution: Solution | None = None
    warned: list[str] = field(default_factory=list)
    cpu: float = 0.0
    method: str = ""
    reached: float = 0.0


class _TimeUp(BaseException):
    """The time limit of a case has passed; this class is no `Exception`, so that no other code catches it."""


def attempt(tables: dict[str, Any], limit: float, name: str = "scene", whole: bool = False) -> Attempt:
    """Solve a case.

    Parameters
    ----------
    tables : tables as in a case file
    limit : time limit for a small scene, without compilation, s of processor time
    name : name of the case in messages
    whole : whether curves and plots are written, as by `fsm run`
    """
    found = Attempt("finished")
    begun = time.process_time()
    steps: list[float] = [begun]
    with python_warnings.catch_warnings(record=True) as caught, tempfile.TemporaryDirectory() as folder:
        python_warnings.simplefilter("always")
        try:
            found.loaded = loaded(tables, name)
            limit *= (1.0 + _bodies(tables) / _SMALL) * (_DRAWN if whole else 1.0)
            with _limited(limit):
                _solve(found, name, Path(folder), steps, whole)
        except CaseError as error:
            found.end, found.what = "refused", str(error)
        except FsmError as error:
            found.end, found.what = "failed", str(error)
        except (_TimeUp, Exception) as error:
            if isinstance(raised_by_signal(error), _TimeUp):
                found.end = "cut off" if steps[-1] - begun > 0.5 * limit else "hang"
                found.what = f"{limit:.3g} s are over, the last step was taken at {steps[-1] - begun:.1f} s"
                return _closed(found, caught, begun)
            place = traceback.extract_tb(error.__traceback__)
            where = [f"{Path(frame.filename).name}:{frame.lineno}" for frame in place if "/fsm/" in frame.filename]
            found.end, found.what = "trace", f"{type(error).__name__}: {error} ({' < '.join(where[-3:][::-1])})"
    return _closed(found, caught, begun)


def _closed(found: Attempt, caught: list[python_warnings.WarningMessage], begun: float) -> Attempt:
    found.warned = sorted({f"{item.category.__name__}: {item.message}" for item in caught})
    found.cpu = time.process_time() - begun
    return found


def _compiling(frame: FrameType | None) -> bool:
    """Whether a compilation is running, which must not be interrupted."""
    while frame is not None:
        if "/numba/" in frame.f_code.co_filename or "/llvmlite/" in frame.f_code.co_filename:
            return True
        frame = frame.f_back
    return False


def _bodies(tables: dict[str, Any]) -> int:
    """Number of segments of a strip; large strips and all sheets have more time."""
    if "sheet" in tables:
        return _OF_A_SHEET
    strip = tables.get("strip", {})
    return int(strip.get("panels", 0)) * int(strip.get("segments_per_panel", 0))


def _solve(found: Attempt, name: str, folder: Path, steps: list[float], whole: bool) -> None:
    assert found.loaded is not None
    warnings: list[str] = []

    def step(fraction: float) -> None:
        steps.append(time.process_time())
        found.reached = fraction

    if whole:
        run_case(found.loaded, folder, progress=step)
        step(1.0)
    analysis = analysis_of(found.loaded.case, name, warnings)
    analysis.initialise(warnings)
    found.method = analysis.method()[0]
    solve = RecordedSolve(found.loaded, analysis, folder, False, warnings)
    found.solution = solve.run(step, time.perf_counter(), jit.compile_time())


@contextmanager
def _limited(limit: float) -> Iterator[None]:
    """Limit the processor time without compilation; a kernel that never returns ends the process at 10 times it."""
    granted = jit.compile_time()

    def over(number: int, frame: FrameType | None) -> None:
        nonlocal granted
        more, granted = jit.compile_time() - granted, jit.compile_time()
        # the alarm is repeated in case it is lost: Python ignores errors that are raised while an object is finalised
        signal.setitimer(signal.ITIMER_PROF, max(0.5, more))
        if not more and not _compiling(frame):
            raise _TimeUp

    before = signal.signal(signal.SIGPROF, over)
    faulthandler.dump_traceback_later(max(600.0, 10.0 * limit), exit=True)
    signal.setitimer(signal.ITIMER_PROF, limit)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        faulthandler.cancel_dump_traceback_later()
        signal.signal(signal.SIGPROF, before)
