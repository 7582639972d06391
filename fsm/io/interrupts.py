"""Repeated Ctrl-C counts once: the first one ends the command, which then writes a checkpoint."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

REPEAT_WINDOW = 3.0
"""Time after an interrupt during which further interrupts are ignored, s."""


@contextmanager
def ignore_repeated_interrupts() -> Iterator[None]:
    """Treat repeated interrupts within the block as one, and ignore interrupts after it.

    The block has no effect if interrupts are already ignored or handled in another way.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    last = time.monotonic() - REPEAT_WINDOW

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal last
        if time.monotonic() - last < REPEAT_WINDOW:
            return
        last = time.monotonic()
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, handle)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
