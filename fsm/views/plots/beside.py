"""Drawing of several figures on two processors: a copy of this process draws a part of them."""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress

from fsm.io.threads import processors


def draw_all(plots: Sequence[Callable[[], None]], two: bool) -> None:
    """Draw figures.

    Parameters
    ----------
    plots : functions that draw and write a figure each, the slowest first
    two : bool
        Whether a copy of this process may draw too. Only the command line may ask for this: a copy has no threads but
        one, and locks of the others would stay locked.
    """
    if not two or len(plots) < 2 or sys.platform != "linux" or processors() < 2:
        for plot in plots:
            plot()
        return
    waiting, numbers = os.pipe()  # each of the two takes the number of the next figure from this pipe
    os.write(numbers, bytes(range(len(plots))))
    os.close(numbers)
    read, write = os.pipe()  # the copy returns the numbers of its figures
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # about threads, such as that of a progress bar
        copy = os.fork()
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
        with suppress(ProcessLookupError):
            os.kill(copy, signal.SIGKILL)
        os.waitpid(copy, 0)
        os.close(waiting)
        os.close(read)
    for k in sorted({*range(len(plots))} - done):
        plots[k]()
