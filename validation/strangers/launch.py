"""Commands in separate forked processes, with limits of time and memory; one of them may crash or hang without affecting the
others."""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import sys
import time
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

__all__ = ["Command", "Course", "Ended", "side_by_side"]

_MEMORY = 10 * 2**30
"""Address space that a command may have, bytes."""
_ASLEEP = 10
"""Times its processor time that a command may take on the clock."""


@dataclass(frozen=True)
class Command:
    """Arguments of `fsm`, file for its output, and bound of its processor time, s."""

    arguments: tuple[str, ...]
    said: Path
    limit: float


@dataclass(frozen=True)
class Ended:
    """Result of a command.

    Attributes
    ----------
    code : exit code, or minus the signal that ended the process; None if its time limit has passed
    said : standard output and standard error
    wall, cpu : wall time and processor time, s
    """

    code: int | None
    said: str
    wall: float
    cpu: float


Course = Generator[Command, Ended, Any]
"""Commands one after the other, each drawn up when it is known how the one before ended; returns what came of them."""


def side_by_side(courses: Iterable[Course], workers: int, run: Callable[[Command], int]) -> Generator[Any, None, None]:
    """Run commands, several at a time, and yield their results in the order in which they end.

    `run` is called in the forked process and returns its exit code. If the consumer stops early, the running processes are
    killed.
    """
    waiting = iter(courses)
    running: dict[int, tuple[Course, Command, float]] = {}
    try:
        while True:
            while len(running) < workers and (course := next(waiting, None)) is not None:
                command = next(course)
                running[_start(command, run)] = (course, command, time.perf_counter())
            if not running:
                return
            pid, status, used = os.wait4(-1, 0)
            if pid not in running:
                continue
            course, command, begun = running.pop(pid)
            try:
                following = course.send(_ended(command, status, used, begun))
            except StopIteration as done:
                yield done.value
            else:
                running[_start(following, run)] = (course, following, time.perf_counter())
    finally:
        for pid in running:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


def _ended(command: Command, status: int, used: resource.struct_rusage, begun: float) -> Ended:
    code: int | None = os.waitstatus_to_exitcode(status)
    if code in (-signal.SIGXCPU, -signal.SIGALRM):
        code = None
    said = command.said.read_text(encoding="utf-8", errors="replace") if command.said.is_file() else ""
    return Ended(code, said, time.perf_counter() - begun, used.ru_utime + used.ru_stime)


def _start(command: Command, run: Callable[[Command], int]) -> int:
    parent = os.getpid()
    pid = os.fork()
    if not pid:
        _end_with(parent)
        _child(command, run)
    return pid


def _end_with(parent: int) -> None:
    """Kill this process when its parent ends, if the system supports that."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)


def _child(command: Command, run: Callable[[Command], int]) -> NoReturn:
    code = 1
    try:
        command.said.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(command.said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        os.dup2(file, 1)
        os.dup2(file, 2)
        sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)  # noqa: SIM115
        seconds = max(1, round(command.limit))
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 10))
        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(_ASLEEP * seconds)
        code = run(command)
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)
