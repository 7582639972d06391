"""Damaged files by number, each read by a process with bounded memory and time."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import random
import resource
import shutil
import signal
import tempfile
import time
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from fsm.errors import FsmError
from validation.fuzz.seeds import seeds
from validation.fuzz.targets import TARGETS

__all__ = ["CLASSES", "Line", "run_fuzz", "write_broken"]

CLASSES = ("read", "refused", "traceback", "hang", "memory", "crash")
"""Verdicts on a broken file; except for the first two, they are faults of the program."""
MEMORY = 3 * 2**30
"""Bytes of address space that a reader may take in addition to the memory of the process."""
PATIENCE = 20.0
"""Seconds of processor time for a file."""

Line = dict[str, Any]


class _TooLong(BaseException):
    """This class is no Exception, so that no reader can catch it."""


def write_broken(target: str, seed: int, number: int, folder: Path) -> Path:
    """Write damaged file `number` of a campaign into a folder."""
    return TARGETS[target].write(seeds(), folder, random.Random(f"{target} {seed} {number}"))


def run_fuzz(target: str, seed: int, count: int, keep: Path, tell: Callable[[Line], None]) -> list[Line]:
    """Let a target read `count` damaged files; files that show a fault are stored in `keep`.

    A process reads one file after the other; if a file kills it, a new process continues with the next file.
    """
    seeds()  # made once, before the processes start
    lines: list[Line] = []
    while len(lines) < count:
        here, there = multiprocessing.Pipe(duplex=False)
        process = multiprocessing.get_context("fork").Process(
            target=_reader, args=(target, seed, len(lines), count, there)
        )  # fmt: skip
        process.start()
        there.close()
        with contextlib.suppress(EOFError):
            while len(lines) < count:
                if not here.poll(10.0 * PATIENCE):
                    break
                lines.append(here.recv())
        process.kill()
        process.join()
        if len(lines) < count:
            text = f"the process ended with {process.exitcode}"
            lines.append({"target": target, "number": len(lines), "class": "crash", "what": text})
    for line in lines:
        if line["class"] not in ("read", "refused"):
            folder = keep / f"{target}-{seed}-{line['number']}"
            folder.mkdir(parents=True, exist_ok=True)
            write_broken(target, seed, line["number"], folder)
            (folder / "what.json").write_text(json.dumps(line, indent=2), encoding="utf-8")
            tell(line)
    return lines


def _reader(target: str, seed: int, first: int, count: int, to: Connection) -> None:
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
    signal.signal(signal.SIGPROF, _too_long)
    os.chdir("/")
    with open(os.devnull, "w") as nothing:
        os.dup2(nothing.fileno(), 1)
        os.dup2(nothing.fileno(), 2)
        for number in range(first, count):
            to.send(_one(target, seed, number))


def _too_long(signal: int, frame: object) -> None:
    raise _TooLong


def _one(target: str, seed: int, number: int) -> Line:
    folder = Path(tempfile.mkdtemp(prefix="fsm-fuzz-"))
    begun = time.process_time()
    line: Line = {"target": target, "number": number}
    try:
        file = write_broken(target, seed, number, folder)
        signal.setitimer(signal.ITIMER_PROF, PATIENCE)
        try:
            TARGETS[target].read(file)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        line |= {"class": "read", "what": ""}
    except FsmError as error:
        line |= {"class": "refused", "what": str(error).splitlines()[0][:200]}
    except OSError as error:  # the command line prints such errors in one line and ends with code 2
        line |= {"class": "refused", "what": str(error)[:200]}
    except MemoryError:
        line |= {"class": "memory", "what": traceback.format_exc()[-1500:]}
    except _TooLong:
        line |= {"class": "hang", "what": traceback.format_exc()[-1500:]}
    except Exception:
        line |= {"class": "traceback", "what": traceback.format_exc()[-3000:]}
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return line | {"cpu_s": round(time.process_time() - begun, 3)}
