"""Drawing on two processors by copies of this process: one that prepares itself while this process still computes, and one
that draws a part of several figures.

Only the command line may ask for a copy: it has no threads but one, and locks of the others would stay locked.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, BinaryIO

from fsm.io.threads import processors

_DONE, _FAILED = b"1", b"0"
_waiting: list[tuple[BinaryIO, int]] = []
"""Requests to the copy that waits, and its replies; empty without a copy."""


def can_copy() -> bool:
    """Whether a copy of this process can run beside it."""
    return sys.platform == "linux" and processors() > 1


@contextmanager
def waiting_copy(prepare: Callable[[], Callable[[Any], None]]) -> Iterator[None]:
    """Have a copy of this process that waits for requests within the block, see `ask_copy`.

    Parameters
    ----------
    prepare : function
        The copy calls it at once, for example to import modules. It returns the function that does what is asked.
    """
    asked, requests = os.pipe()
    replies, replying = os.pipe()
    copy = _fork()
    if copy == 0:
        with suppress(BaseException):
            os.close(requests)  # so that the end of the other process ends this one
            os.setpgid(0, 0)  # an interrupt of a terminal reaches the other process only, and ends this one with its copies
            _serve(prepare(), asked, replying)
        os._exit(0)
    os.close(asked)
    os.close(replying)
    with os.fdopen(requests, "wb") as stream:
        _waiting.append((stream, replies))
        try:
            yield
        finally:
            _waiting.pop()
            os.close(replies)
            with suppress(ProcessLookupError):  # it has no copies, or has not yet begun
                os.killpg(copy, signal.SIGKILL)
            _end(copy)
            with suppress(OSError):  # a request that the copy has not read
                stream.close()


def ask_copy(request: Any) -> Callable[[], bool]:
    """Let the copy that waits do what is asked, which it receives as a pickle.

    Returns
    -------
    Function that waits for the copy; False if there is none, or if it fails. Call it before the next request.
    """
    if not _waiting:
        return lambda: False
    stream, replies = _waiting[-1]

    def done() -> bool:
        with suppress(OSError):
            return os.read(replies, 1) == _DONE
        return False

    try:
        pickle.dump(request, stream, protocol=5)
        stream.flush()
    except OSError:  # the copy has ended
        return lambda: False
    return done


def _serve(answer: Callable[[Any], None], asked: int, replying: int) -> None:
    """Answer requests until the other process closes the pipe or ends."""
    with os.fdopen(asked, "rb") as stream:
        while True:
            request, reply = pickle.load(stream), _FAILED
            with suppress(Exception):  # the other process does it again, and reports the error
                answer(request)
                reply = _DONE
            os.write(replying, reply)


def _fork() -> int:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # about threads, such as that of a progress bar
        return os.fork()


def _end(copy: int) -> None:
    with suppress(ProcessLookupError):
        os.kill(copy, signal.SIGKILL)
    os.waitpid(copy, 0)


def draw_all(plots: Sequence[Callable[[], None]], two: bool) -> None:
    """Draw figures.

    Parameters
    ----------
    plots : functions that draw and write a figure each, the slowest first
    two : bool
        Whether a copy of this process may draw too.
    """
    if not two or len(plots) < 2 or not can_copy():
        for plot in plots:
            plot()
        return
    waiting, numbers = os.pipe()  # each of the two takes the number of the next figure from this pipe
    os.write(numbers, bytes(range(len(plots))))
    os.close(numbers)
    read, write = os.pipe()  # the copy returns the numbers of its figures
    copy = _fork()
    if copy == 0:
        with suppress(BaseException):  # the other process draws the figure again, and reports the error
            while number := os.read(waiting, 1):
                plots[number[0]]()
                os.write(write, number)
        os._exit(0)
    os.close(write)
    done = set[int]()
    try:
        while number := os.read(waiting, 1):
            plots[number[0]]()
            done.update(number)
        while len(done) < len(plots) and (numbers_of_copy := os.read(read, len(plots))):
            done.update(numbers_of_copy)
    finally:
        if len(done) < len(plots):
            _end(copy)  # else it ends by itself, and the wait for its end would take 10 ms
        os.close(waiting)
        os.close(read)
    for k in sorted({*range(len(plots))} - done):
        plots[k]()
